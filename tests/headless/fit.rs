//! Capsules fitted to the parts of a skinned mesh.
#![cfg(feature = "groom")]

use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, Mesh, PrimitiveTopology, VertexAttributeValues},
    prelude::*,
};
use bevy_keratin::{
    ColliderShape,
    authoring::collider_fit::{FitError, JointCapsule, fit_joint_capsules},
};

/// Gives all vertices of a mesh to joints by a rule.
fn skinned(mesh: Mesh, joint_of: impl Fn(Vec3) -> u16) -> Mesh {
    let places = mesh.attribute(Mesh::ATTRIBUTE_POSITION).unwrap().as_float3().unwrap().to_vec();
    let joints: Vec<_> = places.iter().map(|p| [joint_of(Vec3::from_array(*p)), 0, 0, 0]).collect();
    let weights = vec![[1.0, 0.0, 0.0, 0.0]; places.len()];
    mesh.with_inserted_attribute(
        Mesh::ATTRIBUTE_JOINT_INDEX,
        VertexAttributeValues::Uint16x4(joints),
    )
    .with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, weights)
}

/// An open, tapering tube from the origin along +X.
fn tube(length: f32, radii: [f32; 2]) -> Mesh {
    let (rings, sides) = (24_u32, 20_u32);
    let point = |ring: u32, side: u32| {
        let t = ring as f32 / (rings - 1) as f32;
        let (sine, cosine) = (core::f32::consts::TAU * side as f32 / sides as f32).sin_cos();
        let radius = radii[0] + (radii[1] - radii[0]) * t;
        [t * length, radius * cosine, radius * sine]
    };
    let points: Vec<_> = (0..rings).flat_map(|r| (0..sides).map(move |s| point(r, s))).collect();
    let indices = (0..rings - 1).flat_map(|r| {
        (0..sides).flat_map(move |s| {
            let (a, b) = (r * sides + s, r * sides + (s + 1) % sides);
            [a, b, a + sides, a + sides, b, b + sides]
        })
    });
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, points)
        .with_inserted_indices(Indices::U32(indices.collect()))
}

/// The only capsule, with its ends in the order of the axis.
fn one(mesh: &Mesh, axis: Vec3) -> JointCapsule {
    let found = fit_joint_capsules(mesh, &[Mat4::IDENTITY]).unwrap();
    let mut capsule = found[0].unwrap();
    if (capsule.to - capsule.from).dot(axis) < 0.0 {
        (capsule.from, capsule.to) = (capsule.to, capsule.from);
    }
    capsule
}

fn near(found: f32, expected: f32, share: f32) {
    assert!((found - expected).abs() <= share * expected, "{found}, expected {expected}");
}

#[test]
fn a_capsule_is_found_again_wherever_it_lies() {
    for turn in
        [Quat::IDENTITY, Quat::from_rotation_z(1.0), Quat::from_euler(EulerRot::XYZ, 2.0, 1.0, 0.5)]
    {
        let (at, axis) = (Vec3::new(0.4, 1.2, -0.3), turn * Vec3::Y);
        let place = Transform::from_translation(at).with_rotation(turn);
        let mesh = Capsule3d::new(0.05, 0.3).mesh().build().transformed_by(place);
        let capsule = one(&skinned(mesh, |_| 0), axis);
        near(capsule.radius, 0.05, 0.01);
        near(capsule.from.distance(capsule.to), 0.3, 0.01);
        assert!((0.5 * (capsule.from + capsule.to)).distance(at) < 1e-3, "{capsule:?}");
        assert!((capsule.to - capsule.from).normalize().dot(axis) > 0.9999);
        assert!(capsule.deviation < 5e-4, "{capsule:?}");
    }
}

#[test]
fn a_limb_gives_its_radius_and_length() {
    let capsule = one(&skinned(tube(0.4, [0.05, 0.05]), |_| 0), Vec3::X);
    near(capsule.radius, 0.05, 0.02);
    near(capsule.from.distance(capsule.to), 0.4, 0.05);
    let tapered = one(&skinned(tube(0.4, [0.055, 0.04]), |_| 0), Vec3::X);
    near(tapered.radius, 0.0475, 0.05);
    assert!((tapered.to - tapered.from).normalize().dot(Vec3::X) > 0.999);
    assert!(tapered.deviation < 6e-3);
}

#[test]
fn a_ball_is_a_capsule_without_length() {
    let ball = Sphere::new(0.1).mesh().uv(32, 18);
    let capsule = one(&skinned(ball, |_| 0), Vec3::Y);
    near(capsule.radius, 0.1, 0.02);
    assert!(capsule.from.distance(capsule.to) < 0.02, "{capsule:?}");
    assert!((0.5 * (capsule.from + capsule.to)).length() < 1e-3);
}

#[test]
fn each_joint_has_its_own_in_its_own_space() {
    // The upper half of a tube belongs to a joint at its middle that is turned and half as large.
    let pose = Transform::from_xyz(0.2, 0.0, 0.0)
        .with_rotation(Quat::from_rotation_z(0.5))
        .with_scale(Vec3::splat(0.5));
    let mesh = skinned(tube(0.4, [0.05, 0.05]), |p| u16::from(p.x > 0.2));
    let poses = [Mat4::IDENTITY, pose.to_matrix().inverse(), Mat4::IDENTITY];
    let found = fit_joint_capsules(&mesh, &poses).unwrap();
    assert_eq!(found, fit_joint_capsules(&mesh, &poses).unwrap(), "the same each time");
    let (lower, upper) = (found[0].unwrap(), found[1].unwrap());
    assert!(found[2].is_none(), "it moves nothing");
    near(lower.radius, 0.05, 0.02);
    near(upper.radius, 0.1, 0.02);
    let back = pose.transform_point(0.5 * (upper.from + upper.to));
    assert!(back.distance(Vec3::X * 0.3) < 0.015, "{back}");
    let (collider, place) = upper.collider().unwrap();
    let ColliderShape::Capsule(shape) = collider.shape else { panic!("{collider:?}") };
    near(2.0 * shape.half_length, upper.from.distance(upper.to), 1e-4);
    let end = place.transform_point(Vec3::Y * shape.half_length);
    assert!(end.distance(upper.to) < 1e-5);
}

#[test]
fn what_cannot_be_fitted_is_no_capsule() {
    let flat = Plane3d::default().mesh().subdivisions(8).build();
    let found = fit_joint_capsules(&skinned(flat, |_| 0), &[Mat4::IDENTITY]).unwrap();
    if let Some(capsule) = found[0] {
        assert!(capsule.radius.is_finite() && capsule.from.is_finite() && capsule.to.is_finite());
    }
    for points in [vec![[0.0; 3]; 3], vec![[1.0, 2.0, 3.0]; 30]] {
        let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, points);
        let found = fit_joint_capsules(&skinned(mesh, |_| 0), &[Mat4::IDENTITY]).unwrap();
        assert_eq!(found, [None]);
    }
    // On a line, and one point over and over: nothing panics, nothing is endless.
    for step in [0.0, 0.1] {
        let points: Vec<_> = (0..30).map(|i| [step * i as f32, 0.0, 0.0]).collect();
        let mesh = Mesh::new(PrimitiveTopology::PointList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, points);
        let found = fit_joint_capsules(&skinned(mesh, |_| 0), &[Mat4::IDENTITY]).unwrap();
        assert!(found[0].is_none_or(|c| c.radius.is_finite() && c.radius > 0.0), "{found:?}");
    }
    let empty = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, Vec::<[f32; 3]>::new());
    assert_eq!(fit_joint_capsules(&skinned(empty, |_| 0), &[]).unwrap(), []);
}

#[test]
fn a_mesh_that_is_wrong_says_where() {
    let ball = || skinned(Sphere::new(0.1).mesh().uv(8, 6), |_| 0);
    let count = ball().count_vertices();
    let fit = |mesh: &Mesh| fit_joint_capsules(mesh, &[Mat4::IDENTITY]).unwrap_err();
    for (id, what) in [
        (Mesh::ATTRIBUTE_POSITION, "positions"),
        (Mesh::ATTRIBUTE_JOINT_INDEX, "joint indices"),
        (Mesh::ATTRIBUTE_JOINT_WEIGHT, "joint weights"),
    ] {
        let mut mesh = ball();
        mesh.remove_attribute(id);
        let error = fit(&mesh);
        assert_eq!(error, FitError::NoAttribute { what });
        assert!(error.to_string().contains("MAIN_WORLD"), "{error}");
    }
    let short = ball().with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, vec![[1.0; 4]; 2]);
    let what = "joint weights";
    assert_eq!(fit(&short), FitError::Length { what, found: 2, expected: count });
    let other = skinned(Sphere::new(0.1).mesh().uv(8, 6), |_| 5);
    assert_eq!(fit(&other), FitError::UnknownJoint { vertex: 0, joint: 5, joints: 1 });
    let mut places = vec![[0.0; 3]; count];
    places[3][1] = f32::NAN;
    let broken = ball().with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, places);
    assert_eq!(fit(&broken), FitError::NonFinite { what: "position", index: 3 });
    let infinite = vec![[f32::INFINITY, 0.0, 0.0, 0.0]; count];
    let broken = ball().with_inserted_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, infinite);
    assert_eq!(fit(&broken), FitError::NonFinite { what: "joint weight", index: 0 });
    let beyond = ball().with_inserted_indices(Indices::U32(vec![0, 1, 9999]));
    assert_eq!(fit(&beyond), FitError::UnknownVertex { vertex: 9999, vertices: count });
    let pose = [Mat4::from_cols_array(&[f32::NAN; 16])];
    let what = "inverse bind pose";
    assert_eq!(
        fit_joint_capsules(&ball(), &pose).unwrap_err(),
        FitError::NonFinite { what, index: 0 }
    );
}
