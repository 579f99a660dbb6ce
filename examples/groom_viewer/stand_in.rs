//! The training head under a groom that comes without one: as broad, high and deep as the roots say.

use crate::{dressed, mannequin, solid::Paint, trained};
use bevy::prelude::*;
use bevy_keratin::{
    authoring::{groom::Groom, plant::Hairline},
    forces::contact::ColliderShape,
    prelude::*,
};

/// By how much its proportions may differ from the training head's.
const ODD: f32 = 1.3;

/// The half axes (m) of the skull that best fits a groom's roots, about the origin; it has about `radius`. No root
/// is inside: what grows inside a collider is pushed out of it.
pub fn skull(groom: &Groom, radius: f32) -> Vec3 {
    // a x² + b y² + c z² = 1 for the roots, by least squares, and near the training head's proportions
    // where roots say nothing.
    let usual = trained::CRANIUM.1;
    let usual = usual * (radius / (usual.element_product()).cbrt());
    let (mut sums, mut rights, mut count) = (Mat3::ZERO, Vec3::ZERO, 0.0);
    for root in groom.roots() {
        let square = root * root / (radius * radius);
        sums += Mat3::from_cols(square * square.x, square * square.y, square * square.z);
        rights += square;
        count += 1.0;
    }
    let little = 0.01 * f32::max(count, 1.0);
    let expected = (radius / usual) * (radius / usual);
    let solved =
        (sums + Mat3::from_diagonal(Vec3::splat(little))).inverse() * (rights + expected * little);
    let fitted = radius / solved.max(Vec3::splat(1e-3)).map(f32::sqrt);
    let fitted = match fitted.is_finite() {
        true => fitted.clamp(usual / ODD, usual * ODD),
        false => usual,
    };
    let nearest = groom.roots().map(|root| (root / fitted).length()).fold(f32::MAX, f32::min);
    fitted * nearest.clamp(0.8, 1.0)
}

/// Puts the head there as children of `parent`, the middle of the skull at its origin. Returns how far below
/// that the bust ends (m).
pub fn spawn(
    commands: &mut Commands,
    paint: &mut Paint,
    parent: Entity,
    (groom, skull): (&Groom, Vec3),
    melanin: Melanin,
) -> Result<f32> {
    let (middle, radii) = trained::CRANIUM;
    let scale = skull / radii;
    let offset = -middle * scale;
    // The mannequin lies: its crown is at +X and its face at +Y.
    let lying = Vec3::new(scale.y, scale.z, scale.x);
    let upright = Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X);
    let place =
        Transform { rotation: Quat::from_mat3(&upright), ..Transform::from_translation(offset) };
    let mut mesh = mannequin::mesh();
    dressed::scalp().tint(&mut mesh, &Hairline::default(), melanin.color(), trained::COVER);
    let mesh = paint.meshes.add(mesh);
    let skin = paint.matte(Color::WHITE, 0.46);
    let head = commands.spawn((Mesh3d(mesh), MeshMaterial3d(skin), place.with_scale(lying))).id();
    let face = dressed::face(lying, dressed::brows(melanin))?.spawn(commands);
    commands.entity(face).insert(place);
    commands.entity(parent).add_children(&[head, face]);
    for (i, (collider, at)) in trained::body()?.into_iter().enumerate() {
        // The first is the skull. Solids grow alike in all directions only.
        let (collider, at) = match i {
            0 => (HairCollider::ellipsoid(skull)?, Transform::default()),
            _ => {
                let least = Vec3::splat(scale.min_element());
                (collider, at.with_scale(least).with_translation(offset + at.translation * scale))
            }
        };
        // Nothing of it where hair grows, or roots would be pushed out of it.
        let ColliderShape::Capsule(capsule) = &collider.shape else {
            commands.spawn((collider, at, ChildOf(parent)));
            continue;
        };
        let from = at.compute_affine().inverse();
        let off = |root: Vec3| {
            let own = from.transform_point3(root);
            (own - Vec3::Y * own.y.clamp(-capsule.half_length, capsule.half_length)).length()
        };
        let nearest = groom.roots().map(off).fold(capsule.radius, f32::min);
        if nearest < 0.5 * capsule.radius {
            continue;
        }
        let collider = HairCollider::capsule(nearest, 2.0 * capsule.half_length)?;
        commands.spawn((collider, at, ChildOf(parent)));
    }
    Ok(0.31 * scale.y - offset.y)
}
