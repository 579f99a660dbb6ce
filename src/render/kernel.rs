//! Compute shaders that run once for each hair: how they are compiled, and what they are given.

use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntry, BindGroupLayoutDescriptor, CachedComputePipelineId,
            CachedPipelineState, ComputePipeline, ComputePipelineDescriptor, DownlevelFlags,
            PipelineCache,
        },
        renderer::{RenderAdapter, RenderDevice},
    },
    shader::{ShaderCacheError, ShaderDefVal},
};
use core::hash::Hash;

pub(super) fn has_compute(adapter: &RenderAdapter) -> bool {
    adapter.get_downlevel_capabilities().flags.contains(DownlevelFlags::COMPUTE_SHADERS)
}

/// Why a kernel cannot be compiled; `None` too of one whose shaders are only not there yet.
pub(crate) fn why_broken(
    pipelines: &PipelineCache,
    pipeline: CachedComputePipelineId,
) -> Option<&ShaderCacheError> {
    match pipelines.get_compute_pipeline_state(pipeline) {
        CachedPipelineState::Err(
            ShaderCacheError::ShaderNotLoaded(_) | ShaderCacheError::ShaderImportNotYetAvailable,
        ) => None,
        CachedPipelineState::Err(error) => Some(error),
        _ => None,
    }
}

/// A kernel with one bind group, of the buffers of a hair.
pub(super) struct Kernel {
    layout: BindGroupLayoutDescriptor,
    pipeline: CachedComputePipelineId,
}

impl Kernel {
    /// Has the function `entry` of a shader compiled.
    pub(super) fn queue(
        pipelines: &PipelineCache,
        shader: Handle<Shader>,
        entry: &'static str,
        layout: BindGroupLayoutDescriptor,
        mut constants: Vec<ShaderDefVal>,
    ) -> Self {
        // Of what it imports, some is written for a material.
        constants.push(ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), 0));
        let pipeline = pipelines.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some(layout.label.clone()),
            layout: vec![layout.clone()],
            shader,
            shader_defs: constants,
            entry_point: Some(entry.into()),
            ..default()
        });
        Self { layout, pipeline }
    }

    /// Once it has been compiled.
    pub(super) fn ready<'a>(&self, pipelines: &'a PipelineCache) -> Option<&'a ComputePipeline> {
        pipelines.get_compute_pipeline(self.pipeline)
    }

    pub(super) fn why_broken<'a>(
        &self,
        pipelines: &'a PipelineCache,
    ) -> Option<&'a ShaderCacheError> {
        why_broken(pipelines, self.pipeline)
    }

    pub(super) fn group(
        &self,
        device: &RenderDevice,
        pipelines: &PipelineCache,
        entries: &[BindGroupEntry],
    ) -> BindGroup {
        let layout = pipelines.get_bind_group_layout(&self.layout);
        device.create_bind_group(self.layout.label.as_ref(), &layout, entries)
    }
}

/// Bind groups by what they bind, as long as they are used in each frame.
pub(super) struct Groups<Bound, G>(HashMap<Bound, (G, bool)>);

impl<Bound, G> Default for Groups<Bound, G> {
    fn default() -> Self {
        Self(HashMap::default())
    }
}

impl<Bound: Eq + Hash, G> Groups<Bound, G> {
    /// Drops those that were not used in the frame before.
    pub(super) fn begin_frame(&mut self) {
        self.0.retain(|_, (_, is_used)| core::mem::take(is_used));
    }

    pub(super) fn get(&mut self, bound: Bound, make: impl FnOnce() -> G) -> &G {
        let (group, is_used) = self.0.entry(bound).or_insert_with(|| (make(), true));
        *is_used = true;
        group
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_last_as_long_as_each_frame_uses_them() {
        let mut groups = Groups::default();
        let mut made = 0;
        for frame in 0..4 {
            groups.begin_frame();
            let mut get = |bound: u32| {
                groups.get(bound, || {
                    made += 1;
                    made
                });
            };
            get(7);
            if frame != 2 {
                get(8);
            }
        }
        // The second one was dropped after frame 2 and made again.
        assert_eq!(made, 3);
        assert_eq!(groups.0.len(), 2);
    }
}
