//! Buffers and textures back to the program. Waits for the device.

use super::bindings::empty_buffer;
use super::faults::wait;
use crate::{Error, Result};
use std::sync::mpsc;
use wgpu::{
    Buffer, BufferUsages, CommandEncoder, Device, MapMode, Queue, TexelCopyBufferInfo, TexelCopyBufferLayout,
    Texture,
};

const MAPPABLE: BufferUsages = BufferUsages::MAP_READ.union(BufferUsages::COPY_DST);

/// Copies of the first bytes of some buffers, mapped.
///
/// # Errors
/// The device failed.
pub(super) fn buffers(device: &Device, queue: &Queue, sources: &[(&Buffer, u64)]) -> Result<Vec<Buffer>> {
    let mut encoder = device.create_command_encoder(&Default::default());
    let copies: Vec<Buffer> =
        sources.iter().map(|(source, size)| copy(device, &mut encoder, source, *size)).collect();
    queue.submit([encoder.finish()]);
    map(device, &copies)?;
    Ok(copies)
}

/// Records a copy that can be mapped when it is done.
pub(super) fn copy(device: &Device, encoder: &mut CommandEncoder, source: &Buffer, size: u64) -> Buffer {
    let copy = empty_buffer(device, "copy", size, MAPPABLE);
    encoder.copy_buffer_to_buffer(source, 0, &copy, 0, size);
    copy
}

/// All texels of a texture, rows one after the other without gaps.
///
/// # Errors
/// The device failed.
pub fn texture(device: &Device, queue: &Queue, texture: &Texture) -> Result<Vec<u8>> {
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    let row = texel * texture.width();
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = empty_buffer(device, "copy", u64::from(padded) * u64::from(texture.height()), MAPPABLE);
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        TexelCopyBufferInfo {
            buffer: &buffer,
            layout: TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None },
        },
        texture.size(),
    );
    queue.submit([encoder.finish()]);
    map(device, std::slice::from_ref(&buffer))?;
    let view =
        buffer.get_mapped_range(..).map_err(|e| Error::Gpu(format!("cannot read a picture back: {e}")))?;
    Ok(view.chunks_exact(padded as usize).flat_map(|r| &r[..row as usize]).copied().collect())
}

/// Maps buffers for reading once everything submitted is done.
fn map(device: &Device, copies: &[Buffer]) -> Result<()> {
    let (done, results) = mpsc::channel();
    for copy in copies {
        let done = done.clone();
        // Nobody listens any more only when an earlier copy failed already.
        copy.map_async(MapMode::Read, .., move |result| drop(done.send(result)));
    }
    wait(device)?;
    for _ in copies {
        let failed = || Error::Gpu("the device did not hand the picture back".to_owned());
        results.try_recv().map_err(|_| failed())?.map_err(|_| failed())?;
    }
    Ok(())
}
