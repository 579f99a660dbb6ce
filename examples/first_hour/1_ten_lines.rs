//! The first hour, 1: a strand of hair falls, in ten lines and without a window.
//!
//! `cargo run --release --example first_1_ten_lines`

use bevy::prelude::*;
use bevy_keratin::{prelude::*, run_ticks};

fn main() -> Result {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()));
    let hair = app.world_mut().spawn(Hair).id();
    let level = Strand::from_polyline(&[Vec3::ZERO, Vec3::X * 0.1, Vec3::X * 0.2])?;
    let strand = app.world_mut().spawn((StrandOf(hair), level)).id();
    run_ticks(&mut app, 64); // a second
    let now = app.world().get::<Strand>(strand).ok_or("the strand is gone")?;
    println!("its tip has fallen to {:.3}", now.positions()[2]);
    Ok(())
}
