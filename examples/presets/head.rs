//! What hair wants of the mannequin's head: solids to lie on, and a scalp in its colour.

use bevy::prelude::*;
use bevy_keratin::{
    plant::{HairPreset, Scalp},
    prelude::*,
};
use core::f32::consts::PI;

/// A capsule as a collider, between the centres of its ends (m).
pub fn limb(a: Vec3, b: Vec3, radius: f32) -> Result<(HairCollider, Transform)> {
    let way = b - a;
    let turn = Quat::from_rotation_arc(Vec3::Y, way.normalize_or(Vec3::Y));
    let place = Transform::from_translation((a + b) * 0.5).with_rotation(turn);
    Ok((HairCollider::capsule(radius, way.length())?, place))
}

/// The skull: its core, and balls rolled inside it from the forehead over the crown to the nape.
/// Then face and jaw. Upright about the head's centre (m), the ends and the radius of each capsule.
///
/// All a little within the skin, because roots must not be inside, yet not by more than what hair
/// that lies on them needs to be seen.
pub fn skull() -> Vec<(Vec3, Vec3, f32)> {
    let core = (Vec3::new(0.0, 0.018, -0.020), Vec3::new(0.0, 0.018, 0.018), 0.074);
    let rolled = |i: u8| {
        let (sine, cosine) = (f32::from(i) * PI / 6.0).sin_cos();
        Vec3::new(0.0, 0.018 + 0.042 * sine, 0.037 * cosine)
    };
    let face = (Vec3::new(0.0, 0.02, 0.040), Vec3::new(0.0, -0.055, 0.043), 0.053);
    let jaw = (Vec3::new(0.0, -0.066, 0.035), Vec3::new(0.0, -0.066, 0.030), 0.047);
    let balls = (0..8).map(|i| (rolled(i), rolled(i + 1), 0.057));
    [core].into_iter().chain(balls).chain([face, jaw]).collect()
}

/// What hair lies on, as balls and capsules (upright, m).
pub fn body() -> Result<Vec<(HairCollider, Transform)>> {
    // Neck, shoulders, chest.
    let bust = [
        (Vec3::new(0.0, -0.05, -0.012), Vec3::new(0.0, -0.2, -0.03), 0.050),
        (Vec3::new(-0.15, -0.27, -0.04), Vec3::new(0.0, -0.235, -0.035), 0.058),
        (Vec3::new(0.15, -0.27, -0.04), Vec3::new(0.0, -0.235, -0.035), 0.058),
        // Between neck and shoulders.
        (Vec3::new(-0.03, -0.15, -0.045), Vec3::new(-0.115, -0.215, -0.045), 0.037),
        (Vec3::new(0.03, -0.15, -0.045), Vec3::new(0.115, -0.215, -0.045), 0.037),
        (Vec3::new(-0.08, -0.30, -0.02), Vec3::new(0.08, -0.30, -0.02), 0.07),
    ];
    let parts = skull().into_iter().chain(bust);
    parts.map(|(a, b, radius)| limb(a, b, radius)).collect()
}

/// The share of the skin that hair hides where it is dense.
pub const COVER: f32 = 0.85;

/// The skin under the hair, tinted by it.
pub fn with_scalp(mut mesh: Mesh, scalp: &Scalp, preset: HairPreset) -> Mesh {
    preset.tint(&mut mesh, scalp, preset.settings().look.melanin.color(), COVER);
    mesh
}
