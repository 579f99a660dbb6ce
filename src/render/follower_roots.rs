//! Followers with given roots, instead of roots scattered between the guides.

use super::{
    drawn_strand::{DrawnStrand, GuideRoot, direction},
    followers::HairFollowers,
};
use crate::base::{
    fault::{FaultKind, HairFault},
    grid::KdTree,
    setting::{Ranged, setting},
};
use bevy::prelude::*;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// Roots of the followers of a hair. Component of a [`Hair`](crate::Hair); where absent they are
/// scattered evenly between the guides. [`HairFollowers::count`] limits how many are drawn, an
/// evenly spaced subset; its length variation is not used, because lengths are given.
///
/// A follower follows up to three guides near its root, weighted toward those of similar rest shape.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct FollowerRoots(pub Vec<FollowerRoot>);

setting! {
   /// The root of one follower. Roots without a finite position or a length above 0 are left out;
   /// other values out of their ranges are clamped.
   #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
   #[reflect(Default, Clone, PartialEq)]
   pub struct FollowerRoot {
       /// The root's place at rest, in the hair's frame (m), as the guides' are. Roots that are planted with
       /// guides in a mesh's space are moved with them: see
       /// [`RootsOnMesh::strands_from_mesh`](crate::authoring::attach::RootsOnMesh::strands_from_mesh).
       pub place: Vec3 = Vec3::ZERO;
       /// The strand's length, up to four times that of its guides.
       pub length: f32 = 0.0, "m" in LENGTH: 0.0..=f32::INFINITY, safe 0.0..=2.0,
           "hair of a head has up to 1";
       /// From root to tip at rest (m); zero if that is not known.
       pub reach: Vec3 = Vec3::ZERO;
       /// Width as a share of [`HairLook::width`](super::HairLook::width).
       pub width: f32 = 1.0, in WIDTH: 0.0..=1e3, safe 0.3..=2.0, "1 is the look's width";
   }
}

/// Largest length of a follower, as a multiple of its guides'.
const LONGEST: f32 = 4.0;
/// How many of the nearest guides are candidates.
const NEAR: usize = 8;
/// Weight of a difference in shape relative to one in position.
const SHAPE: f32 = 0.3;
/// The same of what a guide is too short by: its shape would be scaled up.
const SHORT: f32 = 0.5;

/// A fault where followers are farther from the guides that they follow than they are long, by the median: roots
/// and guides are not in one frame.
pub(super) fn misplaced(strands: &[DrawnStrand]) -> Option<HairFault> {
    let followers = strands.iter().filter(|strand| !strand.is_guide);
    let mut off: Vec<(f32, f32)> =
        followers.map(|strand| (strand.root.length(), strand.size)).collect();
    let half = off.len() / 2;
    if off.is_empty() {
        return None;
    }
    let (_, (distance, length), _) =
        off.select_nth_unstable_by(half, |a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    (*distance > *length).then(|| {
        let message = format!(
            "followers are {distance:.3} m from the guides that they follow, more than their length: give \
             FollowerRoots in the hair's frame, as the guides are"
        );
        HairFault::new(FaultKind::Roots, message)
    })
}

/// The followers with given roots.
pub(super) fn lay_followers(
    follower_roots: &[FollowerRoot],
    guides: &[GuideRoot],
    settings: &HairFollowers,
) -> Vec<DrawnStrand> {
    let usable = |r: &FollowerRoot| r.place.is_finite() && r.length.is_finite() && r.length > 0.0;
    let follower_roots: Vec<&FollowerRoot> = follower_roots.iter().filter(|r| usable(r)).collect();
    let count = follower_roots.len().min(settings.count as usize);
    let usable = (0..).zip(guides).filter(|(_, guide)| guide.length > 0.0);
    let tree = KdTree::new(usable.map(|(i, guide)| (guide.place, i)));
    (0..count)
        .map(|k| k * follower_roots.len() / count)
        .filter_map(|i| {
            let near = tree.nearest::<NEAR>(follower_roots[i].place);
            follower(i as u32, follower_roots[i], guides, near, settings)
        })
        .collect()
}

fn follower(
    index: u32,
    own: &FollowerRoot,
    guides: &[GuideRoot],
    near: impl Iterator<Item = (u32, f32)>,
    settings: &HairFollowers,
) -> Option<DrawnStrand> {
    let shape = own.reach / own.length;
    let cost = |(i, square): (u32, f32)| {
        let guide = &guides[i as usize];
        let differ = (guide.reach / guide.length - shape) * own.length.min(guide.length);
        let differ = match own.reach == Vec3::ZERO || !differ.is_finite() {
            true => 0.0,
            false => SHAPE * SHAPE * differ.length_squared(),
        };
        let missing = SHORT * (own.length - guide.length).max(0.0);
        (square + differ + missing * missing, i)
    };
    let mut best: Vec<(f32, u32)> = near.map(cost).collect();
    best.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    // Weights fall to 0 toward the fourth guide, so that the choice is continuous.
    let fourth = best.get(3).map_or(f32::INFINITY, |fourth| fourth.0);
    best.truncate(3);
    let nearest = best.first()?.1;

    let weight = |cost: f32| match fourth.is_finite() {
        true => ((1.0 - cost / (fourth + 1e-12)).max(0.0).powi(2)).max(1e-9),
        false => 1.0 / (cost + 1e-8),
    };
    let sum: f32 = best.iter().map(|(cost, _)| weight(*cost)).sum();
    let (mut chosen, mut weights) = ([nearest; 3], [0.0; 3]);
    let (mut root, mut length) = (own.place, 0.0);
    for (k, (cost, i)) in best.iter().enumerate() {
        let guide = &guides[*i as usize];
        (chosen[k], weights[k]) = (*i, weight(*cost) / sum);
        root -= weights[k] * guide.place;
        length += weights[k] * guide.length;
    }
    // A seed of its own, so that a follower does not change when others are added or removed.
    let seed = u64::from(settings.seed) << 32 | u64::from(index);
    let random = &mut Xoshiro256PlusPlus::seed_from_u64(seed);
    let far = random.random::<f32>().powi(3) * 2.0 + 0.3;
    let share = own.length / length;
    (share.is_finite() && root.is_finite()).then(|| DrawnStrand {
        guides: chosen,
        seed: random.random(),
        weights,
        length: share.clamp(0.01, LONGEST),
        root,
        phase: (settings.phase_variation * random.random::<f32>()).min(0.5 * share),
        stray: direction(random) * (settings.stray * own.length * far),
        size: own.length,
        width: own.clamped().width,
        ..default()
    })
}

#[cfg(test)]
mod tests {
    use super::super::curve::{Guide, strand_point};
    use super::*;

    fn guide(x: f32, way: Vec3) -> GuideRoot {
        let (place, length) = (Vec3::X * x, way.length());
        GuideRoot { place, normal: Vec3::Y, length, reach: way }
    }

    fn plain(count: u32) -> HairFollowers {
        HairFollowers {
            phase_variation: 0.0,
            stray: 0.0,
            clump: 0.0,
            locks: Vec3::ZERO,
            lock_length_variation: 0.0,
            frizz: 0.0,
            flyaways: 0.0,
            ..HairFollowers::new(count)
        }
    }

    /// Root and tip as drawn.
    fn drawn(strand: &DrawnStrand, guides: &[GuideRoot]) -> (Vec3, Vec3) {
        let nodes: Vec<[Vec3; 2]> = guides.iter().map(|g| [g.place, g.place + g.reach]).collect();
        let at = |t| {
            let of = |i: u32| Guide { nodes: &nodes[i as usize], ..default() };
            strand_point(strand, of, t, &plain(0), &[]).position
        };
        (at(0.0), at(1.0))
    }

    #[test]
    fn followers_have_the_given_roots_and_lengths() {
        let guides: Vec<_> = (0..5).map(|i| guide(0.01 * i as f32, Vec3::Y * 0.2)).collect();
        let follower_roots: Vec<_> = [0.05, 0.2, 0.3]
            .iter()
            .zip(0..)
            .map(|(length, i)| FollowerRoot {
                place: Vec3::new(0.013 * i as f32 + 0.002, 0.001, 0.004),
                length: *length,
                reach: Vec3::Y * *length,
                ..default()
            })
            .collect();
        let grown = lay_followers(&follower_roots, &guides, &plain(100));
        assert_eq!(grown.len(), 3);
        for (strand, follower_roots) in grown.iter().zip(&follower_roots) {
            let (root, tip) = drawn(strand, &guides);
            assert!(
                root.distance(follower_roots.place) < 1e-6,
                "{root} for {}",
                follower_roots.place
            );
            assert!(
                tip.distance(follower_roots.place + follower_roots.reach) < 1e-5,
                "{tip} of {follower_roots:?}"
            );
            assert!((strand.weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            assert!(strand.weights[0] >= strand.weights[1].max(strand.weights[2]));
        }
        assert_eq!(lay_followers(&follower_roots, &guides, &plain(2)).len(), 2);
        assert!(lay_followers(&follower_roots, &guides, &plain(0)).is_empty());
    }

    #[test]
    fn among_near_guides_those_of_its_shape_count() {
        let guides = [guide(0.0, Vec3::Y * 0.2), guide(0.004, Vec3::X * 0.2)];
        let own = |reach| FollowerRoot { place: Vec3::X * 0.001, length: 0.2, reach, ..default() };
        for (reach, like) in [(Vec3::Y * 0.2, 0), (Vec3::X * 0.2, 1)] {
            let strand = lay_followers(&[own(reach)], &guides, &plain(1))[0];
            assert_eq!(strand.guides[0], like);
            assert!(strand.weights[0] > 0.9, "{strand:?}");
        }
    }

    #[test]
    fn long_strands_do_not_follow_a_fringe() {
        // Three short guides to the front are nearer than three long ones that hang.
        let short = (0..3).map(|i| guide(0.002 * i as f32, Vec3::Z * 0.06));
        let long = (0..3).map(|i| guide(0.02 + 0.002 * i as f32, Vec3::NEG_Y * 0.25));
        let guides: Vec<_> = short.chain(long).collect();
        let place = Vec3::X * 0.009;
        let own = FollowerRoot { place, length: 0.25, reach: Vec3::NEG_Y * 0.25, ..default() };
        let strand = lay_followers(&[own], &guides, &plain(1))[0];
        let followed = strand.guides.iter().zip(strand.weights).filter(|(_, w)| *w > 1e-6);
        assert!(followed.clone().all(|(i, _)| *i >= 3), "{strand:?}");
        assert!(followed.count() > 0);
    }

    #[test]
    fn broken_roots_and_guides_are_left_out() {
        let nan = FollowerRoot { place: Vec3::NAN, length: 0.1, reach: Vec3::Y, ..default() };
        let flat = FollowerRoot { length: 0.0, ..default() };
        let good = FollowerRoot { length: 0.1, ..default() };
        let guides = [guide(0.0, Vec3::Y), guide(f32::NAN, Vec3::Y), guide(0.1, Vec3::ZERO)];
        let grown = lay_followers(&[nan, flat, good], &guides, &plain(9));
        assert_eq!(grown.len(), 1);
        assert_eq!(grown[0].guides, [0; 3]);
        assert!(lay_followers(&[good], &[], &plain(9)).is_empty());
    }

    #[test]
    fn roots_in_another_frame_than_the_guides_are_noticed() {
        let guides: Vec<_> = (0..9).map(|i| guide(0.01 * i as f32, Vec3::Y * 0.2)).collect();
        let roots = |off: Vec3| -> Vec<FollowerRoot> {
            let each = guides.iter().map(|guide| guide.place + off + Vec3::Z * 3e-3);
            each.map(|place| FollowerRoot { place, length: 0.2, ..default() }).collect()
        };
        let laid = |off| lay_followers(&roots(off), &guides, &plain(100));
        assert_eq!(misplaced(&laid(Vec3::ZERO)), None);
        let fault = misplaced(&laid(Vec3::Y * 1.6)).expect("as high as a head");
        assert_eq!(fault.kind, FaultKind::Roots);
        assert!(fault.message.contains("are 1.600 m from"), "{}", fault.message);
        assert_eq!(misplaced(&[]), None);
        assert_eq!(misplaced(&[DrawnStrand::guide(0)]), None);
    }
}
