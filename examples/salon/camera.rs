//! The camera: frames each scene's action, and orbits it by mouse.

use crate::{
    panel,
    scenes::{Scene, SceneKind},
};
use bevy::{
    core_pipeline::tonemapping::Tonemapping,
    input::mouse::{AccumulatedMouseScroll, MouseScrollUnit},
    prelude::*,
    window::CursorMoved,
};
use bevy_egui::input::EguiWantsInput;
use core::f32::consts::{FRAC_PI_2, TAU};

/// Where the camera is, seen from what it looks at.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// What it looks at (m).
    pub focus: Vec3,
    /// Turn around the vertical (rad); 0 looks along −Z.
    pub yaw: f32,
    /// Height above the horizon (rad).
    pub pitch: f32,
    /// Distance (m).
    pub distance: f32,
    /// How far the picture is moved to the right, as a share of its height: room for the panel.
    pub shift: f32,
}

/// How near and far the wheel goes (m): the backdrop is farther than the farthest.
const NEAR: f32 = 0.15;
const FAR: f32 = 1.9;
/// Turn per pixel of the mouse (rad).
const TURN: f32 = 0.006;
const FIELD_OF_VIEW: f32 = 0.55;

impl Orbit {
    /// The view in which a scene's story is seen best.
    pub fn of(kind: SceneKind) -> Self {
        let (focus, yaw, pitch, distance) = match kind {
            SceneKind::Bedhead => (Vec3::new(-0.03, 0.235, 0.0), 0.32, 0.13, 1.04),
            SceneKind::BlowDry => (Vec3::new(-0.03, 0.24, 0.0), 0.45, 0.2, 1.08),
            SceneKind::Perm => (Vec3::new(0.0, 0.465, 0.0), 0.6, 0.08, 1.42),
            SceneKind::Wet => (Vec3::new(0.0, 0.26, 0.0), 0.3, 0.1, 1.15),
            SceneKind::Shower => (Vec3::new(-0.06, 0.235, 0.0), 0.32, 0.13, 1.08),
        };
        Self { focus, yaw, pitch, distance, shift: 0.0 }
    }

    fn pose(&self) -> Transform {
        let turn = Quat::from_euler(EulerRot::YXZ, self.yaw, -self.pitch, 0.0);
        let height = 2.0 * self.distance * (0.5 * FIELD_OF_VIEW).tan();
        let aside = turn * Vec3::NEG_X * (self.shift * height);
        Transform::from_translation(self.focus + aside + turn * Vec3::Z * self.distance)
            .with_rotation(turn)
    }
}

/// The camera's components, for a window or for an image.
pub fn bundle(kind: SceneKind) -> impl Bundle {
    let orbit = Orbit::of(kind);
    (
        Camera3d::default(),
        Projection::from(PerspectiveProjection { fov: FIELD_OF_VIEW, near: 0.02, ..default() }),
        Tonemapping::TonyMcMapface,
        Msaa::Sample4,
        orbit.pose(),
        orbit,
    )
}

/// Frames a scene when another kind is chosen; the user's view stays otherwise.
pub fn frame_scene(
    scene: Res<Scene>,
    mut last: Local<Option<SceneKind>>,
    mut orbits: Query<&mut Orbit>,
) {
    if last.replace(scene.kind).is_some_and(|kind| kind != scene.kind) {
        for mut orbit in &mut orbits {
            *orbit = Orbit { shift: orbit.shift, ..Orbit::of(scene.kind) };
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
