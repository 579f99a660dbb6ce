//! From a character to its hair and back: what is put on it or asked of it acts on its hair, or is told.

use crate::common::*;
#[cfg(all(feature = "groom", feature = "save"))]
use crate::{
    wear::{self, app, groom, wait, worn},
    without_a_device::Reported as Logged,
    worlds_measured::wearer::{ball, character},
};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{FaultKind, HairEstimate, LodLevel, PresentLod, prelude::*};
use std::time::Duration;

/// Character that wears a hair of one strand, made by hand.
fn wearing(app: &mut App) -> (Entity, Entity) {
    let (hair, _) = one_strand(app, 0.24, 8, Vec3::NEG_Y);
    let character = app.world_mut().spawn(Transform::default()).id();
    app.world_mut().entity_mut(hair).insert(WornBy(character));
    (character, hair)
}

fn hairs(app: &App, character: Entity) -> Vec<Entity> {
    app.world().get::<WornHair>(character).map_or_else(Vec::new, |worn| worn.iter().collect())
}

fn drag(app: &App, entity: Entity) -> Option<f32> {
    app.world().get::<AirDrag>(entity).map(|drag| drag.rate)
}

#[test]
fn what_is_put_on_a_wearer_acts_on_its_hair_until_it_is_removed() {
    let mut app = test_app(60.0);
    let (character, hair) = wearing(&mut app);
    app.world_mut().entity_mut(hair).insert(StrandContact { radius: 2e-3, ..default() });
    app.world_mut().entity_mut(character).insert((
        AirDrag { rate: 5.0 },
        HairDye::pink(),
        HairLod::default(),
        StrandContact { radius: 3e-3, ..default() },
    ));
    app.update();
    assert_eq!(drag(&app, hair), Some(5.0));
    assert_eq!(app.world().get::<HairDye>(hair), Some(&HairDye::pink()));
    assert_eq!(app.world().get::<HairLod>(hair), Some(&HairLod::default()));
    // What was written last holds.
    app.world_mut().entity_mut(hair).insert(AirDrag { rate: 9.0 });
    (0..3).for_each(|_| app.update());
    assert_eq!(drag(&app, hair), Some(9.0));
    // A second hair has what its wearer has; the first keeps its own.
    let (beard, _) = one_strand(&mut app, 0.03, 3, Vec3::X);
    app.world_mut().entity_mut(beard).insert(WornBy(character));
    app.update();
    assert_eq!(hairs(&app, character), [hair, beard]);
    assert_eq!([hair, beard].map(|hair| drag(&app, hair)), [Some(9.0), Some(5.0)]);
    app.world_mut().get_mut::<AirDrag>(character).unwrap().rate = 7.0;
    app.update();
    assert_eq!([hair, beard].map(|hair| drag(&app, hair)), [Some(7.0); 2]);
    // Without it they have again what they had.
    app.world_mut().entity_mut(character).remove::<(AirDrag, HairDye, StrandContact)>();
    app.update();
    assert_eq!([hair, beard].map(|hair| drag(&app, hair)), [None; 2]);
    assert!(app.world().get::<HairDye>(hair).is_none());
    let radius = |hair| app.world().get::<StrandContact>(hair).map(|contact| contact.radius);
    assert_eq!([hair, beard].map(radius), [Some(2e-3), None]);
    assert_eq!(faults(&mut app), []);
}

#[test]
fn a_copy_of_a_character_acts_on_its_own_hair() {
    let mut app = test_app(60.0);
    let (character, hair) = wearing(&mut app);
    app.world_mut().entity_mut(hair).insert(ChildOf(character));
    app.world_mut().entity_mut(character).insert(AirDrag { rate: 5.0 });
    app.update();
    let copy = app.world_mut().entity_mut(character).clone_and_spawn_with_opt_out(|cloner| {
        cloner.linked_cloning(true);
    });
    app.update();
    let [own] = hairs(&app, copy)[..] else { panic!("{:?}", hairs(&app, copy)) };
    assert_ne!(own, hair);
    assert_eq!(hairs(&app, character), [hair]);
    app.world_mut().get_mut::<AirDrag>(copy).unwrap().rate = 6.0;
    app.update();
    assert_eq!([hair, own].map(|hair| drag(&app, hair)), [Some(5.0), Some(6.0)]);
    app.world_mut().entity_mut(copy).remove::<AirDrag>();
    app.update();
    assert_eq!([hair, own].map(|hair| drag(&app, hair)), [Some(5.0), None]);
    app.world_mut().entity_mut(character).despawn();
    app.update();
    assert_eq!(faults(&mut app), []);
}

#[derive(Resource, Default)]
struct Told(Vec<Entity>);

#[test]
#[cfg(feature = "save")]
fn requests_take_a_wearer_and_answer_it() {
    let mut app = test_app(60.0);
    let (character, hair) = wearing(&mut app);
    let (other, _) = wearing(&mut app);
    app.init_resource::<Told>();
    app.world_mut().entity_mut(character).observe(
        |dried: On<HairDried>, mut told: ResMut<Told>| told.0.push(dried.original_event_target()),
    );
    app.world_mut().trigger(SoakHair { target: character, wetness: 1.0 });
    app.update();
    fn wetness(In(of): In<[Entity; 2]>, condition: HairCondition) -> [f32; 2] {
        of.map(|of| condition.wetness(of))
    }
    let ask = |app: &mut App, of: [Entity; 2]| {
        app.world_mut().run_system_cached_with(wetness, of).unwrap()
    };
    let [own, of_hair] = ask(&mut app, [character, hair]);
    assert!(own > 0.9 && own == of_hair, "{own} {of_hair}");
    assert_eq!(ask(&mut app, [other, other]), [0.0; 2]);
    app.world_mut().resource_mut::<HairProcessTime>().0 = 1e5;
    run(&mut app, 1.0);
    assert_eq!(app.world().resource::<Told>().0, [hair], "its wearer is told that it has dried");

    app.world_mut().write_message(HairTreatment::lotion(character).over(1e6));
    app.update();
    let acting = |app: &App, hair: Entity| {
        let strand = app.world().get::<Strands>(hair).unwrap().collection()[0];
        app.world()
            .get::<bevy_keratin::keratin::treatment::Treatments>(strand)
            .unwrap()
            .acting()
            .len()
    };
    assert_eq!(acting(&app, hair), 1);

    app.world_mut().entity_mut(character).observe(
        move |taken: On<HairdoCaptured>, mut commands: Commands| {
            commands.trigger(ApplyHairdo { entity: other, hairdo: taken.hairdo.clone() });
        },
    );
    app.world_mut()
        .entity_mut(other)
        .observe(|applied: On<HairdoApplied>, mut told: ResMut<Told>| told.0.push(applied.entity));
    app.world_mut().trigger(CaptureHairdo { entity: character });
    app.world_mut().flush();
    assert_eq!(app.world().resource::<Told>().0, [hair, other]);
    assert_eq!(Hairdo::of(app.world(), character), Hairdo::of(app.world(), hair));
    let strand = app.world().get::<Strands>(hair).unwrap().collection()[0];
    app.world_mut().get_mut::<Strand>(strand).unwrap().positions_mut()[8].x = 0.1;
    app.world_mut().commands().entity(character).queue(Hair::reset);
    app.world_mut().flush();
    assert!(app.world().get::<Strand>(strand).unwrap().positions()[8].x.abs() < 1e-3);

    // Of two, one has to be named; a treatment is of both.
    let (beard, _) = one_strand(&mut app, 0.03, 3, Vec3::X);
    app.world_mut().entity_mut(beard).insert(WornBy(character));
    let error = Hairdo::of(app.world(), character).unwrap_err();
    let message = error.to_string();
    assert!(message.contains(&format!("{hair} and {beard}")), "{message}");
    app.world_mut().trigger(HairTreatment::lotion(character).over(1e6));
    app.update();
    assert_eq!([hair, beard].map(|hair| acting(&app, hair)), [2, 1]);
    assert_eq!(faults(&mut app), []);
}

#[test]
fn what_is_neither_hair_nor_wearer_is_told_where_hair_is() {
    let mut app = test_app(60.0);
    let (character, hair) = wearing(&mut app);
    let player = app.world_mut().spawn(Transform::default()).id();
    app.world_mut().entity_mut(character).insert(ChildOf(player));
    let bone = app.world_mut().spawn((Transform::default(), ChildOf(character))).id();
    app.world_mut().trigger(SoakHair::dripping(bone));
    app.world_mut().trigger(HairTreatment::wet(player));
    app.world_mut().entity_mut(bone).insert(HairDye::pink());
    app.world_mut().commands().entity(player).queue(Hair::reset);
    // One that is put on before the hair is no stray.
    let early = app.world_mut().spawn(HairDye::pink()).id();
    run(&mut app, 1.0);
    let (late, _) = one_strand(&mut app, 0.03, 3, Vec3::X);
    app.world_mut().entity_mut(late).insert(WornBy(early));
    run(&mut app, 2.0);
    let reported = faults(&mut app);
    let expected =
        [("SoakHair", bone), ("HairTreatment", player), ("HairDye", bone), ("Hair::reset", player)];
    for (what, entity) in expected {
        let of: Vec<_> = reported.iter().filter(|fault| fault.message.contains(what)).collect();
        assert_eq!(of.len(), 1, "{what}: {reported:?}");
        assert_eq!((of[0].kind, of[0].entity), (FaultKind::NoTarget, Some(entity)), "{what}");
        let there = format!("{character} wears {hair}");
        assert!(of[0].message.contains(&there), "{what}: {}", of[0].message);
    }
    assert_eq!(reported.len(), 4, "{reported:?}");
}

#[test]
fn a_default_gives_all_hair_levels_of_detail() {
    let mut app = test_app(60.0);
    let hair = [0, 1].map(|_| one_strand(&mut app, 0.24, 8, Vec3::NEG_Y).0);
    let own = HairLod { levels: vec![], ..default() };
    app.world_mut().entity_mut(hair[1]).insert(own);
    for hair in hair {
        **app.world_mut().get_mut::<HairScreenShare>(hair).unwrap() = 0.1;
    }
    let levels = |app: &App| hair.map(|hair| app.world().get::<PresentLod>(hair).unwrap().level);
    app.update();
    assert_eq!(levels(&app), [0, 0]);
    app.insert_resource(HairDefault(HairLod::default()));
    app.update();
    assert_eq!(levels(&app), [2, 0]);
    app.insert_resource(HairDefault(HairLod { levels: vec![LodLevel::FROZEN], ..default() }));
    app.update();
    assert_eq!(levels(&app), [0, 0]);
}

#[test]
fn the_budget_counts_all_hair_and_tells_which_it_leaves_out() {
    let mut app = test_app(60.0);
    let hair = [0, 1].map(|_| one_strand(&mut app, 0.24, 200, Vec3::NEG_Y).0);
    app.update();
    let both = *app.world().resource::<HairEstimate>();
    app.world_mut().entity_mut(hair[0]).insert(HairLod::default());
    app.update();
    assert!(both.present > 0.02);
    assert_eq!(*app.world().resource::<HairEstimate>(), both, "with levels it costs the same");
    app.insert_resource(HairBudget { milliseconds: 0.9 * both.present, ..default() });
    (0..3).for_each(|_| app.update());
    assert!(app.world().get::<PresentLod>(hair[0]).unwrap().budget_levels > 0);
    let estimate = *app.world().resource::<HairEstimate>();
    assert!(estimate.unbudgeted == both.present && estimate.present < 0.9 * both.present);
    let reported = faults(&mut app);
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert_eq!(reported[0].entity, Some(hair[1]));
    assert!(reported[0].message.contains("without HairLod"), "{reported:?}");
    // Rain makes hair dearer.
    app.world_mut().trigger(SoakHair::dripping(hair[1]));
    (0..3).for_each(|_| app.update());
    assert!(app.world().resource::<HairEstimate>().unbudgeted > 1.2 * both.present);
}

#[test]
fn hair_without_levels_on_purpose_is_not_told() {
    let mut app = test_app(60.0);
    let hair = [0, 1].map(|_| one_strand(&mut app, 0.24, 200, Vec3::NEG_Y).0);
    app.world_mut().entity_mut(hair[0]).insert(HairLod::default());
    app.world_mut().entity_mut(hair[1]).insert(HairLod { levels: vec![], ..default() });
    app.update();
    let milliseconds = 0.9 * app.world().resource::<HairEstimate>().present;
    app.insert_resource(HairBudget { milliseconds, ..default() });
    (0..3).for_each(|_| app.update());
    assert!(app.world().get::<PresentLod>(hair[0]).unwrap().budget_levels > 0);
    assert_eq!(faults(&mut app), []);
}

/// Characters that pop in: each hair waits while it has no size, and nothing is reported.
#[test]
fn a_scale_of_zero_is_not_reported() {
    let mut app = test_app(60.0);
    let all: Vec<_> = (0..3).map(|_| wearing(&mut app)).collect();
    for (character, hair) in &all {
        app.world_mut().entity_mut(*hair).insert(ChildOf(*character));
    }
    for scale in [1.0, 0.5, 0.0, 0.0, 0.0, 1e-12, 0.2, 1.0, 1.0] {
        for (character, _) in &all {
            let mut place = app.world_mut().get_mut::<Transform>(*character).unwrap();
            place.scale = Vec3::splat(scale);
        }
        (0..3).for_each(|_| app.update());
    }
    assert_eq!(faults(&mut app), []);
    for (_, hair) in &all {
        let strand = app.world().get::<Strands>(*hair).unwrap().collection()[0];
        let strand = app.world().get::<Strand>(strand).unwrap();
        let tip = strand.positions()[8];
        assert!(strand.peak_strain() < 0.01 && tip.distance(Vec3::NEG_Y * 0.24) < 0.02, "{tip}");
    }
}

#[test]
fn a_copy_without_strands_is_told_once() {
    let mut app = test_app(60.0);
    let (hair, _) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
    app.update();
    let copy = app.world_mut().entity_mut(hair).clone_and_spawn();
    let whole = app.world_mut().entity_mut(hair).clone_and_spawn_with_opt_out(|cloner| {
        cloner.linked_cloning(true);
    });
    assert_eq!(app.world().get::<Strands>(whole).unwrap().len(), 1);
    // Hair that is to get its strands later, and hair that is shaved.
    app.world_mut().spawn(Hair);
    app.world_mut().entity_mut(hair).despawn_related::<Strands>();
    (0..5).for_each(|_| app.update());
    let reported = faults(&mut app);
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert_eq!((reported[0].kind, reported[0].entity), (FaultKind::Strand, Some(copy)));
    assert!(reported[0].message.contains("linked_cloning"), "{}", reported[0].message);
}

#[test]
fn a_schedule_that_does_not_run_again_is_told_once() {
    let told = |plugins: HairPlugins| {
        let mut app = App::new();
        let frame = Duration::from_millis(100);
        app.add_plugins((MinimalPlugins, plugins))
            .insert_resource(TimeUpdateStrategy::ManualDuration(frame))
            .init_resource::<Reported>()
            .add_systems(Last, |mut new: MessageReader<HairFault>, mut all: ResMut<Reported>| {
                all.0.extend(new.read().cloned());
            });
        one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
        (0..40).for_each(|_| app.update());
        app.world_mut().remove_resource::<Reported>().unwrap().0
    };
    #[derive(Resource, Default)]
    struct Reported(Vec<HairFault>);
    let reported = told(HairPlugins::new(Startup));
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert!(reported[0].message.contains("HairPlugins::new(Startup)"), "{}", reported[0].message);
    for plugins in [HairPlugins::default(), HairPlugins::new(FixedUpdate), HairPlugins::new(Update)]
    {
        assert_eq!(told(plugins), []);
    }
}

/// An app that draws, but has no device to do it.
#[cfg(feature = "render")]
mod drawn {
    use super::*;
    use bevy::{
        camera::visibility::{NoFrustumCulling, RenderLayers},
        light::{NotShadowCaster, NotShadowReceiver},
        render::{RenderPlugin, settings::WgpuSettings},
    };
    use bevy_keratin::render::HairBuffers;

    #[test]
    fn what_cameras_and_lights_see_is_set_on_a_hair_or_its_wearer() {
        let render = RenderPlugin {
            render_creation: WgpuSettings { backends: None, ..default() }.into(),
            ..default()
        };
        let mut app = App::new();
        app.add_plugins((
            DefaultPlugins
                .set(render)
                .disable::<bevy::winit::WinitPlugin>()
                .disable::<bevy::log::LogPlugin>(),
            HairPlugins::default(),
        ))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        app.finish();
        app.cleanup();
        let (character, hair) = wearing(&mut app);
        app.world_mut().entity_mut(character).insert(Visibility::default());
        let layers = |layer: usize| RenderLayers::layer(layer);
        app.world_mut().entity_mut(hair).insert((layers(3), NotShadowCaster));
        (0..3).for_each(|_| app.update());
        let child = app.world().get::<HairBuffers>(hair).unwrap().drawn;
        fn of(app: &App, entity: Entity) -> EntityRef<'_> {
            app.world().entity(entity)
        }
        // On the hair.
        assert_eq!(of(&app, child).get::<RenderLayers>(), Some(&layers(3)));
        assert!(of(&app, child).contains::<NotShadowCaster>());
        app.world_mut().entity_mut(hair).insert((layers(4), NotShadowReceiver, NoFrustumCulling));
        app.world_mut().entity_mut(hair).remove::<NotShadowCaster>();
        app.update();
        assert_eq!(of(&app, child).get::<RenderLayers>(), Some(&layers(4)));
        assert!(of(&app, child).contains::<NotShadowReceiver>());
        assert!(of(&app, child).contains::<NoFrustumCulling>());
        assert!(!of(&app, child).contains::<NotShadowCaster>());
        // On its wearer, in the same frame.
        app.world_mut().entity_mut(character).insert((layers(5), NotShadowCaster));
        app.update();
        assert_eq!(of(&app, child).get::<RenderLayers>(), Some(&layers(5)));
        assert!(of(&app, child).contains::<NotShadowCaster>());
        app.world_mut().entity_mut(character).remove::<(RenderLayers, NotShadowCaster)>();
        app.world_mut().entity_mut(hair).remove::<(NotShadowReceiver, NoFrustumCulling)>();
        (0..2).for_each(|_| app.update());
        assert_eq!(of(&app, child).get::<RenderLayers>(), Some(&layers(4)));
        let any = of(&app, child).contains::<NotShadowCaster>()
            || of(&app, child).contains::<NotShadowReceiver>()
            || of(&app, child).contains::<NoFrustumCulling>();
        assert!(!any);
        // With a wearer that it is not below, and by itself.
        let is_seen = |app: &App| of(app, child).get::<InheritedVisibility>().unwrap().get();
        assert!(is_seen(&app));
        for entity in [character, hair] {
            for (visibility, seen) in [(Visibility::Hidden, false), (Visibility::Inherited, true)] {
                *app.world_mut().get_mut::<Visibility>(entity).unwrap() = visibility;
                app.update();
                assert_eq!(is_seen(&app), seen, "{visibility:?}");
            }
        }
    }
}

#[cfg(all(feature = "groom", feature = "save"))]
mod worn_by_one_component {
    use super::*;
    use bevy::world_serialization::{WorldAsset, WorldAssetRoot};

    /// A character that wears a groom.
    fn dressed(app: &mut App, with: impl Bundle) -> (Entity, Entity) {
        let groom = app.world_mut().resource_mut::<Assets<_>>().add(groom());
        let wear = WearHair { colliders: false, ..WearHair::new(groom) };
        let root = app.world_mut().spawn((Transform::default(), wear, with)).id();
        character(app, root, 1.0);
        (root, worn(app))
    }

    #[test]
    fn what_a_wearer_has_stays_when_its_hair_is_swapped() {
        let mut app = app();
        let (root, hair) = dressed(&mut app, AirDrag { rate: 5.0 });
        assert_eq!(hairs(&app, root), [hair]);
        assert_eq!(app.world().get::<WornBy>(hair), Some(&WornBy(root)));
        assert_eq!(drag(&app, hair), Some(5.0), "from its first frame on");
        app.world_mut().get_mut::<WearHair>(root).unwrap().seed = 1;
        let other = worn(&mut app);
        assert_ne!(other, hair);
        assert_eq!((hairs(&app, root), drag(&app, other)), (vec![other], Some(5.0)));
        app.world_mut().entity_mut(root).remove::<WearHair>();
        (0..2).for_each(|_| app.update());
        assert_eq!(hairs(&app, root), []);
        assert!(app.world().get_entity(other).is_err());
        assert_eq!(faults(&mut app), []);
    }

    #[test]
    fn a_default_acts_on_what_is_not_the_presets_own() {
        let mut app = app();
        app.insert_resource(HairDefault(AirDrag { rate: 5.0 }))
            .insert_resource(HairDefault(HairSolver { substep: 1.0 / 90.0, ..default() }));
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(ball(0.1));
        let wear = WearHair { colliders: false, ..WearHair::new(HairPreset::Short) };
        let head = app.world_mut().spawn((Mesh3d(mesh), Transform::default(), wear)).id();
        let hair = worn(&mut app);
        let own = HairPreset::Short.settings();
        let entity = app.world().entity(hair);
        assert!(!entity.contains::<AirDrag>() && !entity.contains::<HairSolver>());
        assert!(!entity.contains::<Sweeps>() && !entity.contains::<HairLod>());
        assert_eq!(entity.get::<HairStiffness>(), Some(&own.stiffness));
        assert_eq!(entity.get::<StrandContact>(), Some(&own.contact));
        // One on the wearer is stronger than the preset's; without it that holds again.
        let soft = HairStiffness { bending_length: 0.03, ..default() };
        app.world_mut().entity_mut(head).insert(soft);
        app.update();
        assert_eq!(app.world().get::<HairStiffness>(hair), Some(&soft));
        app.world_mut().entity_mut(head).remove::<HairStiffness>();
        app.update();
        assert_eq!(app.world().get::<HairStiffness>(hair), Some(&own.stiffness));
    }

    #[test]
    fn forgotten_plugins_are_told_once() {
        let logged = Logged::default();
        tracing::subscriber::with_default(logged.clone(), || {
            let mut app = App::new();
            app.add_plugins(MinimalPlugins);
            for _ in 0..3 {
                app.world_mut().spawn(WearHair::default());
            }
            app.update();
            let mut scene = World::new();
            scene.spawn(WearHair::default());
            scene.flush();
            wear::app().world_mut().spawn(WearHair::default());
        });
        let logged = logged.0.lock().unwrap();
        assert_eq!(logged.len(), 1, "{logged:?}");
        assert!(logged[0].contains("HairPlugins"), "{logged:?}");
    }

    #[test]
    fn a_scene_that_was_not_loaded_is_named() {
        let mut app = app_with_meshes(2.0);
        app.init_asset::<WorldAsset>()
            .register_type::<WorldAssetRoot>()
            .init_resource::<wear::Reported>()
            .add_observer(|not: On<HairNotWorn>, mut reported: ResMut<wear::Reported>| {
                reported.refused.push((not.entity, not.error.clone()));
            });
        let scene = app.world().resource::<AssetServer>().load("models/nobody.scn.ron");
        let root = app.world_mut().spawn((WorldAssetRoot(scene), WearHair::default())).id();
        let refused = wait(&mut app).refused;
        assert_eq!(refused[0].0, root);
        let message = refused[0].1.to_string();
        assert!(message.contains("models/nobody.scn.ron was not loaded"), "{message}");
        assert_eq!(faults(&mut app).len(), 1);
    }
}
