//! Scenes: characters and worlds that are written as text, and read in the same app or a new one.

use super::{
    Row, apart, app_with_meshes,
    copies::{
        Copied, HEAD, LONG, Pair, count, everything, groomed, hair_of, head, longest, off_skin,
        pair, place, roots_in_world,
    },
    fault_count, one_strand, run, strand,
};
use bevy::{
    asset::{io::memory::Dir, uuid::Uuid},
    ecs::{entity::EntityHashMap, reflect::AppTypeRegistry},
    mesh::{
        Mesh, Mesh3d,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
    world_serialization::{DynamicWorld, DynamicWorldBuilder},
};
use bevy_keratin::{authoring::groom::Groom, prelude::*};
use std::{path::Path, thread::sleep, time::Duration};

/// The files that an app reads.
#[derive(Resource, Clone, Default)]
pub(super) struct Files(pub(super) Dir);

/// Numbers of assets.
const MESH: u128 = 1;
const BIND: u128 = 2;
const GROOM: u128 = 3;

/// What an asset is called in all apps, as one from a file is.
fn name<A: Asset>(number: u128) -> AssetId<A> {
    AssetId::Uuid { uuid: Uuid::from_u128(number) }
}

fn named<A: Asset>(app: &mut App, handle: &Handle<A>, number: u128) -> Handle<A> {
    let mut assets = app.world_mut().resource_mut::<Assets<A>>();
    let asset = assets.remove(handle).unwrap();
    assets.insert(name::<A>(number), asset).unwrap();
    Handle::from(Uuid::from_u128(number))
}

/// Names the assets of a character.
pub(super) fn name_assets(app: &mut App, root: Entity) {
    for id in everything(app.world(), root) {
        if let Some(mesh) = app.world().get::<Mesh3d>(id).cloned() {
            let mesh = named(app, &mesh.0, MESH);
            app.world_mut().entity_mut(id).insert(Mesh3d(mesh));
        }
        if let Some(skin) = app.world().get::<SkinnedMesh>(id).cloned() {
            let bind = named(app, &skin.inverse_bindposes, BIND);
            app.world_mut().get_mut::<SkinnedMesh>(id).unwrap().inverse_bindposes = bind;
        }
        let wear = app.world().get::<WearHair>(id).map(|wear| wear.hair.clone());
        if let Some(HairSource::Groom { groom, guides }) = wear {
            let groom = named(app, &groom, GROOM);
            let hair = HairSource::Groom { groom, guides };
            app.world_mut().get_mut::<WearHair>(id).unwrap().hair = hair;
        }
    }
}

/// Others, whose entities have the numbers of those in a scene.
fn strangers(app: &mut App) {
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(head(HEAD));
    for _ in 0..400 {
        let stranger = Transform::from_xyz(5.0, 0.0, 0.0);
        app.world_mut().spawn((Mesh3d(mesh.clone()), stranger));
    }
    run(app, 0.05);
}

/// What scenes need to know of Bevy's components.
fn register(app: &mut App) {
    app.register_type::<Transform>()
        .register_type::<ChildOf>()
        .register_type::<Children>()
        .register_type::<Name>()
        .register_type::<Mesh3d>()
        .register_type::<SkinnedMesh>();
}

/// A character as text.
pub(super) fn save(app: &mut App, root: Entity) -> String {
    register(app);
    let all = everything(app.world(), root);
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let saved = DynamicWorldBuilder::from_world(app.world(), &registry)
        .extract_entities(all.into_iter())
        .build();
    saved.serialize(&registry).unwrap()
}

/// Reads a scene, while time stands still.
fn read(app: &mut App, saved: &str) -> DynamicWorld {
    register(app);
    let file = "saved.scn.ron";
    app.world().resource::<Files>().0.insert_asset_text(Path::new(file), saved);
    let scene = app.world().resource::<AssetServer>().load::<DynamicWorld>(file);
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    for _ in 0..4000 {
        app.update();
        if let Some(read) = app.world_mut().resource_mut::<Assets<DynamicWorld>>().remove(&scene) {
            app.world_mut().resource_mut::<Time<Virtual>>().unpause();
            return read;
        }
        let state = app.world().resource::<AssetServer>().load_state(&scene);
        assert!(!state.is_failed(), "{state:?}");
        sleep(Duration::from_millis(2));
    }
    panic!("no scene is read after 8 s");
}

pub(super) fn load(app: &mut App, saved: &str) -> EntityHashMap<Entity> {
    let mut map = EntityHashMap::default();
    read(app, saved).write_to_world(app.world_mut(), &mut map).unwrap();
    map
}

/// Line 14: hair on a mesh of twice its size, saved and loaded beside the original, or into an app with strangers:
/// the longest strand (m), how far roots are off the loaded mesh after that has moved (m), and faults.
fn loaded(elsewhere: bool) -> [f32; 3] {
    let mut own = groomed(2.0);
    let world = own.app.world_mut();
    let top = world.spawn(Transform::default()).id();
    world.entity_mut(top).add_children(&[own.body, own.hair]);
    name_assets(&mut own.app, own.body);
    run(&mut own.app, 0.1);
    let saved = save(&mut own.app, top);
    if elsewhere {
        own.app = app_with_meshes();
        own.app.insert_resource(HairGravity(Vec3::ZERO));
        own.app.world_mut().resource_mut::<Assets<Mesh>>().insert(name(MESH), head(HEAD)).unwrap();
        strangers(&mut own.app);
    }
    let map = load(&mut own.app, &saved);
    (own.body, own.hair) = (map[&own.body], map[&own.hair]);
    run(&mut own.app, 0.1);
    let there = place(2.0).with_rotation(Quat::from_rotation_x(0.6));
    *own.app.world_mut().get_mut::<Transform>(own.body).unwrap() = there;
    run(&mut own.app, 0.2);
    let off = off_skin(&own, 1, |p| there.transform_point(p));
    [longest(&own.app, own.hair), off, fault_count(&own.app)]
}

/// How far two hairs are from each other in what makes their look.
#[derive(Clone, Copy, Debug, Default)]
struct Differs {
    /// The most of any rate or memory of bonds.
    bonds: f32,
    /// Of lengths and of nodes, seen from the hair (m).
    length: f32,
    nodes: f32,
    /// Of the water on and in any strand, as a share.
    water: f32,
    /// Of the share of the style that is kept; 1 where one has none, or another dye.
    style: f32,
}

impl Differs {
    fn between([(a, hair_a), (b, hair_b)]: [(&App, Entity); 2]) -> Self {
        let members = |app: &App, hair| -> Vec<(Strand, Bonds, f64)> {
            let world = app.world();
            let members = world.get::<Strands>(hair).unwrap().iter();
            let water = |id| world.get::<Moisture>(id).map_or(0.0, Moisture::volume);
            let bonds = |id| world.get::<Bonds>(id).cloned().unwrap_or_default();
            members.map(|id| (strand(app, id), bonds(id), water(id))).collect()
        };
        let (all, other) = (members(a, hair_a), members(b, hair_b));
        let far = f32::INFINITY;
        if all.is_empty() || all.len() != other.len() {
            return Self { bonds: far, length: far, nodes: far, water: far, style: far };
        }
        let mut differs = Self::default();
        let kept = |app: &App, hair| app.world().get::<KeptStyle>(hair).and_then(KeptStyle::kept);
        differs.style = match (kept(a, hair_a), kept(b, hair_b)) {
            (Some(a), Some(b)) => (a - b).abs(),
            _ => 1.0,
        };
        let dye = |app: &App, hair| app.world().get::<HairDye>(hair).cloned();
        if dye(a, hair_a).is_none() || dye(a, hair_a) != dye(b, hair_b) {
            differs.style = 1.0;
        }
        for ((a, bonds_a, water_a), (b, bonds_b, water_b)) in all.iter().zip(&other) {
            differs.length = differs.length.max((a.length() - b.length()).abs());
            differs.nodes = differs.nodes.max(apart(a.positions(), b.positions()));
            let is_same = bonds_a.joints.len() == bonds_b.joints.len();
            differs.bonds = differs.bonds.max(if is_same { 0.0 } else { far });
            for (a, b) in bonds_a.joints.iter().zip(&bonds_b.joints) {
                let rates = a.rates.iter().zip(&b.rates).map(|(a, b)| (a - b).abs());
                let shapes = a.shapes.iter().zip(&b.shapes).map(|(a, b)| a.distance(*b));
                differs.bonds = rates.chain(shapes).fold(differs.bonds, f32::max);
            }
            let share = if *water_a > 0.0 { (water_b / water_a - 1.0).abs() as f32 } else { far };
            differs.water = differs.water.max(share);
        }
        differs
    }
}

/// Line 14: a character with dyed, styled, damp hair is loaded in a new app, with strangers.
fn worn_in_a_new_app() -> Vec<Row> {
    let Pair { mut app, wearers } = pair(Copied::No, true);
    let root = wearers[0];
    let hair = hair_of(&mut app, root)[0];
    app.world_mut().trigger(SoakHair { target: hair, wetness: 0.6 });
    run(&mut app, 0.5);
    app.world_mut().entity_mut(hair).insert((HairDye::pink(), HairStyle::default()));
    run(&mut app, 0.1);
    let colliders = count::<HairCollider>(&mut app);
    let saved = save(&mut app, root);
    let mut new = app_with_meshes();
    copy_assets(&mut app, &mut new);
    strangers(&mut new);
    let map = load(&mut new, &saved);
    let (root_there, hair_there) = (map[&root], map[&hair]);
    let at_once = Differs::between([(&app, hair), (&new, hair_there)]);
    // Time for a second hair to be made, if one is.
    for _ in 0..60 {
        [&mut app, &mut new].into_iter().for_each(App::update);
        sleep(Duration::from_millis(1));
    }
    let later = Differs::between([(&app, hair), (&new, hair_there)]);
    let hairs = hair_of(&mut new, root_there);
    let is_it = f32::from(u8::from(hairs == [hair_there]));
    let roots = roots_in_world(&app, hair);
    let roots_there = roots_in_world(&new, hair_there);
    let what = "worn, loaded in a new app";
    let mut rows = vec![
        Row::new(format!("{what}: hairs of the wearer"), 1.0, hairs.len() as f32, 0.0),
        Row::new(format!("{what}: it is the saved one"), 1.0, is_it, 0.0),
        Row::new(
            format!("{what}: colliders"),
            colliders as f32,
            count::<HairCollider>(&mut new) as f32,
            0.0,
        ),
        Row::at_most(
            format!("{what}: roots off the original's (m)"),
            apart(&roots, &roots_there),
            1e-4,
        ),
        Row::at_most(format!("{what}: faults"), fault_count(&new), 0.0),
    ];
    for (when, differs, [bonds, nodes, water]) in
        [("at once", at_once, [0.0, 0.0, 0.0]), ("a second later", later, [1e-3, 1e-3, 0.01])]
    {
        rows.extend([
            Row::at_most(format!("{what}, {when}: other bonds"), differs.bonds, bonds),
            Row::at_most(format!("{what}, {when}: other lengths (m)"), differs.length, 1e-6),
            Row::at_most(format!("{what}, {when}: nodes off (m)"), differs.nodes, nodes),
            Row::at_most(format!("{what}, {when}: other share of water"), differs.water, water),
            Row::at_most(
                format!("{what}, {when}: other dye or share of style"),
                differs.style,
                1e-3,
            ),
        ]);
    }
    rows
}

/// The named assets of a character, as a new app has them from files.
fn copy_assets(from: &mut App, to: &mut App) {
    fn copy<A: Asset>(from: &App, to: &mut App, number: u128, copied: impl Fn(&A) -> A) {
        let asset = from.world().resource::<Assets<A>>().get(name::<A>(number)).map(copied);
        let mut assets = to.world_mut().resource_mut::<Assets<A>>();
        assets.insert(name::<A>(number), asset.unwrap()).unwrap();
    }
    copy::<Mesh>(from, to, MESH, Mesh::clone);
    copy::<SkinnedMeshInverseBindposes>(from, to, BIND, |bind| bind.to_vec().into());
    copy::<Groom>(from, to, GROOM, Groom::clone);
}

/// Line 9: gusts go on where they were in a world that is loaded from text, and in one that is shifted.
fn saved_gusts() -> Vec<Row> {
    const BY: Vec3 = Vec3::new(-512.0, 0.0, 256.0);
    let wind = HairWind { velocity: Vec3::new(6.5, 0.0, 1.0), ..default() };
    let windy = || {
        let mut app = app_with_meshes();
        app.insert_resource(wind);
        // No time passes in the first frame.
        app.update();
        app
    };
    let mut own = windy();
    own.insert_resource(WindTravel(wind.velocity.as_dvec3() * 36_000.0));
    run(&mut own, 3.0);
    let registry = own.world().resource::<AppTypeRegistry>().clone();
    let saved = DynamicWorldBuilder::from_world(own.world(), &registry.read())
        .deny_all_resources()
        .allow_resource::<WindTravel>()
        .extract_resources()
        .build();
    let saved = saved.serialize(&registry.read()).unwrap();
    let travel = |app: &App| app.world().resource::<WindTravel>().0;
    let mut loaded = windy();
    load(&mut loaded, &saved);
    let off_at_once = (travel(&loaded) - travel(&own)).length() as f32;
    let (mut young, mut shifted) = (windy(), windy());
    shifted.insert_resource(WindTravel(travel(&own)));
    // Where nothing but the gusts would notice.
    let ids = [&mut own, &mut loaded, &mut young, &mut shifted].map(|app| {
        let (hair, id) = one_strand(app);
        app.world_mut().entity_mut(hair).insert(Transform::from_xyz(0.0, 1.5, 0.0));
        app.update();
        (hair, id)
    });
    let (mut off, mut off_shifted, mut off_young) = (0.0f32, 0.0f32, 0.0f32);
    for tick in 0..180 {
        if tick == 60 {
            let hair = ids[3].0;
            let world = shifted.world_mut();
            world.get_mut::<Transform>(hair).unwrap().translation += BY;
            world.commands().trigger(ShiftWorld { by: BY });
            world.flush();
        }
        let at = [&mut own, &mut loaded, &mut young, &mut shifted].map(|app| {
            app.update();
            app
        });
        let [a, b, c, d] = [0, 1, 2, 3].map(|i| strand(at[i], ids[i].1));
        off = off.max(apart(a.positions(), b.positions()));
        off_young = off_young.max(apart(a.positions(), c.positions()));
        off_shifted = off_shifted.max(apart(a.positions(), d.positions()));
    }
    let way = travel(&own) - travel(&shifted) + BY.as_dvec3();
    vec![
        Row::at_most("gusts, loaded from a scene: other way (m)", off_at_once, 0.0),
        Row::at_most("gusts, loaded from a scene: hair off (m)", off, 1e-6),
        Row::at_most("gusts, world shifted: other way (m)", way.length() as f32, 1e-6),
        Row::at_most("gusts, world shifted: hair off (m)", off_shifted, 1e-3),
        Row::new(
            "control, gusts that begin anew: hair is moved",
            1.0,
            f32::from(u8::from(off_young > 5e-3)),
            0.0,
        ),
    ]
}

/// Lines 9 and 14: what comes from a scene that was written as text.
pub fn scenes() -> Vec<Row> {
    let mut rows = Vec::new();
    for (what, elsewhere) in [("beside its original", false), ("in another app", true)] {
        let [length, off, faults] = loaded(elsewhere);
        rows.extend([
            Row::new(format!("scene loaded {what}: longest strand (m)"), 2.0 * LONG, length, 1e-3),
            Row::at_most(format!("scene loaded {what}: roots off the mesh (m)"), off, 1e-4),
            Row::at_most(format!("scene loaded {what}: faults"), faults, 0.0),
        ]);
    }
    rows.extend(worn_in_a_new_app());
    rows.extend(saved_gusts());
    rows
}
