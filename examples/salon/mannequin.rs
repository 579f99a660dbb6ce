//! A training head, made by rule: a smooth union of simple solids, turned into a mesh.
//!
//! It lies on its back: +X to the crown, +Y to the face. Its origin is the centre of the skull and
//! the back of the skull is flattened at −Y, where the hair grows.

use crate::scenes::HEAD_RADIUS;
use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology},
    platform::collections::HashMap,
    prelude::*,
};

/// Edge of the grid on which the surface is found (m).
const CELL: f32 = 0.0045;
/// The box that holds all of the head.
const LOW: Vec3 = Vec3::new(-0.33, -0.13, -0.235);
const HIGH: Vec3 = Vec3::new(0.14, 0.15, 0.235);
/// Where the bust is cut off (m).
pub const BUST_END: f32 = -0.30;

/// Blends two distances over a width of `k`.
pub fn join(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - 0.25 * h * h * k
}

/// Takes `b` away from `a`, with an edge of width `k`.
pub fn carve(a: f32, b: f32, k: f32) -> f32 {
    -join(-a, b, k)
}

fn ball(p: Vec3, centre: Vec3, radius: f32) -> f32 {
    p.distance(centre) - radius
}

fn ellipsoid(p: Vec3, centre: Vec3, radii: Vec3) -> f32 {
    let q = p - centre;
    let (near, far) = ((q / radii).length(), (q / (radii * radii)).length());
    near * (near - 1.0) / far.max(1e-6)
}

/// A capsule whose radius goes from `ra` at `a` to `rb` at `b`.
pub fn limb(p: Vec3, a: Vec3, b: Vec3, ra: f32, rb: f32) -> f32 {
    let way = b - a;
    let t = ((p - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
    p.distance(a + way * t) - (ra + (rb - ra) * t)
}

fn block(p: Vec3, centre: Vec3, half: Vec3, round: f32) -> f32 {
    let q = (p - centre).abs() - half + round;
    q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - round
}

/// Distance to the surface of head, neck and shoulders (m), negative inside.
pub fn head(p: Vec3) -> f32 {
    let p = Vec3::new(p.x, p.y, p.z.abs());
    let v = Vec3::new;
    let mut d = face(p);
    // Neck, shoulders, chest, cut off below.
    d = join(d, limb(p, v(-0.05, -0.012, 0.0), v(-0.2, -0.03, 0.0), 0.05, 0.056), 0.03);
    d = join(d, limb(p, v(-0.235, -0.035, 0.0), v(-0.27, -0.04, 0.15), 0.05, 0.058), 0.06);
    d = join(d, ellipsoid(p, v(-0.31, -0.02, 0.0), v(0.09, 0.07, 0.15)), 0.05);
    carve(d, p.x - BUST_END, 0.012)
}

/// Distance to the surface of the head without its neck (m), negative inside. Both halves are alike.
pub fn face(p: Vec3) -> f32 {
    let p = Vec3::new(p.x, p.y, p.z.abs());
    let v = Vec3::new;
    let skull = ellipsoid(p, v(0.018, 0.0, 0.0), v(0.1, 0.095, 0.077));
    // Flat where the hair's roots are, so that they all sit in the scalp.
    let back = block(p, v(0.0, 0.026 - HEAD_RADIUS, 0.0), v(0.036, 0.026, 0.058), 0.02);
    let mut d = join(skull, back, 0.05);
    let face = ellipsoid(p, v(-0.03, 0.04, 0.0), v(0.072, 0.05, 0.058));
    let jaw = ellipsoid(p, v(-0.066, 0.032, 0.0), v(0.04, 0.05, 0.05));
    d = join(d, join(face, jaw, 0.04), 0.04);
    d = join(d, ball(p, v(-0.094, 0.074, 0.0), 0.013), 0.03);
    // Brow, sockets, closed eyes.
    d = join(d, limb(p, v(0.014, 0.088, 0.008), v(0.008, 0.076, 0.044), 0.006, 0.004), 0.02);
    d = carve(d, ball(p, v(-0.012, 0.103, 0.031), 0.0135), 0.022);
    d = join(d, ellipsoid(p, v(-0.013, 0.076, 0.031), v(0.0105, 0.0115, 0.0155)), 0.005);
    // Nose with its wings.
    d = join(d, limb(p, v(0.002, 0.089, 0.0), v(-0.036, 0.108, 0.0), 0.006, 0.0085), 0.014);
    d = join(d, ball(p, v(-0.041, 0.097, 0.0105), 0.0062), 0.009);
    // Cheek bones, lips.
    d = join(d, ball(p, v(-0.03, 0.062, 0.042), 0.014), 0.03);
    let upper = ellipsoid(p, v(-0.0595, 0.0885, 0.0), v(0.0045, 0.0085, 0.021));
    let lower = ellipsoid(p, v(-0.0685, 0.0875, 0.0), v(0.0055, 0.0085, 0.017));
    d = join(d, upper.min(lower), 0.007);
    // Ear: a shell with a hollow.
    let shell = ellipsoid(p, v(-0.016, -0.002, 0.077), v(0.031, 0.018, 0.0085));
    let ear = carve(shell, ellipsoid(p, v(-0.012, 0.0, 0.084), v(0.02, 0.01, 0.007)), 0.005);
    join(d, ear, 0.008)
}

/// The unit direction in which a distance grows.
pub fn normal(distance: &impl Fn(Vec3) -> f32, p: Vec3) -> Vec3 {
    let step = |axis: Vec3| distance(p + axis * 1e-3) - distance(p - axis * 1e-3);
    Vec3::new(step(Vec3::X), step(Vec3::Y), step(Vec3::Z)).normalize_or(Vec3::Y)
}

/// Skin, and the darker scalp that shows between strands.
fn colour(p: Vec3) -> [f32; 4] {
    let scalp = block(p, Vec3::new(0.0, -0.1, 0.0), Vec3::new(0.044, 0.034, 0.064), 0.02);
    let share = (1.0 - scalp / 0.006).clamp(0.0, 1.0);
    skin(p).lerp(Vec3::new(0.09, 0.05, 0.035), share * 0.9).extend(1.0).to_array()
}

/// Skin and lips.
pub fn skin(p: Vec3) -> Vec3 {
    let lips = ellipsoid(p, Vec3::new(-0.064, 0.09, 0.0), Vec3::new(0.0095, 0.012, 0.02));
    let red = (1.0 - lips / 0.004).clamp(0.0, 1.0) * 0.45;
    Vec3::new(0.62, 0.40, 0.29).lerp(Vec3::new(0.50, 0.18, 0.15), red)
}

/// The head as a mesh with vertex colours.
pub fn mesh() -> Mesh {
    surface((LOW, HIGH), CELL, &head, &colour)
}

/// The same without the dark patch at the back.
pub fn plain() -> Mesh {
    surface((LOW, HIGH), CELL, &head, &|p| skin(p).extend(1.0).to_array())
}

/// What a distance is 0 on within a box, as a mesh with vertex colours: one vertex in each cell that
/// the surface crosses, put onto the surface; one quad around each grid edge that it crosses.
pub fn surface(
    (low, high): (Vec3, Vec3),
    cell: f32,
    distance: &impl Fn(Vec3) -> f32,
    colour: &impl Fn(Vec3) -> [f32; 4],
) -> Mesh {
    let count = ((high - low) / cell).ceil().as_uvec3();
    let place = |c: UVec3| low + c.as_vec3() * cell;
    let index = |c: UVec3| (c.x + count.x * (c.y + count.y * c.z)) as usize;
    let mut field = Vec::with_capacity(count.element_product() as usize);
    for z in 0..count.z {
        for y in 0..count.y {
            field.extend((0..count.x).map(|x| distance(place(UVec3::new(x, y, z)))));
        }
    }
    let inside = |c: UVec3| field[index(c)] < 0.0;

    let mut positions: Vec<[f32; 3]> = Vec::new();
    let mut normals: Vec<[f32; 3]> = Vec::new();
    let mut colours: Vec<[f32; 4]> = Vec::new();
    let mut vertex_of: HashMap<UVec3, u32> = HashMap::default();
    let mut vertex = |corner: UVec3| {
        *vertex_of.entry(corner).or_insert_with(|| {
            let mut p = place(corner) + 0.5 * cell;
            for _ in 0..4 {
                p -= normal(distance, p) * distance(p);
            }
            positions.push(p.to_array());
            normals.push(normal(distance, p).to_array());
            colours.push(colour(p));
            positions.len() as u32 - 1
        })
    };
    let mut indices: Vec<u32> = Vec::new();
    for z in 1..count.z - 1 {
        for y in 1..count.y - 1 {
            for x in 1..count.x - 1 {
                let c = UVec3::new(x, y, z);
                for (axis, u, v) in [
                    (UVec3::X, UVec3::Y, UVec3::Z),
                    (UVec3::Y, UVec3::Z, UVec3::X),
                    (UVec3::Z, UVec3::X, UVec3::Y),
                ] {
                    if inside(c) == inside(c + axis) {
                        continue;
                    }
                    let quad = [c - u - v, c - v, c, c - u].map(&mut vertex);
                    let order = if inside(c) { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
                    indices.extend(order.map(|i| quad[i]));
                }
            }
        }
    }
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colours)
        .with_inserted_indices(Indices::U32(indices))
}
