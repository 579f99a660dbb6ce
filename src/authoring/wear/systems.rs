//! The systems: find heads, start tasks that make hair, spawn and despawn it.

use super::{
    alike::{Makings, Share},
    error::{SEARCH_TIME, WearError},
    facing::FacingFrom,
    fall::Fall,
    make::{Made, MakeInput, RefitInput, Solids, refit},
    missing::missing_asset,
    target::{Characters, Fitted, Search, Target},
    what::{HairNotWorn, HairSource, HairWorn, WearHair, WornAs},
};
use crate::{
    authoring::{
        attach::{OtherMesh, RootsOnMesh, TiedRoots},
        groom::Groom,
    },
    base::{
        fault::{FaultKind, HairFault},
        setting::HairDefault,
    },
    hair::{
        look::HairDye,
        strand::{Hair, Strand, StrandOf, Strands},
        worn::{PassedTypes, Wearer, WornBy, WornHair},
    },
    hairdo::style::{HairStyle, KeptStyle},
    simulation::settle::{SettleConditions, Settling},
    water::HairWetting,
};
use bevy::{
    ecs::system::SystemParam,
    mesh::Mesh3d,
    platform::{
        collections::{HashMap, HashSet},
        time::Instant,
    },
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};
use core::time::Duration;
use std::sync::Arc;

/// How long heads are found in a frame, where there are many, and how many strands are spawned in one.
const FIND_TIME: Duration = Duration::from_millis(2);
const MOST_STRANDS: usize = 800;

/// State of a wearer.
#[derive(Component, Default)]
pub(super) struct Wearing {
    /// What is worn or being made.
    wanted: Option<WearHair>,
    stage: WearStage,
    /// Whether another is wanted than the one that is being made, which is put on first.
    lags: bool,
    /// How the worn hair fell when it settled.
    fall: Option<Arc<Fall>>,
    /// Whether the worn hair took over how other hair lay, and time has stood still since; and whether what is being
    /// made is the same hair, settled.
    is_carried: bool,
    settles: bool,
    /// The bone or mesh that it is worn on.
    head: Option<Entity>,
    /// The worn hair.
    worn: Option<Entity>,
    /// Whether its meshes have changed since its colliders were fitted, and the fit that runs.
    has_changed: bool,
    refit: Option<Task<Result<Solids, WearError>>>,
}

#[derive(Default)]
enum WearStage {
    /// Searching for the head.
    #[default]
    Begun,
    /// The same, for `seconds`; once a failure has been `reported`, from [`SEARCH_TIME`] to a second later.
    Searching { seconds: f32, reported: bool },
    /// Its hair is to be made.
    Found(Box<Found>),
    /// Its hair is being made.
    Making(Share),
    /// It has its hair, or cannot have it.
    Done,
}

/// What hair is made of, but for the world's settings.
struct Found {
    wear: WearHair,
    target: Target,
    groom: Option<Groom>,
}

impl Wearing {
    /// Its hair is to be made, from the beginning.
    fn begin(&mut self, wear: &WearHair) {
        self.wanted = Some(wear.clone());
        self.stage = WearStage::Begun;
        self.head = None;
        (self.lags, self.settles) = (false, false);
    }
}

/// Despawns worn hair with the colliders that were fitted for it.
fn despawn_worn(
    commands: &mut Commands,
    wearer: Entity,
    hair: Entity,
    fitted: &Query<(Entity, &Fitted)>,
) {
    commands.entity(hair).try_despawn();
    #[cfg(feature = "render")]
    super::old_hair::show(commands, wearer);
    for (collider, _) in fitted.iter().filter(|(_, fitted)| fitted.wearer == wearer) {
        commands.entity(collider).try_despawn();
    }
}

/// Removes the hair of what no longer wears any, or is despawned: a beard hangs on a bone, which stays when the mesh
/// that wears it goes.
pub(super) fn leave(
    gone: On<Remove, Wearing>,
    mut commands: Commands,
    wearers: Query<(&Wearing, Option<&WornHair>)>,
    made: Query<(), With<WornAs>>,
    fitted: Query<(Entity, &Fitted)>,
) {
    let wearer = gone.entity;
    let Ok((wearing, worn)) = wearers.get(wearer) else { return };
    // One that has just been copied has not found its hair yet.
    let named = || worn.and_then(|worn| worn.iter().find(|hair| made.contains(*hair)));
    if let Some(hair) = wearing.worn.or_else(named) {
        despawn_worn(&mut commands, wearer, hair, &fitted);
    }
}

/// Wearers that are new find the hair that names them: copies and loaded scenes.
pub(super) fn find_worn(
    mut wearers: Query<(&mut Wearing, &WornHair), Added<Wearing>>,
    made: Query<(Entity, &WornAs, Option<&ChildOf>)>,
) {
    for (mut wearing, worn) in &mut wearers {
        if let Some((hair, worn, on)) = made.iter_many(worn.iter()).next() {
            *wearing = Wearing {
                wanted: Some(worn.wear.clone()),
                stage: WearStage::Done,
                head: on.map(ChildOf::parent),
                worn: Some(hair),
                ..default()
            };
        }
    }
}

/// Ends the wearing of entities without [`WearHair`].
pub(super) fn take_off(
    mut commands: Commands,
    bald: Query<Entity, (With<Wearing>, Without<WearHair>)>,
) {
    for entity in &bald {
        commands.entity(entity).remove::<(Wearing, Wearer)>();
    }
}

/// Starts again where the source of the hair has changed or its hair was despawned with the scene.
/// Changes that worn hair can take are applied to it.
pub(super) fn detect_changes(
    mut commands: Commands,
    mut wearers: Query<(Ref<WearHair>, &mut Wearing)>,
    time: Option<Res<Time<Virtual>>>,
    mut events: Option<MessageReader<AssetEvent<Groom>>>,
    mut hairs: Query<(&mut WornAs, &mut TiedRoots), With<Hair>>,
) {
    let changed: HashSet<_> = events
        .iter_mut()
        .flat_map(|events| events.read())
        .filter_map(|event| match event {
            AssetEvent::Modified { id } => Some(*id),
            _ => None,
        })
        .collect();
    let stands_still = time.is_some_and(|time| time.is_paused());
    for (wear, mut wearing) in &mut wearers {
        // In time that goes on, hair settles before the eyes.
        wearing.bypass_change_detection().is_carried &= stands_still;
        let mut is_other = wear.is_changed() && wearing.wanted.as_ref() != Some(&*wear);
        if is_other
            && let Some(hair) = &wearing.worn
            && matches!(wearing.stage, WearStage::Done)
            && let Some(before) =
                wearing.wanted.as_ref().filter(|before| before.is_same_hair(&wear))
        {
            restyle(&mut commands, *hair, before, &wear);
            if let Ok((mut worn, _)) = hairs.get_mut(*hair) {
                worn.wear = WearHair::clone(&wear);
            }
            wearing.wanted = Some(WearHair::clone(&wear));
            is_other = false;
        }
        if wearing.settles && (is_other || !stands_still) {
            (wearing.stage, wearing.settles) = (WearStage::Done, false);
        }
        // A slider that is dragged: what is being made is shown before the next is begun.
        let is_making = matches!(wearing.stage, WearStage::Making(_));
        let is_variation = || wearing.wanted.as_ref().is_some_and(|old| old.is_variation(&wear));
        if is_other && is_making && is_variation() {
            wearing.lags = !wearing.wanted.as_ref().is_some_and(|old| old.is_same_hair(&wear));
            is_other = false;
        }
        let is_reloaded = match &wear.hair {
            HairSource::Groom { groom, .. } => changed.contains(&groom.id()),
            HairSource::Preset(_) => false,
        };
        let is_overdue = wearing.lags && matches!(wearing.stage, WearStage::Done);
        let is_gone = wearing.worn.as_ref().is_some_and(|hair| !hairs.contains(*hair));
        let is_done = matches!(wearing.stage, WearStage::Done);
        let has_lost_roots = is_done
            && wearing.worn.is_some_and(|hair| {
                hairs
                    .get_mut(hair)
                    .is_ok_and(|(_, mut tied)| tied.bypass_change_detection().take_lost())
            });
        if is_reloaded && is_making {
            wearing.lags = true;
        } else if is_other || is_overdue || is_reloaded || has_lost_roots || (is_gone && is_done) {
            wearing.begin(&wear);
        } else if wearing.is_carried && is_done && wear.at.is_none() {
            wearing.begin(&wear);
            (wearing.is_carried, wearing.settles) = (false, true);
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

/// Finds the heads of wearers.
#[derive(SystemParam)]
pub(super) struct Finder<'w, 's> {
    commands: Commands<'w, 's>,
    time: Option<Res<'w, Time<Real>>>,
    characters: Characters<'w, 's>,
    grooms: Option<Res<'w, Assets<Groom>>>,
    wearers: Query<'w, 's, (Entity, &'static WearHair, &'static mut Wearing)>,
    faults: MessageWriter<'w, HairFault>,
}

/// Searches for heads.
pub(super) fn find_heads(finder: Finder) {
    finder.find(None);
}

impl Finder<'_, '_> {
    /// All, in the time that a frame has for it; or those of hair that is due by now.
    fn find(self, due: Option<Duration>) {
        let Self { mut commands, time, characters, grooms, mut wearers, mut faults } = self;
        // The wearer of a preset on each head.
        let mut taken: HashMap<Entity, Entity> = (wearers.iter())
            .filter(|(_, wear, _)| matches!(wear.hair, HairSource::Preset(_)))
            .filter_map(|(wearer, _, wearing)| Some((wearing.head?, wearer)))
            .collect();
        let start = Instant::now();
        let step = time.filter(|_| due.is_none()).map_or(0.0, |time| time.delta_secs());
        for (wearer, wear, mut wearing) in &mut wearers {
            if due.is_some_and(|now| wear.at.is_none_or(|at| at > now)) {
                continue;
            }
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
                WearStage::Found(_) | WearStage::Making(_) | WearStage::Done => continue,
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
                                Some(reason) => {
                                    failed(WearError::NotLoaded { what: "groom", reason })
                                }
                                None => WearStage::Searching { seconds, reported },
                            };
                            continue;
                        }
                    }
                }
            };
            wearing.stage = match characters.search(wearer, wear) {
                Search::Loading => WearStage::Searching { seconds, reported },
                Search::Nothing if seconds > SEARCH_TIME => {
                    if !reported {
                        commands.queue(move |world: &mut World| report_no_mesh(world, wearer));
                    }
                    WearStage::Searching { seconds: SEARCH_TIME, reported: true }
                }
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
                            let (wear, groom) = (wear.clone(), groom.cloned());
                            WearStage::Found(Box::new(Found { wear, target, groom }))
                        }
                    }
                }
            };
            let is_found = matches!(wearing.stage, WearStage::Found(_));
            if is_found && due.is_none() && start.elapsed() > FIND_TIME {
                break;
            }
        }
    }
}

/// Starts to make hair for heads that were found.
pub(super) fn start(world: &mut World, all: &mut QueryState<(Entity, &mut Wearing)>) {
    let found = all.iter_mut(world).filter_map(|(wearer, mut wearing)| {
        let wearing = wearing.bypass_change_detection();
        match core::mem::take(&mut wearing.stage) {
            WearStage::Found(found) => {
                Some((wearer, found, wearing.fall.clone().filter(|_| !wearing.settles)))
            }
            stage => {
                wearing.stage = stage;
                None
            }
        }
    });
    let found: Vec<_> = found.collect();
    for (wearer, found, fall) in found {
        let Found { wear, target, groom } = *found;
        let conditions = SettleConditions::of(world, wearer);
        #[cfg(feature = "render")]
        let shades = super::shade::shades(world, wearer);
        #[cfg(not(feature = "render"))]
        let shades = false;
        let input = MakeInput { wear, target, groom, before: fall, conditions, shades };
        let share = world.resource_mut::<Makings>().share(input);
        if let Some(mut wearing) = world.get_mut::<Wearing>(wearer) {
            wearing.stage = WearStage::Making(share);
        }
    }
}

fn report_failure(
    commands: &mut Commands,
    faults: &mut MessageWriter<HairFault>,
    wearer: Entity,
    error: WearError,
) {
    faults.write(fault(wearer, error.clone()));
    commands.trigger(HairNotWorn { entity: wearer, error });
}

fn fault(wearer: Entity, error: WearError) -> HairFault {
    let outcome = "the wearer keeps the hair that it has";
    HairFault::caused(FaultKind::Wear, error, outcome).of(wearer)
}

/// Reports that a wearer has no mesh, with the asset that is to blame for it.
fn report_no_mesh(world: &mut World, wearer: Entity) {
    let error = missing_asset(world, wearer).unwrap_or(WearError::NoMesh);
    world.write_message(fault(wearer, error.clone()));
    world.trigger(HairNotWorn { entity: wearer, error });
}

/// Replaces worn hair by finished new hair.
#[derive(SystemParam)]
pub(super) struct Hairdresser<'w, 's> {
    commands: Commands<'w, 's>,
    wearers: Query<'w, 's, (Entity, &'static WearHair, &'static mut Wearing)>,
    entities: Query<'w, 's, ()>,
    fitted: Query<'w, 's, (Entity, &'static Fitted)>,
    wetting: Option<Res<'w, HairDefault<HairWetting>>>,
    faults: MessageWriter<'w, HairFault>,
}

/// Puts on what is ready.
pub(super) fn put_on(dresser: Hairdresser) {
    dresser.put_on(None);
}

impl Hairdresser<'_, '_> {
    /// What is ready, as much as a frame has time for; or what is due by now, which is waited for.
    fn put_on(self, due: Option<Duration>) {
        let Self { mut commands, mut wearers, entities, fitted, wetting, mut faults } = self;
        let wetting = wetting.as_ref().map(|default| default.0).unwrap_or_default();
        let mut spawned = 0;
        for (wearer, wear, mut wearing) in &mut wearers {
            let is_meant = match due {
                Some(now) => wear.at.is_some_and(|at| at <= now),
                None => wear.at.is_none() && spawned < MOST_STRANDS,
            };
            let is_ready = |stage: &WearStage| match stage {
                WearStage::Making(share) => share.is_ready(due.is_some()),
                _ => false,
            };
            if !is_meant || !is_ready(&wearing.stage) {
                continue;
            }
            let stage = core::mem::replace(&mut wearing.stage, WearStage::Done);
            let WearStage::Making(share) = stage else { continue };
            let Some(ready) = share.take() else { continue };
            match ready {
                Ok(mut made)
                    if entities.contains(made.parent)
                        && made.skin.iter().all(|(mesh, _)| entities.contains(*mesh)) =>
                {
                    if let Some(old) = wearing.worn.take() {
                        despawn_worn(&mut commands, wearer, old, &fitted);
                    }
                    spawned += made.strands.len();
                    let ((facing, facing_from), mesh) = (made.facing, made.skin[0].0);
                    log_made(wearer, &made);
                    let fall = made.fall.take();
                    (wearing.is_carried, wearing.settles) = (made.is_carried, false);
                    let of_strands = core::mem::take(&mut made.faults);
                    // What was made, looking as is wanted now.
                    let made_as = wearing.wanted.clone().unwrap_or_else(|| wear.clone());
                    let made_as = made_as.looking_like(wear);
                    wearing.wanted = Some(made_as.clone());
                    let hair = spawn_hair(&mut commands, wearer, &made_as, made, wetting);
                    faults.write_batch(of_strands.into_iter().map(|fault| fault.of(hair)));
                    let event = HairWorn { entity: wearer, hair, mesh, facing, facing_from };
                    commands.trigger(event);
                    wearing.worn = Some(hair);
                    wearing.fall = fall.or(wearing.fall.take());
                }
                // The scene was despawned while the hair was made.
                Ok(_) => wearing.begin(wear),
                Err(error) => {
                    wearing.head = None;
                    report_failure(&mut commands, &mut faults, wearer, error);
                }
            }
        }
    }
}

/// Before a tick: puts on the hair whose time has come.
pub(super) fn put_on_due(world: &mut World, all: &mut QueryState<(&WearHair, &mut Wearing)>) {
    let now = world.resource::<Time>().elapsed();
    let mut is_any = false;
    for (wear, mut wearing) in all.iter_mut(world) {
        if wear.at.is_none_or(|at| at > now) {
            continue;
        }
        // Written since the frame began.
        let is_known = wearing.wanted.as_ref().is_some_and(|wanted| wanted.is_same_hair(wear));
        if !is_known {
            wearing.begin(wear);
        }
        is_any |= !matches!(wearing.stage, WearStage::Done);
    }
    if is_any {
        let _ = world.run_system_cached_with(
            |In(now): In<Duration>, finder: Finder| finder.find(Some(now)),
            now,
        );
        let _ = world.run_system_cached(start);
        let _ = world.run_system_cached_with(
            |In(now): In<Duration>, dresser: Hairdresser| dresser.put_on(Some(now)),
            now,
        );
    }
}

/// Whether hair is put on at a time of the game's choice.
pub(super) fn any_with_time(wearers: Query<&WearHair>) -> bool {
    wearers.iter().any(|wear| wear.at.is_some())
}

/// Logs what was found of a character.
fn log_made(wearer: Entity, made: &Made) {
    let (choice, (way, from)) = (&made.choice, made.facing);
    tracing::info!(
        "hair of {wearer}: {choice}; the face looks along {:?} ({from:?})",
        way.to_array()
    );
    if from == FacingFrom::Assumed {
        tracing::warn!(
            "hair of {wearer}: no bone of an eye, toe or foot and no nose shows where the face looks; it is \
             taken to look along -Z: set WearHair::facing"
        );
    }
}

fn spawn_hair(
    commands: &mut Commands,
    wearer: Entity,
    wear: &WearHair,
    made: Made,
    wetting: HairWetting,
) -> Entity {
    let (mesh, strands_from_mesh) = made.skin[0];
    let others =
        made.skin[1..].iter().map(|&(mesh, from)| OtherMesh { mesh, strands_from_mesh: from });
    let roots = RootsOnMesh {
        mesh: Some(mesh),
        roots: made.roots,
        strands_from_mesh,
        others: others.collect(),
    };
    #[cfg(feature = "render")]
    if wear.hides_old_hair {
        super::old_hair::hide(commands, wearer, &made.old_hair);
    }
    let is = (WornBy(wearer), WornAs { wear: wear.clone(), parts: made.parts });
    let wetting = HairWetting { fibres: made.fibres, ..wetting };
    let mut hair = commands.spawn((Hair, made.place, ChildOf(made.parent), is, wetting, roots));
    if let Some(mut settings) = made.settings {
        settings.wetting = wetting;
        hair.insert(settings);
    }
    if let Some(preset) = made.preset {
        hair.insert(preset);
    }
    // It has settled.
    hair.remove::<Settling>();
    #[cfg(feature = "render")]
    {
        if let Some(look) = made.look {
            hair.insert(look);
        }
        if !made.followers.0.is_empty() {
            hair.insert(made.followers);
        }
        if let Some(shells) = made.shells {
            hair.insert(super::shade::Shading::Made(shells));
        }
    }
    let hair = hair.id();
    let strands =
        made.strands.into_iter().map(move |(strand, bonds)| (StrandOf(hair), strand, bonds));
    commands.spawn_batch(strands.collect::<Vec<_>>());
    spawn_solids(commands, wearer, hair, made.solids);
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
    commands.queue(move |world: &mut World| PassedTypes::pass(world, wearer, hair));
    hair
}

fn spawn_solids(commands: &mut Commands, wearer: Entity, hair: Entity, solids: Solids) {
    let is = Fitted { wearer };
    for ball in solids.balls {
        commands.spawn((ball, is, ChildOf(hair)));
    }
    for (joint, capsule) in solids.capsules {
        commands.spawn((capsule, is, ChildOf(joint)));
    }
}

/// Fits the colliders of worn hair again when its meshes have changed; one fit at a time.
pub(super) fn fit_again(
    mut commands: Commands,
    characters: Characters,
    mut edits: Option<MessageReader<AssetEvent<Mesh>>>,
    replaced: Query<(), Changed<Mesh3d>>,
    meshes: Query<&Mesh3d>,
    mut wearers: Query<(Entity, &WearHair, &mut Wearing)>,
    hairs: Query<(&WornAs, &RootsOnMesh, &Strands)>,
    strands: Query<&Strand>,
    fitted: Query<(Entity, &Fitted)>,
    joints: Query<()>,
) {
    let edits = edits.iter_mut().flat_map(|edits| edits.read());
    let edited: HashSet<AssetId<Mesh>> = edits
        .filter_map(|event| match event {
            AssetEvent::Modified { id } => Some(*id),
            _ => None,
        })
        .collect();
    let has_changed = |part: &Entity| {
        replaced.contains(*part) || meshes.get(*part).is_ok_and(|mesh| edited.contains(&mesh.id()))
    };
    for (wearer, wear, mut wearing) in &mut wearers {
        let wearing = wearing.bypass_change_detection();
        let Some(hair) = wearing.worn.filter(|_| matches!(wearing.stage, WearStage::Done)) else {
            (wearing.has_changed, wearing.refit) = default();
            continue;
        };
        let Ok((worn, roots, members)) = hairs.get(hair) else { continue };
        wearing.has_changed |= worn.parts.iter().any(has_changed);
        let ready = wearing.refit.as_mut().and_then(check_ready);
        let is_ready = ready.is_some();
        if let Some(Ok(mut solids)) = ready {
            for (collider, _) in fitted.iter().filter(|(_, fitted)| fitted.wearer == wearer) {
                commands.entity(collider).try_despawn();
            }
            solids.capsules.retain(|(joint, _)| joints.contains(*joint));
            spawn_solids(&mut commands, wearer, hair, solids);
        }
        if is_ready {
            wearing.refit = None;
        }
        if !wearing.has_changed || wearing.refit.is_some() || !wear.colliders {
            continue;
        }
        let Some(pool) = AsyncComputeTaskPool::try_get() else { continue };
        let target = match characters.search(wearer, wear) {
            Search::Found(target) => target,
            Search::Loading => continue,
            Search::Nothing | Search::Failed(_) => {
                wearing.has_changed = false;
                continue;
            }
        };
        let lengths = strands.iter_many(members.collection()).map(Strand::length);
        let order = RefitInput {
            wear: wear.clone(),
            target,
            skin: roots.meshes().collect(),
            roots: roots.roots.clone(),
            longest: lengths.fold(0.0, f32::max),
        };
        wearing.has_changed = false;
        wearing.refit = Some(pool.spawn(async move { refit(order) }));
    }
}
