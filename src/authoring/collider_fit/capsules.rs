//! Colliders from a character: the capsule for each joint of a skinned mesh.

use super::linear_system::solve;
use crate::{base::setting::InvalidValue, forces::contact::HairCollider};
use bevy::{
    math::{DMat3, DVec3},
    mesh::{Mesh, MeshVertexAttribute, PrimitiveTopology, VertexAttributeValues as Values},
    prelude::*,
};

/// The capsule that comes closest to the part of a skin that one joint moves, in that joint's space.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct JointCapsule {
    /// Centre of one end (m, in the joint's space).
    pub from: Vec3,
    /// Centre of the other end (m, in the joint's space).
    pub to: Vec3,
    /// Its radius (m).
    pub radius: f32,
    /// Root-mean-square distance of the skin from the capsule (m): a millimetre or two for a round limb;
    /// at two centimetres place several colliders by hand.
    pub deviation: f32,
}

impl JointCapsule {
    /// The collider and its transform in the joint's space, to be spawned with `ChildOf(joint)`.
    ///
    /// # Errors
    /// When the radius is not valid for a collider, as may be in a capsule made by hand.
    pub fn collider(&self) -> Result<(HairCollider, Transform), InvalidValue> {
        let way = self.to - self.from;
        let turn = Quat::from_rotation_arc(Vec3::Y, way.normalize_or(Vec3::Y));
        let place = Transform::from_translation((self.from + self.to) * 0.5).with_rotation(turn);
        Ok((HairCollider::capsule(self.radius, way.length())?, place))
    }
}

/// Why capsules cannot be fitted to a mesh.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub enum FitError {
    /// An attribute that is missing, of another format, or only on the graphics device.
    #[error(
        "the mesh has no {what} in the main world, expected a skinned mesh: load it with \
         RenderAssetUsages::MAIN_WORLD, and give a mesh without a skin its colliders by hand"
    )]
    NoAttribute {
        /// Which.
        what: &'static str,
    },
    /// An attribute with another number of elements than there are vertices.
    #[error(
        "{what} has {found} elements, expected {expected}, one for each vertex: repair the mesh"
    )]
    Length {
        /// Which.
        what: &'static str,
        /// How many it has.
        found: usize,
        /// How many vertices there are.
        expected: usize,
    },
    /// A vertex that refers to a joint that does not exist.
    #[error(
        "vertex {vertex} is moved by joint {joint}, expected one of {joints}: give the inverse bind \
         poses of this mesh's own skin"
    )]
    UnknownJoint {
        /// The vertex.
        vertex: usize,
        /// Its joint.
        joint: u16,
        /// How many joints there are.
        joints: usize,
    },
    /// A triangle that refers to a vertex that does not exist.
    #[error("a triangle names vertex {vertex}, expected less than {vertices}: repair the indices")]
    UnknownVertex {
        /// The vertex.
        vertex: usize,
        /// How many there are.
        vertices: usize,
    },
    /// A number that is not finite.
    #[error("{what} {index} is not finite: repair the mesh or leave the part out")]
    NonFinite {
        /// What is not finite: a position, a joint weight, an inverse bind pose.
        what: &'static str,
        /// Which vertex or joint.
        index: usize,
    },
}

/// A capsule is fitted to a joint that moves at least this many vertices.
const MIN_VERTICES: usize = 8;
/// Steps toward the best capsule; a dozen are enough as a rule.
const STEPS: usize = 40;

/// For each joint of a skinned mesh the capsule that best fits the vertices which it moves more than
/// any other joint does, by least squares over the skin's area. `None` for joints that move fewer
/// than eight vertices, or whose vertices are nearly in one plane.
///
/// `inverse_bindposes` are those of the mesh's `SkinnedMesh`, in the order of its joints; capsules
/// have the unit of the joints' space (usually m). The skin lies partly outside, partly inside, as
/// colliders for hair should: hair that grows inside one is pushed out of it.
///
/// ```
/// # use bevy::{mesh::skinning::*, prelude::*}; use bevy_keratin::{authoring::collider_fit::*, prelude::*};
/// fn solid(
///     mut commands: Commands,
///     meshes: Res<Assets<Mesh>>,
///     poses: Res<Assets<SkinnedMeshInverseBindposes>>,
///     bodies: Query<(&Mesh3d, &SkinnedMesh), Added<SkinnedMesh>>,
/// ) -> Result {
///     for (mesh, skin) in &bodies {
///         let (Some(mesh), Some(poses)) = (meshes.get(mesh), poses.get(&skin.inverse_bindposes)) else {
///             continue;
///         };
///         for (joint, capsule) in skin.joints.iter().zip(fit_joint_capsules(mesh, poses)?) {
///             if let Some(capsule) = capsule {
///                 commands.spawn((capsule.collider()?, ChildOf(*joint)));
///             }
///         }
///     }
///     Ok(())
/// }
/// ```
///
/// # Errors
/// When the mesh has no positions, joint indices or joint weights in the main world, these do not
/// match each other or the inverse bind poses, or a value is not finite.
pub fn fit_joint_capsules(
    mesh: &Mesh,
    inverse_bindposes: &[Mat4],
) -> Result<Vec<Option<JointCapsule>>, FitError> {
    let skin = SkinArrays::of(mesh, inverse_bindposes.len())?;
    if let Some(index) = inverse_bindposes.iter().position(|pose| !pose.is_finite()) {
        return Err(FitError::NonFinite { what: "inverse bind pose", index });
    }
    let areas = areas(mesh, skin.positions)?;
    let mut parts = vec![Vec::new(); inverse_bindposes.len()];
    for (vertex, (indices, weights)) in skin.joints.iter().zip(skin.weights).enumerate() {
        // On ties, the first, so that the same mesh gives the same capsules.
        let most = (0..4).fold(0, |most, k| if weights[k] > weights[most] { k } else { most });
        if weights[most] <= 0.0 || areas[vertex] <= 0.0 {
            continue;
        }
        let joint = usize::from(indices[most]);
        let position = Vec3::from_array(skin.positions[vertex]);
        let place = inverse_bindposes[joint].transform_point3(position);
        parts[joint].push((place.as_dvec3(), areas[vertex] * f64::from(weights[most])));
    }
    Ok(parts.iter().map(|part| fit(part)).collect())
}

/// A mesh's skin, with arrays of equal length.
struct SkinArrays<'a> {
    positions: &'a [[f32; 3]],
    joints: &'a [[u16; 4]],
    weights: &'a [[f32; 4]],
}

impl<'a> SkinArrays<'a> {
    fn of(mesh: &'a Mesh, joint_count: usize) -> Result<Self, FitError> {
        let attribute = |id: MeshVertexAttribute| mesh.try_attribute_option(id).ok().flatten();
        let Some(Values::Float32x3(positions)) = attribute(Mesh::ATTRIBUTE_POSITION) else {
            return Err(FitError::NoAttribute { what: "positions" });
        };
        let Some(Values::Uint16x4(joints)) = attribute(Mesh::ATTRIBUTE_JOINT_INDEX) else {
            return Err(FitError::NoAttribute { what: "joint indices" });
        };
        let Some(Values::Float32x4(weights)) = attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT) else {
            return Err(FitError::NoAttribute { what: "joint weights" });
        };
        let expected = positions.len();
        for (what, found) in [("joint indices", joints.len()), ("joint weights", weights.len())] {
            if found != expected {
                return Err(FitError::Length { what, found, expected });
            }
        }
        let not_finite = |what| move |index| FitError::NonFinite { what, index };
        let bad = positions.iter().position(|p| !Vec3::from_array(*p).is_finite());
        bad.map(not_finite("position")).map_or(Ok(()), Err)?;
        let bad = weights.iter().position(|w| w.iter().any(|w| !w.is_finite()));
        bad.map(not_finite("joint weight")).map_or(Ok(()), Err)?;
        for (vertex, (indices, weights)) in joints.iter().zip(weights).enumerate() {
            let moves = |(&joint, &weight): (&u16, &f32)| {
                (weight > 0.0 && usize::from(joint) >= joint_count).then_some(joint)
            };
            if let Some(joint) = indices.iter().zip(weights).find_map(moves) {
                return Err(FitError::UnknownJoint { vertex, joint, joints: joint_count });
            }
        }
        Ok(Self { positions, joints, weights })
    }
}

/// The surface area of each vertex, equal where there are no triangles: weights, so that finer parts of
/// a mesh do not bias the capsule.
fn areas(mesh: &Mesh, positions: &[[f32; 3]]) -> Result<Vec<f64>, FitError> {
    let vertices = positions.len();
    if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
        return Ok(vec![1.0; vertices]);
    }
    let corners: Vec<usize> = match mesh.try_indices_option() {
        Ok(Some(indices)) => indices.iter().collect(),
        Ok(None) => (0..vertices).collect(),
        Err(_) => return Ok(vec![1.0; vertices]),
    };
    if let Some(&vertex) = corners.iter().find(|v| **v >= vertices) {
        return Err(FitError::UnknownVertex { vertex, vertices });
    }
    let mut areas = vec![0.0; vertices];
    for triangle in corners.as_chunks::<3>().0 {
        let [a, b, c] = triangle.map(|v| Vec3::from_array(positions[v]).as_dvec3());
        let area = (b - a).cross(c - a).length() / 6.0;
        triangle.iter().for_each(|v| areas[*v] += area);
    }
    Ok(areas)
}

#[derive(Clone, Copy)]
struct Capsule {
    ends: [DVec3; 2],
    radius: f64,
}

impl Capsule {
    /// Signed distance of a point from the surface, its gradient, and the parameter of the nearest point
    /// on the axis.
    fn distance(&self, point: DVec3) -> (f64, DVec3, f64) {
        let [a, b] = self.ends;
        let way = b - a;
        let share = (point - a).dot(way) / way.length_squared();
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.5 };
        let off = point - (a + way * share);
        (off.length() - self.radius, off.normalize_or_zero(), share)
    }

    fn error(&self, points: &[(DVec3, f64)]) -> f64 {
        points.iter().map(|(p, weight)| weight * self.distance(*p).0.powi(2)).sum()
    }

    /// A damped Gauss–Newton step; `None` where the system is singular.
    fn step(&self, points: &[(DVec3, f64)], damping: f64) -> Option<Self> {
        let (mut sums, mut rights) = ([[0.0; 7]; 7], [0.0; 7]);
        for &(point, weight) in points {
            let (distance, way, share) = self.distance(point);
            let (a, b) = (way * (share - 1.0), way * -share);
            let row = [a.x, a.y, a.z, b.x, b.y, b.z, -1.0];
            for (k, slope) in row.iter().enumerate() {
                sums[k].iter_mut().zip(row).for_each(|(sum, other)| *sum += weight * slope * other);
                rights[k] -= weight * slope * distance;
            }
        }
        // Ends of an open tube may lie anywhere beyond the skin: damping leaves them where they are.
        let mean = sums[6][6] * 1e-3;
        (0..7).for_each(|k| sums[k][k] += damping * (sums[k][k] + mean));
        let [ax, ay, az, bx, by, bz, radius] = solve(sums, rights, 0.0)?;
        let [a, b] = self.ends;
        let ends = [a + DVec3::new(ax, ay, az), b + DVec3::new(bx, by, bz)];
        Some(Self { ends, radius: self.radius + radius })
    }
}

/// The best of the capsules along the three axes of the points' spread.
fn fit(points: &[(DVec3, f64)]) -> Option<JointCapsule> {
    if points.len() < MIN_VERTICES {
        return None;
    }
    let total: f64 = points.iter().map(|p| p.1).sum();
    let middle = points.iter().map(|(p, weight)| p * weight).sum::<DVec3>() / total;
    let reach = points.iter().map(|(p, _)| p.distance(middle)).fold(0.0, f64::max);
    let axes = principal_axes(points, middle);
    let fits = axes.into_iter().filter_map(|axis| {
        let mut best = along(points, (middle, total), axis);
        let (mut error, mut damping) = (best.error(points), 1e-3);
        for _ in 0..STEPS {
            let next = best.step(points, damping)?;
            let changed = next.error(points);
            if changed < error {
                let done = error - changed < 1e-9 * error;
                (best, error, damping) = (next, changed, damping * 0.3);
                if done {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        let deviation = (error / total).sqrt();
        // A nearly flat patch fits arbitrarily large balls.
        let curved = best.radius > 1e-6 * reach && best.radius < 3.0 * reach;
        (deviation.is_finite() && curved).then_some((best, deviation))
    });
    let (best, deviation) = fits.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let [from, to] = best.ends.map(|end| end.as_vec3());
    Some(JointCapsule { from, to, radius: best.radius as f32, deviation: deviation as f32 })
}

/// The initial guess: a capsule around an axis, as long as the points' extent.
fn along(points: &[(DVec3, f64)], (middle, total): (DVec3, f64), axis: DVec3) -> Capsule {
    let off = |p: DVec3| (p - middle).reject_from_normalized(axis).length();
    let radius = points.iter().map(|(p, weight)| weight * off(*p)).sum::<f64>() / total;
    let heights = points.iter().map(|(p, _)| (p - middle).dot(axis));
    let (low, high) = heights.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
    // Not degenerate: from a point the ends could not separate.
    let half = (0.5 * (high - low) - radius).max(0.05 * radius);
    let centre = middle + axis * (0.5 * (low + high));
    Capsule { ends: [centre - axis * half, centre + axis * half], radius }
}

/// Principal axes of the points, by Jacobi rotations.
pub(super) fn principal_axes(points: &[(DVec3, f64)], middle: DVec3) -> [DVec3; 3] {
    let mut spread = DMat3::ZERO;
    for (point, weight) in points {
        let p = *point - middle;
        spread += DMat3::from_cols(p * p.x, p * p.y, p * p.z) * *weight;
    }
    let mut axes = DMat3::IDENTITY;
    for sweep in 0..24 {
        let (i, j) = [(0, 1), (0, 2), (1, 2)][sweep % 3];
        let (off, apart) = (spread.col(j)[i], spread.col(j)[j] - spread.col(i)[i]);
        if off == 0.0 {
            continue;
        }
        let (sine, cosine) = bevy::math::ops::sin_cos((0.5 * f64::atan2(2.0 * off, apart)) as f32);
        let (sine, cosine) = (f64::from(sine), f64::from(cosine));
        let mut turn = DMat3::IDENTITY;
        turn.col_mut(i)[i] = cosine;
        turn.col_mut(j)[j] = cosine;
        turn.col_mut(i)[j] = -sine;
        turn.col_mut(j)[i] = sine;
        spread = turn.transpose() * spread * turn;
        axes *= turn;
    }
    [axes.x_axis, axes.y_axis, axes.z_axis].map(|axis| axis.normalize_or(DVec3::Y))
}
