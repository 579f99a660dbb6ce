//! What a hair is like and who moves it why, as `HairReport` has it.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::prelude::*;

fn report(app: &mut App, of: Entity) -> Option<HairReport> {
    let ask = |In(of): In<Entity>, reports: HairReports| reports.of(of);
    app.world_mut().run_system_cached_with(ask, of).unwrap()
}

/// Strands of these lengths (m) along +X, 1 cm apart.
fn hair(app: &mut App, lengths: &[f32]) -> (Entity, Vec<Entity>) {
    let hair = app.world_mut().spawn(Hair).id();
    let grow = |(i, length): (usize, &f32)| {
        let node = |k: usize| Vec3::new(length * k as f32 / 8.0, 0.0, 0.01 * i as f32);
        let strand = Strand::from_polyline(&(0..9).map(node).collect::<Vec<_>>()).unwrap();
        app.world_mut().spawn((StrandOf(hair), strand)).id()
    };
    let strands = lengths.iter().enumerate().map(grow).collect();
    (hair, strands)
}

#[test]
fn each_owner_has_its_reason() {
    let mut app = test_app(60.0);
    let (moving, _) = hair(&mut app, &[0.1, 0.12]);
    let (restless, _) = hair(&mut app, &[0.1]);
    app.world_mut().entity_mut(restless).insert(SleepSettings::never());
    let (settling, _) = hair(&mut app, &[0.1]);
    let forever = SettleSettings { ticks: 10_000, speed: 0.0, ..default() };
    app.world_mut().entity_mut(settling).insert((Settling::default(), forever));
    let far = |strands| HairLod {
        levels: vec![LodLevel { below: 10.0, strands, ..default() }],
        ..default()
    };
    let (small, _) = hair(&mut app, &[0.1; 8]);
    app.world_mut().entity_mut(small).insert(far(0.0));
    let (few, _) = hair(&mut app, &[0.1; 8]);
    app.world_mut().entity_mut(few).insert((far(0.25), SleepSettings::never()));
    let bald = app.world_mut().spawn(Hair).id();
    let (hidden, _) = hair(&mut app, &[0.1]);
    run(&mut app, 0.1);
    app.world_mut().get_mut::<Transform>(hidden).unwrap().scale = Vec3::splat(1e-4);
    run(&mut app, 0.1);

    let mut of = |hair| report(&mut app, hair).unwrap();
    let found = of(moving);
    assert_eq!((found.owner, found.why), (MotionOwner::Simulated, WhyMoved::Awake));
    assert_eq!((found.strands, found.awake, found.asleep), (2, 2, 0));
    assert!(found.fastest > 0.01 && found.kept_style.is_none() && found.air == 22.0, "{found}");
    assert_eq!(of(restless).why, WhyMoved::NeverSleeps);
    let found = of(settling);
    assert!(matches!(found.why, WhyMoved::Settles(1..)), "{found}");
    let found = of(small);
    assert_eq!((found.owner, found.why), (MotionOwner::Frozen, WhyMoved::Small));
    assert_eq!((found.level, found.strands, found.awake), (1, 8, 0));
    let found = of(few);
    assert_eq!((found.awake, found.followers, found.level), (2, 6, 1));
    assert_eq!(of(bald).why, WhyMoved::NoStrands);
    let found = of(hidden);
    assert_eq!((found.owner, found.why), (MotionOwner::Frozen, WhyMoved::Hidden));
    let words = of(small).to_string();
    assert!(words.starts_with("Frozen, since it is small on the screen; 8 strands"), "{words}");
    #[cfg(feature = "gpu")]
    assert!(words.contains("not on the GPU: SimulateOn::Gpu is not set"), "{words}");

    let nothing = app.world_mut().spawn_empty().id();
    assert_eq!(report(&mut app, nothing), None);

    // At rest it sleeps, in the wind it does not.
    app.insert_resource(HairDefault(SleepSettings { speed: 1.0, turning: 10.0, ..default() }));
    run(&mut app, 1.0);
    let found = report(&mut app, moving).unwrap();
    assert_eq!((found.owner, found.why), (MotionOwner::Asleep, WhyMoved::AtRest));
    assert_eq!((found.awake, found.asleep, found.fastest), (0, 2, 0.0));
    app.insert_resource(HairWind { velocity: Vec3::X, ..default() });
    run(&mut app, 0.1);
    assert_eq!(report(&mut app, moving).unwrap().why, WhyMoved::InWind);
}

#[test]
fn hair_that_the_budget_freezes_says_so() {
    let mut app = test_app(60.0);
    let (hair, _) = hair(&mut app, &[0.1; 8]);
    let near = LodLevel { below: 0.5, strands: 0.0, ..default() };
    app.world_mut().entity_mut(hair).insert(HairLod { levels: vec![near], ..default() });
    app.insert_resource(HairBudget { milliseconds: 1e-9, ..default() });
    run(&mut app, 0.5);
    let found = report(&mut app, hair).unwrap();
    assert_eq!((found.owner, found.why), (MotionOwner::Frozen, WhyMoved::OverBudget));
    assert_eq!((found.level, found.budget_levels), (1, 1));
}

#[test]
fn figures_are_those_that_others_measure() {
    let mut app = test_app(60.0);
    let (hair, strands) = hair(&mut app, &[0.1, 0.12, 0.14]);
    run(&mut app, 0.2);
    app.world_mut().write_message(SoakHair { target: strands[0], wetness: 0.6 });
    let (dryer, place) = Blower::blow_dry(Vec3::new(0.05, 0.0, 0.3), Vec3::new(0.05, 0.0, 0.0));
    let celsius = dryer.celsius;
    app.world_mut().spawn((dryer, place));
    run(&mut app, 0.2);
    app.world_mut().entity_mut(hair).insert(HairStyle::default());
    run(&mut app, 0.1);
    let found = report(&mut app, hair).unwrap();
    let ask = |In(hair): In<Entity>, c: HairCondition| {
        (c.wetness(hair), c.water(hair), c.kept_style(hair))
    };
    let (wetness, water, kept) = app.world_mut().run_system_cached_with(ask, hair).unwrap();
    assert!(wetness > 0.1 && water > 0.0);
    assert_eq!((found.wetness, found.water, found.kept_style), (wetness, water, kept));
    assert!(found.air > 22.5 && found.air <= celsius, "{found}");
    let strains = strands.iter().map(|id| strand(&app, *id).peak_strain());
    let worst = strains.zip(&strands).max_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
    assert_eq!((found.worst_strain, found.worst_strand), (worst.0, Some(*worst.1)));
    let speeds = strands.iter().flat_map(|id| strand(&app, *id).velocities());
    assert_eq!(found.fastest, speeds.map(|v| v.length()).fold(0.0, f32::max));

    // One that is stretched is named.
    let stretched = strands[1];
    app.world_mut().get_mut::<Strand>(stretched).unwrap().positions_mut()[8].x += 0.03;
    let found = report(&mut app, hair).unwrap();
    assert_eq!(found.worst_strand, Some(stretched));
    assert!(found.worst_strain > 1.0, "{found}");
}

#[test]
fn a_report_on_hair_or_its_wearer_is_filled_once_a_frame() {
    let mut app = test_app(60.0);
    let (first, _) = hair(&mut app, &[0.1, 0.1]);
    let (beard, _) = hair(&mut app, &[0.05]);
    let wearer = app.world_mut().spawn(HairReport::default()).id();
    for hair in [first, beard] {
        app.world_mut().entity_mut(hair).insert((WornBy(wearer), SleepSettings::never()));
    }
    app.world_mut().entity_mut(beard).insert(HairReport::default());
    app.world_mut().write_message(SoakHair { target: beard, wetness: 1.0 });
    run(&mut app, 0.1);
    let of = |app: &App, entity| app.world().get::<HairReport>(entity).cloned();
    assert_eq!(of(&app, first), None, "nobody asked");
    let (all, one) = (of(&app, wearer).unwrap(), of(&app, beard).unwrap());
    assert_eq!((all.strands, all.awake, one.strands), (3, 3, 1));
    assert!((all.wetness / one.wetness - 1.0 / 3.0).abs() < 1e-3, "{all}; {one}");
    assert_eq!(all.water, one.water);
    assert_eq!(report(&mut app, wearer).unwrap(), all, "asked and filled are the same");

    // It is not changed where nothing has.
    app.insert_resource(HairDefault(SleepSettings { speed: 1.0, turning: 10.0, ..default() }));
    app.world_mut().despawn(beard);
    app.world_mut().entity_mut(first).remove::<SleepSettings>();
    run(&mut app, 1.0);
    assert_eq!(of(&app, wearer).unwrap().owner, MotionOwner::Asleep);
    let before = app.world().entity(wearer).get_ref::<HairReport>().unwrap().last_changed();
    run(&mut app, 0.2);
    let after = app.world().entity(wearer).get_ref::<HairReport>().unwrap().last_changed();
    assert_eq!(before, after);
    app.world_mut().despawn(first);
    run(&mut app, 0.1);
    assert_eq!(of(&app, wearer), Some(HairReport::default()), "it wears none");
}
