//! The gather pass: every sample's kernel along one inside piece of every pixel, tile by tile, and the result added to
//! the picture.

use super::super::asset::{AssetBuffers, Variant};
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
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
}

impl Gather {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers) -> Self {
        use Slot::{Read, Write};
        let slots = [Read, Read, Read, Read, Read, Write, Write, Write];
        let layout = layout(device, "gather", ShaderStages::COMPUTE, &slots);
        let pipeline_layout = pipeline_layout(device, "gather", common, &layout);
        let lanes = device.features().contains(Features::SUBGROUP);
        let source = if lanes { shaders::GATHER_BY_LANES } else { shaders::GATHER_PLAINLY };
        let module = shaders::module(device, "gather", source);
        let variant = asset.variant();
        let pipeline = Self::pipeline(device, &pipeline_layout, &module, variant);
        Self { layout, pipeline_layout, module, variant, pipeline }
    }

    /// Compiles the pass anew where another material needs other code.
    pub fn set_variant(&mut self, device: &Device, variant: Variant) {
        if variant != self.variant {
            self.variant = variant;
            self.pipeline = Self::pipeline(device, &self.pipeline_layout, &self.module, variant);
        }
    }

    fn pipeline(
        device: &Device,
        layout: &PipelineLayout,
        module: &ShaderModule,
        variant: Variant,
    ) -> ComputePipeline {
        compute(device, "gather", layout, module, &variant.constants())
    }

    pub fn bind(&self, device: &Device, asset: &AssetBuffers, targets: &Targets, piece: usize) -> BindGroup {
        let t = targets;
        let resources = vec![
            asset.samples.as_entire_binding(),
            asset.sources.as_entire_binding(),
            t.tiles(piece),
            t.piece(piece),
            t.profile.as_entire_binding(),
            t.front.as_entire_binding(),
            t.radiance.as_entire_binding(),
            t.counters.as_entire_binding(),
        ];
        group(device, "gather", &self.layout, resources)
    }

    /// Does nothing where no pixel has this piece.
    pub fn record(&self, r: &mut Recorder, group: &BindGroup, targets: &Targets, piece: usize) {
        let at = ARGUMENTS * piece as u64 + OVER_TILES;
        r.compute(Pass::Splat, &self.pipeline, group, |pass| {
            pass.dispatch_workgroups_indirect(&targets.arguments, at);
        });
    }
}
