//! Expands strands once a frame on the GPU: every ring of every strand that is drawn, into a buffer that
//! all passes read.

use super::{
    buffers::HairBuffers,
    draw::Packed,
    kernel::{Groups, Kernel, has_compute},
    material::Ribbon,
    packed_frame::DrawnFrame,
    rings::{Broken, Rings},
    sets::{HairRenderSystems, WritesNodes},
};
use bevy::{
    asset::load_embedded_asset,
    camera::visibility::ViewVisibility,
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        Extract, ExtractSchedule, RenderApp, RenderStartup,
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            BindingResource, Buffer, BufferId, ComputePassDescriptor, DynamicUniformBuffer,
            PipelineCache, ShaderStages,
            binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer},
        },
        renderer::{
            RenderAdapter, RenderContext, RenderDevice, RenderGraph, RenderGraphSystems,
            RenderQueue,
        },
        storage::{GpuShaderBuffer, ShaderBuffer},
    },
};
use core::sync::atomic::Ordering;

/// `@workgroup_size` of `expand.wgsl`.
const WORKGROUP_SIZE: u32 = 64;

pub(super) fn plugin(app: &mut App) {
    let broken = Broken::default();
    app.insert_resource(broken.clone());
    let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
    render
        .insert_resource(broken)
        .init_resource::<Expansions>()
        .add_systems(RenderStartup, compile)
        .add_systems(ExtractSchedule, extract.in_set(HairRenderSystems))
        .add_systems(
            RenderGraph,
            expand.in_set(RenderGraphSystems::Render).after(WritesNodes).before(camera_driver),
        );
}

#[derive(Resource)]
pub(super) struct Expander(Kernel);

fn compile(
    mut commands: Commands,
    assets: Res<AssetServer>,
    pipelines: Res<PipelineCache>,
    adapter: Res<RenderAdapter>,
) {
    if !has_compute(&adapter) {
        return;
    }
    let read = || storage_buffer_read_only_sized(false, None);
    let layout = BindGroupLayoutDescriptor::new(
        "hair rings",
        &BindGroupLayoutEntries::with_indices(
            ShaderStages::COMPUTE,
            (
                (0, uniform_buffer::<Ribbon>(true)),
                (1, read()),
                (2, read()),
                (3, read()),
                (5, read()),
                (6, storage_buffer_sized(false, None)),
            ),
        ),
    );
    let shader = load_embedded_asset!(&*assets, "expand.wgsl");
    commands.insert_resource(Expander(Kernel::queue(
        &pipelines,
        shader,
        "expand",
        layout,
        Vec::new(),
    )));
}

/// The hair that is seen in this frame.
#[derive(Resource, Default)]
pub(super) struct Expansions {
    hairs: Vec<Expansion>,
    ribbons: DynamicUniformBuffer<Ribbon>,
    /// By the buffers that each binds.
    groups: Groups<[BufferId; 6], BindGroup>,
}

pub(super) struct Expansion {
    /// Nodes, guides, strands, frame, rings.
    pub(super) buffers: [AssetId<ShaderBuffer>; 5],
    ribbon: Ribbon,
    /// Where that lies among those of the frame (bytes).
    pub(super) offset: u32,
    pub(super) rings: Rings,
    /// Its grid, and the number of cells along a side.
    pub(super) volume: Option<(AssetId<Image>, u32)>,
}

impl Expansions {
    pub(super) fn hairs(&self) -> &[Expansion] {
        &self.hairs
    }

    /// The ribbons of the frame, once they have been written.
    pub(super) fn ribbons(&self) -> Option<(&Buffer, BindingResource<'_>)> {
        self.ribbons.buffer().zip(self.ribbons.binding())
    }
}

fn extract(
    hairs: Extract<Query<(&HairBuffers, &Packed, &DrawnFrame)>>,
    drawn: Extract<Query<&ViewVisibility>>,
    mut expansions: ResMut<Expansions>,
) {
    expansions.hairs.clear();
    let seen =
        hairs.iter().filter(|(hair, ..)| drawn.get(hair.drawn).is_ok_and(|drawn| drawn.get()));
    expansions.hairs.extend(seen.filter_map(|(hair, packed, drawn)| {
        let HairBuffers { nodes, guides, strands, frame, rings: ring, .. } = hair;
        Some(Expansion {
            buffers: [nodes.id(), guides.id(), strands.id(), frame.id(), ring.as_ref()?.id()],
            ribbon: packed.ribbon,
            offset: 0,
            rings: packed.rings,
            volume: packed.volume.as_ref().map(|(image, _)| (image.id(), drawn.volume.side)),
        })
    }));
}

pub(super) fn expand(
    mut expansions: ResMut<Expansions>,
    (expander, broken): (Option<Res<Expander>>, Res<Broken>),
    pipelines: Res<PipelineCache>,
    buffers: Option<Res<RenderAssets<GpuShaderBuffer>>>,
    (device, queue): (Res<RenderDevice>, Res<RenderQueue>),
    mut context: RenderContext,
) {
    let Expansions { hairs, ribbons, groups } = &mut *expansions;
    if device.is_changed() {
        // What a lost device held is gone.
        (*ribbons, *groups) = default();
    }
    let (Some(expander), Some(buffers)) = (expander, buffers) else { return };
    let Some(pipeline) = expander.0.ready(&pipelines) else {
        if let Some(error) = expander.0.why_broken(&pipelines)
            && !broken.0.swap(true, Ordering::Relaxed)
        {
            tracing::error!("strands of hair are expanded vertex by vertex: {error}");
        }
        return;
    };
    groups.begin_frame();
    if hairs.is_empty() {
        return;
    }
    ribbons.clear();
    for hair in hairs.iter_mut() {
        hair.offset = ribbons.push(&hair.ribbon);
    }
    ribbons.write_buffer(&device, &queue);
    let Some((uniform, ribbon)) = ribbons.buffer().zip(ribbons.binding()) else { return };
    let most = device.limits().max_compute_workgroups_per_dimension;
    let diagnostics = context.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = context
        .command_encoder()
        .begin_compute_pass(&ComputePassDescriptor { label: Some("hair rings"), ..default() });
    let span = diagnostics.pass_span(&mut pass, "hair, rings");
    pass.set_pipeline(pipeline);
    for hair in hairs.iter() {
        let gpu = hair.buffers.map(|id| buffers.get(id).map(|gpu| &gpu.buffer));
        let [Some(nodes), Some(guides), Some(strands), Some(frame), Some(rings)] = gpu else {
            continue;
        };
        let bound = [uniform, nodes, guides, strands, frame, rings];
        let group = groups.get(bound.map(Buffer::id), || {
            let entries = BindGroupEntries::with_indices((
                (0, ribbon.clone()),
                (1, nodes.as_entire_binding()),
                (2, guides.as_entire_binding()),
                (3, strands.as_entire_binding()),
                (5, frame.as_entire_binding()),
                (6, rings.as_entire_binding()),
            ));
            expander.0.group(&device, &pipelines, &entries)
        });
        pass.set_bind_group(0, group, &[hair.offset]);
        let count =
            hair.rings.count().div_ceil(u64::from(WORKGROUP_SIZE)).min(u64::from(u32::MAX)) as u32;
        pass.dispatch_workgroups(count.min(most), count.div_ceil(most), 1);
    }
    span.end(&mut pass);
}
