//! The one write a frame: packed nodes into the GPU buffer that is there already.

use super::{buffers::HairBuffers, draw::Packed, sets::HairRenderSystems};
use bevy::{
    prelude::*,
    render::{
        Extract, ExtractSchedule, RenderApp, render_asset::RenderAssets, renderer::RenderQueue,
        storage::GpuShaderBuffer,
    },
};

pub(super) fn plugin(app: &mut App) {
    if let Some(render) = app.get_sub_app_mut(RenderApp) {
        render.add_systems(ExtractSchedule, upload.in_set(HairRenderSystems));
    }
}

/// While extracting, the frame before has been submitted and this one's transforms are taken over:
/// nodes written now are drawn with them. A buffer made in this frame is not there yet and brings
/// its nodes along.
fn upload(
    hairs: Extract<Query<(&HairBuffers, &Packed)>>,
    buffers: Option<Res<RenderAssets<GpuShaderBuffer>>>,
    queue: Option<Res<RenderQueue>>,
) {
    let (Some(buffers), Some(queue)) = (buffers, queue) else {
        return;
    };
    // Until the frame after, a new device's queue stands beside buffers of a lost one.
    if queue.is_changed() {
        return;
    }
    for (hair, packed) in &hairs {
        let bytes: &[u8] = bytemuck::cast_slice(&packed.nodes);
        if let Some(gpu) = buffers.get(&hair.nodes)
            && gpu.buffer.size() == bytes.len() as u64
        {
            queue.write_buffer(&gpu.buffer, 0, bytes);
        }
    }
}
