//! What is invisible, as lines: colliders, the wind of blowers, the cone of showers, rods.
//!
//! Here and not in the crate, because Bevy's gizmos are a feature that a game need not have. Switched
//! and styled by the config of [`HairGizmos`], as all gizmos are.

use bevy::prelude::*;
use bevy_keratin::{ColliderShape, Shower, prelude::*};
use core::f32::consts::{FRAC_PI_2, TAU};

/// The lines of the overlay. Off until switched on in the `GizmoConfigStore`.
#[derive(Default, Reflect, GizmoConfigGroup)]
pub struct HairGizmos;

pub struct OverlayPlugin;

impl Plugin for OverlayPlugin {
    fn build(&self, app: &mut App) {
        let config = GizmoConfig { enabled: false, depth_bias: -0.2, ..default() };
        let shown = |store: Res<GizmoConfigStore>| store.config::<HairGizmos>().0.enabled;
        app.insert_gizmo_config(HairGizmos, config)
            .add_systems(PostUpdate, (colliders, blowers, showers, rods).run_if(shown));
    }
}

const SOLID: Color = Color::srgb(0.35, 0.85, 0.45);
const WIND: Color = Color::srgb(0.4, 0.75, 1.0);
const WATER: Color = Color::srgb(0.3, 0.55, 1.0);
const ROD: Color = Color::srgb(0.85, 0.5, 0.95);

/// How far wind is drawn (m), and into which angle (rad).
const REACH: f32 = 0.35;
const SPREAD: f32 = 0.16;

fn colliders(mut gizmos: Gizmos<HairGizmos>, colliders: Query<(&HairCollider, &GlobalTransform)>) {
    for (collider, place) in &colliders {
        let (scale, rotation, translation) = place.to_scale_rotation_translation();
        let at = Isometry3d::new(translation, rotation);
        let scale = scale.x;
        match collider.shape.clone() {
            ColliderShape::Sphere(ball) => _ = gizmos.sphere(at, ball.radius * scale, SOLID),
            ColliderShape::Capsule(mut capsule) => {
                capsule.radius *= scale;
                capsule.half_length *= scale;
                gizmos.primitive_3d(&capsule, at, SOLID);
            }
            ColliderShape::Cylinder(mut cylinder) => {
                cylinder.radius *= scale;
                cylinder.half_height *= scale;
                gizmos.primitive_3d(&cylinder, at, SOLID);
            }
            ColliderShape::Plane(plane) => {
                // The grid lies in its own x and y.
                let turn = rotation * Quat::from_rotation_arc(Vec3::Z, *plane.normal);
                let at = Isometry3d::new(translation, turn);
                gizmos.grid(at, UVec2::splat(12), Vec2::splat(0.06), SOLID.with_alpha(0.4));
            }
            ColliderShape::Cuboid { mut cuboid, .. } => {
                cuboid.half_size *= scale;
                gizmos.primitive_3d(&cuboid, at, SOLID);
            }
            ColliderShape::Ellipsoid { radii } | ColliderShape::Hat { radii, .. } => {
                // An ellipse around each axis.
                for turn in [Quat::IDENTITY, Quat::from_rotation_x(FRAC_PI_2)] {
                    let half = (turn.inverse() * radii).abs() * scale;
                    gizmos.ellipse(Isometry3d::new(translation, rotation * turn), half.xy(), SOLID);
                }
                let turn = Quat::from_rotation_y(FRAC_PI_2);
                let at = Isometry3d::new(translation, rotation * turn);
                gizmos.ellipse(at, radii.zy() * scale, SOLID);
            }
            // The salon has none.
            ColliderShape::Hull(_) | ColliderShape::Grid(_) => {}
        }
    }
}

fn blowers(mut gizmos: Gizmos<HairGizmos>, blowers: Query<(&Blower, &GlobalTransform)>) {
    for (blower, place) in &blowers {
        let mouth = place.translation();
        let ahead = *place.forward();
        // A cone as wide as half of the wind is, and an arrow as long as it is strong.
        let ring = REACH * SPREAD.tan();
        let end = mouth + ahead * REACH;
        let turn = Quat::from_rotation_arc(Vec3::Z, ahead);
        gizmos.circle(Isometry3d::new(end, turn), ring, WIND);
        for k in 0..8 {
            let (sin, cos) = (TAU * k as f32 / 8.0).sin_cos();
            gizmos.line(mouth, end + turn * Vec3::new(cos, sin, 0.0) * ring, WIND.with_alpha(0.5));
        }
        let length = REACH * (blower.strength / 10.0).clamp(0.05, 1.0);
        gizmos.arrow(mouth, mouth + ahead * length, WIND);
    }
}

/// Where the drops of a shower may fly, as long as they fly straight: one cone for the plate's rim.
fn showers(mut gizmos: Gizmos<HairGizmos>, showers: Query<(&Shower, &GlobalTransform)>) {
    for (shower, place) in &showers {
        let (_, rotation, plate) = place.to_scale_rotation_translation();
        let end = plate + place.forward() * REACH;
        let rim = shower.opening + REACH * shower.spread.min(1.4).tan();
        gizmos.circle(Isometry3d::new(plate, rotation), shower.opening, WATER);
        gizmos.circle(Isometry3d::new(end, rotation), rim, WATER);
        for k in 0..8 {
            let (sin, cos) = (TAU * k as f32 / 8.0).sin_cos();
            let way = rotation * Vec3::new(cos, sin, 0.0);
            gizmos.line(plate + way * shower.opening, end + way * rim, WATER.with_alpha(0.5));
        }
        let length = REACH * (shower.speed / 5.0).clamp(0.05, 1.0);
        gizmos.arrow(plate, plate + place.forward() * length, WATER);
    }
}

fn rods(mut gizmos: Gizmos<HairGizmos>, rods: Query<(&PermRod, &GlobalTransform)>) {
    for (rod, place) in &rods {
        let (_, rotation, translation) = place.to_scale_rotation_translation();
        let at = Isometry3d::new(translation, rotation);
        gizmos.primitive_3d(&Cylinder::new(rod.radius, rod.length), at, ROD);
        // Which way hair is wound.
        let turn = rotation * Quat::from_rotation_x(-FRAC_PI_2);
        gizmos.arc_3d(4.0, rod.radius * 1.15, Isometry3d::new(translation, turn), ROD);
    }
}
