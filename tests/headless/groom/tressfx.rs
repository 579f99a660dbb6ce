//! `.tfx` files.

use super::files::{Arrays, points, put, tfx};
use bevy::prelude::*;
use bevy_keratin::authoring::groom::{Groom, GroomPlace, GroomSettings, tressfx};

#[test]
fn every_array_of_both_versions_is_read() {
    for version in [3.0, 3.1, 4.0, 4.1] {
        for k in 0..16 {
            let arrays = Arrays {
                uvs: k & 1 != 0,
                thickness: k & 2 != 0,
                colours: k & 4 != 0,
                vertex_uvs: k & 8 != 0,
                guide_indices: k & 8 != 0,
            };
            let (groom, losses) = tressfx::read(&tfx(version, 3, 4, arrays)).unwrap();
            assert_eq!(groom.points(), points(&[3, 3, 3]), "version {version}");
            let strands: Vec<_> = groom.strands().collect();
            assert_eq!(strands.len(), 3);
            assert_eq!(strands[1].uv, arrays.uvs.then_some(Vec2::new(0.25, 0.375)));
            assert_eq!(strands[1].widths, arrays.thickness.then_some(&[1.01f32; 4][..]));
            let colour = strands[2].colors.map(|c| c[3].to_f32_array());
            let expected = [44u8, 45, 46, 47].map(|i| f32::from(i) * 0.01);
            assert_eq!(colour, arrays.colours.then_some(expected));
            let old = version < 4.0;
            assert_eq!(losses.unread_arrays.count, (k >> 3) * (1 + usize::from(old)));
            // Of the two fixed nodes of each strand one is the root.
            assert_eq!(losses.freed_nodes.count, if old { 0 } else { 3 });
        }
    }
}

#[test]
fn the_version_decides_and_offset_zero_is_no_array() {
    // A header of version 4 is too short for one of version 3 and the other way round.
    let mut file = tfx(4.0, 3, 4, Arrays::default());
    put(&mut file, 0, 3.0f32.to_bits());
    assert!(tressfx::read(&file).is_err());
    let mut file = tfx(3.0, 3, 4, Arrays::default());
    put(&mut file, 0, 4.0f32.to_bits());
    let error = tressfx::read(&file).unwrap_err().to_string();
    assert!(error.starts_with("byte 12: the positions' offset is 0"), "{error}");
    let (groom, _) = tressfx::read(&tfx(4.0, 3, 4, Arrays::default())).unwrap();
    assert!(groom.strands().all(|s| s.uv.is_none()), "bytes of the header are no UVs");
}

#[test]
fn errors_say_where_and_what() {
    let good = tfx(4.0, 3, 4, Arrays::ALL);
    for (at, word, says) in [
        (0, 2.0f32.to_bits(), "byte 0: the version is 2, expected 3.x or 4.x"),
        (0, f32::NAN.to_bits(), "byte 0: the version is NaN"),
        (8, 1, "byte 8: the node count of a strand is 1, expected 2"),
        (12, 4, "byte 12: an array's offset is 4, expected 0 or 160"),
        (16, 159, "byte 16: an array's offset is 159"),
        (12, u32::MAX, "byte 4294967295: expected 192 bytes of a position, found 0"),
    ] {
        let mut file = good.clone();
        put(&mut file, at, word);
        let error = tressfx::read(&file).unwrap_err().to_string();
        assert!(error.starts_with(says), "{error}");
    }
    let mut file = good.clone();
    put(&mut file, 160 + 16 * 5 + 8, f32::NEG_INFINITY.to_bits());
    let (groom, losses) = tressfx::read(&file).unwrap();
    assert_eq!(groom.len(), 2);
    assert_eq!(losses.broken_strands.places, [GroomPlace::Node { strand: 1, node: 1 }]);
}

#[test]
fn files_without_strands_are_refused_and_strands_of_negative_width_left_out() {
    for version in [3.0, 4.0] {
        let mut none = tfx(version, 3, 4, Arrays::ALL);
        put(&mut none, 4, 0);
        let error = tressfx::read(&none).unwrap_err().to_string();
        assert!(error.starts_with("byte 4: the count of strands"), "{error}");
        let mut wide = tfx(version, 3, 4, Arrays { thickness: true, ..Arrays::default() });
        let at = wide.len() - 4;
        put(&mut wide, at, (-2.0f32).to_bits());
        let (groom, losses) = tressfx::read(&wide).unwrap();
        assert_eq!((groom.len(), losses.broken_strands.count), (2, 1));
        let strict = GroomSettings { strict: true, ..default() };
        let error = Groom::from_file(&wide, &strict).unwrap_err().to_string();
        assert!(error.contains("(strand 2 node 0), expected none"), "{error}");
        // All of them: the strands can do without.
        for i in 0..3 {
            put(&mut wide, at - 4 * i, (-2.0f32).to_bits());
        }
        let (groom, losses) = tressfx::read(&wide).unwrap();
        assert!(groom.len() == 3 && groom.strands().all(|s| s.widths.is_none()));
        assert!(losses.to_string().contains("expected a finite diameter"), "{losses}");
    }
}
