//! Signed distances of triangles at the points of a grid.

use super::{error::BakeError, hull::SIZES};
use crate::{base::grid::TriangleSoup, solver::rod::shape::DistanceGrid};
use bevy::{math::UVec3, platform::collections::HashMap, prelude::*};

/// The most points of a grid: 32 MB.
const MAX_POINTS: u64 = 1 << 23;
/// Margin of the grid around the surface, in cells.
const MARGIN: f32 = 3.0;
/// Away from the surface exact distances are computed only at every `COARSE`th point.
const COARSE: usize = 3;
/// Distances are exact within this many cells of the surface.
const EXACT: f32 = 1.5;

/// How a surface is baked.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Bake {
    /// Spacing of the grid points (m): at most half of the thinnest part. Finer detail is lost.
    /// Default 0.004, for a head.
    pub cell: f32,
    /// Treatment of surfaces that are not closed. Default [`Openings::Refuse`].
    pub openings: Openings,
}

impl Default for Bake {
    fn default() -> Self {
        Self { cell: 0.004, openings: Openings::Refuse }
    }
}

/// Treatment of surfaces that are not closed.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub enum Openings {
    /// They are an error.
    #[default]
    Refuse,
    /// The inside is where the generalized winding number exceeds ½: right where holes are small
    /// relative to the surface, such as eyes and mouth of a character; surfaces that cross are
    /// united. Some volume around a hole is lost.
    Fill,
    /// A sheet of this thickness (m), whether it is closed or not; at least two cells, or hair falls
    /// through.
    Shell {
        /// The thickness (m).
        thickness: f32,
    },
}

impl DistanceGrid {
    /// Bakes a closed surface: vertices (m), triangles by their vertices, in any order, with the
    /// same winding for all. `cell` is the spacing of the grid points (m).
    ///
    /// A cube of 64 points takes 1 MB. Baking is slow: bake on another thread, or once and clone.
    ///
    /// # Errors
    /// When there are no triangles, something is not finite or not closed, the size is not between
    /// 0.1 mm and 5 km, or there would be more than 8 million points.
    ///
    /// ```
    /// # use bevy_keratin::{forces::contact::{BakeError, DistanceGrid}, prelude::*}; use bevy::prelude::*;
    /// # fn main() -> Result<(), BakeError> {
    /// let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    /// let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    /// let grid = DistanceGrid::bake(&corners, &faces, 0.05)?;
    /// assert!(grid.distance(Vec3::splat(0.1)) < 0.0);
    /// let collider = HairCollider::grid(grid); // spawn it with a `Transform`
    /// # Ok(())
    /// # }
    /// ```
    pub fn bake(vertices: &[Vec3], triangles: &[[u32; 3]], cell: f32) -> Result<Self, BakeError> {
        Self::bake_with(vertices, triangles, &Bake { cell, openings: Openings::Refuse })
    }

    /// The same for surfaces that are open.
    ///
    /// # Errors
    /// As [`bake`](Self::bake); openings are treated as `how` says.
    pub fn bake_with(
        vertices: &[Vec3],
        triangles: &[[u32; 3]],
        how: &Bake,
    ) -> Result<Self, BakeError> {
        let count = vertices.len();
        let named = triangles.iter().flatten().map(|v| *v as usize);
        if let Some(vertex) = named.clone().find(|v| *v >= count) {
            return Err(BakeError::UnknownVertex { vertex, vertices: count });
        }
        if let Some(vertex) = named.clone().find(|v| !vertices[*v].is_finite()) {
            return Err(BakeError::NonFinite { vertex });
        }
        let bounds = |(low, high): (Vec3, Vec3), v| {
            let at = vertices[v];
            (low.min(at), high.max(at))
        };
        let (low, high) = named.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), bounds);
        let corners = |t: &[u32; 3]| t.map(|v| vertices[v as usize]);
        let has_area = |[a, b, c]: &[Vec3; 3]| (b - a).cross(c - a) != Vec3::ZERO;
        if !triangles.iter().map(corners).any(|t| has_area(&t)) {
            return Err(BakeError::NoTriangles);
        }
        let size = (high - low).max_element();
        if !SIZES.contains(&size) {
            return Err(BakeError::Size { found: size });
        }
        let length = |what, found: f32| {
            let is_valid = found > 0.0 && found < size;
            if is_valid { Ok(found) } else { Err(BakeError::Length { what, found, size }) }
        };
        let cell = length("the cell size", how.cell)?;
        let thickness = match how.openings {
            Openings::Shell { thickness } => 0.5 * length("the thickness", thickness)?,
            Openings::Refuse | Openings::Fill => 0.0,
        };
        if how.openings == Openings::Refuse {
            let all: Vec<[Vec3; 3]> = triangles.iter().map(corners).collect();
            let edges = open_edges(&all);
            if edges > 0 {
                return Err(BakeError::Open { edges });
            }
        }
        // Single precision is finest around the origin.
        let middle = 0.5 * (low + high);
        let mut moved: Vec<[Vec3; 3]> =
            triangles.iter().map(|t| corners(t).map(|p| p - middle)).collect();
        let around = GridBox::around(low - middle - thickness, high - middle + thickness, cell)?;
        let is_turned = volume(&moved) < 0.0;
        if is_turned {
            moved.iter_mut().for_each(|t| t.swap(0, 1));
        }
        let soup = TriangleSoup::new(moved.iter().copied());
        let is_inside = |p: Vec3| soup.winding(p) > 0.5;
        let distances = match how.openings {
            Openings::Shell { .. } => {
                let mut distances = around.distances(&soup, |_| false, false, EXACT);
                distances.iter_mut().for_each(|d| *d -= thickness);
                distances
            }
            Openings::Refuse => around.distances(&soup, is_inside, false, EXACT),
            Openings::Fill => {
                let skin = TriangleSoup::new(skin(&moved, &soup, cell).map(|k| moved[k]));
                around.distances(&skin, is_inside, true, EXACT)
            }
        };
        around.finish(distances, middle).ok_or(BakeError::Thin { cell })
    }
}

/// The triangles that face the outside, not those within another surface.
fn skin<'a>(
    triangles: &'a [[Vec3; 3]],
    soup: &'a TriangleSoup,
    cell: f32,
) -> impl Iterator<Item = usize> + 'a {
    (0..triangles.len()).filter(move |k| {
        let [a, b, c] = triangles[*k];
        let out = (b - a).cross(c - a).normalize_or_zero();
        out != Vec3::ZERO && soup.winding((a + b + c) / 3.0 + out * (0.5 * cell)) <= 0.5
    })
}

/// The points of a grid.
#[derive(Clone, Copy, Debug)]
struct GridBox {
    origin: Vec3,
    cell: f32,
    points: [usize; 3],
}

impl GridBox {
    /// Points around a box.
    fn around(low: Vec3, high: Vec3, cell: f32) -> Result<Self, BakeError> {
        let cells = ((high - low) / cell + 2.0 * MARGIN).ceil();
        let points = cells + 1.0;
        let found = points.as_dvec3().element_product();
        if found.is_nan() || found > MAX_POINTS as f64 {
            let enough = cell * (found / MAX_POINTS as f64).cbrt() as f32 * 1.05;
            return Err(BakeError::TooManyPoints {
                cell,
                found: found as u64,
                most: MAX_POINTS,
                enough,
            });
        }
        let origin = 0.5 * (low + high) - 0.5 * cells * cell;
        Ok(Self { origin, cell, points: points.to_array().map(|n| n as usize) })
    }

    /// The position of a point by its index.
    fn point(&self, k: usize) -> Vec3 {
        let [nx, ny, _] = self.points;
        self.at([k % nx, k / nx % ny, k / (nx * ny)])
    }

    fn at(&self, place: [usize; 3]) -> Vec3 {
        self.origin + Vec3::from_array(place.map(|i| i as f32)) * self.cell
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.points[1] + y) * self.points[0] + x
    }

    /// Distances to the nearest triangle, negative where `is_inside` holds; exact within
    /// `exact_cells` cells. `crossed` surfaces may have no triangle between inside and outside.
    fn distances(
        &self,
        soup: &TriangleSoup,
        is_inside: impl Fn(Vec3) -> bool,
        crossed: bool,
        exact_cells: f32,
    ) -> Vec<f32> {
        let mut distances = vec![f32::NAN; self.points.iter().product()];
        // Between two points the distance changes by no more than their separation, and its sign
        // only where a triangle is between.
        let mut last: Option<(Vec3, u32, f32)> = None;
        let mut exact = |place: [usize; 3], distances: &mut [f32]| {
            let k = self.index(place);
            if !distances[k].is_nan() {
                return;
            }
            let p = self.at(place);
            let step = last.map_or(f32::INFINITY, |(q, ..)| p.distance(q));
            let bound = last.map_or(f32::INFINITY, |(.., d)| d.abs() + step) * 1.0001;
            let (_, squared) = soup.nearer_than(p, (u32::MAX, bound * bound + 1e-30));
            let far = squared.sqrt();
            let inside = match last {
                Some((.., d)) if !crossed && d.abs() > 1.01 * step => d < 0.0,
                _ => is_inside(p),
            };
            distances[k] = if inside { -far } else { far };
            last = Some((p, 0, distances[k]));
        };
        let ends = self.points.map(|n| n - 1);
        let starts = |end: usize| (0..end).step_by(COARSE);
        let next = |start: usize, end: usize| (start + COARSE).min(end);
        // In blocks: only near the surface is every point computed exactly.
        for z in starts(ends[2]) {
            for y in starts(ends[1]) {
                for x in starts(ends[0]) {
                    let to = [next(x, ends[0]), next(y, ends[1]), next(z, ends[2])];
                    let corner = |c: usize| {
                        [
                            if c & 1 == 0 { x } else { to[0] },
                            if c & 2 == 0 { y } else { to[1] },
                            if c & 4 == 0 { z } else { to[2] },
                        ]
                    };
                    let corners: [f32; 8] = core::array::from_fn(|c| {
                        exact(corner(c), &mut distances);
                        distances[self.index(corner(c))]
                    });
                    let nearest = corners.iter().map(|d| d.abs()).fold(f32::INFINITY, f32::min);
                    let near = (0.5 * COARSE as f32 * 3f32.sqrt() + exact_cells) * self.cell;
                    let one_side = corners.iter().all(|d| (*d < 0.0) == (corners[0] < 0.0));
                    let is_near = nearest < near || !one_side;
                    for k in z..=to[2] {
                        for j in y..=to[1] {
                            for i in x..=to[0] {
                                let place = [i, j, k];
                                if is_near {
                                    exact(place, &mut distances);
                                    continue;
                                }
                                let at = self.index(place);
                                if distances[at].is_nan() {
                                    let share = |i: usize, a: usize, b: usize| {
                                        (i - a) as f32 / (b - a) as f32
                                    };
                                    distances[at] = between(
                                        &corners,
                                        share(i, x, to[0]),
                                        share(j, y, to[1]),
                                        share(k, z, to[2]),
                                    );
                                }
                            }
                        }
                    }
                }
            }
        }
        if crossed {
            self.smooth(&mut distances);
        }
        distances
    }

    /// Where no triangle is between inside and outside, as in a hole or where a surface is within
    /// another, the inside is shrunk until the gradient of the distance is at most 1.
    fn smooth(&self, distances: &mut [f32]) {
        let [nx, ny, nz] = self.points;
        let strides = [1, nx, nx * ny];
        for _ in 0..2 {
            for forward in [true, false] {
                for n in 0..distances.len() {
                    let k = if forward { n } else { distances.len() - 1 - n };
                    let place = [k % nx, k / nx % ny, k / (nx * ny)];
                    let mut raised = distances[k];
                    for (axis, end) in [nx, ny, nz].into_iter().enumerate() {
                        if forward && place[axis] > 0 {
                            raised = raised.max(distances[k - strides[axis]] - self.cell);
                        }
                        if !forward && place[axis] + 1 < end {
                            raised = raised.max(distances[k + strides[axis]] - self.cell);
                        }
                    }
                    distances[k] = raised;
                }
            }
        }
    }

    /// The grid, moved by `moved`; `None` where no point is inside.
    fn finish(&self, distances: Vec<f32>, moved: Vec3) -> Option<DistanceGrid> {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (k, distance) in distances.iter().enumerate() {
            if *distance < 0.0 {
                let p = self.point(k);
                (low, high) = (low.min(p), high.max(p));
            }
        }
        // The surface is within a cell of what is inside.
        let (low, high) = (low - self.cell + moved, high + self.cell + moved);
        let points = UVec3::from_array(self.points.map(|n| n as u32));
        low.is_finite().then(|| {
            let origin = self.origin + moved;
            DistanceGrid::of_samples(origin, self.cell, points, distances, (low, high))
        })
    }
}

/// Trilinear interpolation between eight corners.
fn between(corners: &[f32; 8], x: f32, y: f32, z: f32) -> f32 {
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |k: usize| mix(corners[k], corners[k + 1], x);
    mix(mix(row(0), row(2), y), mix(row(4), row(6), y), z)
}

/// Six times the volume that triangles enclose.
fn volume(triangles: &[[Vec3; 3]]) -> f64 {
    let each = triangles.iter().map(|t| t.map(|p| p.as_dvec3()));
    each.map(|[a, b, c]| a.dot(b.cross(c))).sum()
}

/// The number of edges without a triangle on both sides. Coinciding vertices count as one: meshes
/// have several where texture coordinates or normals differ.
fn open_edges(triangles: &[[Vec3; 3]]) -> usize {
    let bounds = |(low, high): (Vec3, Vec3), p: &Vec3| (low.min(*p), high.max(*p));
    let all = triangles.iter().flatten();
    let (low, high) = all.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), bounds);
    let resolution = SAME / (high - low).max_element();
    let mut places: HashMap<[i32; 3], u32> = default();
    let mut place = |p: Vec3| {
        let next = places.len() as u32;
        let key = ((p - low) * resolution).round().to_array().map(|x| x as i32);
        *places.entry(key).or_insert(next)
    };
    let mut edges: HashMap<(u32, u32), i32> = default();
    for triangle in triangles {
        let [a, b, c] = triangle.map(&mut place);
        if a == b || b == c || c == a {
            continue;
        }
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let (edge, sign) = if p < q { ((p, q), 1) } else { ((q, p), -1) };
            *edges.entry(edge).or_default() += sign;
        }
    }
    edges.values().filter(|sum| **sum != 0).count()
}

/// Resolution of the comparison of vertices, in steps along the longest side.
const SAME: f32 = 2e5;
