//! What treatments, water and wind do to bonds of strands that are carried is there afterwards.

use super::{
    head::{carried, fewer},
    zoom,
};
use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// Twelve strands side by side that stand out, three of them simulated.
fn row() -> (App, Entity, Vec<Entity>) {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(AirDrag { rate: 6.0 }));
    let hair = app.world_mut().spawn((Hair, fewer(0.25))).id();
    let grow = |i: usize| {
        let points =
            [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|k| Vec3::new(0.03 * k as f32, 0.0, 0.01 * i as f32));
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
    };
    let ids: Vec<Entity> = (0..12).map(grow).collect();
    zoom(&mut app, hair, 0.1);
    app.update();
    assert_eq!(carried(&app, &ids).len(), 9);
    (app, hair, ids)
}

fn shape(app: &App, entity: Entity) -> Vec<Vec3> {
    let s = strand(app, entity);
    (0..s.edges()).map(|i| s.darboux(i).xyz()).collect()
}

#[test]
fn a_style_put_on_from_afar_is_there_from_near() {
    let (mut app, hair, ids) = row();
    app.world_mut().write_message(HairTreatment::wet(hair));
    run(&mut app, 3.0);
    let hung: Vec<_> = ids.iter().map(|e| (*e, shape(&app, *e))).collect();
    app.world_mut().write_message(HairTreatment::dry(hair));
    run(&mut app, 0.1);
    no_gravity(&mut app);
    zoom(&mut app, hair, 1.0);
    run(&mut app, 6.0);
    assert_eq!(carried(&app, &ids), []);
    for (e, hung) in hung {
        let now = shape(&app, e);
        let dot: f32 = now.iter().zip(&hung).map(|(a, b)| a.dot(*b)).sum();
        let kept = dot / hung.iter().map(|h| h.length_squared()).sum::<f32>();
        // The hydrogen bonds' influence.
        assert!((kept - 0.33).abs() < 0.01, "kept {kept}");
    }
}

#[test]
fn wind_dries_and_water_wets_followers() {
    let (mut app, hair, ids) = row();
    let rate = |app: &App, e: Entity| {
        let bonds = app.world().get::<Bonds>(e).unwrap();
        bonds.rates(BondKind::Hydrogen).sum::<f32>() / 8.0
    };
    app.world_mut().write_message(HairTreatment::wet(hair));
    run(&mut app, 1.0);
    assert!(ids.iter().all(|e| rate(&app, *e) == 0.0));
    let blower = Blower { strength: 20.0, ..default() };
    let at = Transform::from_xyz(0.1, 0.0, 0.4).looking_at(Vec3::new(0.1, 0.0, 0.0), Vec3::Y);
    let blower = app.world_mut().spawn((blower, at)).id();
    run(&mut app, 2.0);
    let dried: Vec<f32> = carried(&app, &ids).iter().map(|e| rate(&app, *e)).collect();
    println!("dried by wind: {dried:?}");
    assert!(dried.iter().all(|r| *r > 0.2), "{dried:?}");
    app.world_mut().despawn(blower);
    app.world_mut().write_message(HairTreatment::dry(hair));
    run(&mut app, 0.5);
    app.world_mut().write_message(SoakHair { target: hair, wetness: 1.0 });
    run(&mut app, 8.0);
    let wet: Vec<f32> = carried(&app, &ids).iter().map(|e| rate(&app, *e)).collect();
    assert!(wet.len() == 9 && wet.iter().all(|r| *r < 0.05), "{wet:?}");
    assert!(ids.iter().all(|e| strand(&app, *e).is_finite()));
}
