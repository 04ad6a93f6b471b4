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

use super::shard::Shard;
use super::timers::{Pass, Timers};

/// What a pass is recorded with: the command buffer, the shared group and the ray's place in it.
pub(super) struct Recorder<'a> {
    pub encoder: &'a mut CommandEncoder,
    pub timers: &'a mut Timers,
    /// One for each of the object's shards, of which passes that mind no samples take the first.
    pub common: &'a [BindGroup],
    pub view_offset: u32,
    /// Columns and rows of the tile; the targets may be larger.
    pub tile: [u32; 2],
}

impl Recorder<'_> {
    /// Workgroups of 8 × 8 that cover the tile.
    fn pixel_groups(&self) -> [u32; 2] {
        self.tile.map(|n| n.div_ceil(8))
    }

    /// Clears what a buffer keeps for the tile, so many bytes a pixel.
    fn clear_pixels(&mut self, buffer: &Buffer, bytes: u64) {
        let pixels = u64::from(self.tile[0]) * u64::from(self.tile[1]);
        self.encoder.clear_buffer(buffer, 0, Some(bytes * pixels));
    }

    /// Points a render pass at the tile and the shared group.
    fn aim(common: &[BindGroup], view_offset: u32, tile: [u32; 2], render: &mut wgpu::RenderPass<'_>) {
        render.set_viewport(0.0, 0.0, tile[0] as f32, tile[1] as f32, 0.0, 1.0);
        render.set_bind_group(0, &common[0], &[view_offset]);
    }

    /// Runs a compute pass over the tile's pixels that no timer watches.
    fn over_pixels(&mut self, label: &str, pipeline: &ComputePipeline, group: &BindGroup) {
        let [x, y] = self.pixel_groups();
        let mut compute = self
            .encoder
            .begin_compute_pass(&ComputePassDescriptor { label: Some(label), timestamp_writes: None });
        compute.set_pipeline(pipeline);
        compute.set_bind_group(0, &self.common[0], &[self.view_offset]);
        compute.set_bind_group(1, group, &[]);
        compute.dispatch_workgroups(x, y, 1);
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

    /// The same with a thread for every sample, `rounds` times each.
    fn over_samples(
        &mut self,
        pass: Pass,
        pipeline: &ComputePipeline,
        groups: &[BindGroup],
        shards: &[Shard],
        rounds: u32,
    ) {
        self.over_shards(pass, pipeline, groups, |pass, k| {
            let [columns, rows] = shards[k].sample_groups();
            for _ in 0..rounds {
                pass.dispatch_workgroups(columns, rows, 1);
            }
        });
    }
}
