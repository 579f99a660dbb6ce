//! What a frame writes: packed nodes and the frame's own numbers into the existing GPU buffers.

use super::{
    buffers::HairBuffers, draw::Packed, elsewhere::DrawnElsewhere, packed_frame::DrawnFrame,
    sets::HairRenderSystems,
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
    hairs: Extract<Query<(&HairBuffers, &Packed, &DrawnFrame, Has<DrawnElsewhere>)>>,
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
    for (hair, packed, frame, is_drawn_elsewhere) in &hairs {
        let nodes: &[u8] = bytemuck::cast_slice(&packed.nodes);
        let nodes = (!is_drawn_elsewhere).then_some((&hair.nodes, nodes, nodes.len()));
        let frame = (&hair.frame, frame.packed.bytes(), size_of_val(&frame.packed));
        for (buffer, bytes, size) in nodes.into_iter().chain([frame]) {
            if let Some(gpu) = buffers.get(buffer)
                && gpu.buffer.size() == size as u64
            {
                queue.write_buffer(&gpu.buffer, 0, bytes);
            }
        }
    }
}
