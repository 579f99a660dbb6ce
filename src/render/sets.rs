//! System sets of drawing, and its run condition.

use bevy::{
    prelude::*,
    render::{render_resource::DownlevelFlags, renderer::RenderAdapter},
};

/// The systems that draw: in `PostUpdate` after transforms have been propagated and before visibility
/// is, and in the render world's `ExtractSchedule` the writes to the GPU.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HairRenderSystems;

/// In the render world's graph: what writes nodes on the GPU does so before strands are expanded.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct WritesNodes;

/// Whether drawing goes between ticks by the overstep of the fixed clock.
#[derive(Resource, Clone, Copy, Debug)]
pub(super) struct Interpolate(pub(super) bool);

/// Run condition: whether the graphics device can draw hair; logs once if not. Checked at run time,
/// because the device may be created by a plugin that finishes later.
pub(super) fn supported(
    adapter: Option<Res<RenderAdapter>>,
    mut known: Local<Option<bool>>,
) -> bool {
    let Some(adapter) = adapter else {
        return true;
    };
    *known.get_or_insert_with(|| {
        let flags = adapter.get_downlevel_capabilities().flags;
        let supported = flags.contains(DownlevelFlags::VERTEX_STORAGE);
        if !supported {
            tracing::warn!(
                "hair is not drawn: the graphics device has no storage buffers in vertex shaders; \
                 use Vulkan, Metal, Direct3D 12 or WebGPU"
            );
        }
        supported
    })
}
