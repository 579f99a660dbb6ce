//! Water in a real app: droplets clump hair, hair wets and dries, nothing is lost.

mod common;
#[path = "../examples/scenes/locks.rs"]
mod locks;

use bevy::prelude::*;
use bevy_keratin::{DropletRules, prelude::*};
use common::{run, test_app};
use core::f32::consts::PI;
use locks::{clustered_share, tip_spacing};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

const HEAD: f32 = 0.09;

/// A head of `count` strands of nine nodes and 24 cm, of a gravity-bending length, settled dry.
fn head_of_hair(count: usize, bending_length: f32) -> App {
    let mut app = test_app(60.0);
    // Equation 18 is off, as in the experiment.
    app.insert_resource(HairDefault(LockContact { strength: 0.0, ..default() }));
    app.insert_resource(HairDefault(AirDrag { rate: 3.0 }));
    app.world_mut().spawn(HairCollider::sphere(HEAD).unwrap());
    let hair =
        app.world_mut().spawn((Hair, Stiffness::from_bending_length(bending_length).unwrap())).id();
    // A spiral that covers the upper half evenly.
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    for i in 0..count {
        let y = (i as f32 + 0.5) / count as f32;
        let across = (1.0 - y * y).sqrt();
        let (sine, cosine) = (golden * i as f32).sin_cos();
        let normal = Vec3::new(across * cosine, y, across * sine);
        let points: Vec<Vec3> = (0..9).map(|k| normal * (HEAD + 0.002 + 0.03 * k as f32)).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    run(&mut app, 8.0);
    app.init_resource::<PeakStrain>().add_systems(HairTick, watch_strain.in_set(HairSystems::Last));
    app
}

fn tips(app: &mut App) -> Vec<Vec3> {
    let mut strands = app.world_mut().query::<&Strand>();
    strands.iter(app.world()).map(|s| *s.positions().last().unwrap()).collect()
}

/// The largest strain of any segment in any substep.
#[derive(Resource, Default)]
struct PeakStrain(f32);

fn watch_strain(strands: Query<&Strand>, mut peak: ResMut<PeakStrain>) {
    peak.0 = strands.iter().map(Strand::peak_strain).fold(peak.0, f32::max);
}

/// Drops of 3 mm on nodes of the outer two thirds of the hair, that follow their strands.
fn wet_with(app: &mut App, count: usize) {
    let mut strands = app.world_mut().query::<&Strand>();
    let nodes: Vec<Vec3> =
        strands.iter(app.world()).flat_map(|s| s.positions()[3..].to_vec()).collect();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    for _ in 0..count {
        let place = nodes[random.random_range(0..nodes.len())];
        let volume = 4.0 / 3.0 * core::f64::consts::PI * 0.003_f64.powi(3);
        let drop = Droplet::new(place, volume).unwrap().with_influence(0.003, 0.015).unwrap();
        app.world_mut().spawn(drop);
    }
}

fn ledger(app: &App) -> WaterLedger {
    *app.world().resource::<WaterLedger>()
}

struct Clumped {
    ratio: f64,
    clustered: f64,
    strain: f32,
}

fn clump(app: &mut App, drops: usize, seconds: usize) -> Clumped {
    let dry = tip_spacing(&tips(app));
    wet_with(app, drops);
    run(app, seconds as f64);
    let strain = app.world().resource::<PeakStrain>().0;
    let tips = tips(app);
    let ratio = tip_spacing(&tips) / dry;
    Clumped { ratio, clustered: clustered_share(&tips, 0.5 * dry as f32), strain }
}

#[test]
fn print_clumping() {
    for (lg, drops) in [(0.06, 100), (0.06, 1000), (0.13, 1000)] {
        let mut app = head_of_hair(2000, lg);
        let strands =
            Wetting { fibres: 50.0, uptake: 0.0, sliding: 0.0, evaporation: 0.0, ..default() };
        app.insert_resource(HairDefault(strands));
        app.insert_resource(DropletRules { merging: false, ..default() });
        let dry = tip_spacing(&tips(&mut app));
        let start = std::time::Instant::now();
        let c = clump(&mut app, drops, 5);
        println!("{:?}", start.elapsed());
        let l = ledger(&app);
        let n = app.world_mut().query::<&Droplet>().iter(app.world()).count();
        let riding = app
            .world_mut()
            .query::<&Droplet>()
            .iter(app.world())
            .filter(|d| d.ride().is_some())
            .count();
        println!(
            "{lg} {drops}: dry {dry:.5} ratio {:.3} clustered {:.3} strain {:.4} left {n} riding {riding} {:?} {}",
            c.ratio,
            c.clustered,
            c.strain,
            l,
            l.error()
        );
    }
}
