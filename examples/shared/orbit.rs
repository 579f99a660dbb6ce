//! From where the salon is seen.

use crate::scenes::SceneKind;
use bevy::{core_pipeline::tonemapping::Tonemapping, prelude::*};

/// How high the middle of a head is that wears a preset (m).
pub const HEAD: f32 = 0.47;
const FIELD_OF_VIEW: f32 = 0.55;

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

impl Orbit {
    /// The view in which a scene's story is seen best.
    pub fn of(kind: SceneKind) -> Self {
        let (focus, yaw, pitch, distance) = match kind {
            SceneKind::Bedhead => (Vec3::new(-0.03, 0.235, 0.0), 0.32, 0.13, 1.04),
            SceneKind::BlowDry => (Vec3::new(-0.03, 0.24, 0.0), 0.45, 0.2, 1.08),
            SceneKind::Perm => (Vec3::new(-0.02, 0.55, 0.0), 0.62, 0.08, 1.22),
            SceneKind::Wet => (Vec3::new(0.0, 0.26, 0.0), 0.3, 0.1, 1.15),
            SceneKind::Shower => (Vec3::new(-0.06, 0.235, 0.0), 0.32, 0.13, 1.08),
        };
        Self { focus, yaw, pitch, distance, shift: 0.0 }
    }

    /// The view in which a head of hair is seen best.
    #[allow(dead_code, reason = "the gallery has no presets on this stage")]
    pub fn of_head() -> Self {
        let focus = Vec3::new(0.0, HEAD - 0.055, 0.0);
        Self { focus, yaw: 0.5, pitch: 0.08, distance: 0.98, shift: 0.0 }
    }

    /// Where the camera is.
    pub fn pose(&self) -> Transform {
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
