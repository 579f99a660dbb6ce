//! Planting hair on a mesh.

use super::{
    error::PlantError, grow, map::PlantingMaps, recipe::Planting, scatter, surface::Surface,
};
use crate::{authoring::groom::Groom, base::setting::Ranged};
use bevy::prelude::*;

/// A root on a mesh by its triangle and barycentric weights, so that it can follow when the mesh is
/// skinned. Weights are ≥ 0 and sum to 1.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct RootOnMesh {
    /// Indices of the triangle's vertices.
    pub vertices: [u32; 3],
    /// Barycentric weights of these vertices.
    pub weights: Vec3,
}

/// The result of planting.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Planted {
    /// The strands, in the mesh's space; with UVs if the mesh has them.
    pub groom: Groom,
    /// Where each strand grows, in the groom's order.
    pub roots: Vec<RootOnMesh>,
}

impl Planting {
    /// Plants hair all over `mesh`, whose triangles may be a list or a strip, indexed or not.
    /// Directions follow its normals, where it has some.
    ///
    /// Spacing is even (Poisson disk): the density is exact to a per cent, and no two roots are
    /// nearer than half the mean spacing 1/√density. Where surfaces overlap within that distance,
    /// the minimum distance takes precedence over density.
    ///
    /// # Errors
    /// When a setting is out of its range, the mesh has no triangles with an area or vertices that
    /// are not finite, there would be more than [`MAX_ROOTS`](super::MAX_ROOTS) strands, or the curl has fewer than
    /// four nodes a turn.
    pub fn plant(&self, mesh: &Mesh) -> Result<Planted, PlantError> {
        self.plant_with(mesh, &PlantingMaps::new())
    }

    /// Plants hair with density, length or direction that vary over the mesh.
    ///
    /// # Errors
    /// Those of [`plant`](Self::plant); also when the density map leaves no room for a single strand.
    pub fn plant_with(&self, mesh: &Mesh, maps: &PlantingMaps) -> Result<Planted, PlantError> {
        self.plant_beside(mesh, None, maps)
    }

    /// The same with hair that lies on `beside`, of which the mesh is a part.
    pub(super) fn plant_beside(
        &self,
        mesh: &Mesh,
        beside: Option<&Mesh>,
        maps: &PlantingMaps,
    ) -> Result<Planted, PlantError> {
        self.check()?;
        let surface = Surface::of(mesh)?;
        let beside = beside.map(Surface::of).transpose()?;
        let solid = beside.as_ref().unwrap_or(&surface);
        self.check_reach(solid)?;
        let roots = scatter::scatter(&surface, self.density, self.seed, maps)?;
        let lines = grow::grow(self, maps, &surface, solid, &roots);
        let mut planted = Planted::default();
        let (mut kept, mut uvs) = (Vec::with_capacity(lines.len()), Vec::new());
        for (root, line) in roots.iter().zip(lines) {
            // Length 0 leaves places bald, too.
            let Some(line) = line else {
                continue;
            };
            kept.push(line);
            uvs.extend(root.place.uv);
            planted.roots.push(RootOnMesh {
                vertices: surface.triangles[root.triangle as usize],
                weights: root.weights,
            });
        }
        if kept.is_empty() {
            return Err(PlantError::NoRoots { area: surface.area() as f32, density: self.density });
        }
        planted.groom = Groom::from_polylines(kept)?.with_uvs(uvs)?;
        Ok(planted)
    }

    fn check(&self) -> Result<(), PlantError> {
        self.checked()?;
        let Some(curl) = self.curl else { return Ok(()) };
        let turns = self.length / curl.turn_length();
        let expected = (4.0 * turns).ceil() + 1.0;
        if (self.nodes as f32) < expected {
            return Err(PlantError::CoarseCurl {
                nodes: self.nodes,
                turns,
                expected: expected as u32,
            });
        }
        Ok(())
    }

    /// Neighbouring nodes must differ in single precision, however far the mesh is from its origin.
    fn check_reach(&self, surface: &Surface) -> Result<(), PlantError> {
        let segment = self.length / (self.nodes - 1) as f32;
        let most = segment * 1e5;
        let (vertex, found) = surface.farthest();
        if found > most {
            return Err(PlantError::TooFar { vertex, found, most });
        }
        Ok(())
    }
}
