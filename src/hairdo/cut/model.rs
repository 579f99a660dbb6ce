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
