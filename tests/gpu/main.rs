//! Hair by compute shaders.
#![cfg(feature = "gpu")]

#[path = "../common/mod.rs"]
mod common;
mod lab;
#[path = "../common/offscreen.rs"]
mod offscreen;
#[path = "../../examples/shared/scenes/mod.rs"]
mod scenes;
mod twin;
#[path = "../common/golden.rs"]
mod vectors;

mod bad;
mod bits;
mod closed_forms;
mod cost;
mod crossing;
mod golden;
mod journal;
mod layout;
mod led;
mod lod;
mod papers;
mod pictures;
mod pipelined;
mod present;
mod probe;
mod residence;
mod shapes;
mod sleep;
mod stage;
mod substep;
mod sweeps;
