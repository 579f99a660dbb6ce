//! Strands from glTF and GLB files: primitives of lines, such as Blender exports from hair curves
//! that were turned into the edges of a mesh.
//!
//! `LINE_STRIP` is a strand; `LINE_LOOP` is one, opened at its first node; `LINES` are joined to
//! strands where they share a node, or where one ends at the very place where another begins, and branches
//! become strands of their own. The root is the end that comes first in the file. `POSITION`, `COLOR_0` and
//! `TEXCOORD_0` (of the root) are read, and nodes' transforms applied, or on skinned lines those of the
//! joints, as glTF says. Primitives that are no lines are counted and skipped; colours and UVs that cannot be
//! read are counted and left out.
//!
//! Only what lines need is looked at: other buffers may be missing or compressed, materials and animations
//! broken.

mod accessor;
mod chain;
mod container;
mod document;
mod error;
mod skin;

use super::{Groom, GroomError, GroomFileError, GroomLosses, intake::Intake, losses::GroomPlace};
use accessor::{Buffers, Elements, Vectors};
use bevy::{platform::collections::HashMap, prelude::*};
use document::{COLOR, Document, Node, POSITION, Primitive, UV, compression};
use error::{missing, wrong};
use skin::{Bones, Place};

pub(super) use chain::Chains;
pub(super) use container::looks_like_json;

/// A glTF or GLB file whose JSON has been read.
#[derive(Clone, Debug)]
pub struct GltfFile<'a> {
    document: Document,
    bin: Option<&'a [u8]>,
    size: usize,
}

/// A groom from a file that holds all its buffers, see [`GltfFile::read`].
///
/// # Errors
/// As there, and when a buffer is a file of its own.
pub fn read(file: &[u8]) -> Result<(Groom, GroomLosses), GroomFileError> {
    GltfFile::parse(file)?.read(&HashMap::default())
}

impl<'a> GltfFile<'a> {
    /// Reads the JSON of a glTF or GLB file.
    ///
    /// # Errors
    /// When the container or the JSON is broken, or it is not glTF 2.
    pub fn parse(file: &'a [u8]) -> Result<Self, GroomFileError> {
        let (document, bin) = container::split(file)?;
        Ok(Self { document, bin, size: file.len() })
    }

    /// The URIs of buffers that lines need and that are files of their own, relative to this one,
    /// percent-encoded as in the file.
    pub fn external(&self) -> Vec<String> {
        let buffers = self.document.buffers.iter().zip(self.document.needed());
        let uris = buffers.filter_map(|(buffer, needed)| buffer.uri.clone().filter(|_| needed));
        uris.filter(|uri| !uri.starts_with(accessor::DATA)).collect()
    }

    /// The groom, in the file's own unit and axes (metres and Y up as glTF has it), and what was left
    /// out. `external` has the contents of the files that [`external`](Self::external) names.
    ///
    /// # Errors
    /// When there are no lines, a reference of theirs is invalid, or copies would take more memory than the
    /// file justifies.
    pub fn read(
        &self,
        external: &HashMap<String, Vec<u8>>,
    ) -> Result<(Groom, GroomLosses), GroomFileError> {
        self.intake(external).map(|intake| (intake.groom, intake.losses))
    }

    pub(super) fn intake(
        &self,
        external: &HashMap<String, Vec<u8>>,
    ) -> Result<Intake, GroomFileError> {
        let document = &self.document;
        let buffers = Buffers::new(document, self.bin, external);
        let placed = placed_nodes(document)?;
        let bones = Bones::new(document, &buffers, &placed);
        let mut reading = Reading {
            document,
            limit: self.size + buffers.size(),
            buffers: &buffers,
            bones: &bones,
            groom: Groom::default(),
            losses: GroomLosses::default(),
        };
        for &(index, place) in &placed {
            let node = &document.nodes[index];
            let Some(mesh) = node.mesh else {
                continue;
            };
            let mesh_path = format!("meshes[{mesh}]");
            let Some(found) = document.meshes.get(mesh) else {
                return missing(&mesh_path);
            };
            for (k, primitive) in found.primitives.iter().enumerate() {
                let path = format!("{mesh_path}.primitives[{k}]");
                reading.primitive(primitive, &path, (node, place))?;
            }
        }
        let Reading { groom, losses, .. } = reading;
        if groom.is_empty() {
            return wrong("meshes", "no lines", "primitives of mode 1, 2 or 3", LINES_HINT);
        }
        Ok(Intake::cleaned(groom, losses)?)
    }
}

const LINES_HINT: &str = "in Blender convert the curves to a mesh, and export loose edges";

/// All nodes of the scene by their indices, with their transforms to it, parents first.
fn placed_nodes(document: &Document) -> Result<Vec<(usize, Mat4)>, GroomFileError> {
    let nodes = &document.nodes;
    let mut parent = vec![false; nodes.len()];
    for child in nodes.iter().flat_map(|n| &n.children) {
        if let Some(has) = parent.get_mut(*child) {
            *has = true;
        }
    }
    let mut open: Vec<(usize, Mat4)> = match document.scenes.get(document.scene.unwrap_or(0)) {
        Some(scene) => scene.nodes.iter().map(|n| (*n, Mat4::IDENTITY)).collect(),
        None => (0..parent.len()).filter(|i| !parent[*i]).map(|i| (i, Mat4::IDENTITY)).collect(),
    };
    open.reverse();
    let mut seen = vec![false; nodes.len()];
    let mut placed = Vec::new();
    while let Some((index, above)) = open.pop() {
        let path = format!("nodes[{index}]");
        let (Some(node), Some(seen)) = (nodes.get(index), seen.get_mut(index)) else {
            return missing(&path);
        };
        if core::mem::replace(seen, true) {
            let hint = "export the file again";
            return wrong(&path, "a node with two parents", "a tree of nodes", hint);
        }
        let place = above * local(node);
        placed.push((index, place));
        open.extend(node.children.iter().rev().map(|child| (*child, place)));
    }
    Ok(placed)
}

fn local(node: &Node) -> Mat4 {
    match &node.matrix {
        Some(matrix) => Mat4::from_cols_array(matrix),
        None => Mat4::from_scale_rotation_translation(
            node.scale.map_or(Vec3::ONE, Vec3::from),
            // Unit length is not required here; non-finite values show in the positions.
            node.rotation.map_or(Quat::IDENTITY, Quat::from_array),
            node.translation.map_or(Vec3::ZERO, Vec3::from),
        ),
    }
}

struct Reading<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    bones: &'a Bones,
    /// How many nodes the groom may have: as many as there are bytes.
    limit: usize,
    groom: Groom,
    losses: GroomLosses,
}

impl<'a> Reading<'a> {
    fn primitive(
        &mut self,
        primitive: &Primitive,
        path: &str,
        (node, place): (&Node, Mat4),
    ) -> Result<(), GroomFileError> {
        let Some(mode) = primitive.lines() else {
            self.losses.skipped_primitives.add(GroomPlace::Part(path.to_owned()));
            return Ok(());
        };
        let Some(&positions) = primitive.attributes.get(POSITION) else {
            let hint = "export the file again";
            return wrong(path, "no POSITION", "an accessor of positions", hint);
        };
        if let Some(name) = compression(&primitive.extensions) {
            let hint = "export without compression";
            return wrong(path, name, "numbers as they are", hint);
        }
        let positions = self.buffers.elements((self.document, positions))?;
        let count = positions.count();
        let indices = primitive.indices.map(|i| self.buffers.elements((self.document, i)));
        let indices = indices.transpose()?;
        let order_count = indices.as_ref().map_or(count, |i| i.count());
        // Checked before allocation. No mode makes more nodes than it has indices.
        if self.groom.points.len().saturating_add(order_count) > self.limit {
            let expected = "copies that the file's size justifies";
            let found = "many more nodes than the file has bytes";
            return wrong(path, found, expected, "apply instances before the export");
        }
        let positions = positions.vectors::<3>()?;
        let order = match indices {
            Some(indices) => indices.indices(count)?,
            None => (0..count as u32).collect(),
        };
        let chains = match mode {
            Primitive::LINES => Chains::of_edges(&order).joined(|i| positions.get(i)),
            _ => Chains::of_strip(order, mode == Primitive::LINE_LOOP),
        };
        let losses = &mut self.losses;
        for (loss, found) in [
            (&mut losses.opened_loops, chains.loops),
            (&mut losses.split_branches, chains.branches),
            (&mut losses.merged_nodes, chains.repeated),
        ] {
            if found > 0 {
                loss.add_many(found, GroomPlace::Part(path.to_owned()));
            }
        }
        let colours = self.optional(primitive, (path, COLOR, count), Elements::vectors::<4>);
        let uvs = self.optional(primitive, (path, UV, count), Elements::vectors::<2>);
        let place = match node.skin {
            None => Place::Node(place),
            Some(skin) => {
                let joints = (path, document::JOINTS, count);
                let joints = self.optional(primitive, joints, Elements::integers::<4>);
                let weights = (path, document::WEIGHTS, count);
                let weights = self.optional(primitive, weights, Elements::vectors::<4>);
                self.bones.place(skin, joints.zip(weights))
            }
        };
        self.add(&chains, &positions, colours, uvs, place)
    }

    /// An attribute that lines can do without: `None`, and counted, if it cannot be read.
    fn optional<const N: usize>(
        &mut self,
        primitive: &Primitive,
        (path, name, count): (&str, &str, usize),
        vectors: fn(Elements<'a>) -> Result<Vectors<'a, N>, GroomFileError>,
    ) -> Option<Vectors<'a, N>> {
        let index = *primitive.attributes.get(name)?;
        let elements =
            self.buffers.elements((self.document, index)).and_then(|e| match e.count() {
                fits if fits == count => Ok(e),
                found => {
                    let expected = format!("{count}, as many as positions");
                    wrong(name, format!("{found} elements"), expected, "export the file again")
                }
            });
        let (loss, error) = match elements.map(vectors) {
            Ok(Ok(vectors)) => return Some(vectors),
            Ok(Err(error)) => (&mut self.losses.unread_arrays, error),
            Err(error) => (&mut self.losses.broken_arrays, error),
        };
        loss.add(GroomPlace::Part(format!("{path}.{name}: {error}")));
        None
    }

    fn add(
        &mut self,
        chains: &Chains,
        positions: &Vectors<'_, 3>,
        colours: Option<Vectors<'_, 4>>,
        uvs: Option<Vectors<'_, 2>>,
        place: Place<'_>,
    ) -> Result<(), GroomFileError> {
        let groom = &mut self.groom;
        // Some primitives may have colours or UVs while others have none.
        if colours.is_some() {
            groom.colors.resize(groom.points.len(), LinearRgba::WHITE);
        }
        if uvs.is_some() {
            groom.uvs.resize(groom.ends.len(), Vec2::ZERO);
        }
        let (had_colours, had_uvs) = (!groom.colors.is_empty(), !groom.uvs.is_empty());
        for chain in chains.iter() {
            let Some(&root) = chain.first() else {
                continue;
            };
            for &i in chain {
                groom.points.push(place.of(i, Vec3::from_array(positions.get(i))));
                if let Some(colours) = &colours {
                    groom.colors.push(LinearRgba::from_f32_array(colours.get(i)));
                } else if had_colours {
                    groom.colors.push(LinearRgba::WHITE);
                }
            }
            if let Some(uvs) = &uvs {
                groom.uvs.push(Vec2::from_array(uvs.get(root)));
            } else if had_uvs {
                groom.uvs.push(Vec2::ZERO);
            }
            let found = groom.points.len();
            let end = u32::try_from(found).map_err(|_| GroomError::TooMany { found })?;
            groom.ends.push(end);
        }
        Ok(())
    }
}
