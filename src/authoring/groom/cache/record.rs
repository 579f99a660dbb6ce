//! Recording hair, tick by tick.

use super::{error::GroomCacheError, motion::GroomCache};
use crate::{
    authoring::groom::{Groom, GroomError},
    base::{
        fault::{FaultKind, HairFault},
        schedule::{HairStep, HairSystems, HairTick, last_substep},
    },
    hair::{
        strand::{Hair, OnGpu, RecordedHair, Strand, StrandRank, Strands},
        worn,
    },
};
use bevy::prelude::*;

/// Records the strands of a hair from the next tick on; [`GroomCache::of_recording`] ends it and gives what was recorded. On
/// the entity of the [`Hair`], which is not on the GPU meanwhile.
///
/// ```
/// # use bevy_keratin::{prelude::*, authoring::groom::*}; use bevy::prelude::*;
/// fn begin(hair: Query<Entity, With<Hair>>, mut commands: Commands) {
///     hair.iter().for_each(|hair| _ = commands.entity(hair).insert(RecordGroomCache::default()));
/// }
///
/// fn save(world: &mut World, hair: Entity) -> Result {
///     let cache = GroomCache::of_recording(world, hair)?;
///     Ok(std::fs::write("dance.abc", alembic::write_cache(&cache)?)?)
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct RecordGroomCache {
    /// Of so many ticks one becomes a frame: 1, all of them. 0 counts as 1.
    pub every: u32,
    /// How many bytes of nodes may be recorded: 1 GiB. Recording then ends, which is reported.
    pub most_bytes: usize,
}

impl Default for RecordGroomCache {
    fn default() -> Self {
        Self { every: 1, most_bytes: 1 << 30 }
    }
}

/// What has been recorded of a hair.
#[derive(Component, Default)]
#[component(clone_behavior = Ignore)]
struct Recording {
    strands: Vec<Entity>,
    ends: Vec<u32>,
    /// Of each frame the tick, and its nodes.
    frames: Vec<(f64, Vec<Vec3>)>,
    seconds: f64,
    ticks: u32,
    /// Whether no more is recorded.
    has_ended: bool,
}

pub(super) fn build(app: &mut App) {
    worn::acts_only_on::<RecordGroomCache, Without<Hair>>(app, "no Hair", "put it on a hair");
    app.register_type::<RecordGroomCache>()
        .add_observer(begin)
        .add_observer(end)
        .add_systems(HairTick, record.in_set(HairSystems::BondUpdate).run_if(last_substep));
}

fn begin(asked: On<Add, RecordGroomCache>, mut commands: Commands) {
    commands.entity(asked.entity).try_insert((Recording::default(), RecordedHair));
}

fn end(left: On<Remove, RecordGroomCache>, mut commands: Commands) {
    commands.entity(left.entity).try_remove::<(Recording, RecordedHair)>();
}

fn record(
    step: Res<HairStep>,
    mut hairs: Query<
        (Entity, &RecordGroomCache, &mut Recording, &Strands),
        (With<Hair>, Without<OnGpu>),
    >,
    strands: Query<(&Strand, &StrandRank)>,
    mut faults: MessageWriter<HairFault>,
) {
    let seconds = f64::from(step.dt) * f64::from(step.count);
    for (hair, asked, mut recording, members) in &mut hairs {
        let recording = &mut *recording;
        let tick = recording.ticks;
        recording.ticks += 1;
        recording.seconds += seconds;
        if recording.has_ended || !tick.is_multiple_of(asked.every.max(1)) {
            continue;
        }
        if recording.frames.is_empty() {
            recording.strands = members.iter().filter(|strand| strands.contains(*strand)).collect();
            recording.strands.sort_by_key(|strand| {
                let rank = strands.get(*strand).map(|(_, rank)| *rank).unwrap_or_default();
                (rank, *strand)
            });
        }
        let mut ends = Vec::with_capacity(recording.strands.len());
        let mut nodes = Vec::new();
        for (strand, _) in recording.strands.iter().filter_map(|strand| strands.get(*strand).ok()) {
            nodes.extend_from_slice(strand.positions());
            ends.push(nodes.len() as u32);
        }
        let held = (recording.frames.len() + 1) * size_of_val(&nodes[..]);
        let why = if recording.frames.is_empty() {
            recording.ends = ends;
            None
        } else if recording.ends != ends {
            Some("its strands have changed".to_owned())
        } else if held > asked.most_bytes {
            Some(format!("RecordGroomCache::most_bytes, {}, are full", asked.most_bytes))
        } else {
            None
        };
        match why {
            None => recording.frames.push((recording.seconds, nodes)),
            Some(why) => {
                recording.has_ended = true;
                let frames = recording.frames.len();
                let message = format!("recording has ended after {frames} frames: {why}");
                faults.write(HairFault::new(FaultKind::Groom, message).of(hair));
            }
        }
    }
}

impl GroomCache {
    /// Ends the recording of a hair and returns it: all its strands node by node, marked as guides.
    ///
    /// # Errors
    /// When the entity is not being recorded, or no tick has passed since.
    pub fn of_recording(world: &mut World, hair: Entity) -> Result<Self, GroomCacheError> {
        let mut hair = world.get_entity_mut(hair).map_err(|_| GroomCacheError::NotRecorded)?;
        let Some(recording) = hair.take::<Recording>() else {
            return Err(GroomCacheError::NotRecorded);
        };
        hair.remove::<RecordGroomCache>();
        let Some((_, first)) = recording.frames.first() else {
            return Err(GroomCacheError::Empty);
        };
        let starts = [0].into_iter().chain(recording.ends.iter().copied());
        let strands = starts.zip(&recording.ends);
        let lines = strands.map(|(from, to)| first[from as usize..*to as usize].iter().copied());
        let groom = Groom::from_polylines(lines)?;
        if groom.is_empty() {
            return Err(GroomError::Empty.into());
        }
        let guides = vec![true; groom.len()];
        Self::new(groom.with_guides(guides)?, recording.frames)
    }
}
