//! Every part of the plugin group that hair can do without really switches off.

use crate::{
    all_plugins::{ALL, BASIS, Switch},
    offscreen::Offscreen,
};
use bevy::{
    app::PluginGroupBuilder, mesh::skinning::SkinnedMeshInverseBindposes, prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{
    authoring::{attach::RootsOnMesh, plant::RootOnMesh},
    forces::{contact::ContactPlugin, environment::EnvironmentPlugin},
    keratin::treatment::TreatmentPlugin,
    prelude::*,
    render::HairFollowers,
    simulation::{lod::LodPlugin, settle::SettlePlugin, sleep::SleepPlugin, solve::SpringPlugin},
    water::WaterPlugin,
};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use std::sync::{Arc, Mutex};

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

pub fn each_part_switches_off_alone() {
    for (what, switch) in OPTIONAL {
        falls(what, switch(HairPlugins::default().build()));
    }
}

pub fn all_parts_switch_off_together() {
    let none = OPTIONAL.iter().fold(HairPlugins::default().build(), |group, (_, off)| off(group));
    falls("all of them", none);
}

/// A head of hair, drawn with these plugins.
fn is_drawn(what: &str, plugins: PluginGroupBuilder) {
    let mut scene = Offscreen::with_plugins(160, 120, plugins);
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

pub fn hair_is_drawn_without_any_one_of_them() {
    for (what, switch) in OPTIONAL {
        is_drawn(what, switch(HairPlugins::default().build()));
    }
}

pub fn hair_is_drawn_without_all_of_them() {
    let none = OPTIONAL.iter().fold(HairPlugins::default().build(), |group, (_, off)| off(group));
    is_drawn("all of them", none);
}

/// Where hair grows on a ball (m).
const ROOTS: [Vec3; 4] = [
    Vec3::new(0.0, 0.07, 0.01),
    Vec3::new(0.02, 0.07, 0.01),
    Vec3::new(0.04, 0.07, 0.01),
    Vec3::new(0.06, 0.07, 0.01),
];

/// An app without some plugins, with hair that uses most of what there is, after so many ticks; and the
/// strands.
fn used(without: &[Switch], ticks: u32) -> (App, Vec<Entity>) {
    let plugins = without.iter().fold(HairPlugins::default().build(), |group, off| off(group));
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default()))
        .init_asset::<Mesh>()
        .init_asset::<SkinnedMeshInverseBindposes>()
        .add_plugins(plugins)
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.finish();
    app.cleanup();
    let mesh = Sphere::new(0.08).mesh().ico(2).unwrap();
    let world = app.world_mut();
    let skin = world.resource_mut::<Assets<Mesh>>().add(mesh.clone());
    let head = world.spawn((Mesh3d(skin.clone()), Transform::default())).id();
    let roots = RootOnMesh::nearest(&mesh, ROOTS).unwrap();
    let roots = roots.into_iter().map(|(root, _)| root).collect();
    let rod = world.spawn((PermRod::default(), Transform::from_xyz(0.0, 0.2, 0.0))).id();
    let mut strands = Vec::new();
    for model in [StrandModel::Rod, StrandModel::MassSpring] {
        let tied = RootsOnMesh { mesh: Some(head), roots: Clone::clone(&roots), ..default() };
        let lod = (HairLod::default(), HairScreenShare(0.02));
        let look = (HairLook::default(), HairDye::default(), HairStyle::default());
        let hair = (Hair, model, Settling::default(), tied, lod, look, SimulateOn::Gpu);
        let hair = world.spawn((hair, HairView::default(), ChildOf(head))).id();
        for (i, place) in ROOTS.iter().enumerate() {
            let line: Vec<Vec3> = (0..6).map(|k| *place * (1.0 + 0.3 * k as f32)).collect();
            let mut strand = world.spawn((StrandOf(hair), Strand::from_polyline(&line).unwrap()));
            strands.push(strand.id());
            if i == 0 {
                strand.insert((WoundOn(rod), PermWinding::default()));
            }
        }
        world.write_message(SoakHair { target: hair, wetness: 1.5 });
        world.write_message(HairTreatment::lotion(hair));
        world.trigger(CaptureHairdo { entity: hair });
    }
    world.spawn((HairCollider::default(), Transform::from_xyz(0.0, -1.0, 0.0)));
    world.spawn((Blower::default(), Transform::from_xyz(0.1, 0.3, 0.0)));
    world.spawn((WindZone { velocity: Vec3::X, ..default() }, Transform::default()));
    world.spawn((Shower { rate: 200.0, ..default() }, Transform::from_xyz(0.0, 0.2, 0.3)));
    world.spawn((WaterVolume::default(), Transform::from_xyz(0.0, -3.0, 0.0)));
    world.spawn(Droplet::new(Vec3::Y * 0.1, 1e-8).unwrap());
    world.spawn((Mesh3d(skin), WearHair::new(HairPreset::Bob).on("nobody"), Transform::default()));
    app.insert_resource(HairWind { velocity: Vec3::X, ..default() });
    (0..ticks).for_each(|_| app.update());
    (app, strands)
}

/// Warnings and errors of the crate as they are logged: Bevy has some of its own about messages that no plugin
/// has registered.
#[derive(Clone, Default)]
struct Warnings(Arc<Mutex<Vec<String>>>);

impl tracing::field::Visit for Warnings {
    fn record_debug(&mut self, _: &tracing::field::Field, value: &dyn core::fmt::Debug) {
        self.0.lock().unwrap().push(format!("{value:?}"));
    }
}

impl tracing::Subscriber for Warnings {
    fn enabled(&self, about: &tracing::Metadata<'_>) -> bool {
        *about.level() <= tracing::Level::WARN && about.target().starts_with("bevy_keratin")
    }
    fn new_span(&self, _: &tracing::span::Attributes<'_>) -> tracing::span::Id {
        tracing::span::Id::from_u64(1)
    }
    fn record(&self, _: &tracing::span::Id, _: &tracing::span::Record<'_>) {}
    fn record_follows_from(&self, _: &tracing::span::Id, _: &tracing::span::Id) {}
    fn event(&self, event: &tracing::Event<'_>) {
        event.record(&mut self.clone());
    }
    fn enter(&self, _: &tracing::span::Id) {}
    fn exit(&self, _: &tracing::span::Id) {}
}

pub fn any_plugin_may_be_left_out_and_what_misses_it_says_so_once() {
    for (what, off) in ALL {
        let warnings = Warnings::default();
        let (app, strands) =
            tracing::subscriber::with_default(warnings.clone(), || used(&[off], 120));
        let planted: Vec<Vec3> = ROOTS.iter().chain(&ROOTS).map(|root| *root * 2.5).collect();
        let said = warnings.0.lock().unwrap();
        // Of what is missing alone, and nothing else twice either.
        let missing: Vec<_> = said.iter().filter(|w| w.contains("nothing without")).collect();
        // What would say so is missing itself: the component does.
        let (is_told, name) = match what {
            "WearPlugin" => (true, "HairPlugins"),
            _ => (BASIS.contains(&what), what),
        };
        assert_eq!(missing.len(), usize::from(is_told), "without {what}: {said:?}");
        let names_it = |w: &&String| w.contains(&format!("nothing without {name}:"));
        assert!(missing.iter().all(names_it), "without {what}: {said:?}");
        for (i, one) in said.iter().enumerate() {
            assert!(!said[..i].contains(one), "without {what}, again: {one}");
        }
        let strand = |s: &Entity| app.world().get::<Strand>(*s).unwrap();
        assert!(strands.iter().all(|s| strand(s).is_finite()), "without {what}");
        let tip = |s: &Entity| *strand(s).positions().last().unwrap();
        let moves =
            strands.iter().zip(&planted).any(|(s, tip_then)| tip(s).distance(*tip_then) > 1e-4);
        assert_eq!(moves, !["TickPlugin", "StrandPlugin"].contains(&what), "without {what}");
    }
}

pub fn any_set_of_plugins_may_be_left_out() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(37);
    for _ in 0..20 {
        let share = random.random_range(0.05..0.7);
        let off: Vec<_> = ALL.into_iter().filter(|_| random.random_bool(share)).collect();
        let (names, off): (Vec<_>, Vec<_>) = off.into_iter().unzip();
        let (app, strands) = used(&off, 12);
        let strand = |s: &Entity| app.world().get::<Strand>(*s).unwrap();
        assert!(strands.iter().all(|s| strand(s).is_finite()), "without {names:?}");
    }
}

pub fn nothing_falls_without_the_environment_and_nothing_hides_without_settling() {
    let mut app = App::new();
    let plugins = HairPlugins::default().build().disable::<EnvironmentPlugin>();
    app.add_plugins((MinimalPlugins, plugins.disable::<SettlePlugin>()));
    app.finish();
    let (hair, strand) = crate::common::one_strand(&mut app, 0.24, 8, Vec3::X);
    app.world_mut().entity_mut(hair).insert(Settling::default());
    run_ticks(&mut app, 30);
    let tip = app.world().get::<Strand>(strand).unwrap().positions()[8];
    assert!(tip.y.abs() < 1e-4, "the tip is at {tip}");
    assert!(!app.world().entity(hair).contains::<Settling>(), "it is drawn");
}
