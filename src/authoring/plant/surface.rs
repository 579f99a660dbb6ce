//! A mesh as a surface for sampling points.

use super::{error::PlantError, map::RootPlace};
use bevy::{
    mesh::{Indices, MeshVertexAttribute, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use rand::{RngExt, rngs::Xoshiro256PlusPlus};

/// The triangles of a mesh that have an area.
pub(super) struct Surface {
    pub(super) triangles: Vec<[u32; 3]>,
    /// Cumulative area up to and including each triangle (m²).
    areas: Vec<f64>,
    positions: Vec<Vec3>,
    normals: Option<Vec<Vec3>>,
    uvs: Option<Vec<Vec2>>,
    colors: Option<Vec<Vec4>>,
}

/// A point on a surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    pub(super) triangle: u32,
    pub(super) weights: Vec3,
    pub(super) place: RootPlace,
}

impl Surface {
    pub(super) fn of(mesh: &Mesh) -> Result<Self, PlantError> {
        use VertexAttributeValues as Values;
        let positions: Vec<Vec3> = match attribute(mesh, Mesh::ATTRIBUTE_POSITION)? {
            Some(Values::Float32x3(values)) => values.iter().copied().map(Vec3::from).collect(),
            _ => return Err(PlantError::NoPositions),
        };
        let all = triangles(mesh, positions.len())?;
        if all.is_empty() {
            return Err(PlantError::NoTriangles);
        }
        let (mut kept, mut areas, mut total) = (Vec::new(), Vec::new(), 0.0);
        for triangle in all {
            if let Some(&vertex) = triangle.iter().find(|v| !positions[**v as usize].is_finite()) {
                return Err(PlantError::NonFinite { vertex });
            }
            let [a, b, c] = triangle.map(|v| positions[v as usize].as_dvec3());
            let area = 0.5 * (b - a).cross(c - a).length();
            // Slivers whose area is only rounding error have no normal either.
            let longest = (b - a).length_squared().max((c - a).length_squared());
            if area > 1e-12 * longest {
                total += area;
                kept.push(triangle);
                areas.push(total);
            }
        }
        if kept.is_empty() {
            return Err(PlantError::NoArea { found: 0.0 });
        }
        // An attribute of wrong length or type counts as absent.
        let count = positions.len();
        let fits = |values: &&Values| values.len() == count;
        let normals = match attribute(mesh, Mesh::ATTRIBUTE_NORMAL)?.filter(fits) {
            Some(Values::Float32x3(values)) => {
                Some(values.iter().copied().map(Vec3::from).collect())
            }
            _ => None,
        };
        let uvs = match attribute(mesh, Mesh::ATTRIBUTE_UV_0)?.filter(fits) {
            Some(Values::Float32x2(values)) => {
                Some(values.iter().copied().map(Vec2::from).collect())
            }
            _ => None,
        };
        let colors = match attribute(mesh, Mesh::ATTRIBUTE_COLOR)?.filter(fits) {
            Some(Values::Float32x4(values)) => {
                Some(values.iter().copied().map(Vec4::from).collect())
            }
            Some(Values::Unorm8x4(values)) => {
                let scaled = |v: &[u8; 4]| Vec4::from(v.map(f32::from)) / 255.0;
                Some(values.iter().map(scaled).collect())
            }
            _ => None,
        };
        Ok(Self { triangles: kept, areas, positions, normals, uvs, colors })
    }

    /// All of its area (m²).
    pub(super) fn area(&self) -> f64 {
        self.areas.last().copied().unwrap_or(0.0)
    }

    /// The vertex farthest from the origin and its distance (m).
    pub(super) fn farthest(&self) -> (u32, f32) {
        let distance = |v: u32| self.positions[v as usize].as_dvec3().length() as f32;
        let each = self.triangles.iter().flatten().map(|&v| (v, distance(v)));
        each.fold((0, 0.0), |most, v| if v.1 > most.1 { v } else { most })
    }

    /// `count` stratified samples: one from each of `count` strata of equal area.
    pub(super) fn draw<'a>(
        &'a self,
        count: usize,
        random: &'a mut Xoshiro256PlusPlus,
    ) -> impl Iterator<Item = Root> + 'a {
        let mut triangle = 0;
        (0..count).map(move |i| {
            let along = (i as f64 + random.random::<f64>()) / count as f64 * self.area();
            while triangle + 1 < self.areas.len() && self.areas[triangle] <= along {
                triangle += 1;
            }
            let across = random.random::<f32>().sqrt();
            let along = random.random::<f32>();
            let weights = Vec3::new(1.0 - across, across * (1.0 - along), across * along);
            self.root(triangle, weights)
        })
    }

    fn root(&self, triangle: usize, weights: Vec3) -> Root {
        let corners = self.triangles[triangle].map(|v| v as usize);
        let [a, b, c] = corners.map(|v| self.positions[v]);
        let flat = self.flat_normal(triangle);
        let normal = self.normals.as_ref().map_or(flat, |normals| {
            let [a, b, c] = corners.map(|v| normals[v]);
            let smooth = (a * weights.x + b * weights.y + c * weights.z).normalize_or(flat);
            // Custom normals may point anywhere; hair must not grow inward.
            if smooth.is_finite() && smooth.dot(flat) > 0.2 { smooth } else { flat }
        });
        let uv = self.uvs.as_ref().map(|uvs| {
            let [a, b, c] = corners.map(|v| uvs[v]);
            a * weights.x + b * weights.y + c * weights.z
        });
        let color = self.colors.as_ref().map(|colors| {
            let [a, b, c] = corners.map(|v| colors[v]);
            a * weights.x + b * weights.y + c * weights.z
        });
        let position = a * weights.x + b * weights.y + c * weights.z;
        Root {
            triangle: triangle as u32,
            weights,
            place: RootPlace { position, normal, uv, color },
        }
    }

    /// The places of a triangle's vertices (m).
    pub(super) fn corners(&self, triangle: usize) -> [Vec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// The triangle's own normal, by the order of its vertices.
    pub(super) fn flat_normal(&self, triangle: usize) -> Vec3 {
        let [a, b, c] = self.triangles[triangle].map(|v| self.positions[v as usize].as_dvec3());
        (b - a).cross(c - a).normalize_or(bevy::math::DVec3::Y).as_vec3()
    }
}

fn attribute(
    mesh: &Mesh,
    which: MeshVertexAttribute,
) -> Result<Option<&VertexAttributeValues>, PlantError> {
    mesh.try_attribute_option(which).map_err(|_| PlantError::Extracted)
}

fn triangles(mesh: &Mesh, vertices: usize) -> Result<Vec<[u32; 3]>, PlantError> {
    // The largest value of the index type restarts a strip.
    let (indices, restart): (Vec<u32>, u32) =
        match mesh.try_indices_option().map_err(|_| PlantError::Extracted)? {
            Some(Indices::U16(i)) => (i.iter().map(|&i| u32::from(i)).collect(), 0xffff),
            Some(Indices::U32(i)) => (i.clone(), u32::MAX),
            None => (
                u32::try_from(vertices).map_or_else(|_| Vec::new(), |n| (0..n).collect()),
                u32::MAX,
            ),
        };
    let is_strip = match mesh.primitive_topology() {
        PrimitiveTopology::TriangleList => false,
        PrimitiveTopology::TriangleStrip => true,
        found => return Err(PlantError::NotTriangles { found }),
    };
    let outside = |i: &&u32| **i as usize >= vertices && !(is_strip && **i == restart);
    if let Some(&found) = indices.iter().find(outside) {
        return Err(PlantError::Index { found, vertices });
    }
    if !is_strip {
        return Ok(indices.as_chunks::<3>().0.to_vec());
    }
    let has_restart = |i: &u32| *i == restart && *i as usize >= vertices;
    let strips = indices.split(has_restart);
    let triangles = strips.flat_map(|strip| {
        strip.windows(3).enumerate().map(|(i, v)| match i % 2 {
            0 => [v[0], v[1], v[2]],
            _ => [v[1], v[0], v[2]],
        })
    });
    Ok(triangles.collect())
}
