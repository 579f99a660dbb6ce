//! The camera: frames each scene's action, and orbits it by mouse.

use crate::{orbit::Orbit, panel, scenes::SceneKind, worn::Shown};
use bevy::{
    input::mouse::{AccumulatedMouseScroll, MouseScrollUnit},
    prelude::*,
    window::CursorMoved,
};
use bevy_egui::input::EguiWantsInput;
use core::f32::consts::{FRAC_PI_2, TAU};

/// How near and far the wheel goes (m): the backdrop is farther than the farthest.
const NEAR: f32 = 0.15;
const FAR: f32 = 1.9;
/// Turn per pixel of the mouse (rad).
const TURN: f32 = 0.006;

/// Frames what is on the stage when that is another scene, or a head after a scene; the user's view stays
/// otherwise.
pub fn frame_stage(
    shown: Res<Shown>,
    mut last: Local<Option<Option<SceneKind>>>,
    mut orbits: Query<&mut Orbit>,
) {
    let kind = match *shown {
        Shown::Scene(scene) => Some(scene.kind),
        Shown::Preset(_) => None,
    };
    if last.replace(kind).is_some_and(|last| last != kind) {
        for mut orbit in &mut orbits {
            let framed = kind.map_or_else(Orbit::of_head, Orbit::of);
            *orbit = Orbit { shift: orbit.shift, ..framed };
        }
    }
}

/// Dragging orbits (right or middle button: moves), the wheel zooms, unless the panel has the mouse.
pub fn orbit(
    buttons: Res<ButtonInput<MouseButton>>,
    mut moves: MessageReader<CursorMoved>,
    scroll: Res<AccumulatedMouseScroll>,
    egui: Res<EguiWantsInput>,
    windows: Query<&Window>,
    mut dragging: Local<bool>,
    mut orbits: Query<&mut Orbit>,
) {
    let motion: Vec2 = moves.read().filter_map(|moved| moved.delta).sum();
    let over_panel = |w: &Window| w.cursor_position().is_some_and(|p| p.x < panel::WIDTH);
    let taken = egui.wants_any_pointer_input() || windows.iter().any(over_panel);
    let turning = buttons.pressed(MouseButton::Left);
    let moving = buttons.any_pressed([MouseButton::Right, MouseButton::Middle]);
    // A drag belongs to whom it began with.
    let fresh = buttons.get_just_pressed().next().is_some();
    *dragging = (turning || moving) && (*dragging || (fresh && !taken));
    let wheel = match scroll.unit {
        MouseScrollUnit::Line => scroll.delta.y,
        MouseScrollUnit::Pixel => scroll.delta.y / 40.0,
    };
    for mut orbit in &mut orbits {
        if *dragging && motion != Vec2::ZERO {
            if turning {
                orbit.yaw = (orbit.yaw - motion.x * TURN).rem_euclid(TAU);
                let pitch = orbit.pitch + motion.y * TURN;
                orbit.pitch = pitch.clamp(-0.25, FRAC_PI_2 - 0.02);
            } else {
                let turn = Quat::from_euler(EulerRot::YXZ, orbit.yaw, -orbit.pitch, 0.0);
                let way = turn * Vec3::new(-motion.x, motion.y, 0.0);
                let focus = orbit.focus + way * (orbit.distance * 8e-4);
                orbit.focus = focus.clamp(Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 0.9, 0.5));
            }
        }
        if wheel != 0.0 && !taken {
            orbit.distance = (orbit.distance * (-0.12 * wheel).exp()).clamp(NEAR, FAR);
        }
    }
}

/// Puts the camera where its orbit says.
pub fn place(mut cameras: Query<(&Orbit, &mut Transform), Changed<Orbit>>) {
    for (orbit, mut transform) in &mut cameras {
        *transform = orbit.pose();
        // Never under the floor.
        transform.translation.y = transform.translation.y.max(0.01);
    }
}
