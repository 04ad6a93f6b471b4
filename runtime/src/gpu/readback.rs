//! Buffers and textures back to the program. Waits for the device.

use super::bindings::empty_buffer;
use super::faults::wait;
use crate::{Error, Result};
use std::sync::mpsc;
use wgpu::{
    Buffer, BufferUsages, BufferView, CommandEncoder, Device, MapMode, Queue, TexelCopyBufferInfo,
    TexelCopyBufferLayout, Texture,
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

/// Buffers that bytes of the device come back in, kept from frame to frame.
#[derive(Default)]
pub(super) struct Staging {
    kept: Vec<Buffer>,
    /// Bytes that are used of the first ones.
    used: Vec<u64>,
}

impl Staging {
    /// Records copies of the first bytes of some buffers. They may be read when they were submitted.
    pub fn record(&mut self, device: &Device, encoder: &mut CommandEncoder, sources: &[(&Buffer, u64)]) {
        self.used = sources.iter().map(|(_, size)| *size).collect();
        for (k, (source, size)) in sources.iter().enumerate() {
            let kept = self.kept.get(k).filter(|kept| kept.size() >= *size);
            let to = kept.cloned().unwrap_or_else(|| empty_buffer(device, "staging", *size, MAPPABLE));
            encoder.copy_buffer_to_buffer(source, 0, &to, 0, *size);
            if k < self.kept.len() {
                self.kept[k] = to;
            } else {
                self.kept.push(to);
            }
        }
    }

    /// Waits for the device, and hands on what was copied, in the same order.
    ///
    /// # Errors
    /// The device failed; nothing is kept then.
    pub fn read(&mut self, device: &Device, take: impl FnOnce(&[BufferView])) -> Result<()> {
        let read = self.read_kept(device, take);
        if read.is_err() {
            *self = Self::default();
        }
        read
    }

    fn read_kept(&self, device: &Device, take: impl FnOnce(&[BufferView])) -> Result<()> {
        let copies = &self.kept[..self.used.len()];
        map(device, copies)?;
        let view = |(copy, size): (&Buffer, &u64)| copy.get_mapped_range(..*size);
        let views: std::result::Result<Vec<_>, _> = copies.iter().zip(&self.used).map(view).collect();
        take(&views.map_err(|e| Error::Gpu(format!("cannot read the picture back: {e}")))?);
        copies.iter().for_each(Buffer::unmap);
        Ok(())
    }
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
