//! The systems: find heads, start tasks that make hair, spawn and despawn it.

use super::{
    error::{SEARCH_TIME, WearError},
    make::{Made, MakeInput, make},
    target::{Characters, Fitted, Search},
    what::{HairNotWorn, HairSource, HairWorn, WearHair, WornHair},
};
use crate::{
    authoring::{attach::RootsOnMesh, groom::Groom},
    base::{
        fault::{FaultKind, HairFault},
        setting::HairDefault,
    },
    hair::{
        look::HairDye,
        strand::{Hair, StrandOf},
    },
    hairdo::style::{HairStyle, KeptStyle},
    simulation::settle::Settling,
    water::HairWetting,
};
use bevy::{
    platform::collections::{HashMap, HashSet},
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};

/// State of a wearer.
#[derive(Component, Default)]
pub(super) struct Wearing {
    /// What is worn or being made.
    wanted: Option<WearHair>,
    stage: WearStage,
    /// The bone or mesh that it is worn on.
    head: Option<Entity>,
    /// The entities of the worn hair.
    worn: Option<Worn>,
}

#[derive(Default)]
enum WearStage {
    /// Searching for the head.
    #[default]
    Begun,
    /// The same, for `seconds`; once a failure has been `reported`, from [`SEARCH_TIME`] to a second later.
    Searching { seconds: f32, reported: bool },
    /// Its hair is being made.
    Making(Making),
    /// It has its hair, or cannot have it.
    Done,
}

enum Making {
    Running(Task<Result<Made, WearError>>),
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

/// Removes the hair of what no longer wears any, or is despawned: a beard hangs on a bone, which stays when the mesh
/// that wears it goes.
pub(super) fn leave(
    gone: On<Remove, Wearing>,
    mut commands: Commands,
    mut wearers: Query<&mut Wearing>,
) {
    let wearing = wearers.get_mut(gone.entity).ok();
    if let Some(worn) = wearing.and_then(|mut wearing| wearing.worn.take()) {
        worn.take_off(&mut commands);
    }
}

/// Ends the wearing of entities without [`WearHair`].
pub(super) fn take_off(
    mut commands: Commands,
    bald: Query<Entity, (With<Wearing>, Without<WearHair>)>,
) {
    for entity in &bald {
        commands.entity(entity).remove::<Wearing>();
    }
}

/// Starts again where the source of the hair has changed or its hair was despawned with the scene.
/// Changes that worn hair can take are applied to it.
pub(super) fn detect_changes(
    mut commands: Commands,
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
        let mut is_other = wear.is_changed() && wearing.wanted.as_ref() != Some(&*wear);
        if is_other
            && let Some(worn) = &wearing.worn
            && matches!(wearing.stage, WearStage::Done)
            && let Some(before) =
                wearing.wanted.as_ref().filter(|before| before.is_same_hair(&wear))
        {
            restyle(&mut commands, worn.hair, before, &wear);
            wearing.wanted = Some(WearHair::clone(&wear));
            is_other = false;
        }
        let is_reloaded = match &wear.hair {
            HairSource::Groom { groom, .. } => changed.contains(&groom.id()),
            HairSource::Preset(_) => false,
        };
        let is_gone = wearing.worn.as_ref().is_some_and(|worn| !hairs.contains(worn.hair));
        if is_other || is_reloaded || (is_gone && matches!(wearing.stage, WearStage::Done)) {
            wearing.wanted = Some(WearHair::clone(&wear));
            wearing.stage = WearStage::Begun;
            wearing.head = None;
        }
    }
}

/// Applies changes of look, dye and [`HairStyle`] to worn hair.
fn restyle(commands: &mut Commands, hair: Entity, before: &WearHair, wear: &WearHair) {
    let mut hair = commands.entity(hair);
    if before.look != wear.look
        && let Some(look) = wear.look.clone()
    {
        hair.try_insert(look);
    }
    if before.dye != wear.dye {
        match wear.dye.clone() {
            Some(dye) => hair.try_insert(dye),
            None => hair.try_remove::<HairDye>(),
        };
    }
    if before.style != wear.style {
        match wear.style {
            Some(style) => hair.try_insert(style),
            None => hair.try_remove::<(HairStyle, KeptStyle)>(),
        };
    }
}

/// Searches for heads, and starts to make hair for those that are found.
pub(super) fn find_heads(
    mut commands: Commands,
    time: Option<Res<Time<Real>>>,
    characters: Characters,
    grooms: Option<Res<Assets<Groom>>>,
    mut wearers: Query<(Entity, &WearHair, &mut Wearing)>,
    mut faults: MessageWriter<HairFault>,
) {
    // The wearer of a preset on each head.
    let mut taken: HashMap<Entity, Entity> = wearers
        .iter()
        .filter(|(_, wear, _)| matches!(wear.hair, HairSource::Preset(_)))
        .filter_map(|(wearer, _, wearing)| Some((wearing.head?, wearer)))
        .collect();
    let step = time.map_or(0.0, |time| time.delta_secs());
    for (wearer, wear, mut wearing) in &mut wearers {
        let (seconds, reported) = match wearing.stage {
            WearStage::Begun => (0.0, false),
            WearStage::Searching { seconds, reported } => {
                let seconds = seconds + step;
                if reported && seconds < SEARCH_TIME + 1.0 {
                    wearing.bypass_change_detection().stage =
                        WearStage::Searching { seconds, reported };
                    continue;
                }
                (seconds, reported)
            }
            WearStage::Making(_) | WearStage::Done => continue,
        };
        // The scene may change: it is searched again.
        let mut failed = |error: WearError| {
            if !reported {
                report_failure(&mut commands, &mut faults, wearer, error);
            }
            WearStage::Searching { seconds: SEARCH_TIME, reported: true }
        };
        let groom = match &wear.hair {
            HairSource::Preset(_) => None,
            HairSource::Groom { groom, .. } => {
                match grooms.as_ref().and_then(|grooms| grooms.get(groom)) {
                    Some(groom) => Some(groom),
                    None => {
                        wearing.stage = match characters.failure(groom.id().untyped()) {
                            Some(reason) => failed(WearError::NotLoaded { what: "groom", reason }),
                            None => WearStage::Searching { seconds, reported },
                        };
                        continue;
                    }
                }
            }
        };
        wearing.stage = match characters.search(wearer, wear) {
            Search::Loading => WearStage::Searching { seconds, reported },
            Search::Nothing if seconds > SEARCH_TIME => failed(WearError::NoMesh),
            Search::Nothing => WearStage::Searching { seconds, reported },
            Search::Failed(error) => failed(error),
            Search::Found(target) => {
                let is_preset = matches!(wear.hair, HairSource::Preset(_));
                match taken.get(&target.head).filter(|by| is_preset && **by != wearer) {
                    Some(&by) => failed(WearError::Taken { by }),
                    None => {
                        if is_preset {
                            taken.insert(target.head, wearer);
                        }
                        wearing.head = Some(target.head);
                        let input = MakeInput { wear: wear.clone(), target, groom: groom.cloned() };
                        WearStage::Making(begin(input))
                    }
                }
            }
        };
    }
}

/// Makes hair on the async compute pool, or at once in an app without pools.
fn begin(input: MakeInput) -> Making {
    match AsyncComputeTaskPool::try_get() {
        Some(pool) => Making::Running(pool.spawn(async move { make(input) })),
        None => Making::Ready(Some(Box::new(make(input)))),
    }
}

fn report_failure(
    commands: &mut Commands,
    faults: &mut MessageWriter<HairFault>,
    wearer: Entity,
    error: WearError,
) {
    let outcome = "the wearer keeps the hair that it has";
    faults.write(HairFault::caused(FaultKind::Wear, error.clone(), outcome).of(wearer));
    commands.trigger(HairNotWorn { entity: wearer, error });
}

/// Replaces worn hair by finished new hair.
pub(super) fn put_on(
    mut commands: Commands,
    mut wearers: Query<(Entity, &WearHair, &mut Wearing)>,
    entities: Query<()>,
    wetting: Option<Res<HairDefault<HairWetting>>>,
    mut faults: MessageWriter<HairFault>,
) {
    for (wearer, wear, mut wearing) in &mut wearers {
        if !matches!(wearing.stage, WearStage::Making(_)) {
            continue;
        }
        let WearStage::Making(making) = &mut wearing.bypass_change_detection().stage else {
            continue;
        };
        let ready = match making {
            Making::Running(task) => check_ready(task),
            Making::Ready(made) => made.take().map(|made| *made),
        };
        let Some(ready) = ready else { continue };
        wearing.stage = WearStage::Done;
        match ready {
            Ok(made) if entities.contains(made.parent) && entities.contains(made.mesh) => {
                if let Some(old) = wearing.worn.take() {
                    old.take_off(&mut commands);
                }
                let wetting = wetting.as_ref().map(|default| default.0).unwrap_or_default();
                let worn = spawn_hair(&mut commands, wearer, wear, made, wetting);
                commands.trigger(HairWorn { entity: wearer, hair: worn.hair });
                wearing.worn = Some(worn);
            }
            // The scene was despawned while the hair was made.
            Ok(_) => wearing.stage = WearStage::Begun,
            Err(error) => {
                wearing.head = None;
                report_failure(&mut commands, &mut faults, wearer, error);
            }
        }
    }
}

fn spawn_hair(
    commands: &mut Commands,
    wearer: Entity,
    wear: &WearHair,
    made: Made,
    wetting: HairWetting,
) -> Worn {
    let roots =
        RootsOnMesh { mesh: Some(made.mesh), roots: made.roots, strands_from_mesh: made.from_mesh };
    let is = WornHair { wearer, hair: wear.hair.clone() };
    let wetting = HairWetting { fibres: made.fibres, ..wetting };
    let mut hair = commands.spawn((Hair, made.place, ChildOf(made.parent), is, wetting, roots));
    if let Some(mut settings) = made.settings {
        settings.wetting = wetting;
        hair.insert(settings);
    }
    if let Some(preset) = made.preset {
        hair.insert(preset);
    }
    // A saved style is put on as it is.
    #[cfg(feature = "save")]
    let is_styled = wear.hairdo.is_some();
    #[cfg(not(feature = "save"))]
    let is_styled = false;
    if is_styled {
        hair.remove::<Settling>();
    } else {
        hair.insert(Settling::default());
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
        commands.entity(hair).queue(hairdo.into_fitting_command());
    }
    // These override the hairdo's.
    let mut own = commands.entity(hair);
    if let Some(look) = wear.look.clone() {
        own.insert(look);
    }
    if let Some(dye) = wear.dye.clone() {
        own.insert(dye);
    }
    if let Some(style) = wear.style {
        own.insert(style);
    }
    Worn { hair, colliders }
}
