//! The kernels on a device.

use super::{constants::source, record::WORDS};
use bevy::render::{
    render_resource::{
        BindGroupLayout, BindGroupLayoutEntries, BindGroupLayoutEntry, ComputePipeline,
        PipelineLayoutDescriptor, RawComputePipelineDescriptor, ShaderModuleDescriptor,
        ShaderSource, ShaderStages,
        binding_types::{
            storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer_sized,
        },
    },
    renderer::RenderDevice,
};
use core::num::NonZeroU64;
use std::sync::LazyLock;

/// The shader source of a substep, of strands and of followers.
pub static SOURCE: LazyLock<String> = LazyLock::new(|| source(SUBSTEP));

/// Its files.
const SUBSTEP: &str = concat!(
    include_str!("wgsl/math.wgsl"),
    include_str!("wgsl/strand.wgsl"),
    include_str!("wgsl/obstacle.wgsl"),
    include_str!("wgsl/limiter.wgsl"),
    include_str!("wgsl/direct.wgsl"),
    include_str!("wgsl/sweep.wgsl"),
    include_str!("wgsl/bonds.wgsl"),
    include_str!("wgsl/air.wgsl"),
    include_str!("wgsl/substep.wgsl"),
    include_str!("wgsl/follow.wgsl"),
);

/// How many kernels and groups there are.
pub(super) const COUNT: usize = 8;
const GROUPS: usize = 6;

/// Entry points with their files and which of [`layouts`] they bind.
pub(super) const KERNELS: [(&str, &str, &[usize]); COUNT] = [
    ("substep", SUBSTEP, &[0, 1]),
    ("present", include_str!("wgsl/present.wgsl"), &[2]),
    ("measure", include_str!("wgsl/measure.wgsl"), &[3]),
    ("set_targets", include_str!("wgsl/targets.wgsl"), &[4, 1]),
    ("set_root_targets", include_str!("wgsl/targets.wgsl"), &[4, 1]),
    ("follow", SUBSTEP, &[0, 1]),
    ("sleep", include_str!("wgsl/sleep.wgsl"), &[5, 1]),
    ("sweep", SUBSTEP, &[0, 1]),
];

/// The groups that kernels bind, with their labels: a hair, a record, what packing, measuring,
/// targets and sleep bind.
pub(super) fn layouts() -> [(&'static str, Vec<BindGroupLayoutEntry>); GROUPS] {
    const STAGE: ShaderStages = ShaderStages::COMPUTE;
    let read = || storage_buffer_read_only_sized(false, None);
    let write = || storage_buffer_sized(false, None);
    let frame = uniform_buffer_sized(false, None);
    let record = uniform_buffer_sized(true, NonZeroU64::new(4 * WORDS as u64));
    let hair = (read(), read(), write(), write(), write(), write(), write(), write());
    let drawn = (read(), read(), read(), read(), read(), read(), write(), frame);
    let measured = (read(), read(), read(), write());
    let targets = (read(), write(), write());
    let still = (read(), read(), write(), write());
    [
        ("hair", BindGroupLayoutEntries::sequential(STAGE, hair).to_vec()),
        ("hair substep", BindGroupLayoutEntries::single(STAGE, record).to_vec()),
        ("drawn hair", BindGroupLayoutEntries::sequential(STAGE, drawn).to_vec()),
        ("measured hair", BindGroupLayoutEntries::sequential(STAGE, measured).to_vec()),
        ("kinematic targets", BindGroupLayoutEntries::sequential(STAGE, targets).to_vec()),
        ("still hair", BindGroupLayoutEntries::sequential(STAGE, still).to_vec()),
    ]
}

/// The kernels on a device.
#[derive(Clone, Debug)]
pub struct HairKernels {
    /// What a substep binds: a hair, and a record.
    pub(super) hair: BindGroupLayout,
    pub(super) record: BindGroupLayout,
    pub(super) substep: ComputePipeline,
    /// The same of strands that the paper's projections solve.
    pub(super) sweep: ComputePipeline,
    /// What packing binds.
    pub(super) drawn: BindGroupLayout,
    pub(super) present: ComputePipeline,
    /// What measuring binds.
    pub(super) measured: BindGroupLayout,
    pub(super) measure: ComputePipeline,
    /// What writing targets binds beside a record.
    pub(super) targets: BindGroupLayout,
    pub(super) set_targets: ComputePipeline,
    pub(super) set_root_targets: ComputePipeline,
    /// Binds what a substep does.
    pub(super) follow: ComputePipeline,
    /// What sleep binds beside a record.
    pub(super) still: BindGroupLayout,
    pub(super) sleep: ComputePipeline,
}

impl HairKernels {
    /// Compiles the kernels, which takes a while.
    pub fn new(device: &RenderDevice) -> Self {
        let layouts =
            layouts().map(|(label, entries)| device.create_bind_group_layout(label, &entries[..]));
        let pipelines = KERNELS.map(|(name, files, groups)| {
            let groups: Vec<_> = groups.iter().map(|group| &layouts[*group]).collect();
            pipeline(device, name, &source(files), &groups)
        });
        Self::of(layouts, pipelines)
    }

    /// The same with another substep, for tests of what it is made of: source with the bindings and entry
    /// points of [`SOURCE`].
    pub fn with_substep(self, device: &RenderDevice, source: &str) -> Self {
        let substep = pipeline(device, "substep", source, &[&self.hair, &self.record]);
        Self { substep, ..self }
    }

    /// Of what [`layouts`] and [`KERNELS`] list.
    pub(super) fn of(
        layouts: [BindGroupLayout; GROUPS],
        pipelines: [ComputePipeline; COUNT],
    ) -> Self {
        let [hair, record, drawn, measured, targets, still] = layouts;
        let [substep, present, measure, set_targets, set_root_targets, follow, sleep, sweep] =
            pipelines;
        Self {
            hair,
            record,
            substep,
            sweep,
            drawn,
            present,
            measured,
            measure,
            targets,
            set_targets,
            set_root_targets,
            follow,
            still,
            sleep,
        }
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
