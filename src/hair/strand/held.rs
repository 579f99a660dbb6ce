//! Held nodes, and how far from the root they can be held.

use super::Strand;
use crate::base::fault::{FaultKind, HairFault};
use bevy::prelude::*;

/// Nodes held by something else: a rod they are wound on, a hand, a clip. Held nodes have inverse
/// mass 0 and move to their targets as far as the strand reaches: no edge is stretched. A target out of
/// reach is reported once as a fault of kind [`FaultKind::Strand`]. Add it to a strand entity.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
#[require(HeldNodesState)]
pub struct HeldNodes {
    /// For each node from the root its target at the end of the next substep (m, in the hair's
    /// frame), or `None` for a free node. May be shorter than the strand.
    pub targets: Vec<Option<Vec3>>,
    /// For each node from the root the orientation of the edge before it at the end of the next substep (in the
    /// hair's frame; its third axis points along the edge, and is turned to do so), or `None` for an edge that is
    /// free to twist. Counts where both ends of the edge are held; the root's is
    /// [`Strand::root_frame`]. Together with the two targets it clamps the strand there, as a tie or a braid's
    /// end does. Empty by default; [`SolverMethod::Sweeps`](crate::SolverMethod::Sweeps) ignores it.
    pub frames: Vec<Option<Quat>>,
}

/// Whether targets of a strand's held nodes are out of reach. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HeldNodesState {
    /// A target is out of reach, which has been reported.
    pub out_of_reach: bool,
}

/// Maximum extension of hair between two held nodes, as a share of its length. Fully straight
/// hair has more length constraints than degrees of freedom, and its tensions are undetermined.
const TAUT: f32 = 0.99;

/// Distance at which the ends of free hair of a `length` are held whose targets are `distance`
/// apart (m). Nearly straight hair is held as it is; targets beyond reach are brought nearer the
/// farther they are, down to [`TAUT`].
pub(crate) fn drawn_out(distance: f32, length: f32) -> f32 {
    let excess = (distance - length).clamp(0.0, (1.0 - TAUT) * length.max(0.0));
    distance.min(length) - excess
}

/// Tolerance for the rounding of lengths.
const SLACK: f32 = 1e-3;

impl HeldNodes {
    /// Index and position of each held node. A target out of reach of the previous held node, or of
    /// the root, is moved within reach, and adjacent held nodes follow at the length of their edges; a
    /// target that is not finite leaves the node free.
    pub(crate) fn within_reach<'a>(
        &'a self,
        strand: &'a Strand,
    ) -> impl Iterator<Item = (usize, Vec3)> + 'a {
        let root = strand.positions.first().copied().unwrap_or_default();
        self.within_reach_of(root, strand)
    }

    /// The same for a strand whose root is here.
    pub(crate) fn within_reach_of<'a>(
        &'a self,
        root: Vec3,
        strand: &'a Strand,
    ) -> impl Iterator<Item = (usize, Vec3)> + 'a {
        let targets = self.targets.iter().take(strand.nodes()).enumerate();
        let (mut last, mut length) = (root, 0.0);
        let (mut is_drawn, mut is_displaced) = (false, false);
        targets.filter_map(move |(node, target)| {
            let edge = node.checked_sub(1);
            length += edge.map_or(0.0, |edge| strand.rest_lengths[edge]);
            let Some(target) = target.filter(|target| target.is_finite()) else {
                is_drawn |= node > 0;
                return None;
            };
            let Some(edge) = edge else {
                last = target;
                return Some((node, last));
            };
            // Squares of user values may overflow f32.
            let direction = (target - last).as_dvec3();
            let distance = direction.length() as f32;
            let apart = if is_drawn {
                drawn_out(distance, length)
            } else if is_displaced {
                length
            } else {
                distance.min(length)
            };
            is_displaced &= !is_drawn;
            is_displaced |= distance > length * (1.0 + SLACK);
            let now = (strand.positions[edge + 1] - strand.positions[edge]).as_dvec3();
            let direction = direction.normalize_or(now.normalize_or_zero()).as_vec3();
            last = if apart == distance { target } else { last + direction * apart };
            (length, is_drawn) = (0.0, false);
            Some((node, last))
        })
    }

    /// The first node whose target is out of reach, and by how much (m).
    fn out_of_reach(&self, strand: &Strand) -> Option<(usize, f32)> {
        let unknown = self.targets.iter().position(|t| t.is_some_and(|t| !t.is_finite()));
        let unknown = unknown.map(|node| (node, f32::INFINITY));
        let most = SLACK * strand.length();
        unknown.or_else(|| {
            self.within_reach(strand)
                .map(|(node, place)| (node, self.targets[node].map_or(0.0, |t| t.distance(place))))
                .find(|(_, short)| *short > most)
        })
    }
}

/// Reports targets out of reach once, until they are within reach again.
pub(super) fn report_out_of_reach(
    mut strands: Query<(Entity, &Strand, &HeldNodes, &mut HeldNodesState)>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, strand, held, mut reach) in strands.iter_mut().filter(|s| s.1.nodes() > 1) {
        let found = held.out_of_reach(strand);
        if let (Some((node, short)), false) = (found, reach.out_of_reach) {
            let message = format!(
                "node {node} of the strand is held {short} m farther away than hair of {} m reaches; \
                 it is held as near to its target as possible",
                strand.length()
            );
            faults.write(HairFault::new(FaultKind::Strand, message).of(entity));
        }
        reach.set_if_neq(HeldNodesState { out_of_reach: found.is_some() });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strand() -> Strand {
        let points: Vec<Vec3> = (0..6).map(|i| Vec3::X * (0.1 * i as f32)).collect();
        Strand::from_polyline(&points).unwrap()
    }

    fn held(targets: &[Option<Vec3>]) -> Vec<(usize, Vec3)> {
        HeldNodes { targets: targets.to_vec(), ..default() }.within_reach(&strand()).collect()
    }

    #[test]
    fn what_is_within_reach_stays() {
        let at = Vec3::new(0.05, 0.1, 0.1);
        assert_eq!(held(&[None, None, Some(at)]), [(2, at)]);
        let root = Vec3::Y * 0.01;
        assert_eq!(held(&[Some(root), None, Some(at)]), [(0, root), (2, at)]);
        assert_eq!(held(&[None; 9]), []);
    }

    #[test]
    fn no_part_is_held_longer_than_it_is() {
        let far = Some(Vec3::Y * 4e37);
        let places = held(&[None, None, far, far, None, far, far]);
        let expected = [(2, 0.198), (3, 0.298), (5, 0.496)];
        assert_eq!(places.len(), 3, "{places:?}");
        for ((node, place), (at, height)) in places.into_iter().zip(expected) {
            assert_eq!(node, at);
            assert!(place.distance(Vec3::Y * height) < 1e-6, "{place}");
        }
    }

    #[test]
    fn a_target_that_is_not_finite_holds_nothing_and_is_reported() {
        let strand = strand();
        let out = |first: Option<Vec3>, x: f32| {
            let held = HeldNodes { targets: vec![None, first, Some(Vec3::X * x)], ..default() };
            (held.within_reach(&strand).count(), held.out_of_reach(&strand))
        };
        assert!(matches!(out(Some(Vec3::NAN), 0.1), (1, Some((1, _)))));
        assert_eq!(out(Some(Vec3::X * 0.1), 0.20001), (2, None), "rounding");
        assert!(matches!(out(None, 0.248), (1, Some((2, s))) if (s - 0.05).abs() < 1e-6));
    }
}
