//! Distance grids of Bevy's meshes.

use crate::forces::contact::{Bake, BakeError, DistanceGrid};
use bevy::{
    mesh::{Mesh, PrimitiveTopology, VertexAttributeValues as Values},
    prelude::*,
};

impl DistanceGrid {
    /// Bakes a mesh, in its own space: [`DistanceGrid::bake_with`]. On the mesh's entity, or on a child of
    /// it, the grid's collider lies where the mesh is drawn, unless that is skinned or morphed.
    ///
    /// ```
    /// # use bevy_keratin::{forces::contact::*, prelude::*}; use bevy::prelude::*;
    /// # fn bake(mut commands: Commands, meshes: Res<Assets<Mesh>>, entity: Entity, mesh: &Mesh3d) -> Result {
    /// if let Some(mesh) = meshes.get(mesh) {
    ///     let grid = DistanceGrid::of_mesh(mesh, &Bake { cell: 0.02, ..default() })?;
    ///     commands.entity(entity).insert(HairCollider::grid(grid));
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// As [`bake_with`](Self::bake_with), and when the mesh has no positions or triangles in the main world.
    pub fn of_mesh(mesh: &Mesh, how: &Bake) -> Result<Self, BakeError> {
        let missing = |what| BakeError::NoAttribute { what };
        let places = mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION).ok().flatten();
        let Some(Values::Float32x3(places)) = places else { return Err(missing("positions")) };
        let places: Vec<Vec3> = places.iter().copied().map(Vec3::from).collect();
        let corners: Vec<u32> = match mesh.try_indices_option() {
            Ok(Some(indices)) => indices.iter().map(|v| v as u32).collect(),
            Ok(None) => (0..places.len() as u32).collect(),
            Err(_) => return Err(missing("indices")),
        };
        let triangles: Vec<[u32; 3]> = match mesh.primitive_topology() {
            PrimitiveTopology::TriangleList => corners.as_chunks::<3>().0.to_vec(),
            PrimitiveTopology::TriangleStrip => {
                let each = corners.windows(3).enumerate();
                each.map(|(k, t)| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
                    .collect()
            }
            _ => return Err(missing("triangles")),
        };
        Self::bake_with(&places, &triangles, how)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forces::contact::Openings;
    use bevy::{asset::RenderAssetUsages, mesh::Indices};

    #[test]
    fn meshes_of_bevy_are_closed_though_their_vertices_are_not_shared() {
        let how = Bake { cell: 0.01, ..default() };
        let meshes = [
            Cuboid::new(0.2, 0.2, 0.2).mesh().build(),
            Sphere::new(0.1).mesh().uv(32, 18),
            Sphere::new(0.1).mesh().ico(8).unwrap(),
        ];
        for (k, mesh) in meshes.iter().enumerate() {
            let grid = match DistanceGrid::of_mesh(mesh, &how) {
                Ok(grid) => grid,
                // Sines and cosines of a whole turn are not those of none.
                Err(BakeError::Open { .. }) if k == 1 => {
                    let how = Bake { openings: Openings::Fill, ..how };
                    DistanceGrid::of_mesh(mesh, &how).unwrap()
                }
                Err(error) => panic!("{k}: {error}"),
            };
            assert!((grid.distance(Vec3::X * 0.08) + 0.02).abs() < 2e-3, "{k}");
            assert!((grid.distance(Vec3::X * 0.13) - 0.03).abs() < 2e-3, "{k}");
        }
        let strip = Mesh::new(PrimitiveTopology::TriangleStrip, RenderAssetUsages::default())
            .with_inserted_attribute(
                Mesh::ATTRIBUTE_POSITION,
                vec![[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.1, 0.1, 0.0]],
            )
            .with_inserted_indices(Indices::U16(vec![0, 1, 2, 3]));
        let shell = Bake { openings: Openings::Shell { thickness: 0.03 }, ..how };
        let sheet = DistanceGrid::of_mesh(&strip, &shell).unwrap();
        // Half way through, the distance has a ridge that lies between two layers of points.
        let within = sheet.distance(Vec3::new(0.08, 0.08, 0.0));
        assert!((within + 0.015).abs() < 0.6 * how.cell, "{within}");
        let mut bare = meshes[0].clone();
        bare.remove_attribute(Mesh::ATTRIBUTE_POSITION);
        let error = DistanceGrid::of_mesh(&bare, &how).unwrap_err();
        assert_eq!(error, BakeError::NoAttribute { what: "positions" });
        let points = Mesh::new(PrimitiveTopology::PointList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0; 3]; 3]);
        let error = DistanceGrid::of_mesh(&points, &how).unwrap_err();
        assert_eq!(error, BakeError::NoAttribute { what: "triangles" });
    }
}
