//! Kinematic targets of substeps on a device.

use super::{
    followers,
    layout::Layout,
    pipelines::HairKernels,
    record::{FREE, Indices, KinematicTarget, ROOT, SubstepRecord},
};
use bevy::render::{
    render_resource::{
        BindGroup, BindGroupEntries, Buffer, BufferDescriptor, BufferUsages, ComputePipeline,
    },
    renderer::{RenderDevice, RenderQueue},
};

/// Threads of a workgroup that writes targets.
const GROUP: u32 = 64;

/// The kinematic targets of the uploaded substeps.
#[derive(Debug, Default)]
pub(super) struct KinematicTargets {
    uploaded: Option<Uploaded>,
    words: Vec<[u32; 8]>,
    /// How many nodes of simulated strands, and roots of followers, each substep has.
    counts: Vec<[u32; 2]>,
}

#[derive(Debug)]
struct Uploaded {
    buffer: Buffer,
    /// Of simulated strands, and of followers.
    groups: [Option<BindGroup>; 2],
}

impl KinematicTargets {
    pub(super) fn clear(&mut self) {
        self.words.clear();
        self.counts.clear();
    }

    /// Adds a substep; returns where it finds what belongs to it.
    pub(super) fn push(&mut self, layout: &Layout, record: &SubstepRecord) -> Indices {
        let mut put = |words: &mut dyn Iterator<Item = [u32; 8]>| {
            let first = self.words.len() as u32;
            self.words.extend(words);
            first..self.words.len() as u32
        };
        let targets =
            put(&mut record.targets.iter().filter_map(|target| target_words(layout, target)));
        // Roots of followers move once a tick.
        let roots = record.targets.iter().filter(|_| record.follows.is_some());
        let root_targets = put(&mut roots.filter_map(|target| root_words(layout, target)));
        self.counts.push([&targets, &root_targets].map(|range| range.end - range.start));
        Indices {
            targets,
            root_targets,
            first_follower_block: layout.simulated_blocks() as u32,
            first_follower_slot: layout.first_follower_slot() as u32,
            has_spins: layout.has_spins(),
        }
    }

    /// Has the device take them: into the scratch of simulated strands, and into the guide offsets of followers.
    pub(super) fn upload(
        &mut self,
        device: &RenderDevice,
        queue: &RenderQueue,
        kernels: &HairKernels,
        rest: &Buffer,
        into: [Option<&Buffer>; 2],
    ) {
        let bytes: &[u8] = bytemuck::cast_slice(&self.words);
        let size = bytes.len() as u64;
        if size == 0 {
            return;
        }
        let uploaded = self.uploaded.take().filter(|uploaded| uploaded.buffer.size() >= size);
        let uploaded = uploaded.unwrap_or_else(|| {
            let buffer = device.create_buffer(&BufferDescriptor {
                label: Some("kinematic targets"),
                size: size.next_power_of_two(),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let group = |into: &Buffer| {
                let entries = BindGroupEntries::sequential((
                    buffer.as_entire_binding(),
                    rest.as_entire_binding(),
                    into.as_entire_binding(),
                ));
                device.create_bind_group("kinematic targets", &kernels.targets, &entries)
            };
            let groups = into.map(|into| into.map(group));
            Uploaded { buffer, groups }
        });
        queue.write_buffer(&uploaded.buffer, 0, bytes);
        self.uploaded = Some(uploaded);
    }

    /// What moves the kinematic nodes of an uploaded substep: pipelines, groups and numbers of workgroups.
    pub(super) fn of<'a>(
        &'a self,
        substep: usize,
        kernels: &'a HairKernels,
    ) -> impl Iterator<Item = (&'a ComputePipeline, &'a BindGroup, usize)> {
        let counts = self.counts.get(substep).copied().unwrap_or_default();
        let groups = self.uploaded.iter().flat_map(|uploaded| &uploaded.groups);
        let all =
            [&kernels.set_targets, &kernels.set_root_targets].into_iter().zip(groups).zip(counts);
        all.filter(|(_, count)| *count > 0).filter_map(|((pipeline, group), count)| {
            Some((pipeline, group.as_ref()?, count.div_ceil(GROUP) as usize))
        })
    }
}

/// A node's target as targets.wgsl reads it; `None` for a node that does not exist.
fn target_words(layout: &Layout, target: &KinematicTarget) -> Option<[u32; 8]> {
    let (strand, node) = (target.strand as usize, target.node as usize);
    if strand >= layout.strands() || node >= layout.nodes(strand) || layout.is_follower(strand) {
        return None;
    }
    let slot = layout.slot(strand, node);
    let root = if target.node == 0 { ROOT } else { 0 };
    let free = if target.place.is_none() { FREE } else { 0 };
    let [x, y, z] = target.place.unwrap_or_default().to_array().map(f32::to_bits);
    let [a, b, c, d] = target.frame.to_array().map(f32::to_bits);
    Some([x, y, z, slot | root | free, a, b, c, d])
}

/// The target of a follower's root as targets.wgsl reads it; `None` for another node.
fn root_words(layout: &Layout, target: &KinematicTarget) -> Option<[u32; 8]> {
    let strand = target.strand as usize;
    if strand >= layout.strands() || target.node > 0 || !layout.is_follower(strand) {
        return None;
    }
    let tip = layout.nodes(strand) - 1;
    let slot = followers::offset_index(layout, strand, tip, followers::ROOT_PART) as u32;
    let [x, y, z] = target.place?.to_array().map(f32::to_bits);
    let [a, b, c, d] = target.frame.to_array().map(f32::to_bits);
    Some([x, y, z, slot, a, b, c, d])
}
