//! How well hair keeps its length, stays out of the head and on the skin.

use crate::figure::{Body, Skull};
use bevy::{
    mesh::{
        VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};
use bevy_keratin::{authoring::attach::RootsOnMesh, hair::strand::StrandHistory, prelude::*};
use core::fmt;

/// What has been measured up to now.
#[derive(Resource)]
pub struct Measure {
    strain: f32,
    peak_strain: f32,
    /// Of any node but the root from the head (m), negative within: now and at least.
    off_head: f32,
    nearest: f32,
    /// Of any drawn root from the drawn skin (m).
    off_skin: f32,
    /// The mean over all strands, 0…1.
    wetness: f32,
    frames: u32,
}

impl Default for Measure {
    fn default() -> Self {
        Self {
            strain: 0.0,
            peak_strain: 0.0,
            off_head: f32::MAX,
            nearest: f32::MAX,
            off_skin: 0.0,
            wetness: 0.0,
            frames: 0,
        }
    }
}

/// Until hair has settled, nothing is measured (frames).
const SETTLING: u32 = 60;

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "strain {:.1} % now and {:.1} % at most, nodes {:.2} mm off the head now and {:.2} mm at \
             least, roots at most {:.4} mm off the skin, {:.0} % wet",
            100.0 * self.strain,
            100.0 * self.peak_strain,
            1e3 * self.off_head,
            1e3 * self.nearest,
            1e3 * self.off_skin,
            100.0 * self.wetness
        )
    }
}

pub struct MeasurePlugin;

impl Plugin for MeasurePlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Measure>().add_systems(Last, (strands, roots));
    }
}

fn strands(
    mut measure: ResMut<Measure>,
    strands: Query<(&Strand, &Moisture)>,
    skull: Query<&Skull>,
) {
    let off_head = |p: &Vec3| {
        let off = |&Skull(a, b, radius): &Skull| {
            let share = (p - a).dot(b - a) / (b - a).length_squared().max(1e-12);
            p.distance(a.lerp(b, share.clamp(0.0, 1.0))) - radius
        };
        skull.iter().map(off).fold(f32::MAX, f32::min)
    };
    let nodes = strands.iter().flat_map(|(strand, _)| &strand.positions()[1..]);
    measure.off_head = nodes.map(off_head).fold(f32::MAX, f32::min);
    measure.strain = strands.iter().map(|(s, _)| s.peak_strain()).fold(0.0, f32::max);
    let mean = |wetness: &[f32]| wetness.iter().sum::<f32>() / wetness.len().max(1) as f32;
    let sum: f32 = strands.iter().map(|(_, water)| mean(water.wetness())).sum();
    measure.wetness = sum / strands.iter().len().max(1) as f32;
    measure.frames += 1;
    if measure.frames > SETTLING {
        measure.peak_strain = measure.peak_strain.max(measure.strain);
        measure.nearest = measure.nearest.min(measure.off_head);
    }
}

/// Drawn roots against the skin by the definition of skinning.
fn roots(
    mut measure: ResMut<Measure>,
    time: Res<Time<Fixed>>,
    meshes: Res<Assets<Mesh>>,
    poses: Res<Assets<SkinnedMeshInverseBindposes>>,
    places: Query<&GlobalTransform>,
    bodies: Query<(&Mesh3d, &SkinnedMesh), With<Body>>,
    hairs: Query<(&GlobalTransform, &Strands, &RootsOnMesh)>,
    strands: Query<(&Strand, &StrandHistory)>,
) -> Result {
    let Some((mesh, skin)) = bodies.iter().next() else { return Ok(()) };
    let (Some(mesh), Some(poses)) = (meshes.get(&mesh.0), poses.get(&skin.inverse_bindposes))
    else {
        return Ok(());
    };
    let (
        Some(VertexAttributeValues::Float32x3(points)),
        Some(VertexAttributeValues::Uint16x4(joints)),
        Some(VertexAttributeValues::Float32x4(weights)),
    ) = (
        mesh.attribute(Mesh::ATTRIBUTE_POSITION),
        mesh.attribute(Mesh::ATTRIBUTE_JOINT_INDEX),
        mesh.attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT),
    )
    else {
        return Ok(());
    };
    let mut matrices = Vec::new();
    for (joint, inverse) in skin.joints.iter().zip(poses.iter()) {
        matrices.push(places.get(*joint)?.to_matrix() * *inverse);
    }
    let skinned = |vertex: u32| {
        let at = Vec3::from_array(points[vertex as usize]);
        let pull = joints[vertex as usize].iter().zip(weights[vertex as usize]);
        pull.map(|(joint, w)| matrices[usize::from(*joint)].transform_point3(at) * w).sum::<Vec3>()
    };
    if measure.frames <= SETTLING {
        return Ok(());
    }
    for (hair, members, roots) in &hairs {
        for (member, root) in members.iter().zip(&roots.roots) {
            let (strand, history) = strands.get(member)?;
            let drawn = hair.transform_point(history.drawn(strand, 0, time.overstep_fraction()));
            let [a, b, c] = root.vertices.map(skinned);
            let scalp = a * root.weights.x + b * root.weights.y + c * root.weights.z;
            measure.off_skin = measure.off_skin.max(drawn.distance(scalp));
        }
    }
    Ok(())
}
