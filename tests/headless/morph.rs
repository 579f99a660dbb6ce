//! Roots on a mesh with morph targets: against the sum that defines them, alone and under a skin.

use crate::common::{app_with_meshes, faults, no_gravity, run, strand};
use bevy::{
    asset::RenderAssetUsages,
    mesh::{
        Mesh, Mesh3d, PrimitiveTopology, VertexAttributeValues,
        morph::{MeshMorphWeights, MorphAttributes, MorphWeights},
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};
use bevy_keratin::{
    FaultKind,
    authoring::{
        attach::{RootsError, RootsOnMesh},
        plant::RootOnMesh,
    },
    hair::strand::StrandHistory,
    prelude::*,
};

const REST: [Vec3; 5] = [
    Vec3::new(0.7, 0.1, 0.2),
    Vec3::new(0.0, 0.0, 0.0),
    Vec3::new(0.5, 0.5, 0.5),
    Vec3::new(0.0, 0.0, 0.06),
    Vec3::new(0.06, 0.0, 0.0),
];

/// Each target's displacement of each vertex. The last doubles the triangle of the root.
const TARGETS: [[Vec3; 5]; 3] = [
    [Vec3::ONE, Vec3::new(0.01, 0.02, 0.0), Vec3::ONE, Vec3::new(0.0, 0.03, 0.01), Vec3::ZERO],
    [Vec3::X, Vec3::ZERO, Vec3::X, Vec3::new(0.02, -0.01, 0.0), Vec3::new(0.0, 0.01, 0.03)],
    [Vec3::Y, Vec3::ZERO, Vec3::Y, Vec3::new(0.0, 0.0, 0.06), Vec3::new(0.06, 0.0, 0.0)],
];

const ROOT: RootOnMesh = RootOnMesh { vertices: [1, 3, 4], weights: Vec3::new(0.5, 0.2, 0.3) };

const LENGTH: f32 = 0.14;

fn mesh() -> Mesh {
    let morphs = TARGETS.as_flattened().iter();
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, REST.map(|p| p.to_array()).to_vec())
        .with_morph_targets(
            morphs.map(|&by| MorphAttributes { position: by, ..default() }).collect(),
        )
}

/// The root's triangle with these weights, by the definition of morph targets.
fn morphed(weights: [f32; 3]) -> [Vec3; 3] {
    ROOT.vertices.map(|v| {
        let by = TARGETS.iter().zip(weights).map(|(target, w)| target[v as usize] * w);
        REST[v as usize] + by.sum::<Vec3>()
    })
}

fn on([a, b, c]: [Vec3; 3]) -> Vec3 {
    a * ROOT.weights.x + b * ROOT.weights.y + c * ROOT.weights.z
}

fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a).normalize()
}

/// A straight strand that leaves the triangle along its normal, on a hair of its own.
fn strand_on(app: &mut App, mesh: Entity) -> (Entity, Entity) {
    let rest = morphed([0.0; 3]);
    let (root, up) = (on(rest), normal(rest));
    let points: Vec<Vec3> = (0..8).map(|k| root + up * (LENGTH * k as f32 / 7.0)).collect();
    let world = app.world_mut();
    let hair = world.spawn((Hair, Transform::from_xyz(0.1, 0.2, 0.3))).id();
    let id = world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id();
    world.entity_mut(hair).insert(RootsOnMesh { mesh: Some(mesh), roots: vec![ROOT], ..default() });
    (hair, id)
}

fn drawn(app: &App, hair: Entity, id: Entity) -> Vec3 {
    let world = app.world();
    let overstep = world.resource::<Time<Fixed>>().overstep_fraction();
    let root = world.get::<StrandHistory>(id).unwrap().drawn(strand(app, id), 0, overstep);
    world.get::<GlobalTransform>(hair).unwrap().transform_point(root)
}

fn value(weights: impl Into<Vec<f32>>) -> MeshMorphWeights {
    MeshMorphWeights::Value { weights: weights.into() }
}

#[test]
fn roots_are_drawn_on_the_morphed_triangle_in_every_frame() {
    // Frames that fit no tick, on a mesh that stands somewhere in the world.
    let mut app = app_with_meshes(144.0);
    let place = Transform::from_xyz(1.0, -2.0, 0.5).with_rotation(Quat::from_rotation_z(0.7));
    let handle = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh());
    let body = app.world_mut().spawn((Mesh3d(handle), value([0.0; 3]), place)).id();
    let (hair, id) = strand_on(&mut app, body);
    let weights = |t: f32| [(7.0 * t).sin().abs(), 0.5 - 0.5 * (5.0 * t).cos(), 0.3 * t];
    app.add_systems(Update, move |time: Res<Time>, mut all: Query<&mut MeshMorphWeights>| {
        *all.get_mut(body).unwrap() = value(weights(time.elapsed_secs()));
    });
    let mut worst = 0.0_f32;
    for frame in 0..300 {
        app.update();
        if frame >= 8 {
            let now = weights(app.world().resource::<Time<Virtual>>().elapsed_secs());
            let scalp = place.transform_point(on(morphed(now)));
            worst = worst.max(drawn(&app, hair, id).distance(scalp));
        }
    }
    println!("roots at most {} mm beside", worst * 1e3);
    assert!(worst < 1e-4, "a root was drawn {} mm beside its scalp", worst * 1e3);
    assert!(strand(&app, id).is_finite() && strand(&app, id).peak_strain() < 0.1);
    assert_eq!(faults(&mut app), []);
}

#[test]
fn the_simulated_root_goes_and_turns_with_the_morphed_triangle() {
    let mut app = app_with_meshes(60.0);
    no_gravity(&mut app);
    let handle = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh());
    let body = app.world_mut().spawn((Mesh3d(handle), Transform::default())).id();
    let (hair, id) = strand_on(&mut app, body);
    run(&mut app, 0.2);
    // Weights that come later, and more than one set of them.
    for weights in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.7, -0.4, 0.5], [0.0; 3]] {
        app.world_mut().entity_mut(body).insert(value(weights));
        run(&mut app, 4.0);
        let triangle = morphed(weights);
        let at = |node: usize| Vec3::new(0.1, 0.2, 0.3) + strand(&app, id).positions()[node];
        assert!(at(0).distance(on(triangle)) < 1e-5, "{weights:?}: {}", at(0));
        let tip = on(triangle) + normal(triangle) * LENGTH;
        assert!(at(7).distance(tip) < 1e-3, "{weights:?}: {} is not {tip}", at(7));
        assert!(drawn(&app, hair, id).distance(on(triangle)) < 1e-4);
    }
    assert!(normal(morphed([1.0, 0.0, 0.0])).dot(Vec3::Y) < 0.97, "the first target turns it");
}

/// The skin moves what the targets have moved, not the other way round.
#[test]
fn morph_targets_move_corners_before_joints_do() {
    let mut app = app_with_meshes(60.0);
    let world = app.world_mut();
    let skinned = mesh()
        .with_inserted_attribute(
            Mesh::ATTRIBUTE_JOINT_INDEX,
            VertexAttributeValues::Uint16x4(vec![[0, 1, 0, 0]; 5]),
        )
        .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[0.25, 0.75, 0.0, 0.0]; 5]);
    let mesh = world.resource_mut::<Assets<Mesh>>().add(skinned);
    let neck = Transform::from_xyz(0.0, 1.0, 0.0).with_rotation(Quat::from_rotation_x(1.2));
    let head = Transform::from_xyz(0.3, 1.5, 0.0).with_rotation(Quat::from_rotation_z(-0.9));
    let joints = [neck, head].map(|joint| world.spawn(joint).id()).to_vec();
    let inverse_bindposes = world
        .resource_mut::<Assets<_>>()
        .add(SkinnedMeshInverseBindposes::from(vec![Mat4::IDENTITY; 2]));
    // Weights that several meshes share.
    let face = world.spawn(MorphWeights::new(vec![0.0; 3], None).unwrap()).id();
    let skin = SkinnedMesh { inverse_bindposes, joints };
    let body = world.spawn((Mesh3d(mesh), skin, MeshMorphWeights::Reference(face))).id();
    let (hair, id) = strand_on(&mut app, body);
    for weights in [[0.0; 3], [0.8, 0.3, -0.2]] {
        let mut all = app.world_mut().get_mut::<MorphWeights>(face).unwrap();
        all.weights_mut().copy_from_slice(&weights);
        run(&mut app, 1.0);
        let at = on(morphed(weights)
            .map(|c| neck.transform_point(c) * 0.25 + head.transform_point(c) * 0.75));
        let drawn = drawn(&app, hair, id);
        assert!(drawn.distance(at) < 1e-4, "{weights:?}: {drawn} is not {at}");
        let simulated = Vec3::new(0.1, 0.2, 0.3) + strand(&app, id).positions()[0];
        assert!(simulated.distance(at) < 1e-4, "{weights:?}: {simulated} is not {at}");
    }
}

#[test]
fn a_face_that_is_puffed_when_hair_is_tied_makes_it_no_longer() {
    let mut app = app_with_meshes(60.0);
    let handle = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh());
    let place = Transform::from_scale(Vec3::splat(1.5));
    let body = app.world_mut().spawn((Mesh3d(handle), value([0.0, 0.0, 1.0]), place)).id();
    let (hair, id) = strand_on(&mut app, body);
    run(&mut app, 0.2);
    assert!(drawn(&app, hair, id).distance(1.5 * on(morphed([0.0, 0.0, 1.0]))) < 1e-4);
    let length = strand(&app, id).length();
    assert!((length - 1.5 * LENGTH).abs() < 1e-4, "{length} m");
}

#[test]
fn bad_weights_count_as_none_and_break_nothing() {
    let mut app = app_with_meshes(60.0);
    let handle = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh());
    let body = app.world_mut().spawn((Mesh3d(handle), Transform::default())).id();
    let (hair, id) = strand_on(&mut app, body);
    let gone = app.world_mut().spawn_empty().id();
    app.world_mut().despawn(gone);
    for (weights, valid) in [
        (value([f32::NAN, 0.5, f32::INFINITY]), [0.0, 0.5, 0.0]),
        (value([0.5]), [0.5, 0.0, 0.0]),
        (value([0.1, 0.2, 0.3, 0.4, 0.5]), [0.1, 0.2, 0.3]),
        (MeshMorphWeights::Reference(gone), [0.0; 3]),
    ] {
        app.world_mut().entity_mut(body).insert(weights.clone());
        run(&mut app, 0.5);
        let at = drawn(&app, hair, id);
        assert!(at.distance(on(morphed(valid))) < 1e-4, "{weights:?}: {at}");
    }
    // So large that the triangle leaves the numbers: the root waits where it was.
    app.world_mut().entity_mut(body).insert(value([f32::MAX, 0.0, 0.0]));
    run(&mut app, 0.5);
    assert!(strand(&app, id).is_finite() && drawn(&app, hair, id).is_finite());
    app.world_mut().entity_mut(body).insert(value([0.0; 3]));
    run(&mut app, 0.5);
    assert!(drawn(&app, hair, id).distance(on(morphed([0.0; 3]))) < 1e-4);
    assert_eq!(faults(&mut app), []);
}

/// Errors are reported once, with their numbers, and strands stay where they are.
#[test]
fn roots_that_fit_no_mesh_tell_what_was_expected() {
    let mut app = app_with_meshes(60.0);
    let world = app.world_mut();
    let whole = world.resource_mut::<Assets<Mesh>>().add(mesh());
    let bare = mesh().with_removed_attribute(Mesh::ATTRIBUTE_POSITION);
    let bare = world.resource_mut::<Assets<Mesh>>().add(bare);
    let mut drawn_only = mesh();
    let _ = drawn_only.take_gpu_data().unwrap();
    let drawn_only = world.resource_mut::<Assets<Mesh>>().add(drawn_only);
    let inverse_bindposes =
        world.resource_mut::<Assets<_>>().add(SkinnedMeshInverseBindposes::from(vec![]));
    let jointless = SkinnedMesh { inverse_bindposes, joints: vec![Entity::PLACEHOLDER; 2] };
    let body = world.spawn((Mesh3d(whole.clone()), Transform::default())).id();
    let bare = world.spawn((Mesh3d(bare), Transform::default())).id();
    let drawn_only = world.spawn((Mesh3d(drawn_only), Transform::default())).id();
    let jointless = world.spawn((Mesh3d(whole), jointless, Transform::default())).id();
    let (hair, id) = strand_on(&mut app, body);
    let flat = RootOnMesh { vertices: [1, 1, 1], ..ROOT };
    let beyond = RootOnMesh { vertices: [1, 3, 99], ..ROOT };
    let before = strand(&app, id).positions()[0];
    for (mesh, roots, why) in [
        (body, vec![ROOT; 2], RootsError::Count { found: 2, expected: 1 }),
        (body, vec![beyond], RootsError::Vertex { found: 99, vertices: 5 }),
        (body, vec![flat], RootsError::Flat { found: 1 }),
        (bare, vec![ROOT], RootsError::NoPositions),
        (drawn_only, vec![ROOT], RootsError::Extracted),
        (jointless, vec![ROOT], RootsError::NoJoints { joints: 2, poses: 0 }),
    ] {
        app.world_mut().entity_mut(hair).insert(RootsOnMesh {
            mesh: Some(mesh),
            roots,
            ..default()
        });
        run(&mut app, 0.2);
        let reported = faults(&mut app);
        assert!(
            matches!(&reported[..], [f] if f.kind == FaultKind::Roots && f.cause() == Some(&why))
        );
        assert_eq!(strand(&app, id).positions()[0], before);
    }
}
