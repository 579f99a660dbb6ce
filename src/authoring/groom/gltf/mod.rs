//! Strands from glTF and GLB files: primitives of lines, such as Blender exports from hair curves
//! that were turned into the edges of a mesh.
//!
//! `LINE_STRIP` is a strand; `LINE_LOOP` is one, opened at its first node; `LINES` are joined to
//! strands where they share a node, and branches become strands of their own. The root is the end
//! that comes first in the file. `POSITION`, `COLOR_0` and `TEXCOORD_0` (of the root) are read, and
//! nodes' transforms applied. Primitives that are no lines are counted and skipped.

mod accessor;
mod chain;
mod container;
mod error;

use super::{Groom, GroomError, GroomFileError, GroomLosses};
use ::gltf::json::{
    Index, Root,
    accessor::Accessor,
    mesh::{Mode, Primitive, Semantic},
    scene::Node,
    validation::Checked,
};
use accessor::{Buffers, Vectors};
use bevy::{platform::collections::HashMap, prelude::*};
use chain::Chains;
use error::{missing, wrong};

pub(super) use container::looks_like_json;

/// A glTF or GLB file whose JSON has been read.
#[derive(Clone, Debug)]
pub struct GltfFile<'a> {
    root: Root,
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
        let (root, bin) = container::split(file)?;
        Ok(Self { root, bin, size: file.len() })
    }

    /// The URIs of buffers that are files of their own, relative to this one, percent-encoded as in
    /// the file.
    pub fn external(&self) -> impl Iterator<Item = &str> {
        let uris = self.root.buffers.iter().filter_map(|b| b.uri.as_deref());
        uris.filter(|uri| !uri.starts_with(accessor::DATA))
    }

    /// The groom, in the file's own unit and axes (metres and Y up as glTF has it), and what was left
    /// out. `external` has the contents of the files that [`external`](Self::external) names.
    ///
    /// # Errors
    /// When there are no lines, a reference is invalid, a number is not finite, or copies would
    /// take more memory than the file justifies.
    pub fn read(
        &self,
        external: &HashMap<String, Vec<u8>>,
    ) -> Result<(Groom, GroomLosses), GroomFileError> {
        let buffers = Buffers::new(&self.root, self.bin, external)?;
        let mut reading = Reading {
            root: &self.root,
            limit: self.size + buffers.size(),
            buffers: &buffers,
            groom: Groom::default(),
            losses: GroomLosses::default(),
        };
        for (node, place) in placed_nodes(&self.root)? {
            let Some(mesh) = &node.mesh else {
                continue;
            };
            let mesh_path = format!("meshes[{}]", mesh.value());
            let Some(found) = self.root.meshes.get(mesh.value()) else {
                return missing(&mesh_path);
            };
            for (k, primitive) in found.primitives.iter().enumerate() {
                reading.primitive(primitive, &format!("{mesh_path}.primitives[{k}]"), place)?;
            }
        }
        let Reading { groom, losses, .. } = reading;
        if groom.is_empty() {
            return wrong("meshes", "no lines", "primitives of mode 1, 2 or 3", LINES_HINT);
        }
        Ok((groom.checked()?, losses))
    }
}

const LINES_HINT: &str = "in Blender convert the curves to a mesh, and export loose edges";

/// All nodes of the scene with their transforms to it, parents first.
fn placed_nodes(root: &Root) -> Result<Vec<(&Node, Mat4)>, GroomFileError> {
    let mut parent = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        if let Some(has) = parent.get_mut(child.value()) {
            *has = true;
        }
    }
    let scene = root.scene.map_or(0, |scene| scene.value());
    let mut open: Vec<(usize, Mat4)> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(|n| (n.value(), Mat4::IDENTITY)).collect(),
        None => (0..parent.len()).filter(|i| !parent[*i]).map(|i| (i, Mat4::IDENTITY)).collect(),
    };
    open.reverse();
    let mut seen = vec![false; root.nodes.len()];
    let mut placed = Vec::new();
    while let Some((index, above)) = open.pop() {
        let path = format!("nodes[{index}]");
        let (Some(node), Some(seen)) = (root.nodes.get(index), seen.get_mut(index)) else {
            return missing(&path);
        };
        if core::mem::replace(seen, true) {
            let hint = "export the file again";
            return wrong(&path, "a node with two parents", "a tree of nodes", hint);
        }
        let place = above * local(node);
        placed.push((node, place));
        let children = node.children.iter().flatten().rev();
        open.extend(children.map(|child| (child.value(), place)));
    }
    Ok(placed)
}

fn local(node: &Node) -> Mat4 {
    match &node.matrix {
        Some(matrix) => Mat4::from_cols_array(matrix),
        None => Mat4::from_scale_rotation_translation(
            node.scale.map_or(Vec3::ONE, Vec3::from),
            // Unit length is not required here; non-finite values show in the positions.
            node.rotation.as_ref().map_or(Quat::IDENTITY, |q| Quat::from_array(q.0)),
            node.translation.map_or(Vec3::ZERO, Vec3::from),
        ),
    }
}

struct Reading<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    /// How many nodes the groom may have: as many as there are bytes.
    limit: usize,
    groom: Groom,
    losses: GroomLosses,
}

impl Reading<'_> {
    fn primitive(
        &mut self,
        primitive: &Primitive,
        path: &str,
        place: Mat4,
    ) -> Result<(), GroomFileError> {
        let Checked::Valid(mode @ (Mode::Lines | Mode::LineLoop | Mode::LineStrip)) =
            primitive.mode
        else {
            self.losses.skipped_primitives += 1;
            return Ok(());
        };
        let buffers = self.buffers;
        let accessor = |index: &Index<Accessor>| (self.root, index.value());
        let attribute = |semantic| primitive.attributes.get(&Checked::Valid(semantic));
        let Some(positions) = attribute(Semantic::Positions) else {
            let hint = "export the file again";
            return wrong(path, "no POSITION", "an accessor of positions", hint);
        };
        let positions = buffers.elements(accessor(positions))?;
        let count = positions.count();
        let of_each = |index: Option<&Index<Accessor>>| {
            let elements = index.map(|i| buffers.elements(accessor(i))).transpose()?;
            match elements {
                Some(e) if e.count() != count => {
                    let found = format!("{} elements", e.count());
                    let expected = format!("{count}, as many as positions");
                    wrong(path, found, expected, "export the file again")
                }
                elements => Ok(elements),
            }
        };
        let colours = of_each(attribute(Semantic::Colors(0)))?;
        let uvs = of_each(attribute(Semantic::TexCoords(0)))?;
        let indices =
            primitive.indices.as_ref().map(|i| buffers.elements(accessor(i))).transpose()?;
        let order_count = indices.as_ref().map_or(count, |i| i.count());
        // Checked before allocation. No mode makes more nodes than it has indices.
        if self.groom.points.len().saturating_add(order_count) > self.limit {
            let expected = "copies that the file's size justifies";
            let found = "many more nodes than the file has bytes";
            return wrong(path, found, expected, "apply instances before the export");
        }
        let positions = positions.vectors::<3>()?;
        let order = indices.as_ref().map(|i| i.indices(count)).transpose()?;
        let chains = match (mode, order) {
            (Mode::Lines, None) => Chains::of_pairs(count as u32, |i| positions.get(i))?,
            (Mode::Lines, Some(order)) => Chains::of_edges(&order),
            (_, None) => Chains::of_strip((0..count as u32).collect(), mode == Mode::LineLoop),
            (_, Some(order)) => Chains::of_strip(order, mode == Mode::LineLoop),
        };
        self.losses.opened_loops += chains.loops;
        self.losses.split_branches += chains.branches;
        self.losses.merged_nodes += chains.repeated;
        let colours = colours.as_ref().map(|c| c.vectors::<4>()).transpose()?;
        let uvs = uvs.as_ref().map(|c| c.vectors::<2>()).transpose()?;
        self.add(&chains, &positions, colours, uvs, place)
    }

    fn add(
        &mut self,
        chains: &Chains,
        positions: &Vectors<'_, 3>,
        colours: Option<Vectors<'_, 4>>,
        uvs: Option<Vectors<'_, 2>>,
        place: Mat4,
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
            let [Some(&root), Some(_)] = [chain.first(), chain.get(1)] else {
                self.losses.short_strands += 1;
                continue;
            };
            for &i in chain {
                let point = Vec3::from_array(positions.get(i)?);
                groom.points.push(place.transform_point3(point));
                if let Some(colours) = &colours {
                    groom.colors.push(LinearRgba::from_f32_array(colours.get(i)?));
                } else if had_colours {
                    groom.colors.push(LinearRgba::WHITE);
                }
            }
            if let Some(uvs) = &uvs {
                groom.uvs.push(Vec2::from_array(uvs.get(root)?));
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
