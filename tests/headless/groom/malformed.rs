//! Files cut short, with extreme numbers, and of random bytes: always an error, never a panic.

use super::files::{Arrays, glb, gltf_bytes, gltf_json, hair, primitive, put, small_glb, tfx};
use bevy::math::Vec3;
use bevy_keratin::authoring::groom::{Groom, GroomSettings, alembic};
use proptest::prelude::*;

fn read(file: &[u8]) -> Result<Groom, String> {
    let read = Groom::from_file(file, &GroomSettings::default());
    read.map(|r| r.0).map_err(|e| e.to_string())
}

fn valid_files() -> Vec<Vec<u8>> {
    let json = gltf_json(&primitive(1, true), "");
    vec![
        hair(&[2, 1, 3], 31),
        hair(&[2, 2], 2),
        tfx(4.0, 3, 4, Arrays::ALL),
        tfx(4.0, 2, 3, Arrays::default()),
        tfx(3.0, 3, 4, Arrays::ALL),
        tfx(3.0, 2, 3, Arrays::default()),
        small_glb(),
        glb(&json, &gltf_bytes()),
        archive(),
    ]
}

fn archive() -> Vec<u8> {
    let strands = [0.0, 0.1, 0.2].map(|x| [Vec3::X * x, Vec3::X * x + Vec3::Y * 0.1]);
    alembic::write(&Groom::from_polylines(strands).unwrap()).unwrap()
}

#[test]
fn every_truncation_is_an_error_that_names_a_place() {
    for file in valid_files() {
        assert!(read(&file).is_ok(), "{:?}", read(&file));
        for end in 0..file.len() {
            let error = read(&file[..end]).expect_err("a file cut short");
            assert!(error.starts_with("byte "), "{error}");
            assert!(error.contains("expected"), "{error}");
        }
    }
}

#[test]
fn json_cut_short_is_an_error() {
    let json = gltf_json(&primitive(3, false), r#""uri":"data:;base64,AAAA","#);
    for end in 0..json.len() {
        assert!(read(&json.as_bytes()[..end]).is_err());
    }
}

#[test]
fn header_fields_at_their_extremes_do_no_harm() {
    let extremes = [
        0,
        1,
        2,
        3,
        127,
        160,
        u16::MAX.into(),
        i32::MAX as u32,
        1 << 31,
        u32::MAX - 1,
        u32::MAX,
        f32::MAX.to_bits(),
        f32::INFINITY.to_bits(),
        f32::MIN_POSITIVE.to_bits(),
    ];
    let (mut good, mut bad) = (0, 0);
    for file in valid_files() {
        let header = file.len().min(296);
        for at in (0..header - 3).step_by(4) {
            for word in extremes {
                let mut broken = file.clone();
                put(&mut broken, at, word);
                match read(&broken) {
                    Ok(groom) => {
                        good += 1;
                        assert!(groom.points().iter().all(|p| p.is_finite()));
                        // What comes out is in the size class of what went in.
                        assert!(groom.points().len() <= broken.len());
                    }
                    Err(_) => bad += 1,
                }
            }
        }
    }
    assert!(good > 100 && bad > 500, "{good} read, {bad} refused");
}

/// Fields whose extreme values contradict the rest, so that each has to be refused.
#[test]
fn header_fields_that_count_or_point_are_checked() {
    let hair = hair(&[2, 1, 3], 31);
    let v4 = tfx(4.0, 3, 4, Arrays::ALL);
    let v3 = tfx(3.0, 3, 4, Arrays::ALL);
    let glb = small_glb();
    let fields: [(&[u8], &[usize]); 4] = [
        (&hair, &[0, 4, 8, 12]),
        (&v4, &[0, 4, 8, 12, 16, 24, 28]),
        (&v3, &[0, 4, 8, 144, 148, 152, 156]),
        (&glb, &[0, 4, 8, 12, 16]),
    ];
    for (file, fields) in fields {
        for &at in fields {
            for word in [u32::MAX, u32::MAX - 3, 1 << 31, i32::MAX as u32] {
                let mut broken = file.to_vec();
                put(&mut broken, at, word);
                assert!(read(&broken).is_err(), "{word:#x} at byte {at}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let _ = read(&bytes);
    }

    #[test]
    fn random_bytes_behind_a_good_beginning_never_panic(
        kind in 0..7usize,
        strands in 0..6u32,
        nodes in 0..20u32,
        bytes in proptest::collection::vec(any::<u8>(), 0..600),
    ) {
        let start: [&[u8]; 7] = [
            b"HAIR",
            &4.0f32.to_le_bytes(),
            &3.0f32.to_le_bytes(),
            b"glTF",
            b"{\"asset\":",
            b"Ogawa\xff\0\x01",
            b"ply\n",
        ];
        let mut file = start[kind].to_vec();
        if kind < 3 {
            file.extend(strands.to_le_bytes());
            file.extend(nodes.to_le_bytes());
        }
        file.extend(bytes);
        let _ = read(&file);
    }

    #[test]
    fn valid_files_with_bytes_changed_never_panic(
        which in 0..9usize,
        changes in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12),
    ) {
        let mut file = valid_files().swap_remove(which);
        for (at, byte) in changes {
            let at = at.index(file.len());
            file[at] = byte;
        }
        if let Ok(groom) = read(&file) {
            prop_assert!(groom.points().iter().all(|p| p.is_finite()));
            prop_assert!(groom.points().len() <= file.len());
        }
    }
}
