//! Where things are at each tick: one account of all transforms that move hair.
//!
//! Ticks and frames are not synchronous. A head that is animated from frame to frame has no pose at
//! the time of a tick, only before and after it: so the ticks of a frame run when the frame's motion is
//! known, and find each transform where it was on its way at their time. What fixed ticks themselves
//! move, for instance physics, is where each of them left it. A hierarchy may mix both.

use crate::base::tape::Tape;
use bevy::{
    ecs::{entity::EntityHashMap, system::SystemParam},
    prelude::*,
};
use core::time::Duration;

/// A fixed tick: when it is within its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TickMoment {
    /// Counts ticks from 1.
    pub(crate) number: u64,
    /// The frame that it belongs to; counts from 1.
    pub(crate) frame: u64,
    /// Which of the frame's ticks it is.
    pub(crate) index: usize,
    /// The shares of the frame's motion at which it begins and ends.
    pub(crate) shares: [f32; 2],
    /// How long it is (s).
    pub(crate) seconds: f32,
    /// From its end to the end of the frame's motion (s).
    pub(crate) rest: f32,
    /// Whether it begins when the tick before ended: not after a pause or discarded ticks.
    pub(crate) continues: bool,
}

impl Default for TickMoment {
    fn default() -> Self {
        Self {
            number: 0,
            frame: 0,
            index: 0,
            shares: [0.0, 1.0],
            seconds: 0.0,
            rest: 0.0,
            continues: true,
        }
    }
}

/// The transform of an entity in a frame and its ticks.
#[derive(Clone, Debug)]
struct Track {
    parent: Option<Entity>,
    /// At the end of the last frame, and of this one.
    frames: [Transform; 2],
    /// The motion of the last frame in which time passed, jumps left out, and how long that was (s).
    way: ([Transform; 2], f32),
    /// In each tick of the frame.
    ticks: Vec<Transform>,
    /// In the two ticks before those.
    last_ticks: [Transform; 2],
    /// Where the tick with this index began that has jumped.
    begins: Option<(usize, Transform)>,
    /// The last frame in which it jumped.
    jumped: u64,
    /// When it was last looked at.
    seen: Transform,
    /// Whether a tick, or something else in the frame, has changed it since the last frame.
    changed: [bool; 2],
    /// Whether it is moved by ticks.
    by_ticks: bool,
    /// Whether it moved while time stood still.
    was_put: bool,
    /// The last tick that asked for it.
    used: u64,
    /// Where that was in the world.
    place: Option<GlobalTransform>,
}

impl Track {
    fn new(at: Transform, parent: Option<Entity>) -> Self {
        Self {
            parent,
            frames: [at; 2],
            way: ([at; 2], 0.0),
            ticks: Vec::new(),
            last_ticks: [at; 2],
            begins: None,
            jumped: 0,
            seen: at,
            changed: [false; 2],
            by_ticks: false,
            was_put: false,
            used: 0,
            place: None,
        }
    }

    fn see(&mut self, now: Transform, in_tick: bool) {
        self.changed[usize::from(!in_tick)] |= now != self.seen;
        self.seen = now;
    }

    /// At the end of a tick, or at its beginning.
    fn at(&self, tick: &TickMoment, ends: bool) -> Transform {
        if !self.by_ticks {
            return between(&self.frames, tick.shares[usize::from(ends)]);
        }
        match self.begins {
            _ if ends => self.in_tick(tick.index),
            Some((index, at)) if index == tick.index => at,
            _ => self.before_tick(tick.index),
        }
    }

    fn in_tick(&self, index: usize) -> Transform {
        self.ticks.get(index).copied().unwrap_or(self.seen)
    }

    fn before_tick(&self, index: usize) -> Transform {
        index.checked_sub(1).map_or(self.last_ticks[1], |before| self.in_tick(before))
    }

    /// Its motion before a tick, jumps left out.
    fn motion_before_tick(&self, index: usize) -> [Transform; 2] {
        let Some(before) = index.checked_sub(1) else { return self.last_ticks };
        let begins = self.begins.filter(|(jumped, _)| *jumped == before);
        [begins.map_or_else(|| self.before_tick(before), |(_, at)| at), self.in_tick(before)]
    }

    /// From the next tick on, of this `index` in the frame, it goes on from this motion.
    fn go_on_from(&mut self, index: usize, motion: [Transform; 2]) {
        self.begins = None;
        self.ticks.resize(index, motion[1]);
        match index {
            0 => self.last_ticks = motion,
            1 => (self.last_ticks[1], self.ticks[0]) = (motion[0], motion[1]),
            _ => (self.ticks[index - 2], self.ticks[index - 1]) = (motion[0], motion[1]),
        }
    }

    /// Where it was before the motion of this frame or tick, if it has moved in it as it did before.
    fn carried_back(&self, tick: &TickMoment, frame_seconds: f32) -> Transform {
        if self.by_ticks {
            return carried_back(
                &self.in_tick(tick.index),
                &self.motion_before_tick(tick.index),
                1.0,
            );
        }
        let (way, seconds) = &self.way;
        let times = if *seconds > 0.0 { frame_seconds / seconds } else { 0.0 };
        carried_back(&self.frames[1], way, times)
    }

    /// All places that are known of it.
    fn places_mut(&mut self) -> impl Iterator<Item = (Instant, &mut Transform)> {
        let frames = self.frames.iter_mut().enumerate();
        let last_ticks = self.last_ticks.iter_mut().enumerate();
        let ticks = self.ticks.iter_mut().enumerate();
        (frames.map(|(i, at)| (Instant::Frame(i), at)))
            .chain(last_ticks.map(|(i, at)| (Instant::LastTick(i), at)))
            .chain(ticks.map(|(i, at)| (Instant::Tick(i), at)))
            .chain(self.begins.as_mut().map(|(i, at)| (Instant::Tick(*i), at)))
            .chain(self.way.0.iter_mut().enumerate().map(|(i, at)| (Instant::Way(i), at)))
    }

    fn at_instant(&self, instant: Instant) -> Transform {
        match instant {
            Instant::Way(i) => self.way.0[i],
            Instant::Frame(i) => self.frames[i],
            Instant::LastTick(i) => self.last_ticks[i],
            Instant::Tick(i) => self.in_tick(i),
        }
    }
}

/// When a transform is known.
#[derive(Clone, Copy)]
enum Instant {
    Way(usize),
    Frame(usize),
    LastTick(usize),
    Tick(usize),
}

/// Where something was that has come to `to` by so many `times` this motion along its own axes.
fn carried_back(to: &Transform, [from, then]: &[Transform; 2], times: f32) -> Transform {
    let turn = (then.rotation * from.rotation.inverse()).normalize();
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let own = to.rotation * then.rotation.inverse();
    let spin = own * turn.to_scaled_axis() * times;
    Transform {
        translation: to.translation - own * (then.translation - from.translation) * times,
        rotation: (Quat::from_scaled_axis(-spin) * to.rotation).normalize(),
        scale: to.scale,
    }
}

/// How far two places of an entity are apart: metres, with turns as at 10 cm.
fn apart(a: &Transform, b: &Transform) -> f32 {
    let is_mirrored = a.scale.signum() != b.scale.signum();
    let turned = 0.1 * a.rotation.angle_between(b.rotation);
    if is_mirrored { f32::INFINITY } else { a.translation.distance(b.translation) + turned }
}

/// Up to this factor a scale that changes from frame to frame is on its way; beyond, it is set.
const GROWS: f32 = 2.0;

/// On the way between two transforms, or before the first.
fn between([from, to]: &[Transform; 2], t: f32) -> Transform {
    // At rest it stays the same to the last bit.
    if t >= 1.0 || from == to {
        return *to;
    }
    Transform {
        translation: from.translation.lerp(to.translation, t),
        rotation: from.rotation.slerp(to.rotation, t).normalize(),
        // A scale that is carried on could change its sign.
        scale: from.scale.lerp(to.scale, t.max(0.0)),
    }
}

/// The account of transforms, and of the ticks that a frame has still to run.
#[derive(Resource, Default, Debug)]
pub(crate) struct WorldMotion {
    tracks: EntityHashMap<Track>,
    /// Scratch space of snapshots.
    known: Vec<Entity>,
    /// The tick that runs.
    pub(crate) tick: TickMoment,
    /// How many frames were closed.
    frames: u64,
    /// Ticks noted in the present frame.
    noted: usize,
    /// When the last tick ended, on the clock of frames.
    ended: Option<Duration>,
    /// How long the frame was that has not been closed.
    delta: Duration,
    /// How long the frame was that was closed last (s).
    seconds: f32,
}

impl WorldMotion {
    /// Shifts the world.
    pub(crate) fn shift(&mut self, by: Vec3) {
        for track in self.tracks.values_mut().filter(|track| track.parent.is_none()) {
            track.seen.translation += by;
            track.places_mut().for_each(|(_, at)| at.translation += by);
        }
    }

    /// Where an entity was.
    fn place_at(
        &self,
        present: &Placed<'_, '_>,
        entity: Option<Entity>,
        instant: Instant,
    ) -> GlobalTransform {
        let Some(entity) = entity else { return GlobalTransform::IDENTITY };
        let (local, parent) = match (self.tracks.get(&entity), present.get(entity)) {
            (Some(track), _) => (track.at_instant(instant), track.parent),
            (None, Ok((now, parent))) => (*now, parent.map(ChildOf::parent)),
            (None, Err(_)) => return GlobalTransform::IDENTITY,
        };
        self.place_at(present, parent, instant).mul_transform(local)
    }

    /// What has got another parent was where it was: that is now given in the frame of its new parent.
    fn note_parents(&mut self, present: &Placed<'_, '_>) {
        let mut adopted: Vec<(Entity, Track)> = Vec::new();
        let mut parents: Vec<(Entity, Track)> = Vec::new();
        for (entity, track) in &self.tracks {
            let Ok((now, parent)) = present.get(*entity) else { continue };
            let parent = parent.map(ChildOf::parent);
            if parent == track.parent {
                continue;
            }
            let mut own = track.clone();
            for (instant, at) in own.places_mut() {
                let place = self.place_at(present, track.parent, instant).mul_transform(*at);
                let seen = place.reparented_to(&self.place_at(present, parent, instant));
                // A parent without size has no inside.
                *at = if seen.is_finite() { seen } else { *now };
            }
            own.parent = parent;
            adopted.push((*entity, own));
            // From now on it is known how that moves.
            let mut next = parent;
            while let Some(parent) = next.filter(|parent| !self.tracks.contains_key(parent))
                && let Ok((at, above)) = present.get(parent)
            {
                next = above.map(ChildOf::parent);
                let used = self.tick.number;
                parents.push((parent, Track { used, ..Track::new(*at, next) }));
            }
        }
        self.tracks.extend(adopted);
        self.tracks.extend(parents);
    }

    /// The next tick, which ends `rest` before the `frame` that ends at `now`; without `rest`
    /// everything is where it is, in schedules that are not fixed.
    pub(crate) fn next_tick(
        &mut self,
        seconds: Duration,
        [frame, now]: [Duration; 2],
        rest: Option<Duration>,
    ) -> TickMoment {
        let share = |before: Duration| match frame.as_secs_f64() {
            frame if frame > 0.0 => (1.0 - before.as_secs_f64() / frame) as f32,
            _ => 1.0,
        };
        let mut moment =
            TickMoment { index: self.noted, seconds: seconds.as_secs_f32(), ..default() };
        if let Some(rest) = rest {
            let ends = now.saturating_sub(rest);
            let ended = self.ended.replace(ends);
            moment.continues = ended.is_none_or(|ended| ended + seconds == ends);
            moment.shares = [share(rest + seconds), share(rest)];
            moment.rest = rest.as_secs_f32();
        }
        self.noted += 1;
        moment
    }

    /// The tick that ran last, in the present frame.
    pub(crate) fn moment(&self) -> TickMoment {
        TickMoment { frame: self.frames, ..self.tick }
    }

    /// Takes down, or puts back, how things that ticks move have moved in the last one.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let index = self.noted;
        let transform = |tape: &mut Tape<'_>, at: &mut Transform| {
            tape.values([&mut at.translation, &mut at.scale]);
            tape.value(&mut at.rotation);
        };
        let mut known = core::mem::take(&mut self.known);
        known.clear();
        known.extend(self.tracks.keys());
        known.sort_unstable_by_key(|entity| entity.index_u32());
        let count = tape.count(known.len(), size_of::<u64>());
        known.resize(count, Entity::PLACEHOLDER);
        for mut entity in known.drain(..) {
            tape.entity(&mut entity);
            let track = self.tracks.get_mut(&entity);
            let mut motion =
                track.as_ref().map_or_else(default, |track| track.motion_before_tick(index));
            motion.iter_mut().for_each(|at| transform(tape, at));
            if let (Tape::Read(Some(_)), Some(track)) = (&*tape, track) {
                track.go_on_from(index, motion);
            }
        }
        self.known = known;
    }

    /// Begins a tick.
    pub(crate) fn begin(&mut self, moment: TickMoment) {
        let number = self.tick.number + 1;
        self.tick = TickMoment { number, frame: self.frames, ..moment };
    }

    /// After the ticks of a frame.
    pub(crate) fn end_ticks(&mut self) {
        if core::mem::take(&mut self.noted) == 0 {
            return;
        }
        for track in self.tracks.values_mut() {
            track.last_ticks = match track.ticks.len() {
                0 => [track.seen; 2],
                ticks => track.motion_before_tick(ticks),
            };
            track.ticks.clear();
            (track.was_put, track.begins) = (false, None);
        }
    }
}

type Placed<'w, 's> = Query<'w, 's, (&'static Transform, Option<&'static ChildOf>)>;

/// Transforms at the tick that runs.
#[derive(SystemParam)]
pub(crate) struct TickTransforms<'w, 's> {
    motion: ResMut<'w, WorldMotion>,
    present: Placed<'w, 's>,
}

impl TickTransforms<'_, '_> {
    /// The tick that runs.
    pub(crate) fn tick(&self) -> TickMoment {
        self.motion.tick
    }

    /// Where an entity is at the end of the tick; `None` where it, or what it is a child of, has no
    /// [`Transform`].
    pub(crate) fn end(&mut self, entity: Entity) -> Option<GlobalTransform> {
        let tick = self.motion.tick;
        if let Some(track) = self.motion.tracks.get(&entity)
            && track.used == tick.number
        {
            return track.place;
        }
        let (local, parent) = self.local(entity, true)?;
        let place = match parent {
            Some(parent) => self.end(parent).map(|parent| parent.mul_transform(local)),
            None => Some(local.into()),
        };
        if let Some(track) = self.motion.tracks.get_mut(&entity) {
            (track.used, track.place) = (tick.number, place);
        }
        place
    }

    /// Where it was at the beginning of the tick, carried back from its motion where that is not known.
    pub(crate) fn begin(&mut self, entity: Entity) -> Option<GlobalTransform> {
        let (end, _) = self.local(entity, true)?;
        let (local, parent) = self.local(entity, false)?;
        // What only grows has not moved.
        let local = Transform { scale: end.scale, ..local };
        match parent {
            Some(parent) => self.begin(parent).map(|parent| parent.mul_transform(local)),
            None => Some(local.into()),
        }
    }

    /// It has jumped in this tick: the motion that is not explained by that before is taken out of what it
    /// is carried by.
    pub(crate) fn jump(&mut self, entity: Entity) {
        if self.was_put(entity) {
            // That was while time stood still: since then it has moved on.
            return;
        }
        let WorldMotion { tracks, tick, frames, seconds, .. } = &mut *self.motion;
        let seconds = *seconds;
        let (mut next, mut most) = (Some(entity), None);
        while let Some(at) = next {
            let Some(track) = tracks.get(&at) else { break };
            if track.jumped == *frames && (!track.by_ticks || track.begins.is_some()) {
                // Known by another that it carries.
                return;
            }
            let (began, from) = if track.by_ticks {
                (track.before_tick(tick.index), track.carried_back(tick, seconds))
            } else {
                (track.frames[0], track.carried_back(tick, seconds))
            };
            let off = apart(&began, &from);
            if most.is_none_or(|(_, _, most)| off > most) {
                most = Some((at, from, off));
            }
            next = track.parent;
        }
        let Some((jumped, from, _)) = most else { return };
        if let Some(track) = tracks.get_mut(&jumped) {
            track.jumped = *frames;
            match track.by_ticks {
                true => track.begins = Some((tick.index, from)),
                false => track.frames[0] = from,
            }
        }
        // Places in this tick are no longer what they were.
        tracks.values_mut().for_each(|track| track.used = track.used.min(tick.number - 1));
    }

    /// Whether it was moved while time stood still before this tick.
    pub(crate) fn was_put(&self, entity: Entity) -> bool {
        let track = self.motion.tracks.get(&entity).filter(|_| self.motion.tick.index == 0);
        track.is_some_and(|track| {
            track.was_put || track.parent.is_some_and(|parent| self.was_put(parent))
        })
    }

    fn local(&mut self, entity: Entity, ends: bool) -> Option<(Transform, Option<Entity>)> {
        let (present, parent) = self.present.get(entity).ok()?;
        let parent = parent.map(ChildOf::parent);
        let WorldMotion { tracks, tick, .. } = &mut *self.motion;
        let track = tracks.entry(entity).or_insert_with(|| Track::new(*present, parent));
        if track.parent != parent {
            *track = Track::new(*present, parent);
        }
        Some((track.at(tick, ends), parent))
    }
}

/// Before the ticks of a frame: what has changed by now was changed by the frame.
pub(crate) fn see_frame(mut motion: ResMut<WorldMotion>, present: Placed<'_, '_>) {
    motion.note_parents(&present);
    for (entity, track) in &mut motion.tracks {
        if let Ok((now, _)) = present.get(*entity) {
            track.see(*now, false);
        }
    }
}

/// In a tick: where it finds what moves, `alone` or between frames that move things too.
pub(crate) fn note_tick(
    In(alone): In<bool>,
    mut motion: ResMut<WorldMotion>,
    present: Placed<'_, '_>,
) {
    motion.note_parents(&present);
    for (entity, track) in &mut motion.tracks {
        if let Ok((now, _)) = present.get(*entity) {
            track.see(*now, true);
            track.by_ticks |= alone || track.changed[0];
            track.ticks.push(*now);
        }
    }
}

/// When all has moved that moves in a frame: the present one, or the `last` one.
pub(crate) fn close_frame(
    In(last): In<bool>,
    mut motion: ResMut<WorldMotion>,
    present: Placed<'_, '_>,
    time: Option<Res<Time<Virtual>>>,
) {
    let now = time.map_or(Duration::ZERO, |time| time.delta());
    let before = core::mem::replace(&mut motion.delta, now);
    let delta = if last { before } else { now };
    let last_seconds = core::mem::replace(&mut motion.seconds, delta.as_secs_f32());
    motion.note_parents(&present);
    let WorldMotion { tracks, tick, noted, frames, .. } = &mut *motion;
    *frames += 1;
    tracks.retain(|entity, track| {
        // One that is despawned or disabled is met anew.
        let Ok((now, _)) = present.get(*entity) else { return false };
        track.see(*now, false);
        let [by_tick, by_frame] = core::mem::take(&mut track.changed);
        track.by_ticks &= by_tick || !by_frame || *noted == 0;
        if last_seconds > 0.0 {
            track.way = (track.frames, last_seconds);
        }
        track.frames = [track.frames[1], *now];
        let grown = now.scale.length() / track.frames[0].scale.length();
        if !(GROWS.recip()..GROWS).contains(&grown) {
            track.frames[0].scale = now.scale;
        }
        if delta.is_zero() && track.frames[0] != track.frames[1] {
            // It will go on as it did, from there.
            let before = carried_back(now, &track.last_ticks, 1.0);
            (track.was_put, track.last_ticks) = (true, [before, *now]);
        }
        // What nothing has asked for in the last ticks is forgotten.
        track.used + 64 > tick.number
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_frames_move_is_on_its_way_and_what_ticks_move_is_where_they_put_it() {
        let at = |x: f32| Transform::from_xyz(x, 0.0, 0.0);
        let tick = |index, begins: f32, ends: f32| TickMoment {
            index,
            shares: [begins, ends],
            ..TickMoment::default()
        };
        let mut track = Track::new(at(0.0), None);
        track.frames = [at(1.0), at(2.0)];
        assert_eq!(track.at(&tick(0, 0.25, 0.75), true), at(1.75));
        // Carried back where the frame began later.
        assert_eq!(track.at(&tick(0, -0.5, 0.5), false), at(0.5));
        track.by_ticks = true;
        (track.last_ticks, track.ticks) = ([at(3.0); 2], vec![at(4.0), at(6.0)]);
        let both = |index| [false, true].map(|ends| track.at(&tick(index, 0.0, 0.5), ends));
        assert_eq!([both(0), both(1)], [[at(3.0), at(4.0)], [at(4.0), at(6.0)]]);
    }

    #[test]
    fn ticks_go_on_from_each_other_unless_time_is_missing() {
        let mut motion = WorldMotion::default();
        let [tick, frame] = [10, 30].map(Duration::from_millis);
        let mut next = |now: u64, rest: u64| {
            let now = Duration::from_millis(now);
            motion.next_tick(tick, [frame, now], Some(Duration::from_millis(rest)))
        };
        let first = next(30, 15);
        assert!(first.continues && (first.shares[0] - 5.0 / 30.0).abs() < 1e-6);
        assert!((first.shares[1] - 0.5).abs() < 1e-6 && (first.rest - 0.015).abs() < 1e-6);
        assert!(next(30, 5).continues);
        // The overstep of 5 ms was discarded.
        assert!(!next(60, 20).continues);
        assert!(next(60, 10).continues);
    }
}
