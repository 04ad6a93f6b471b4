//! Short ways to say what wgpu wants at length: layouts, bind groups, buffers and pipelines.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindGroupLayoutDescriptor,
    BindGroupLayoutEntry, BindingResource, BindingType, Buffer, BufferBindingType, BufferDescriptor,
    BufferUsages, ComputePipeline, ComputePipelineDescriptor, Device, PipelineCompilationOptions,
    PipelineLayout, PipelineLayoutDescriptor, ShaderModule, ShaderStages, TextureSampleType,
    TextureViewDimension,
};

/// What a shader sees at a binding.
#[derive(Clone, Copy, Debug)]
pub(super) enum Slot {
    /// A uniform buffer.
    Uniform,
    /// A uniform buffer whose offset is given when the group is set.
    Moving,
    /// A storage buffer that is read.
    Read,
    /// A storage buffer that is written.
    Write,
    /// A texture of f32 that is loaded from, not filtered.
    Texture,
    /// A depth texture that is loaded from.
    Depth,
}

impl Slot {
    fn binding_type(self) -> BindingType {
        let buffer =
            |ty, has_dynamic_offset| BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None };
        let texture = |sample_type| BindingType::Texture {
            sample_type,
            view_dimension: TextureViewDimension::D2,
            multisampled: false,
        };
        match self {
            Self::Uniform => buffer(BufferBindingType::Uniform, false),
            Self::Moving => buffer(BufferBindingType::Uniform, true),
            Self::Read => buffer(BufferBindingType::Storage { read_only: true }, false),
            Self::Write => buffer(BufferBindingType::Storage { read_only: false }, false),
            Self::Texture => texture(TextureSampleType::Float { filterable: false }),
            Self::Depth => texture(TextureSampleType::Depth),
        }
    }
}

/// A layout with bindings 0, 1, ... for all `stages`. A slot that the fragment stage writes is hidden from the vertex
/// stage, which may not see it.
pub(super) fn layout(device: &Device, label: &str, stages: ShaderStages, slots: &[Slot]) -> BindGroupLayout {
    let entries: Vec<BindGroupLayoutEntry> = slots
        .iter()
        .enumerate()
        .map(|(i, slot)| BindGroupLayoutEntry {
            binding: i as u32,
            visibility: if matches!(slot, Slot::Write) { stages & !ShaderStages::VERTEX } else { stages },
            ty: slot.binding_type(),
            count: None,
        })
        .collect();
    device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: Some(label), entries: &entries })
}

/// A group with `resources` at bindings 0, 1, ...
pub(super) fn group(
    device: &Device,
    label: &str,
    layout: &BindGroupLayout,
    resources: Vec<BindingResource>,
) -> BindGroup {
    let entries: Vec<BindGroupEntry> = resources
        .into_iter()
        .enumerate()
        .map(|(i, resource)| BindGroupEntry { binding: i as u32, resource })
        .collect();
    device.create_bind_group(&BindGroupDescriptor { label: Some(label), layout, entries: &entries })
}

/// The layout of a pass: the common group and its own.
pub(super) fn pipeline_layout(
    device: &Device,
    label: &str,
    common: &BindGroupLayout,
    own: &BindGroupLayout,
) -> PipelineLayout {
    device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some(label),
        bind_group_layouts: &[Some(common), Some(own)],
        immediate_size: 0,
    })
}

/// Constants of a pipeline as overrides of the shader.
pub(super) fn options<'a>(constants: &'a [(&'a str, f64)]) -> PipelineCompilationOptions<'a> {
    // Shaders here write what they share before they read it.
    PipelineCompilationOptions { constants, zero_initialize_workgroup_memory: false }
}

/// A compute pipeline.
pub(super) fn compute(
    device: &Device,
    label: &str,
    layout: &PipelineLayout,
    module: &ShaderModule,
    constants: &[(&str, f64)],
) -> ComputePipeline {
    device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(label),
        layout: Some(layout),
        module,
        entry_point: None,
        compilation_options: options(constants),
        cache: None,
    })
}

/// An uninitialised (zero) buffer of at least 16 bytes.
pub(super) fn empty_buffer(device: &Device, label: &str, size: u64, usage: BufferUsages) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some(label),
        size: size.max(16),
        usage,
        mapped_at_creation: false,
    })
}

/// A buffer that holds `data`; at least 16 bytes, because shaders cannot bind nothing.
pub(super) fn filled_buffer<T: bytemuck::Pod>(
    device: &Device,
    label: &str,
    data: &[T],
    usage: BufferUsages,
) -> Buffer {
    let bytes: &[u8] = bytemuck::cast_slice(data);
    let contents = if bytes.len() < 16 { &[bytes, &[0; 16]].concat() } else { bytes };
    let size = (contents.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
    let descriptor = BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: true };
    let buffer = device.create_buffer(&descriptor);
    // Without memory or device nothing is mapped; whoever listens to the device has heard of it.
    if let Ok(mut mapped) = buffer.get_mapped_range_mut(..) {
        mapped.slice(..contents.len()).copy_from_slice(contents);
        drop(mapped);
        buffer.unmap();
    }
    buffer
}

/// Most bytes of a buffer that a shader sees.
pub(super) fn most_bound(device: &Device) -> u64 {
    let limits = device.limits();
    limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
}
