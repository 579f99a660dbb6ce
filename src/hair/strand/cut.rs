//! Strands that have been cut.

use super::Strand;
use bevy::prelude::*;

/// What a strand was before its first cut, and where it ends now. Component of strands that
/// [`CutHair`](crate::CutHair) has cut: drawn strands keep the shape that they have beside the whole strand, and a
/// [`Hairdo`](crate::Hairdo) cuts grown hair as far.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct CutStrand {
    /// How many edges the whole strand had.
    pub(crate) edges: u32,
    /// Where it ends, in edges of the whole one: 6.25 is a quarter along the seventh.
    pub(crate) end: f32,
    /// Length of the whole one (m).
    pub(crate) length: f32,
    /// From its root to its tip just before the first cut, in the hair's frame (m).
    pub(crate) reach: Vec3,
}

impl CutStrand {
    /// Of a strand that is whole.
    pub(crate) fn whole(strand: &Strand) -> Self {
        let [root, .., tip] = strand.positions() else { return Self::default() };
        let (edges, reach) = (strand.edges() as u32, *tip - *root);
        Self { edges, end: edges as f32, length: strand.length(), reach }
    }

    /// Whether a strand of so many nodes ends where this says: it may have been replaced since, or this been edited.
    pub(crate) fn fits(&self, nodes: usize) -> bool {
        let edges = nodes.saturating_sub(1) as f32;
        self.end > edges - 1.0
            && self.end <= (edges + 1.0).min(self.edges as f32)
            && self.length > 0.0
            && self.length.is_finite()
            && self.reach.is_finite()
    }

    /// Length of the whole strand (m).
    pub fn whole_length(&self) -> f32 {
        self.length
    }

    /// Where it ends, as a share of the whole strand's edges.
    pub fn share(&self) -> f32 {
        let share = self.end / self.edges as f32;
        if share > 0.0 { share.min(1.0) } else { 1.0 }
    }
}

/// Where each drawn follower of a hair that has been cut ends, in their order, in 65535ths of its length. Kept by cutting.
/// With another number of followers they end with their guides.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct FollowerCuts(pub(crate) Vec<u16>);

/// A place along a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StrandPlace {
    /// The edge, from the root.
    pub(crate) edge: usize,
    /// How far along it, 0 to 1.
    pub(crate) share: f32,
}

/// The shortest edge that a cut leaves (m); a shorter end becomes part of the edge before it.
pub(crate) const SHORTEST_END: f32 = 1e-3;

impl Strand {
    /// Removes what is beyond a place; the new tip is there. Whether there is enough before it: of the first edge
    /// [`SHORTEST_END`] has to stay.
    pub(crate) fn cut(&mut self, place: StrandPlace, cut: &mut CutStrand) -> bool {
        let StrandPlace { edge, share } = place;
        // What an inspector has written is repaired in the next tick.
        if !self.has_nodes(self.nodes()) {
            return false;
        }
        let Some(length) = self.rest_lengths.get(edge).map(|length| length * share) else {
            return false;
        };
        let joins = length < SHORTEST_END;
        if joins && edge == 0 {
            return false;
        }
        let is_last = edge + 1 == self.edges();
        let (first, along) = (edge as f32, share);
        let end = if is_last { first + along * (cut.end - first) } else { first + along };
        let [from, to] = [self.positions[edge], self.positions[edge + 1]];
        let [slow, fast] = [self.velocities[edge], self.velocities[edge + 1]];
        let edges = edge + usize::from(!joins);
        self.positions.truncate(edges);
        self.velocities.truncate(edges);
        self.positions.push(from.lerp(to, share));
        self.velocities.push(slow.lerp(fast, share));
        self.rest_lengths.truncate(edges);
        self.rest_lengths[edges - 1] =
            if joins { self.rest_lengths[edges - 1] + length } else { length };
        self.orientations.truncate(edges);
        self.angular_velocities.truncate(edges);
        self.tensions.truncate(edges);
        self.unforced.clear();
        self.blown.clear();
        cut.end = end;
        true
    }
}
