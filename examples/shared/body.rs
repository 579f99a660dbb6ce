//! The body's skin: one smooth surface around its bones, each vertex moved by the bones near it.

use crate::{
    mannequin::{self, carve, face, join, limb},
    skeleton::{self, *},
};
use bevy::{asset::RenderAssetUsages, mesh::VertexAttributeValues, prelude::*};

/// Size of the surface's cells, of the face and of the rest (m).
const FINE: f32 = 0.0018;
const CELL: f32 = 0.006;
const LOW: Vec3 = Vec3::new(-0.54, -0.02, -0.22);
const HIGH: Vec3 = Vec3::new(0.54, 1.76, 0.24);
/// Over what distance the pull of a bone fades (m).
const BLEND: f32 = 0.013;
/// Beyond this from the skull's centre there is no face to look for (m).
const FACE: f32 = 0.2;

/// A tapered piece of a bone's flesh, and over what width it blends with what is above it.
struct Piece {
    bone: usize,
    ends: [Vec3; 2],
    radii: [f32; 2],
    blend: f32,
}

const fn piece(bone: usize, a: [f32; 3], b: [f32; 3], radii: [f32; 2], blend: f32) -> Piece {
    Piece { bone, ends: [Vec3::from_array(a), Vec3::from_array(b)], radii, blend }
}

/// The left half; pieces that begin in the middle go on to the other side.
const PIECES: [Piece; 23] = [
    piece(NECK, [0.0, 1.55, -0.014], [0.0, 1.39, -0.035], [0.047, 0.053], 0.03),
    piece(CHEST, [0.0, 1.375, -0.045], [0.15, 1.345, -0.042], [0.046, 0.05], 0.05),
    piece(CHEST, [0.0, 1.30, -0.035], [0.085, 1.315, -0.038], [0.087, 0.071], 0.05),
    piece(CHEST, [0.0, 1.22, -0.027], [0.062, 1.23, -0.025], [0.091, 0.088], 0.045),
    piece(1, [0.0, 1.15, -0.022], [0.053, 1.15, -0.022], [0.087, 0.084], 0.04),
    piece(1, [0.0, 1.085, -0.02], [0.046, 1.085, -0.02], [0.083, 0.081], 0.04),
    piece(0, [0.0, 1.02, -0.02], [0.053, 1.015, -0.02], [0.086, 0.085], 0.04),
    piece(0, [0.0, 0.95, -0.02], [0.067, 0.94, -0.02], [0.093, 0.094], 0.045),
    piece(0, [0.05, 0.89, -0.06], [0.066, 0.90, -0.055], [0.078, 0.076], 0.05),
    piece(UPPER_ARM, [0.165, 1.345, -0.041], [0.19, 1.29, -0.04], [0.052, 0.050], 0.05),
    piece(UPPER_ARM, [0.19, 1.29, -0.04], [0.284, 1.096, -0.04], [0.048, 0.037], 0.04),
    piece(FOREARM, [0.284, 1.096, -0.04], [0.309, 1.043, -0.038], [0.036, 0.039], 0.012),
    piece(FOREARM, [0.309, 1.043, -0.038], [0.386, 0.877, -0.03], [0.039, 0.025], 0.01),
    // Palm, fingers, thumb.
    piece(FOREARM, [0.390, 0.868, -0.03], [0.412, 0.815, -0.018], [0.0235, 0.022], 0.015),
    piece(FOREARM, [0.405, 0.83, -0.035], [0.418, 0.79, -0.038], [0.020, 0.017], 0.015),
    piece(FOREARM, [0.416, 0.80, -0.026], [0.434, 0.715, -0.014], [0.0195, 0.012], 0.02),
    piece(FOREARM, [0.396, 0.848, -0.015], [0.398, 0.792, 0.024], [0.013, 0.010], 0.02),
    piece(THIGH, [0.088, 0.88, -0.02], [0.095, 0.50, -0.008], [0.080, 0.052], 0.05),
    piece(SHIN, [0.095, 0.49, -0.006], [0.095, 0.34, -0.018], [0.050, 0.048], 0.012),
    piece(SHIN, [0.095, 0.34, -0.018], [0.095, 0.09, -0.035], [0.048, 0.033], 0.01),
    // Calf.
    piece(SHIN, [0.096, 0.40, -0.034], [0.096, 0.30, -0.036], [0.040, 0.034], 0.05),
    piece(FOOT, [0.095, 0.075, -0.04], [0.097, 0.035, -0.065], [0.038, 0.033], 0.03),
    piece(FOOT, [0.096, 0.055, -0.03], [0.106, 0.022, 0.125], [0.040, 0.028], 0.03),
];

impl Piece {
    fn distance(&self, p: Vec3) -> f32 {
        limb(p, self.ends[0], self.ends[1], self.radii[0], self.radii[1])
    }
}

/// From the body to the mannequin, which lies about its skull.
fn lying(p: Vec3) -> Vec3 {
    let p = p - SKULL;
    Vec3::new(p.y, p.z, p.x)
}

fn head(p: Vec3) -> f32 {
    let off = p.distance(SKULL);
    if off > FACE { off - 0.14 } else { face(lying(p)) }
}

/// Distance to the skin (m), negative inside.
fn skin(p: Vec3) -> f32 {
    let half = Vec3::new(p.x.abs(), p.y, p.z);
    let all = PIECES.iter().fold(head(p), |d, piece| join(d, piece.distance(half), piece.blend));
    carve(all, p.y, 0.01)
}

/// Skin, and clothes as tight as paint.
fn color(p: Vec3) -> [f32; 4] {
    let along = |bone: usize| {
        let (a, b) = (joint(bone), joint(bone + 1));
        let p = Vec3::new(p.x.abs(), p.y, p.z);
        (p - a).dot((b - a).normalize())
    };
    let edge = |distance: f32| (0.5 + distance / 0.006).clamp(0.0, 1.0);
    let neckline = edge((p.distance(Vec3::new(0.0, 1.445, -0.01)) - 0.115).min(1.46 - p.y));
    let arm = if p.x.abs() > 0.16 { edge(0.15 - along(UPPER_ARM)) } else { 1.0 };
    let shirt = neckline * arm;
    let mut color = mannequin::skin(lying(p)).lerp(Vec3::new(0.20, 0.27, 0.30), shirt);
    let is_arm = p.x.abs() > 0.2;
    if !is_arm {
        color = color.lerp(Vec3::new(0.055, 0.06, 0.075), edge(0.985 - p.y));
        color = color.lerp(Vec3::new(0.55, 0.54, 0.52), edge(0.095 - p.y));
    }
    color.extend(1.0).to_array()
}

/// How far the flesh of a bone is from a point (m).
fn of_bone(bone: usize, p: Vec3) -> f32 {
    if bone == HEAD {
        return head(p);
    }
    let is_right = bone >= UPPER_ARM + OTHER_SIDE;
    let left = if is_right { bone - OTHER_SIDE } else { bone };
    // Bones of one side have no hold on the other.
    let across = match (left >= UPPER_ARM, is_right) {
        (false, _) => 0.0,
        (true, false) => (0.01 - p.x).max(0.0),
        (true, true) => (0.01 + p.x).max(0.0),
    };
    let half = Vec3::new(p.x.abs(), p.y, p.z);
    let own = PIECES.iter().filter(|piece| piece.bone == left).map(|piece| piece.distance(half));
    own.fold(f32::MAX, f32::min) + 6.0 * across
}

/// The four bones that move a point, and how much each does.
fn weights(p: Vec3) -> ([u16; 4], [f32; 4]) {
    let distances: [f32; skeleton::COUNT] = core::array::from_fn(|bone| of_bone(bone, p));
    let least = distances.iter().copied().fold(f32::MAX, f32::min);
    let mut pulls: Vec<(u16, f32)> =
        (0..).zip(distances.map(|d| ((least - d) / BLEND).exp())).collect();
    pulls.sort_by(|a, b| b.1.total_cmp(&a.1));
    let pulls: [(u16, f32); 4] = core::array::from_fn(|i| pulls[i]);
    // What is hardly there is not there, without a step.
    let kept = pulls.map(|(_, pull)| (pull - 0.02).max(0.0));
    let all: f32 = kept.iter().sum();
    (pulls.map(|(bone, _)| bone), kept.map(|pull| pull / all))
}

/// The body as a skinned mesh at rest (m): its feet on the floor at the origin, its face toward +Z.
pub fn mesh() -> Mesh {
    mesh_of(FINE, CELL)
}

/// The same in cells of other sizes (m), of the face and of the rest.
pub fn mesh_of(fine: f32, cell: f32) -> Mesh {
    let up = [(SKULL.y - 0.1, SKULL.y + 0.026)];
    let front = [(SKULL.z - 0.026, SKULL.z + 0.02), (SKULL.z + 0.06, SKULL.z + 0.122)];
    let across = [(-0.09, -0.066), (-0.05, 0.05), (0.066, 0.09)];
    let grid = mannequin::Grid::graded((LOW, HIGH), [&across, &up, &front], fine, cell);
    let mut mesh = grid.surface(&skin, &color);
    mesh.asset_usage = RenderAssetUsages::default();
    let places =
        mesh.attribute(Mesh::ATTRIBUTE_POSITION).and_then(VertexAttributeValues::as_float3);
    let pulls = places.unwrap_or_default().iter().map(|p| weights(Vec3::from_array(*p)));
    let (joints, weights): (Vec<_>, Vec<_>) = pulls.unzip();
    mesh.with_inserted_attribute(
        Mesh::ATTRIBUTE_JOINT_INDEX,
        VertexAttributeValues::Uint16x4(joints),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, weights)
}
