//! Drawn strands of hair that has been cut.

use super::{
    curve::{Guide, strand_point},
    draw::{Packed, guide_root},
    drawn_strand::{DrawnStrand, GuideEnd},
    follower_roots::FollowerRoots,
    followers::HairFollowers,
    scatter::{LEAST, WHOLE, scatter, shorten},
};
use crate::{
    base::{
        parallel::{Nanos, for_each},
        setting::Settings,
    },
    hair::strand::{CutStrand, FollowerCuts, Strand},
    hairdo::cut::{CutBy, HairCut},
    water::Moisture,
};
use bevy::prelude::*;

/// Cuts the followers of a hair as its guides have been.
pub(super) fn cut_followers(
    cut: On<HairCut>,
    hairs: Query<(&Packed, Option<&FollowerRoots>, Option<&FollowerCuts>)>,
    settings: Settings<HairFollowers>,
    strands: Query<(&Strand, Option<&CutStrand>, Option<&Moisture>)>,
    mut commands: Commands,
) {
    let HairCut { hair, by, region, .. } = *cut;
    let Ok((packed, follower_roots, cuts)) = hairs.get(hair) else { return };
    let guides = packed.guides().map_while(|guide| {
        let (strand, cut, water) = strands.get(guide).ok()?;
        Some((strand, cut.filter(|cut| cut.fits(strand.nodes())), water))
    });
    let guides: Vec<_> = guides.collect();
    let settings = settings.of(hair);
    if guides.is_empty() || guides.len() != packed.guides().len() {
        return;
    }
    let roots = packed.known_roots(follower_roots).map_or_else(
        || guides.iter().map(|(strand, cut, _)| guide_root(strand, *cut)).collect(),
        <[_]>::to_vec,
    );
    let end = |(strand, cut, _): &(&Strand, Option<&CutStrand>, Option<&Moisture>)| {
        cut.map_or_else(|| GuideEnd::whole(strand.nodes() as u32), GuideEnd::from)
    };
    let ends: Vec<_> = guides.iter().map(end).collect();
    let mut drawn = scatter(&roots, follower_roots, &settings);
    let count = drawn.len() - ends.len();
    let before = cuts.filter(|cuts| cuts.0.len() == count).cloned();
    shorten(
        &mut drawn,
        &ends,
        Some(&before.unwrap_or_else(|| FollowerCuts(vec![u16::MAX; count]))),
    );
    let guide = |i: u32| {
        let (strand, cut, water) = guides[i as usize];
        Guide {
            nodes: strand.positions(),
            moisture: water.map_or(&[], Moisture::sheen),
            end: cut.map(GuideEnd::from),
        }
    };
    let followers = &mut drawn[ends.len()..];
    for_each(followers, Nanos(5_000), |follower| {
        if region.contains(follower.place(&roots)) {
            follower.cut = cut_at(follower, guide, &settings, &by);
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
