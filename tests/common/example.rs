//! Examples as programs, for tests of what they say and do.
#![allow(dead_code, reason = "each test binary uses its own part")]

use bevy::prelude::*;
use bevy_keratin::authoring::groom::{Groom, yuksel};
use std::{path::PathBuf, process::Command};

/// An example as `cargo test` has just built it.
pub fn example(name: &str) -> Command {
    let mut path = std::env::current_exe().unwrap();
    path.pop();
    path.pop();
    path.push(format!("examples/{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(path.exists(), "{} is missing: run `cargo test`, which builds it", path.display());
    Command::new(path)
}

/// A new folder with a `.hair` file in it, whose unit is the metre.
pub fn hair_file(name: &str) -> (PathBuf, String) {
    let folder = std::env::temp_dir().join(format!("bevy_keratin-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let roots = (0..40).map(|i| Vec3::new(0.002 * (i % 7) as f32, 0.002 * (i / 7) as f32, 0.0));
    let groom = Groom::from_polylines(roots.map(|r| [r, r - Vec3::Z * 0.3])).unwrap();
    let file = folder.join("tail.hair");
    std::fs::write(&file, yuksel::write(&groom).unwrap()).unwrap();
    (folder, file.display().to_string())
}
