//! Buffers that follow the frame: its rays and its lights.

use super::asset::AssetBuffers;
use super::bindings::{Slot, empty_buffer, group, layout};
use super::uniforms::{LightRecord, TableUse, ViewUniform};
use crate::cpu::lighting::Lighting;
use crate::exact::{ExactDepths, Known};
use crate::fold::{Ambient, Linear, Plan};
use crate::frame::Frame;
use crate::{Error, Result};
use glam::Vec3;
use half::f16;
use std::collections::{HashMap, HashSet};
use wgpu::{BindGroup, BindGroupLayout, Buffer, BufferBinding, BufferUsages, Device, Queue, ShaderStages};

/// Distance between two rays' uniforms: the largest alignment that an adapter may ask for.
pub(super) const VIEW_STRIDE: u64 = 256;

/// Buffers that follow the frame. They grow when they must; [`Self::changed`] then tells that groups are stale.
pub(super) struct FrameBuffers {
    views: Buffer,
    pub lights: Buffer,
    pub exact: Buffer,
    /// Which table is in which part of it.
    slots: Vec<Option<u64>>,
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
            slots: Vec::new(),
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
        let plan = &self.plan;
        let others = (0..frame.scene_lights).filter(|l| plan.single.binary_search(l).is_err());
        let order: Vec<usize> = plan.order.iter().copied().chain(others).collect();
        self.first_scene_light = plan.environment as u32;
        let folded: Vec<bool> = order.iter().map(|l| plan.is_folded(*l)).collect();
        let samples = asset.sample_count as usize;
        let tables: Vec<Option<Words>> =
            order.iter().map(|l| Words::of(exact?.known(*l)?, samples)).collect();
        let limits = device.limits();
        let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
        let size = 8 * (samples * tables.iter().flatten().count()) as u64;
        let lights = (order.len() * size_of::<LightRecord>()) as u64;
        if size > most || lights > most {
            return Err(Error::Gpu(format!(
                "{} lights with exact depths for {samples} samples do not fit the adapter's buffers ({} MiB)",
                tables.iter().flatten().count(),
                most >> 20
            )));
        }
        let slots = self.upload(device, queue, samples, &tables);
        let record = |((l, slot), (table, folded)): ((&usize, u32), (&Option<Words>, bool))| {
            let table = table.as_ref().map(|t| TableUse { slot, share: t.share });
            LightRecord::new(&frame.lights[*l], table, !folded)
        };
        let records: Vec<LightRecord> =
            order.iter().zip(slots).zip(tables.iter().zip(folded)).map(record).collect();
        self.changed |= grow(device, &mut self.lights, "lights", lights);
        if !records.is_empty() {
            queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&records));
        }
        Ok(())
    }

    /// Sees that all tables are in the buffer, those that are there already where they are. Returns the slot of each, 0 where there
    /// is none.
    fn upload(
        &mut self,
        device: &Device,
        queue: &Queue,
        samples: usize,
        tables: &[Option<Words>],
    ) -> Vec<u32> {
        let wanted: HashSet<u64> = tables.iter().flatten().map(|t| t.id).collect();
        let needed = 8 * (samples * wanted.len()) as u64;
        if grow(device, &mut self.exact, "exact", needed) {
            self.changed = true;
            self.slots.clear();
        }
        let room = (self.exact.size() as usize).checked_div(8 * samples).unwrap_or(0);
        self.slots.resize(room, None);
        let (mut known, mut free) = (HashMap::new(), Vec::new());
        for (slot, table) in self.slots.iter().enumerate() {
            match table.filter(|id| wanted.contains(id)) {
                Some(id) => drop(known.insert(id, slot)),
                None => free.push(slot),
            }
        }
        let mut slots = vec![0; tables.len()];
        for (place, table) in slots.iter_mut().zip(tables) {
            let Some(table) = table else { continue };
            // There are as many slots as tables: where one is not there, one is free.
            let Some(slot) = known.get(&table.id).copied().or_else(|| free.pop()) else { continue };
            if known.insert(table.id, slot).is_none() {
                queue.write_buffer(&self.exact, (8 * samples * slot) as u64, table.bytes);
                self.slots[slot] = Some(table.id);
            }
            *place = slot as u32;
        }
        slots
    }
}

/// A table as it is uploaded, eight bytes a sample.
struct Words<'a> {
    id: u64,
    bytes: &'a [u8],
    /// See [`TableUse`].
    share: f32,
}

impl<'a> Words<'a> {
    /// `None` where the table is not for so many samples.
    fn of(known: &'a Known, samples: usize) -> Option<Self> {
        let words = match known {
            Known::Exact(t) => Self { id: t.id(), bytes: bytemuck::cast_slice(t.values()), share: 1.0 },
            Known::Corrected { by, share } => {
                Self { id: by.id(), bytes: bytemuck::cast_slice(by.values()), share: *share }
            }
        };
        (words.bytes.len() == 8 * samples).then_some(words)
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
                self.plan.unfold(frame, &asset.info);
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
