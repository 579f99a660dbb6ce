//! Pictures in linear light, for comparing with numbers.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses its own part")]

use crate::offscreen::{Offscreen, Picture};
use bevy::{
    camera::{Exposure, ScalingMode},
    core_pipeline::tonemapping::Tonemapping,
    prelude::*,
};

/// The light that a screen's byte stands for.
pub fn linear(byte: u8) -> f32 {
    Color::srgb_u8(byte, byte, byte).to_linear().red
}

pub fn light_at(picture: &Picture, x: u32, y: u32) -> Vec3 {
    Vec3::from(picture.at(x, y).map(linear))
}

/// Makes the camera measure: no exposure, no tone curve, parallel, `height` metres tall, along −z.
pub fn measure(scene: &mut Offscreen, width: f32, height: f32) {
    let projection = Projection::Orthographic(OrthographicProjection {
        scaling_mode: ScalingMode::Fixed { width, height },
        near: 0.0,
        far: 2.0,
        ..OrthographicProjection::default_3d()
    });
    let camera = scene.camera;
    scene.app.world_mut().entity_mut(camera).insert((
        projection,
        Exposure { ev100: -(1.2f32.log2()) },
        Tonemapping::None,
    ));
    scene.look(Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO);
}
