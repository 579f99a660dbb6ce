//! What planting costs.

#[path = "../examples/salon/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;

/// What the mannequin takes from the scenes.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

use bevy::prelude::*;
use bevy_keratin::plant::*;
use std::time::Instant;

/// A sixth of a second on a machine of its own. Here others may use the machine, too: what takes an
/// order more has lost its nearest-neighbour search.
#[test]
fn presets_are_planted_in_a_moment() {
    let mesh = mannequin::mesh();
    let scalp = Scalp { up: Dir3::X, front: Dir3::Y, height: 0.118, ..default() };
    for preset in HairPreset::ALL {
        let start = Instant::now();
        let planted = preset.plant(&mesh, &scalp).unwrap();
        let took = start.elapsed();
        println!("{preset:?}: {} guides in {took:.1?}", planted.groom.len());
        assert!(took.as_secs_f32() < 3.0, "{preset:?} took {took:?}");
    }
}
