//! The resolve pass: inside pieces of every pixel join the picture.

use super::super::asset::AssetBuffers;
use super::super::bindings::{Slot, compute, group, layout, pipeline_layout};
use super::super::shaders;
use super::super::splatting::SplatPath;
use super::super::targets::{ARGUMENTS, OVER_CELLS, Targets};
use super::super::timers::Pass;
use super::Recorder;
use wgpu::{BindGroup, BindGroupLayout, BindingResource, ComputePipeline, Device, ShaderStages};

/// See resolve.wgsl.
#[derive(Clone)]
pub(crate) struct Resolve {
    layout: BindGroupLayout,
    pipeline: ComputePipeline,
    /// Whether tiles kept the sums, or quads blended them.
    kept: bool,
    /// Pieces that a dispatch joins.
    pieces: usize,
}

impl Resolve {
    pub fn new(device: &Device, common: &BindGroupLayout, asset: &AssetBuffers, kept: bool) -> Self {
        use Slot::{Read, Texture, Write};
        let sums = if kept { &[Read][..] } else { &[Texture, Texture] };
        let slots = [&[Read, Read, Write, Write, Write], sums].concat();
        let layout = layout(device, "resolve", ShaderStages::COMPUTE, &slots);
        let source = if kept { shaders::RESOLVE_KEPT } else { shaders::RESOLVE_BLENDED };
        let pipeline_layout = pipeline_layout(device, "resolve", common, &layout);
        let module = shaders::module(device, "resolve", source);
        let pieces = if kept { asset.pieces_at_once(SplatPath::Tiles) } else { 1 };
        let heterogeneous = f64::from(u8::from(asset.heterogeneous));
        let constants = [("HETEROGENEOUS", heterogeneous), ("PIECES", pieces as f64)];
        let pipeline = compute(device, "resolve", &pipeline_layout, &module, &constants);
        Self { layout, pipeline, kept, pieces }
    }

    pub fn bind(&self, device: &Device, targets: &Targets, piece: usize) -> BindGroup {
        let t = targets;
        let mut resources = vec![t.pieces(piece, self.pieces)];
        resources.extend([&t.profile, &t.front, &t.radiance, &t.counters].map(|b| b.as_entire_binding()));
        if self.kept {
            resources.push(t.kept.as_entire_binding());
        } else {
            resources.extend([&t.numerator, &t.denominator].map(BindingResource::TextureView));
        }
        group(device, "resolve", &self.layout, resources)
    }

    /// Does nothing where no pixel has this piece; joins those behind it too where one dispatch does several.
    pub fn record(&self, r: &mut Recorder, group: &BindGroup, targets: &Targets, piece: usize) {
        let at = ARGUMENTS * piece as u64 + OVER_CELLS;
        r.compute(Pass::Resolve, &self.pipeline, group, |pass| {
            pass.dispatch_workgroups_indirect(&targets.arguments, at);
        });
    }
}
