//! Points on a mesh: the nearest ones to given roots, and samples of the whole surface.

use super::{error::PlantError, planting::RootOnMesh, surface::Surface};
use crate::base::grid::KdTree;
use bevy::prelude::*;
use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};

/// Triangles of which the largest is so many times as large as the smallest are searched together.
const ALIKE: f32 = 2.0;

/// By how much farther a triangle is looked for than it can be, as a share: distances are rounded.
const SLACK: f32 = 1e-4;

impl RootOnMesh {
    /// The points of a mesh that are nearest to `places`, each with its distance (m): the roots of
    /// a groom that was made for this mesh. In the mesh's own space.
    ///
    /// Of triangles that are equally near, the one with the nearest centroid.
    ///
    /// ```
    /// # use bevy_keratin::authoring::plant::*; use bevy::prelude::*;
    /// let head = Sphere::new(0.1).mesh().build();
    /// let found = RootOnMesh::nearest(&head, [Vec3::Y * 0.11]).unwrap();
    /// assert!((found[0].1 - 0.01).abs() < 1e-3);
    /// ```
    ///
    /// # Errors
    /// When the mesh has no triangles with an area, or vertices that are not finite.
    pub fn nearest(
        mesh: &Mesh,
        places: impl IntoIterator<Item = Vec3>,
    ) -> Result<Vec<(Self, f32)>, PlantError> {
        let surface = Surface::of(mesh)?;
        let sizes = by_size(&surface);
        let nearest = |place: Vec3| {
            // Distance, square of that of the centroid, triangle.
            let mut best = (f32::INFINITY, f32::INFINITY, u32::MAX);
            let mut found = Self::default();
            for (radius, tree) in &sizes {
                let reach = |best: f32| (best + radius) * (1.0 + SLACK);
                tree.visit(place, reach(best.0), |i, square| {
                    let corners = surface.corners(i as usize);
                    let weights = nearest_on(corners, place);
                    let at =
                        corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
                    let one = (at.distance(place), square, i);
                    if one < best {
                        best = one;
                        found = Self { vertices: surface.triangles[i as usize], weights };
                    }
                    reach(best.0)
                });
            }
            (found, best.0)
        };
        Ok(places.into_iter().map(nearest).collect())
    }
}

/// The triangles in groups of like size, small ones first: how far the corners of a group are from their centroids at
/// most (m), and its centroids.
fn by_size(surface: &Surface) -> Vec<(f32, KdTree)> {
    let mut all: Vec<(f32, Vec3, u32)> = (0..surface.triangles.len())
        .zip(0u32..)
        .map(|(triangle, i)| {
            let corners = surface.corners(triangle);
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            let radius = corners.iter().map(|p| p.distance(middle)).fold(0.0, f32::max);
            (radius, middle, i)
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let mut groups = Vec::new();
    let mut rest = &all[..];
    while let Some((smallest, ..)) = rest.first() {
        let (alike, larger) = rest.split_at(rest.partition_point(|of| of.0 <= smallest * ALIKE));
        rest = larger;
        groups.push((alike[alike.len() - 1].0, KdTree::new(alike.iter().map(|of| (of.1, of.2)))));
    }
    groups
}

/// Barycentric weights of the point of a triangle that is nearest to `p` (Ericson 2005, "Real-Time
/// Collision Detection", 5.1.5): a corner, a point of an edge, or one inside.
fn nearest_on([a, b, c]: [Vec3; 3], p: Vec3) -> Vec3 {
    let (ab, ac) = (b - a, c - a);
    let along = |from: Vec3| (ab.dot(p - from), ac.dot(p - from));
    let ((a1, a2), (b1, b2), (c1, c2)) = (along(a), along(b), along(c));
    if a1 <= 0.0 && a2 <= 0.0 {
        return Vec3::X;
    }
    if b1 >= 0.0 && b2 <= b1 {
        return Vec3::Y;
    }
    if c2 >= 0.0 && c1 <= c2 {
        return Vec3::Z;
    }
    let (to_a, to_b, to_c) = (b1 * c2 - c1 * b2, c1 * a2 - a1 * c2, a1 * b2 - b1 * a2);
    if to_c <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        let share = a1 / (a1 - b1);
        return Vec3::new(1.0 - share, share, 0.0);
    }
    if to_b <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        let share = a2 / (a2 - c2);
        return Vec3::new(1.0 - share, 0.0, share);
    }
    if to_a <= 0.0 && b2 >= b1 && c1 >= c2 {
        let share = (b2 - b1) / ((b2 - b1) + (c1 - c2));
        return Vec3::new(0.0, 1.0 - share, share);
    }
    let all = to_a + to_b + to_c;
    if all > 0.0 { Vec3::new(to_a, to_b, to_c) / all } else { Vec3::X }
}

/// A point of a mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint {
    /// Where it is (m).
    pub at: Vec3,
    /// The normal of its triangle.
    pub normal: Vec3,
    /// Vertex colour, red.
    pub red: f32,
}

/// `count` stratified samples of a mesh, the same each time.
pub(crate) fn surface_points(mesh: &Mesh, count: usize) -> Result<Vec<SurfacePoint>, PlantError> {
    let surface = Surface::of(mesh)?;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
    let points = surface.draw(count, &mut random).map(|root| SurfacePoint {
        at: root.place.position,
        normal: surface.flat_normal(root.triangle as usize),
        red: root.place.color.map_or(0.0, |color| color.x),
    });
    Ok(points.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;

    #[test]
    fn of_triangles_of_all_sizes_the_nearest_is_found() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut place =
            |size: f32| size * Vec3::from_array([(); 3].map(|()| random.random_range(-1.0..1.0)));
        let corners: Vec<[Vec3; 3]> = (0..400)
            .map(|i| {
                // Few are large, as on a body of few triangles with a face of many.
                let (middle, size) = (place(1.0), if i % 40 == 0 { 1.0 } else { 0.03 });
                [middle + place(size), middle + place(size), middle + place(size)]
            })
            .collect();
        let mesh = Mesh::new(
            bevy::mesh::PrimitiveTopology::TriangleList,
            bevy::asset::RenderAssetUsages::default(),
        )
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners.concat());
        let places: Vec<Vec3> = (0..300).map(|i| place(if i < 10 { 30.0 } else { 1.2 })).collect();
        let found = RootOnMesh::nearest(&mesh, places.iter().copied()).unwrap();
        for (p, (_, apart)) in places.iter().zip(found) {
            let of = |corners: &[Vec3; 3]| {
                let w = nearest_on(*corners, *p);
                (corners[0] * w.x + corners[1] * w.y + corners[2] * w.z).distance(*p)
            };
            let least = corners.iter().map(of).fold(f32::INFINITY, f32::min);
            assert!((apart - least).abs() < 1e-5 * (1.0 + least), "{apart}, not {least}");
        }
        let nowhere = RootOnMesh::nearest(&mesh, [Vec3::NAN]).unwrap();
        assert!(!nowhere[0].1.is_finite());
    }

    #[test]
    fn the_nearest_point_of_a_triangle_is_nearer_than_any_other() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut place = || Vec3::from_array([(); 3].map(|()| random.random_range(-1.0..1.0)));
        for _ in 0..500 {
            let (corners, p) = ([place(), place(), place()], place());
            let at = |w: Vec3| corners[0] * w.x + corners[1] * w.y + corners[2] * w.z;
            let found = nearest_on(corners, p);
            assert!((found.element_sum() - 1.0).abs() < 1e-5 && found.min_element() >= 0.0);
            let least = at(found).distance(p);
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let w = Vec3::new(i as f32, j as f32, (20 - i - j) as f32) / 20.0;
                    assert!(at(w).distance(p) > least - 1e-5, "{corners:?} {p}");
                }
            }
        }
    }
}
