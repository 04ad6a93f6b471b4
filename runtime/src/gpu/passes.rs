//! The passes: pipelines, and the commands of each.

pub(super) mod batches;
pub(super) mod boundary;
pub(super) mod clip;
pub(super) mod compose;
pub(super) mod display;
pub(super) mod fold;
pub(super) mod gather;
pub(super) mod lighting;
pub(super) mod limits;
pub(super) mod outlines;
pub(super) mod overlay;
pub(super) mod profile;
pub(super) mod publish;
pub(super) mod resolve;
pub(super) mod segments;
pub(super) mod slopes;
pub(super) mod splat;
pub(super) mod surface;

use wgpu::{BindGroup, Buffer, CommandEncoder, ComputePassDescriptor, ComputePipeline};

use super::lot::Lot;
use super::shard::Shard;
use super::timers::{Pass, Timers};

/// What a pass is recorded with: the command buffer, the shared group and the rays' place in it.
pub(super) struct Recorder<'a> {
    pub encoder: &'a mut CommandEncoder,
    pub timers: &'a mut Timers,
    /// One for each of the object's shards, of which passes that mind no samples take the first.
    pub common: &'a [BindGroup],
    /// Of the first view.
    pub view_offset: u32,
    /// The tiles that are drawn; the targets may be larger.
    pub lot: Lot,
}

impl Recorder<'_> {
    /// Workgroups of 8 × 8 that cover each of the tiles.
    fn pixel_groups(&self) -> [u32; 3] {
        let [x, y] = self.lot.size.map(|n| n.div_ceil(8));
        [x, y, self.lot.count]
    }

    /// Clears what a buffer keeps for the tiles, so many bytes a pixel.
    fn clear_pixels(&mut self, buffer: &Buffer, bytes: u64) {
        self.encoder.clear_buffer(buffer, 0, Some(bytes * self.lot.pixels));
    }

    /// Points a render pass at tiles up to a size and the shared group.
    fn aim(
        common: &[BindGroup],
        view_offset: u32,
        [width, height]: [u32; 2],
        render: &mut wgpu::RenderPass<'_>,
    ) {
        render.set_viewport(0.0, 0.0, width as f32, height as f32, 0.0, 1.0);
        render.set_bind_group(0, &common[0], &[view_offset]);
    }

    /// Runs a compute pass over the tiles' pixels that no timer watches.
    fn over_pixels(&mut self, label: &str, pipeline: &ComputePipeline, group: &BindGroup) {
        let [x, y, z] = self.pixel_groups();
        let mut compute = self
            .encoder
            .begin_compute_pass(&ComputePassDescriptor { label: Some(label), timestamp_writes: None });
        compute.set_pipeline(pipeline);
        compute.set_bind_group(0, &self.common[0], &[self.view_offset]);
        compute.set_bind_group(1, group, &[]);
        compute.dispatch_workgroups(x, y, z);
    }

    /// Runs a compute pass; `dispatch` starts its workgroups.
    fn compute(
        &mut self,
        pass: Pass,
        pipeline: &ComputePipeline,
        group: &BindGroup,
        dispatch: impl Fn(&mut wgpu::ComputePass<'_>),
    ) {
        self.over_shards(pass, pipeline, std::slice::from_ref(group), |pass, _| dispatch(pass));
    }

    /// The same for each shard, which has a group of its own; `dispatch` gets its index.
    fn over_shards(
        &mut self,
        pass: Pass,
        pipeline: &ComputePipeline,
        groups: &[BindGroup],
        dispatch: impl Fn(&mut wgpu::ComputePass<'_>, usize),
    ) {
        let mut compute = self.encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some(pass.name()),
            timestamp_writes: self.timers.compute(pass),
        });
        compute.set_pipeline(pipeline);
        for (k, (common, group)) in self.common.iter().zip(groups).enumerate() {
            compute.set_bind_group(0, common, &[self.view_offset]);
            compute.set_bind_group(1, group, &[]);
            dispatch(&mut compute, k);
        }
    }

    /// The same with a thread for every sample of every object.
    fn over_samples(
        &mut self,
        pass: Pass,
        pipeline: &ComputePipeline,
        groups: &[BindGroup],
        shards: &[Shard],
    ) {
        let count = self.lot.count;
        self.over_shards(pass, pipeline, groups, |pass, k| {
            let [columns, rows] = shards[k].sample_groups();
            pass.dispatch_workgroups(columns, rows, count);
        });
    }
}
