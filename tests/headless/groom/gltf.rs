//! glTF and GLB files.

use super::files::{glb, gltf_bytes, gltf_json, le, primitive, small_glb};
use base64::{Engine, engine::general_purpose::STANDARD};
use bevy::{platform::collections::HashMap, prelude::*};
use bevy_keratin::authoring::groom::{Groom, GroomFileError, GroomPlace, GroomSettings, gltf};

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
        assert_eq!(losses.opened_loops.count, usize::from(mode == 2));
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
    assert_eq!(file.external(), ["my%20hair.bin"]);
    let beside = HashMap::from_iter([("my%20hair.bin".to_owned(), gltf_bytes())]);
    assert_eq!(file.read(&beside).unwrap().0, embedded);
    let error = gltf::read(json.as_bytes()).unwrap_err().to_string();
    assert!(error.contains("expected the file my%20hair.bin"), "{error}");
}

#[test]
fn what_is_no_line_is_skipped_and_counted() {
    let mixed = [primitive(4, true), primitive(3, false), primitive(0, false)].join(",");
    let (groom, losses) = gltf::read(&glb(&gltf_json(&mixed, ""), &gltf_bytes())).unwrap();
    assert_eq!((groom.len(), losses.skipped_primitives.count), (1, 2));
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
        (r#""count":5,"type":"VEC3""#, r#""count":5,"type":"VEC3","sparse":{}"#, "accessors[0]"),
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
    let (groom, losses) = gltf::read(&glb(&good, &bin)).unwrap();
    assert_eq!(lines(&groom), [chain(&[3, 4])]);
    assert_eq!(losses.broken_strands.places, [GroomPlace::Node { strand: 0, node: 0 }]);
    let mut bin = gltf_bytes();
    bin[122..124].copy_from_slice(&5u16.to_le_bytes());
    let error = gltf::read(&glb(&good, &bin)).unwrap_err().to_string();
    assert!(error.starts_with("accessors[3], byte 122 of its buffer: found 5"), "{error}");
}

/// By KHR_mesh_quantization, and sparse: what to do is said, and nothing is read wrong.
#[test]
fn positions_that_are_not_floats_are_refused_with_advice() {
    let good = gltf_json(&primitive(1, true), "");
    let float = r#""componentType":5126,"count":5,"type":"VEC3""#;
    assert!(gltf::read(&glb(&good, &gltf_bytes())).is_ok());
    for (instead, found, advice) in [
        (float.replace("5126", "5120"), "I8", "export as floats"),
        (float.replace("5126", "5121"), "U8", "export as floats"),
        (float.replace("5126", r#"5122,"normalized":true"#), "I16", "export as floats"),
        (float.replace("5126", "5123"), "U16", "export as floats"),
        (format!(r#"{float},"sparse":{{"count":1}}"#), "no data of its own", "sparse accessors"),
    ] {
        let json = good.replacen(float, &instead, 1);
        let error = gltf::read(&glb(&json, &gltf_bytes())).unwrap_err().to_string();
        assert!(error.starts_with("accessors[0]"), "{error}");
        assert!(error.contains(found) && error.contains(advice), "{error}");
    }
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

/// Two strands of three nodes: the good file in which each test breaks one thing.
fn two_strands() -> (String, Vec<u8>) {
    (gltf_json(&primitive(1, true), ""), gltf_bytes())
}

fn two() -> Vec<Vec<Vec3>> {
    vec![chain(&[0, 1, 2]), chain(&[3, 4])]
}

#[test]
fn what_lines_do_not_need_does_not_matter() {
    let (good, bin) = two_strands();
    let buffers = r#""buffers":[{"byteLength":132}"#;
    let missing = r#",{"byteLength":96,"uri":"not%20here.bin"}"#;
    let fallback =
        r#",{"byteLength":96,"extensions":{"EXT_meshopt_compression":{"fallback":true}}}"#;
    for (what, instead) in [
        (r#""scenes":[{"nodes":[0]}]"#, r#""scenes":[{"nodes":[0]},{"name":"empty"}]"#.to_owned()),
        (buffers, format!("{buffers}{fallback}")),
        (buffers, format!("{buffers}{missing}")),
        (
            buffers,
            format!(r#""materials":[{{"name":5}}],"animations":[{{"channels":[{{}}]}}],{buffers}"#),
        ),
        (r#""asset""#, r#""cameras":[{}],"textures":"none","asset""#.to_owned()),
    ] {
        let json = good.replacen(what, &instead, 1);
        assert_ne!(json, good);
        let file = glb(&json, &bin);
        assert_eq!(gltf::GltfFile::parse(&file).unwrap().external(), [""; 0], "{instead}");
        let (groom, losses) = gltf::read(&file).unwrap();
        assert!(lines(&groom) == two() && losses.is_empty(), "{instead}: {losses}");
    }
    // The same buffers, where lines are in them.
    for (buffer, says) in
        [(missing, "the file not%20here.bin"), (fallback, "EXT_meshopt_compression")]
    {
        let json = good.replacen(buffers, &format!("{buffers}{buffer}"), 1);
        let json =
            json.replacen(r#"{"buffer":0,"byteOffset":0"#, r#"{"buffer":1,"byteOffset":0"#, 1);
        let error = gltf::read(&glb(&json, &bin)).unwrap_err().to_string();
        assert!(error.starts_with("buffers[1]") && error.contains(says), "{error}");
    }
    let compressed =
        r#"{"extensions":{"EXT_meshopt_compression":{"buffer":0}},"buffer":0,"byteOffset":0"#;
    let json = good.replacen(r#"{"buffer":0,"byteOffset":0"#, compressed, 1);
    let error = gltf::read(&glb(&json, &bin)).unwrap_err().to_string();
    assert!(error.starts_with("bufferViews[0]: found EXT_meshopt_compression"), "{error}");
    // A scene without nodes that is the one to show has no lines.
    let json = good.replacen(r#""scenes":[{"nodes":[0]}]"#, r#""scenes":[{}]"#, 1);
    assert!(gltf::read(&glb(&json, &bin)).unwrap_err().to_string().contains("no lines"));
}

#[test]
fn json_padded_by_nul_is_read() {
    let (json, bin) = two_strands();
    for padding in ["\0", "\0\0\0\0", " \0\0"] {
        let (groom, losses) = gltf::read(&glb(&format!("{json}{padding}"), &bin)).unwrap();
        assert!(lines(&groom) == two() && losses.is_empty());
    }
    let inside = json.replacen(',', ",\0", 1);
    assert!(gltf::read(&glb(&inside, &bin)).is_err());
}

#[test]
fn lines_whose_segments_have_nodes_of_their_own_are_joined_by_place() {
    // Two strands, 0 to 2 and 5 to 7, as four segments with eight nodes.
    let places = [0, 1, 1, 2, 5, 6, 6, 7];
    let file = |order: Option<[u16; 8]>| {
        let mut bin: Vec<u8> = places.iter().flat_map(|x| le(&[*x as f32, 0.0, 0.0])).collect();
        bin.extend(order.unwrap_or_default().iter().flat_map(|i| i.to_le_bytes()));
        let indices = order.map_or("", |_| r#","indices":1"#);
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"mode":1{indices}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":8,"type":"VEC3"}},
{{"bufferView":1,"componentType":5123,"count":8,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":16}}],
"buffers":[{{"byteLength":112}}]}}"#
        );
        let (groom, _) = gltf::read(&glb(&json, &bin)).unwrap();
        let x = |strand: Vec<Vec3>| strand.iter().map(|p| p.x as i32).collect::<Vec<_>>();
        lines(&groom).into_iter().map(x).collect::<Vec<_>>()
    };
    let joined = vec![vec![0, 1, 2], vec![5, 6, 7]];
    assert_eq!(file(None), joined);
    assert_eq!(file(Some([0, 1, 2, 3, 4, 5, 6, 7])), joined);
    let mut shuffled = file(Some([6, 7, 2, 3, 0, 1, 4, 5]));
    shuffled.sort();
    assert_eq!(shuffled, joined);
    // The file's own direction counts.
    let turned = file(Some([3, 2, 1, 0, 7, 6, 5, 4]));
    assert_eq!(turned, [[2, 1, 0], [7, 6, 5]]);
}

#[test]
fn colours_and_uvs_that_cannot_be_read_are_left_out_and_counted() {
    let (good, bin) = two_strands();
    let uv = r#"{"bufferView":2,"componentType":5126,"count":5,"type":"VEC2"}"#;
    for (instead, broken, says) in [
        (uv.replace("5126", "5122"), false, "I16"),
        (uv.replace("VEC2", "VEC3").replace("5126", "5121"), false, "3 numbers"),
        (uv.replace(r#""bufferView":2,"#, ""), true, "no data of its own"),
        (uv.replace(r#""bufferView":2"#, r#""bufferView":9"#), true, "bufferViews[9]"),
        (uv.replace(r#""count":5"#, r#""count":4"#), true, "4 elements"),
        (uv.replace("5126", "7"), true, "an unknown type"),
    ] {
        let json = good.replacen(uv, &instead, 1);
        assert_ne!(json, good);
        let file = glb(&json, &bin);
        let (groom, losses) = gltf::read(&file).unwrap();
        assert_eq!(lines(&groom), two());
        assert!(groom.strands().all(|s| s.uv.is_none() && s.colors.is_some()), "{instead}");
        let counts = (losses.unread_arrays.count, losses.broken_arrays.count);
        assert_eq!(counts, (usize::from(!broken), usize::from(broken)), "{losses}");
        let text = losses.to_string();
        assert!(
            text.contains("meshes[0].primitives[0].TEXCOORD_0") && text.contains(says),
            "{text}"
        );
        let strict = GroomSettings { strict: true, ..default() };
        assert_eq!(Groom::from_file(&file, &strict).is_err(), broken);
    }
    // Without places there is nothing.
    let json = good.replacen(r#""POSITION":0"#, r#""POSITION":3"#, 1);
    assert!(gltf::read(&glb(&json, &bin)).is_err());
}

#[test]
fn skinned_lines_follow_their_joints_and_not_their_node() {
    // The mesh's node and its parent are scaled; joint 2 is not, and lies 10 m to the right.
    let joints = "[2]";
    let skinned = |node: &str, extra: &str, skin: &str| {
        let (good, mut bin) = two_strands();
        let attributes = format!(r#""TEXCOORD_0":2{extra}"#);
        let json = good
            .replacen(r#""TEXCOORD_0":2"#, &attributes, 1)
            .replacen(r#"{"mesh":0,"translation":[0,0,1]}"#, node, 1)
            .replacen(r#""scene":0"#, &format!(r#""skins":[{skin}],"scene":0"#), 1)
            .replacen(r#"[{"nodes":[0]}]"#, r#"[{"nodes":[0,2]}]"#, 1)
            .replacen(
                r#""count":6,"type":"SCALAR"}]"#,
                r#""count":6,"type":"SCALAR"},
{"bufferView":4,"componentType":5121,"count":5,"type":"VEC4"},
{"bufferView":5,"componentType":5126,"count":5,"type":"VEC4"},
{"bufferView":6,"componentType":5126,"count":1,"type":"MAT4"}]"#,
                1,
            )
            .replacen(
                r#""byteLength":12}]"#,
                r#""byteLength":12},
{"buffer":0,"byteOffset":132,"byteLength":20},{"buffer":0,"byteOffset":152,"byteLength":80},
{"buffer":0,"byteOffset":232,"byteLength":64}]"#,
                1,
            )
            .replacen(r#""byteLength":132"#, r#""byteLength":296"#, 1);
        // Slots of weight 0 name joints that are not there.
        (0..5).for_each(|_| bin.extend([0, 255, 255, 255]));
        (0..5).for_each(|_| bin.extend(le(&[0.5, 0.0, 0.0, 0.0])));
        bin.extend(le(&Mat4::from_translation(Vec3::Y).to_cols_array()));
        let (groom, losses) = gltf::read(&glb(&json, &bin)).unwrap();
        assert!(losses.is_empty(), "{losses}");
        groom.points().to_vec()
    };
    let node = r#"{"mesh":0,"skin":0,"scale":[0.01,0.01,0.01]},{"translation":[10,0,0]}"#;
    let free = r#"{"mesh":0,"translation":[0,0,1]},{"translation":[10,0,0]}"#;
    let weights = r#","JOINTS_0":4,"WEIGHTS_0":5"#;
    let at = |offset: Vec3| (0..5).map(|i| Vec3::X * i as f32 + offset).collect::<Vec<_>>();
    let skin = format!(r#"{{"joints":{joints}}}"#);
    assert_eq!(skinned(node, weights, &skin), at(Vec3::X * 10.0));
    let bound = format!(r#"{{"joints":{joints},"inverseBindMatrices":6}}"#);
    assert_eq!(skinned(node, weights, &bound), at(Vec3::X * 10.0 + Vec3::Y));
    // Without weights: as they are. Without a skin: by the node.
    assert_eq!(skinned(node, "", &skin), at(Vec3::ZERO));
    assert_eq!(skinned(free, weights, &skin), two().concat());
}
