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

/// The papers' substeps, and those of games.
fn labs() -> [(&'static str, Lab); 2] {
    [("1/360 s", Lab::usual()), ("1/180 s", Lab::in_games())]
}

/// Moves a collider, which may strain hair by no more than `most` at either substep, as `path` says for `seconds`, then
/// leaves it there for three more.
fn lead(
    (name, most): (&str, [f32; 2]),
    collider: HairCollider,
    seconds: f32,
    path: impl Fn(f32) -> Transform,
    depth: impl Fn(Vec3, Transform) -> f32,
) {
    for ((substep, mut lab), most) in labs().into_iter().zip(most) {
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
            "{name} at {substep}: deepest {deepest:.2e} m, peak strain {peak:.4}; late \
             {late_depth:.2e} m, {late:.5}"
        );
        // Nodes keep a lock's radius away.
        let inside = deepest.max(late_depth) + LockContact::default().radius;
        assert!(inside < 1e-5, "{name}: {deepest} m inside, late {late_depth}");
        assert!(late < 5e-4, "{name}: strain {late} late");
        assert!(peak < most, "{name}: peak strain {peak}");
    }
}

#[test]
fn a_comb_goes_through_hair() {
    let radius = 0.005;
    lead(
        ("comb", [5e-3; 2]),
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
        ("floor", [0.08, 0.25]),
        HairCollider::plane(Dir3::Y),
        1.0,
        |t| Transform::from_xyz(0.0, -0.32 + 0.2 * t, 0.0),
        |p, place| place.translation.y - p.y,
    );
}

#[test]
fn a_ball_swings_into_hair() {
    lead(
        ("ball", [5e-3; 2]),
        HairCollider::sphere(0.06).unwrap(),
        1.0,
        |t| Transform::from_xyz(0.3 * (3.0 * t).cos(), -0.15, 0.01),
        |p, place| 0.06 - p.distance(place.translation),
    );
}

#[test]
fn hair_is_wound_under_tension_and_gives_way_when_its_rod_is_taken_too_far() {
    // Hair that buckles as its rod comes and is then drawn taut cracks like a whip; the finest cannot be
    // followed in the longer step.
    for ((substep, mut lab), most) in labs().into_iter().zip([0.05, 1.5]) {
        lab.drag(2.0);
        let strands = SEGMENTS.map(|n| lab.straight(0.13, LENGTH, n, Vec3::NEG_Y));
        // Out of reach of the quarter of the hair that is not to be wound.
        let rod = lab.app.world_mut();
        let rod = rod.spawn((
            PermRod::new(0.01, 0.1).unwrap(),
            Transform::from_xyz(0.12, -0.03, 0.0).with_rotation(Quat::from_rotation_x(1.57)),
        ));
        let rod = rod.id();
        for (strand, n) in strands.iter().zip(SEGMENTS) {
            let winding = Winding { from_node: n / 4, seconds: 1.0, ..default() };
            lab.app.world_mut().entity_mut(*strand).insert((WoundOn(rod), winding));
        }
        let (mut peak, mut told) = (0.0_f32, Vec::new());
        let mut go_on = |lab: &mut Lab, seconds: f32, by: f32| {
            for _ in 0..(seconds * 60.0) as usize {
                lab.app.world_mut().get_mut::<Transform>(rod).unwrap().translation.x += by / 60.0;
                lab.run(1.0 / 60.0);
                peak = peak.max(worst(lab, &strands, |_| 0.0).1);
                told.extend(faults(lab));
            }
            (worst(lab, &strands, |_| 0.0).1, peak, told.clone())
        };
        let (late, wound, told) = go_on(&mut lab, 4.0, 0.0);
        assert_eq!(told, [], "what the winding does by itself is within reach");
        go_on(&mut lab, 1.0, 0.5);
        let (late_away, away, told) = go_on(&mut lab, 3.0, 0.0);
        println!(
            "winding at {substep}: peak strain {wound:.5}, late {late:.5}; half a metre away \
             {away:.5}, late {late_away:.5}"
        );
        assert!(late < 5e-3 && late_away < 5e-3, "strain {late}, {late_away} late");
        assert!(away < most, "peak strain {away}");
        assert_eq!(told, strands, "each strand's reach is told once");
    }
}

/// The strands of which something was told.
fn faults(lab: &mut Lab) -> Vec<Entity> {
    let mut told = lab.app.world_mut().resource_mut::<Messages<HairFault>>();
    told.drain().inspect(|fault| println!("{fault}")).filter_map(|fault| fault.entity).collect()
}

#[test]
fn strands_that_push_each_other_keep_their_length() {
    for (substep, mut lab) in labs() {
        lab.app.insert_resource(HairDefault(LockContact::default()));
        lab.drag(2.0);
        // Three rows that fall through one another: crosswise, end-on and side by side.
        let strands: Vec<Entity> = (0..48)
            .map(|i| {
                let (row, place) = (i / 16, (i % 16) as f32);
                let n = SEGMENTS[i % 3];
                let root = Vec3::new(0.004 * place, 0.02 * row as f32, 0.002 * row as f32);
                let aside = [Vec3::X, Vec3::new(-1.0, 0.3, 0.0), Vec3::new(0.2, 1.0, 0.1)][row];
                let points: Vec<Vec3> =
                    line(0.2, n, aside.normalize()).iter().map(|p| root + *p).collect();
                lab.strand(0.13, &points)
            })
            .collect();
        let mut peak = 0.0_f32;
        for _ in 0..60 {
            lab.run(1.0 / 60.0);
            peak = peak.max(worst(&lab, &strands, |_| 0.0).1);
        }
        lab.run(4.0);
        let late = worst(&lab, &strands, |_| 0.0).1;
        println!("strands in each other's way at {substep}: peak strain {peak:.5}, late {late:.5}");
        assert!(late < 5e-3, "strain {late} late");
        assert!(peak < 0.05, "peak strain {peak}");
    }
}
