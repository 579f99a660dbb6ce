//! A character that wears hair, made in code: a head on a neck on a trunk, skinned to four bones.

use bevy::{
    mesh::{
        VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};

/// The head's middle, and its half axes (m).
pub const MIDDLE: Vec3 = Vec3::new(0.0, 1.6, 0.0);
pub const HALF: Vec3 = Vec3::new(0.077, 0.118, 0.098);
/// Name and joint (m) of each bone, below the one before.
pub const BONES: [(&str, Vec3); 4] = [
    ("Hips", Vec3::new(0.0, 0.95, 0.0)),
    ("Spine", Vec3::new(0.0, 1.2, 0.0)),
    ("Neck", Vec3::new(0.0, 1.42, 0.0)),
    ("Head", Vec3::new(0.0, 1.5, 0.0)),
];

/// A head without a body.
pub fn ball(radius: f32) -> Mesh {
    Sphere::new(radius).mesh().uv(48, 32)
}

/// A part of a body that moves with one joint.
pub fn part(mesh: Mesh, place: Transform, joint: u16) -> Mesh {
    let mut mesh = mesh.transformed_by(place);
    mesh.remove_attribute(Mesh::ATTRIBUTE_UV_0);
    let count = mesh.count_vertices();
    let joints = VertexAttributeValues::Uint16x4(vec![[joint, 0, 0, 0]; count]);
    mesh.with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, joints)
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[1.0, 0.0, 0.0, 0.0]; count])
}

/// A head on a neck on a trunk, at rest, its vertices scaled.
pub fn skin(scale: f32) -> Mesh {
    let ball = Sphere::new(1.0).mesh().uv(64, 48);
    // The poles of the ball are along Z.
    let turn = Quat::from_rotation_x(-core::f32::consts::FRAC_PI_2);
    let head = Transform::from_translation(MIDDLE)
        .with_rotation(turn)
        .with_scale(Vec3::new(HALF.x, HALF.z, HALF.y));
    let mut mesh = part(ball, head, 3);
    let limb = |radius: f32, length: f32| Capsule3d::new(radius, length).mesh().build();
    let at = |y: f32| Transform::from_xyz(0.0, y, 0.02);
    mesh.merge(&part(limb(0.055, 0.12), at(1.43), 2)).unwrap();
    let lying = Quat::from_rotation_z(core::f32::consts::FRAC_PI_2);
    mesh.merge(&part(limb(0.1, 0.2), at(1.3).with_rotation(lying), 1)).unwrap();
    mesh.merge(&part(limb(0.15, 0.1), at(1.0), 0)).unwrap();
    mesh.transformed_by(Transform::from_scale(Vec3::splat(scale)))
}

/// A character without hair, its skin in units of `1 / scale` m.
pub fn character(app: &mut App, root: Entity, scale: f32) -> (Entity, Entity) {
    let world = app.world_mut();
    let armature = Transform::from_scale(Vec3::splat(1.0 / scale));
    let mut above = world.spawn((Name::new("Armature"), armature, ChildOf(root))).id();
    let (mut joints, mut inverse) = (Vec::new(), Vec::new());
    let mut before = Vec3::ZERO;
    for (name, at) in BONES {
        let place = Transform::from_translation((at - before) * scale);
        above = world.spawn((Name::new(name), place, ChildOf(above))).id();
        joints.push(above);
        inverse.push(Mat4::from_translation(-at * scale));
        before = at;
    }
    let head = above;
    let inverse_bindposes =
        world.resource_mut::<Assets<_>>().add(SkinnedMeshInverseBindposes::from(inverse));
    let mesh = world.resource_mut::<Assets<Mesh>>().add(skin(scale));
    let body =
        world.spawn((Mesh3d(mesh), SkinnedMesh { inverse_bindposes, joints }, ChildOf(root))).id();
    (head, body)
}
