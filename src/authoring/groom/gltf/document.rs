//! The part of glTF's JSON that lines need. Whatever else is in a file, and is wrong there, does not matter.

use bevy::platform::collections::HashMap;
use serde::{Deserialize, de::IgnoredAny};

macro_rules! objects {
    ($($(#[$doc:meta])* struct $name:ident { $($(#[$attribute:meta])* $field:ident: $type:ty,)* })*) => {
        $(
            $(#[$doc])*
            #[derive(Deserialize, Clone, Debug, Default)]
            #[serde(rename_all = "camelCase", default)]
            pub struct $name { $($(#[$attribute])* pub $field: $type,)* }
        )*
    };
}

objects! {
    /// The whole.
    struct Document {
        asset: Asset,
        scene: Option<usize>,
        scenes: Vec<Scene>,
        nodes: Vec<Node>,
        meshes: Vec<Mesh>,
        skins: Vec<Skin>,
        accessors: Vec<Accessor>,
        buffer_views: Vec<BufferView>,
        buffers: Vec<Buffer>,
    }
    struct Asset {
        version: String,
    }
    struct Scene {
        nodes: Vec<usize>,
    }
    struct Node {
        children: Vec<usize>,
        mesh: Option<usize>,
        skin: Option<usize>,
        matrix: Option<[f32; 16]>,
        scale: Option<[f32; 3]>,
        rotation: Option<[f32; 4]>,
        translation: Option<[f32; 3]>,
    }
    struct Mesh {
        primitives: Vec<Primitive>,
    }
    struct Primitive {
        attributes: HashMap<String, usize>,
        indices: Option<usize>,
        mode: Option<u32>,
        extensions: Extensions,
    }
    struct Skin {
        joints: Vec<usize>,
        inverse_bind_matrices: Option<usize>,
    }
    struct Accessor {
        buffer_view: Option<usize>,
        byte_offset: u64,
        component_type: u32,
        normalized: bool,
        count: u64,
        #[serde(rename = "type")]
        shape: String,
        sparse: Option<IgnoredAny>,
    }
    struct BufferView {
        buffer: usize,
        byte_offset: u64,
        byte_length: u64,
        byte_stride: Option<u64>,
        extensions: Extensions,
    }
    struct Buffer {
        uri: Option<String>,
        byte_length: u64,
        extensions: Extensions,
    }
}

/// Extensions of an object by their names.
pub type Extensions = HashMap<String, IgnoredAny>;

/// The names of extensions that compress.
pub fn compression(extensions: &Extensions) -> Option<&str> {
    let known = |name: &&String| name.contains("compression") || name.contains("meshopt");
    extensions.keys().filter(known).map(String::as_str).min()
}

impl Primitive {
    pub const LINES: u32 = 1;
    pub const LINE_LOOP: u32 = 2;
    pub const LINE_STRIP: u32 = 3;

    /// Its mode if it is lines.
    pub fn lines(&self) -> Option<u32> {
        self.mode.filter(|mode| (Self::LINES..=Self::LINE_STRIP).contains(mode))
    }
}

/// Attributes that are read.
pub const POSITION: &str = "POSITION";
pub const COLOR: &str = "COLOR_0";
pub const UV: &str = "TEXCOORD_0";
pub const JOINTS: &str = "JOINTS_0";
pub const WEIGHTS: &str = "WEIGHTS_0";

impl Document {
    /// Whether lines in any mesh need each buffer.
    pub fn needed(&self) -> Vec<bool> {
        let read = [POSITION, COLOR, UV, JOINTS, WEIGHTS];
        let lines = self.meshes.iter().flat_map(|m| &m.primitives).filter(|p| p.lines().is_some());
        let accessors = lines.flat_map(|p| {
            read.iter().filter_map(|name| p.attributes.get(*name)).chain(&p.indices).copied()
        });
        let skins = self.nodes.iter().filter(|node| node.mesh.is_some()).filter_map(|n| n.skin);
        let skins = skins.filter_map(|skin| self.skins.get(skin)?.inverse_bind_matrices);
        let mut needed = vec![false; self.buffers.len()];
        for accessor in accessors.chain(skins) {
            let view = self.accessors.get(accessor).and_then(|accessor| accessor.buffer_view);
            let view = view.and_then(|view| self.buffer_views.get(view));
            if let Some(needed) = view.and_then(|view| needed.get_mut(view.buffer)) {
                *needed = true;
            }
        }
        needed
    }
}
