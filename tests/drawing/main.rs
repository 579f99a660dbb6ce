//! Apps that draw, on any Vulkan device.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/linear.rs"]
mod linear;
#[path = "../../examples/shared/mannequin.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod mannequin;
#[path = "../common/offscreen.rs"]
mod offscreen;

/// What the modules of examples expect of their app.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

mod cost;
mod coverage;
mod dye;
mod frames;
mod groom;
mod light;
mod look;
mod pictures;
mod plugins;
mod reference;
mod twin;
mod wet;
