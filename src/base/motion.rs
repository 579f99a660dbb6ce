//! Where things are at each tick: one account of all transforms that move hair.
//!
//! Ticks and frames are not synchronous. A head that is animated from frame to frame has no pose at
//! the time of a tick, only before and after it: so the ticks of a frame run when the frame's motion is
//! known, and find each transform where it was on its way at their time. What fixed ticks themselves
//! move, for instance physics, is where each of them left it. A hierarchy may mix both.

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
    /// In each tick of the frame.
    ticks: Vec<Transform>,
    /// In the tick before those.
    last_tick: Transform,
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
            ticks: Vec::new(),
            last_tick: at,
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
        match (ends, tick.index.checked_sub(1)) {
            (true, _) => self.ticks.get(tick.index).copied().unwrap_or(self.seen),
            (false, Some(before)) => self.ticks.get(before).copied().unwrap_or(self.seen),
            (false, None) => self.last_tick,
        }
    }
}

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
}

impl WorldMotion {
    /// Shifts the world.
    pub(crate) fn shift(&mut self, by: Vec3) {
        for track in self.tracks.values_mut().filter(|track| track.parent.is_none()) {
            let at = track.frames.iter_mut().chain(&mut track.ticks);
            for at in at.chain([&mut track.last_tick, &mut track.seen]) {
                at.translation += by;
            }
        }
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
            track.last_tick = track.ticks.last().copied().unwrap_or(track.seen);
            track.ticks.clear();
            track.was_put = false;
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
        let (local, parent) = self.local(entity, false)?;
        match parent {
            Some(parent) => self.begin(parent).map(|parent| parent.mul_transform(local)),
            None => Some(local.into()),
        }
    }

    /// Where it is at the end of the frame if frames move it; `None` if ticks do.
    pub(crate) fn frame_end(&mut self, entity: Entity) -> Option<GlobalTransform> {
        self.local(entity, true)?;
        let track = self.motion.tracks.get(&entity).filter(|track| !track.by_ticks)?;
        let (local, parent) = (track.frames[1], track.parent);
        match parent {
            Some(parent) => self.frame_end(parent).map(|parent| parent.mul_transform(local)),
            None => Some(local.into()),
        }
    }

    /// Whether it was moved while time stood still.
    pub(crate) fn was_put(&self, entity: Entity) -> bool {
        let track = self.motion.tracks.get(&entity);
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
    let WorldMotion { tracks, tick, noted, frames, .. } = &mut *motion;
    *frames += 1;
    tracks.retain(|entity, track| {
        // One that is despawned or disabled is met anew.
        let Ok((now, _)) = present.get(*entity) else { return false };
        track.see(*now, false);
        let [by_tick, by_frame] = core::mem::take(&mut track.changed);
        track.by_ticks &= by_tick || !by_frame || *noted == 0;
        track.frames = [track.frames[1], *now];
        if delta.is_zero() && track.frames[0] != track.frames[1] {
            (track.was_put, track.last_tick) = (true, *now);
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
        (track.last_tick, track.ticks) = (at(3.0), vec![at(4.0), at(6.0)]);
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
