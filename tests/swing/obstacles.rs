//! Colliders that move: combs, floors that rise under hair, heads that turn.

use super::lab::*;
use bevy::prelude::*;
use bevy_keratin::prelude::*;

const SEGMENTS: [usize; 3] = [8, 16, 64];
const LENGTH: f32 = 0.3;

/// Deepest node in a collider (m), and largest strain.
fn worst(lab: &Lab, strands: &[Entity], depth: impl Fn(Vec3) -> f32) -> (f32, f32) {
    let of = |s: &Entity| {
        let strand = lab.get(*s);
        let deepest = strand.positions()[1..].iter().map(|p| depth(*p)).fold(f32::MIN, f32::max);
        (deepest, strand.peak_strain())
    };
    strands.iter().map(of).fold((f32::MIN, 0.0), |a, b| (a.0.max(b.0), a.1.max(b.1)))
}

/// Moves a collider, which may strain hair by no more than `most`, as `path` says for `seconds`, then leaves it there for three more.
fn lead(
    (name, most): (&str, f32),
    collider: HairCollider,
    seconds: f32,
    path: impl Fn(f32) -> Transform,
    depth: impl Fn(Vec3, Transform) -> f32,
) {
    let mut lab = Lab::usual();
    lab.drag(2.0);
    let strands = SEGMENTS.map(|n| lab.straight(0.13, LENGTH, n, Vec3::NEG_Y));
    let entity = lab.app.world_mut().spawn((collider, path(0.0))).id();
    lab.run(0.5);
    let (mut deepest, mut peak) = (f32::MIN, 0.0_f32);
    for frame in 1..=(seconds * 60.0) as usize {
        let place = path((frame as f32 / 60.0).min(seconds));
        *lab.app.world_mut().get_mut::<Transform>(entity).unwrap() = place;
        lab.run(1.0 / 60.0);
        let now = worst(&lab, &strands, |p| depth(p, place));
        (deepest, peak) = (deepest.max(now.0), peak.max(now.1));
    }
    lab.run(3.0);
    let (late_depth, late) = worst(&lab, &strands, |p| depth(p, path(seconds)));
    println!(
        "{name}: deepest {deepest:.2e} m, peak strain {peak:.4}; late {late_depth:.2e} m, {late:.5}"
    );
    // Nodes keep a lock's radius away.
    let inside = deepest.max(late_depth) + LockContact::default().radius;
    assert!(inside < 1e-5, "{name}: {deepest} m inside, late {late_depth}");
    assert!(late < 5e-4, "{name}: strain {late} late");
    assert!(peak < most, "{name}: peak strain {peak}");
}

#[test]
fn a_comb_goes_through_hair() {
    let radius = 0.005;
    lead(
        ("comb", 5e-3),
        HairCollider::capsule(radius, 0.3).unwrap(),
        1.0,
        |t| {
            Transform::from_xyz(-0.15 + 0.3 * t, -0.15, 0.0)
                .with_rotation(Quat::from_rotation_x(1.57))
        },
        |p, place| radius - (p - place.translation).with_z(0.0).length(),
    );
}

#[test]
fn hair_falls_end_on_onto_a_floor_that_rises() {
    lead(
        ("floor", 0.08),
        HairCollider::plane(Dir3::Y),
        1.0,
        |t| Transform::from_xyz(0.0, -0.32 + 0.2 * t, 0.0),
        |p, place| place.translation.y - p.y,
    );
}

#[test]
fn a_ball_swings_into_hair() {
    lead(
        ("ball", 5e-3),
        HairCollider::sphere(0.06).unwrap(),
        1.0,
        |t| Transform::from_xyz(0.3 * (3.0 * t).cos(), -0.15, 0.01),
        |p, place| 0.06 - p.distance(place.translation),
    );
}
