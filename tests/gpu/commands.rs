//! Examples that simulate by compute shaders.

use crate::example::example;
use serde_json::Value;

/// What it comes to there `papers` compares, with fewer strands.
pub fn a_scene_runs_on_a_graphics_device_and_says_so() {
    let arguments = ["--scene", "perm", "--seconds", "1", "--gpu", "--json"];
    let out = example("headless").args(arguments).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(report["residence"], "gpu");
    assert_eq!(report["finite"], true);
    // Of 60, less those in which its kernels were compiled.
    let number = |key: &str| report[key].as_u64().unwrap();
    let (ticks, frames) = (number("gpu_ticks"), number("frames"));
    assert!(ticks > 30 && ticks <= frames, "{ticks} of {frames}");
    assert!(!report["adapter"].as_str().unwrap().is_empty());
}
