//! Hair that is there to be seen only: brows and lashes, and a head of hair that is put up. It moves with
//! the head it is on, and nothing of it is simulated.

use crate::mannequin::{EYE, LID, gradient, head, lash_line};
use bevy::{math::ops::sin_cos, prelude::*};
use bevy_keratin::{
    authoring::{
        groom::Groom,
        plant::{HairPreset, Hairline, Planted, Scalp},
    },
    prelude::*,
    render::{FollowerRoot, FollowerRoots, HairFollowers, HairView, Melanin},
    simulation::lod::LodLevel,
};
use core::f32::consts::{PI, TAU};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// The scalp of the training head as it lies.
pub fn scalp() -> Scalp {
    Scalp { up: Dir3::X, front: Dir3::Y, height: 0.118, ..default() }
}

/// Hair that nobody simulates: frozen at any size.
#[derive(Clone)]
pub struct Carried {
    strands: Vec<Strand>,
    roots: FollowerRoots,
    followers: HairFollowers,
    /// Its own look; otherwise that of all hair.
    look: Option<HairLook>,
}

impl Carried {
    fn new(
        guides: impl Iterator<Item = impl AsRef<[Vec3]>>,
        roots: FollowerRoots,
        followers: HairFollowers,
    ) -> Result<Self> {
        let strands = guides.map(|points| Strand::from_polyline(points.as_ref()));
        let strands = strands.collect::<Result<_, _>>()?;
        let count = roots.0.len() as u32;
        Ok(Self { strands, roots, followers: HairFollowers { count, ..followers }, look: None })
    }

    /// Grows it.
    pub fn spawn(&self, commands: &mut Commands) -> Entity {
        let frozen = LodLevel { below: 100.0, strands: 0.0, ..default() };
        let lod = HairLod { levels: vec![frozen], ..default() };
        let (roots, followers) = (self.roots.clone(), self.followers);
        let mut hair = commands.spawn((Hair, lod, HairView::Natural, roots, followers));
        if let Some(look) = &self.look {
            hair.insert(look.clone());
        }
        let hair = hair.id();
        for strand in &self.strands {
            commands.spawn((StrandOf(hair), strand.clone()));
        }
        hair
    }
}

/// Puts a point onto the skin, `above` it (m).
fn onto_skin(mut p: Vec3, above: f32) -> Vec3 {
    for _ in 0..6 {
        p += gradient(&head, p, 3e-4) * (above - head(p));
    }
    p
}

/// From a place on the skin the given way, turning by `curl` (rad) about the axis that way has with
/// the normal, in five nodes.
fn tuft(root: Vec3, way: Vec3, curl: f32, length: f32) -> [Vec3; 5] {
    let normal = gradient(&head, root, 3e-4);
    let axis = way.cross(normal).normalize_or(Vec3::Z);
    let mut points = [root; 5];
    for i in 1..5 {
        let turn = Quat::from_axis_angle(axis, curl * i as f32 / 4.0);
        points[i] = points[i - 1] + turn * way.normalize() * (0.25 * length);
    }
    points
}

/// The colour of brows and lashes that suits hair: darker.
pub fn brows(hair: Melanin) -> Melanin {
    let Melanin { eumelanin, pheomelanin } = hair;
    Melanin::new((eumelanin * 1.3).max(0.35), pheomelanin)
}

/// One brow hair or lash of so many is a guide of those around it.
const GUIDE_OF: usize = 6;

/// Brows and lashes of one side, along +z.
fn face_hair() -> Vec<[Vec3; 5]> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut hairs = Vec::new();
    for i in 0..260 {
        let [across, along, off, long] = random.random::<[f32; 4]>();
        let t = ((i as f32 + along) / 260.0).clamp(0.0, 1.0);
        // From the nose up to the arch and down to the temple; thin at both ends.
        let z = 0.0125 + 0.0375 * t;
        let arch = 0.0185 + 0.0065 * (PI * (0.15 + 0.62 * t)).sin() - 0.006 * t * t * t;
        let thick = 0.0078 * (1.0 - 0.72 * t) * (0.55 + 0.45 * (8.0 * t).min(1.0));
        let root = onto_skin(Vec3::new(arch + thick * (across - 0.5), 0.1, z), -2e-4);
        let normal = gradient(&head, root, 3e-4);
        // Upright near the nose, then outward, from above and below onto the middle.
        let up = (0.85 - 1.7 * t).max(0.35 - 0.9 * across);
        let way = Vec3::new(up + 0.3 * (off - 0.5), 0.0, 0.25 + 1.4 * t.sqrt());
        let way = way.reject_from_normalized(normal).normalize() + 0.32 * normal;
        hairs.push(tuft(root, way, -0.45, (0.0055 + 0.0035 * long) * (1.0 - 0.25 * t)));
    }
    for (count, below, long) in [(110, 0.0, 0.0088), (60, 0.0011, 0.0045)] {
        for i in 0..count {
            let [jitter, off, own] = random.random::<[f32; 3]>();
            let t = (i as f32 + jitter) / count as f32;
            let z = 0.0175 + 0.0275 * t;
            let outward = Vec3::new(lash_line(z) - below, EYE.y + LID, z) - EYE;
            let root = onto_skin(EYE + outward.normalize() * (LID + 0.001), -1e-4);
            let normal = gradient(&head, root, 3e-4);
            // Down over the cheek, fanned out to the sides.
            let fan = Vec3::new(-0.9, 0.0, 1.5 * (t - 0.42) + 0.35 * (off - 0.5));
            let way = normal * 0.75 + fan.reject_from_normalized(normal);
            let longest = 1.0 - 0.55 * (2.0 * t - 1.15).powi(2);
            hairs.push(tuft(root, way, 0.9, long * longest * (0.75 + 0.25 * own)));
        }
    }
    hairs
}

/// Brows and lashes of the training head. `scale` is that of the head along its own axes.
pub fn face(scale: Vec3, melanin: Melanin) -> Result<Carried> {
    let half = face_hair();
    let mirrored = |points: &[Vec3; 5]| points.map(|p| p * Vec3::new(1.0, 1.0, -1.0));
    let both = half.iter().copied().chain(half.iter().map(mirrored));
    let all: Vec<[Vec3; 5]> = both.map(|points| points.map(|p| p * scale)).collect();
    let root = |points: &[Vec3; 5]| FollowerRoot {
        place: points[0],
        length: points.windows(2).map(|pair| pair[0].distance(pair[1])).sum(),
        reach: points[4] - points[0],
        width: 1.0,
    };
    let settings = HairFollowers {
        segments: 8,
        stray: 0.02,
        clump: 0.0,
        locks: Vec3::new(0.0, 0.0, 0.2),
        frizz: 0.0,
        flyaways: 0.0,
        phase_variation: 0.0,
        ..default()
    };
    let roots = FollowerRoots(all.iter().map(root).collect());
    let mut hair = Carried::new(all.iter().step_by(GUIDE_OF), roots, settings)?;
    hair.look = Some(HairLook {
        melanin,
        width: 0.09e-3,
        taper: 0.25,
        root_fade: 0.3e-3,
        tip_bleach: 0.0,
        ..default()
    });
    Ok(hair)
}

/// The knot on the crown into which hair is put up, and its radius (m).
const KNOT: Vec3 = Vec3::new(0.121, -0.052, 0.0);
const KNOT_RADIUS: f32 = 0.027;
/// The section at the back that is let down: half of its sides along the head and across (m).
const SECTION: Vec2 = Vec2::new(0.031, 0.057);
/// Guides that are put up, before those of the section are taken away, and their nodes.
const GUIDES: usize = 900;
const NODES: usize = 24;

/// Whether hair that grows here is let down.
fn is_let_down(p: Vec3) -> bool {
    p.y < -0.06 && p.x.abs() < SECTION.x && p.z.abs() < SECTION.y
}

/// The way a strand takes over the head into the knot and around it.
fn put_up(root: Vec3, random: &mut impl RngExt) -> Vec<Vec3> {
    const STEP: f32 = 0.004;
    let [lift, wide, high] = random.random::<[f32; 3]>();
    let mut points = vec![root];
    let mut p = root;
    let normal = gradient(&head, KNOT, 1e-3);
    for i in 0..120 {
        let to = KNOT - p;
        if to.length() < KNOT_RADIUS {
            break;
        }
        // Around the section, not across it.
        let aside = (p.z.abs() - SECTION.y).max(p.x.abs() - SECTION.x).max(0.0);
        let near = (1.0 - aside / 0.03).max(0.0) * if p.y < -0.04 { 1.0 } else { 0.0 };
        let around = Vec3::new(0.0, 0.6, p.z.signum()) * near;
        let out = gradient(&head, p, 1e-3);
        let way = (to.normalize() + 1.6 * around).reject_from_normalized(out).normalize_or(out);
        let above = (0.001 + 0.06 * (i as f32 * STEP)).min(0.0025 + 0.004 * lift);
        p = onto_skin(p + way * STEP, above);
        points.push(p);
    }
    // Once and a half around the knot, ever tighter and higher.
    let from = (p - KNOT).reject_from_normalized(normal).normalize_or(Vec3::Y);
    let side = normal.cross(from);
    let turns = 1.1 + 0.8 * wide;
    for i in 1..=28 {
        let t = i as f32 / 28.0;
        let (sin, cos) = sin_cos(TAU * turns * t);
        let radius = KNOT_RADIUS * (1.0 - 0.55 * high * t - 0.15 * t);
        let rise = KNOT_RADIUS * (0.7 * high * t * (2.0 - t) - 0.25 * (1.0 - t));
        points.push(KNOT + (from * cos + side * sin) * radius + normal * rise);
    }
    resampled(&points, NODES)
}

/// As many points at equal distances along a line.
fn resampled(line: &[Vec3], count: usize) -> Vec<Vec3> {
    let mut along = vec![0.0];
    for pair in line.windows(2) {
        along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
    }
    let length = along[along.len() - 1];
    let at = |k: usize| {
        let wanted = length * k as f32 / (count - 1) as f32;
        let i = along.iter().rposition(|a| *a <= wanted).unwrap_or(0).min(line.len() - 2);
        let share = (wanted - along[i]) / (along[i + 1] - along[i]).max(1e-9);
        line[i].lerp(line[i + 1], share.min(1.0))
    };
    (0..count).map(at).collect()
}

/// All hair of the lying head but the section at its back, put up.
pub fn up(mesh: &Mesh) -> Result<Carried> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let scalp = scalp();
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    let mut lines = Vec::new();
    for i in 0..2 * GUIDES {
        let x = 1.0 - 2.0 * (i as f32 + 0.5) / (2 * GUIDES) as f32;
        let (sin, cos) = sin_cos(golden * i as f32);
        let flat = (1.0 - x * x).sqrt();
        let root = onto_skin(Vec3::new(0.018 + 0.1 * x, 0.09 * flat * sin, 0.08 * flat * cos), 0.0);
        if scalp.density(root) > 0.1 && !is_let_down(root) {
            lines.push(put_up(root, &mut random));
        }
    }
    let planted = Planted { groom: Groom::from_polylines(lines.clone())?, roots: Vec::new() };
    // Lengths are those of the way into the knot, wherever a strand grows.
    let line = Hairline { least_length: 1.0, baby_length: 12e-3, ..default() };
    let mut roots = HairPreset::Short.follower_roots(&planted, mesh, &scalp, &line, 30_000, 0)?;
    roots.0.retain(|root| !is_let_down(root.place));
    let settings = HairFollowers {
        segments: 30,
        stray: 0.006,
        clump: 0.0,
        locks: Vec3::new(0.2, 0.3, 0.2),
        lock_length_variation: 0.0,
        frizz: 0.1e-3,
        flyaways: 0.006,
        flyaway_reach: 8e-3,
        phase_variation: 0.0,
        ..default()
    };
    Carried::new(lines.iter(), roots, settings)
}
