//! Strands that follow others, at levels of detail with fewer strands.

use super::layout::{FollowerView, GROUP_SIZE, Layout};
use crate::simulation::lod::follow::{GUIDES, GuideOffsets};
use bevy::math::{Quat, Vec3, ops};

/// Vectors per node of a follower's guide offsets.
pub(super) const OFFSET_VECTORS: usize = 6;

/// Where the target of a follower's root is, in the guide offsets of its last node.
pub(super) const ROOT_PART: usize = 3;

/// How followers move in a substep.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FollowRecord {
    /// Length of the tick (s).
    pub seconds: f32,
    /// How points at rest in the world have moved in the hair's frame in this tick: rotation and translation
    /// (m).
    pub frame: Option<(Quat, Vec3)>,
    /// Time since the hair was handed over (s).
    pub since: f32,
}

impl FollowRecord {
    /// Words of turn, way and seconds, times.
    pub(super) fn words(&self) -> [f32; 12] {
        let (turn, way) = self.frame.unwrap_or((Quat::IDENTITY, Vec3::ZERO));
        let [a, b, c, d] = turn.to_array();
        let decay = ops::exp(-self.since / GuideOffsets::OWN_MOTION);
        let seconds = if self.seconds > 0.0 { self.seconds } else { 1.0 };
        [a, b, c, d, way.x, way.y, way.z, seconds, self.since, decay, GuideOffsets::OWN_MOTION, 0.0]
    }
}

/// The guide offsets of a hair's followers as the kernel reads them.
pub(super) fn pack(layout: &Layout, followers: &[(usize, FollowerView<'_>)]) -> Vec<[f32; 4]> {
    let mut packed = vec![[0.0; 4]; layout.follower_vectors(OFFSET_VECTORS)];
    for (strand, view) in followers {
        let edges = layout.nodes(*strand) - 1;
        let guides = view.offsets.guides.len().min(GUIDES);
        let at = |node, part| offset_index(layout, *strand, node, part);
        let (own, since) = view.offsets.own_motion();
        let mut offsets = view.offsets.edges();
        for edge in 0..edges {
            let mut position = [0.0; GUIDES];
            let mut segment = Vec3::ZERO;
            for (guide, place) in position.iter_mut().enumerate().take(guides) {
                let Some((relative, along, at_edge)) = offsets.next() else { break };
                packed[at(edge, guide)] = relative.to_array();
                *place = at_edge;
                if guide == 0 {
                    segment = along;
                }
            }
            let spin = own.get(edge).copied().unwrap_or_default();
            packed[at(edge, 3)] = segment.extend(position[0]).to_array();
            packed[at(edge, 4)] = spin.extend(position[1]).to_array();
            packed[at(edge, 5)] = [position[2], 0.0, 0.0, 0.0];
        }
        // Whole numbers up to 2^24 are exact.
        let mut head = [0.0; 4];
        let mut weights = [0.0, 0.0, 0.0, since];
        let mut ends = [0.0; 4];
        for (guide, (_, weight)) in view.offsets.guides.iter().enumerate().take(guides) {
            let of = view.guides[guide] as usize;
            head[guide] = layout.slot(of, 0) as f32;
            ends[guide] = (layout.nodes(of) - 2) as f32;
            weights[guide] = *weight;
        }
        head[3] = guides as f32;
        ends[3] = ops::exp(-since / GuideOffsets::OWN_MOTION);
        packed[at(edges, 0)] = head;
        packed[at(edges, 1)] = weights;
        packed[at(edges, 2)] = ends;
    }
    packed
}

/// Where part `part` of a follower's node lies among the guide offsets.
pub(super) fn offset_index(layout: &Layout, strand: usize, node: usize, part: usize) -> usize {
    layout.index(strand, node, part, OFFSET_VECTORS)
        - layout.first_follower_slot() * OFFSET_VECTORS * GROUP_SIZE
}
