//! Light, room and camera.

use crate::{figure::Figure, solid::Paint, studio};
use bevy::{
    core_pipeline::{prepass::DepthPrepass, tonemapping::Tonemapping},
    input::mouse::{AccumulatedMouseMotion, AccumulatedMouseScroll},
    light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap},
    prelude::*,
};
use core::f32::consts::FRAC_PI_2;

const FIELD_OF_VIEW: f32 = 0.5;

/// Where the camera is, seen from the figure.
#[derive(Component, Clone, Copy, Debug)]
pub struct Follow {
    /// What it looks at, above the figure's feet (m).
    pub height: f32,
    /// Turn from the way the figure goes (rad): 0 looks into its face.
    pub yaw: f32,
    /// Height above the horizon (rad).
    pub pitch: f32,
    /// Distance (m).
    pub distance: f32,
}

impl Default for Follow {
    fn default() -> Self {
        Self { height: 1.0, yaw: 0.7, pitch: 0.12, distance: 4.4 }
    }
}

/// The camera's components, for a window or for an image.
pub fn camera() -> impl Bundle {
    let projection = PerspectiveProjection { fov: FIELD_OF_VIEW, near: 0.05, ..default() };
    (
        Camera3d::default(),
        Projection::from(projection),
        Tonemapping::TonyMcMapface,
        Msaa::Sample4,
        DepthPrepass,
        Follow::default(),
    )
}

pub struct StagePlugin;

impl Plugin for StagePlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(DirectionalLightShadowMap { size: 4096 })
            .insert_resource(GlobalAmbientLight { brightness: 320.0, ..default() })
            .add_systems(Startup, light)
            .add_systems(Update, orbit)
            .add_systems(PostUpdate, follow.before(TransformSystems::Propagate));
    }
}

fn light(mut commands: Commands, mut paint: Paint) {
    let light = |at: Vec3, lux: f32, color: Color, shadows: bool| {
        let light = DirectionalLight {
            illuminance: lux,
            color,
            shadow_maps_enabled: shadows,
            shadow_normal_bias: 0.8,
            ..default()
        };
        let cascades = CascadeShadowConfigBuilder {
            num_cascades: 2,
            first_cascade_far_bound: 2.0,
            maximum_distance: 8.0,
            ..default()
        };
        (light, cascades.build(), Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y))
    };
    commands.spawn(light(Vec3::new(1.0, 1.6, 1.2), 8000.0, Color::srgb(1.0, 0.95, 0.88), true));
    commands.spawn(light(Vec3::new(-1.5, 0.5, 0.9), 2500.0, Color::srgb(0.8, 0.88, 1.0), false));
    commands.spawn(light(Vec3::new(-0.7, 1.0, -1.5), 4000.0, Color::WHITE, true));
    studio::room(&mut commands, &mut paint, 0.0, 4.0);
}

/// Dragging orbits, the wheel zooms.
fn orbit(
    buttons: Option<Res<ButtonInput<MouseButton>>>,
    motion: Option<Res<AccumulatedMouseMotion>>,
    scroll: Option<Res<AccumulatedMouseScroll>>,
    mut cameras: Query<&mut Follow>,
) {
    let (Some(buttons), Some(motion), Some(scroll)) = (buttons, motion, scroll) else { return };
    let dragged = if buttons.pressed(MouseButton::Left) { motion.delta } else { Vec2::ZERO };
    for mut follow in &mut cameras {
        follow.yaw -= 0.006 * dragged.x;
        follow.pitch = (follow.pitch + 0.006 * dragged.y).clamp(-0.1, 0.9 * FRAC_PI_2);
        let zoom = (-0.1 * scroll.delta.y.clamp(-3.0, 3.0)).exp();
        follow.distance = (follow.distance * zoom).clamp(0.5, 5.5);
        // Near, it looks at the head.
        if zoom != 1.0 {
            follow.height = 1.0 + 0.5 * ((3.5 - follow.distance) / 2.5).clamp(0.0, 1.0);
        }
    }
}

fn follow(
    figures: Query<&Transform, (With<Figure>, Without<Follow>)>,
    mut cameras: Query<(&Follow, &mut Transform)>,
) {
    let Some(figure) = figures.iter().next() else { return };
    for (follow, mut place) in &mut cameras {
        let turn =
            figure.rotation * Quat::from_euler(EulerRot::YXZ, follow.yaw, -follow.pitch, 0.0);
        let focus = figure.translation + Vec3::Y * follow.height;
        *place = Transform::from_translation(focus + turn * Vec3::Z * follow.distance)
            .with_rotation(turn);
    }
}
