//! Hours of a game: memory stays flat, state finite, and bonds keep what they kept.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::{KeptStyle, prelude::*};

const SECONDS: u32 = 60;

/// Resident memory of this process (bytes); `None` where the system does not say.
fn resident() -> Option<f64> {
    let pages = std::fs::read_to_string("/proc/self/statm").ok()?;
    Some(pages.split(' ').nth(1)?.parse::<f64>().ok()? * 4096.0)
}

fn kept(app: &App, hair: Entity) -> f32 {
    app.world().get::<KeptStyle>(hair).and_then(KeptStyle::kept).expect("a style")
}

/// How memory is counted: not while other tests run beside this one.
#[derive(Clone, Copy, PartialEq)]
enum Memory {
    StaysFlat,
    IsShared,
}

/// Simulates so many hours of a head that nods, with wind that comes and goes, whose hydrogen bonds are half
/// open.
fn soak(hours: f32, memory: Memory) {
    let mut app = test_app(60.0);
    let hair = app.world_mut().spawn(Hair).id();
    app.world_mut().spawn((HairCollider::sphere(0.09).unwrap(), ChildOf(hair)));
    for i in 0..24 {
        let (sin, cos) = (0.8 * i as f32).sin_cos();
        let out = Vec3::new(cos, 1.0, sin).normalize();
        let side = out.any_orthonormal_vector();
        let node = |k: usize| out * (0.092 + 0.015 * k as f32) + side * 4e-3 * (k as f32).sin();
        let points: Vec<Vec3> = (0..10).map(node).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    app.world_mut().write_message(HairTreatment::wet(hair));
    run(&mut app, 1.5);
    app.world_mut().write_message(HairTreatment::dry(hair));
    run(&mut app, 0.2);
    app.world_mut().entity_mut(hair).insert(HairStyle { fades_below: 0.05 });
    run(&mut app, 0.1);
    app.world_mut().write_message(HairTreatment::set(hair, BondKind::Hydrogen, 0.5).unwrap());
    run(&mut app, 5.0);
    let before = kept(&app, hair);
    let mut strands = app.world_mut().query::<&Strand>();
    let mut first = None;
    let minutes = (hours * 60.0).round() as u32;
    for minute in 0..minutes {
        let gust = if minute % 3 == 0 { Vec3::X * 3.0 } else { Vec3::ZERO };
        app.world_mut().resource_mut::<HairWind>().velocity = gust;
        for tick in 0..SECONDS * 60 {
            let nod = 0.3 * (tick as f32 * core::f32::consts::TAU / 240.0).sin();
            app.world_mut().get_mut::<Transform>(hair).unwrap().rotation =
                Quat::from_rotation_x(nod);
            app.update();
        }
        let finite = strands.iter(app.world()).all(Strand::is_finite);
        assert!(finite, "not finite after {minute} minutes");
        let worst = strands.iter(app.world()).map(Strand::peak_strain).fold(0.0, f32::max);
        assert!(worst < 0.02, "strained by {worst} after {minute} minutes");
        if let Some(now) = resident().filter(|_| memory == Memory::StaysFlat) {
            let first = *first.get_or_insert(now);
            let grown = now / first - 1.0;
            if minute % 60 == 59 || minute + 1 == minutes {
                println!(
                    "{} minutes: {grown:+.4} of memory, kept {}",
                    minute + 1,
                    kept(&app, hair)
                );
            }
            assert!(grown < 0.01, "{grown:+.4} of memory after {minute} minutes");
        }
    }
    let after = kept(&app, hair);
    assert!((after - before).abs() < 1e-3, "kept {before}, then {after}");
    assert_eq!(faults(&mut app), []);
}

#[test]
fn minutes_leave_bonds_as_they_were() {
    soak(0.05, Memory::IsShared);
}

#[test]
#[ignore = "takes a quarter of an hour, and counts memory: run it alone"]
fn ten_hours_leave_memory_and_bonds_as_they_were() {
    soak(10.0, Memory::StaysFlat);
}
