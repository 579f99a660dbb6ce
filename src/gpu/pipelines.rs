//! The kernels on a device.

use super::record::WORDS;
use bevy::render::{
    render_resource::{
        BindGroupLayout, BindGroupLayoutEntries, ComputePipeline, PipelineLayoutDescriptor,
        RawComputePipelineDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages,
        binding_types::{
            storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer_sized,
        },
    },
    renderer::RenderDevice,
};
use core::num::NonZeroU64;

/// The shader source of a substep, concatenated from its files.
pub const SOURCE: &str = concat!(
    include_str!("wgsl/math.wgsl"),
    include_str!("wgsl/strand.wgsl"),
    include_str!("wgsl/obstacle.wgsl"),
    include_str!("wgsl/limiter.wgsl"),
    include_str!("wgsl/direct.wgsl"),
    include_str!("wgsl/bonds.wgsl"),
    include_str!("wgsl/air.wgsl"),
    include_str!("wgsl/substep.wgsl"),
);

/// The kernels on a device.
#[derive(Clone, Debug)]
pub struct HairKernels {
    /// What a substep binds: a hair, and a record.
    pub(super) hair: BindGroupLayout,
    pub(super) record: BindGroupLayout,
    pub(super) substep: ComputePipeline,
    /// What packing binds.
    pub(super) drawn: BindGroupLayout,
    pub(super) present: ComputePipeline,
}

impl HairKernels {
    /// Compiles the kernels.
    pub fn new(device: &RenderDevice) -> Self {
        let read = || storage_buffer_read_only_sized(false, None);
        let write = || storage_buffer_sized(false, None);
        let hair = device.create_bind_group_layout(
            "hair",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (read(), read(), write(), write(), write(), write(), write(), write()),
            ),
        );
        let size = NonZeroU64::new(4 * WORDS as u64);
        let record = device.create_bind_group_layout(
            "hair substep",
            &BindGroupLayoutEntries::single(
                ShaderStages::COMPUTE,
                uniform_buffer_sized(true, size),
            ),
        );
        let drawn = device.create_bind_group_layout(
            "drawn hair",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    read(),
                    read(),
                    read(),
                    read(),
                    read(),
                    read(),
                    write(),
                    uniform_buffer_sized(false, None),
                ),
            ),
        );
        let substep = pipeline(device, "substep", SOURCE, &[&hair, &record]);
        let present = pipeline(device, "present", include_str!("wgsl/present.wgsl"), &[&drawn]);
        Self { hair, record, substep, drawn, present }
    }
}

/// A pipeline of the entry point of this name.
fn pipeline(
    device: &RenderDevice,
    name: &str,
    source: &str,
    groups: &[&BindGroupLayout],
) -> ComputePipeline {
    let groups: Vec<_> = groups.iter().map(|group| Some(&***group)).collect();
    let layout = device.create_pipeline_layout(&PipelineLayoutDescriptor {
        label: Some(name),
        bind_group_layouts: &groups,
        immediate_size: 0,
    });
    let module = device.create_and_validate_shader_module(ShaderModuleDescriptor {
        label: Some(name),
        source: ShaderSource::Wgsl(source.into()),
    });
    device.create_compute_pipeline(&RawComputePipelineDescriptor {
        label: Some(name),
        layout: Some(&layout),
        module: &module,
        entry_point: Some(name),
        compilation_options: Default::default(),
        cache: None,
    })
}
