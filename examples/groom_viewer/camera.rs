//! The camera: frames the groom, and orbits it by mouse.

use crate::head::Shown;
use bevy::{
    core_pipeline::tonemapping::Tonemapping,
    input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll},
    prelude::*,
};
use core::f32::consts::FRAC_PI_2;

/// From where the hair is first seen (rad).
pub const YAW: f32 = 0.6;
const FIELD_OF_VIEW: f32 = 0.55;

/// Where the camera is, seen from what it looks at.
#[derive(Component, Clone, Copy, Debug, Default)]
pub struct Orbit {
    focus: Vec3,
    yaw: f32,
    pitch: f32,
    distance: f32,
}

impl Orbit {
    fn pose(&self) -> Transform {
        let turn = Quat::from_euler(EulerRot::YXZ, self.yaw, -self.pitch, 0.0);
        Transform::from_translation(self.focus + turn * Vec3::Z * self.distance).with_rotation(turn)
    }
}

/// The camera's components, for a window or for an image.
pub fn bundle() -> impl Bundle {
    let projection = PerspectiveProjection { fov: FIELD_OF_VIEW, near: 0.01, ..default() };
    (
        Camera3d::default(),
        Projection::from(projection),
        Tonemapping::TonyMcMapface,
        Msaa::Sample4,
        Orbit::default(),
    )
}

/// Brings all of the groom into view once it is there.
pub fn frame(
    shown: Option<Res<Shown>>,
    mut cameras: Query<(&mut Orbit, &mut Transform, &mut Projection)>,
) {
    let Some(shown) = shown.filter(|s| s.is_added()) else {
        return;
    };
    for (mut orbit, mut place, mut projection) in &mut cameras {
        let distance = 1.1 * shown.reach / (0.5 * FIELD_OF_VIEW).sin();
        *orbit = Orbit { focus: shown.middle, yaw: YAW, pitch: 0.15, distance };
        *place = orbit.pose();
        if let Projection::Perspective(projection) = &mut *projection {
            projection.near = 0.02 * distance;
        }
    }
}

/// Dragging orbits, the wheel zooms.
pub fn orbit(
    buttons: Res<ButtonInput<MouseButton>>,
    motion: Res<AccumulatedMouseMotion>,
    scroll: Res<AccumulatedMouseScroll>,
    mut cameras: Query<(&mut Orbit, &mut Transform)>,
) {
    let dragged = if buttons.pressed(MouseButton::Left) { motion.delta } else { Vec2::ZERO };
    if dragged == Vec2::ZERO && scroll.delta.y == 0.0 {
        return;
    }
    for (mut orbit, mut place) in &mut cameras {
        orbit.yaw -= 0.006 * dragged.x;
        orbit.pitch = (orbit.pitch + 0.006 * dragged.y).clamp(-FRAC_PI_2, FRAC_PI_2);
        orbit.distance *= (-0.1 * scroll.delta.y.clamp(-3.0, 3.0)).exp();
        *place = orbit.pose();
    }
}
