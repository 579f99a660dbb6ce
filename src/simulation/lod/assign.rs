//! Which guides each follower follows.

use super::{
    follow::{GUIDES, GuideOffsets, StrandState},
    guides::{GroupStrand, Guides},
    model::waypoints,
};
use crate::{
    base::{
        grid::KdTree,
        parallel::{Nanos, for_each},
    },
    hair::strand::Strand,
};
use bevy::prelude::*;

/// How many of the nearest guides are candidates; the most similar ones are taken.
const CANDIDATES: usize = 8;

/// Below this simulated share of the strands each follower has one guide.
const SINGLE_GUIDE_SHARE: f32 = 0.125;

/// Distance from a guide below which its weight hardly grows (m).
const ALIKE: f32 = 1e-3;

/// Assigns followers without guides those that are near and similar.
pub(super) fn assign_guides(
    members: &mut [GroupStrand<'_>],
    strands: &[Ref<'_, Strand>],
    guides: &mut Guides,
) {
    let is_loose = |m: &GroupStrand<'_>| {
        m.free && m.follower.guide.is_none() && m.follower.offsets.guides.is_empty()
    };
    if !members.iter().any(is_loose) {
        return;
    }
    if guides.strands.is_empty() {
        // Frozen hair has no guides.
        for (member, strand) in members.iter_mut().zip(strands) {
            if is_loose(member) && !member.sleep.is_follower() {
                member.sleep.bypass_change_detection().set_follower(true);
                member.follower.bypass_change_detection().root = waypoints(strand)[0];
            }
        }
        return;
    }
    let mut ahead: Vec<Option<&Strand>> = vec![None; guides.strands.len()];
    for (member, strand) in members.iter().zip(strands) {
        if let Some(place) = member.follower.guide.and_then(|i| ahead.get_mut(i as usize)) {
            *place = Some(strand);
        }
    }
    // Guides may have been written to since the last tick.
    ahead.iter().enumerate().for_each(|(i, strand)| guides.update_pose(i, *strand));
    let guides = &*guides;
    // With so few guides it does not show that neighbours move alike.
    let most = if (guides.strands.len() as f32) < SINGLE_GUIDE_SHARE * members.len() as f32 {
        1
    } else {
        GUIDES
    };
    let waypoints_of: Vec<[Vec3; 3]> =
        ahead.iter().map(|s| s.map_or([Vec3::ZERO; 3], waypoints)).collect();
    let nearest = KdTree::new(waypoints_of.iter().map(|c| c[0]).zip(0..));
    let mut loose: Vec<_> = (members.iter_mut())
        .zip(strands)
        .filter(|(m, _)| is_loose(m))
        .map(|(m, strand)| {
            m.sleep.bypass_change_detection().set_follower(true);
            (m.follower.bypass_change_detection(), &**strand)
        })
        .collect();
    for_each(&mut loose, Nanos(5_000), |(follower, strand)| {
        let own = waypoints(strand);
        let mut found: Vec<(f32, u32, StrandState<'_>)> = nearest
            .nearest::<CANDIDATES>(own[0])
            .filter_map(|(index, _)| {
                let i = index as usize;
                let guide = ahead[i]?;
                let apart = waypoints_of[i].iter().zip(own).map(|(a, b)| a.distance_squared(b));
                let turns = guides.turns(index)?;
                Some((apart.sum::<f32>() / 3.0, index, StrandState { turns, ..state_of(guide) }))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(most);
        let weight = |apart: f32| 1.0 / (apart + ALIKE * ALIKE);
        let sum: f32 = found.iter().map(|f| weight(f.0)).sum();
        let guides = found.into_iter().map(|(apart, i, guide)| (i, weight(apart) / sum, guide));
        follower.offsets = GuideOffsets::new(state_of(strand), guides);
        follower.root = own[0];
    });
}

fn state_of(strand: &Strand) -> StrandState<'_> {
    StrandState {
        positions: strand.positions(),
        velocities: strand.velocities(),
        turns: strand.orientations(),
        lengths: strand.rest_lengths(),
    }
}
