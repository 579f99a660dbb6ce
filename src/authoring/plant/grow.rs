//! How strands grow from their roots: an axis integrated in steps, and a helix around it.

use super::{
    map::{PlantingMaps, RootPlace},
    recipe::{CombPattern, Curl, CurlPhase, Planting},
    shell::{Shell, SurfaceQuery},
    surface::{Root, Surface},
};
use crate::{
    base::grid::{KdTree, UniformGrid},
    hair::strand::MIN_SEGMENT,
};
use bevy::{
    math::ops::{cos, sin, sin_cos, tan},
    prelude::*,
};
use core::f32::consts::{FRAC_PI_2, TAU};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// Steps along the axis for each turn of a curl, and between two nodes.
const STEPS_A_TURN: f32 = 24.0;
const STEPS_A_NODE: u32 = 2;
const MAX_STEPS: usize = 100_000;

/// The random numbers of a strand.
struct StrandRandom {
    length: f32,
    way: Vec3,
    normal: Vec3,
    outward: f32,
    curl: Option<Curl>,
    phase: f32,
    /// How a curl drifts, and how its plane is turned about the strand (rad).
    drift: u32,
    plane: f32,
    clearance: f32,
}

/// How far the planes of flat curls are turned out of the scalp's at most (rad).
const MOST_TURNED: f32 = 0.7;
/// Turns in which a curl's drift goes from one random number to the next.
const DRIFT_TURNS: f32 = 1.5;

/// The polyline of each root of a surface, kept out of a `solid`; `None` where the length map leaves it bald.
pub(super) fn grow(
    planting: &Planting,
    maps: &PlantingMaps,
    surface: &Surface,
    solid: &Surface,
    roots: &[Root],
) -> Vec<Option<Vec<Vec3>>> {
    let leaders = leaders(planting, maps, roots);
    let draws = draw_random(planting, maps, surface, roots, &leaders);
    let steps = steps(planting);
    let reach = draws.iter().map(|drawn| drawn.clearance).fold(0.0, f32::max);
    let shell = planting.drape.map(|drape| Shell::of(solid, reach, 0.6 * drape.over));
    let axis_of = |i: usize, leader: Option<&[Vec3]>| {
        axis(planting, &roots[i].place, &draws[i], shell.as_ref(), steps, leader)
    };
    // Leaders of locks first, because the others follow them.
    let is_leader = |i: usize| leaders[i] == i;
    let mut axes: Vec<Vec<Vec3>> = (0..roots.len())
        .map(|i| if is_leader(i) { axis_of(i, None) } else { Vec::new() })
        .collect();
    for i in 0..roots.len() {
        if !is_leader(i) {
            axes[i] = axis_of(i, Some(&axes[leaders[i]]));
        }
    }
    (axes.iter().zip(&draws)).map(|(axis, drawn)| finish(planting, axis, drawn)).collect()
}

/// How alike the ways of two strands of a lock are at least, as a cosine: locks do not reach across a
/// parting.
const ALIKE: f32 = 0.5;

/// For each root the leader of its lock: the nearest of a subset with the given spacing, among those that
/// are combed a similar way.
fn leaders(planting: &Planting, maps: &PlantingMaps, roots: &[Root]) -> Vec<usize> {
    let Some(clump) = planting.clump else {
        return (0..roots.len()).collect();
    };
    let mut grid = UniformGrid::default();
    let place = |i: usize| roots[i].place.position;
    let ways: Vec<Vec3> = roots.iter().map(|root| combed(planting, maps, &root.place)).collect();
    let is_alike = |i: usize, j: usize| ways[i].dot(ways[j]) > ALIKE;
    grid.build(clump.spacing, (0..roots.len()).map(place).zip(0u32..));
    let mut is_middle = vec![false; roots.len()];
    for i in 0..roots.len() {
        let mut is_free = true;
        grid.for_each_near(place(i), |j| {
            let j = j as usize;
            let near = place(i).distance(place(j)) < clump.spacing;
            is_free &= !(near && is_middle[j] && is_alike(i, j));
        });
        is_middle[i] = is_free;
    }
    let middles = (0..).zip(&is_middle).filter(|(_, is_middle)| **is_middle);
    let middles = KdTree::new(middles.map(|(i, _)| (place(i as usize), i)));
    let leader = |i: usize| {
        let is_meant = |j: u32, _| is_alike(i, j as usize);
        let mut near = middles.nearest_of::<1, _>(place(i), is_meant);
        near.next().map_or(i, |(j, _)| j as usize)
    };
    (0..roots.len()).map(|i| if is_middle[i] { i } else { leader(i) }).collect()
}

fn draw_random(
    planting: &Planting,
    maps: &PlantingMaps,
    surface: &Surface,
    roots: &[Root],
    leaders: &[usize],
) -> Vec<StrandRandom> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(planting.seed ^ 0x60b0_d4a1);
    // Of their own, so that strands without are as before there were these.
    let mut of_curls = Xoshiro256PlusPlus::seed_from_u64(planting.seed ^ 0x5f35_6495);
    let up = planting.drape.map_or(Vec3::ZERO, |drape| -drape.toward.normalize_or_zero());
    let lowest = roots.iter().map(|r| r.place.position.dot(up)).fold(f32::MAX, f32::min);
    let mut draws: Vec<StrandRandom> = Vec::with_capacity(roots.len());
    for root in roots {
        // The same number of draws for each strand, so that a setting does not reshuffle the rest.
        let [short, tilt, around, phase, handedness, wide, long, layer] =
            [(); 8].map(|()| random.random::<f32>());
        let place = &root.place;
        let length =
            planting.length * maps.length_at(place) * (1.0 - planting.length_variation * short);
        let flat = surface.flat_normal(root.triangle as usize);
        let combed = combed(planting, maps, place);
        let way = off_the_scalp(jittered(combed, planting.jitter * tilt.sqrt(), around), flat);
        let vary = |x: f32, variation: f32| 1.0 + variation * (2.0 * x - 1.0);
        let curl = planting.curl.map(|curl| Curl {
            radius: curl.radius * vary(wide, curl.variation),
            // A negative pitch turns the other way.
            pitch: curl.pitch
                * vary(long, curl.variation)
                * if handedness < 0.5 && curl.phase != CurlPhase::Same { -1.0 } else { 1.0 },
            ..curl
        });
        let phase = match planting.curl {
            Some(Curl { phase: CurlPhase::Same, .. }) => 0.0,
            _ => phase * TAU,
        };
        let clearance = planting.drape.map_or(0.0, |drape| {
            let layers = drape.layering * (place.position.dot(up) - lowest);
            (drape.clearance + layers * (0.6 + 0.8 * layer)) + curl.map_or(0.0, |c| c.radius)
        });
        draws.push(StrandRandom {
            length,
            way,
            normal: flat,
            outward: way.dot(flat),
            curl,
            phase,
            drift: of_curls.random(),
            plane: MOST_TURNED * (2.0 * of_curls.random::<f32>() - 1.0),
            clearance,
        });
    }
    if planting.curl.is_some_and(|curl| curl.phase == CurlPhase::PerClump) {
        for (i, &leader) in leaders.iter().enumerate() {
            let StrandRandom { phase, drift, plane, .. } = draws[leader];
            (draws[i].phase, draws[i].drift, draws[i].plane) = (phase, drift, plane);
            let pitch = draws[leader].curl.map_or(1.0, |curl| curl.pitch);
            if let Some(curl) = &mut draws[i].curl {
                curl.pitch = curl.pitch.abs().copysign(pitch);
            }
        }
    }
    draws
}

/// The direction in which a strand leaves the surface.
fn combed(planting: &Planting, maps: &PlantingMaps, place: &RootPlace) -> Vec3 {
    let comb = maps.direction_at(place).unwrap_or_else(|| match planting.comb {
        CombPattern::Out => Vec3::ZERO,
        CombPattern::Along(along) => along,
        CombPattern::Whorl { center, turn } => {
            let away = place.position - center;
            let away = away.reject_from_normalized(place.normal).normalize_or_zero();
            Quat::from_axis_angle(place.normal, turn) * away
        }
        CombPattern::Parted { at, across, along } => {
            let side = (place.position - at).dot(across);
            across * if side < 0.0 { -1.0 } else { 1.0 } + along
        }
    });
    let along = comb.normalize_or_zero().reject_from_normalized(place.normal);
    if !along.is_finite() || along.length_squared() < 1e-12 {
        return place.normal;
    }
    let (sine, cosine) = sin_cos(planting.lean);
    place.normal * cosine + along.normalize() * sine
}

fn jittered(way: Vec3, angle: f32, around: f32) -> Vec3 {
    let (x, y) = way.any_orthonormal_pair();
    let (sine, cosine) = sin_cos(around * TAU);
    (way + (x * cosine + y * sine) * tan(angle.min(1.5))).normalize_or(way)
}

/// The direction with at least a small outward component.
fn off_the_scalp(way: Vec3, normal: Vec3) -> Vec3 {
    const LEAST: f32 = 0.1;
    let out = way.dot(normal);
    if out >= LEAST {
        return way;
    }
    let along = (way - normal * out).normalize_or_zero();
    (along * (1.0 - LEAST * LEAST).sqrt() + normal * LEAST).normalize_or(normal)
}

/// The number of steps of every axis.
fn steps(planting: &Planting) -> usize {
    let between_nodes = ((planting.nodes - 1) * STEPS_A_NODE) as usize;
    let turns = planting.curl.map_or(0.0, |curl| {
        let tightest = 1.0 - curl.variation;
        let tight = Curl { radius: curl.radius * tightest, pitch: curl.pitch * tightest, ..curl };
        axis_length(planting.length, Some(&tight)) / tight.pitch
    });
    between_nodes.max((turns * STEPS_A_TURN) as usize).min(MAX_STEPS)
}

/// The length of an axis for a strand of `length` (m), with some margin.
fn axis_length(length: f32, curl: Option<&Curl>) -> f32 {
    curl.map_or(length, |curl| {
        let pitch = curl.pitch.abs();
        1.1 * length * pitch / curl.turn_length() + pitch
    })
}

/// The line that a strand follows, in steps of equal length.
fn axis(
    planting: &Planting,
    place: &RootPlace,
    drawn: &StrandRandom,
    shell: Option<&Shell>,
    steps: usize,
    leader: Option<&[Vec3]>,
) -> Vec<Vec3> {
    let step = axis_length(drawn.length, drawn.curl.as_ref()) / steps as f32;
    let strength = planting.clump.map_or(0.0, |clump| clump.strength);
    let mut way = drawn.way;
    let mut points = Vec::with_capacity(steps + 1);
    points.push(place.position);
    let mut query = SurfaceQuery::default();
    for i in 0..steps {
        let from = points[i];
        if let Some(drape) = planting.drape {
            way = (way + drape.toward.normalize_or_zero() * (step / drape.over)).normalize_or(way);
        }
        let mut go = way;
        if let Some(leader) = leader {
            // So that the remaining distance is 1 − strength · share².
            let share = i as f32 / steps as f32;
            let lead = leader[i + 1] - leader[i];
            let along = lead.normalize_or(way);
            let closing = 2.0 * strength * share / (1.0 - strength * share * share) / steps as f32;
            let other = (leader[i] - from).reject_from_normalized(along);
            way = way.lerp(along, (2.0 * share).min(1.0)).normalize_or(along);
            go = (way * step + other * closing).normalize_or(way);
        }
        let mut next = from + go * step;
        if let Some(shell) = shell {
            // The clearance grows gradually: hair lies flat at its roots.
            let clearance = drawn.clearance.min(0.4 * step * (i + 1) as f32);
            if let Some((depth, off)) = shell.depth(next, clearance, &mut query) {
                go = (next + off * depth - from).normalize_or(off);
                next = from + go * step;
                // Along the surface, so that the push does not bend it outward.
                way = (go - off * go.dot(off).max(0.0) * 0.5).normalize_or(go);
            }
        }
        points.push(next);
    }
    points
}

/// Curls, cuts and resamples an axis to the number of nodes.
fn finish(planting: &Planting, axis: &[Vec3], drawn: &StrandRandom) -> Option<Vec<Vec3>> {
    let segments = (planting.nodes - 1) as usize;
    let curled = drawn.curl.map(|curl| curled(axis, &curl, drawn));
    let line = curled.as_deref().unwrap_or(axis);
    let mut length = drawn.length;
    if let Some(cut) = planting.cut {
        let is_off = |p: &Vec3| (p - cut.at).dot(cut.normal) < 0.0;
        if let Some(i) = axis.iter().position(is_off) {
            let up_to: f32 = line[..=i].windows(2).map(|p| p[0].distance(p[1])).sum();
            length = length.min(up_to.max(cut.least));
        }
    }
    let segment = length / segments as f32;
    // Too short for distinct nodes.
    (segment > 10.0 * MIN_SEGMENT).then(|| resampled(line, segment, segments))
}

/// The helix around an axis.
fn curled(axis: &[Vec3], curl: &Curl, drawn: &StrandRandom) -> Vec<Vec3> {
    let tangent = |i: usize| {
        let (a, b) = (axis[i.saturating_sub(1)], axis[(i + 1).min(axis.len() - 1)]);
        (b - a).normalize_or(drawn.way)
    };
    let step = axis[0].distance(axis[1]);
    let mut along = tangent(0);
    let mut across = match curl.flatness > 0.0 {
        true => {
            let aside = drawn.normal.cross(along).normalize_or(along.any_orthonormal_vector());
            Quat::from_axis_angle(along, drawn.plane) * aside
        }
        false => along.any_orthonormal_vector(),
    };
    let round = 1.0 - curl.flatness;
    let grown_over = 0.5 * curl.pitch.abs();
    (0..axis.len())
        .map(|i| {
            let next = tangent(i);
            across = Quat::from_rotation_arc(along, next) * across;
            across = across.reject_from_normalized(next).normalize_or(across);
            along = next;
            let passed = step * i as f32;
            let [sooner, wider] = match curl.drift > 0.0 {
                true => [0, 1].map(|of| {
                    let turns = passed / curl.pitch.abs() / DRIFT_TURNS;
                    curl.drift * noise(drawn.drift.wrapping_add(of), turns)
                }),
                false => [0.0, 0.0],
            };
            let angle = drawn.phase + TAU * passed / curl.pitch + TAU * sooner;
            // The radius grows from the root on, no faster than the axis leaves the scalp.
            let grown = (passed / grown_over).min(1.0);
            let grown = sin(grown * FRAC_PI_2);
            let radius = curl.radius * (1.0 + wider);
            let radius = (radius * grown * grown).min(0.7 * drawn.outward * passed);
            let side = along.cross(across) * round;
            axis[i] + (across * cos(angle) + side * sin(angle)) * radius
        })
        .collect()
}

/// Smooth noise in −1 ... 1, random at each whole number.
fn noise(seed: u32, at: f32) -> f32 {
    let (piece, share) = (at.max(0.0).floor(), at.max(0.0).fract());
    let knot = |after: u32| {
        let knot = u64::from(seed) << 32 | u64::from(piece as u32 + after);
        Xoshiro256PlusPlus::seed_from_u64(knot).random::<f32>()
    };
    2.0 * knot(0).lerp(knot(1), share * share * (3.0 - 2.0 * share)) - 1.0
}

/// Resamples a line to `segments` pieces of that length, extended straight if it is too short.
fn resampled(line: &[Vec3], segment: f32, segments: usize) -> Vec<Vec3> {
    let mut points = Vec::with_capacity(segments + 1);
    points.push(line[0]);
    let (mut i, mut start) = (0, 0.0);
    for k in 1..=segments {
        let wanted = segment * k as f32;
        let mut piece = line[i].distance(line[i + 1]);
        while start + piece < wanted && i + 2 < line.len() {
            start += piece;
            i += 1;
            piece = line[i].distance(line[i + 1]);
        }
        let way = (line[i + 1] - line[i]) / piece.max(1e-12);
        let at = line[i] + way * (wanted - start);
        // In a narrow cleft a line may come back to where it was.
        let last = points[k - 1];
        let is_new = last.distance_squared(at) > (0.01 * segment).powi(2);
        points.push(if is_new { at } else { last + way.normalize_or(Vec3::Y) * segment });
    }
    points
}
