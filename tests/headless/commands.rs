//! What examples say to command lines and machines that they cannot serve.

use crate::example::{example, hair_file};
use std::process::Output;

/// A path below a file, where no folder can be created.
const NO_FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml/pictures");

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

#[test]
fn a_run_that_was_logged_is_replayed_to_the_bit() {
    let folder = std::env::temp_dir().join(format!("bevy_keratin-replay-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let [log, other] = ["run.log", "other.log"].map(|name| folder.join(name));
    let [log, other] = [&log, &other].map(|path| path.to_str().unwrap());
    fn replay<'a>(more: &[&'a str]) -> Vec<&'a str> {
        [&["--scene", "replay", "--json"], more].concat()
    }
    let out = run("headless", &replay(&["--seed", "5", "--seconds", "4", "--write", log]));
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    for threads in ["1", "3"] {
        let out = run("headless", &replay(&["--read", log, "--threads", threads]));
        let text = String::from_utf8(out.stdout).unwrap();
        assert!(out.status.success() && text.contains("\"equal\":true"), "{text}");
    }
    // Another input is another run.
    let text = std::fs::read_to_string(log).unwrap();
    let input = text.lines().find(|line| line.starts_with("{\"Input\"")).expect("an input");
    let (tick, _) = input.split_once(",\"input\"").unwrap();
    let moved = text.replacen(input, &format!("{tick},\"input\":\"Wet\"}}}}"), 1);
    assert_ne!(moved, text);
    std::fs::write(other, moved).unwrap();
    let says = error("headless", &replay(&["--read", other]));
    assert!(says.contains("differs from its log"), "{says}");
    std::fs::write(other, &text[..text.len() / 2]).unwrap();
    let says = error("headless", &replay(&["--read", other]));
    assert!(says.contains("write the log again") || says.contains("it was cut off"), "{says}");
    // So is another tip.
    let state = text.lines().find(|line| line.starts_with("{\"State\"")).expect("a state");
    let (before, tips) = state.split_once("\"tips\":[[").expect("tips");
    let (_, after) = tips.split_once(',').unwrap();
    std::fs::write(other, text.replacen(state, &format!("{before}\"tips\":[[9.0,{after}"), 1))
        .unwrap();
    let says = error("headless", &replay(&["--read", other]));
    assert!(says.contains("differs from its log"), "{says}");
    let says = error("headless", &replay(&["--read", log, "--solver", "sweeps"]));
    assert!(says.contains("--solver is not for this scene, which takes --seconds"), "{says}");
    let says = error("headless", &replay(&[]));
    assert!(says.contains("--write LOG and --read LOG"), "{says}");
    std::fs::remove_dir_all(folder).unwrap();
}
