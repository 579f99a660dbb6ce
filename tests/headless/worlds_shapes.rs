//! Scales that a shape cannot have.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::{FaultKind, prelude::*};

#[test]
fn what_cannot_be_scaled_so_is_reported_once_with_the_scale_that_it_has() {
    let reported = |bundle: fn(&mut App) -> Entity| {
        let mut app = test_app(60.0);
        let entity = bundle(&mut app);
        run(&mut app, 0.2);
        let all = faults(&mut app);
        assert!(
            all.iter()
                .all(|fault| fault.entity == Some(entity) && fault.kind == FaultKind::Transform)
        );
        all.into_iter().map(|fault| fault.message).collect::<Vec<_>>()
    };
    let faults = reported(|app| {
        let flat = Transform::from_scale(Vec3::new(4.0, 1.0, 1.0));
        app.world_mut().spawn((HairCollider::capsule(0.1, 0.2).unwrap(), flat)).id()
    });
    assert_eq!(faults.len(), 1);
    assert!(
        faults[0].contains("4.000, 1.000, 1.000") && faults[0].contains("2.000, 1.000, 2.000"),
        "{faults:?}"
    );
    let faults = reported(|app| {
        let long = app.world_mut().spawn(Transform::from_scale(Vec3::new(3.0, 1.0, 1.0))).id();
        let turned = Transform::from_rotation(Quat::from_rotation_z(0.8));
        app.world_mut().spawn((HairCollider::sphere(0.1).unwrap(), turned, ChildOf(long))).id()
    });
    assert!(faults.len() == 1 && faults[0].contains("shears"), "{faults:?}");
    for spawn in [
        |app: &mut App| {
            app.world_mut()
                .spawn((PermRod::default(), Transform::from_scale(Vec3::new(1.0, 2.0, 1.0))))
                .id()
        },
        |app: &mut App| {
            let turned = Transform::from_rotation(Quat::from_rotation_z(0.8));
            let long = app.world_mut().spawn(Transform::from_scale(Vec3::new(3.0, 1.0, 1.0))).id();
            app.world_mut().spawn((WindZone::default(), turned, ChildOf(long))).id()
        },
        |app: &mut App| {
            let turned = Transform::from_rotation(Quat::from_rotation_z(0.8));
            let long = app.world_mut().spawn(Transform::from_scale(Vec3::new(3.0, 1.0, 1.0))).id();
            app.world_mut().spawn((WaterVolume::default(), turned, ChildOf(long))).id()
        },
    ] {
        assert_eq!(reported(spawn).len(), 1);
    }
    // What is scaled evenly, mirrored or turned, or can be as it is drawn, is not.
    let faults = reported(|app| {
        let parent = app.world_mut().spawn(Transform::from_scale(Vec3::new(-2.0, 2.0, 2.0))).id();
        let turned = Transform::from_rotation(Quat::from_rotation_z(0.8));
        app.world_mut().spawn((HairCollider::capsule(0.1, 0.2).unwrap(), turned, ChildOf(parent)));
        app.world_mut()
            .spawn((WindZone::shelter(), Transform::from_scale(Vec3::new(1.0, 3.0, 2.0))))
            .id()
    });
    assert_eq!(faults, [""; 0]);
}
