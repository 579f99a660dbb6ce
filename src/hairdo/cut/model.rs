//! Where a cut goes through a strand, and what becomes of what it carries.

use crate::hair::strand::StrandPlace;
use bevy::prelude::*;

/// What a cut does to a strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Meeting {
    /// It ends before the cut.
    Misses,
    /// It is cut at a place.
    At(StrandPlace),
    /// Nothing would be left.
    Whole,
}

/// Where a strand first goes through a plane, from the side that its normal points away from.
pub(super) fn through_plane(positions: &[Vec3], point: Vec3, normal: Vec3) -> Meeting {
    let (point, normal) = (point.as_dvec3(), normal.as_dvec3().normalize_or_zero());
    let beyond = |p: &Vec3| (p.as_dvec3() - point).dot(normal);
    if positions.first().is_none_or(|root| beyond(root) >= 0.0) {
        return Meeting::Whole;
    }
    let mut edges =
        positions.windows(2).map(|ends| [beyond(&ends[0]), beyond(&ends[1])]).enumerate();
    match edges.find(|(_, [_, end])| *end > 0.0) {
        Some((edge, [begin, end])) => {
            Meeting::At(StrandPlace { edge, share: (begin / (begin - end)) as f32 })
        }
        None => Meeting::Misses,
    }
}

/// Where a strand is so long.
pub(super) fn at_length(rest_lengths: &[f32], length: f32) -> Meeting {
    let mut left = length;
    for (edge, own) in rest_lengths.iter().enumerate() {
        if left < *own {
            return match left > 0.0 {
                true => Meeting::At(StrandPlace { edge, share: left / own }),
                false => Meeting::Whole,
            };
        }
        left -= own;
    }
    Meeting::Misses
}

/// What nodes carry (per node, spread evenly over its half edges) after a cut: the part that lies within the
/// new edges. The sum is that of the old before the cut's place.
pub(super) fn within(carried: &[f64], old: &[f32], new: &[f32]) -> Vec<f64> {
    let total: f64 = new.iter().map(|l| f64::from(*l)).sum();
    // All that lies below a place along the strand.
    let below = |place: f64| {
        let (mut sum, mut begin) = (0.0, 0.0);
        for (node, amount) in carried.iter().enumerate() {
            let half = |edge: Option<usize>| {
                edge.and_then(|edge| old.get(edge)).map_or(0.0, |l| 0.5 * f64::from(*l))
            };
            let length = half(node.checked_sub(1)) + half(Some(node));
            let share = if length > 0.0 { ((place - begin) / length).clamp(0.0, 1.0) } else { 0.0 };
            sum += amount * share;
            begin += length;
        }
        sum
    };
    let mut nodes = Vec::with_capacity(new.len() + 1);
    let (mut begin, mut before) = (0.0, 0.0);
    for length in new {
        let middle = below(begin + 0.5 * f64::from(*length));
        nodes.push(middle - before);
        before = middle;
        begin += f64::from(*length);
    }
    nodes.push(below(total) - before);
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_strand_that_curls_through_a_plane_is_cut_where_it_first_does() {
        let at = |y: f32| Vec3::new(0.0, y, 0.0);
        let curl = [at(0.03), at(0.01), at(-0.01), at(0.02), at(-0.04)];
        let meet = |y: f32| through_plane(&curl, at(y), Vec3::NEG_Y * 3.0);
        assert_eq!(meet(0.0), Meeting::At(StrandPlace { edge: 1, share: 0.5 }));
        assert_eq!(meet(-0.05), Meeting::Misses);
        assert_eq!(meet(0.04), Meeting::Whole);
        assert_eq!(through_plane(&[], Vec3::ZERO, Vec3::Y), Meeting::Whole);
    }

    #[test]
    fn a_length_is_measured_along_the_edges() {
        let lengths = [0.01, 0.02, 0.03];
        assert_eq!(at_length(&lengths, 0.02), Meeting::At(StrandPlace { edge: 1, share: 0.5 }));
        assert_eq!(at_length(&lengths, 0.07), Meeting::Misses);
        assert_eq!(at_length(&lengths, 0.0), Meeting::Whole);
    }

    proptest! {
        /// What is spread evenly stays so, and no more is left than there was before the cut.
        #[test]
        fn what_nodes_carry_is_split_by_length(
            lengths in prop::collection::vec(0.002_f32..0.05, 1..12),
            carried in prop::collection::vec(0.0_f64..1e-8, 13),
            edge in 0_usize..12,
            share in 0.01_f32..1.0,
        ) {
            let edge = edge.min(lengths.len() - 1);
            let mut new = lengths[..=edge].to_vec();
            new[edge] *= share;
            let even: Vec<f64> = crate::water::moisture::node_lengths(&lengths).map(f64::from).collect();
            let left = within(&even, &lengths, &new);
            for (left, expected) in left.iter().zip(crate::water::moisture::node_lengths(&new)) {
                prop_assert!((left - f64::from(expected)).abs() < 1e-7, "{left} for {expected}");
            }
            let carried = &carried[..=lengths.len()];
            let left = within(carried, &lengths, &new);
            prop_assert!(left.len() == new.len() + 1 && left.iter().all(|amount| *amount >= 0.0));
            prop_assert!(left.iter().sum::<f64>() <= carried.iter().sum::<f64>() * (1.0 + 1e-12));
            let all = within(carried, &lengths, &lengths);
            let sums = (all.iter().sum::<f64>(), carried.iter().sum::<f64>());
            prop_assert!((sums.0 - sums.1).abs() <= 1e-12 * sums.1, "{sums:?}");
        }
    }
}
