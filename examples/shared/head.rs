//! What hair wants of the mannequin's head: solids to lie on, and a scalp in its colour.

use bevy::prelude::*;
use bevy_keratin::{
    authoring::plant::{HairPreset, Scalp},
    prelude::*,
};

/// A capsule as a collider, between the centres of its ends (m).
pub fn limb(a: Vec3, b: Vec3, radius: f32) -> Result<(HairCollider, Transform)> {
    let way = b - a;
    let turn = Quat::from_rotation_arc(Vec3::Y, way.normalize_or(Vec3::Y));
    let place = Transform::from_translation((a + b) * 0.5).with_rotation(turn);
    Ok((HairCollider::capsule(radius, way.length())?, place))
}

/// The upper part of the skull as an ellipsoid: upright about the head's centre (m), its middle and its
/// half axes.
///
/// Only 0.3 mm within the skin: hair beside a parting lies on nothing else, and what sinks into the skin
/// leaves a bald stripe. Roots must not be inside.
pub const CRANIUM: (Vec3, Vec3) = (Vec3::new(0.0, 0.018, 0.0), Vec3::new(0.0767, 0.0997, 0.0947));

/// The rest of it: its sides, its flat back, face and jaw. The ends and the radius of each capsule.
///
/// Fitted to the training head's distance function: the scalp is 0.5 to 5.5 mm outside them, 2 mm as a
/// rule, and no root of a preset is inside.
pub fn skull() -> Vec<(Vec3, Vec3, f32)> {
    let middle = |from: [f32; 2], to: [f32; 2], radius| {
        (Vec3::new(0.0, from[0], from[1]), Vec3::new(0.0, to[0], to[1]), radius)
    };
    let across = |aside: f32, high: f32, front: f32, radius| {
        (Vec3::new(-aside, high, front), Vec3::new(aside, high, front), radius)
    };
    vec![
        middle([-0.003, -0.029], [0.024, -0.025], 0.0761),
        middle([0.030, 0.002], [-0.023, 0.011], 0.0744),
        // Cheeks and lips lie behind the temples' line: a beard's roots must be outside.
        middle([0.041, 0.019], [-0.015, 0.0467], 0.0657),
        across(0.022, 0.015, -0.059, 0.0533),
        across(0.027, -0.010, -0.065, 0.0450),
        middle([0.02, 0.040], [-0.055, 0.043], 0.053),
        middle([-0.066, 0.035], [-0.066, 0.030], 0.047),
    ]
}

/// The collider of [`CRANIUM`].
pub fn cranium() -> Result<(HairCollider, Transform)> {
    let (middle, radii) = CRANIUM;
    Ok((HairCollider::ellipsoid(radii)?, Transform::from_translation(middle)))
}

/// What hair lies on (upright, m), no more than drawn strands are pushed out of.
pub fn body() -> Result<Vec<(HairCollider, Transform)>> {
    // Neck and chest, fitted as the skull is: 2 mm within the skin as a rule, 11 at most.
    let middle = [
        (Vec3::new(0.0, -0.080, -0.017), Vec3::new(0.0, -0.215, -0.045), 0.0513),
        (Vec3::new(-0.054, -0.245, -0.033), Vec3::new(0.054, -0.245, -0.033), 0.0662),
    ];
    // A shoulder, what is between it and the neck, and the muscle along the throat.
    let half = [
        (Vec3::new(0.018, -0.271, -0.016), Vec3::new(0.122, -0.246, -0.040), 0.0593),
        (Vec3::new(0.019, -0.163, -0.041), Vec3::new(0.136, -0.229, -0.047), 0.0408),
        (Vec3::new(0.037, -0.076, -0.001), Vec3::new(0.007, -0.291, 0.004), 0.0223),
    ];
    let parts = skull().into_iter().chain(middle).chain(half.into_iter().flat_map(both));
    let limbs = parts.map(|(a, b, radius)| limb(a, b, radius));
    core::iter::once(cranium()).chain(limbs).collect()
}

/// A capsule on both sides.
fn both((a, b, radius): (Vec3, Vec3, f32)) -> [(Vec3, Vec3, f32); 2] {
    let mirrored = |p: Vec3| p * Vec3::new(-1.0, 1.0, 1.0);
    [(a, b, radius), (mirrored(a), mirrored(b), radius)]
}

/// [`body`] for pictures from near: what it leaves free below the skin is filled. Otherwise hair
/// beside the face sinks into cheeks and shoulders by up to 18 mm, and skin shows through it.
pub fn close_fit() -> Result<Vec<(HairCollider, Transform)>> {
    let half = [
        // Jaw and chin, cheeks and temples, the head behind the ears.
        (Vec3::new(0.0082, -0.0541, 0.0091), Vec3::new(0.0108, -0.0491, 0.0009), 0.0586),
        (Vec3::new(0.0231, -0.0800, 0.0444), Vec3::new(0.0039, -0.0919, 0.0671), 0.0238),
        (Vec3::new(0.0229, -0.0258, -0.0260), Vec3::new(0.0253, -0.0163, 0.0326), 0.0485),
        (Vec3::new(0.0002, -0.0531, 0.0239), Vec3::new(-0.0063, -0.0492, -0.0029), 0.0628),
        (Vec3::new(0.0009, -0.0681, 0.0000), Vec3::new(0.0262, -0.0144, -0.0471), 0.0467),
        (Vec3::new(0.0197, -0.0288, 0.0361), Vec3::new(0.0117, -0.0767, 0.0013), 0.0485),
        // Neck, shoulders, chest.
        (Vec3::new(0.0190, -0.2193, -0.0461), Vec3::new(0.0190, -0.1480, -0.0372), 0.0450),
        (Vec3::new(0.1139, -0.2803, -0.0305), Vec3::new(0.0587, -0.3076, -0.0157), 0.0556),
        (Vec3::new(0.0652, -0.3110, -0.0234), Vec3::new(0.0007, -0.3081, -0.0156), 0.0625),
        (Vec3::new(0.0119, -0.2908, -0.0476), Vec3::new(0.0983, -0.2774, -0.0464), 0.0467),
        (Vec3::new(0.1143, -0.3007, -0.0267), Vec3::new(0.1293, -0.2781, -0.0389), 0.0476),
        (Vec3::new(0.1368, -0.2707, -0.0181), Vec3::new(0.1409, -0.2589, -0.0557), 0.0359),
        (Vec3::new(0.1052, -0.3096, -0.0406), Vec3::new(0.0105, -0.3287, -0.0523), 0.0368),
        (Vec3::new(0.1006, -0.2731, -0.0075), Vec3::new(0.0292, -0.3033, 0.0106), 0.0364),
    ];
    let finer = half.into_iter().flat_map(both).map(|(a, b, radius)| limb(a, b, radius));
    let balls = BALLS.into_iter().flat_map(|(middle, radius)| {
        let both = [middle, middle * Vec3::new(-1.0, 1.0, 1.0)];
        both.map(|at| Ok((HairCollider::sphere(radius)?, Transform::from_translation(at))))
    });
    body()?.into_iter().map(Ok).chain(finer).chain(balls).collect()
}

/// On both sides balls that touch the skin from within, 0.4 to 1 mm below it: before the ears, where hair hangs
/// over bare skin, then all around.
const BALLS: [(Vec3, f32); 14] = [
    (Vec3::new(0.0042, -0.0096, 0.0115), 0.0745),
    (Vec3::new(0.0035, 0.0108, -0.0393), 0.0751),
    (Vec3::new(0.0201, -0.0179, 0.0329), 0.0539),
    (Vec3::new(0.0326, 0.0165, 0.0557), 0.0298),
    (Vec3::new(0.0222, -0.0309, 0.0480), 0.0427),
    (Vec3::new(0.0007, -0.0469, 0.0037), 0.0698),
    (Vec3::new(0.0097, 0.0189, -0.0387), 0.0686),
    (Vec3::new(0.0067, 0.0013, -0.0433), 0.0705),
    (Vec3::new(0.0128, 0.0097, 0.0264), 0.0595),
    (Vec3::new(0.0298, 0.0165, -0.0686), 0.0430),
    (Vec3::new(0.0220, -0.0137, 0.0243), 0.0552),
    (Vec3::new(0.0286, -0.0110, -0.0673), 0.0432),
    (Vec3::new(0.0286, -0.0111, 0.0140), 0.0514),
    (Vec3::new(0.0290, -0.0243, 0.0485), 0.0390),
];

/// The share of the skin that hair hides where it is dense.
pub const COVER: f32 = 0.85;

/// The skin under the hair, tinted by it.
pub fn with_scalp(mut mesh: Mesh, scalp: &Scalp, preset: HairPreset) -> Mesh {
    preset.tint(&mut mesh, scalp, preset.settings().look.melanin.color(), COVER);
    mesh
}
