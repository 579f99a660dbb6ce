//! The motion of a groom: its nodes at a number of times.

use super::error::GroomCacheError;
use crate::authoring::groom::{Groom, shared::Shared};
use bevy::prelude::*;

/// Between nodes that are no farther away distances are finite (m).
const FARTHEST: Vec3 = Vec3::splat(1e9);

/// The motion of a groom: the nodes of all its strands at a number of times (m, in the frame of its hair). An asset, and
/// immutable like [`Groom`]; a clone shares its arrays.
///
/// It comes from a hair that was [recorded](crate::authoring::groom::RecordGroomCache), from an Alembic file of animated curves or from game code,
/// goes to an Alembic file ([`alembic::write_cache`](crate::authoring::groom::alembic::write_cache)) and is [played](crate::authoring::groom::PlayGroomCache) on hair. A
/// node takes 12 bytes a frame.
///
/// ```
/// # use bevy_keratin::authoring::groom::*; use bevy::prelude::*;
/// let groom = Groom::from_polylines([[Vec3::ZERO, Vec3::Y * 0.1]]).unwrap();
/// let frames = [(0.0, vec![Vec3::ZERO, Vec3::Y * 0.1]), (0.5, vec![Vec3::ZERO, Vec3::X * 0.1])];
/// let cache = GroomCache::new(groom, frames).unwrap();
/// let mut now = Vec::new();
/// cache.at(0.25, &mut now);
/// assert_eq!(now[1], Vec3::new(0.05, 0.05, 0.0));
/// ```
#[derive(Asset, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(opaque, Default, Clone, PartialEq)]
pub struct GroomCache {
    groom: Groom,
    /// Of each frame, from that of the first (s).
    times: Shared<f32>,
    /// Frame after frame.
    points: Shared<Vec3>,
}

impl GroomCache {
    /// The motion of a groom: of each frame its time (s) and the nodes of all strands, strand after strand as in
    /// [`Groom::points`]. Times count from that of the first frame.
    ///
    /// # Errors
    /// Without a frame, when times do not ascend, or a frame has more or fewer nodes than the groom or one that is not
    /// finite or farther than 10⁹ m away.
    pub fn new(
        groom: Groom,
        frames: impl IntoIterator<Item = (f64, Vec<Vec3>)>,
    ) -> Result<Self, GroomCacheError> {
        let mut cache = Self { groom, ..Self::default() };
        let mut first = None;
        for (time, points) in frames {
            cache.push((time - *first.get_or_insert(time)) as f32, points)?;
        }
        if cache.is_empty() {
            return Err(GroomCacheError::Empty);
        }
        Ok(cache)
    }

    fn push(&mut self, time: f32, points: Vec<Vec3>) -> Result<(), GroomCacheError> {
        let (frame, expected, found) = (self.len(), self.groom.points().len(), points.len());
        if found != expected {
            return Err(GroomCacheError::Differs { frame, what: "nodes", found, expected });
        }
        let before = self.times.last().copied();
        if !time.is_finite() || before.is_some_and(|before| time <= before) {
            let before = before.unwrap_or_default();
            return Err(GroomCacheError::Time { frame, found: time, before });
        }
        if let Some(node) = points.iter().position(|p| !p.abs().cmple(FARTHEST).all()) {
            return Err(GroomCacheError::NonFinite { frame, node });
        }
        self.times.push(time);
        match self.points.is_empty() {
            true => self.points = points.into(),
            false => self.points.extend(points),
        }
        Ok(())
    }

    /// Its strands, with what files say of them; in the shape of the first frame where it comes from a file.
    pub fn groom(&self) -> &Groom {
        &self.groom
    }

    /// How many frames there are.
    pub fn len(&self) -> usize {
        self.times.len()
    }

    /// Whether there are none: only of the default.
    pub fn is_empty(&self) -> bool {
        self.times.is_empty()
    }

    /// The time of each frame (s), 0 of the first.
    pub fn times(&self) -> &[f32] {
        &self.times
    }

    /// The time of the last frame (s).
    pub fn duration(&self) -> f32 {
        self.times.last().copied().unwrap_or_default()
    }

    /// The nodes of all strands in a frame (m); none of one that is not there.
    pub fn frame(&self, frame: usize) -> &[Vec3] {
        let nodes = self.groom.points().len();
        self.points.get(frame * nodes..(frame + 1) * nodes).unwrap_or_default()
    }

    /// Puts the nodes of all strands at a time (s) into `points`, blended between the two frames around it; before the
    /// first and after the last those of these.
    pub fn at(&self, time: f32, points: &mut Vec<Vec3>) {
        points.clear();
        let after = self.times.partition_point(|t| *t <= time);
        let (from, to) = (after.saturating_sub(1), after.min(self.len().saturating_sub(1)));
        points.extend_from_slice(self.frame(from));
        if from < to {
            let share = (time - self.times[from]) / (self.times[to] - self.times[from]);
            for (point, to) in points.iter_mut().zip(self.frame(to)) {
                *point = point.lerp(*to, share);
            }
        }
    }
}
