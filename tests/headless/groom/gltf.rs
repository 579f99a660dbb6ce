//! glTF and GLB files.

use super::files::{glb, gltf_bytes, gltf_json, primitive, small_glb};
use base64::{Engine, engine::general_purpose::STANDARD};
use bevy::{platform::collections::HashMap, prelude::*};
use bevy_keratin::authoring::groom::{Groom, GroomFileError, gltf};

/// Where node `i` is once both transforms are applied.
fn at(i: usize) -> Vec3 {
    Vec3::new(2.0 * i as f32, 0.0, 2.0)
}

fn lines(groom: &Groom) -> Vec<Vec<Vec3>> {
    groom.strands().map(|s| s.points.to_vec()).collect()
}

fn chain(indices: &[usize]) -> Vec<Vec3> {
    indices.iter().map(|i| at(*i)).collect()
}

#[test]
fn lines_strips_and_loops_become_strands_in_the_scene() {
    for (mode, indexed, expected) in [
        (1, true, vec![chain(&[0, 1, 2]), chain(&[3, 4])]),
        (1, false, vec![chain(&[0, 1]), chain(&[2, 3])]),
        (3, false, vec![chain(&[0, 1, 2, 3, 4])]),
        (3, true, vec![chain(&[2, 1, 0, 1, 3, 4])]),
        (2, false, vec![chain(&[0, 1, 2, 3, 4])]),
    ] {
        let file = glb(&gltf_json(&primitive(mode, indexed), ""), &gltf_bytes());
        let (groom, losses) = gltf::read(&file).unwrap();
        assert_eq!(lines(&groom), expected, "mode {mode}");
        assert_eq!(losses.opened_loops, usize::from(mode == 2));
    }
}

#[test]
fn colours_and_uvs_come_along() {
    let (groom, _) = gltf::read(&small_glb()).unwrap();
    let strands: Vec<_> = groom.strands().collect();
    assert_eq!(strands.len(), 3);
    assert_eq!(strands[1].colors.unwrap()[1], LinearRgba::new(0.8, 0.0, 1.0, 1.0));
    assert_eq!(strands[1].uv, Some(Vec2::new(0.3, 0.5)));
    // A primitive without them beside one with.
    let bare = r#"{"attributes":{"POSITION":0},"mode":3}"#;
    let both = [bare, &primitive(3, false)].join(",");
    let (groom, _) = gltf::read(&glb(&gltf_json(&both, ""), &gltf_bytes())).unwrap();
    let strands: Vec<_> = groom.strands().collect();
    assert_eq!(strands[0].colors.unwrap()[4], LinearRgba::WHITE);
    assert_eq!(
        strands[1].colors.unwrap()[4],
        LinearRgba::new(0.8, 0.0, 1.0, 1.0).with_red(1.0 * 4.0 / 5.0)
    );
}

#[test]
fn buffers_may_be_inside_or_files_of_their_own() {
    let (embedded, _) = gltf::read(&small_glb()).unwrap();
    let primitives = [primitive(1, true), primitive(3, false)].join(",");
    let data = STANDARD.encode(gltf_bytes());
    let uri = format!(r#""uri":"data:application/octet-stream;base64,{data}","#);
    let (inside, _) = gltf::read(gltf_json(&primitives, &uri).as_bytes()).unwrap();
    assert_eq!(inside, embedded);

    let json = gltf_json(&primitives, r#""uri":"my%20hair.bin","#);
    let file = gltf::GltfFile::parse(json.as_bytes()).unwrap();
    assert_eq!(file.external().collect::<Vec<_>>(), ["my%20hair.bin"]);
    let beside = HashMap::from_iter([("my%20hair.bin".to_owned(), gltf_bytes())]);
    assert_eq!(file.read(&beside).unwrap().0, embedded);
    let error = gltf::read(json.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("expected the file my%20hair.bin"), "{error}");
}

#[test]
fn what_is_no_line_is_skipped_and_counted() {
    let mixed = [primitive(4, true), primitive(3, false), primitive(0, false)].join(",");
    let (groom, losses) = gltf::read(&glb(&gltf_json(&mixed, ""), &gltf_bytes())).unwrap();
    assert_eq!((groom.len(), losses.skipped_primitives), (1, 2));
    let none = gltf_json(&primitive(4, true), "");
    let error = gltf::read(&glb(&none, &gltf_bytes())).unwrap_err().to_string();
    assert!(error.contains("expected primitives of mode 1, 2 or 3"), "{error}");
}

#[test]
fn references_to_nothing_are_errors_with_their_path() {
    let good = gltf_json(&primitive(1, true), "");
    for (what, instead, path) in [
        (r#""POSITION":0"#, r#""POSITION":9"#, "accessors[9]"),
        (r#""POSITION":0"#, r#""NORMAL":0"#, "meshes[0].primitives[0]"),
        (r#""indices":3"#, r#""indices":0"#, "accessors[0]"),
        (r#""bufferView":0"#, r#""bufferView":7"#, "bufferViews[7]"),
        (r#""byteLength":60"#, r#""byteLength":600000"#, "bufferViews[0]"),
        (r#""count":5,"type":"VEC3""#, r#""count":6,"type":"VEC3""#, "accessors[0]"),
        (r#""count":6"#, r#""count":18446744073709551615"#, "accessors[3]"),
        (r#""byteLength":132"#, r#""byteLength":133"#, "buffers[0]"),
        (r#""mesh":0"#, r#""mesh":1"#, "meshes[1]"),
        (r#""nodes":[0]"#, r#""nodes":[5]"#, "nodes[5]"),
        (r#""mesh":0"#, r#""mesh":0,"children":[0]"#, "nodes[0]"),
        (
            r#""componentType":5126,"count":5,"type":"VEC3""#,
            r#""componentType":5123,"count":5,"type":"VEC3""#,
            "accessors[0]",
        ),
        (r#""version":"2.0""#, r#""version":"1.0""#, "asset.version"),
    ] {
        let json = good.replacen(what, instead, 1);
        assert_ne!(json, good, "{what} is there to be replaced");
        match gltf::read(&glb(&json, &gltf_bytes())) {
            Err(GroomFileError::Gltf { place, .. }) => assert_eq!(place, path, "{instead}"),
            other => panic!("{instead}: {other:?}"),
        }
    }
    let mut bin = gltf_bytes();
    bin[4..8].copy_from_slice(&f32::NAN.to_le_bytes());
    let error = gltf::read(&glb(&good, &bin)).unwrap_err().to_string();
    assert!(error.starts_with("accessors[0], byte 4 of its buffer"), "{error}");
    let mut bin = gltf_bytes();
    bin[122..124].copy_from_slice(&5u16.to_le_bytes());
    let error = gltf::read(&glb(&good, &bin)).unwrap_err().to_string();
    assert!(error.starts_with("accessors[3], byte 122 of its buffer: found 5"), "{error}");
}

#[test]
fn copies_beyond_the_files_size_are_refused() {
    let nodes: Vec<String> = (0..2000).map(|_| r#"{"mesh":0}"#.to_owned()).collect();
    let json = gltf_json(&primitive(3, false), "")
        .replace(r#"{"mesh":0,"#, &(nodes.join(",") + r#",{"mesh":0,"#));
    let all: Vec<String> = (1..2000).map(|i| i.to_string()).collect();
    let json = json.replace("[{\"nodes\":[0]}]", &format!("[{{\"nodes\":[{}]}}]", all.join(",")));
    assert!(gltf::read(&glb(&json, &gltf_bytes())).is_ok(), "five nodes for every ten bytes");
    let many = vec![primitive(3, true); 30].join(",");
    let json = json.replace(&primitive(3, false), &many);
    let error = gltf::read(&glb(&json, &gltf_bytes())).unwrap_err().to_string();
    assert!(error.contains("apply instances"), "{error}");
}

#[test]
fn extras_of_any_kind_are_ignored() {
    let good = gltf_json(&primitive(1, true), "");
    let expected = gltf::read(&glb(&good, &gltf_bytes())).unwrap();
    for extras in ["1", "\"text\"", "[1, {}]", "true", "null", "{\"a\": [2]}"] {
        let with = |before: &str| {
            let json = good.replacen(before, &format!("\"extras\":{extras},{before}"), 1);
            assert_ne!(json, good);
            json
        };
        for before in [r#""asset""#, r#""version""#, r#""mesh":0"#, r#""attributes""#] {
            let read = gltf::read(&glb(&with(before), &gltf_bytes()));
            assert_eq!(read.as_ref(), Ok(&expected), "{extras} before {before}");
        }
    }
}
