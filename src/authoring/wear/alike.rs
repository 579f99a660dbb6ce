//! Hair that is made: once for all wearers that are to get the same.

use super::{
    error::WearError,
    fall::Fall,
    make::{HairInput, Made, MakeInput, Source, make},
    part::{Cue, MeshPart},
    target::{OwnSolid, Target},
    what::{HairSource, WearHair},
};
use crate::{forces::contact::HairCollider, simulation::settle::SettleConditions};
use bevy::{
    ecs::entity::EntityHashMap,
    math::{Affine3A, Mat3A, Vec3A},
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, block_on, futures::check_ready},
};
use core::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// How far apart two places are at most that are the same (m), and how different two sizes, as a logarithm.
const SAME_PLACE: f32 = 1e-4;
const SAME_SIZE: f32 = 0.1;

/// What hair hangs on, to find out who gets the same.
struct Likeness {
    wear: WearHair,
    hairs: Vec<HairInput>,
    before: Vec<Arc<Fall>>,
    conditions: SettleConditions,
    shades: bool,
    down: Vec3,
    size: f32,
    /// The entities of the target, in its order, each with whether colliders of the character's own are below it or
    /// on it.
    entities: Vec<(Entity, [bool; 2])>,
    parts: Vec<PartLikeness>,
    own: Vec<(HairCollider, Option<Entity>, Affine3A)>,
}

struct PartLikeness {
    name: String,
    facts: [bool; 3],
    mesh: AssetId<Mesh>,
    skin: Option<(Option<usize>, Vec<bool>, Vec<Cue>, Vec<Affine3A>)>,
    turn: Mat3A,
    at: Vec3A,
}

impl PartLikeness {
    fn of(part: &MeshPart, is_garment: bool) -> Self {
        let skin = part.skin.as_ref();
        Self {
            name: part.name.clone(),
            facts: [part.is_shown, part.is_named, is_garment],
            mesh: part.mesh_id,
            skin: skin.map(|s| (s.head, s.of_head.clone(), s.cues.clone(), s.poses.clone())),
            turn: part.to_wearer.matrix3,
            at: part.to_wearer.translation,
        }
    }

    /// Whether they are the same, the second moved by `by`.
    fn is_like(&self, other: &Self, by: Vec3A) -> bool {
        self.facts == other.facts
            && self.mesh == other.mesh
            && self.turn.abs_diff_eq(other.turn, SAME_PLACE)
            && self.at.abs_diff_eq(other.at + by, SAME_PLACE)
            && self.name == other.name
            && self.skin == other.skin
    }
}

impl Likeness {
    fn of(input: &MakeInput) -> Self {
        let Target { head, parts, garments, hats, own, size, .. } = &input.target;
        let all = || parts.iter().chain(garments).chain(hats);
        let joints = |part: &MeshPart| part.skin.iter().flat_map(|s| s.joints.clone()).collect();
        let of_parts = all().flat_map(|part| {
            let joints: Vec<Entity> = joints(part);
            core::iter::once(part.entity).chain(joints)
        });
        let entities = core::iter::once(*head).chain(of_parts);
        let marked = |at: Entity| (at, [own.above.contains(&at), own.joints.contains(&at)]);
        let kinds = parts.iter().map(|part| (part, false));
        let kinds = kinds.chain(garments.iter().chain(hats).map(|part| (part, true)));
        let solid = |s: &OwnSolid| (s.collider.clone(), s.joint, s.place);
        Self {
            wear: input.wear.bare(),
            hairs: input.hairs.clone(),
            before: input.before.clone(),
            conditions: input.conditions.clone(),
            shades: input.shades,
            down: input.down(),
            size: *size,
            entities: entities.map(marked).collect(),
            parts: kinds.map(|(part, is_garment)| PartLikeness::of(part, is_garment)).collect(),
            own: own.solids.iter().map(solid).collect(),
        }
    }

    /// The entities of another target for those of this one, where it gets the same hair.
    fn map_to(&self, other: &Self) -> Option<EntityHashMap<Entity>> {
        let is_same_size = (self.size / other.size).ln().abs() < SAME_SIZE;
        let is_same = |a: &Source, b: &Source| match (a, b) {
            (Source::Groom(a, _), Source::Groom(b, _)) => {
                a.points().as_ptr() == b.points().as_ptr()
            }
            (Source::Recipe(a), Source::Recipe(b)) => a == b,
            _ => false,
        };
        let are_same = |(a, b): (&HairInput, &HairInput)| {
            a.is_kept == b.is_kept && is_same(&a.source, &b.source)
        };
        let before = |of: &Self| of.before.iter().map(Arc::as_ptr).collect::<Vec<_>>();
        let counts = |of: &Self| [of.entities.len(), of.parts.len(), of.own.len()];
        // An animation has moved the character within its own space.
        let is_free = self.wear.scalp.is_none()
            && self.wear.sources().all(|hair| !matches!(hair, HairSource::Groom { .. }));
        let at = |of: &Self| of.parts.first().map_or(default(), |part| part.at);
        let by = if is_free { at(self) - at(other) } else { default() };
        let is_like = is_same_size
            && counts(self) == counts(other)
            && self.down == other.down
            && self.shades == other.shades
            && before(self) == before(other)
            && self.hairs.len() == other.hairs.len()
            && self.hairs.iter().zip(&other.hairs).all(are_same)
            && self.wear == other.wear
            && self.conditions == other.conditions
            && self.parts.iter().zip(&other.parts).all(|(a, b)| a.is_like(b, by));
        if !is_like {
            return None;
        }
        let (mut there, mut back) = (EntityHashMap::default(), EntityHashMap::default());
        for ((a, marks), (b, others)) in self.entities.iter().zip(&other.entities) {
            let is_same =
                *there.entry(*a).or_insert(*b) == *b && *back.entry(*b).or_insert(*a) == *a;
            if !is_same || marks != others {
                return None;
            }
        }
        let joint = |joint: Option<Entity>| joint.map(|joint| there.get(&joint).copied());
        let is_own = self.own.iter().zip(&other.own).all(|((collider, on, at), other)| {
            *collider == other.0
                && joint(*on) == other.1.map(Some)
                && at.abs_diff_eq(other.2, SAME_PLACE)
        });
        is_own.then_some(there)
    }
}

/// Hair that is being made. Nobody's any more, it ends.
pub(super) struct Making {
    likeness: Likeness,
    is_unwanted: Arc<AtomicBool>,
    state: Mutex<State>,
}

type Result = core::result::Result<Made, WearError>;

enum State {
    Running(Task<Result>),
    Ready(Arc<Result>),
}

impl Drop for Making {
    fn drop(&mut self) {
        self.is_unwanted.store(true, Ordering::Relaxed);
    }
}

impl Making {
    /// On the async compute pool, or at once in an app without pools.
    fn begin(input: MakeInput, likeness: Likeness) -> Self {
        let is_unwanted = Arc::new(AtomicBool::new(false));
        // A single thread cannot wait for itself.
        let waits_alone = cfg!(target_family = "wasm") && input.wear.at.is_some();
        let state =
            match AsyncComputeTaskPool::try_get().filter(|_| !waits_alone) {
                Some(pool) => {
                    let is_unwanted = is_unwanted.clone();
                    State::Running(pool.spawn(async move {
                        make(input, &|| !is_unwanted.load(Ordering::Relaxed))
                    }))
                }
                None => State::Ready(Arc::new(make(input, &|| true))),
            };
        Self { likeness, is_unwanted, state: Mutex::new(state) }
    }

    fn ready(&self, waits: bool) -> Option<Arc<Result>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let State::Running(task) = &mut *state {
            let made = if waits { Some(block_on(task)) } else { check_ready(task) };
            *state = State::Ready(Arc::new(made?));
        }
        match &*state {
            State::Ready(made) => Some(made.clone()),
            State::Running(_) => None,
        }
    }
}

/// A wearer's part in it: with what stands for the entities of the wearer that it is made for.
pub(super) struct Share {
    making: Arc<Making>,
    entities: Option<EntityHashMap<Entity>>,
}

impl Share {
    /// Whether it is made; if not, it is waited for.
    pub(super) fn is_ready(&self, waits: bool) -> bool {
        self.making.ready(waits).is_some()
    }

    /// What was made, for this wearer.
    pub(super) fn take(self) -> Option<Result> {
        let made = self.making.ready(false)?;
        // The last one copies nothing.
        drop(self.making);
        let mut made = Arc::try_unwrap(made).unwrap_or_else(|shared| Result::clone(&shared));
        if let (Ok(made), Some(entities)) = (&mut made, &self.entities) {
            made.give_to(entities);
        }
        Some(made)
    }
}

/// All hair that is being made.
#[derive(Resource, Default)]
pub(super) struct Makings(Vec<Weak<Making>>);

impl Makings {
    /// A share in the hair that this makes.
    pub(super) fn share(&mut self, input: MakeInput) -> Share {
        self.0.retain(|making| making.strong_count() > 0);
        let likeness = Likeness::of(&input);
        let shared = self.0.iter().find_map(|making| {
            let making = making.upgrade()?;
            let entities = Some(making.likeness.map_to(&likeness)?);
            Some(Share { making, entities })
        });
        shared.unwrap_or_else(|| {
            let making = Arc::new(Making::begin(input, likeness));
            self.0.push(Arc::downgrade(&making));
            Share { making, entities: None }
        })
    }
}
