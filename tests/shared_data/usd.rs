//! Files of Blender in USD, against what the folder's `expected.json` says of each.

use crate::bytes;
use bevy::prelude::*;
use bevy_keratin::authoring::groom::*;
use libtest_mimic::Trial;
use serde_json::Value;
use std::path::Path;

/// As far as numbers of `expected.json` are rounded (m).
const NEAR: f32 = 1e-5;
const FILES: [&str; 4] =
    ["curves.usdc", "curves-small.usda", "curves-small-yup.usda", "particles.usdc"];

pub fn tests() -> Vec<Trial> {
    vec![
        super::with("blender", "usd::is_what_was_exported", is_what_was_exported),
        super::with("blender", "usd::of_both_axes_is_the_same", of_both_axes_is_the_same),
        super::with("blender", "usd::in_life_size", in_life_size),
        super::with("blender", "usd::without_hair", without_hair),
        super::with("blender", "usd::broken", |folder| broken(folder, 60)),
        super::with("blender", "usd::broken_everywhere", |folder| broken(folder, 5_000))
            .with_ignored_flag(true),
    ]
}

fn load(folder: &Path, name: &str) -> (Groom, GroomLosses) {
    let settings = GroomSettings { roots: RootEnd::First, keep_strays: true, ..default() };
    Groom::from_file(&bytes(folder, name), &settings).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn is_what_was_exported(folder: &Path) {
    let expected: Value = serde_json::from_slice(&bytes(folder, "expected.json")).unwrap();
    for name in FILES {
        let (groom, losses) = load(folder, name);
        let sets = expected[name]["objects"].as_array().unwrap();
        let set = sets.iter().find(|set| set["schema"] == "BasisCurves").unwrap();
        let count = |what: &str| set[what].as_u64().unwrap() as usize;
        assert_eq!(
            (groom.len(), groom.points().len()),
            (count("curves"), count("points")),
            "{name}"
        );
        let vector =
            |what: &str| Vec3::from_array([0, 1, 2].map(|k| set[what][k].as_f64().unwrap() as f32));
        let (low, high) = groom.extents().unwrap();
        let first = groom.points()[0];
        let last = *groom.points().last().unwrap();
        for (what, found) in
            [("min", low), ("max", high), ("first_point", first), ("last_point", last)]
        {
            let apart = (found - vector(what)).abs().max_element();
            assert!(apart < NEAR, "{name}: {what} is {found}, expected {}", vector(what));
        }
        let length: f32 = groom.strands().map(|strand| strand.length()).sum();
        let all = set["total_polyline_m"].as_f64().unwrap() as f32;
        assert!((length - all).abs() < 1e-3 * all, "{name}: {length} m, expected {all}");
        let widths: Vec<f32> =
            groom.strands().flat_map(|s| s.widths.unwrap_or_default()).copied().collect();
        let known = &set["widths"];
        assert_eq!(widths.len(), known["count"].as_u64().unwrap_or_default() as usize, "{name}");
        for (what, found) in [
            ("min", widths.iter().copied().reduce(f32::min)),
            ("max", widths.iter().copied().reduce(f32::max)),
        ] {
            let expected = known[what].as_f64().map(|width| width as f32);
            assert!(
                found.zip(expected).is_none_or(|(a, b)| (a - b).abs() < 1e-9),
                "{name}: {what}"
            );
        }
        // Roots have a place on the scalp's texture in new hair only; particle hair has one colour for all.
        let has_uvs = set["primvars"].get("surface_uv_coordinate").is_some();
        assert!(groom.strands().all(|s| s.uv.is_some() == has_uvs && s.colors.is_none()), "{name}");
        assert_eq!((losses.skipped_primitives.count, losses.is_broken()), (1, false), "{losses}");
    }
}

fn of_both_axes_is_the_same(folder: &Path) {
    let [z, y] = ["curves-small.usda", "curves-small-yup.usda"].map(|name| load(folder, name).0);
    assert!(z.points().iter().zip(y.points()).all(|(a, b)| a.distance(*b) < NEAR));
    let [a, b] = [&z, &y].map(|groom| groom.strands().map(|s| s.uv).collect::<Vec<_>>());
    assert_eq!(a, b);
}

fn in_life_size(folder: &Path) {
    let (hair, _) = Groom::from_file(&bytes(folder, "curves.usdc"), &default()).unwrap();
    assert_eq!((hair.len(), hair.odd_size(1.0), hair.odd_up(UpAxis::Y)), (600, None, None));
    let width = hair.mean_width().unwrap();
    assert!((width - 6e-5).abs() < 1e-6, "{width} m");
    // The same hair as Alembic, with which Blender leaves out where roots are on the texture.
    let (alembic, _) = Groom::from_file(&bytes(folder, "curves.abc"), &default()).unwrap();
    assert!(hair.points().iter().zip(alembic.points()).all(|(a, b)| a.distance(*b) < NEAR));
}

fn without_hair(folder: &Path) {
    let text = String::from_utf8(bytes(folder, "curves-small.usda")).unwrap();
    let bald = text.replace("def BasisCurves \"Hair\"", "def Xform \"Hair\"");
    let error = Groom::from_file(bald.as_bytes(), &default()).unwrap_err().to_string();
    assert!(error.contains("without curves (1 primitives skipped that are no lines"), "{error}");
    let hidden = text.replace(
        "def BasisCurves \"Hair\"\n            {",
        "def BasisCurves \"Hair\"\n            {\n token visibility = \"invisible\"",
    );
    let error = Groom::from_file(hidden.as_bytes(), &default()).unwrap_err().to_string();
    assert!(error.contains("/root/Head/Hair/Hair, invisible"), "{error}");
}

/// Cut short and with bytes changed: a groom or an error, never a panic.
fn broken(folder: &Path, changed: usize) {
    let mut changes = crate::Changes::default();
    for name in FILES {
        let whole = bytes(folder, name);
        for k in 0..changed / 4 {
            let end = whole.len() * k / (changed / 4);
            usd::read(&whole[..end]).expect_err("a file cut short");
        }
        for round in 0..changed {
            let file = changes.of(&whole, round);
            if let Ok((groom, _)) = usd::read(&file) {
                assert!(groom.points().len() <= file.len() / 4);
                assert!(groom.points().iter().all(|p| p.is_finite()));
            }
        }
    }
}
