//! Ears, nose and chin of a head, found from its shape.

use super::part::HEAD_WEIGHT;
use crate::authoring::plant::{Scalp, SurfacePoint};
use bevy::{math::ops::atan2, prelude::*};
use core::ops::Range;

/// Points of a head's surface that landmarks are found by.
pub(super) const POINTS: usize = 20_000;
/// The upper end of the ears above the middle between them, as a share of the height from there to the crown.
const EAR_TOP: f32 = 0.126;
/// Ears stand out of the skull's width above them by this share at least.
const STANDS_OUT: f32 = 1.06;
/// Where that width is measured, and where ears are looked for, in heights of the head.
const SKULL: Range<f32> = 0.25..0.55;
const EARS: Range<f32> = -0.7..0.28;
/// How long and deep what stands out may be, and how far the two sides may differ, in heights of the head.
const EAR_LENGTH: Range<f32> = 0.12..0.7;
const EAR_DEPTH: Range<f32> = 0.05..0.45;
const UNEVEN: f32 = 0.15;
/// Samples on a side that are an ear.
const MIN_EAR_SAMPLES: usize = 10;
/// Half the width of the strip of a face in which its profile is taken, the step of the profile and half of the height
/// of a bin, in heights of the head.
const STRIP: f32 = 0.1;
const STEP: f32 = 0.04;
const BIN: f32 = 0.03;
/// Where the tip of a nose is looked for.
const NOSE: Range<f32> = -0.9..0.1;
/// How far a nose stands out of what is above and below it, and how far up and down that is looked for.
const ABOVE: (f32, f32) = (0.02, 0.24);
const BELOW: (f32, f32) = (0.05, 0.2);
/// Its base is where so much of the way back from its tip is gone.
const BASE: f32 = 0.6;
/// The chin ends where the profile is at this share of the base of the nose.
const CHIN: f32 = 0.8;

/// The middle between the ears of a head whose surface has these points, up along Y, looking along −Z, `height` (m)
/// from its middle to its crown; and that height from there. `None` where no pair of ears stands out.
pub(super) fn by_ears(points: &[SurfacePoint], height: f32) -> Option<(Vec3, f32)> {
    let of_head = || points.iter().filter(|p| p.red > HEAD_WEIGHT).map(|p| p.at / height);
    let mut widths: Vec<f32> =
        of_head().filter(|p| SKULL.contains(&p.y)).map(|p| p.x.abs()).collect();
    widths.sort_by(f32::total_cmp);
    let wide = *widths.iter().rev().nth(MIN_EAR_SAMPLES)?;
    // Upper end and middle from front to back.
    let side = |sign: f32| {
        let outside = |p: &Vec3| sign * p.x > STANDS_OUT * wide && EARS.contains(&p.y);
        let ear: Vec<Vec3> = of_head().filter(outside).collect();
        let span = |axis: fn(&Vec3) -> f32| {
            let mut all: Vec<f32> = ear.iter().map(axis).collect();
            all.sort_by(f32::total_cmp);
            let few = all.len() / 50;
            [all.get(few).copied(), all.get(all.len().wrapping_sub(1 + few)).copied()]
        };
        let [Some(low), Some(high)] = span(|p| p.y) else { return None };
        let [Some(front), Some(back)] = span(|p| p.z) else { return None };
        let is_ear = ear.len() >= MIN_EAR_SAMPLES
            && EAR_LENGTH.contains(&(high - low))
            && EAR_DEPTH.contains(&(back - front));
        is_ear.then_some(Vec2::new(high, 0.5 * (front + back)))
    };
    let (left, right) = (side(-1.0)?, side(1.0)?);
    if left.distance(right) > UNEVEN {
        return None;
    }
    let ears = 0.5 * (left + right);
    let new = (1.0 - ears.x) / (1.0 - EAR_TOP);
    Some((Vec3::new(0.0, 1.0 - new, ears.y) * height, new * height))
}

/// The elevations (rad) of the base of the nose and of the chin at the middle of the head, for
/// [`Scalp::nose`] and [`Scalp::chin`]. `None` where no nose stands out.
pub(super) fn face(points: &[SurfacePoint], scalp: &Scalp) -> Option<[f32; 2]> {
    let [right, up, front] = scalp.axes();
    let of_head = points.iter().filter(|p| p.red > HEAD_WEIGHT);
    let strip = of_head.map(|p| (p.at - scalp.center) / scalp.height);
    let strip: Vec<Vec2> = strip
        .filter(|p| p.dot(right).abs() < STRIP && p.dot(front) > 0.0)
        .map(|p| Vec2::new(p.dot(front), p.dot(up)))
        .collect();
    let at = |high: f32| {
        let bin = strip.iter().filter(|p| (p.y - high).abs() < BIN);
        bin.map(|p| p.x).reduce(f32::max)
    };
    // From above down.
    let steps = (0..).map(|k| 0.5 - STEP * k as f32).take_while(|high| *high > -1.5);
    let profile: Vec<Vec2> = steps.filter_map(|high| Some(Vec2::new(at(high)?, high))).collect();
    let within = |range: Range<f32>| profile.iter().filter(move |p| range.contains(&p.y));
    let least = |range: Range<f32>| within(range).map(|p| p.x).reduce(f32::min);
    let tip = within(NOSE).find(|tip| {
        let near = within(tip.y - 0.16..tip.y + 0.16).all(|p| p.x <= tip.x);
        let above = least(tip.y..tip.y + ABOVE.1).is_some_and(|x| tip.x - x > ABOVE.0);
        near && above && least(tip.y - BELOW.1..tip.y).is_some_and(|x| tip.x - x > BELOW.0)
    })?;
    let back = BASE * (tip.x - least(tip.y - BELOW.1..tip.y)?);
    let nose = profile.iter().find(|p| p.y < tip.y && p.x <= tip.x - back)?;
    let chin =
        profile.iter().filter(|p| p.y < nose.y).take_while(|p| p.x > CHIN * nose.x).last()?;
    Some([nose, chin].map(|p| atan2(p.y, p.x)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points all over an ellipsoid.
    fn ball(at: Vec3, half: Vec3, count: usize) -> Vec<SurfacePoint> {
        let place = |i: usize| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let (sine, cosine) = (i as f32 * 2.399_963).sin_cos();
            let normal = Vec3::new(cosine * (1.0 - y * y).sqrt(), y, sine * (1.0 - y * y).sqrt());
            SurfacePoint { at: at + normal * half, normal, red: 1.0 }
        };
        (0..count).map(place).collect()
    }

    /// A skull of 12 cm with ears whose tops are at `ears` (up and back, m), a nose that ends at `nose` (up, m) and
    /// a chin.
    fn head(ears: Vec2, nose: f32) -> Vec<SurfacePoint> {
        let mut all = ball(Vec3::ZERO, Vec3::new(0.077, 0.12, 0.098), 16_000);
        for side in [-1.0, 1.0] {
            let half = Vec3::new(0.012, 0.03, 0.016);
            all.extend(ball(Vec3::new(side * 0.077, ears.x - half.y, ears.y), half, 800));
        }
        all.extend(ball(Vec3::new(0.0, nose + 0.02, -0.095), Vec3::new(0.012, 0.02, 0.022), 1500));
        all
    }

    #[test]
    fn the_middle_is_between_the_ears_wherever_they_are() {
        for ears in [Vec2::new(0.015, 0.0), Vec2::new(-0.005, 0.02), Vec2::new(-0.02, -0.01)] {
            let (center, height) = by_ears(&head(ears, -0.04), 0.12).unwrap();
            assert!((center.z - ears.y).abs() < 2e-3, "{center} for {ears}");
            // What stands out begins a little below the very top.
            assert!((center.y + EAR_TOP * height - ears.x).abs() < 5e-3, "{center} for {ears}");
            assert!((center.y + height - 0.12).abs() < 1e-5);
        }
    }

    #[test]
    fn a_head_without_ears_or_with_one_keeps_its_middle() {
        let one = |p: &SurfacePoint| p.at.x < 0.07;
        let all: Vec<SurfacePoint> = head(Vec2::ZERO, -0.04).into_iter().filter(one).collect();
        assert_eq!(by_ears(&all, 0.12), None);
        assert_eq!(by_ears(&ball(Vec3::ZERO, Vec3::splat(0.1), 4000), 0.1), None);
        assert_eq!(by_ears(&[], 0.1), None);
        let body = head(Vec2::ZERO, -0.04).into_iter().map(|p| SurfacePoint { red: 0.0, ..p });
        assert_eq!(by_ears(&body.collect::<Vec<_>>(), 0.12), None);
    }

    #[test]
    fn the_base_of_the_nose_is_found_and_none_where_there_is_none() {
        let scalp = Scalp { front: Dir3::NEG_Z, height: 0.12, ..default() };
        for nose in [-0.03, -0.045, -0.06] {
            let [found, chin] = face(&head(Vec2::ZERO, nose), &scalp).unwrap();
            // On the skull.
            let expected = atan2(nose, 0.098 * (1.0 - (nose / 0.12) * (nose / 0.12)).sqrt());
            assert!((found - expected).abs() < 0.06, "{found} for {expected}");
            assert!(chin < found - 0.1);
        }
        assert_eq!(face(&ball(Vec3::ZERO, Vec3::new(0.077, 0.12, 0.098), 16_000), &scalp), None);
        assert_eq!(face(&[], &scalp), None);
    }
}
