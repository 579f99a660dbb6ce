//! The single write a frame: packed nodes into the existing GPU buffer.

use super::{
    buffers::HairBuffers, draw::Packed, elsewhere::DrawnElsewhere, sets::HairRenderSystems,
};
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

/// Runs in extraction, after the previous frame was submitted, so that nodes and transforms of the same
/// frame are drawn together. A buffer created in this frame is uploaded with its contents instead.
fn upload(
    hairs: Extract<Query<(&HairBuffers, &Packed), Without<DrawnElsewhere>>>,
    buffers: Option<Res<RenderAssets<GpuShaderBuffer>>>,
    queue: Option<Res<RenderQueue>>,
) {
    let (Some(buffers), Some(queue)) = (buffers, queue) else {
        return;
    };
    // For one frame after a device loss the new queue is combined with buffers of the lost device.
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
