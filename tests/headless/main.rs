//! Apps without a device that draws, as on a server.

#[path = "../common/plugins.rs"]
#[cfg(all(feature = "groom", feature = "gpu", feature = "save"))]
#[allow(dead_code, reason = "each program uses its part")]
mod all_plugins;
#[path = "../../examples/shared/body.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod body;
#[path = "../../examples/shared/characters.rs"]
#[allow(dead_code, reason = "each program uses its part")]
#[cfg(feature = "groom")]
mod characters_measured;
#[path = "../common/mod.rs"]
mod common;
#[path = "../common/example.rs"]
mod example;
#[path = "../../examples/shared/gltf.rs"]
#[cfg(feature = "groom")]
mod gltf;
#[path = "../../examples/shared/scenes/locks.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod locks;
#[path = "../../examples/shared/mannequin.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod mannequin;
#[path = "../../examples/shared/rods/mod.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod rods_measured;
#[path = "../../examples/shared/rows.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod rows;
#[path = "../../examples/shared/skeleton.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod skeleton;
#[path = "../../examples/headless/trace.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod trace;
#[path = "../common/golden.rs"]
mod vectors;
#[path = "../../examples/salon/wardrobe.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod wardrobe;
#[path = "../../examples/shared/worlds/mod.rs"]
#[allow(dead_code, reason = "each program uses its part")]
mod worlds_measured;

/// What the modules of examples expect of their app.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
    #[derive(bevy::prelude::Component)]
    pub struct Treated;
}

mod attack;
mod avian;
mod beside;
mod blink;
mod bonds;
mod change;
mod character;
mod characters;
mod closed_forms;
mod colliders;
mod commands;
mod contact;
mod cut;
mod drawn_locks;
mod dye;
mod figure;
mod fit;
mod golden;
mod groom;
mod hairdo;
mod hat;
mod held;
mod hour;
mod lod;
mod morph;
mod pairs;
mod papers_scenes;
mod plant;
mod recipe;
mod reflection;
mod report;
mod rest;
mod restyle;
mod rods;
mod rollback;
mod second_day;
mod settle;
mod shade;
mod sleep;
mod soak;
mod stiffness;
mod style;
mod submersion;
mod swing;
mod tick;
mod tie;
mod touch;
mod water;
mod wear;
mod wearers;
mod wind;
mod without_a_device;
mod worlds;
mod worlds_shapes;

/// Figures of the headless program are within their tolerances, and there are some.
fn check(rows: Vec<rows::Row>) {
    assert!(!rows.is_empty());
    rows.iter().for_each(|row| println!("{row:?}"));
    let outside: Vec<_> = rows.iter().filter(|row| !row.within).collect();
    assert!(outside.is_empty(), "{outside:#?}");
}
