//! Grooms that people really have: what the folders' README says is right for each.

use crate::bytes;
use bevy::{platform::collections::HashMap, prelude::*};
use bevy_keratin::authoring::groom::*;
use libtest_mimic::Trial;
use std::path::Path;

pub fn tests() -> Vec<Trial> {
    vec![
        super::with("odd", "grooms::lines_of_odd_gltf_files", lines_of_odd_gltf_files),
        super::with("odd", "grooms::odd_hair_files", odd_hair_files),
        super::with("odd", "grooms::odd_files_are_no_surprise_to_the_strict", strict),
        super::with("odd", "grooms::text_of_tressfx_2", text_of_tressfx_2),
        super::with("", "grooms::real_tressfx_files", real_tressfx_files),
        super::with("blender", "grooms::lines_from_blender", lines_from_blender),
        super::with(
            "blender",
            "grooms::alembic_is_what_was_exported",
            alembic_is_what_was_exported,
        ),
        super::with("blender", "grooms::alembic_in_life_size", alembic_in_life_size),
        super::with("blender", "grooms::broken_alembic", |folder| broken_alembic(folder, 997, 250)),
        super::with("blender", "grooms::alembic_broken_everywhere", |folder| {
            broken_alembic(folder, 1, 100_000);
        })
        .with_ignored_flag(true),
        super::with("blender", "grooms::usd_is_named", usd_is_named),
    ]
}

fn read(folder: &Path, name: &str) -> (Groom, GroomLosses) {
    Groom::from_file(&bytes(folder, name), &default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn lines_of_odd_gltf_files(folder: &Path) {
    for name in [
        "G0_good_two_strands",
        "G1_second_scene_without_nodes",
        "G2_meshopt_fallback_buffer_unused_by_lines",
        "G3_json_padded_by_nul",
        "G4_indexed_lines_own_vertices",
        "G4b_same_without_indices",
        "G6_uv_i16_normalized",
    ] {
        let file = bytes(folder, &format!("{name}.glb"));
        let external = gltf::GltfFile::parse(&file).unwrap().external();
        assert!(external.is_empty(), "{name}: {external:?}");
        let (groom, losses) =
            gltf::GltfFile::parse(&file).unwrap().read(&HashMap::default()).unwrap();
        let nodes: Vec<usize> = groom.strands().map(|s| s.points.len()).collect();
        // The strip with UVs has one strand only.
        let expected: &[usize] = if name.starts_with("G6") { &[5] } else { &[5, 5] };
        assert_eq!(nodes, expected, "{name}");
        assert!(groom.strands().all(|s| s.uv.is_none()));
        assert_eq!(
            losses.unread_arrays.count,
            usize::from(name.starts_with("G6")),
            "{name}: {losses}"
        );
        assert_eq!(losses.is_empty(), !name.starts_with("G6"), "{name}: {losses}");
    }
}

fn odd_hair_files(folder: &Path) {
    let (good, losses) = read(folder, "H0_good_200.hair");
    assert!(good.len() == 200 && losses.is_empty(), "{losses}");
    assert_eq!((good.odd_size(0.00254), good.odd_up(UpAxis::Z)), (None, None));

    let (groom, losses) = read(folder, "H1_trailing_newline.hair");
    assert!(groom == good && losses.unread_bytes.count == 1, "{losses}");

    let (groom, losses) = read(folder, "H2_one_nan_strand_of_200.hair");
    assert_eq!(groom.len(), 199);
    assert_eq!(losses.broken_strands.places, [GroomPlace::Node { strand: 57, node: 3 }]);

    let (groom, losses) = read(folder, "H3_ten_roots_at_origin_of_200.hair");
    assert_eq!((groom.len(), losses.stray_strands.count), (190, 10), "{losses}");
    let guides = groom.guides(20);
    assert!(guides.iter().all(|i| groom.strand(*i).unwrap().points[0].y > 1.0));

    let (groom, losses) = read(folder, "H4_tip_first.hair");
    assert_eq!(losses.turned_strands.count, 200, "{losses}");
    assert!(groom.points().iter().zip(good.points()).all(|(a, b)| a.distance(*b) < 1e-5));

    let (groom, losses) = read(folder, "H8_one_tip_a_thousand_km_off.hair");
    assert_eq!((groom.len(), groom.odd_size(0.00254)), (199, None));
    assert_eq!(losses.far_strands.places, [GroomPlace::Node { strand: 0, node: 7 }]);
}

fn strict(folder: &Path) {
    let strict = GroomSettings { strict: true, ..default() };
    for (name, says) in [
        ("H0_good_200", None),
        ("H1_trailing_newline", Some("1 bytes after the end")),
        ("H2_one_nan_strand_of_200", Some("strand 57 node 3")),
        ("H3_ten_roots_at_origin_of_200", Some("10 strays")),
        ("H4_tip_first", None),
        ("H8_one_tip_a_thousand_km_off", Some("strand 0 node 7")),
    ] {
        let file = bytes(folder, &format!("{name}.hair"));
        match (Groom::from_file(&file, &strict), says) {
            (Ok(_), None) => {}
            (Err(error), Some(says)) => {
                assert!(error.to_string().contains(says), "{name}: {error}");
            }
            (read, _) => panic!("{name}: {:?}", read.map(|_| "read")),
        }
    }
}

fn text_of_tressfx_2(folder: &Path) {
    let file = bytes(folder, "T1_tressfx2_text.tfx");
    let error = Groom::from_file(&file, &default()).unwrap_err().to_string();
    assert!(error.contains("a text file of TressFX version 2.0"), "{error}");
}

/// In metres they are fine, and in centimetres a metre has a hundred of them.
fn real_tressfx_files(folder: &Path) {
    for (name, count) in [("ratboy-mohawk.tfx", 2228), ("sintel-16pt.tfx", 11_400)] {
        let (groom, losses) = read(folder, name);
        println!("{name}: {losses}");
        assert_eq!(groom.len() + losses.short_strands.count, count, "{name}: {losses}");
        assert!(!losses.is_broken() && losses.turned_strands.count == 0, "{name}: {losses}");
        assert_eq!((groom.odd_size(1.0), groom.odd_up(UpAxis::Y)), (None, None), "{name}");
        for unit in [0.01f32, 0.001] {
            let raw = groom.clone().scaled(1.0 / unit).unwrap();
            assert_eq!(raw.odd_size(1.0).unwrap().scale, unit, "{name}");
        }
    }
}

fn lines_from_blender(folder: &Path) {
    let (groom, losses) = read(folder, "curves-as-lines.glb");
    assert_eq!((groom.len(), groom.points().len()), (600, 9600));
    assert!(losses.turned_strands.count == 0 && !losses.is_broken(), "{losses}");
    assert_eq!((groom.odd_size(1.0), groom.odd_up(UpAxis::Y)), (None, None));
    let on_head = |root: Vec3| ((root - Vec3::Y * 0.12) / Vec3::new(0.072, 0.1, 0.092)).length();
    let off = groom.roots().map(|root| (on_head(root) - 1.0).abs()).fold(0.0, f32::max);
    assert!(off < 1e-3, "roots are off the head by {off} of its radius");
}

const ARCHIVES: [&str; 4] =
    ["curves.abc", "curves-hair-only.abc", "particles.abc", "unreal-style.abc"];

/// Strands, points and extents as Blender and the Alembic library tell them, in the file's unit.
fn alembic_is_what_was_exported(folder: &Path) {
    let expected: serde_json::Value =
        serde_json::from_slice(&bytes(folder, "expected.json")).unwrap();
    for name in ARCHIVES {
        let (groom, losses) = alembic::read(&bytes(folder, name)).unwrap();
        assert!(!losses.is_broken(), "{name}: {losses}");
        let mut first = 0;
        let sets = expected[name]["objects"].as_array().unwrap().iter();
        for set in sets.filter(|set| set.get("curves").is_some()) {
            let count = |what: &str| set[what].as_u64().unwrap() as usize;
            let strands = groom.picked(first..first + count("curves"));
            first += count("curves");
            assert_eq!(strands.len(), count("curves"), "{name}");
            assert_eq!(strands.points().len(), count("points"), "{name}");
            let points = strands.points();
            let (low, high) = strands.extents().unwrap();
            let ends = (points[0], points[points.len() - 1]);
            for (what, found) in
                [("min", low), ("max", high), ("first_point", ends.0), ("last_point", ends.1)]
            {
                for k in 0..3 {
                    let off = (set[what][k].as_f64().unwrap() - f64::from(found[k])).abs();
                    assert!(off < 1.1e-5, "{name}: {what} is {found}");
                }
            }
            let total: f64 = strands.strands().map(|s| f64::from(s.length())).sum();
            let expected = set["total_polyline_m"].as_f64().unwrap();
            assert!((total / expected - 1.0).abs() < 1e-5, "{name}: {total}");
        }
        assert_eq!(groom.len(), first, "{name}");
        let again = alembic::read(&alembic::write(&groom).unwrap()).unwrap().0;
        // All sets become one, whose path its groups have.
        let bare = |groom: &Groom| groom.clone().with_groups(Vec::new(), Vec::new()).unwrap();
        assert!(bare(&again) == bare(&groom), "{name} is another once written");
        let names = |groom: &Groom| -> Vec<_> {
            groom.strands().map(|s| s.group.map(|of| (of.id, of.name.clone()))).collect()
        };
        assert!(names(&again) == names(&groom), "{name} has other groups once written");
    }
}

fn alembic_in_life_size(folder: &Path) {
    let (hair, losses) = read(folder, "curves.abc");
    assert_eq!((hair.len(), losses.skipped_primitives.count), (600, 1), "{losses}");
    assert_eq!((hair.odd_size(1.0), hair.odd_up(UpAxis::Y)), (None, None));
    let width = hair.mean_width().unwrap();
    assert!((width - 6e-5).abs() < 1e-6, "{width} m");
    // In centimetres, with the guides that the file names.
    let (unreal, losses) = read(folder, "unreal-style.abc");
    assert_eq!(unreal.odd_size(1.0).unwrap().scale, 0.01);
    assert_eq!(unreal.guides(500).len(), 30);
    assert!(unreal.guides(500).into_iter().all(|i| i < 30));
    assert!(unreal.strands().all(|s| s.uv.is_some() && s.widths.is_some()));
    assert!(losses.turned_strands.count == 0 && losses.unread_arrays.count == 7, "{losses}");
}

/// Cut short and with bytes changed: a groom, or an error that says where; see the unit tests for memory.
fn broken_alembic(folder: &Path, step: usize, changed: usize) {
    let mut changes = crate::Changes::default();
    for name in ARCHIVES {
        let whole = bytes(folder, name);
        for end in (6..whole.len()).step_by(step) {
            let error = alembic::read(&whole[..end]).expect_err("a file cut short").to_string();
            assert!(error.starts_with("byte ") && error.contains("expected"), "{error}");
        }
        for round in 0..changed {
            let file = changes.of(&whole, round);
            if let Ok((groom, _)) = alembic::read(&file) {
                assert!(groom.points().len() <= file.len() / 4);
                assert!(groom.points().iter().all(|p| p.is_finite()));
            }
        }
    }
}

fn usd_is_named(folder: &Path) {
    for name in ["curves.usdc", "curves-small.usda"] {
        let file = bytes(folder, name);
        assert_eq!(GroomFormat::of(&file), Ok(GroomFormat::Usd));
        if !cfg!(feature = "usd") {
            let error = Groom::from_file(&file, &default()).unwrap_err().to_string();
            assert!(error.contains("turn on the feature `usd`"), "{name}: {error}");
        }
    }
}
