//! Tiny files of every format, made here.

use bevy::prelude::*;

pub fn le(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

pub fn words(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|x| x.to_le_bytes()).collect()
}

pub fn put(file: &mut [u8], at: usize, word: u32) {
    file[at..at + 4].copy_from_slice(&word.to_le_bytes());
}

/// The nodes of all strands, strand i having `segments[i]` segments: no two alike.
pub fn points(segments: &[u16]) -> Vec<Vec3> {
    let strand = |(i, s): (usize, &u16)| {
        (0..=*s).map(move |k| Vec3::new(i as f32, 0.25 * i as f32, 0.5 * f32::from(k)))
    };
    segments.iter().enumerate().flat_map(strand).collect()
}

/// A `.hair` file with the arrays of these bits.
pub fn hair(segments: &[u16], bits: u32) -> Vec<u8> {
    let points = points(segments);
    let count = points.len();
    let mut file = b"HAIR".to_vec();
    file.extend(words(&[segments.len() as u32, count as u32, bits, segments[0].into()]));
    file.extend(le(&[0.5, 0.25, 0.1, 0.2, 0.3]));
    file.resize(128, 0);
    if bits & 1 != 0 {
        file.extend(segments.iter().flat_map(|s| s.to_le_bytes()));
    }
    points.iter().for_each(|p| file.extend(le(&p.to_array())));
    let each = |file: &mut Vec<u8>, f: &dyn Fn(f32) -> Vec<f32>| {
        (0..count).for_each(|i| file.extend(le(&f(i as f32))));
    };
    if bits & 4 != 0 {
        each(&mut file, &|i| vec![0.01 + i]);
    }
    if bits & 8 != 0 {
        each(&mut file, &|i| vec![1.0 / (i + 2.0)]);
    }
    if bits & 16 != 0 {
        each(&mut file, &|i| vec![0.125 * i, 0.5, 1.0]);
    }
    file
}

/// Which optional arrays a `.tfx` file has.
#[derive(Clone, Copy, Default)]
pub struct Arrays {
    pub uvs: bool,
    pub thickness: bool,
    pub colours: bool,
    pub vertex_uvs: bool,
    pub guide_indices: bool,
}

impl Arrays {
    pub const ALL: Self =
        Self { uvs: true, thickness: true, colours: true, vertex_uvs: true, guide_indices: true };
}

/// A `.tfx` file of `strands` strands of `each` nodes. In version 4 the first two nodes are fixed.
pub fn tfx(version: f32, strands: usize, each: usize, arrays: Arrays) -> Vec<u8> {
    let old = version < 4.0;
    let mut file = le(&[version]);
    file.extend(words(&[strands as u32, each as u32]));
    file.resize(if old { 296 } else { 160 }, 0);
    let slots: [usize; 6] = match old {
        true => [144, 152, 148, 156, 164, 160],
        false => [12, 16, 24, 28, 20, 0],
    };
    let mut add = |slot: usize, numbers: Vec<f32>| {
        let at = file.len() as u32;
        put(&mut file, slot, at);
        file.extend(le(&numbers));
    };
    let nodes = points(&vec![each as u16 - 1; strands]);
    let fixed = |i: usize| if i % each < 2 { 0.0 } else { 1.0 };
    let positions = nodes.iter().enumerate().flat_map(|(i, p)| match old {
        true => p.to_array().to_vec(),
        false => p.extend(fixed(i)).to_array().to_vec(),
    });
    add(slots[0], positions.collect());
    if arrays.uvs {
        add(slots[1], (0..2 * strands).map(|i| i as f32 * 0.125).collect());
    }
    if arrays.thickness {
        add(slots[2], (0..strands).map(|i| 0.01 + i as f32).collect());
    }
    if arrays.colours {
        add(slots[3], (0..4 * nodes.len()).map(|i| i as f32 * 0.01).collect());
    }
    if arrays.vertex_uvs {
        add(slots[4], vec![0.5; 2 * nodes.len()]);
    }
    if arrays.guide_indices && old {
        add(slots[5], vec![0.0; strands]);
    }
    file
}

/// glTF's JSON around `primitive` and `buffer`, the four parts of [`gltf_bytes`] as accessors 0
/// (POSITION), 1 (COLOR_0), 2 (TEXCOORD_0), 3 (indices).
pub fn gltf_json(primitive: &str, buffer: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"children":[1],"scale":[2,2,2]}},{{"mesh":0,"translation":[0,0,1]}}],
"meshes":[{{"primitives":[{primitive}]}}],
"accessors":[
{{"bufferView":0,"componentType":5126,"count":5,"type":"VEC3"}},
{{"bufferView":1,"componentType":5121,"normalized":true,"count":5,"type":"VEC4"}},
{{"bufferView":2,"componentType":5126,"count":5,"type":"VEC2"}},
{{"bufferView":3,"componentType":5123,"count":6,"type":"SCALAR"}}],
"bufferViews":[
{{"buffer":0,"byteOffset":0,"byteLength":60}},
{{"buffer":0,"byteOffset":60,"byteLength":20}},
{{"buffer":0,"byteOffset":80,"byteLength":40}},
{{"buffer":0,"byteOffset":120,"byteLength":12}}],
"buffers":[{{{buffer}"byteLength":132}}]}}"#
    )
}

/// Five nodes along x, their colours, UVs, and edges 2–1, 0–1, 3–4: two strands.
pub fn gltf_bytes() -> Vec<u8> {
    let mut bytes: Vec<u8> = (0..5).flat_map(|i| le(&[i as f32, 0.0, 0.0])).collect();
    bytes.extend((0..5u8).flat_map(|i| [i * 51, 0, 255, 255]));
    bytes.extend((0..5).flat_map(|i| le(&[0.1 * i as f32, 0.5])));
    bytes.extend([2u16, 1, 0, 1, 3, 4].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

pub fn primitive(mode: u32, indexed: bool) -> String {
    let indices = if indexed { r#","indices":3"# } else { "" };
    let attributes = r#"{"POSITION":0,"COLOR_0":1,"TEXCOORD_0":2}"#;
    format!(r#"{{"attributes":{attributes},"mode":{mode}{indices}}}"#)
}

pub fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut text = json.as_bytes().to_vec();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = b"glTF".to_vec();
    file.extend(words(&[2, (28 + text.len() + bin.len()) as u32, text.len() as u32]));
    file.extend(b"JSON");
    file.extend(text);
    file.extend(words(&[bin.len() as u32]));
    file.extend(b"BIN\0");
    file.extend(bin);
    file
}

/// A GLB file with a strand of each mode.
pub fn small_glb() -> Vec<u8> {
    glb(&gltf_json(&[primitive(1, true), primitive(3, false)].join(","), ""), &gltf_bytes())
}
