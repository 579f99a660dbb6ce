//! Nodes that something else holds, and how far they can be held from the root.

use super::Strand;
use crate::fault::{FaultKind, HairFault};
use bevy::prelude::*;

/// Nodes that something else holds: a rod they are wound on, a hand, a clip. Held nodes have no
/// inverse mass and go where they are told, as far as the strand reaches: no edge is stretched to get
/// there, what asks for more is told as a fault of kind [`FaultKind::Strand`]. Add it to a strand entity.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
#[require(HeldReach)]
pub struct HeldNodes {
    /// For each node from the root where it is to be at the end of the next substep (m, in the
    /// hair's frame), or `None`. May be shorter than the strand.
    pub targets: Vec<Option<Vec3>>,
}

/// Whether a strand's nodes are held farther away than it reaches. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HeldReach {
    /// It does not reach; that has been told.
    pub exceeded: bool,
}

/// The share of its length to which hair is drawn out between held nodes that would be farther apart.
/// Drawn out straight it has one more length than ways to give, and its tensions are anything.
const TAUT: f32 = 0.99;

/// How far apart the ends of free hair of a `length` are held that are to be `distance` apart (m).
/// Hair that is straight already is left so; beyond that it is given way the more, down to [`TAUT`].
pub(crate) fn drawn_out(distance: f32, length: f32) -> f32 {
    let excess = (distance - length).clamp(0.0, (1.0 - TAUT) * length.max(0.0));
    distance.min(length) - excess
}

/// Rounding of lengths is no stretch.
const SLACK: f32 = 1e-3;

impl HeldNodes {
    /// Number and place of each held node. A place that the hair between it and the held node before,
    /// or the root, cannot reach is brought near enough, and what is held next to it follows at the
    /// length of its edge; one that is not finite leaves the node free.
    pub(crate) fn within_reach<'a>(
        &'a self,
        strand: &'a Strand,
    ) -> impl Iterator<Item = (usize, Vec3)> + 'a {
        let targets = self.targets.iter().take(strand.nodes()).enumerate();
        let (mut last, mut length) = (strand.positions[0], 0.0);
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
            // Squares of what somebody wrote may be beyond f32.
            let way = (target - last).as_dvec3();
            let distance = way.length() as f32;
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
            let way = way.normalize_or(now.normalize_or_zero()).as_vec3();
            last = if apart == distance { target } else { last + way * apart };
            (length, is_drawn) = (0.0, false);
            Some((node, last))
        })
    }

    /// The first node that cannot be where it is to be held, and by how much (m).
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

/// What is held out of reach is told once, until it is within reach again.
pub(super) fn report_out_of_reach(
    mut strands: Query<(Entity, &Strand, &HeldNodes, &mut HeldReach)>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, strand, held, mut reach) in strands.iter_mut().filter(|s| s.1.nodes() > 1) {
        let found = held.out_of_reach(strand);
        if let (Some((node, short)), false) = (found, reach.exceeded) {
            let message = format!(
                "node {node} of the strand is held {short} m farther away than hair of {} m reaches; \
                 it is held as near as it comes",
                strand.length()
            );
            faults.write(HairFault::new(FaultKind::Strand, message).of(entity));
        }
        reach.set_if_neq(HeldReach { exceeded: found.is_some() });
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
        HeldNodes { targets: targets.to_vec() }.within_reach(&strand()).collect()
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
    fn what_is_no_place_holds_nothing_and_is_told() {
        let strand = strand();
        let out = |first: Option<Vec3>, x: f32| {
            let held = HeldNodes { targets: vec![None, first, Some(Vec3::X * x)] };
            (held.within_reach(&strand).count(), held.out_of_reach(&strand))
        };
        assert!(matches!(out(Some(Vec3::NAN), 0.1), (1, Some((1, _)))));
        assert_eq!(out(Some(Vec3::X * 0.1), 0.20001), (2, None), "rounding");
        assert!(matches!(out(None, 0.248), (1, Some((2, s))) if (s - 0.05).abs() < 1e-6));
    }
}
