//! The systems: look for heads, have hair made, put it on, take it off.

use super::{
    error::{PATIENCE, WearError},
    make::{Made, Order, make},
    target::{Characters, Fitted, Search},
    what::{HairNotWorn, HairSource, HairWorn, WearHair, WornHair},
};
use crate::{
    attach::RootsOnMesh,
    fault::{FaultKind, HairFault},
    groom::Groom,
    setting::HairDefault,
    strand::{Hair, StrandOf},
    water::Wetting,
};
use bevy::{
    platform::collections::{HashMap, HashSet},
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};

/// How far a wearer is.
#[derive(Component, Default)]
pub(super) struct Wearing {
    /// What is worn, or is to be.
    wanted: Option<WearHair>,
    stage: Stage,
    /// The bone or mesh that it is worn on.
    head: Option<Entity>,
    /// What is there.
    worn: Option<Worn>,
}

#[derive(Default)]
enum Stage {
    /// Looks for its head.
    #[default]
    Begun,
    /// The same, for so long (s); what was missing may have been told.
    Seeking { seconds: f32, told: bool },
    /// Its hair is being made.
    Making(Making),
    /// It has its hair, or cannot have it.
    Done,
}

enum Making {
    Elsewhere(Task<Result<Made, WearError>>),
    Ready(Option<Box<Result<Made, WearError>>>),
}

struct Worn {
    hair: Entity,
    colliders: Vec<Entity>,
}

impl Worn {
    fn take_off(self, commands: &mut Commands) {
        commands.entity(self.hair).try_despawn();
        for collider in self.colliders {
            commands.entity(collider).try_despawn();
        }
    }
}

/// Takes the hair off those that are no longer to wear any.
pub(super) fn take_off(
    mut commands: Commands,
    mut bald: Query<(Entity, &mut Wearing), Without<WearHair>>,
) {
    for (entity, mut wearing) in &mut bald {
        if let Some(worn) = wearing.worn.take() {
            worn.take_off(&mut commands);
        }
        commands.entity(entity).remove::<Wearing>();
    }
}

/// Begins anew where what is worn has changed, or is gone with the scene that it was on.
pub(super) fn note_changes(
    mut wearers: Query<(Ref<WearHair>, &mut Wearing)>,
    mut events: Option<MessageReader<AssetEvent<Groom>>>,
    hairs: Query<(), With<Hair>>,
) {
    let changed: HashSet<_> = events
        .iter_mut()
        .flat_map(|events| events.read())
        .filter_map(|event| match event {
            AssetEvent::Modified { id } => Some(*id),
            _ => None,
        })
        .collect();
    for (wear, mut wearing) in &mut wearers {
        let is_other = wear.is_changed() && wearing.wanted.as_ref() != Some(&*wear);
        let is_reloaded = match &wear.hair {
            HairSource::Groom { groom, .. } => changed.contains(&groom.id()),
            HairSource::Preset(_) => false,
        };
        let is_gone = wearing.worn.as_ref().is_some_and(|worn| !hairs.contains(worn.hair));
        if is_other || is_reloaded || (is_gone && matches!(wearing.stage, Stage::Done)) {
            wearing.wanted = Some(WearHair::clone(&wear));
            wearing.stage = Stage::Begun;
            wearing.head = None;
        }
    }
}

/// Looks for heads, and has hair made for those that are there.
pub(super) fn seek(
    mut commands: Commands,
    time: Option<Res<Time<Real>>>,
    characters: Characters,
    grooms: Option<Res<Assets<Groom>>>,
    mut wearers: Query<(Entity, &WearHair, &mut Wearing)>,
    mut faults: MessageWriter<HairFault>,
) {
    // Whose preset is worn where.
    let mut taken: HashMap<Entity, Entity> = wearers
        .iter()
        .filter(|(_, wear, _)| matches!(wear.hair, HairSource::Preset(_)))
        .filter_map(|(wearer, _, wearing)| Some((wearing.head?, wearer)))
        .collect();
    let step = time.map_or(0.0, |time| time.delta_secs());
    for (wearer, wear, mut wearing) in &mut wearers {
        let (seconds, told) = match wearing.stage {
            Stage::Begun => (0.0, false),
            Stage::Seeking { seconds, told } => (seconds + step, told),
            Stage::Making(_) | Stage::Done => continue,
        };
        let mut failed = |error: WearError, told: bool| {
            if !told {
                refuse(&mut commands, &mut faults, wearer, error);
            }
        };
        let groom = match &wear.hair {
            HairSource::Preset(_) => None,
            HairSource::Groom { groom, .. } => {
                match grooms.as_ref().and_then(|grooms| grooms.get(groom)) {
                    Some(groom) => Some(groom),
                    None => {
                        if let Some(reason) = characters.failure(groom.id().untyped()) {
                            failed(WearError::NotLoaded { what: "groom", reason }, told);
                            wearing.stage = Stage::Done;
                        } else {
                            wearing.stage = Stage::Seeking { seconds, told };
                        }
                        continue;
                    }
                }
            }
        };
        wearing.stage = match characters.search(wearer, wear) {
            Search::Loading => Stage::Seeking { seconds, told },
            Search::Nothing => {
                let is_late = seconds > PATIENCE;
                if is_late {
                    failed(WearError::NoMesh, told);
                }
                Stage::Seeking { seconds, told: told || is_late }
            }
            // What is missing may still come.
            Search::Failed(error) => {
                failed(error, told);
                Stage::Seeking { seconds, told: true }
            }
            Search::Found(target) => {
                let is_preset = matches!(wear.hair, HairSource::Preset(_));
                match taken.get(&target.head).filter(|by| is_preset && **by != wearer) {
                    Some(&by) => {
                        failed(WearError::Taken { by }, false);
                        Stage::Done
                    }
                    None => {
                        if is_preset {
                            taken.insert(target.head, wearer);
                        }
                        wearing.head = Some(target.head);
                        let order = Order { wear: wear.clone(), target, groom: groom.cloned() };
                        Stage::Making(begin(order))
                    }
                }
            }
        };
    }
}

/// Has hair made on the async compute pool; here, in an app without pools.
fn begin(order: Order) -> Making {
    match AsyncComputeTaskPool::try_get() {
        Some(pool) => Making::Elsewhere(pool.spawn(async move { make(order) })),
        None => Making::Ready(Some(Box::new(make(order)))),
    }
}

fn refuse(
    commands: &mut Commands,
    faults: &mut MessageWriter<HairFault>,
    wearer: Entity,
    error: WearError,
) {
    let outcome = "the wearer keeps the hair that it has";
    faults.write(HairFault::caused(FaultKind::Wear, error.clone(), outcome).of(wearer));
    commands.trigger(HairNotWorn { entity: wearer, error });
}

/// Puts on hair that is ready, in place of what was worn.
pub(super) fn put_on(
    mut commands: Commands,
    mut wearers: Query<(Entity, &WearHair, &mut Wearing)>,
    entities: Query<()>,
    wetting: Option<Res<HairDefault<Wetting>>>,
    mut faults: MessageWriter<HairFault>,
) {
    for (wearer, wear, mut wearing) in &mut wearers {
        if !matches!(wearing.stage, Stage::Making(_)) {
            continue;
        }
        let Stage::Making(making) = &mut wearing.bypass_change_detection().stage else { continue };
        let ready = match making {
            Making::Elsewhere(task) => check_ready(task),
            Making::Ready(made) => made.take().map(|made| *made),
        };
        let Some(ready) = ready else { continue };
        wearing.stage = Stage::Done;
        match ready {
            Ok(made) if entities.contains(made.parent) && entities.contains(made.mesh) => {
                if let Some(old) = wearing.worn.take() {
                    old.take_off(&mut commands);
                }
                let wetting = wetting.as_ref().map(|default| default.0).unwrap_or_default();
                let worn = dress(&mut commands, wearer, wear, made, wetting);
                commands.trigger(HairWorn { entity: wearer, hair: worn.hair });
                wearing.worn = Some(worn);
            }
            // The scene went while its hair was made.
            Ok(_) => wearing.stage = Stage::Begun,
            Err(error) => {
                wearing.head = None;
                refuse(&mut commands, &mut faults, wearer, error);
            }
        }
    }
}

fn dress(
    commands: &mut Commands,
    wearer: Entity,
    wear: &WearHair,
    made: Made,
    wetting: Wetting,
) -> Worn {
    let roots =
        RootsOnMesh { mesh: Some(made.mesh), roots: made.roots, strands_from_mesh: made.from_mesh };
    let is = WornHair { wearer, hair: wear.hair.clone() };
    let wetting = Wetting { fibres: made.fibres, ..wetting };
    let mut hair = commands.spawn((Hair, made.place, ChildOf(made.parent), is, wetting, roots));
    if let Some(settings) = made.settings {
        hair.insert(settings);
    }
    #[cfg(feature = "render")]
    {
        if let Some(look) = made.look {
            hair.insert(look);
        }
        if !made.hair.followers.0.is_empty() {
            hair.insert(made.hair.followers);
        }
    }
    let hair = hair.id();
    for strand in made.hair.strands {
        commands.spawn((StrandOf(hair), strand));
    }
    for ball in made.balls {
        commands.spawn((ball, Fitted, ChildOf(hair)));
    }
    let capsules = made.capsules.into_iter();
    let colliders =
        capsules.map(|(joint, capsule)| commands.spawn((capsule, Fitted, ChildOf(joint))).id());
    let colliders = colliders.collect();
    #[cfg(feature = "save")]
    if let Some(hairdo) = wear.hairdo.clone() {
        commands.entity(hair).queue(hairdo.put_on_fitting());
    }
    Worn { hair, colliders }
}
