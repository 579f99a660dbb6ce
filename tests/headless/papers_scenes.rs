//! The paper's scenes as a user runs them: through the `headless` example and its JSON.

use crate::example::example;
use serde_json::Value;
use std::{
    process::{Output, Stdio},
    sync::atomic::{AtomicUsize, Ordering},
    time::{Duration, Instant},
};

fn headless(arguments: &[&str]) -> Output {
    example("headless").args(arguments).output().unwrap()
}

fn scene(scene: &str, variant: &str) -> Value {
    scene_by(scene, variant, "direct")
}

fn scene_by(scene: &str, variant: &str, solver: &str) -> Value {
    scene_with(scene, variant, &["--solver", solver])
}

fn scene_with(scene: &str, variant: &str, more: &[&str]) -> Value {
    let run = ["--scene", scene, "--variant", variant, "--json", "--threads", "1"];
    let out = headless(&[&run[..], more].concat());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(
        (report["scene"].as_str(), report["variant"].as_str()),
        (Some(scene), Some(variant))
    );
    assert_eq!(report["finite"], true);
    let strain = number(&report, "strain_peak");
    assert!(strain < 0.02, "{scene} {variant}: peak strain {strain}");
    assert_eq!(report["substeps"], 6);
    report
}

fn number(report: &Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key} is missing in {report}"))
}

#[track_caller]
fn near(report: &Value, key: &str, expected: f64, tolerance: f64) {
    let found = number(report, key);
    assert!((found - expected).abs() <= tolerance, "{key} is {found}, expected {expected}");
}

#[test]
fn bedhead_keeps_a_third_and_its_controls_nothing() {
    let treated = scene("bedhead", "treated");
    near(&treated, "kept_zero_gravity", 0.33, 0.002);
    near(&treated, "kept_rest", 0.33, 0.002);
    assert!(number(&treated, "kept_hanging") > 0.1, "the bend is seen under gravity too");
    for control in ["never-wet", "never-dried"] {
        near(&scene("bedhead", control), "kept_zero_gravity", 0.0, 0.002);
    }
}

#[test]
fn blow_dry_follows_the_wind() {
    let treated = scene("blow-dry", "treated");
    // every rate is min(1, b₀ + 0.3 Σ|Δv_w|)
    near(&treated, "drying_error", 0.0, 1e-4);
    let hydrogen = &treated["b_hydrogen"];
    let (least, mean) = (number(hydrogen, "min"), number(hydrogen, "mean"));
    assert!((0.6..0.95).contains(&mean) && least < 0.6, "{hydrogen}");
    assert!(number(&treated, "wind_rate_correlation") >= 0.9);
    // without gravity every joint of a strand that touches no other rests at Σ f b Ω_j / Σ f b
    let alone = scene_with("blow-dry", "treated", &["--no-contact"]);
    near(&alone, "relaxed_error", 0.0, 2e-4);
    assert!(number(&treated, "kept_zero_gravity") > 0.2);
    near(&scene("blow-dry", "no-drying"), "kept_zero_gravity", 0.0, 0.002);
    near(&scene("blow-dry", "uniform"), "kept_zero_gravity", 0.33, 0.002);
}

#[test]
fn perm_curls_and_its_controls_hang_straight() {
    let treated = scene("perm", "treated");
    near(&treated, "kept_zero_gravity", 0.67, 0.002);
    near(&treated, "curl_radius_held", 0.03, 1e-3);
    near(&treated, "curl_radius_zero_gravity", 0.03 / 0.67, 1e-3);
    let hanging = number(&treated, "kept_hanging");
    assert!((0.55..0.67).contains(&hanging), "hanging {hanging}");
    assert!(number(&treated, "turns") > 1.2);
    near(&scene("perm", "water-set"), "kept_zero_gravity", 0.63, 0.002);
    for control in ["cut-only", "untreated"] {
        let report = scene("perm", control);
        near(&report, "kept_zero_gravity", 0.0, 0.002);
        assert!(number(&report, "turns") < 0.1);
    }
}

#[test]
fn the_papers_projections_keep_the_same_shares() {
    for (scene, variant, kept) in [
        ("bedhead", "treated", 0.33),
        ("bedhead", "never-wet", 0.0),
        ("perm", "treated", 0.67),
        ("perm", "water-set", 0.63),
        ("perm", "untreated", 0.0),
    ] {
        near(&scene_by(scene, variant, "sweeps"), "kept_zero_gravity", kept, 0.005);
    }
    let dried = scene_by("blow-dry", "treated", "sweeps");
    near(&dried, "drying_error", 0.0, 1e-4);
    near(&dried, "relaxed_error", 0.0, 1e-3);
}

fn swing(from: &str, segments: &str, more: &[&str]) -> Value {
    let strand = ["--scene", "swing", "--length", "0.2", "--bending-length", "0.13", "--json"];
    let out = headless(&[&strand, &["--from", from, "--segments", segments][..], more].concat());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(report["finite"], true);
    assert!(number(&report, "strain_peak") < 0.01, "{report}");
    report
}

#[test]
fn a_strand_let_go_swings_as_a_rod() {
    // The elastica, and a beam under its own weight hanging and about the elastica.
    let (sag, hanging, level) = (0.3963, 0.4029, 0.4419);
    for segments in ["8", "32"] {
        let report = swing("hanging", segments, &[]);
        near(&report, "sag", sag, if segments == "8" { 0.025 } else { 0.01 });
        near(&report, "period", hanging, 0.05 * hanging);
        assert!(report["low_point"].is_null(), "{report}");
        assert_eq!(report["substeps"], 3);
    }
    let report = swing("level", "16", &["--substeps", "12"]);
    near(&report, "sag", sag, 0.01);
    near(&report, "period", level, 0.05 * level);
    // It falls for a little more than half of a period: large swings are slower.
    let low = number(&report, "low_point") / level;
    assert!((0.45..0.6).contains(&low), "lowest after {low} periods");
    let left = number(&report, "energy_left_1s");
    assert!(left > 0.0 && left < 1.0, "{left} of the energy is left");
    assert_eq!(report["substeps"], 12);
}

#[test]
fn a_swing_that_cannot_be_says_why() {
    let error = |more: &[&str]| {
        let strand = ["--scene", "swing", "--bending-length", "0.13", "--from", "level"];
        let out = headless(&[&strand, more].concat());
        assert!(!out.status.success());
        String::from_utf8(out.stderr).unwrap()
    };
    let length = "--length is -2 m, expected 0.001 to 10";
    assert!(error(&["--segments", "8", "--length", "-2"]).contains(length));
    let segments = "--segments is 0, expected 1 to 1024";
    assert!(error(&["--length", "1", "--segments", "0"]).contains(segments));
    assert!(error(&["--length", "1"]).contains("--segments"));
    let strand = ["--length", "1", "--segments", "8"];
    assert!(error(&[&strand[..], &["--substeps", "0"]].concat()).contains("expected 1 to 1000"));
    assert!(error(&[&strand[..], &["--seconds", "1"]].concat()).contains("--seconds is not for"));
    let out = headless(&["--scene", "perm", "--length", "1"]);
    assert!(String::from_utf8_lossy(&out.stderr).contains("--length is not for"));
}

#[test]
fn a_table_that_cannot_be_written_is_named_and_no_frame_is_an_error() {
    let error = |arguments: &[&str]| {
        let out = headless(&[&["--scene", "bedhead"], arguments].concat());
        assert_eq!(out.status.code(), Some(1));
        String::from_utf8(out.stderr).unwrap()
    };
    let table = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml/table.csv");
    let text = error(&["--csv", table]);
    assert!(text.contains(&format!("--csv {table} cannot be written")), "{text}");
    for seconds in ["0.001", "0", "-1", "NaN", "1e9"] {
        let text = error(&[&format!("--seconds={seconds}")]);
        assert!(text.contains("--seconds is") && text.contains("expected 0.017"), "{text}");
    }
}

#[test]
fn a_run_that_is_interrupted_leaves_whole_lines() {
    let table = std::env::temp_dir().join(format!("interrupted-{}.csv", std::process::id()));
    let mut run = example("headless")
        .args(["--scene", "bedhead", "--csv", table.to_str().unwrap()])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let written = || std::fs::read_to_string(&table).unwrap_or_default();
    let begun = Instant::now();
    while written().lines().count() < 5 && begun.elapsed().as_secs() < 60 {
        std::thread::sleep(Duration::from_millis(5));
    }
    run.kill().unwrap();
    let status = run.wait().unwrap();
    let text = written();
    std::fs::remove_file(&table).unwrap();
    assert!(!status.success(), "it was not interrupted");
    assert!(text.ends_with('\n') && text.lines().count() >= 5, "{text}");
    let is_number = |field: &str| field.parse::<f32>().is_ok();
    for line in text.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        assert!(fields.len() == 7 && fields.into_iter().all(is_number), "{line}");
    }
}

fn shower(variant: &str, seconds: &str) -> Value {
    let arguments = ["--scene", "shower", "--variant", variant, "--seconds", seconds, "--json"];
    let out = headless(&arguments);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let report: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(report["finite"], true);
    assert!(number(&report, "water_error") < 1e-5, "{report}");
    assert!(number(&report, "strain_peak") < 0.05, "{report}");
    report
}

/// Until the head has been lifted and the hair hangs.
const LIFTED: &str = "22";

#[test]
fn hair_pressed_wet_keeps_what_water_opened() {
    let treated = shower("treated", LIFTED);
    let open = 1.0 - number(&treated, "b_pressed");
    let kept = number(&treated, "kept_zero_gravity");
    assert!((kept - 0.33 * open).abs() < 0.01, "kept {kept}, open {open}");
    assert!(kept >= 0.15, "{kept}");
    near(&shower("never-wet", LIFTED), "kept_zero_gravity", 0.0, 0.01);
    near(&shower("dried-free", LIFTED), "kept_zero_gravity", 0.0, 0.02);
}

#[test]
fn another_shower_lets_go_of_it() {
    let report = shower("treated", "40");
    let (kept, left) = (number(&report, "kept_dried"), number(&report, "b_rewet"));
    let now = number(&report, "kept_zero_gravity");
    assert!(kept > 0.15 && now <= kept * left + 0.02, "{now} of {kept} after rates {left}");
}

#[test]
fn ten_thousand_strands_gather_around_droplets() {
    let wet = |droplets: &str, most_strain: f64| {
        let out = headless(&["--scene", "wet", "--droplets", droplets, "--seconds", "7", "--json"]);
        let report: Value = serde_json::from_slice(&out.stdout).unwrap();
        assert_eq!(report["finite"], true);
        assert!(number(&report, "water_error") < 1e-5, "{report}");
        assert!(number(&report, "strain_peak") < most_strain, "{report}");
        report
    };
    let dry = wet("0", 0.02);
    near(&dry, "tip_spacing_ratio", 1.0, 0.05);
    assert!(number(&dry, "clustered_share") < 0.02);
    // The worst moment of the worst of 10,000 strands that a thousand droplets tear at: 0.0007.
    let (few, many) = (wet("100", 0.02), wet("1000", 0.02));
    let (a, b) = (number(&few, "tip_spacing_ratio"), number(&many, "tip_spacing_ratio"));
    assert!(b < a && a < 0.98 && b < 0.8, "{a} {b}");
}

/// The names that are answered to a wrong one, without what is no scene.
fn valid(wrong: &[&str]) -> Vec<String> {
    let out = headless(wrong);
    let text = String::from_utf8(out.stderr).unwrap();
    let (_, names) = text.trim_end().split_once("valid: ").unwrap_or_else(|| panic!("{text}"));
    let names = names.lines().next().unwrap().split(", ").take_while(|name| *name != "swing");
    names.map(str::to_owned).collect()
}

/// A scene with a variant, for how long (s), and by what it is run.
struct Run<'a> {
    scene: &'a str,
    variant: &'a str,
    seconds: &'a str,
    threads: &'a str,
    /// An instruction set; the machine's best if `None`.
    set: Option<&'a str>,
}

impl Run<'_> {
    fn hash(&self) -> String {
        let mut program = example("headless");
        program.args(["--scene", self.scene, "--variant", self.variant, "--seconds", self.seconds]);
        program.args(["--threads", self.threads, "--json"]).env_remove("KERATIN_SIMD");
        let out = program.envs(self.set.map(|set| ("KERATIN_SIMD", set))).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let report: Value = serde_json::from_slice(&out.stdout).unwrap();
        assert_eq!(report["finite"], true, "{report}");
        report["state_hash"].as_str().unwrap().to_owned()
    }
}

/// The hashes that runs come to, two at a time.
fn hashes(runs: &[Run]) -> Vec<String> {
    let next = AtomicUsize::new(0);
    let work = || {
        let own = std::iter::from_fn(|| {
            let i = next.fetch_add(1, Ordering::Relaxed);
            runs.get(i).map(|run| (i, run.hash()))
        });
        own.collect::<Vec<_>>()
    };
    let mut all = std::thread::scope(|scope| {
        let other = scope.spawn(work);
        let own = work();
        [own, other.join().unwrap()].concat()
    });
    all.sort_unstable();
    all.into_iter().map(|(_, hash)| hash).collect()
}

/// All scenes with all their variants, each for so long.
fn every_scene(seconds: impl Fn(&str, &str) -> &'static str) -> Vec<[String; 3]> {
    let scenes = valid(&["--scene", "none"]);
    let mut all = Vec::new();
    for scene in scenes {
        for variant in valid(&["--scene", &scene, "--variant", "none"]) {
            let seconds = seconds(&scene, &variant).to_owned();
            all.push([scene.clone(), variant, seconds]);
        }
    }
    assert!(all.len() >= 16, "{all:?}");
    all
}

#[test]
fn every_bit_is_the_same_again_and_on_two_threads() {
    // Until after what sets a variant apart. The full treatments long enough for wind, contact with the floor and
    // bond changes; winding in the perm, droplets on ten thousand strands.
    let all = every_scene(|scene, variant| match (scene, variant) {
        ("wet", "rods") => "5",
        ("wet", _) => "4.5",
        ("shower", "treated") => "4",
        ("shower", _) => "2.5",
        ("perm", "treated") => "10",
        (_, "treated") => "8",
        _ => "7",
    });
    let runs = all.iter().flat_map(|[scene, variant, seconds]| {
        ["1", "2"].map(|threads| Run { scene, variant, seconds, threads, set: None })
    });
    let found = hashes(&runs.collect::<Vec<_>>());
    for (scene, hashes) in all.iter().zip(found.chunks(2)) {
        println!("{scene:?}: {hashes:?}");
        assert_eq!(hashes[0], hashes[1], "{scene:?}: a second run, on two threads, differs");
    }
}

/// AVX2 and AVX-512 fuse the same products; SSE2 cannot, and rounds twice, but always alike.
#[test]
#[cfg(target_arch = "x86_64")]
fn every_bit_is_the_same_by_each_instruction_set_that_fuses() {
    let best = fearless_simd::Level::new();
    let mut by = vec![("sse2", "1"), ("sse2", "2")];
    for (set, threads, has) in
        [("avx2", "2", best.as_avx2().is_some()), ("avx512", "1", best.as_avx512().is_some())]
    {
        if has {
            by.push((set, threads));
        } else {
            println!("not tested, since this machine lacks it: {set}");
        }
    }
    // Hair that falls in wind, is wound, gets wet, and springs. What comes later are other numbers for the same
    // kernels.
    let all = every_scene(|scene, _| match scene {
        "wet" => "0.2",
        "shower" => "1.5",
        _ => "2",
    });
    let runs = all.iter().flat_map(|[scene, variant, seconds]| {
        let run = move |(set, threads)| Run { scene, variant, seconds, threads, set: Some(set) };
        by.iter().copied().map(run)
    });
    let found = hashes(&runs.collect::<Vec<_>>());
    let mut chosen = false;
    for (scene, hashes) in all.iter().zip(found.chunks(by.len())) {
        println!("{scene:?}: {hashes:?} by {by:?}");
        let (sse2, fused) = hashes.split_at(2);
        assert_eq!(sse2[0], sse2[1], "{scene:?}: SSE2 on two threads");
        assert!(fused.iter().all(|hash| *hash == fused[0]), "{scene:?}: AVX-512 differs from AVX2");
        chosen |= fused.iter().all(|hash| *hash != sse2[0]);
    }
    assert!(chosen, "KERATIN_SIMD chooses nothing");
}

#[test]
fn misspelt_names_are_answered_with_the_valid_ones() {
    let error = |arguments: &[&str]| {
        let out = headless(arguments);
        assert!(!out.status.success());
        String::from_utf8(out.stderr).unwrap()
    };
    let text = error(&["--scene", "bedhaed"]);
    assert!(
        text.contains("no scene `bedhaed`; valid: bedhead, blow-dry, perm, wet, shower"),
        "{text}"
    );
    let text = error(&["--scene", "perm", "--variant", "curly"]);
    assert!(text.contains("valid: treated, water-set, cut-only, untreated"), "{text}");
    let text = error(&["--scene", "perm", "--second", "3"]);
    assert!(text.contains("--seconds"), "{text}");
    let text = error(&["--scene", "perm", "--seconds", "-3"]);
    assert!(!text.contains("panicked"), "{text}");
}
