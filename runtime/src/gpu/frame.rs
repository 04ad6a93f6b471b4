//! Buffers that follow the frame: its rays and its lights.

use super::asset::AssetBuffers;
use super::bindings::{Slot, empty_buffer, group, layout};
use super::uniforms::{LightRecord, ViewUniform};
use crate::cpu::lighting::Lighting;
use crate::exact::ExactDepths;
use crate::fold::{Ambient, Linear, Plan};
use crate::frame::Frame;
use crate::{Error, Result};
use glam::Vec3;
use half::f16;
use wgpu::{BindGroup, BindGroupLayout, Buffer, BufferBinding, BufferUsages, Device, Queue, ShaderStages};

/// Distance between two rays' uniforms: the largest alignment that an adapter may ask for.
pub(super) const VIEW_STRIDE: u64 = 256;

/// Buffers that follow the frame. They grow when they must; [`Self::changed`] then tells that groups are stale.
pub(super) struct FrameBuffers {
    views: Buffer,
    pub lights: Buffer,
    pub exact: Buffer,
    /// Transmittance for folded lights, of the material whose ratio this is.
    pub linear: Buffer,
    known: Option<(Vec3, Linear)>,
    /// What folded lights send.
    pub ambient: Buffer,
    /// One for each shard.
    common: Vec<BindGroup>,
    changed: bool,
    /// Which lights are evaluated how.
    pub plan: Plan,
    /// Share of the lights that baked means serve.
    pub means: f32,
    /// Place of the scene's first light among the records.
    pub first_scene_light: u32,
}

/// The layout of the group that all passes share: the ray's view and the medium.
pub(super) fn common_layout(device: &Device) -> BindGroupLayout {
    layout(
        device,
        "common",
        ShaderStages::VERTEX_FRAGMENT | ShaderStages::COMPUTE,
        &[Slot::Moving, Slot::Uniform],
    )
}

fn common_groups(
    device: &Device,
    layout: &BindGroupLayout,
    views: &Buffer,
    asset: &AssetBuffers,
) -> Vec<BindGroup> {
    let view = wgpu::BindingResource::Buffer(BufferBinding {
        buffer: views,
        offset: 0,
        size: wgpu::BufferSize::new(size_of::<ViewUniform>() as u64),
    });
    let of =
        |medium: &Buffer| group(device, "common", layout, vec![view.clone(), medium.as_entire_binding()]);
    asset.shards.iter().map(|shard| of(&shard.medium)).collect()
}

impl FrameBuffers {
    /// Small buffers to start with.
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        let views =
            empty_buffer(device, "views", VIEW_STRIDE, BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        Self {
            common: common_groups(device, common, &views, asset),
            views,
            lights: empty_buffer(device, "lights", 64, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            exact: empty_buffer(device, "exact", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            linear: empty_buffer(device, "linear", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            known: None,
            ambient: empty_buffer(device, "ambient", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            changed: true,
            plan: Plan::default(),
            means: 1.0,
            first_scene_light: 0,
        }
    }

    /// Binds another medium.
    pub fn renew(&mut self, device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) {
        self.common = common_groups(device, common, &self.views, asset);
    }

    /// The shared group of each shard; set it with an offset of [`VIEW_STRIDE`] times the view's index.
    pub fn common(&self) -> &[BindGroup] {
        &self.common
    }

    /// Whether a buffer was replaced since the last call.
    pub fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// Writes the views of the rays to come, at multiples of [`VIEW_STRIDE`].
    pub fn write_views(
        &mut self,
        device: &Device,
        queue: &Queue,
        layout: &BindGroupLayout,
        asset: &AssetBuffers,
        views: &[ViewUniform],
    ) {
        let mut bytes = vec![0; views.len() * VIEW_STRIDE as usize];
        for (place, view) in bytes.chunks_exact_mut(VIEW_STRIDE as usize).zip(views) {
            place[..size_of::<ViewUniform>()].copy_from_slice(bytemuck::bytes_of(view));
        }
        if self.views.size() < bytes.len() as u64 {
            let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
            self.views = empty_buffer(device, "views", bytes.len() as u64, usage);
            self.common = common_groups(device, layout, &self.views, asset);
        }
        queue.write_buffer(&self.views, 0, &bytes);
    }

    /// Writes the lights and the exact depth tables that serve some of them.
    ///
    /// # Errors
    /// The tables are too large for the adapter's buffers.
    pub fn write_lights(
        &mut self,
        device: &Device,
        queue: &Queue,
        asset: &AssetBuffers,
        frame: &Frame,
        exact: Option<&ExactDepths>,
    ) -> Result<()> {
        self.means = frame.share_of_means(exact);
        self.plan = Plan::new(frame, &asset.info, exact);
        self.fold(device, queue, asset, frame);
        // Those that are evaluated first, an environment's in front; then the scene's others, for highlights alone.
        let is_single = |l: usize| self.plan.single.binary_search(&l).is_ok();
        let environment = self.plan.single.iter().copied().filter(|l| *l >= frame.scene_lights);
        let scene = self.plan.single.iter().copied().filter(|l| *l < frame.scene_lights);
        let others = (0..frame.scene_lights).filter(|l| !is_single(*l));
        self.first_scene_light = environment.clone().count() as u32;
        let mut tables: Vec<&[[f32; 2]]> = Vec::new();
        let mut records = Vec::with_capacity(frame.lights.len());
        for l in environment.chain(scene).chain(others) {
            let table = exact.and_then(|e| e.light(l)).filter(|t| t.len() == asset.sample_count as usize);
            let slot = table.map(|t| {
                tables.push(t);
                tables.len() as u32 - 1
            });
            records.push(LightRecord::new(&frame.lights[l], slot));
        }
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let table_bytes = 8 * u64::from(asset.sample_count);
        let size = table_bytes * tables.len() as u64;
        if size > most || (records.len() * size_of::<LightRecord>()) as u64 > most {
            return Err(Error::Gpu(format!(
                "{} lights with exact depths for {} samples do not fit the adapter's buffers ({} MiB)",
                tables.len(),
                asset.sample_count,
                most >> 20
            )));
        }
        self.changed |=
            grow(device, &mut self.lights, "lights", (records.len() * size_of::<LightRecord>()) as u64);
        self.changed |= grow(device, &mut self.exact, "exact", size);
        if !records.is_empty() {
            queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&records));
        }
        for (k, table) in tables.iter().enumerate() {
            queue.write_buffer(&self.exact, k as u64 * table_bytes, bytemuck::cast_slice(table));
        }
        Ok(())
    }
}

impl FrameBuffers {
    /// Uploads what the fold pass needs for the lights that the plan folds. Where its coefficients do not fit the adapter
    /// the lights are evaluated one by one.
    fn fold(&mut self, device: &Device, queue: &Queue, asset: &AssetBuffers, frame: &Frame) {
        if self.plan.folded.is_empty() {
            return;
        }
        let ratio = asset.material.ratio;
        if self.known.as_ref().is_none_or(|(known, _)| *known != ratio) {
            let lighting = Lighting::new(&asset.info, &asset.source);
            let limits = device.limits();
            let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
            let Some(bands) = Linear::fitting(asset.source.len(), lighting.channels(), most) else {
                self.plan.single.append(&mut self.plan.folded);
                self.plan.single.sort_unstable();
                return;
            };
            let linear =
                Linear::new(asset.source.len(), bands, lighting.channels(), lighting.order(), |i, to, b| {
                    lighting.arriving(i, to, b)
                });
            let packed: Vec<f16> = linear.values.iter().map(|v| f16::from_f32(*v)).collect();
            self.changed |= grow(device, &mut self.linear, "linear", 2 * packed.len() as u64);
            queue.write_buffer(&self.linear, 0, bytemuck::cast_slice(&packed));
            self.known = Some((ratio, Linear { values: Vec::new(), ..linear }));
        }
        let Some((_, linear)) = &self.known else { return };
        let lights = self.plan.folded.iter().filter_map(|l| frame.lights.get(*l));
        let ambient = Ambient::new(lights, asset.material.mean_cosine, frame.view.origin, linear.bands);
        let vectors = ambient.values.len() / ambient.count;
        let header = [ambient.count, vectors, linear.channels, 0].map(|n| f32::from_bits(n as u32));
        let bytes: Vec<[f32; 4]> = std::iter::once(header).chain(ambient.values).collect();
        self.changed |= grow(device, &mut self.ambient, "ambient", 16 * bytes.len() as u64);
        queue.write_buffer(&self.ambient, 0, bytemuck::cast_slice(&bytes));
    }

    /// Error of the transmittance that folded lights see.
    pub fn fold_error(&self) -> f32 {
        self.known.as_ref().map_or(0.0, |(_, linear)| linear.error)
    }
}

/// Replaces a storage buffer that is too small; says whether it did.
fn grow(device: &Device, buffer: &mut Buffer, label: &str, size: u64) -> bool {
    let small = buffer.size() < size;
    if small {
        *buffer = empty_buffer(device, label, size, BufferUsages::STORAGE | BufferUsages::COPY_DST);
    }
    small
}
