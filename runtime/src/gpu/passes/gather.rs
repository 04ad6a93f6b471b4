//! The gather pass: every sample's kernel along the inside pieces of every pixel, tile by tile, and the result added to
//! the picture.

use super::super::asset::{AssetBuffers, Variant};
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::shard::Shard;
use super::super::splatting::SplatPath;
use super::super::targets::{ARGUMENTS, OVER_TILES, Targets};
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{
    BindGroup, BindGroupLayout, ComputePipeline, Device, Features, PipelineLayout, ShaderModule, ShaderStages,
};

/// See gather.wgsl.
#[derive(Clone)]
pub(crate) struct Gather {
    layout: BindGroupLayout,
    pipeline_layout: PipelineLayout,
    module: ShaderModule,
    variant: Variant,
    pipeline: ComputePipeline,
    /// Whether sums are kept for the resolve pass.
    kept: bool,
    /// Pieces that a dispatch sums.
    pieces: usize,
    /// Halves of its square of pixels that a workgroup has.
    halves: u32,
}

impl Gather {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers, kept: bool) -> Self {
        use Slot::{Read, Write};
        let slots = [Read, Read, Read, Read, Read, Write, Write, Write];
        let slots = if kept { &slots[..6] } else { &slots[..] };
        let layout = layout(device, "gather", ShaderStages::COMPUTE, slots);
        let pipeline_layout = pipeline_layout(device, "gather", common, &layout);
        let lanes = device.features().contains(Features::SUBGROUP);
        let source = match (kept, lanes) {
            (false, true) => shaders::GATHER_BY_LANES,
            (false, false) => shaders::GATHER_PLAINLY,
            (true, true) => shaders::KEEP_BY_LANES,
            (true, false) => shaders::KEEP_PLAINLY,
        };
        let module = shaders::module(device, "gather", source);
        let variant = asset.variant();
        let pieces = asset.pieces_at_once(SplatPath::Tiles);
        // Slices are for few squares, whose workgroups had better be many than large.
        let halves = if kept && !asset.pixel_state().kept { 1 } else { 2 };
        let pipeline = Self::pipeline(device, &pipeline_layout, &module, variant, pieces, halves);
        Self { layout, pipeline_layout, module, variant, pipeline, kept, pieces, halves }
    }

    /// Compiles the pass anew where another material needs other code.
    pub fn set_variant(&mut self, device: &Device, variant: Variant) {
        if variant != self.variant {
            self.variant = variant;
            let Self { pipeline_layout, module, pieces, halves, .. } = &*self;
            self.pipeline = Self::pipeline(device, pipeline_layout, module, variant, *pieces, *halves);
        }
    }

    fn pipeline(
        device: &Device,
        layout: &PipelineLayout,
        module: &ShaderModule,
        variant: Variant,
        pieces: usize,
        halves: u32,
    ) -> ComputePipeline {
        let own = [("PIECES", pieces as f64), ("HALVES", f64::from(halves))];
        let constants = [&variant.constants()[..], &own].concat();
        compute(device, "gather", layout, module, &constants)
    }

    pub fn bind(&self, device: &Device, shard: &Shard, targets: &Targets, piece: usize) -> BindGroup {
        let t = targets;
        let mut resources = vec![
            shard.samples.as_entire_binding(),
            shard.sources.as_entire_binding(),
            t.tiles(piece),
            t.pieces(piece, self.pieces),
            t.profile.as_entire_binding(),
        ];
        let sums = if self.kept { &[&t.kept][..] } else { &[&t.front, &t.radiance, &t.counters] };
        resources.extend(sums.iter().map(|b| b.as_entire_binding()));
        group(device, "gather", &self.layout, resources)
    }

    /// Does nothing where no pixel has this piece; sums those behind it too where one dispatch does several.
    pub fn record(&self, r: &mut Recorder, groups: &[BindGroup], targets: &Targets, piece: usize) {
        let at = ARGUMENTS * piece as u64 + OVER_TILES;
        r.over_shards(Pass::Splat, &self.pipeline, groups, |pass, _| {
            pass.dispatch_workgroups_indirect(&targets.arguments, at);
        });
    }
}
