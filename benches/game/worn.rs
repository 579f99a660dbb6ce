//! Rows of presets that a skinned figure wears by one component.

use crate::{PARTS, body, common, in_turns, print_parts, skeleton, time_parts};
use bevy::{
    mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    prelude::*,
};
use bevy_keratin::{authoring::plant::HairPreset, prelude::*};
use std::{thread::sleep, time::Duration};

/// The bones of the figure that walks.
#[derive(Resource)]
struct Walker(Entity, Vec<Entity>);

pub fn rows(threads: usize) {
    // `mark_dirty_trees` of Bevy 0.19 never returns without a thread in the compute pool.
    if threads < 2 {
        return;
    }
    let skin = body::mesh_of(0.009, 0.009);
    for preset in [HairPreset::Wavy, HairPreset::Straight, HairPreset::Coily, HairPreset::Long] {
        let name = format!("{preset:?}").to_lowercase();
        let (mut app, hair) = figure(threads, &skin, preset);
        let parts = std::env::var_os(PARTS).is_some();
        if parts {
            time_parts(&mut app);
        }
        let contact = preset.settings().contact;
        let without = StrandContact { strength: 0.0, ..contact };
        (0..90).for_each(|_| app.update());
        let [on, off] = in_turns(&mut app, |app, turn| {
            let contact = if turn == 0 { contact } else { without };
            app.world_mut().entity_mut(hair).insert(contact);
        });
        println!("{name} worn by a figure that walks | {threads} | on | {on:.2}");
        println!("{name} worn by a figure that walks | {threads} | off | {off:.2}");
        if parts {
            app.world_mut().entity_mut(hair).insert(contact);
            print_parts(&mut app);
        }
        let guides = app.world().get::<Strands>(hair).map_or(0, |strands| strands.len());
        let colliders = app.world_mut().query::<&HairCollider>().iter(app.world()).count();
        println!("{name} worn: {guides} guides, {colliders} colliders");
    }
}

/// A figure that walks and wears a preset.
fn figure(threads: usize, skin: &Mesh, preset: HairPreset) -> (App, Entity) {
    let mut app = common::app(threads);
    app.add_plugins((TransformPlugin, AssetPlugin::default()))
        .init_asset::<Mesh>()
        .init_asset::<SkinnedMeshInverseBindposes>()
        .add_plugins(HairPlugins::default())
        .insert_resource(HairDefault(SleepSettings::never()))
        .add_systems(FixedUpdate, walk);
    app.finish();
    app.cleanup();
    let world = app.world_mut();
    let (root, bones) = skeleton::spawn(&mut world.commands());
    world.flush();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(skin.clone());
    let inverse_bindposes = world
        .resource_mut::<Assets<SkinnedMeshInverseBindposes>>()
        .add(SkinnedMeshInverseBindposes::from(skeleton::inverse_poses()));
    let joints = bones.clone();
    world.spawn((Mesh3d(mesh), SkinnedMesh { inverse_bindposes, joints }, ChildOf(root)));
    world.entity_mut(root).insert(WearHair::new(preset).facing(Dir3::Z));
    world.insert_resource(Walker(root, bones));
    let hair = (0..6000).find_map(|_| {
        app.update();
        sleep(Duration::from_millis(2));
        let mut worn = app.world_mut().query_filtered::<Entity, With<WornAs>>();
        worn.iter(app.world()).next()
    });
    (app, hair.expect("hair is worn"))
}

fn walk(time: Res<Time>, walker: Res<Walker>, mut places: Query<&mut Transform>) {
    let seconds = time.elapsed_secs_wrapped();
    let bones = walker.1.iter().copied().zip(skeleton::walk(seconds));
    for (entity, now) in bones.chain([(walker.0, skeleton::path(seconds))]) {
        if let Ok(mut place) = places.get_mut(entity) {
            *place = now;
        }
    }
}
