//! `.hair` files.

use super::files::{hair, points, put};
use bevy::prelude::*;
use bevy_keratin::authoring::groom::{Groom, GroomError, GroomPlace, GroomSettings, yuksel};

#[test]
fn every_array_is_read_whatever_others_there_are() {
    // Three strands put all that follows at odd multiples of two bytes.
    for segments in [&[2u16, 1, 3][..], &[2, 2, 2], &[1, 4]] {
        let nodes = points(segments);
        for arrays in 0..16u32 {
            let bits = 2 | (arrays & 1) | (arrays & 14) << 1;
            if bits & 1 == 0 && segments.iter().any(|s| *s != segments[0]) {
                continue;
            }
            let (groom, losses) = yuksel::read(&hair(segments, bits)).unwrap();
            assert!(losses.is_empty());
            assert_eq!(groom.points(), nodes);
            let lengths: Vec<u16> = groom.strands().map(|s| s.points.len() as u16 - 1).collect();
            assert_eq!(lengths, segments, "bits {bits}");
            let last = groom.strands().last().unwrap();
            let (end, i) = (last.points.len() - 1, nodes.len() as f32 - 1.0);
            // What is in no array comes from the header.
            let width = if bits & 4 != 0 { 0.01 + i } else { 0.5 };
            let clear = if bits & 8 != 0 { 1.0 / (i + 2.0) } else { 0.25 };
            let [r, g, b] = if bits & 16 != 0 { [0.125 * i, 0.5, 1.0] } else { [0.1, 0.2, 0.3] };
            assert_eq!(last.widths.unwrap()[end], width);
            assert_eq!(last.colors.unwrap()[end], LinearRgba::new(r, g, b, 1.0 - clear));
            assert_eq!(last.uv, None);
        }
    }
}

#[test]
fn unset_defaults_say_nothing() {
    let mut file = hair(&[2, 2], 2);
    for (at, unset) in [(20, 1.0f32), (24, 0.0), (28, 1.0), (32, 1.0), (36, 1.0)] {
        put(&mut file, at, unset.to_bits());
    }
    let (groom, _) = yuksel::read(&file).unwrap();
    assert!(groom.strands().all(|s| s.widths.is_none() && s.colors.is_none()));
}

#[test]
fn strands_without_segments_are_left_out_and_counted() {
    let (groom, losses) = yuksel::read(&hair(&[0, 2, 0, 1], 31)).unwrap();
    assert_eq!((groom.len(), losses.short_strands.count), (2, 2));
    let (first, whole) = (groom.strands().next().unwrap(), points(&[0, 2, 0, 1]));
    assert_eq!(first.points, &whole[1..4]);
    assert_eq!(first.widths.unwrap(), [1.01, 2.01, 3.01]);
    assert!(losses.to_string().contains("2 strands"), "{losses}");
}

#[test]
fn what_is_written_reads_as_the_same_groom_and_writes_as_the_same_bytes() {
    for segments in [&[2u16, 1, 3][..], &[2, 2]] {
        for bits in [2 | 1, 2 | 1 | 4, 2 | 1 | 8, 2 | 1 | 16, 31] {
            let (groom, _) = yuksel::read(&hair(segments, bits)).unwrap();
            let written = yuksel::write(&groom).unwrap();
            let (again, _) = yuksel::read(&written).unwrap();
            assert_eq!(again.points(), groom.points());
            assert_eq!(yuksel::write(&again).unwrap(), written, "bits {bits}");
        }
    }
    // A file that is written the way this crate does it comes back byte by byte.
    for bits in [2 | 1 | 4 | 16, 2 | 1 | 4, 2 | 1 | 16, 2 | 1] {
        let file = hair(&[2, 1, 3], bits);
        let (groom, _) = yuksel::read(&file).unwrap();
        let mut written = yuksel::write(&groom).unwrap();
        // Defaults of arrays that are there mean nothing.
        written[16..40].copy_from_slice(&file[16..40]);
        assert_eq!(written, file, "bits {bits}");
    }
    let plain = Groom::from_polylines([[Vec3::ZERO, Vec3::Y], [Vec3::X, Vec3::ONE]]).unwrap();
    assert_eq!(yuksel::read(&yuksel::write(&plain).unwrap()).unwrap().0, plain);
}

#[test]
fn what_the_format_cannot_hold_is_refused() {
    let long = (0..65_537).map(|i| Vec3::Y * i as f32);
    let groom = Groom::from_polylines([long]).unwrap();
    let refused = yuksel::write(&groom).unwrap_err();
    assert_eq!(refused, GroomError::TooManyNodes { strand: 0, found: 65_537 });
    assert_eq!(yuksel::write(&Groom::default()).unwrap_err(), GroomError::Empty);
}

#[test]
fn files_without_strands_are_refused_and_impossible_widths_left_out() {
    let mut none = hair(&[1], 2);
    none.truncate(128);
    (4..=16).step_by(4).for_each(|at| put(&mut none, at, 0));
    put(&mut none, 12, 2);
    let error = yuksel::read(&none).unwrap_err().to_string();
    assert!(error.starts_with("byte 4: the count of strands is 0, expected 1 or more"), "{error}");
    for file in [hair(&[0, 0], 2), hair(&[0, 0, 0], 3)] {
        let error = yuksel::read(&file).unwrap_err().to_string();
        assert!(error.contains("strands without length left out (strand 0, strand 1"), "{error}");
    }
    // Three counts of two bytes, nine points, and the fourth thickness.
    let at = 128 + 6 + 9 * 12 + 3 * 4;
    let mut wide = hair(&[2, 1, 3], 31);
    for wrong in [-0.5, f32::NAN] {
        put(&mut wide, at, wrong.to_bits());
        let (groom, losses) = yuksel::read(&wide).unwrap();
        assert_eq!(groom.len(), 2);
        assert_eq!(losses.broken_strands.places, [GroomPlace::Node { strand: 1, node: 0 }]);
        let strict = GroomSettings { strict: true, ..default() };
        let error = Groom::from_file(&wide, &strict).unwrap_err().to_string();
        assert!(error.contains("(strand 1 node 0), expected none"), "{error}");
    }
    // A default that no strand can have: they do without.
    let mut wide = hair(&[2, 2], 2);
    put(&mut wide, 20, (-1.0f32).to_bits());
    let (groom, losses) = yuksel::read(&wide).unwrap();
    assert!(groom.len() == 2 && groom.strands().all(|s| s.widths.is_none()));
    assert_eq!((losses.broken_arrays.count, losses.broken_strands.count), (1, 0));
}

#[test]
fn what_is_written_after_any_scale_can_be_read() {
    let (groom, _) = yuksel::read(&hair(&[2, 1, 3], 31)).unwrap();
    let lines: Vec<_> = groom.strands().map(|s| s.points.to_vec()).collect();
    for width in [1e-30, 1.0, 1e20, 1e30, f32::MAX] {
        let groom = Groom::from_polylines(lines.clone()).unwrap();
        let groom = groom.with_widths((0..9).map(|i| width * 0.1 * i as f32).collect()).unwrap();
        for scale in [1e-9, 1.0, 1e9] {
            let Ok(scaled) = groom.clone().scaled(scale) else {
                continue;
            };
            assert_eq!(yuksel::read(&yuksel::write(&scaled).unwrap()).unwrap().0, scaled);
        }
    }
}

#[test]
fn errors_say_where_and_what() {
    let good = hair(&[2, 1, 3], 31);
    let mut broken = good.clone();
    put(&mut broken, 12, 1);
    let error = yuksel::read(&broken).unwrap_err().to_string();
    assert!(error.starts_with("byte 12: the array bits is 0x1, expected bit 2"), "{error}");

    let mut broken = good.clone();
    put(&mut broken, 8, 100);
    let error = yuksel::read(&broken).unwrap_err().to_string();
    assert!(error.starts_with("byte 8: the point count is 100, expected 9"), "{error}");

    let mut broken = good.clone();
    // The second point's y, behind three counts of two bytes.
    put(&mut broken, 128 + 6 + 12 + 4, f32::NAN.to_bits());
    let (groom, losses) = yuksel::read(&broken).unwrap();
    assert_eq!(
        (groom.len(), &losses.to_string()[..]),
        (2, "1 strands with a broken number left out (strand 0 node 1)",)
    );

    let mut swapped = good.clone();
    put(&mut swapped, 12, 31u32.swap_bytes());
    let error = yuksel::read(&swapped).unwrap_err().to_string();
    assert!(error.contains("the file is big-endian"), "{error}");
}

#[test]
fn bytes_after_the_end_are_reported() {
    let good = hair(&[2, 1, 3], 31);
    let (expected, _) = yuksel::read(&good).unwrap();
    let long = [&good[..], b"\r\n"].concat();
    let (groom, losses) = yuksel::read(&long).unwrap();
    assert_eq!(groom, expected);
    let says = format!("2 bytes after the end not read (from byte {})", good.len());
    assert_eq!(losses.to_string(), says);
    let strict = GroomSettings { strict: true, ..default() };
    let error = Groom::from_file(&long, &strict).unwrap_err().to_string();
    assert!(error.contains(&says) && error.contains("set GroomSettings::strict"), "{error}");
    assert!(Groom::from_file(&good, &strict).is_ok());
}
