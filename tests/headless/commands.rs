//! What examples say to command lines and machines that they cannot serve.

use bevy::prelude::*;
use bevy_keratin::authoring::groom::{Groom, yuksel};
use std::{
    path::PathBuf,
    process::{Command, Output},
};

/// A path below a file, where no folder can be created.
const NO_FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml/pictures");

/// An example as `cargo test` has just built it.
fn example(name: &str) -> Command {
    let mut path = std::env::current_exe().unwrap();
    path.pop();
    path.pop();
    path.push(format!("examples/{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(path.exists(), "{} is missing: run `cargo test`, which builds it", path.display());
    Command::new(path)
}

fn run(name: &str, arguments: &[&str]) -> Output {
    example(name).args(arguments).output().unwrap()
}

/// What it says when it fails.
fn error(name: &str, arguments: &[&str]) -> String {
    let out = run(name, arguments);
    let text = String::from_utf8(out.stderr).unwrap();
    assert!(matches!(out.status.code(), Some(1 | 2)), "{name} {arguments:?}: {text}");
    text
}

/// A new folder with a `.hair` file in it, whose unit is the metre.
fn hair_file(name: &str) -> (PathBuf, String) {
    let folder = std::env::temp_dir().join(format!("bevy_keratin-{name}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let roots = (0..40).map(|i| Vec3::new(0.002 * (i % 7) as f32, 0.002 * (i / 7) as f32, 0.0));
    let groom = Groom::from_polylines(roots.map(|r| [r, r - Vec3::Z * 0.3])).unwrap();
    let file = folder.join("tail.hair");
    std::fs::write(&file, yuksel::write(&groom).unwrap()).unwrap();
    (folder, file.display().to_string())
}

#[test]
fn a_folder_that_cannot_be_made_is_blamed_itself() {
    let (folder, file) = hair_file("folder");
    let salon = ["--offscreen", NO_FOLDER];
    let commands: [(&str, &[&str]); 3] = [
        ("groom_viewer", &[&file, "--offscreen", NO_FOLDER]),
        ("salon", &salon),
        ("gallery", &["figure", "--out", NO_FOLDER]),
    ];
    for (name, arguments) in commands {
        let text = error(name, arguments);
        let says = format!("error: {NO_FOLDER} cannot be written: ");
        assert!(text.starts_with(&says) && !text.contains("tail.hair"), "{name}: {text}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_groom_that_is_missing_or_none_is_blamed_itself() {
    let text = error("groom_viewer", &["nowhere.hair"]);
    assert!(text.starts_with("error: nowhere.hair: "), "{text}");
    let none = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    let text = error("groom_viewer", &[none]);
    assert!(text.contains("Cargo.toml: byte 0: found an unknown kind of file"), "{text}");
}

#[test]
fn numbers_out_of_range_are_refused() {
    for (flag, value) in
        [("--guides", "0"), ("--nodes", "1"), ("--seconds", "0.001"), ("--scale", "0")]
    {
        let text = error("groom_viewer", &["nowhere.hair", flag, value]);
        assert!(text.contains(flag) && !text.contains("nowhere"), "{text}");
    }
}

#[test]
fn the_gallery_explains_itself_and_makes_no_folder_of_flags() {
    let folder = std::env::temp_dir().join(format!("bevy_keratin-help-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let out = example("gallery").arg("--help").current_dir(&folder).output().unwrap();
    assert!(out.status.success() && String::from_utf8_lossy(&out.stdout).contains("Usage"));
    let out = example("gallery").arg("--wavy").current_dir(&folder).output().unwrap();
    assert_eq!(out.status.code(), Some(2));
    assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
    std::fs::remove_dir_all(folder).unwrap();
    let text = error("gallery", &["mohawk"]);
    assert!(text.contains("mohawk") && text.contains("bedhead"), "{text}");
}

#[test]
#[cfg(target_os = "linux")]
fn without_a_display_there_is_a_sentence_and_no_panic() {
    let (folder, file) = hair_file("display");
    for (name, arguments) in [("salon", vec![]), ("groom_viewer", vec![file])] {
        let mut command = example(name);
        let command = command.args(arguments).env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY");
        let out = command.env_remove("WAYLAND_SOCKET").output().unwrap();
        let text = String::from_utf8(out.stderr).unwrap();
        assert_eq!(out.status.code(), Some(1), "{name}: {text}");
        assert!(text.contains("error: there is no display"), "{name}: {text}");
        assert!(!text.contains("panicked"), "{name}: {text}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}

/// Skipped, with the reason printed, where nothing can draw.
#[test]
fn a_tail_in_the_wrong_unit_is_shown_in_the_right_one_and_without_a_head() {
    let (folder, file) = hair_file("tail");
    let arguments = ["--seconds", "1", "--size", "64x64", "--offscreen"];
    let out = run(
        "groom_viewer",
        &[&[&file[..]], &arguments[..], &[&folder.display().to_string()]].concat(),
    );
    std::fs::remove_dir_all(folder).unwrap();
    let (text, why) = (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
    if why.contains("adapter") {
        eprintln!("skipped: {why}");
        return;
    }
    assert!(out.status.success(), "{why}");
    assert!(text.contains("with 0.00254 m a unit it is 7.62"), "{text}");
    assert!(text.contains("shown as by --scale 1\n"), "{text}");
    assert!(text.contains("no head:"), "{text}");
    assert!(text.contains("40 strands and 0 followers") && text.contains("0 broken"), "{text}");
}
