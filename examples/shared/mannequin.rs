//! A training head, made by rule: the surface on which a distance is 0, turned into a mesh.
//!
//! It lies on its back: +X to the crown, +Y to the face. Its origin is the centre of the skull and
//! the back of the skull is flattened at −Y, where the hair grows.

#[path = "sculpt.rs"]
mod sculpt;

use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology},
    platform::collections::HashMap,
    prelude::*,
};
pub use sculpt::*;

/// Edges of the grid on which the surface is found: where the face and the ears are, and elsewhere (m).
const FINE: f32 = 0.0014;
const COARSE: f32 = 0.0042;
/// The box that holds all of the head.
const LOW: Vec3 = Vec3::new(-0.40, -0.13, -0.20);
const HIGH: Vec3 = Vec3::new(0.14, 0.15, 0.20);
/// Which part of each axis is fine; of the last, on both sides of the middle: the face and the ears.
const FINE_X: [(f32, f32); 1] = [(-0.105, 0.028)];
const FINE_Y: [(f32, f32); 2] = [(-0.026, 0.022), (0.060, 0.124)];
const FINE_Z: [(f32, f32); 3] = [(-0.094, -0.066), (-0.052, 0.052), (0.066, 0.094)];

/// The head as a mesh with vertex colours.
pub fn mesh() -> Mesh {
    grid().surface(&head, &|p| skin(p).extend(1.0).to_array())
}

/// Fine where it must be.
fn grid() -> Grid {
    let fine: [&[(f32, f32)]; 3] = [&FINE_X, &FINE_Y, &FINE_Z];
    Grid::graded((LOW, HIGH), fine, FINE, COARSE)
}

/// Steps from `low` to `high`, fine in the given parts; from one size to the other by a fifth at a time.
fn steps((low, high): (f32, f32), fine: &[(f32, f32)], least: f32, most: f32) -> Vec<f32> {
    let mut at = vec![low];
    let mut last = low;
    while last < high {
        let apart = |part: &(f32, f32)| (part.0 - last).max(last - part.1).max(0.0);
        let away = fine.iter().map(apart).fold(f32::MAX, f32::min);
        last += (least + 0.2 * away).min(most);
        at.push(last);
    }
    at
}

/// Planes across each axis, from low to high.
pub struct Grid([Vec<f32>; 3]);

/// Cells along the side of a block that is looked at as a whole.
const BLOCK: u32 = 8;
/// By how much a blended distance may be greater than the true one.
const BLENDED: f32 = 1.6;

impl Grid {
    /// Over a box, with edges of `least` in the fine parts of each axis and up to `most` elsewhere (m).
    pub fn graded(
        (low, high): (Vec3, Vec3),
        fine: [&[(f32, f32)]; 3],
        least: f32,
        most: f32,
    ) -> Self {
        Self([0, 1, 2].map(|i| steps((low[i], high[i]), fine[i], least, most)))
    }

    fn count(&self) -> UVec3 {
        let [x, y, z] = &self.0;
        UVec3::new(x.len() as u32, y.len() as u32, z.len() as u32)
    }

    fn place(&self, c: UVec3) -> Vec3 {
        Vec3::new(self.0[0][c.x as usize], self.0[1][c.y as usize], self.0[2][c.z as usize])
    }

    /// The distance at the grid's points, those far from the surface from the middle of their block.
    fn field(&self, distance: &impl Fn(Vec3) -> f32) -> Vec<f32> {
        let count = self.count();
        let mut field = vec![0.0; count.element_product() as usize];
        let index = |c: UVec3| (c.x + count.x * (c.y + count.y * c.z)) as usize;
        let blocks = count.map(|n| n.div_ceil(BLOCK));
        for block in each(UVec3::ZERO, blocks) {
            let (first, end) = (block * BLOCK, ((block + 1) * BLOCK).min(count));
            let (a, b) = (self.place(first), self.place(end - 1));
            let whole = distance(0.5 * (a + b));
            let is_far = whole.abs() > BLENDED * 0.5 * a.distance(b);
            for c in each(first, end) {
                field[index(c)] = if is_far { whole } else { distance(self.place(c)) };
            }
        }
        field
    }

    /// What a distance is 0 on, as a mesh with vertex colours: one vertex in each cell that the surface
    /// crosses, put onto the surface; one quad around each grid edge that it crosses.
    pub fn surface(
        &self,
        distance: &impl Fn(Vec3) -> f32,
        colour: &impl Fn(Vec3) -> [f32; 4],
    ) -> Mesh {
        let count = self.count();
        let field = self.field(distance);
        let inside = |c: UVec3| field[(c.x + count.x * (c.y + count.y * c.z)) as usize] < 0.0;
        let mut positions: Vec<[f32; 3]> = Vec::new();
        let mut normals: Vec<[f32; 3]> = Vec::new();
        let mut colours: Vec<[f32; 4]> = Vec::new();
        let mut vertex_of: HashMap<UVec3, u32> = HashMap::default();
        let mut vertex = |corner: UVec3| {
            *vertex_of.entry(corner).or_insert_with(|| {
                let (low, high) = (self.place(corner), self.place(corner + 1));
                let mut p = 0.5 * (low + high);
                for _ in 0..3 {
                    p -= normal(distance, p) * distance(p);
                }
                // Where the surface has an edge, it may have gone astray.
                let p = p.clamp(2.0 * low - high, 2.0 * high - low);
                positions.push(p.to_array());
                normals.push(normal(distance, p).to_array());
                colours.push(colour(p));
                positions.len() as u32 - 1
            })
        };
        let mut indices: Vec<u32> = Vec::new();
        for c in each(UVec3::ONE, count - 1) {
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
        Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
            .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
            .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colours)
            .with_inserted_indices(Indices::U32(indices))
    }
}

/// All of a range, along x first.
fn each(low: UVec3, high: UVec3) -> impl Iterator<Item = UVec3> {
    (low.z..high.z).flat_map(move |z| {
        (low.y..high.y).flat_map(move |y| (low.x..high.x).map(move |x| UVec3::new(x, y, z)))
    })
}
