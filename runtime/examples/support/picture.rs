//! A device, targets of half floats, and what is on them as a PNG.

use anyhow::Result;
use diaphane_formats::picture::{Display, Picture, write_png};
use diaphane_runtime::gpu::{Renderer, read_texture};
use diaphane_runtime::wgpu;
use half::f16;
use std::path::Path;

/// Any adapter's device, with the features that make splatting faster.
pub fn device() -> Result<(wgpu::Device, wgpu::Queue)> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let required_features = adapter.features() & Renderer::FEATURES;
    let descriptor = wgpu::DeviceDescriptor { required_features, ..Default::default() };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}

/// A texture to draw to and read from.
pub fn target(device: &wgpu::Device, size: [u32; 2], format: wgpu::TextureFormat) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::COPY_SRC
            | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

/// A texture of four half floats a pixel as a PNG, with an exposure that suits it.
pub fn save(device: &wgpu::Device, queue: &wgpu::Queue, target: &wgpu::Texture, path: &Path) -> Result<()> {
    let mut picture = Picture::new(target.width() as usize, target.height() as usize);
    let half = |b: &[u8]| f16::from_le_bytes([b[0], b[1]]).to_f32();
    for (pixel, texel) in picture.pixels.iter_mut().zip(read_texture(device, queue, target)?.chunks_exact(8))
    {
        *pixel = [half(&texel[0..]), half(&texel[2..]), half(&texel[4..])];
    }
    Ok(write_png(path, &picture, Display::automatic(&picture))?)
}
