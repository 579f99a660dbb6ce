//! A frame on the GPU, in the render world: what the ticks have written down is run, before any
//! camera draws, and the nodes go into the buffers that drawing reads.

use super::{
    compile::Compiled, hair::GpuHair, record::GpuJournal, residence::HairGpu, shared::Link,
};
use crate::{
    base::setting::Ranged,
    hair::strand::StrandHistory,
    render::{DrawnElsewhere, HairBuffers, WritesNodes},
};
use bevy::{
    core_pipeline::schedule::camera_driver,
    ecs::entity_disabling::Disabled,
    prelude::*,
    render::{
        ExtractSchedule, MainWorld, RenderApp,
        render_asset::RenderAssets,
        renderer::{RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue},
        storage::{GpuShaderBuffer, ShaderBuffer},
    },
};

pub(super) fn plugin(app: &mut App) {
    if let Some(render) = app.get_sub_app_mut(RenderApp) {
        render.init_resource::<Extracted>().add_systems(ExtractSchedule, extract).add_systems(
            RenderGraph,
            run.in_set(RenderGraphSystems::Render).in_set(WritesNodes).before(camera_driver),
        );
    }
}

/// The hair of this frame.
#[derive(Resource, Default)]
struct Extracted {
    hairs: Vec<Frame>,
    /// Ticks that each of them runs at most.
    ticks: usize,
}

struct Frame {
    link: Link,
    nodes: Option<AssetId<ShaderBuffer>>,
    overstep: f32,
    /// Where its roots are drawn, if they are on a mesh.
    roots: Vec<Option<Vec3>>,
    /// Whether it sleeps.
    rests: bool,
}

/// Substeps and requests are taken here, between two frames, so that none is run before its frame.
fn extract(
    mut main: ResMut<MainWorld>,
    mut extracted: ResMut<Extracted>,
    compiled: Option<Res<Compiled>>,
    device: Res<RenderDevice>,
) {
    extracted.hairs.clear();
    let settings = main.get_resource::<HairGpu>().copied().unwrap_or_default().clamped();
    extracted.ticks = settings.ticks_a_frame.max(1) as usize;
    if let Some(compiled) = compiled.filter(|_| device.is_changed()) {
        compiled.renew();
    }
    let mut tied = Vec::new();
    let mut hairs = main.query_filtered::<(
        Entity,
        &mut GpuHair,
        Option<&mut GpuJournal>,
        Option<&HairBuffers>,
        Option<&DrawnElsewhere>,
    ), Allow<Disabled>>();
    for (entity, mut hair, journal, buffers, drawn) in hairs.iter_mut(&mut main) {
        let link = hair.link.clone();
        let mut shared = link.lock();
        let mut rests = false;
        if let Some(mut journal) = journal {
            rests = journal.rest.is_asleep && !hair.is_tied;
            shared.pending.append(&mut journal.records);
        }
        if let Some(number) = hair.bypass_change_detection().take_request() {
            shared.asked = Some(number);
        }
        shared.ask_for(&hair.probed, hair.ticks);
        drop(shared);
        let nodes = buffers.zip(drawn).map(|(buffers, _)| buffers.nodes.id());
        if hair.is_tied {
            tied.push((entity, extracted.hairs.len()));
        }
        let overstep = drawn.map_or(1.0, |drawn| drawn.overstep);
        extracted.hairs.push(Frame { link, nodes, overstep, roots: Vec::new(), rests });
    }
    for (hair, index) in tied {
        let Some(hair) = main.get::<GpuHair>(hair) else { continue };
        let root = |strand: &Entity| main.get::<StrandHistory>(*strand)?.root;
        extracted.hairs[index].roots.extend(hair.members.iter().map(root));
    }
}

/// All substeps of all hair, the outer loop over substeps: hairs share no buffer, so only it meets barriers.
fn run(
    extracted: Res<Extracted>,
    compiled: Option<Res<Compiled>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    buffers: Option<Res<RenderAssets<GpuShaderBuffer>>>,
) {
    if extracted.hairs.is_empty() {
        return;
    }
    // Hair on a lost device is skipped.
    let present = compiled.map_or(0, |compiled| compiled.device());
    let hairs = extracted.hairs.iter().filter(|frame| frame.link.is_on(present));
    let mut hairs: Vec<_> = hairs.map(|frame| (frame.link.lock(), frame)).collect();
    let most = extracted.ticks;
    let counts: Vec<usize> = hairs.iter_mut().map(|(shared, _)| shared.upload(most)).collect();
    let mut encoder = device.create_command_encoder(&default());
    let longest = counts.iter().copied().max().unwrap_or(0);
    if longest > 0 {
        let mut pass = encoder.begin_compute_pass(&default());
        for index in 0..longest {
            for ((shared, _), _) in hairs.iter_mut().zip(&counts).filter(|(_, n)| index < **n) {
                let kernels = shared.kernels.clone();
                shared.strands.dispatch(&kernels, &mut pass, index);
            }
        }
        for ((shared, _), _) in hairs.iter().zip(&counts).filter(|(_, n)| **n > 0) {
            shared.strands.measure(&shared.kernels, &mut pass);
        }
    }
    for ((shared, frame), count) in hairs.iter_mut().zip(&counts) {
        let nodes = frame.nodes.and_then(|id| buffers.as_ref()?.get(id));
        if let Some(nodes) = nodes {
            shared.draw(&nodes.buffer, &mut encoder, frame.overstep, (&frame.roots, frame.rests));
        }
        shared.copy(&mut encoder, *count > 0);
    }
    // Submitted here and not with the cameras: whoever else runs this hair's substeps comes after.
    queue.submit([encoder.finish()]);
    hairs.iter().for_each(|(shared, _)| shared.map());
}
