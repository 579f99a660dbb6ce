//! Where skinned lines are: glTF says that their joints place them, and their node does not.

use super::{
    accessor::{Buffers, Vectors},
    document::{Document, Skin},
};
use bevy::prelude::*;

/// The skins of a file as it stands, for each joint the matrix that takes nodes to the scene.
pub struct Bones {
    skins: Vec<Vec<Mat4>>,
}

impl Bones {
    pub fn new(document: &Document, buffers: &Buffers<'_>, placed: &[(usize, Mat4)]) -> Self {
        let mut world = vec![None; document.nodes.len()];
        placed.iter().for_each(|(node, place)| world[*node] = Some(*place));
        let used: Vec<usize> = document.nodes.iter().filter_map(|node| node.skin).collect();
        let one = |(i, skin): (usize, &Skin)| {
            if !used.contains(&i) {
                return Vec::new();
            }
            let binds = skin.inverse_bind_matrices.and_then(|index| {
                let elements = buffers.elements((document, index)).ok()?;
                let count = elements.count();
                Some((elements.vectors::<16>().ok()?, count))
            });
            let matrix = |(k, joint): (usize, &usize)| {
                let bind = binds.as_ref().filter(|(_, count)| k < *count);
                let bind = bind.map(|(binds, _)| Mat4::from_cols_array(&binds.get(k as u32)));
                let place = world.get(*joint).copied().flatten();
                place.unwrap_or_default() * bind.unwrap_or_default()
            };
            skin.joints.iter().enumerate().map(matrix).collect()
        };
        Self { skins: document.skins.iter().enumerate().map(one).collect() }
    }

    /// Of a primitive with this skin, and its joints and weights.
    pub fn place<'a>(
        &'a self,
        skin: usize,
        weights: Option<(Vectors<'a, 4>, Vectors<'a, 4>)>,
    ) -> Place<'a> {
        match (self.skins.get(skin), weights) {
            (Some(bones), Some((joints, weights))) => Place::Skin { bones, joints, weights },
            _ => Place::Node(Mat4::IDENTITY),
        }
    }
}

/// What places lines in the scene.
pub enum Place<'a> {
    /// Their node's transform.
    Node(Mat4),
    /// Their skin.
    Skin {
        /// A matrix for each joint.
        bones: &'a [Mat4],
        /// Four joints of each node …
        joints: Vectors<'a, 4>,
        /// … and how much of each.
        weights: Vectors<'a, 4>,
    },
}

impl Place<'_> {
    /// Where node `i`, which is at `point`, is in the scene.
    pub fn of(&self, i: u32, point: Vec3) -> Vec3 {
        let (bones, joints, weights) = match self {
            Self::Node(place) => return place.transform_point3(point),
            Self::Skin { bones, joints, weights } => (bones, joints.get(i), weights.get(i)),
        };
        let used = joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0);
        let used = used.filter_map(|(joint, weight)| Some((bones.get(joint as usize)?, weight)));
        let (sum, all) = used.fold((Vec3::ZERO, 0.0), |(sum, all), (bone, weight)| {
            (sum + bone.transform_point3(point) * weight, all + weight)
        });
        if all > 0.0 { sum / all } else { point }
    }
}
