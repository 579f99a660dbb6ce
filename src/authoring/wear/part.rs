//! Meshes of a character, with their skins.

use super::error::WearError;
use crate::authoring::plant::PlantError;
use bevy::{
    asset::RenderAssetUsages,
    math::{Affine3A, Vec3A},
    mesh::{PrimitiveTopology, VertexAttributeValues as Values},
    prelude::*,
};

/// Smallest weight of the head joint at a vertex that counts as the head, not the neck.
pub(super) const HEAD_WEIGHT: f32 = 0.5;

/// What a bone shows about where its character looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Cue {
    #[default]
    None,
    Eye,
    Face,
    Toe,
    Foot,
    Hand,
}

impl Cue {
    /// That of a bone of this name.
    pub(super) fn of(name: &str, is_of_head: bool) -> Self {
        let name = name.to_ascii_lowercase();
        let says = |words: &[&str]| words.iter().any(|word| name.contains(word));
        match is_of_head {
            true if says(&["brow", "lash", "lid"]) => Self::Face,
            true if says(&["eye"]) => Self::Eye,
            true if says(&["jaw", "nose", "mouth", "teeth", "tongue", "lip", "chin", "cheek"]) => {
                Self::Face
            }
            true => Self::None,
            // Handles of animators are no part of the body.
            false if says(&["hand", "wrist", "finger", "slot", "weapon"]) => Self::Hand,
            false if says(&["ik", "control", "ctrl", "roll", "pole", "target"]) => Self::None,
            false if says(&["toe"]) => Self::Toe,
            false if says(&["foot", "ankle"]) => Self::Foot,
            false => Self::None,
        }
    }
}

/// The joints of a mesh.
pub(super) struct MeshSkin {
    pub(super) joints: Vec<Entity>,
    /// Inverse bind poses.
    pub(super) poses: Vec<Affine3A>,
    /// Which joint is the head; `None` where none is known to be.
    pub(super) head: Option<usize>,
    /// Which joints are the head or below it.
    pub(super) of_head: Vec<bool>,
    /// What their names show.
    pub(super) cues: Vec<Cue>,
}

/// A mesh on which hair may grow.
pub(super) struct MeshPart {
    pub(super) entity: Entity,
    pub(super) name: String,
    /// Whether it is drawn, unless the character as a whole is not.
    pub(super) is_shown: bool,
    /// Whether hair may grow on it; without [`WearHair::mesh`] that is found.
    pub(super) is_named: bool,
    /// Its positions, normals, triangles and skin.
    pub(super) mesh: Mesh,
    pub(super) mesh_id: AssetId<Mesh>,
    pub(super) skin: Option<MeshSkin>,
    /// From the mesh, as it is bound, to the wearer.
    pub(super) to_wearer: Affine3A,
}

/// Copies the attributes of a mesh that planting, ties and fits need.
pub(super) fn skin_of(mesh: &Mesh) -> Result<Mesh, WearError> {
    let extracted = |_| PlantError::Extracted;
    let mut copy = Mesh::new(mesh.primitive_topology(), RenderAssetUsages::default());
    for which in [
        Mesh::ATTRIBUTE_POSITION,
        Mesh::ATTRIBUTE_NORMAL,
        Mesh::ATTRIBUTE_JOINT_INDEX,
        Mesh::ATTRIBUTE_JOINT_WEIGHT,
    ] {
        if let Some(values) = mesh.try_attribute_option(which).map_err(extracted)? {
            copy.insert_attribute(which, values.clone());
        }
    }
    if let Some(indices) = mesh.try_indices_option().map_err(extracted)? {
        copy.insert_indices(indices.clone());
    }
    Ok(copy)
}

pub(super) fn positions(mesh: &Mesh) -> &[[f32; 3]] {
    match mesh.attribute(Mesh::ATTRIBUTE_POSITION) {
        Some(Values::Float32x3(positions)) => positions,
        _ => &[],
    }
}

/// The head's skinning weight at each vertex; 1 for a mesh without a skin. Where no joint is known
/// to be the head, it is the one with the largest weight at the highest vertex.
pub(super) fn head_shares(part: &mut MeshPart, up: Vec3) -> Result<Vec<f32>, WearError> {
    let places = positions(&part.mesh);
    let Some(skin) = &mut part.skin else { return Ok(vec![1.0; places.len()]) };
    let (Some(Values::Uint16x4(joints)), Some(Values::Float32x4(weights))) = (
        part.mesh.attribute(Mesh::ATTRIBUTE_JOINT_INDEX),
        part.mesh.attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT),
    ) else {
        return Ok(vec![1.0; places.len()]);
    };
    let known = skin.joints.len().min(skin.poses.len());
    // Slots without weight are not used, whatever joint they name.
    let slots = joints.iter().flatten().zip(weights.iter().flatten());
    let used = slots.filter(|(_, weight)| **weight != 0.0).map(|(joint, _)| usize::from(*joint));
    let found = used.max().unwrap_or(0);
    if found >= known {
        let (joints, poses) = (skin.joints.len(), skin.poses.len());
        return Err(WearError::Joints { joints, poses, found });
    }
    if skin.head.is_none() {
        let height = |p: &[f32; 3]| part.to_wearer.transform_point3(Vec3::from_array(*p)).dot(up);
        let highest = (0..places.len().min(joints.len()).min(weights.len()))
            .max_by(|a, b| height(&places[*a]).total_cmp(&height(&places[*b])));
        if let Some(v) = highest {
            let most = (0..4).max_by(|a, b| weights[v][*a].total_cmp(&weights[v][*b]));
            let head = usize::from(joints[v][most.unwrap_or(0)]);
            // A vertex without weights may name any joint.
            if let Some(of_head) = skin.of_head.get_mut(head).filter(|_| head < known) {
                *of_head = true;
                skin.head = Some(head);
            }
        }
    }
    let share = |(joints, weights): (&[u16; 4], &[f32; 4])| {
        let all: f32 = weights.iter().sum();
        let is_of_head = |j: u16| skin.of_head.get(usize::from(j)) == Some(&true);
        let own = joints.iter().zip(weights).filter(|(j, _)| is_of_head(**j));
        own.map(|(_, weight)| weight).sum::<f32>() / all.max(1e-6)
    };
    let mut shares: Vec<f32> = joints.iter().zip(weights).map(share).collect();
    shares.resize(places.len(), 0.0);
    Ok(shares)
}

/// The corners of the triangles that are of the head, in the mesh's own space.
pub(super) fn head_triangles<'a>(
    mesh: &'a Mesh,
    shares: &'a [f32],
) -> impl Iterator<Item = [Vec3; 3]> + 'a {
    let places = positions(mesh);
    let corner = |v: usize| places.get(v).map(|p| Vec3::from_array(*p));
    triangles(mesh).filter_map(move |triangle| {
        let of_head = triangle.iter().all(|v| shares.get(*v).is_some_and(|s| *s > 0.5));
        let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { return None };
        of_head.then_some([a, b, c])
    })
}

impl MeshPart {
    /// Where a joint is when the mesh is bound, in the wearer's space.
    pub(super) fn bound_joint(&self, joint: usize) -> Vec3 {
        let pose = self.skin.as_ref().and_then(|skin| skin.poses.get(joint));
        let place = pose.map_or(Vec3A::NAN, |pose| pose.inverse().translation);
        self.to_wearer.transform_point3a(place).into()
    }

    /// The area of the triangles that are of the head, in the mesh's own unit squared.
    pub(super) fn head_area(&self, shares: &[f32]) -> f32 {
        let area = |[a, b, c]: [Vec3; 3]| 0.5 * (b - a).cross(c - a).length();
        head_triangles(&self.mesh, shares).map(area).filter(|area| area.is_finite()).sum()
    }

    /// For each vertex the joint that moves most of it; `None` where none is named, as on a part that one moves.
    pub(super) fn joints_of_vertices(&self) -> Option<Vec<usize>> {
        let (Some(Values::Uint16x4(joints)), Some(Values::Float32x4(weights))) = (
            self.mesh.attribute(Mesh::ATTRIBUTE_JOINT_INDEX),
            self.mesh.attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT),
        ) else {
            return None;
        };
        let most = |w: &[f32; 4]| (0..4).fold(0, |most, k| if w[k] > w[most] { k } else { most });
        Some(joints.iter().zip(weights).map(|(j, w)| usize::from(j[most(w)])).collect())
    }

    /// The vertices that a joint moves for the greater part, in the wearer's space.
    pub(super) fn moved_by(&self, joint: usize) -> impl Iterator<Item = Vec3> + '_ {
        let skin = match (
            self.mesh.attribute(Mesh::ATTRIBUTE_JOINT_INDEX),
            self.mesh.attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT),
        ) {
            (Some(Values::Uint16x4(joints)), Some(Values::Float32x4(weights))) => {
                joints.iter().zip(weights)
            }
            _ => [].iter().zip(&[]),
        };
        let is_moved = move |(joints, weights): (&[u16; 4], &[f32; 4])| {
            let own = joints.iter().zip(weights).filter(|(j, _)| usize::from(**j) == joint);
            own.map(|(_, weight)| weight).sum::<f32>() >= 0.5
        };
        let moved = positions(&self.mesh).iter().zip(skin).filter(move |(_, of)| is_moved(*of));
        moved.map(|(p, _)| self.to_wearer.transform_point3(Vec3::from_array(*p)))
    }
}

/// The vertices of each triangle; the winding of strips is ignored.
pub(super) fn triangles(mesh: &Mesh) -> impl Iterator<Item = [usize; 3]> {
    let step = if mesh.primitive_topology() == PrimitiveTopology::TriangleStrip { 1 } else { 3 };
    let indices: Vec<usize> = match mesh.indices() {
        Some(indices) => indices.iter().collect(),
        None => (0..mesh.count_vertices()).collect(),
    };
    let starts = (0..indices.len().saturating_sub(2)).step_by(step);
    starts.map(move |i| [indices[i], indices[i + 1], indices[i + 2]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bones_tell_by_their_names() {
        for (name, is_of_head, cue) in [
            ("eye.L", true, Cue::Eye),
            ("J_Adj_R_FaceEye", true, Cue::Eye),
            ("eyebrow_r", true, Cue::Face),
            ("jaw", true, Cue::Face),
            ("eye", false, Cue::None),
            ("mixamorig:LeftToeBase", false, Cue::Toe),
            ("toes.l", false, Cue::Toe),
            ("foot.L", false, Cue::Foot),
            ("IK-toe.l", false, Cue::None),
            ("control-foot-roll.r", false, Cue::None),
            ("Head", true, Cue::None),
        ] {
            assert_eq!(Cue::of(name, is_of_head), cue, "{name}");
        }
    }
}
