//! Buffers that follow the frame: rays and lights of one or several objects with the same samples.

use super::asset::AssetBuffers;
use super::bindings::{Slot, empty_buffer, group, layout, most_bound};
use super::lot::MOST_VIEWS;
use super::uniforms::{LightLayout, LightRecord, TableUse, ViewUniform};
use crate::cpu::lighting::Lighting;
use crate::exact::{ExactDepths, Known};
use crate::fold::{Ambient, Linear, Plan};
use crate::frame::Frame;
use crate::{Error, Result};
use glam::Vec3;
use half::f16;
use std::collections::{HashMap, HashSet};
use wgpu::{BindGroup, BindGroupLayout, Buffer, BufferBinding, BufferUsages, Device, Queue, ShaderStages};

/// Distance between two views, which is also the largest alignment of uniforms that an adapter may ask for.
pub(super) const VIEW_STRIDE: u64 = size_of::<ViewUniform>() as u64;

/// An object in a frame.
#[derive(Clone, Copy)]
pub(super) struct Object<'a> {
    /// Which part of the values and sources is its own.
    pub slot: usize,
    /// Camera and lights in its coordinates.
    pub frame: &'a Frame,
    /// Exact depths for some of the lights.
    pub exact: Option<&'a ExactDepths>,
}

/// An object whose samples are lit anew.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lit {
    pub slot: usize,
    /// That are evaluated one by one.
    pub lights: usize,
}

/// What became of the lights of the object in a slot when they were written.
#[derive(Default)]
struct Lights {
    plan: Plan,
    /// Share of the lights that baked means serve.
    means: f32,
    /// Tables of depths that it uses.
    tables: Vec<u64>,
}

/// Buffers that follow the frame. They grow when they must; [`Self::take_changed`] then tells that groups are stale.
pub(super) struct FrameBuffers {
    views: Buffer,
    /// Records of the lights of every slot, [`Self::light_stride`] each.
    pub lights: Buffer,
    light_stride: usize,
    pub exact: Buffer,
    /// Which table is in which part of it.
    tables: Vec<Option<u64>>,
    /// Transmittance for folded lights, of the material whose ratio this is.
    pub linear: Buffer,
    known: Option<(Vec3, Linear)>,
    /// What folded lights send, [`Self::ambient_stride`] vectors for every slot.
    pub ambient: Buffer,
    ambient_stride: usize,
    /// One for each shard.
    common: Vec<BindGroup>,
    changed: bool,
    /// By slot.
    objects: Vec<Lights>,
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
        size: wgpu::BufferSize::new(VIEW_STRIDE * MOST_VIEWS as u64),
    });
    let of =
        |medium: &Buffer| group(device, "common", layout, vec![view.clone(), medium.as_entire_binding()]);
    asset.shards.iter().map(|shard| of(&shard.medium)).collect()
}

impl FrameBuffers {
    /// Small buffers to start with.
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        let views =
            empty_buffer(device, "views", views_size(1), BufferUsages::UNIFORM | BufferUsages::COPY_DST);
        Self {
            common: common_groups(device, common, &views, asset),
            views,
            lights: empty_buffer(device, "lights", 64, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            light_stride: 0,
            exact: empty_buffer(device, "exact", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            tables: Vec::new(),
            linear: empty_buffer(device, "linear", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            known: None,
            ambient: empty_buffer(device, "ambient", 16, BufferUsages::STORAGE | BufferUsages::COPY_DST),
            ambient_stride: 0,
            changed: true,
            objects: Vec::new(),
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
        let size = views_size(views.len());
        if self.views.size() < size {
            let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
            self.views = empty_buffer(device, "views", size, usage);
            self.common = common_groups(device, layout, &self.views, asset);
        }
        queue.write_buffer(&self.views, 0, bytemuck::cast_slice(views));
    }

    /// Sees that there is room for the lights of so many slots, so many each. Says whether those that were there are gone.
    pub fn reserve(&mut self, device: &Device, slots: usize, lights: usize) -> Result<bool> {
        if self.objects.len() < slots {
            self.objects.resize_with(slots, Lights::default);
        }
        let bytes = |stride: usize| (slots * stride * size_of::<LightRecord>()) as u64;
        let most = most_bound(device);
        // What there was room for before, unless that is too much by now.
        let known = self.light_stride;
        let stride = if bytes(known.max(lights)) <= most { known.max(lights) } else { lights };
        let size = bytes(stride);
        if size > most {
            return Err(Error::Gpu(format!(
                "{lights} lights of {slots} objects do not fit the adapter's buffers ({} MiB)",
                most >> 20
            )));
        }
        self.light_stride = stride;
        let grown = grow(device, &mut self.lights, "lights", size);
        self.changed |= grown;
        Ok(grown || stride != known)
    }

    /// Forgets which tables objects use that are not drawn now.
    pub fn keep_tables(&mut self, drawn: &[Object<'_>]) {
        for (slot, object) in self.objects.iter_mut().enumerate() {
            if !drawn.iter().any(|d| d.slot == slot) {
                object.tables.clear();
            }
        }
    }

    /// Writes the lights of some objects and the exact depth tables that serve some of them.
    ///
    /// # Errors
    /// The tables are too large for the adapter's buffers.
    pub fn write_lights(
        &mut self,
        device: &Device,
        queue: &Queue,
        asset: &AssetBuffers,
        objects: &[Object<'_>],
    ) -> Result<Vec<Lit>> {
        for object in objects {
            self.objects[object.slot] = Lights {
                plan: Plan::new(object.frame, &asset.info, object.exact),
                means: object.frame.share_of_means(object.exact),
                tables: Vec::new(),
            };
        }
        self.fold(device, queue, asset, objects);
        let orders: Vec<Vec<usize>> = objects.iter().map(|o| self.order(o)).collect();
        let samples = asset.sample_count as usize;
        let tables: Vec<Vec<Option<Words>>> = objects
            .iter()
            .zip(&orders)
            .map(|(o, order)| order.iter().map(|l| Words::of(o.exact?.known(*l)?, samples)).collect())
            .collect();
        for (object, tables) in objects.iter().zip(&tables) {
            self.objects[object.slot].tables = tables.iter().flatten().map(|t| t.id).collect();
        }
        let places = self.upload(device, queue, samples, &tables)?;
        for (object, (order, tables)) in objects.iter().zip(orders.iter().zip(&tables)) {
            let plan = &self.objects[object.slot].plan;
            let record = |(l, table): (&usize, &Option<Words>)| {
                let table = table.as_ref().and_then(|t| places.get(&t.id).map(|p| (*p, t.share)));
                let table = table.map(|(slot, share)| TableUse { slot, share });
                LightRecord::new(&object.frame.lights[*l], table, !plan.is_folded(*l))
            };
            let records: Vec<LightRecord> = order.iter().zip(tables).map(record).collect();
            let start = object.slot * self.light_stride * size_of::<LightRecord>();
            if !records.is_empty() {
                queue.write_buffer(&self.lights, start as u64, bytemuck::cast_slice(&records));
            }
        }
        let lit = |o: &Object| Lit { slot: o.slot, lights: self.objects[o.slot].plan.single.len() };
        Ok(objects.iter().map(lit).collect())
    }

    /// The order of an object's records: lights that are evaluated first, an environment's in front; then the scene's others, for
    /// highlights alone.
    fn order(&self, object: &Object) -> Vec<usize> {
        let plan = &self.objects[object.slot].plan;
        let others = (0..object.frame.scene_lights).filter(|l| plan.single.binary_search(l).is_err());
        plan.order.iter().copied().chain(others).collect()
    }

    /// What the rays of the object in a slot need to know about its lights.
    pub fn layout(&self, slot: usize) -> LightLayout {
        let Lights { plan, means, .. } = &self.objects[slot];
        LightLayout {
            single: plan.single.len() as u32,
            environment: plan.environment as u32,
            negligible: plan.negligible,
            first_scene_light: plan.environment as u32,
            means: *means,
            slot: slot as u32,
            first_light: (slot * self.light_stride) as u32,
            first_ambient: (slot * self.ambient_stride) as u32,
        }
    }

    /// Which lights of the object in a slot are evaluated how.
    pub fn plan(&self, slot: usize) -> Option<&Plan> {
        self.objects.get(slot).map(|o| &o.plan)
    }

    /// Sees that all tables are in the buffer, those that are there already where they are. Returns the part of each.
    fn upload(
        &mut self,
        device: &Device,
        queue: &Queue,
        samples: usize,
        tables: &[Vec<Option<Words>>],
    ) -> Result<HashMap<u64, u32>> {
        let wanted: HashSet<u64> = self.objects.iter().flat_map(|o| &o.tables).copied().collect();
        let needed = 8 * (samples * wanted.len()) as u64;
        let most = most_bound(device);
        if needed > most {
            return Err(Error::Gpu(format!(
                "{} lights with exact depths for {samples} samples do not fit the adapter's buffers ({} MiB)",
                wanted.len(),
                most >> 20
            )));
        }
        if grow(device, &mut self.exact, "exact", needed) {
            self.changed = true;
            self.tables.clear();
        }
        let room = (self.exact.size() as usize).checked_div(8 * samples).unwrap_or(0);
        self.tables.resize(room, None);
        let (mut places, mut free) = (HashMap::new(), Vec::new());
        for (place, table) in self.tables.iter().enumerate() {
            match table.filter(|id| wanted.contains(id)) {
                Some(id) => drop(places.insert(id, place as u32)),
                None => free.push(place),
            }
        }
        for table in tables.iter().flatten().flatten() {
            if places.contains_key(&table.id) {
                continue;
            }
            // There is room for all tables: where one is not there, a part is free.
            let Some(place) = free.pop() else { continue };
            queue.write_buffer(&self.exact, (8 * samples * place) as u64, table.bytes);
            self.tables[place] = Some(table.id);
            places.insert(table.id, place as u32);
        }
        Ok(places)
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
    /// Uploads what the fold pass needs for the lights that the objects' plans fold. Where its coefficients do not fit the adapter
    /// the lights are evaluated one by one.
    fn fold(&mut self, device: &Device, queue: &Queue, asset: &AssetBuffers, objects: &[Object<'_>]) {
        if objects.iter().all(|o| self.objects[o.slot].plan.folded.is_empty()) {
            return;
        }
        let ratio = asset.material.ratio;
        if self.known.as_ref().is_none_or(|(known, _)| *known != ratio) {
            let lighting = Lighting::new(&asset.info, &asset.source);
            let most = most_bound(device);
            let Some(bands) = Linear::fitting(asset.source.len(), lighting.channels(), most) else {
                for object in objects {
                    self.objects[object.slot].plan.unfold(object.frame, &asset.info);
                }
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
        let sent: Vec<Vec<[f32; 4]>> = objects
            .iter()
            .map(|o| sent(o.frame, &self.objects[o.slot].plan, linear, asset.material.mean_cosine))
            .collect();
        // What is there is not needed any more: the pass runs only for objects that are lit anew.
        self.ambient_stride = sent.iter().map(Vec::len).fold(self.ambient_stride, usize::max);
        let size = 16 * (self.ambient_stride * asset.slots) as u64;
        self.changed |= grow(device, &mut self.ambient, "ambient", size);
        for (object, sent) in objects.iter().zip(&sent) {
            let start = 16 * self.ambient_stride * object.slot;
            queue.write_buffer(&self.ambient, start as u64, bytemuck::cast_slice(sent));
        }
    }

    /// Error of the transmittance that folded lights see.
    pub fn fold_error(&self) -> f32 {
        self.known.as_ref().map_or(0.0, |(_, linear)| linear.error)
    }
}

/// What an object's folded lights send, as fold.wgsl reads it.
fn sent(frame: &Frame, plan: &Plan, linear: &Linear, mean_cosine: f32) -> Vec<[f32; 4]> {
    if plan.folded.is_empty() {
        return vec![[0.0; 4]];
    }
    let lights = plan.folded.iter().filter_map(|l| frame.lights.get(*l));
    let ambient = Ambient::new(lights, mean_cosine, frame.view.origin, linear.bands);
    let vectors = ambient.values.len() / ambient.count;
    let header = [ambient.count, vectors, linear.channels, 0].map(|n| f32::from_bits(n as u32));
    std::iter::once(header).chain(ambient.values).collect()
}

/// Bytes of so many views: a binding begins at each of them.
fn views_size(views: usize) -> u64 {
    VIEW_STRIDE * (views + MOST_VIEWS - 1) as u64
}

/// Replaces a storage buffer that is too small; says whether it did.
fn grow(device: &Device, buffer: &mut Buffer, label: &str, size: u64) -> bool {
    let small = buffer.size() < size;
    if small {
        *buffer = empty_buffer(device, label, size, BufferUsages::STORAGE | BufferUsages::COPY_DST);
    }
    small
}
