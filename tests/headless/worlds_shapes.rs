//! Any tick rate.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// In how many substeps the strands have moved.
#[derive(Resource, Default)]
struct Solves {
    count: u32,
    last: Vec<Vec3>,
}

fn count_solves(strands: Query<&Strand>, mut solves: ResMut<Solves>) {
    let now: Vec<Vec3> = strands.iter().flat_map(|s| s.positions().to_vec()).collect();
    solves.count += u32::from(now != solves.last);
    solves.last = now;
}

#[test]
fn a_tick_has_as_many_solves_of_dry_hair_as_it_needs_at_any_rate() {
    let solves = |hertz: u32, wet: bool| {
        let mut app = test_app(hertz.into());
        app.init_resource::<Solves>()
            .add_systems(HairTick, count_solves.in_set(HairSystems::Last).ambiguous_with_all());
        let (hair, _) = one_strand(&mut app, 0.2, 4, Vec3::X);
        if wet {
            app.world_mut().trigger(SoakHair::dripping(hair));
        }
        run(&mut app, 0.25);
        app.world_mut().resource_mut::<Solves>().count = 0;
        (0..hertz / 4).for_each(|_| app.update());
        (4 * app.world().resource::<Solves>().count).div_ceil(hertz)
    };
    for (hertz, expected) in
        [(60, 3), (64, 3), (72, 3), (76, 3), (92, 2), (120, 2), (144, 2), (164, 2), (180, 1)]
    {
        assert_eq!(solves(hertz, false), expected, "{hertz} Hz");
    }
    // Hair that carries water takes every substep.
    assert_eq!([solves(60, true), solves(72, true)], [6, 5]);
}

/// How far from where it hangs the tip of a strand comes to rest in wind, and where it is in the middle
/// of its first swing.
#[test]
fn hair_leans_and_swings_alike_at_any_rate() {
    let lean = |hertz: f64| {
        let mut app = test_app(hertz);
        app.insert_resource(HairWind { velocity: Vec3::X * 3.0, gusts: 0.0, ..default() });
        let (_, e) = one_strand(&mut app, 0.2, 6, Vec3::NEG_Y);
        let tip = |app: &App| {
            let tip = *strand(app, e).positions().last().unwrap();
            tip.x.atan2(-tip.y).to_degrees()
        };
        run(&mut app, 0.25);
        let swings = tip(&app);
        run(&mut app, 3.75);
        [swings, tip(&app)]
    };
    let [swings, rests] = lean(60.0);
    assert!(rests > 10.0 && swings > 3.0, "{swings} {rests}");
    for hertz in [72.0, 76.0, 92.0, 120.0, 144.0, 164.0, 240.0] {
        let found = lean(hertz);
        println!("{hertz} Hz: {found:?}, {:?} at 60", [swings, rests]);
        assert!((found[1] / rests - 1.0).abs() < 0.01, "{hertz} Hz: {found:?}, not {rests}");
        assert!((found[0] / swings - 1.0).abs() < 0.05, "{hertz} Hz: {found:?}, not {swings}");
    }
}
