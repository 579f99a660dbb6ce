//! Grooms as people have them: strays, strands stored tip first, other units and axes, files that are none.

use super::files::put;
use crate::mannequin;
use bevy::prelude::*;
use bevy_keratin::authoring::{
    groom::{Groom, GroomFormat, GroomLosses, GroomPlace, GroomSettings, RootEnd, UpAxis, yuksel},
    plant::{HairPreset, Scalp},
};

/// Metres in a unit of `.hair`.
const UNIT: f32 = 0.00254;
const COUNT: usize = 200;

/// Strands of 8 nodes on the upper half of a head of 9 cm at `centre`, standing out by `length` (m).
fn head(centre: Vec3, length: f32) -> Vec<Vec<Vec3>> {
    let strand = |i: usize| {
        let up = (i as f32 + 0.5) / COUNT as f32;
        let turn = i as f32 * 2.4;
        let across = (1.0 - up * up).sqrt();
        let way = Vec3::new(across * turn.cos(), up, across * turn.sin());
        (0..8).map(|k| centre + way * (0.09 + length * k as f32 / 7.0)).collect()
    };
    (0..COUNT).map(strand).collect()
}

const HEAD: Vec3 = Vec3::new(0.0, 1.6, 0.0);

/// A `.hair` file of strands in metres, with this axis up.
fn file(strands: &[Vec<Vec3>], metres: f32, up: UpAxis) -> Vec<u8> {
    let to = Mat3::from_cols(up.to_y_up(Vec3::X), up.to_y_up(Vec3::Y), up.to_y_up(Vec3::Z));
    let placed = |p: &Vec3| to.transpose() * (*p / metres);
    let strands = strands.iter().map(|strand| strand.iter().map(placed).collect::<Vec<_>>());
    yuksel::write(&Groom::from_polylines(strands).unwrap()).unwrap()
}

fn hair(strands: &[Vec<Vec3>]) -> Vec<u8> {
    file(strands, UNIT, UpAxis::Z)
}

fn read(file: &[u8]) -> (Groom, GroomLosses) {
    Groom::from_file(file, &default()).unwrap()
}

/// What a strict reader says.
fn refused(file: &[u8]) -> String {
    let strict = GroomSettings { strict: true, ..default() };
    Groom::from_file(file, &strict).unwrap_err().to_string()
}

fn nodes(strands: impl IntoIterator<Item = usize>, node: usize) -> Vec<GroomPlace> {
    strands.into_iter().map(|strand| GroomPlace::Node { strand, node }).collect()
}

fn assert_near(groom: &Groom, strands: &[Vec<Vec3>]) {
    assert_eq!(groom.len(), strands.len());
    for (strand, expected) in groom.strands().zip(strands) {
        for (p, expected) in strand.points.iter().zip(expected) {
            assert!(p.distance(*expected) < 1e-4, "{p} for {expected}");
        }
    }
}

#[test]
fn a_good_groom_loses_nothing() {
    for (centre, length) in [(HEAD, 0.12), (Vec3::ZERO, 0.12), (HEAD, 0.01), (Vec3::ZERO, 0.6)] {
        let strands = head(centre, length);
        let (groom, losses) = read(&hair(&strands));
        assert!(losses.is_empty(), "{losses}");
        assert_near(&groom, &strands);
        assert_eq!((groom.odd_size(UNIT), groom.odd_up(UpAxis::Z)), (None, None));
        let strict = GroomSettings { strict: true, ..default() };
        assert!(Groom::from_file(&hair(&strands), &strict).is_ok());
    }
}

#[test]
fn a_strand_with_a_broken_number_is_left_out_with_its_numbers() {
    let strands = head(HEAD, 0.12);
    let mut broken = hair(&strands);
    // Each node has 12 bytes; all strands have as many nodes, so there are no counts.
    put(&mut broken, 128 + 12 * (8 * 57 + 3) + 4, f32::NAN.to_bits());
    let (groom, losses) = read(&broken);
    let mut left = strands.clone();
    left.remove(57);
    assert_near(&groom, &left);
    let says = "1 strands with a broken number left out (strand 57 node 3)";
    assert_eq!(losses.to_string(), says);
    assert_eq!(losses.broken_strands.places, nodes([57], 3));
    let error = refused(&broken);
    assert!(
        error.starts_with(says) && error.contains("set GroomSettings::strict to false"),
        "{error}"
    );
}

#[test]
fn a_node_a_thousand_kilometres_off_costs_its_strand_and_no_other() {
    let mut strands = head(HEAD, 0.12);
    strands[11][7] = Vec3::X * 1e6;
    // A broken one before does not shift the numbers.
    let mut broken = hair(&strands);
    put(&mut broken, 128 + 12 * 8 * 4, f32::INFINITY.to_bits());
    let (groom, losses) = read(&broken);
    assert_eq!(losses.far_strands.places, nodes([11], 7));
    assert_eq!(losses.broken_strands.places, nodes([4], 0));
    assert_eq!((groom.len(), groom.odd_size(UNIT)), (COUNT - 2, None));
    assert!(refused(&broken).contains("(strand 11 node 7)"));
    let keep = GroomSettings { keep_strays: true, ..default() };
    let (kept, losses) = Groom::from_file(&broken, &keep).unwrap();
    assert!(kept.len() == COUNT - 1 && losses.far_strands.count == 0);
    // Even with it the size is judged by the others.
    assert_eq!(kept.odd_size(UNIT), None);
}

#[test]
fn strays_are_left_out_and_none_becomes_a_guide() {
    let odd = || (0..COUNT).step_by(20);
    let rooted = |centre: Vec3| {
        let mut strands = head(centre, 0.12);
        odd().for_each(|i| strands[i][0] = Vec3::ZERO);
        strands
    };
    let moved = |centre: Vec3| {
        let mut strands = head(centre, 0.12);
        for i in odd() {
            let root = strands[i][0];
            strands[i].iter_mut().for_each(|p| *p -= root);
        }
        strands
    };
    // Roots at the origin below the head and in it, and whole strands moved there.
    for strands in [rooted(HEAD), rooted(Vec3::ZERO), moved(HEAD), moved(Vec3::ZERO)] {
        let broken = hair(&strands);
        let (groom, losses) = read(&broken);
        assert_eq!((groom.len(), losses.stray_strands.count), (COUNT - 10, 10), "{losses}");
        let places: Vec<_> = losses
            .stray_strands
            .places
            .iter()
            .map(|p| match p {
                GroomPlace::Node { strand, .. } => *strand,
                other => panic!("{other}"),
            })
            .collect();
        assert_eq!(places, odd().collect::<Vec<_>>());
        for i in groom.guides(20) {
            assert_ne!(groom.strand(i).unwrap().points[0], Vec3::ZERO);
        }
        assert!(refused(&broken).contains("10 strays left out (strand 0 node"), "{losses}");
        let keep = GroomSettings { keep_strays: true, ..default() };
        let (kept, _) = Groom::from_file(&broken, &keep).unwrap();
        assert_eq!(kept.len(), COUNT);
        assert!(kept.guides(20).iter().any(|i| kept.strand(*i).unwrap().points[0] == Vec3::ZERO));
    }
    // One alone, far from all.
    let mut lone = head(HEAD, 0.12);
    lone[3].iter_mut().for_each(|p| *p += Vec3::X * 2.0);
    assert_eq!(read(&hair(&lone)).1.stray_strands.places, nodes([3], 0));
}

#[test]
fn hair_in_several_places_is_no_stray() {
    // Feet below a head, of several strands with roots of their own.
    let mut feet = head(HEAD, 0.12);
    for (i, strand) in feet.iter_mut().enumerate().filter(|(i, _)| i % 20 == 0) {
        *strand = (0..8).map(|k| Vec3::new(0.002 * i as f32, 0.1, 0.01 * k as f32)).collect();
    }
    assert_near(&read(&hair(&feet)).0, &feet);
    // Tufts, each from one root.
    let tufts: Vec<Vec<Vec3>> = head(HEAD, 0.12)
        .chunks(10)
        .flat_map(|tuft| {
            let root = tuft[0][0];
            tuft.iter().map(move |s| [&[root], &s[1..]].concat())
        })
        .collect();
    let (groom, losses) = read(&hair(&tufts));
    assert!(losses.is_empty() && groom.len() == COUNT, "{losses}");
    // Two strands only.
    let two = [vec![Vec3::ZERO, Vec3::Y * 0.1], vec![Vec3::X * 5.0, Vec3::X * 5.0 + Vec3::Y * 0.1]];
    assert_eq!(read(&hair(&two)).0.len(), 2);
}

fn reversed(strands: &[Vec<Vec3>], every: usize) -> Vec<Vec<Vec3>> {
    let turn = |(i, strand): (usize, &Vec<Vec3>)| {
        let mut strand = strand.clone();
        if i % every == 0 {
            strand.reverse();
        }
        strand
    };
    strands.iter().enumerate().map(turn).collect()
}

#[test]
fn strands_stored_tip_first_are_turned() {
    for (centre, length) in [(HEAD, 0.12), (HEAD, 0.01), (Vec3::ZERO, 0.5)] {
        let strands = head(centre, length);
        for every in [1, 4] {
            let backwards = hair(&reversed(&strands, every));
            let (groom, losses) = read(&backwards);
            if every > 1 && length < 0.02 {
                continue;
            }
            assert_near(&groom, &strands);
            assert_eq!(losses.turned_strands.count, COUNT / every, "{losses}");
            assert!(losses.to_string().contains("tip first turned (strand 0, strand"), "{losses}");
            // Nothing is lost by it.
            let strict = GroomSettings { strict: true, ..default() };
            assert!(Groom::from_file(&backwards, &strict).is_ok());
            let first = GroomSettings { roots: RootEnd::First, ..default() };
            let (as_stored, losses) = Groom::from_file(&backwards, &first).unwrap();
            assert!(losses.is_empty());
            assert_near(&as_stored, &reversed(&strands, every));
        }
        let last = GroomSettings { roots: RootEnd::Last, ..default() };
        let (groom, _) = Groom::from_file(&hair(&strands), &last).unwrap();
        assert_near(&groom, &reversed(&strands, 1));
    }
    // Widths turn along.
    let groom = Groom::from_polylines(reversed(&head(HEAD, 0.12), 1)).unwrap();
    let widths = (0..COUNT * 8).map(|i| (i % 8) as f32 * 1e-5).collect();
    let groom = groom.with_widths(widths).unwrap();
    let settings = GroomSettings { scale: Some(1.0), ..default() };
    let (groom, _) = settings.apply(groom, GroomFormat::Gltf).unwrap();
    assert_eq!(groom.strand(5).unwrap().widths.unwrap()[0], 7.0 * 1e-5);
}

/// Grooms of all presets on the training head, Y up.
fn presets() -> Vec<(HairPreset, Groom)> {
    let mesh = mannequin::mesh();
    let scalp = Scalp { up: Dir3::X, front: Dir3::Y, height: 0.118, ..default() };
    let planted = |preset: HairPreset| preset.plant(&mesh, &scalp).unwrap().groom;
    HairPreset::ALL.into_iter().map(|p| (p, planted(p).with_up(UpAxis::X))).collect()
}

#[test]
fn what_real_hair_is_like_is_not_odd_and_what_it_is_not_is() {
    let metres = GroomSettings { scale: Some(1.0), up: Some(UpAxis::Y), ..default() };
    let read = |groom: Groom| metres.apply(groom, GroomFormat::Gltf).unwrap();
    for (preset, groom) in presets() {
        let (same, losses) = read(groom.clone());
        assert!(losses.is_empty() && same == groom, "{preset:?}: {losses}");
        assert_eq!(groom.odd_size(1.0), None, "{preset:?}");
        assert_eq!(groom.odd_up(UpAxis::Y), None, "{preset:?}");
        let strands: Vec<Vec<Vec3>> = groom.strands().map(|s| s.points.to_vec()).collect();
        let backwards = Groom::from_polylines(reversed(&strands, 1)).unwrap();
        let (turned, losses) = read(backwards);
        let right = turned.strands().zip(&strands).filter(|(s, of)| s.points == &of[..]).count();
        assert_eq!(losses.turned_strands.count, right, "{preset:?}");
        let share = right as f32 / groom.len() as f32;
        let noticed = UpAxis::ALL.into_iter().filter(|up| {
            let odd = groom.clone().with_up(*up).odd_up(UpAxis::Y);
            odd.is_some_and(|odd| odd.to_y_up(up.to_y_up(Vec3::Y)).y > 0.99)
        });
        let noticed = noticed.count();
        use HairPreset::*;
        if matches!(preset, Curly | Coily | Short | Bob | Long | Fringe | Undercut | Locs) {
            assert!(share > 0.99, "{preset:?}: {share} turned");
        }
        // Where they cover a scalp.
        assert!(noticed >= 3 || matches!(preset, Beard | Fur), "{preset:?}: {noticed} of 5 axes");
    }
}

#[test]
fn millimetres_with_x_up_are_noticed() {
    for strands in [head(HEAD, 0.12), head(Vec3::ZERO, 0.3)] {
        let (groom, _) = read(&file(&strands, 0.001, UpAxis::X));
        let odd = groom.odd_size(UNIT).expect("2.54 times too large");
        assert_eq!(odd.scale, 0.001, "{odd}");
        assert!((odd.head.unwrap() - 0.09 * 2.54).abs() < 0.01, "{odd}");
        assert_eq!(groom.odd_up(UpAxis::Z), Some(UpAxis::X));
        let settings = GroomSettings { scale: Some(0.001), up: Some(UpAxis::X), ..default() };
        let (groom, _) = Groom::from_file(&file(&strands, 0.001, UpAxis::X), &settings).unwrap();
        assert_near(&groom, &strands);
        assert_eq!((groom.odd_size(0.001), groom.odd_up(UpAxis::X)), (None, None));
    }
    // Hair that hangs on no head, upside down; a crest that stands.
    let hangs = |length: f32| {
        let strand = |i: usize| {
            let root = Vec3::new(0.0, 0.0, 0.004 * i as f32);
            [root, root - Vec3::Y * length]
        };
        Groom::from_polylines((0..50).map(strand)).unwrap()
    };
    assert_eq!(hangs(0.4).odd_up(UpAxis::Y), None);
    assert_eq!(hangs(-0.4).odd_up(UpAxis::Y), Some(UpAxis::NegY));
    assert_eq!(hangs(-0.06).odd_up(UpAxis::Y), None);
}

#[test]
fn a_mane_in_centimetres_is_noticed_by_size_and_length_together() {
    // Down the back of a figure, 0.9 m, of strands of 8 cm: as metres it is fine.
    let strand = |i: usize| {
        let at = i as f32 / 300.0;
        let root = Vec3::new(0.01 * (i as f32 * 2.4).sin(), 0.9 - 0.7 * at, -0.5 * at);
        [root, root + Vec3::new(0.0, 0.02, -0.077)]
    };
    let mane = Groom::from_polylines((0..300).map(strand)).unwrap();
    assert_eq!((mane.odd_size(1.0), mane.odd_up(UpAxis::Y)), (None, None));
    for unit in [0.01f32, 0.001] {
        let raw = mane.clone().scaled(1.0 / unit).unwrap();
        assert_eq!(raw.odd_size(1.0).unwrap().scale, unit);
    }
}

#[test]
fn files_that_are_no_grooms_are_reported_for_what_they_are() {
    let dump: Vec<u8> = (0..300).flat_map(|i| (i as f32 * 0.01).sin().to_le_bytes()).collect();
    for (file, says) in [
        (
            &b"version https://git-lfs.github.com/spec/v1\noid sha256:ab\nsize 10\n"[..],
            "git lfs pull",
        ),
        (b"<!DOCTYPE html><html><body>Not Found</body></html>", "a web page (HTML)"),
        (b"\x89HDF\r\n\x1a\n", "Alembic archives of before 2013"),
        (b"version 2.0\nscale 1.0\n", "a text file of TressFX version 2.0"),
        (&4f32.to_be_bytes(), "unknown kind"),
        (&dump, "numbers without a header"),
    ] {
        let error = Groom::from_file(file, &default()).unwrap_err().to_string();
        assert!(error.contains(says), "{error}");
        assert!(!error.contains("expected .hair"), "{error}");
        assert_eq!(GroomFormat::of(file).unwrap_err().to_string(), error);
    }
    // USD is known, and read with a feature.
    let usd = b"#usda 1.0\n";
    let error = Groom::from_file(usd, &default()).unwrap_err().to_string();
    let is_on = cfg!(feature = "usd");
    let says = if is_on { "without curves" } else { "turn on the feature `usd`" };
    assert!(GroomFormat::of(usd) == Ok(GroomFormat::Usd) && error.contains(says), "{error}");
}
