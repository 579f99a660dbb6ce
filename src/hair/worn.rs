//! Who wears a hair, and what of a wearer acts on it.
//!
//! [`WornBy`] and [`WornHair`] lead from a hair to its character and back. What a game puts on the character acts on
//! its hair: `setting` and `component` register that for a component, `HairsOf` finds the hair that a request
//! to a character is about.

use crate::{
    base::{
        fault::{FaultKind, HairChecks, HairFault},
        schedule::HairFrame,
        setting::{self, HairSetting, Ranged},
    },
    hair::strand::Hair,
};
use bevy::{
    ecs::{
        query::QueryFilter,
        system::{SystemParam, SystemState},
    },
    prelude::*,
    reflect::{GetTypeRegistration, Typed},
    utils::prelude::ShortName,
};
use std::collections::VecDeque;

/// The character that wears a [`Hair`]. Component of the hair: [`WearHair`](crate::WearHair) puts it there, and so
/// may a game on hair that is made by hand.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Component, Clone, PartialEq)]
#[relationship(relationship_target = WornHair)]
pub struct WornBy(pub Entity);

/// The [`Hair`]s that a character wears, in the order they were put on. Kept by Bevy from [`WornBy`].
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// # #[derive(Component)] struct Player;
/// fn is_player_drenched(players: Query<&WornHair, With<Player>>, condition: HairCondition) -> bool {
///     players.iter().flat_map(|worn| worn.iter()).any(|hair| condition.wetness(hair) > 0.9)
/// }
/// ```
///
/// Requests and events take the wearer as well: `commands.trigger(SoakHair::dripping(character))`. Components of hair
/// ([`HairDye`](crate::HairDye), [`HairLod`](crate::HairLod), [`AirDrag`](crate::AirDrag), … and, where hair is drawn,
/// `RenderLayers`, `NoFrustumCulling`, `NotShadowCaster`, `NotShadowReceiver`) that are put on the wearer are copied to
/// its hair at the beginning of the next frame, whenever they change, and to hair that it wears later. What was
/// written last holds: a change on the wearer replaces what its hair has, and a hair may then be given another value.
/// When one is removed from the wearer, its hair has again what it had before. A hair that is no longer worn keeps
/// what it has.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone)]
#[relationship_target(relationship = WornBy)]
pub struct WornHair(Vec<Entity>);

/// On an entity that is to wear hair, whether it is there yet or not.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct Wearer;

pub(super) fn plugin(app: &mut App) {
    app.register_type::<WornBy>().register_type::<WornHair>();
}

/// Names entities on which components of its own entity act.
pub(crate) trait ActsOn: Component {
    /// The entities.
    fn others(&self) -> &[Entity];
}

impl ActsOn for WornHair {
    fn others(&self) -> &[Entity] {
        &self.0
    }
}

/// Components that can be passed on.
pub(crate) trait Passed:
    Component + Clone + FromReflect + Typed + GetTypeRegistration
{
}

impl<T: Component + Clone + FromReflect + Typed + GetTypeRegistration> Passed for T {}

/// On an entity whose `T` is a copy: whose, and what it had before.
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Clone)]
pub(crate) struct CopyOf<T: Passed> {
    #[entities]
    from: Entity,
    before: Option<T>,
}

/// In [`HairFrame`], what copies components of wearers to their hair, once hair has been put on.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PassedOn;

/// Copies `T` from where it is to the entities on which it acts: as it comes or changes, and to those that come
/// later. Where it is removed they get back what they had.
pub(crate) fn pass_on<T: Passed, S: ActsOn>(
    sources: Query<(Entity, Ref<T>, &S), Or<(Changed<T>, Changed<S>)>>,
    mut removed: RemovedComponents<T>,
    without: Query<&S, Without<T>>,
    others: Query<(Option<&T>, Option<&CopyOf<T>>)>,
    mut commands: Commands,
) {
    for (from, value, acts) in &sources {
        for &other in acts.others() {
            let Ok((own, copy)) = others.get(other) else { continue };
            let is_known = copy.is_some_and(|copy| copy.from == from);
            if is_known && !value.is_changed() {
                continue;
            }
            let mut other = commands.entity(other);
            other.try_insert(T::clone(&value));
            if !is_known {
                let before = copy.map_or(own, |copy| copy.before.as_ref()).cloned();
                other.try_insert(CopyOf { from, before });
            }
        }
    }
    let acts = removed.read().filter_map(|from| without.get(from).ok());
    for &other in acts.flat_map(S::others) {
        let Ok((_, Some(copy))) = others.get(other) else { continue };
        let mut other = commands.entity(other);
        match copy.before.clone() {
            Some(before) => other.try_insert(before),
            None => other.try_remove::<T>(),
        };
        other.try_remove::<CopyOf<T>>();
    }
}

/// Registers settings of hair: their default, the report of invalid values, and that they act from a wearer too.
pub(crate) fn setting<T: HairSetting>(app: &mut App) {
    setting::plugin::<T>(app);
    acts_from_wearer::<T>(app);
}

/// Registers a component of hair that has no default for all hair.
pub(crate) fn component<T: Passed + Ranged>(app: &mut App) {
    setting::component::<T>(app);
    acts_from_wearer::<T>(app);
}

/// The components that act from a wearer: what passes each on to hair that has just been put on.
#[derive(Resource, Default)]
pub(crate) struct PassedTypes(Vec<fn(&mut World, Entity, Entity)>);

#[cfg(feature = "groom")]
impl PassedTypes {
    /// Copies what is on a wearer to its new hair at once, not in the next frame.
    pub(crate) fn pass(world: &mut World, wearer: Entity, hair: Entity) {
        let all = world.get_resource::<Self>().map(|all| all.0.clone());
        all.into_iter().flatten().for_each(|pass| pass(world, wearer, hair));
    }
}

fn pass_now<T: Passed>(world: &mut World, from: Entity, to: Entity) {
    let Some(value) = world.get::<T>(from).cloned() else { return };
    let Ok(mut to) = world.get_entity_mut(to) else { return };
    let before = to.get::<T>().cloned();
    to.insert((value, CopyOf { from, before }));
}

fn acts_from_wearer<T: Passed>(app: &mut App) {
    passed::<T>(app);
    acts_only_on::<T, Stray>(app, "no Hair and wears none", "put it on either");
}

/// Has it reported where a component is on an entity on which it does nothing: which entities are `strays`, and in
/// words, what they are not and what to do.
pub(crate) fn acts_only_on<T: Component, Strays: QueryFilter + 'static>(
    app: &mut App,
    not: &'static str,
    instead: &'static str,
) {
    app.add_systems(HairChecks, (move || (not, instead)).pipe(report_stray::<T, Strays>));
}

/// Registers a component that is passed on to hair, and may be on anything.
pub(crate) fn passed<T: Passed>(app: &mut App) {
    app.world_mut().get_resource_or_init::<PassedTypes>().0.push(pass_now::<T>);
    app.register_type::<CopyOf<T>>()
        .add_systems(HairFrame, pass_on::<T, WornHair>.in_set(PassedOn));
}

/// What neither is hair nor wears any, nor is to.
type Stray = (Without<Hair>, Without<WornHair>, Without<Wearer>);

/// How long a component may wait for its entity to become hair or a wearer before it is told that it does nothing (s).
const STRAY_TIME: f32 = 2.0;

/// Says what does nothing where it is.
fn report_stray<T: Component, Strays: QueryFilter + 'static>(
    In((not, instead)): In<(&'static str, &'static str)>,
    added: Query<Entity, (Added<T>, Strays)>,
    strays: Query<(), (With<T>, Strays)>,
    (hairs, time): (HairsOf, Option<Res<Time<Real>>>),
    mut waiting: Local<Vec<(Entity, f32)>>,
    mut faults: MessageWriter<HairFault>,
) {
    let step = time.map_or(0.0, |time| time.delta_secs());
    waiting.iter_mut().for_each(|(_, seconds)| *seconds += step);
    for (entity, _) in waiting.extract_if(.., |(_, seconds)| *seconds > STRAY_TIME) {
        if !strays.contains(entity) {
            continue;
        }
        let (part, near) = (ShortName::of::<T>(), hairs.near(entity));
        let message =
            format!("`{part}` does nothing here, on an entity that is {not}{near}: {instead}");
        faults.write(HairFault::new(FaultKind::NoTarget, message).of(entity));
    }
    waiting.extend(added.iter().map(|entity| (entity, 0.0)));
}

/// Finds the hair that a request is about.
#[derive(SystemParam)]
pub(crate) struct HairsOf<'w, 's> {
    hairs: Query<'w, 's, (), With<Hair>>,
    worn: Query<'w, 's, &'static WornHair, Without<Hair>>,
    parents: Query<'w, 's, &'static ChildOf>,
    children: Query<'w, 's, &'static Children>,
}

impl HairsOf<'_, '_> {
    /// The hairs that an entity wears; itself where it wears none.
    pub(crate) fn of<'a>(&'a self, entity: &'a Entity) -> &'a [Entity] {
        match self.worn.get(*entity) {
            Ok(WornHair(hairs)) if !hairs.is_empty() => hairs,
            _ => core::slice::from_ref(entity),
        }
    }

    /// What says that a request names nothing that it could act on.
    pub(crate) fn no_target(&self, request: &str, target: Entity) -> HairFault {
        let near = self.near(target);
        let message =
            format!("the target of {request} is no Hair or strand and wears no hair{near}");
        HairFault::new(FaultKind::NoTarget, message).of(target)
    }

    /// Where hair is above or below an entity that has none, in words that go on from a sentence; empty where there
    /// is none.
    pub(crate) fn near(&self, entity: Entity) -> String {
        if let Some(itself) = self.described(entity) {
            return format!("; {itself}");
        }
        let parent = |of: &Entity| self.parents.get(*of).ok().map(ChildOf::parent);
        let above =
            core::iter::successors(parent(&entity), parent).find_map(|at| self.described(at));
        if let Some(found) = above {
            return format!("; {found}, above it");
        }
        let mut todo = VecDeque::from([entity]);
        while let Some(at) = todo.pop_front() {
            if let Some(found) = self.described(at) {
                return format!("; {found}, below it");
            }
            todo.extend(self.children.get(at).into_iter().flatten());
        }
        String::new()
    }

    fn described(&self, at: Entity) -> Option<String> {
        if self.hairs.contains(at) {
            return Some(format!("{at} is a Hair"));
        }
        let hairs = &self.worn.get(at).ok()?.0;
        (!hairs.is_empty()).then(|| format!("{at} wears {}", listed(hairs)))
    }
}

/// Entities, in words.
pub(crate) fn listed(entities: &[Entity]) -> String {
    entities.iter().map(Entity::to_string).collect::<Vec<_>>().join(" and ")
}

/// Reports a request for an entity that is no hair and wears none.
pub(crate) fn report_no_hair(world: &mut World, request: &str, entity: Entity) {
    let mut state = SystemState::<HairsOf>::new(world);
    if let Ok(fault) = state.get(world).map(|hairs| hairs.no_target(request, entity)) {
        world.write_message(fault);
    }
}

/// The hairs that an entity is or wears.
pub(crate) fn hairs_of(world: &World, entity: Entity) -> Vec<Entity> {
    match world.get::<Hair>(entity) {
        Some(Hair) => vec![entity],
        None => world.get::<WornHair>(entity).map_or_else(Vec::new, |worn| worn.0.clone()),
    }
}
