//! The figure as a binary glTF file: skin, bones and colours, for the example `preset_on_gltf`.

use crate::skeleton;
use bevy::{mesh::VertexAttributeValues as Values, prelude::*};
use serde_json::{Value, json};
use std::{fs, path::Path};

/// Names of the bones in the middle, of the left side and of the right.
const NAMES: [&str; skeleton::COUNT] = [
    "Hips",
    "Spine",
    "Chest",
    "Neck",
    "Head",
    "UpperArm.L",
    "Forearm.L",
    "Thigh.L",
    "Shin.L",
    "Foot.L",
    "UpperArm.R",
    "Forearm.R",
    "Thigh.R",
    "Shin.R",
    "Foot.R",
];

/// The buffer, and what is said of its parts.
#[derive(Default)]
struct Buffer {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Buffer {
    fn add(&mut self, bytes: impl IntoIterator<Item = u8>, mut about: Value) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
        about["bufferView"] = json!(self.views.len() - 1);
        self.accessors.push(about);
        self.accessors.len() - 1
    }
}

const BYTE: u32 = 5121;
const SHORT: u32 = 5123;
const FLOAT: u32 = 5126;

fn floats<const N: usize>(values: &[[f32; N]]) -> impl Iterator<Item = u8> {
    values.iter().flatten().flat_map(|x| x.to_le_bytes())
}

fn byte(x: f32) -> u8 {
    (x.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Weights as bytes that sum to one.
fn weight_bytes(weights: &[f32; 4]) -> [u8; 4] {
    let mut bytes = weights.map(byte);
    let others = bytes[1].saturating_add(bytes[2]).saturating_add(bytes[3]);
    bytes[0] = 255 - others;
    bytes
}

/// Writes it.
pub fn write(mesh: &Mesh, path: &Path) -> Result {
    let attribute = |id| mesh.attribute(id);
    let (
        Some(Values::Float32x3(places)),
        Some(Values::Float32x3(normals)),
        Some(Values::Float32x4(colors)),
        Some(Values::Uint16x4(joints)),
        Some(Values::Float32x4(weights)),
        Some(indices),
    ) = (
        attribute(Mesh::ATTRIBUTE_POSITION),
        attribute(Mesh::ATTRIBUTE_NORMAL),
        attribute(Mesh::ATTRIBUTE_COLOR),
        attribute(Mesh::ATTRIBUTE_JOINT_INDEX),
        attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT),
        mesh.indices(),
    )
    else {
        return Err("the body has not all it needs".into());
    };
    let count = places.len();
    let indices: Vec<u16> = indices.iter().map(u16::try_from).collect::<Result<_, _>>()?;
    let ends = places.iter().map(|p| Vec3::from_array(*p));
    let (low, high) = ends.fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(p), b.max(p)));
    let about = |count: usize, kind: u32, shape: &str| json!({"count": count, "componentType": kind, "type": shape});
    let mut buffer = Buffer::default();
    let mut place = about(count, FLOAT, "VEC3");
    place["min"] = json!(low.to_array());
    place["max"] = json!(high.to_array());
    let mut color = about(count, BYTE, "VEC4");
    color["normalized"] = json!(true);
    let mut weight = color.clone();
    weight["type"] = json!("VEC4");
    let attributes = json!({
        "POSITION": buffer.add(floats(places), place),
        "NORMAL": buffer.add(floats(normals), about(count, FLOAT, "VEC3")),
        "COLOR_0": buffer.add(colors.iter().flat_map(|c| c.map(byte)), color),
        "JOINTS_0": buffer.add(joints.iter().flat_map(|j| j.map(|j| j as u8)), about(count, BYTE, "VEC4")),
        "WEIGHTS_0": buffer.add(weights.iter().flat_map(weight_bytes), weight),
    });
    let triangles = about(indices.len(), SHORT, "SCALAR");
    let triangles = buffer.add(indices.iter().flat_map(|i| i.to_le_bytes()), triangles);
    let inverse: Vec<[f32; 16]> = (0..skeleton::COUNT)
        .map(|bone| Mat4::from_translation(-skeleton::joint(bone)).to_cols_array())
        .collect();
    let inverse = buffer.add(floats(&inverse), about(skeleton::COUNT, FLOAT, "MAT4"));
    // The figure, its bones, its skin.
    let below = |bone: usize| -> Vec<usize> {
        (0..skeleton::COUNT).filter(|b| skeleton::parent(*b) == Some(bone)).map(|b| b + 1).collect()
    };
    let skin = skeleton::COUNT + 1;
    let mut nodes = vec![json!({"name": "Figure", "children": [1, skin]})];
    for (bone, name) in NAMES.iter().enumerate() {
        let place = skeleton::at_rest(bone).translation.to_array();
        let mut node = json!({"name": name, "translation": place});
        if !below(bone).is_empty() {
            node["children"] = json!(below(bone));
        }
        nodes.push(node);
    }
    nodes.push(json!({"name": "Body", "mesh": 0, "skin": 0}));
    let joints: Vec<usize> = (1..=skeleton::COUNT).collect();
    let document = json!({
        "asset": {"version": "2.0", "generator": "bevy_keratin, example gallery"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "skins": [{"joints": joints, "inverseBindMatrices": inverse, "skeleton": 1}],
        "meshes": [{"name": "Body", "primitives":
            [{"attributes": attributes, "indices": triangles, "material": 0}]}],
        "materials": [{"name": "Skin", "pbrMetallicRoughness":
            {"metallicFactor": 0.0, "roughnessFactor": 0.55}}],
        "buffers": [{"byteLength": buffer.bytes.len()}],
        "bufferViews": buffer.views,
        "accessors": buffer.accessors,
    });
    let mut text = serde_json::to_vec(&document)?;
    text.resize(text.len().next_multiple_of(4), b' ');
    let size = |n: usize| u32::try_from(n).map(u32::to_le_bytes);
    let mut file = b"glTF".to_vec();
    file.extend(2_u32.to_le_bytes());
    file.extend(size(12 + 8 + text.len() + 8 + buffer.bytes.len())?);
    file.extend(size(text.len())?);
    file.extend(b"JSON");
    file.extend(text);
    file.extend(size(buffer.bytes.len())?);
    file.extend(b"BIN\0");
    file.extend(buffer.bytes);
    fs::write(path, file)?;
    Ok(())
}
