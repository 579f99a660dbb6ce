//! Every part of the plugin group that hair can do without really switches off.

use crate::offscreen::Offscreen;
use bevy::{app::PluginGroupBuilder, prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{
    forces::contact::ContactPlugin,
    keratin::treatment::TreatmentPlugin,
    prelude::*,
    render::HairFollowers,
    simulation::{lod::LodPlugin, sleep::SleepPlugin, solve::SpringPlugin},
    water::WaterPlugin,
};

type Switch = fn(PluginGroupBuilder) -> PluginGroupBuilder;

const OPTIONAL: [(&str, Switch); 6] = [
    ("water", |group| group.disable::<WaterPlugin>()),
    ("springs", |group| group.disable::<SpringPlugin>()),
    ("contact", |group| group.disable::<ContactPlugin>()),
    ("treatment", |group| group.disable::<TreatmentPlugin>()),
    ("sleep", |group| group.disable::<SleepPlugin>()),
    ("level of detail", |group| group.disable::<LodPlugin>()),
];

/// A strand held out level, with everything around that the switched-off parts would have looked at.
fn falls(what: &str, plugins: PluginGroupBuilder) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, plugins))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.finish();
    app.cleanup();
    let (hair, strand) = crate::common::one_strand(&mut app, 0.24, 8, Vec3::X);
    app.world_mut().entity_mut(hair).insert((HairLod::default(), HairView::default()));
    app.world_mut().spawn((Blower::default(), Transform::from_xyz(0.1, 0.3, 0.0)));
    app.world_mut().spawn((HairCollider::default(), Transform::from_xyz(0.0, -1.0, 0.0)));
    for _ in 0..30 {
        app.update();
    }
    let strand = app.world().get::<Strand>(strand).unwrap();
    let tip = strand.positions()[8];
    assert!(strand.is_finite() && tip.y < -0.05, "without {what} the tip is at {tip}");
}

#[test]
fn each_part_switches_off_alone() {
    for (what, switch) in OPTIONAL {
        falls(what, switch(HairPlugins::default().build()));
    }
}

#[test]
fn all_parts_switch_off_together() {
    let none = OPTIONAL.iter().fold(HairPlugins::default().build(), |group, (_, off)| off(group));
    falls("all of them", none);
}

/// A head of hair, drawn with these plugins.
fn is_drawn(what: &str, plugins: PluginGroupBuilder) {
    let Some(mut scene) = Offscreen::with_plugins(160, 120, plugins) else { return };
    let hair = scene.app.world_mut().spawn((Hair, HairFollowers::new(300))).id();
    scene.app.world_mut().spawn((DirectionalLight::default(), Transform::default()));
    for line in crate::offscreen::head_of_guides(60, 0.1, 0.1, 6) {
        scene.app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&line).unwrap()));
    }
    scene.ticking(1);
    scene.look(Vec3::new(0.0, 0.1, 0.6), Vec3::ZERO);
    let covered = scene.draw().covered([0; 3]);
    assert!(covered > 300, "without {what}: {covered} pixels of hair");
}

#[test]
fn hair_is_drawn_without_any_one_of_them() {
    for (what, switch) in OPTIONAL {
        is_drawn(what, switch(HairPlugins::default().build()));
    }
}

#[test]
fn hair_is_drawn_without_all_of_them() {
    let none = OPTIONAL.iter().fold(HairPlugins::default().build(), |group, (_, off)| off(group));
    is_drawn("all of them", none);
}
