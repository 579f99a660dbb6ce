//! Hair by compute shaders.
#![cfg(feature = "gpu")]

#[path = "../common/mod.rs"]
mod common;
mod lab;
#[path = "../common/offscreen.rs"]
mod offscreen;
mod twin;

mod bits;
mod closed_forms;
mod cost;
mod crossing;
mod journal;
mod layout;
mod led;
mod lod;
mod pictures;
mod present;
mod probe;
mod residence;
mod shapes;
mod sleep;
mod stage;
mod substep;
