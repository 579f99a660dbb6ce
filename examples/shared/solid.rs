//! Turned solids and plain paint, of which the studio's things are made.

use bevy::{
    asset::RenderAssetUsages,
    ecs::system::SystemParam,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};
use core::f32::consts::TAU;

/// Adds meshes and materials.
#[derive(SystemParam)]
pub struct Paint<'w> {
    pub meshes: ResMut<'w, Assets<Mesh>>,
    materials: ResMut<'w, Assets<StandardMaterial>>,
}

impl Paint<'_> {
    pub fn matte(
        &mut self,
        base_color: Color,
        perceptual_roughness: f32,
    ) -> Handle<StandardMaterial> {
        self.materials.add(StandardMaterial { base_color, perceptual_roughness, ..default() })
    }

    /// Not fully metallic: there is no surrounding that it could mirror.
    pub fn metal(&mut self, base_color: Color) -> Handle<StandardMaterial> {
        let material = StandardMaterial {
            base_color,
            metallic: 0.55,
            perceptual_roughness: 0.28,
            ..default()
        };
        self.materials.add(material)
    }

    pub fn glow(&mut self, base_color: Color, strength: f32) -> Handle<StandardMaterial> {
        let emissive = base_color.to_linear() * strength;
        self.materials.add(StandardMaterial { base_color, emissive, ..default() })
    }
}

/// A solid of revolution around Y from a profile of (radius, height) in m, in `sides` steps. Going up
/// the profile its outside is away from the axis.
pub fn lathe(profile: &[Vec2], sides: u32) -> Mesh {
    let faces: Vec<Vec2> = profile
        .windows(2)
        .map(|p| (p[1] - p[0]).normalize_or_zero())
        .map(|way| Vec2::new(way.y, -way.x))
        .collect();
    // Edges that are nearly straight are shaded round.
    let shade = |at: usize, face: Vec2| match faces.get(at) {
        Some(other) if other.dot(face) > 0.7 => (face + *other).normalize_or(face),
        _ => face,
    };
    let (mut positions, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for (i, ends) in profile.windows(2).enumerate() {
        let face = faces[i];
        let shades = [shade(i.wrapping_sub(1), face), shade(i + 1, face)];
        let first = positions.len() as u32;
        for side in 0..=sides {
            let (sin, cos) = (TAU * side as f32 / sides as f32).sin_cos();
            for (p, n) in ends.iter().zip(shades) {
                positions.push([p.x * cos, p.y, p.x * sin]);
                normals.push([n.x * cos, n.y, n.x * sin]);
            }
        }
        for side in 0..sides {
            let k = first + 2 * side;
            indices.extend([k, k + 1, k + 2, k + 2, k + 1, k + 3]);
        }
    }
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::RENDER_WORLD)
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_indices(Indices::U32(indices))
}
