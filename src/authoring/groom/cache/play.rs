//! Hair that a cache moves in place of the tick.

use super::motion::GroomCache;
use crate::{
    authoring::groom::reshape::{arc_lengths, place},
    base::{
        fault::{FaultKind, HairFault},
        grid::KdTree,
        schedule::{HairFrame, HairStep, HairSystems, HairTick, last_substep},
    },
    hair::{
        strand::{
            CutStrand, Hair, PlayedHair, Regroomed, Settling, SimulatedHere, Strand, StrandHistory,
            StrandRank, Strands, TickPose,
        },
        worn,
    },
};
use bevy::{
    asset::{AssetEvent, LoadState},
    ecs::entity::EntityHashMap,
    platform::collections::HashSet,
    prelude::*,
};
use core::ops::Range;

/// Plays a [`GroomCache`] on a hair: its strands are where the cache says, in the hair's frame, in place of being simulated.
/// On the entity of the [`Hair`]; it is simulated until the asset is there, and again, with the velocities that it has by
/// then, once this is removed. Meanwhile water, drying and treatments act, which changes what its bonds remember and not how it
/// is drawn; settling and lakes wait, and it is not on the GPU; strands that follow others at a
/// [level of detail](crate::HairLod), and strands that are drawn between others, follow those that are played.
/// [`MotionOwner::Played`](crate::MotionOwner::Played) says that it is on.
///
/// A hair of as many strands as the cache, with as many nodes each, plays node by node; of a recorded hair that is the order
/// of its strands. Else each strand plays the one of the cache whose root was nearest in the first frame, its nodes as far along
/// it as its lengths say: as guides of [`GroomedHair`](crate::authoring::groom::GroomedHair) grow on that groom. A strand that
/// has been cut plays as much of it as is left. Lengths are not restored: what a file stretches stays stretched until the hair is
/// simulated again.
///
/// ```
/// # use bevy_keratin::{prelude::*, authoring::groom::*}; use bevy::prelude::*;
/// fn dance(hair: Query<Entity, With<Hair>>, assets: Res<AssetServer>, mut commands: Commands) {
///     for hair in &hair {
///         let cache = assets.load::<GroomCache>("dance.abc");
///         commands.entity(hair).insert(PlayGroomCache { repeat: true, ..PlayGroomCache::new(cache) });
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct PlayGroomCache {
    /// What is played.
    pub cache: Handle<GroomCache>,
    /// Where in it, from its first frame (s): 0. Ticks advance it up to the last frame; writing it jumps.
    pub time: f32,
    /// How many seconds of it in a second of the game: 1. Negative plays backwards, 0 stands still.
    pub speed: f32,
    /// Whether it begins again at the other end: false, so it stays there.
    pub repeat: bool,
}

impl Default for PlayGroomCache {
    fn default() -> Self {
        Self { cache: default(), time: 0.0, speed: 1.0, repeat: false }
    }
}

impl PlayGroomCache {
    /// From the first frame on, once.
    pub fn new(cache: Handle<GroomCache>) -> Self {
        Self { cache, ..default() }
    }

    /// The time so many seconds later, that from which hair has moved there, and whether it begins again in between.
    fn after(&self, seconds: f32, duration: f32) -> Advance {
        let [time, speed] = [self.time, self.speed].map(|n| if n.is_finite() { n } else { 0.0 });
        let next = time + speed * seconds;
        if (0.0..=duration).contains(&next) || !self.repeat || duration <= 0.0 {
            return Advance { from: time, to: next.clamp(0.0, duration), wraps: false };
        }
        let to = next.rem_euclid(duration);
        Advance { from: to - speed * seconds, to, wraps: true }
    }
}

/// A tick's way through a cache.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Advance {
    from: f32,
    to: f32,
    wraps: bool,
}

/// What a hair plays.
#[derive(Component, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
struct Playback {
    cache: AssetId<GroomCache>,
    /// Which strand of the cache each strand plays.
    strands: Vec<(Entity, u32)>,
    /// Where the tick before has left it (s).
    time: Option<f32>,
    /// What was reported not to be there.
    failed: Option<AssetId<GroomCache>>,
}

pub(super) fn build(app: &mut App) {
    app.register_type::<PlayGroomCache>().add_observer(stop);
    worn::acts_only_on::<PlayGroomCache, Without<Hair>>(app, "no Hair", "put it on a hair");
}

pub(super) fn with_assets(app: &mut App) {
    app.add_systems(HairFrame, begin).add_systems(
        HairTick,
        play.in_set(HairSystems::Projection).before(HairSystems::Rods).run_if(last_substep),
    );
}

fn stop(left: On<Remove, PlayGroomCache>, mut commands: Commands) {
    commands.entity(left.entity).try_remove::<(Playback, PlayedHair)>();
}

/// Finds the strands of the cache that hair plays.
fn begin(
    mut commands: Commands,
    (caches, assets): (Res<Assets<GroomCache>>, Res<AssetServer>),
    mut events: MessageReader<AssetEvent<GroomCache>>,
    mut hairs: Query<
        (Entity, Ref<PlayGroomCache>, Option<&mut Playback>, Ref<Regroomed>, Option<Ref<Strands>>),
        With<Hair>,
    >,
    strands: Query<(&Strand, &StrandRank)>,
    mut faults: MessageWriter<HairFault>,
) {
    let changed: HashSet<_> = events
        .read()
        .filter_map(|event| match event {
            AssetEvent::Modified { id } | AssetEvent::Added { id } => Some(*id),
            _ => None,
        })
        .collect();
    for (hair, wanted, playback, regroomed, members) in &mut hairs {
        let Some(mut playback) = playback else {
            commands.entity(hair).try_insert(Playback::default());
            continue;
        };
        let id = wanted.cache.id();
        let is_new = wanted.is_changed() || playback.is_added();
        if is_new && ![wanted.time, wanted.speed].iter().all(|n| n.is_finite()) {
            let message = format!(
                "PlayGroomCache has time {} s and speed {}, expected finite numbers: 0 is taken",
                wanted.time, wanted.speed
            );
            faults.write(HairFault::new(FaultKind::Setting, message).of(hair));
        }
        let Some(cache) = caches.get(id) else {
            // Not there yet, or no more.
            if !playback.strands.is_empty() {
                playback.strands.clear();
                commands.entity(hair).try_remove::<PlayedHair>();
            }
            let is_known = playback.failed == Some(id);
            if let (LoadState::Failed(error), false) = (assets.load_state(id), is_known) {
                let error = error.to_string();
                let error = error.lines().next().unwrap_or_default().to_owned();
                let message = format!("the hair's cache was not loaded: {error}; it is simulated");
                faults.write(HairFault::new(FaultKind::Groom, message).of(hair));
                *playback = Playback { failed: Some(id), ..default() };
                commands.entity(hair).try_remove::<PlayedHair>();
            }
            continue;
        };
        let are_others = members.as_ref().is_some_and(|members| members.is_changed());
        let is_same = playback.cache == id && !changed.contains(&id);
        let is_matched = is_same && !playback.strands.is_empty();
        if is_matched && !are_others && !regroomed.is_changed() {
            continue;
        }
        // Those that play go on with the same strand: their roots may have moved.
        let known: EntityHashMap<u32> = match is_same {
            true => playback.strands.drain(..).collect(),
            false => default(),
        };
        let members = members.iter().flat_map(|members| members.iter());
        let mut own: Vec<_> = members
            .filter_map(|entity| Some((entity, strands.get(entity).ok()?)))
            .filter(|(_, (strand, _))| strand.nodes() >= 2)
            .collect();
        own.sort_by_key(|(entity, (_, rank))| (**rank, *entity));
        let own: Vec<(Entity, &Strand)> =
            own.into_iter().map(|(entity, (strand, _))| (entity, strand)).collect();
        playback.strands = matched(cache, &own, &known);
        (playback.cache, playback.failed) = (id, None);
        match playback.strands.is_empty() {
            false => commands.entity(hair).try_insert(PlayedHair).try_remove::<Settling>(),
            true => commands.entity(hair).try_remove::<PlayedHair>(),
        };
    }
}

/// Which strand of a cache each of these plays.
fn matched(
    cache: &GroomCache,
    own: &[(Entity, &Strand)],
    known: &EntityHashMap<u32>,
) -> Vec<(Entity, u32)> {
    let strands = || cache.groom().strands();
    let is_same = own.len() == strands().len()
        && own.iter().zip(strands()).all(|((_, own), of)| own.nodes() == of.points.len());
    let root = |i: usize| Some(cache.frame(0)[nodes_of(cache, i)?.start]);
    let roots = KdTree::new((0..strands().len()).filter_map(root).zip(0..));
    if is_same {
        // Guides of a groom are as many, but in an order of their own. Roots on a skin may have moved all together.
        let squares = own.iter().enumerate().filter_map(|(i, (_, strand))| {
            let at = *strand.positions().first()?;
            let nearest = roots.nearest::<1>(at).next()?.1;
            Some((root(i)?.distance_squared(at), nearest))
        });
        let (own_order, nearest) = squares.fold((0.0, 0.0), |(a, b), (x, y)| (a + x, b + y));
        if own_order <= 4.0 * nearest + 1e-6 * own.len() as f32 {
            return own.iter().map(|(entity, _)| *entity).zip(0..).collect();
        }
    }
    let nearest = |(entity, strand): &(Entity, &Strand)| {
        if let Some(of) = known.get(entity) {
            return Some((*entity, *of));
        }
        let root = strand.positions().first()?;
        let (of, _) = roots.nearest::<1>(*root).next()?;
        Some((*entity, of))
    };
    own.iter().filter_map(nearest).collect()
}

/// Where the nodes of a strand are among those of a frame.
fn nodes_of(cache: &GroomCache, strand: usize) -> Option<Range<usize>> {
    (strand < cache.groom().len()).then(|| cache.groom().nodes_of(strand))
}

fn play(
    step: Res<HairStep>,
    caches: Res<Assets<GroomCache>>,
    mut hairs: Query<(&mut PlayGroomCache, &mut Playback, &TickPose), With<PlayedHair>>,
    mut strands: Query<(&mut Strand, &mut StrandHistory, Option<&CutStrand>), SimulatedHere>,
    mut scratch: Local<[Vec<Vec3>; 2]>,
) {
    let seconds = step.dt * step.count as f32;
    for (mut wanted, mut playback, pose) in &mut hairs {
        let Some(cache) = caches.get(playback.cache) else { continue };
        let was_put = playback.time.is_none_or(|time| time != wanted.time);
        let Advance { from, to, wraps } = wanted.after(seconds, cache.duration());
        let [now, before] = &mut *scratch;
        cache.at(to, now);
        cache.at(from, before);
        wanted.bypass_change_detection().time = to;
        playback.time = Some(to);
        for (entity, of) in &playback.strands {
            let (Ok((mut strand, mut history, cut)), Some(nodes)) =
                (strands.get_mut(*entity), nodes_of(cache, *of as usize))
            else {
                continue;
            };
            let strand = strand.bypass_change_detection();
            let along = Along::of(&now[nodes.clone()], strand, cut);
            let [now, before] = [&now[nodes.clone()], &before[nodes]];
            strand.put_nodes(|node| {
                let [now, before] = [now, before].map(|points| along.at(points, node));
                (now, (now - before) / seconds + pose.motion_at(now))
            });
            if was_put || wraps {
                history.bypass_change_detection().remember(strand);
            }
        }
    }
}

/// Where the nodes of a strand are along a polyline, as shares of its segments: so they are in any other pose of it.
struct Along(Vec<(usize, f32)>);

impl Along {
    /// Node by node where a whole strand has as many as the polyline, else as far along as the strand's own lengths say.
    fn of(points: &[Vec3], strand: &Strand, cut: Option<&CutStrand>) -> Self {
        let cut = cut.filter(|cut| cut.fits(strand.nodes()));
        if points.len() == strand.nodes() && cut.is_none() {
            return Self(Vec::new());
        }
        let own = strand.length();
        let whole = cut.map_or(own, |cut| cut.whole_length().max(own));
        let mut along = Vec::new();
        let scale = arc_lengths(points, &mut along) / f64::from(whole);
        let mut at = 0.0;
        let ends = strand.rest_lengths().iter().map(|length| {
            at += f64::from(*length);
            at
        });
        Self([0.0].into_iter().chain(ends).map(|at| place(&along, at * scale)).collect())
    }

    fn at(&self, points: &[Vec3], node: usize) -> Vec3 {
        match self.0.get(node) {
            Some((segment, share)) => points[*segment].lerp(points[segment + 1], *share),
            None => points[node],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_ends_at_the_last_frame_or_begins_again() {
        let play = |time, speed, repeat| PlayGroomCache { time, speed, repeat, ..default() };
        let after = |play: PlayGroomCache, seconds, duration| {
            let Advance { from, to, wraps } = play.after(seconds, duration);
            (from, to, wraps)
        };
        assert_eq!(after(play(0.5, 1.0, false), 0.25, 2.0), (0.5, 0.75, false));
        assert_eq!(after(play(1.875, 1.0, false), 0.25, 2.0), (1.875, 2.0, false));
        // At the end it stands still.
        assert_eq!(after(play(2.0, 1.0, false), 0.25, 2.0), (2.0, 2.0, false));
        assert_eq!(after(play(1.75, 1.0, true), 0.5, 2.0), (-0.25, 0.25, true));
        assert_eq!(after(play(0.25, -1.0, true), 0.5, 2.0), (2.25, 1.75, true));
        assert_eq!(after(play(0.25, -1.0, false), 0.5, 2.0), (0.25, 0.0, false));
        assert_eq!(after(play(f32::NAN, f32::INFINITY, true), 0.5, 2.0), (0.0, 0.0, false));
        assert_eq!(after(play(1.0, 1.0, true), 0.5, 0.0), (1.0, 0.0, false));
    }
}
