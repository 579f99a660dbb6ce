//! The systems: find heads, start tasks that make hair, spawn and despawn it.

use super::{
    alike::{Makings, Share},
    error::{SEARCH_TIME, WearError},
    facing::FacingFrom,
    fall::Fall,
    make::{HairInput, Made, MadeHair, MakeInput, RefitInput, Rooted, Solids, Source, refit},
    missing::missing_asset,
    target::{Characters, Fitted, Search, Target},
    what::{HairNotWorn, HairSource, HairWorn, WearHair, WornAs},
};
#[cfg(feature = "save")]
use crate::hairdo::save::Regrowth;
use crate::{
    authoring::{
        attach::{OtherMesh, RootsOnMesh, TiedRoots},
        groom::Groom,
        recipe::{FollowRecipe, Followed, HairRecipe, apply},
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
    simulation::settle::{SettleConditions, Settled, Settling},
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
    /// Whether what is being made is the worn hair, settled.
    settles: bool,
    /// The bone or mesh that it is worn on.
    head: Option<Entity>,
    /// The worn hairs, in the component's order.
    worn: Vec<Worn>,
    /// Whether its meshes have changed since its colliders were fitted, and the fit that runs.
    has_changed: bool,
    refit: Option<Task<Result<Solids, WearError>>>,
}

/// A worn hair.
#[derive(Clone)]
struct Worn {
    hair: Entity,
    /// How it fell when it settled.
    fall: Option<Arc<Fall>>,
    /// Whether it took over how other hair lay, and time has stood still since.
    is_carried: bool,
    /// Whether what it was made of is another since: its groom, or its mesh.
    is_stale: bool,
}

impl Worn {
    fn found(hair: Entity) -> Self {
        Self { hair, fall: None, is_carried: false, is_stale: false }
    }
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
    /// Its hair is being made, but for those of the worn hairs that are kept.
    Making(Share, Vec<Option<Entity>>),
    /// It has its hair, or cannot have it.
    Done,
}

/// What hair is made of, but for the world's settings.
struct Found {
    wear: WearHair,
    target: Target,
    /// For each hair.
    sources: Vec<Source>,
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

/// Despawns worn hairs, and the colliders that were fitted for the wearer.
fn despawn_worn(
    commands: &mut Commands,
    wearer: Entity,
    hairs: impl IntoIterator<Item = Entity>,
    fitted: &Query<(Entity, &Fitted)>,
) {
    hairs.into_iter().for_each(|hair| commands.entity(hair).try_despawn());
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
    let mut hairs: Vec<Entity> = wearing.worn.iter().map(|worn| worn.hair).collect();
    if hairs.is_empty() {
        // One that has just been copied has not found its hair yet.
        let named = worn.into_iter().flat_map(|worn| worn.iter());
        hairs.extend(named.filter(|hair| made.contains(*hair)));
    }
    if !hairs.is_empty() {
        despawn_worn(&mut commands, wearer, hairs, &fitted);
    }
}

/// Wearers that are new find the hair that names them: copies and loaded scenes.
pub(super) fn find_worn(
    mut wearers: Query<(&mut Wearing, &WornHair), Added<Wearing>>,
    made: Query<(Entity, &WornAs, Option<&ChildOf>)>,
) {
    for (mut wearing, worn) in &mut wearers {
        let mut all: Vec<_> = made.iter_many(worn.iter()).collect();
        all.sort_by_key(|(_, worn, _)| worn.which);
        all.dedup_by_key(|(_, worn, _)| worn.which);
        if let Some((_, _, on)) = all.first() {
            *wearing = Wearing {
                wanted: WearHair::of_each(all.iter().map(|(_, worn, _)| worn.wear.clone())),
                stage: WearStage::Done,
                head: on.map(ChildOf::parent),
                worn: all.iter().map(|(hair, ..)| Worn::found(*hair)).collect(),
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
    (mut events, mut recipe_events): (
        Option<MessageReader<AssetEvent<Groom>>>,
        Option<MessageReader<AssetEvent<HairRecipe>>>,
    ),
    recipes: Option<Res<Assets<HairRecipe>>>,
    mut hairs: Query<(&mut WornAs, &mut TiedRoots, Option<&Followed>), With<Hair>>,
    (members, strands): (Query<&Strands>, Query<Ref<Strand>>),
) {
    let changed: HashSet<_> =
        events.iter_mut().flat_map(|events| events.read()).filter_map(modified).collect();
    let recipe_events = recipe_events.iter_mut().flat_map(|events| events.read());
    let changed_recipes: HashSet<_> = recipe_events.filter_map(modified).collect();
    let stands_still = time.is_some_and(|time| time.is_paused());
    let is_written = |hair: Entity| {
        let mut own = strands.iter_many(members.get(hair).into_iter().flat_map(Strands::iter));
        own.any(|strand| strand.is_changed() && !strand.is_added())
    };
    for (wear, mut wearing) in &mut wearers {
        // In time that goes on, hair settles before the eyes; what is cut or styled meanwhile stays as it is.
        for worn in &mut wearing.bypass_change_detection().worn {
            worn.is_carried = worn.is_carried && stands_still && !is_written(worn.hair);
        }
        let is_carried = wearing.worn.iter().any(|worn| worn.is_carried);
        let mut is_other = wear.is_changed() && wearing.wanted.as_ref() != Some(&*wear);
        let is_same = || wearing.wanted.as_ref().is_some_and(|before| before.is_same_hair(&wear));
        let is_worn = !wearing.worn.is_empty() && matches!(wearing.stage, WearStage::Done);
        if is_other && is_worn && is_same() {
            for (own, wear) in wearing.worn.iter().zip(wear.each()) {
                if let Ok((mut worn, ..)) = hairs.get_mut(own.hair) {
                    restyle(&mut commands, own.hair, &mut worn, wear);
                }
            }
            wearing.wanted = Some(WearHair::clone(&wear));
            is_other = false;
        }
        if wearing.settles && (is_other || !is_carried) {
            (wearing.stage, wearing.settles) = (WearStage::Done, false);
        }
        // A slider that is dragged: what is being made is shown before the next is begun.
        let is_making = matches!(wearing.stage, WearStage::Making(..));
        let is_variation = || wearing.wanted.as_ref().is_some_and(|old| old.is_variation(&wear));
        if is_other && is_making && is_variation() {
            wearing.lags = !wearing.wanted.as_ref().is_some_and(|old| old.is_same_hair(&wear));
            is_other = false;
        }
        // A recipe that only sets hair that has grown otherwise makes none.
        let is_reloaded = |hair: &HairSource, has: Option<&Followed>| match hair {
            HairSource::Groom { groom, .. } => changed.contains(&groom.id()),
            HairSource::Recipe(recipe) => {
                let now = recipes.as_ref().and_then(|recipes| recipes.get(recipe));
                let grows_alike = || has.zip(now).is_some_and(|(has, now)| has.grows_like(now));
                changed_recipes.contains(&recipe.id()) && !grows_alike()
            }
            HairSource::Preset(_) => false,
        };
        let is_overdue = wearing.lags && matches!(wearing.stage, WearStage::Done);
        let is_done = matches!(wearing.stage, WearStage::Done);
        let (mut is_gone, mut has_lost_roots) = (false, false);
        let mut reloaded = is_making && wear.sources().any(|hair| is_reloaded(hair, None));
        for own in &mut wearing.bypass_change_detection().worn {
            let Ok((worn, mut tied, followed)) = hairs.get_mut(own.hair) else {
                is_gone = true;
                continue;
            };
            let is_other = is_reloaded(&worn.wear.hair, followed);
            (own.is_stale, reloaded) = (own.is_stale || is_other, reloaded || is_other);
            if is_done && tied.bypass_change_detection().take_lost() {
                (own.is_stale, has_lost_roots) = (true, true);
            }
        }
        let is_to_settle = is_carried && !wearing.settles;
        if reloaded && is_making {
            wearing.lags = true;
        } else if is_other || is_overdue || reloaded || has_lost_roots || (is_gone && is_done) {
            wearing.begin(&wear);
        } else if is_done && wear.at.is_none() && is_to_settle {
            wearing.begin(&wear);
            wearing.settles = true;
        }
    }
}

/// The asset of an event that says that it is another.
fn modified<A: Asset>(event: &AssetEvent<A>) -> Option<AssetId<A>> {
    match event {
        AssetEvent::Modified { id } => Some(*id),
        _ => None,
    }
}

/// Makes worn hair what is wanted now: applies changes of look, dye and [`HairStyle`].
fn restyle(commands: &mut Commands, hair: Entity, worn: &mut WornAs, wear: WearHair) {
    let before = core::mem::replace(&mut worn.wear, wear);
    let wear = &worn.wear;
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

type Wearers<'w, 's> = Query<'w, 's, (Entity, &'static WearHair, &'static mut Wearing)>;

/// Finds the heads of wearers.
#[derive(SystemParam)]
pub(super) struct Finder<'w, 's> {
    commands: Commands<'w, 's>,
    time: Option<Res<'w, Time<Real>>>,
    characters: Characters<'w, 's>,
    grooms: Option<Res<'w, Assets<Groom>>>,
    recipes: Option<Res<'w, Assets<HairRecipe>>>,
    wearers: Wearers<'w, 's>,
    faults: MessageWriter<'w, HairFault>,
}

/// Searches for heads.
pub(super) fn find_heads(finder: Finder) {
    finder.find(None);
}

impl Finder<'_, '_> {
    /// All, in the time that a frame has for it; or those of hair that is due by now.
    fn find(self, due: Option<Duration>) {
        let Self { mut commands, time, characters, grooms, recipes, mut wearers, mut faults } =
            self;
        // The wearer of a preset on each head.
        let mut taken: HashMap<Entity, Entity> = (wearers.iter())
            .filter(|(_, wear, _)| has_preset(wear))
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
                WearStage::Found(_) | WearStage::Making(..) | WearStage::Done => continue,
            };
            // The scene may change: it is searched again.
            let mut failed = |error: WearError| {
                if !reported {
                    report_failure(&mut commands, &mut faults, wearer, error);
                }
                WearStage::Searching { seconds: SEARCH_TIME, reported: true }
            };
            let source = |hair: &HairSource| match hair {
                HairSource::Preset(preset) => Ok(Source::Recipe((*preset).into())),
                HairSource::Groom { groom, guides } => {
                    let loaded = grooms.as_ref().and_then(|grooms| grooms.get(groom));
                    let loaded = loaded.map(|groom| Source::Groom(groom.clone(), *guides));
                    loaded.ok_or(("groom", groom.id().untyped()))
                }
                HairSource::Recipe(recipe) => {
                    let loaded = recipes.as_ref().and_then(|recipes| recipes.get(recipe));
                    loaded.cloned().map(Source::Recipe).ok_or(("recipe", recipe.id().untyped()))
                }
            };
            let sources = match wear.sources().map(source).collect::<Result<Vec<_>, _>>() {
                Ok(sources) => sources,
                Err((what, missing)) => {
                    wearing.stage = match characters.failure(missing) {
                        Some(reason) => failed(WearError::NotLoaded { what, reason }),
                        None => WearStage::Searching { seconds, reported },
                    };
                    continue;
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
                    let is_preset = has_preset(wear);
                    match taken.get(&target.head).filter(|by| is_preset && **by != wearer) {
                        Some(&by) => failed(WearError::Taken { by }),
                        None => {
                            if is_preset {
                                taken.insert(target.head, wearer);
                            }
                            wearing.head = Some(target.head);
                            let wear = wear.clone();
                            WearStage::Found(Box::new(Found { wear, target, sources }))
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

fn has_preset(wear: &WearHair) -> bool {
    wear.sources().any(|hair| !matches!(hair, HairSource::Groom { .. }))
}

/// Starts to make hair for heads that were found.
pub(super) fn start(world: &mut World, all: &mut QueryState<(Entity, &mut Wearing)>) {
    let found = all.iter_mut(world).filter_map(|(wearer, mut wearing)| {
        let wearing = wearing.bypass_change_detection();
        match core::mem::take(&mut wearing.stage) {
            WearStage::Found(found) => Some((wearer, found)),
            stage => {
                wearing.stage = stage;
                None
            }
        }
    });
    let found: Vec<_> = found.collect();
    for (wearer, found) in found {
        let Some(wearing) = world.get::<Wearing>(wearer) else { continue };
        let kept = kept(world, wearing, &found);
        let falls = wearing.worn.iter().filter(|_| !wearing.settles);
        let before = falls.filter_map(|worn| worn.fall.clone()).collect();
        let Found { wear, target, sources } = *found;
        let hairs = sources.into_iter().zip(&kept);
        let hairs = hairs.map(|(source, kept)| HairInput { source, is_kept: kept.is_some() });
        let hairs = hairs.collect();
        let conditions = SettleConditions::of(world, wearer);
        #[cfg(feature = "render")]
        let shades = super::shade::shades(world, wearer);
        #[cfg(not(feature = "render"))]
        let shades = false;
        let input = MakeInput { wear, target, hairs, before, conditions, shades };
        let share = world.resource_mut::<Makings>().share(input);
        if let Some(mut wearing) = world.get_mut::<Wearing>(wearer) {
            wearing.stage = WearStage::Making(share, kept);
        }
    }
}

/// For each hair that is to be worn the one that is it already, on the same meshes.
fn kept(world: &World, wearing: &Wearing, found: &Found) -> Vec<Option<Entity>> {
    let is_as_made = |worn: &&Worn| !(worn.is_stale || wearing.settles && worn.is_carried);
    let worn = wearing.worn.iter().filter(is_as_made);
    let worn: Vec<_> =
        worn.filter_map(|worn| Some((worn.hair, world.get::<WornAs>(worn.hair)?))).collect();
    let parts = || found.target.parts.iter().map(|part| &part.entity);
    let own = |wear: WearHair| {
        let is_it = |is: &WornAs| is.wear.is_same_hair(&wear) && is.parts.iter().eq(parts());
        worn.iter().find(|(_, is)| is_it(is)).map(|(hair, _)| *hair)
    };
    found.wear.each().map(own).collect()
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
    entities: Query<'w, 's, ()>,
    hairs: Query<'w, 's, (&'static mut WornAs, &'static Transform)>,
    fitted: Query<'w, 's, (Entity, &'static Fitted)>,
    wetting: Option<Res<'w, HairDefault<HairWetting>>>,
    faults: MessageWriter<'w, HairFault>,
}

/// Puts on what is ready.
pub(super) fn put_on(mut dresser: Hairdresser, wearers: Wearers) {
    dresser.put_on(wearers, None);
}

impl Hairdresser<'_, '_> {
    /// What is ready, as much as a frame has time for; or what is due by now, which is waited for.
    fn put_on(&mut self, mut wearers: Wearers, due: Option<Duration>) {
        let mut spawned = 0;
        for (wearer, wear, mut wearing) in &mut wearers {
            let is_meant = match due {
                Some(now) => wear.at.is_some_and(|at| at <= now),
                None => wear.at.is_none() && spawned < MOST_STRANDS,
            };
            let is_ready = |stage: &WearStage| match stage {
                WearStage::Making(share, _) => share.is_ready(due.is_some()),
                _ => false,
            };
            if !is_meant || !is_ready(&wearing.stage) {
                continue;
            }
            let stage = core::mem::replace(&mut wearing.stage, WearStage::Done);
            let WearStage::Making(share, kept) = stage else { continue };
            let Some(ready) = share.take() else { continue };
            match ready {
                Ok(made) if self.can_be_worn(&made, &kept) => {
                    spawned +=
                        made.hairs.iter().flatten().map(|new| new.strands.len()).sum::<usize>();
                    self.dress(wearer, wear, &mut wearing, made, &kept);
                }
                // The scene was despawned while the hair was made.
                Ok(_) => wearing.begin(wear),
                Err(error) => {
                    wearing.head = None;
                    report_failure(&mut self.commands, &mut self.faults, wearer, error);
                }
            }
        }
    }

    /// Whether what it hangs on, and the worn hairs that are kept, are there.
    fn can_be_worn(&self, made: &Made, kept: &[Option<Entity>]) -> bool {
        let mut of_head = made.skin.iter().map(|(mesh, _)| *mesh).chain([made.parent]);
        of_head.all(|entity| self.entities.contains(entity))
            && kept.iter().flatten().all(|hair| self.hairs.contains(*hair))
    }

    /// Puts on what was made, at once.
    fn dress(
        &mut self,
        wearer: Entity,
        wear: &WearHair,
        wearing: &mut Wearing,
        mut made: Made,
        kept: &[Option<Entity>],
    ) {
        if core::mem::take(&mut wearing.settles) {
            for (worn, new) in wearing.worn.iter_mut().zip(made.hairs) {
                let Some(new) = new.filter(|_| worn.is_carried) else { continue };
                (worn.fall, worn.is_carried) = (new.fall, false);
                let (settled, hair) =
                    (Settled { strands: new.strands, faults: new.faults }, worn.hair);
                self.commands.queue(move |world: &mut World| settled.lay(world, hair));
            }
            return;
        }
        log_made(wearer, &made);
        let before = core::mem::take(&mut wearing.worn);
        #[cfg(feature = "save")]
        let mut regrowths = self.regrowths(&before, wearing.wanted.as_ref().unwrap_or(wear), kept);
        let gone = before.iter().map(|worn| worn.hair).filter(|hair| !kept.contains(&Some(*hair)));
        despawn_worn(&mut self.commands, wearer, gone, &self.fitted);
        #[cfg(feature = "render")]
        if wear.hides_old_hair {
            super::old_hair::hide(&mut self.commands, wearer, &made.old_hair);
        }
        // What was made, looking as is wanted now.
        let made_as = wearing.wanted.take().unwrap_or_else(|| wear.clone()).looking_like(wear);
        let mut solids = core::mem::take(&mut made.solids);
        let hairs = core::mem::take(&mut made.hairs).into_iter().zip(made_as.each());
        for (which, ((new, wear), kept)) in hairs.zip(kept).enumerate() {
            let worn = match (new, kept) {
                (Some(new), _) => {
                    let fall = new.fall.clone();
                    #[cfg(feature = "save")]
                    let regrowth = regrowths.get_mut(which).and_then(Option::take);
                    let worn = Worn {
                        is_carried: new.is_carried,
                        fall: fall.or_else(|| before.get(which)?.fall.clone()),
                        // A groom that was loaded again meanwhile.
                        is_stale: wearing.lags && !matches!(wear.hair, HairSource::Preset(_)),
                        hair: self.spawn(wearer, &made, new, wear, which),
                    };
                    #[cfg(feature = "save")]
                    if let Some(regrowth) = regrowth {
                        regrowth.put_on(&mut self.commands, worn.hair, |_| true);
                    }
                    worn
                }
                (None, Some(hair)) => {
                    let Ok((mut is, place)) = self.hairs.get_mut(*hair) else { continue };
                    if which == 0 && *place != made.place {
                        solids.move_balls(place.to_matrix().inverse() * made.place.to_matrix());
                    }
                    restyle(&mut self.commands, *hair, &mut is, wear);
                    is.which = which;
                    let own = before.iter().find(|worn| worn.hair == *hair);
                    own.cloned().unwrap_or_else(|| Worn::found(*hair))
                }
                (None, None) => continue,
            };
            wearing.worn.push(worn);
        }
        wearing.wanted = Some(made_as);
        let mut hairs = wearing.worn.iter().map(|worn| worn.hair);
        let Some(hair) = hairs.next() else { return };
        spawn_solids(&mut self.commands, wearer, hair, solids);
        let ((facing, facing_from), mesh) = (made.facing, made.skin[0].0);
        let beside = hairs.collect();
        let event = HairWorn { entity: wearer, hair, beside, mesh, facing, facing_from };
        self.commands.trigger(event);
    }

    /// What has been done to hair whose groom is loaded again, or is otherwise made anew as it was.
    #[cfg(feature = "save")]
    fn regrowths(
        &mut self,
        before: &[Worn],
        wanted: &WearHair,
        kept: &[Option<Entity>],
    ) -> Vec<Option<Regrowth>> {
        let taken = before.iter().zip(wanted.each()).zip(kept).map(|((worn, wear), kept)| {
            let is_asset = !matches!(wear.hair, HairSource::Preset(_));
            let (was, _) = self.hairs.get(worn.hair).ok()?;
            let is_same = is_asset && kept.is_none() && was.wear.is_same_hair(&wear);
            is_same.then(|| Regrowth::take(&mut self.commands, worn.hair, |_| true))
        });
        taken.collect()
    }

    /// Spawns a hair of what was made.
    fn spawn(
        &mut self,
        wearer: Entity,
        made: &Made,
        new: MadeHair,
        wear: WearHair,
        which: usize,
    ) -> Entity {
        let (mesh, strands_from_mesh) = made.skin[0];
        let others =
            made.skin[1..].iter().map(|&(mesh, from)| OtherMesh { mesh, strands_from_mesh: from });
        let roots = RootsOnMesh {
            mesh: Some(mesh),
            roots: new.roots,
            strands_from_mesh,
            others: others.collect(),
        };
        let wetting = self.wetting.as_ref().map(|default| default.0).unwrap_or_default();
        let wetting = HairWetting { fibres: new.fibres, ..wetting };
        let is = WornAs { wear: wear.clone(), which, parts: made.parts.clone() };
        let is = (Hair, made.place, ChildOf(made.parent), WornBy(wearer), is, wetting, roots);
        let mut hair = self.commands.spawn(is);
        if let Some(mut settings) = new.settings {
            settings.wetting = wetting;
            hair.insert(settings);
        }
        if let Some(preset) = new.preset {
            hair.insert(preset);
        }
        // It has settled.
        hair.remove::<Settling>();
        #[cfg(feature = "render")]
        {
            if let Some(look) = new.look {
                hair.insert(look);
            }
            if !new.followers.0.is_empty() {
                hair.insert(new.followers);
            }
            if let Some(shells) = new.shells {
                hair.insert(super::shade::Shading::Made(shells));
            }
        }
        let hair = hair.id();
        let strands =
            new.strands.into_iter().map(move |(strand, bonds)| (StrandOf(hair), strand, bonds));
        let strands = strands.collect::<Vec<_>>();
        if new.materials.is_empty() {
            self.commands.spawn_batch(strands);
        } else {
            self.commands.spawn_batch(strands.into_iter().zip(new.materials).collect::<Vec<_>>());
        }
        let mut own = self.commands.entity(hair);
        #[cfg(feature = "save")]
        if let Some(hairdo) = wear.hairdo {
            own.queue(hairdo.into_fitting_command());
        }
        if let (Some(recipe), HairSource::Recipe(handle)) = (new.recipe, &wear.hair) {
            own.insert(FollowRecipe(handle.clone())).queue(apply(recipe));
        }
        // These override the hairdo's.
        if let Some(look) = wear.look {
            own.insert(look);
        }
        if let Some(dye) = wear.dye {
            own.insert(dye);
        }
        if let Some(style) = wear.style {
            own.insert(style);
        }
        self.commands.queue(move |world: &mut World| PassedTypes::pass(world, wearer, hair));
        self.faults.write_batch(new.faults.into_iter().map(|fault| fault.of(hair)));
        hair
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
            |In(now): In<Duration>, mut dresser: Hairdresser, wearers: Wearers| {
                dresser.put_on(wearers, Some(now));
            },
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

fn spawn_solids(commands: &mut Commands, wearer: Entity, hair: Entity, solids: Solids) {
    let is = Fitted { wearer };
    for ball in solids.balls {
        commands.spawn((ball, is, ChildOf(hair)));
    }
    for (joint, capsule) in solids.capsules {
        commands.spawn((capsule, is, ChildOf(joint)));
    }
    for (on, helmet) in solids.helmets {
        commands.spawn((helmet, is, ChildOf(on)));
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
        let is_done = matches!(wearing.stage, WearStage::Done);
        let Some(first) = wearing.worn.first().filter(|_| is_done).map(|worn| worn.hair) else {
            (wearing.has_changed, wearing.refit) = default();
            continue;
        };
        let all = wearing.worn.iter().map(|worn| hairs.get(worn.hair));
        let Ok(all) = all.collect::<Result<Vec<_>, _>>() else { continue };
        let mut parts = all.iter().flat_map(|(worn, ..)| &worn.parts);
        wearing.has_changed |= parts.any(has_changed);
        let ready = wearing.refit.as_mut().and_then(check_ready);
        let is_ready = ready.is_some();
        if let Some(Ok(mut solids)) = ready {
            for (collider, _) in fitted.iter().filter(|(_, fitted)| fitted.wearer == wearer) {
                commands.entity(collider).try_despawn();
            }
            solids.capsules.retain(|(joint, _)| joints.contains(*joint));
            solids.helmets.retain(|(on, _)| joints.contains(*on));
            spawn_solids(&mut commands, wearer, first, solids);
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
        let members = all.iter().flat_map(|(.., members)| members.collection());
        let lengths = strands.iter_many(members).map(Strand::length);
        let rooted = all.iter().map(|(_, roots, _)| Rooted {
            skin: roots.meshes().collect(),
            roots: roots.roots.clone(),
        });
        let order = RefitInput {
            wear: wear.clone(),
            target,
            hairs: rooted.collect(),
            longest: lengths.fold(0.0, f32::max),
        };
        wearing.has_changed = false;
        wearing.refit = Some(pool.spawn(async move { refit(order) }));
    }
}
