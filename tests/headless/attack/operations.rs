//! The operations: what users, inspectors and scene files may do to a world.

use bevy::{
    ecs::{
        entity_disabling::Disabled,
        query::QueryFilter,
        reflect::{AppTypeRegistry, ReflectComponent, ReflectResource},
        resource::IsResource,
        system::SystemState,
    },
    prelude::*,
    reflect::{PartialReflect, ReflectMut, ReflectRef, std_traits::ReflectDefault},
};
use bevy_keratin::{
    AddedMass, BondChanges, ContactMethod, HairLod, HairSnapshot, HairSnapshots, HairSubsteps,
    MotionOwner, Shower, SleepSettings, SoakHair, SolverMethod, WindReceived, WindZone,
    authoring::attach::TiedRoots,
    forces::{
        contact::{LockNeighbours, Obstacles},
        environment::BlownAir,
    },
    hair::strand::{SleepPose, StrandHistory, StrandSleep, TickPose},
    keratin::bond::RestShape,
    prelude::*,
    simulation::lod::Guides,
};
use rand::{RngExt, rngs::Xoshiro256PlusPlus, seq::IndexedRandom};

type Random = Xoshiro256PlusPlus;

const WRONG: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    0.0,
    -0.0,
    -1.0,
    1e-30,
    1e30,
    f32::MAX,
    1.0,
    0.37,
    1e6,
];

/// Lets operations reach what scenes leave out as derived, and code may touch all the same.
pub fn reach_derived(app: &mut App) {
    app.register_type_data::<AddedMass, ReflectComponent>()
        .register_type_data::<BlownAir, ReflectComponent>()
        .register_type_data::<Guides, ReflectComponent>()
        .register_type_data::<LockNeighbours, ReflectComponent>()
        .register_type_data::<Obstacles, ReflectComponent>()
        .register_type_data::<RestShape, ReflectComponent>()
        .register_type_data::<SleepPose, ReflectComponent>()
        .register_type_data::<StrandHistory, ReflectComponent>()
        .register_type_data::<TickPose, ReflectComponent>()
        .register_type_data::<TiedRoots, ReflectComponent>();
}

/// Writes something into a part of a value, however deep. Says where.
fn spoil(value: &mut dyn PartialReflect, random: &mut Random) -> String {
    let wrong = *WRONG.choose(random).unwrap();
    let small = random.random_range(0..20_u64);
    let count = if small == 19 { u64::MAX } else { small };
    macro_rules! put {
        ($($number:ty: $wrong:expr),*) => {
            $(if let Some(number) = value.try_downcast_mut::<$number>() {
                *number = $wrong;
                return format!(" = {number}");
            })*
        };
    }
    put!(
        f32: wrong, f64: wrong.into(), u32: count as u32, u64: count, usize: count as usize,
        bool: small < 10, Entity: Entity::PLACEHOLDER
    );
    let name = value.reflect_type_path().to_owned();
    let at = |len: usize, random: &mut Random| (len > 0).then(|| random.random_range(0..len));
    let inside = match value.reflect_mut() {
        ReflectMut::Struct(parts) => at(parts.field_len(), random).map(|i| {
            let field = parts.name_at(i).unwrap_or_default().to_owned();
            format!(".{field}{}", spoil(parts.field_at_mut(i).unwrap(), random))
        }),
        ReflectMut::TupleStruct(parts) => at(parts.field_len(), random)
            .map(|i| format!(".{i}{}", spoil(parts.field_mut(i).unwrap(), random))),
        ReflectMut::Tuple(parts) => at(parts.field_len(), random)
            .map(|i| format!(".{i}{}", spoil(parts.field_mut(i).unwrap(), random))),
        ReflectMut::Array(parts) => at(parts.len(), random)
            .map(|i| format!("[{i}]{}", spoil(parts.get_mut(i).unwrap(), random))),
        ReflectMut::Enum(parts) => at(parts.field_len(), random)
            .map(|i| format!(".{i}{}", spoil(parts.field_at_mut(i).unwrap(), random))),
        ReflectMut::List(list) if small < 5 => list.pop().map(|_| ".pop()".to_owned()),
        ReflectMut::List(list) if small == 5 => {
            list.drain();
            Some(".clear()".to_owned())
        }
        ReflectMut::List(list) => at(list.len(), random)
            .map(|i| format!("[{i}]{}", spoil(list.get_mut(i).unwrap(), random))),
        _ => None,
    };
    inside.unwrap_or(name)
}

/// Where a number is not finite, if one is.
fn search(value: &dyn PartialReflect) -> Option<String> {
    if let Some(number) = value.try_downcast_ref::<f32>() {
        return (!number.is_finite()).then(|| format!(" = {number}"));
    }
    if let Some(number) = value.try_downcast_ref::<f64>() {
        return (!number.is_finite()).then(|| format!(" = {number}"));
    }
    let each = |i: usize, part: &dyn PartialReflect| search(part).map(|at| format!(".{i}{at}"));
    match value.reflect_ref() {
        ReflectRef::Struct(parts) => {
            parts.iter_fields().find_map(|(name, part)| Some(format!(".{name}{}", search(part)?)))
        }
        ReflectRef::TupleStruct(parts) => {
            parts.iter_fields().enumerate().find_map(|(i, part)| each(i, part))
        }
        ReflectRef::Tuple(parts) => parts.iter_fields().enumerate().find_map(|(i, p)| each(i, p)),
        ReflectRef::Array(parts) => parts.iter().enumerate().find_map(|(i, part)| each(i, part)),
        ReflectRef::List(parts) => parts.iter().enumerate().find_map(|(i, part)| each(i, part)),
        ReflectRef::Enum(parts) => {
            parts.iter_fields().enumerate().find_map(|(i, part)| each(i, part.value()))
        }
        _ => None,
    }
}

/// What the tick keeps and users do not set. Sums of wind are user code's to reset. A pose of sleep is written anew before it is read again.
const STATE: [&str; 7] =
    ["Strand", "StrandHistory", "Moisture", "Droplet", "Bonds", "TickPose", "RestShape"];

/// The components of an entity.
fn names(world: &World, entity: Entity) -> Vec<String> {
    let registry = world.resource::<AppTypeRegistry>().read();
    let parts = world.inspect_entity(entity).into_iter().flatten();
    let types = parts.filter_map(|part| registry.get(part.type_id()?));
    types.map(|of| of.type_info().type_path_table().short_path().to_owned()).collect()
}

/// A number of the world's state that is not finite, if there is one.
pub fn not_finite(app: &mut App) -> Option<String> {
    let world = app.world_mut();
    let registry = world.resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let hairs: Vec<Entity> = world.query_filtered::<Entity, With<Hair>>().iter(world).collect();
    let all: Vec<Entity> = world
        .query_filtered::<Entity, Or<(With<Hair>, With<Droplet>, With<Strand>, With<TickPose>)>>()
        .iter(world)
        .collect();
    for name in STATE {
        let component = registry.get_with_short_type_path(name).expect(name);
        let component = component.data::<ReflectComponent>().expect(name);
        for entity in &all {
            // Entities of other crates are left unchanged.
            let is_lost = world.get::<StrandOf>(*entity).is_none_or(|of| !hairs.contains(&of.0))
                && world.get::<Strand>(*entity).is_some();
            // Of an entity that has ceased to be a strand nothing is made again.
            let is_left = name == "RestShape" && world.get::<Strand>(*entity).is_none();
            let is_stub = world.get::<Strand>(*entity).is_some_and(|strand| strand.nodes() < 2);
            if !is_lost
                && !is_left
                && !is_stub
                && let Some(value) = component.reflect(world.entity(*entity))
                && let Some(found) = search(value.as_partial_reflect())
            {
                let of = world.get::<StrandOf>(*entity).map(|of| of.0);
                return Some(format!(
                    "{entity}: {name}{found}: {value:?}; it has {:?} and {:?}, its hair {:?} and {:?}",
                    names(world, *entity),
                    world.get::<StrandSleep>(*entity),
                    of.map(|hair| names(world, hair)),
                    of.map(|hair| world.get::<MotionOwner>(hair))
                ));
            }
        }
    }
    for entity in &all {
        if let Some(added) = world.get::<AddedMass>(*entity)
            && let Some(load) = added.mass.iter().chain(&added.softening).find(|x| !x.is_finite())
        {
            return Some(format!("{entity}: AddedMass has {load}"));
        }
    }
    None
}

/// Whether `strand` belongs to a hair, is long enough to swing with its first edge held, and near enough
/// to the hair's origin for single precision to resolve it: 200 km away its steps are of 16 mm.
fn can_swing(world: &World, entity: Entity) -> bool {
    let strand = world.get::<Strand>(entity);
    strand.is_some_and(|strand| {
        strand.nodes() >= 4
            && (0.04..1.0).contains(&strand.rest_lengths().iter().sum::<f32>())
            && strand.positions()[0].abs().max_element() < 1e3
    }) && world.get::<StrandOf>(entity).is_some_and(|of| world.get::<Hair>(of.0).is_some())
}

/// Puts the world's surroundings back to what they are by default, each strand on a new hair, and
/// gives the strands a push. Those that do not move are dead: whatever was done to them must not last.
pub fn find_dead(app: &mut App) -> Option<String> {
    let world = app.world_mut();
    let registry = world.resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let old: Vec<Entity> = world
        .query_filtered::<Entity, (
            Or<(With<TickPose>, With<Droplet>)>,
            Without<Hair>,
            Without<IsResource>,
        )>()
        .iter(world)
        .collect();
    old.iter().for_each(|tool| _ = world.despawn(*tool));
    let resources = with::<With<IsResource>>(world);
    for kind in registry.iter().filter(|kind| {
        let table = kind.type_info().type_path_table();
        kind.type_info().type_path().starts_with("bevy_keratin")
            && table.ident() != Some("WaterLedger")
    }) {
        let parts = (kind.data::<ReflectComponent>(), kind.data::<ReflectDefault>());
        let (Some(component), Some(default)) = parts else { continue };
        for resource in &resources {
            let mut resource = world.entity_mut(*resource);
            if component.contains(&resource) {
                component.apply(&mut resource, default.default().as_partial_reflect());
            }
        }
    }
    world.insert_resource(Time::<Fixed>::from_hz(60.0));
    // Also colliders that were put on strands and heads.
    for entity in with::<With<HairCollider>>(world) {
        world.entity_mut(entity).remove::<HairCollider>();
    }
    let strands: Vec<Entity> = world.query_filtered::<Entity, With<Strand>>().iter(world).collect();
    let whole: Vec<Entity> = strands.into_iter().filter(|e| can_swing(world, *e)).collect();
    for entity in &whole {
        let hair = world.spawn(Hair).id();
        world
            .entity_mut(*entity)
            .remove::<(HeldNodes, WoundOn, Disabled, StrandMaterial)>()
            .insert((StrandOf(hair), Moisture::default()));
    }
    // What was put on the strands is noticed, and what has been wrong is repaired.
    (0..3).for_each(|_| app.update());
    let mut before = Vec::new();
    for entity in &whole {
        let mut strand = app.world_mut().get_mut::<Strand>(*entity).unwrap();
        // Across the last edge: what is pushed along itself need not move.
        let &[.., inner, tip] = strand.positions() else { unreachable!("it can swing") };
        let push = (tip - inner).normalize_or(Vec3::X).any_orthonormal_vector();
        strand.velocities_mut()[1..].fill(push);
        before.push(tip);
    }
    let mut farthest = vec![0.0_f32; whole.len()];
    for _ in 0..3 {
        app.update();
        for ((entity, before), way) in whole.iter().zip(&before).zip(&mut farthest) {
            let strand = app.world().get::<Strand>(*entity).unwrap();
            *way = way.max(strand.positions().last().unwrap().distance(*before));
        }
    }
    for (entity, way) in whole.into_iter().zip(farthest) {
        let strand = app.world().get::<Strand>(entity).unwrap();
        if !strand.is_finite() || way < 1e-4 {
            return Some(format!(
                "{entity} of {} nodes moves by {way} m: {:?}, {:?}",
                strand.nodes(),
                names(app.world(), entity),
                app.world().get::<StrandSleep>(entity)
            ));
        }
    }
    None
}

/// Puts the default of any component of ours on an entity. Says which.
fn insert_any(world: &mut World, entity: Entity, random: &mut Random) -> String {
    let registry = world.resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let components: Vec<_> = (registry.iter())
        .filter(|kind| kind.type_info().type_path().starts_with("bevy_keratin"))
        .filter(|kind| kind.data::<ReflectResource>().is_none())
        .filter_map(|kind| {
            let component = kind.data::<ReflectComponent>()?;
            Some((kind.type_info().type_path(), component, kind.data::<ReflectDefault>()?))
        })
        .collect();
    let (name, component, default) = components.choose(random).unwrap();
    let value = default.default();
    component.insert(&mut world.entity_mut(entity), value.as_partial_reflect(), &registry);
    format!("{name} put on")
}

/// Writes into a component, or takes it off. Says which.
fn write(world: &mut World, entity: Entity, may_go: bool, random: &mut Random) -> String {
    let registry = world.resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    let components: Vec<_> = (registry.iter())
        .filter(|t| t.type_info().type_path().starts_with("bevy_keratin"))
        // Relationships are immutable, and the ledger belongs to the tick.
        .filter(|t| {
            !["StrandOf", "WoundOn", "Tied", "WaterLedger"]
                .contains(&t.type_info().type_path_table().ident().unwrap_or_default())
        })
        .filter_map(|t| Some((t.type_info().type_path(), t.data::<ReflectComponent>()?)))
        .filter(|(_, component)| component.contains(world.entity(entity)))
        .collect();
    let Some((name, component)) = components.choose(random) else {
        return "nothing".into();
    };
    let mut entity = world.entity_mut(entity);
    if may_go && random.random_range(0..12) == 0 {
        component.remove(&mut entity);
        return format!("without {name}");
    }
    match component.reflect_mut(&mut entity) {
        Some(mut value) => {
            format!("{name}{}", spoil(value.as_partial_reflect_mut(), random))
        }
        None => "nothing".into(),
    }
}

fn with<F: QueryFilter>(world: &mut World) -> Vec<Entity> {
    world.query_filtered::<Entity, F>().iter(world).collect()
}

/// One operation on the world. Says which.
pub fn one(app: &mut App, random: &mut Random) -> String {
    let world = app.world_mut();
    let (hairs, strands) = (with::<With<Hair>>(world), with::<With<Strand>>(world));
    let drops = with::<With<Droplet>>(world);
    let tools = with::<
        Or<(With<HairCollider>, With<Blower>, With<PermRod>, With<Shower>, With<WindZone>)>,
    >(world);
    if drops.len() > 500 {
        drops[100..].iter().for_each(|drop| _ = world.despawn(*drop));
        return "most drops gone".into();
    }
    let all: Vec<Entity> = [&hairs[..], &strands, &tools, &drops[..drops.len().min(10)]].concat();
    let (hair, one) = (hairs.choose(random).copied(), strands.choose(random).copied());
    let (any, drop) = (all.choose(random).copied(), drops.choose(random).copied());
    let place = Vec3::from_array([(); 3].map(|()| random.random_range(-0.3..0.3)));
    let wrong = *WRONG.choose(random).unwrap();
    let line = |segments: usize| {
        let points: Vec<Vec3> =
            (0..=segments).map(|i| place * 0.1 + Vec3::X * 0.02 * i as f32).collect();
        Strand::from_polyline(&points).unwrap()
    };
    match (random.random_range(0..66), hair, one, any) {
        (0, Some(hair), ..) if strands.len() < 40 => {
            let segments = random.random_range(1..20);
            world.spawn((StrandOf(hair), line(segments)));
            format!("a strand of {segments} segments")
        }
        (1, _, Some(strand), _) if strands.len() > 8 => {
            world.despawn(strand);
            "a strand gone".into()
        }
        (2, _, Some(strand), _) if strands.len() < 40 => {
            world.entity_mut(strand).clone_and_spawn();
            "a strand cloned".into()
        }
        (3, Some(hair), Some(strand), _) => {
            world.entity_mut(strand).insert(StrandOf(hair));
            "a strand on another head".into()
        }
        (4, _, Some(strand), _) => {
            world.entity_mut(strand).insert(line(random.random_range(1..12)));
            "a haircut".into()
        }
        (5, Some(hair), ..) => {
            world.write_message(HairTreatment::wet(hair));
            "wet".into()
        }
        (6, Some(hair), ..) => {
            world.write_message(HairTreatment::dry(hair).over(wrong.abs()));
            format!("dry over {}", wrong.abs())
        }
        (7, _, Some(strand), _) => {
            let wetness = random.random_range(0.0..1.0);
            world.write_message(SoakHair { target: strand, wetness });
            "soaked".into()
        }
        (8, Some(hair), ..) => {
            Hair::teleport(world.entity_mut(hair));
            world.get_mut::<Transform>(hair).unwrap().translation = place * 100.0;
            "a teleport".into()
        }
        (9, Some(hair), ..) => {
            world.get_mut::<Transform>(hair).unwrap().translation += place;
            "a jump".into()
        }
        (10, ..) if tools.len() < 20 => {
            let at = Transform::from_translation(place);
            match random.random_range(0..6) {
                5 => world.spawn((WindZone::fire(), at)),
                0 => world.spawn((HairCollider::sphere(0.05).unwrap(), at)),
                1 => world.spawn(PermRod::default()),
                2 => world.spawn((Shower::new(100.0, 1e-3).unwrap(), at)),
                3 => world.spawn((HairCollider::plane(Dir3::Y), at)),
                _ => world.spawn((Blower::default(), at)),
            };
            "a tool".into()
        }
        (11, ..) if tools.len() > 4 => {
            world.despawn(*tools.choose(random).unwrap());
            "a tool gone".into()
        }
        (12, Some(hair), ..) => {
            let model = [StrandModel::Rod, StrandModel::MassSpring][random.random_range(0..2)];
            world.entity_mut(hair).insert(model);
            "another model".into()
        }
        (13, Some(hair), ..) => {
            let method = [SolverMethod::Direct, SolverMethod::Sweeps][random.random_range(0..2)];
            world.entity_mut(hair).insert(HairSolver { method, ..default() });
            "another solver".into()
        }
        (14, ..) => {
            world.spawn(Droplet::new(place, 3e-8).unwrap());
            "a drop".into()
        }
        (15, ..) if drop.is_some() => {
            world.entity_mut(drop.unwrap()).clone_and_spawn();
            "a drop cloned".into()
        }
        (16, _, Some(strand), _) => {
            let other = *strands.choose(random).unwrap();
            if let Some(moisture) = world.get::<Moisture>(other).cloned() {
                world.entity_mut(strand).insert(moisture);
            }
            "another's moisture".into()
        }
        (17, _, Some(strand), _) => {
            if let Some(moisture) = world.entity_mut(strand).take::<Moisture>() {
                world.entity_mut(*strands.choose(random).unwrap()).insert(moisture);
            }
            "moisture that goes over".into()
        }
        (18, Some(hair), ..) => {
            if let Some(tool) = tools.choose(random)
                && world.get::<ChildOf>(*tool).is_none()
            {
                world.entity_mut(hair).insert(ChildOf(*tool));
            }
            "another parent".into()
        }
        (19, Some(hair), ..) => {
            world.entity_mut(hair).remove::<ChildOf>();
            "no parent".into()
        }
        (20, Some(hair), ..) => {
            let scale = [0.5, 2.0, -1.0, 1.0, 1.0, wrong][random.random_range(0..6)];
            world.get_mut::<Transform>(hair).unwrap().scale = Vec3::splat(scale);
            format!("scale {scale}")
        }
        (21, Some(hair), ..) => {
            let mut transform = world.get_mut::<Transform>(hair).unwrap();
            transform.rotation = Quat::from_axis_angle(Vec3::Y, wrong.min(10.0));
            transform.translation.y = wrong;
            format!("height {wrong}")
        }
        (22, Some(hair), ..) => {
            *world.get_mut::<Transform>(hair).unwrap() = Transform::default();
            "home".into()
        }
        (23, _, Some(strand), _) => {
            let nodes = random.random_range(0..12);
            let far = place * [1.0, 1.0, wrong][random.random_range(0..3)];
            let targets = (0..nodes).map(|i| (i % 2 == 0).then_some(far)).collect();
            world.entity_mut(strand).insert(HeldNodes { targets, ..default() });
            format!("{nodes} nodes held at {far}")
        }
        (24, _, Some(strand), _) => {
            world.entity_mut(strand).remove::<HeldNodes>();
            "let go".into()
        }
        (25, _, Some(strand), _) => {
            if let Some(rod) = tools.iter().find(|tool| world.get::<PermRod>(**tool).is_some()) {
                world.entity_mut(strand).insert(WoundOn(*rod));
            }
            "wound".into()
        }
        (26, _, Some(strand), _) => {
            world.entity_mut(strand).remove::<WoundOn>();
            "unwound".into()
        }
        (27, ..) => {
            let hertz = random.random_range(20.0..240.0);
            world.insert_resource(Time::<Fixed>::from_hz(hertz));
            format!("{hertz} Hz")
        }
        (28, ..) if random.random() => {
            let seed = random.random();
            world.insert_resource(HairWind { velocity: place * 10.0, seed, ..default() });
            "wind".into()
        }
        (28, ..) => {
            world.insert_resource(HairBudget { milliseconds: wrong, ..default() });
            world.insert_resource(HairSubsteps::default());
            world.insert_resource(HairProcessTime(wrong));
            format!("process time {wrong}")
        }
        (29, _, Some(strand), _) => {
            if let Some(mut changes) = world.get_mut::<BondChanges>(strand) {
                let far = [0, 3, 100, 65_535, 100_000_000, usize::MAX];
                let joint = far[random.random_range(0..far.len())];
                changes.request(joint, BondKind::Hydrogen, wrong);
            }
            format!("bonds by {wrong}")
        }
        (30, Some(hair), ..) => {
            world.entity_mut(hair).insert((HairLod::default(), HairScreenShare(0.01)));
            "far away".into()
        }
        (31, Some(hair), ..) => {
            world.entity_mut(hair).insert(SleepSettings::default());
            "may sleep".into()
        }
        (32, _, Some(strand), _) => {
            world.entity_mut(strand).insert(WindReceived::default());
            "counts wind".into()
        }
        (33, _, Some(strand), _) if strands.len() > 8 => {
            world.entity_mut(strand).insert(Disabled);
            "disabled".into()
        }
        (34, ..) => {
            let mut hidden = world.query_filtered::<Entity, With<Disabled>>();
            let hidden: Vec<Entity> = hidden.iter(world).collect();
            hidden.iter().for_each(|entity| _ = world.entity_mut(*entity).remove::<Disabled>());
            "enabled again".into()
        }
        (35, ..) => {
            let resources = with::<With<IsResource>>(world);
            let ours: Vec<Entity> = resources.into_iter().collect();
            let entity = *ours.choose(random).unwrap();
            write(world, entity, false, random)
        }
        (36, Some(hair), _, _) if hairs.len() < 4 => {
            world.entity_mut(hair).clone_and_spawn();
            "a head cloned".into()
        }
        (37, Some(hair), ..) => {
            let treat = [
                HairTreatment::lotion,
                HairTreatment::neutraliser,
                HairTreatment::shampoo,
                HairTreatment::set_everything,
            ];
            let from = random.random_range(0..12);
            let joints = from..[from, from + 3, usize::MAX][random.random_range(0..3)];
            let delay = *WRONG.choose(random).unwrap();
            let treat = treat.choose(random).unwrap()(hair).joints(joints.clone());
            world.write_message(treat.over(wrong).after(delay));
            format!("treated at {joints:?} over {wrong} s after {delay} s")
        }
        (38, Some(hair), ..) => {
            let request = [Hair::reset, Hair::restyle, Hair::teleport].choose(random).unwrap();
            request(world.entity_mut(hair));
            "reset, restyled or teleported".into()
        }
        (39, Some(hair), ..) => {
            let other = *hairs.choose(random).unwrap();
            match Hairdo::of(world, other) {
                Ok(hairdo) => format!("a hairdo: {:?}", hairdo.apply(world, hair)),
                Err(error) => format!("no hairdo: {error}"),
            }
        }
        (40, Some(hair), ..) if strands.len() < 20 => {
            let length = [1e-4, 2e-4, 5e-4][random.random_range(0..3)];
            let points: Vec<Vec3> = (0..120).map(|i| Vec3::X * length * i as f32).collect();
            world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
            format!("a strand of {length} m segments")
        }
        (41, Some(hair), ..) if hairs.len() > 1 => {
            world.despawn(hair);
            "a head gone".into()
        }
        (42, ..) if hairs.len() < 2 => {
            let hair = world.spawn((Hair, Transform::from_translation(place))).id();
            (0..4).for_each(|_| _ = world.spawn((StrandOf(hair), line(6))));
            "a head".into()
        }
        (43, ..) => {
            (0..2).for_each(|_| _ = world.spawn(Droplet::new(place, 0.8e-3).unwrap()));
            "two drops that are too large for one".into()
        }
        (44, Some(hair), ..) => {
            world.entity_mut(hair).despawn_related::<Strands>();
            let segments = random.random_range(1..12);
            (0..6).for_each(|_| _ = world.spawn((StrandOf(hair), line(segments))));
            format!("another groom of {segments} segments")
        }
        (45, ..) => {
            (0..40).for_each(|_| _ = world.spawn(Droplet::new(place, 1e-9).unwrap()));
            "drops in one place".into()
        }
        (46, ..) => {
            let substeps = random.random_range(0..13);
            world.insert_resource(HairSubsteps::Fixed(substeps));
            format!("{substeps} substeps")
        }
        (47, ..) => {
            let mut showers = world.query::<&mut Shower>();
            showers.iter_mut(world).for_each(|mut shower| shower.due = wrong);
            format!("showers that owe {wrong}")
        }
        (48, _, _, Some(entity)) => insert_any(world, entity, random),
        (49, Some(hair), ..) => {
            let length = [0.05, 0.1, wrong][random.random_range(0..3)];
            let by = match random.random() {
                true => CutBy::Length(length),
                false => CutBy::Plane { point: place, normal: Vec3::X * length },
            };
            world.trigger(CutHair::all(hair, by));
            format!("cut {by:?}")
        }
        (50, Some(hair), ..) => {
            let tie = HairTie { radius: wrong, seconds: wrong.abs() };
            let tie = world.spawn((tie, Transform::from_translation(place), ChildOf(hair))).id();
            let normal = Vec3::Y * wrong;
            let region = [StrandRegion::All, StrandRegion::Above { point: place, normal }];
            let region = region[random.random_range(0..2)];
            world.trigger(TieHair { hair, tie, region });
            format!("tied with {wrong}, {region:?}")
        }
        (51, ..) => {
            let mut ties = world.query_filtered::<Entity, With<HairTie>>();
            let tie = ties.iter(world).next();
            if let Some(tie) = tie {
                world.despawn(tie);
            }
            "a tie gone".into()
        }
        (52, Some(hair), ..) => {
            let methods = [ContactMethod::Printed, ContactMethod::Mutual, ContactMethod::Pairs];
            let method = methods[random.random_range(0..3)];
            let radius = [1e-3, 5e-3, wrong][random.random_range(0..3)];
            world.entity_mut(hair).insert(StrandContact { method, radius, ..default() });
            format!("contact by {method:?} at {radius}")
        }
        (53, Some(hair), ..) => {
            let other = *hairs.choose(random).unwrap();
            let mut state = SystemState::<HairSnapshots>::new(world);
            let mut snapshots = state.get_mut(world).unwrap();
            let mut taken = HairSnapshot::default();
            let done = snapshots.take(other, &mut taken);
            // Bytes of another machine, one of them broken.
            let mut bytes = taken.to_bytes();
            if random.random() && !bytes.is_empty() {
                let at = random.random_range(0..bytes.len());
                bytes[at] ^= 1 << random.random_range(0..8);
            }
            let done = done.and_then(|()| HairSnapshot::from_bytes(&bytes));
            format!("rolled back: {:?}", done.and_then(|taken| snapshots.restore(hair, &taken)))
        }
        (54, Some(hair), ..) => {
            world.entity_mut(hair).insert(RecordGroomCache::default());
            "recorded".into()
        }
        (55, Some(hair), ..) => {
            let frames = GroomCache::of_recording(world, hair).map(|cache| cache.len());
            format!("recorded frames: {frames:?}")
        }
        (_, _, _, Some(entity)) => write(world, entity, true, random),
        _ => "nothing".into(),
    }
}
