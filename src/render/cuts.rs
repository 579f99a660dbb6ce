//! Drawn strands of hair that has been cut.

use super::{
    curve::{Guide, strand_point},
    drawn_strand::DrawnStrand,
    followers::HairFollowers,
    present::PresentHair,
    scatter::{LEAST, WHOLE},
};
use crate::{
    base::parallel::{Nanos, for_each},
    hair::strand::FollowerCuts,
    hairdo::cut::{CutBy, HairCut},
};
use bevy::prelude::*;

/// Cuts the followers of a hair as its guides have been.
pub(super) fn cut_followers(cut: On<HairCut>, drawn: PresentHair, mut commands: Commands) {
    let HairCut { hair, by, region, .. } = *cut;
    let Some(present) = drawn.to_cut(hair) else { return };
    let mut followers = present.strands[present.roots.len()..].to_vec();
    let guide = |i: u32| present.guide(i);
    for_each(&mut followers, Nanos(5_000), |follower| {
        if region.contains(follower.place(&present.roots)) {
            follower.cut = cut_at(follower, guide, &present.settings, &by);
        }
    });
    let ends = followers.iter().map(|own| (own.cut * WHOLE).round() as u16);
    commands.entity(hair).insert(FollowerCuts(ends.collect()));
}

/// Places along a strand at which its side of a plane is looked at.
const SAMPLES: u32 = 12;
/// Halvings of the piece between two of them.
const HALVINGS: u32 = 8;

/// Where a cut leaves a follower, a share of its whole length.
fn cut_at<'a>(
    strand: &DrawnStrand,
    guide: impl Fn(u32) -> Guide<'a> + Copy,
    followers: &HairFollowers,
    by: &CutBy,
) -> f32 {
    let (point, normal) = match *by {
        CutBy::Length(length) => return strand.cut.min(length / strand.size.max(length)),
        CutBy::Plane { point, normal } => (point, normal),
    };
    let whole = DrawnStrand { cut: 1.0, ..*strand };
    let is_beyond = |t: f32| {
        (strand_point(&whole, guide, t, followers, &[]).position - point).dot(normal) > 0.0
    };
    // Guides end at the plane, so this follower goes through it near its end; some curl through it before.
    let mut places = (1..=SAMPLES).map(|i| strand.cut * i as f32 / SAMPLES as f32);
    let Some(mut beyond) = places.find(|t| is_beyond(*t)) else { return strand.cut };
    let mut before = (beyond - strand.cut / SAMPLES as f32).max(0.0);
    if before == 0.0 && is_beyond(before) {
        return strand.cut;
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (before + beyond);
        if is_beyond(middle) {
            beyond = middle;
        } else {
            before = middle;
        }
    }
    beyond.max(LEAST)
}
