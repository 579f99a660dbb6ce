//! Followers as pure functions: how a strand that is not simulated follows its guides.
//!
//! Each of its edges rotates with its guides' edges at the same distance from the root, and the
//! strand is rebuilt from its own root with its own segments. So it keeps its lengths exactly, its
//! root stays on the scalp, and it is continuous when its guides are assigned: rotations start at zero.
//! Its angular velocity relative to the guides at that time decays and its displacement returns to zero.

use crate::base::parallel::prefetch;
use bevy::math::ops;
use glam::{Quat, Vec3};

/// How many guides a strand has at most.
pub const GUIDES: usize = 3;

/// Time constant with which a follower's relative motion decays (s).
const OWN_MOTION: f32 = 0.15;

/// How long that lasts, in such times.
pub(crate) const OWN_LASTS: f32 = 10.0;

/// A follower's guides and its pose relative to them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GuideOffsets {
    /// The guides, by their index among the hair's, with their weights.
    pub guides: Vec<(u32, f32)>,
    /// For each edge and guide, edge by edge.
    edges: Vec<EdgeOffset>,
    /// Angular velocity of each edge relative to its guides when they were assigned (rad/s); empty once that
    /// has decayed.
    own: Vec<Vec3>,
    /// Time since then (s).
    since: f32,
}

/// An edge's pose relative to a guide.
#[derive(Clone, Copy, Debug, PartialEq)]
struct EdgeOffset {
    /// The edge's frame in that of the guide.
    relative: Quat,
    /// The segment in the frame of the edge, the same for each guide (m).
    segment: Vec3,
    /// Edge of the guide, with the fraction toward the next.
    at: f32,
}

/// State of a follower or a guide.
#[derive(Clone, Copy, Debug)]
pub struct StrandState<'a> {
    /// Node positions (m).
    pub positions: &'a [Vec3],
    /// Node velocities (m/s).
    pub velocities: &'a [Vec3],
    /// Orientations of its edges.
    pub turns: &'a [Quat],
    /// Their rest lengths (m).
    pub lengths: &'a [f32],
}

impl StrandState<'_> {
    /// Angular velocity of edge `i` without its axial part (rad/s).
    fn spin(&self, i: usize) -> Vec3 {
        let (p, v) = (self.positions, self.velocities);
        let (Some(p), Some(v)) = (p.get(i..i + 2), v.get(i..i + 2)) else { return Vec3::ZERO };
        let edge = p[1] - p[0];
        let spin = edge.cross(v[1] - v[0]) / edge.length_squared();
        if spin.is_finite() { spin } else { Vec3::ZERO }
    }
}

/// The displacement, in the moving frame of the nodes, of points at rest in the world.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Frame(Option<(Quat, Vec3)>);

impl Frame {
    /// Appends a rotation and translation (m).
    pub fn then(&mut self, turn: Quat, way: Vec3) {
        let (turned, gone) = self.0.unwrap_or((Quat::IDENTITY, Vec3::ZERO));
        self.0 = Some(((turn * turned).normalize(), turn * gone + way));
    }

    /// Rotation and translation, if there was any.
    #[cfg(feature = "gpu")]
    pub(crate) fn motion(&self) -> Option<(Quat, Vec3)> {
        self.0
    }

    /// The world velocity (m/s) of a point that rested in the moving frame for `seconds`.
    pub(super) fn velocity(&self, place: Vec3, seconds: f32) -> Vec3 {
        let v = (place - self.place(place)) / seconds;
        if v.is_finite() { v } else { Vec3::ZERO }
    }

    #[inline]
    fn place(&self, place: Vec3) -> Vec3 {
        self.0.map_or(place, |(turn, way)| turn * place + way)
    }

    #[inline]
    fn turned(&self, orientation: Quat) -> Quat {
        self.0.map_or(orientation, |(turn, _)| turn * orientation)
    }
}

/// The state of a strand, mutable.
#[derive(Debug)]
pub struct StrandPose<'a> {
    /// Node positions (m).
    pub positions: &'a mut [Vec3],
    /// Where the nodes were before they moved, to be written (m); as many, or none if not needed.
    pub before: &'a mut [Vec3],
    /// Node velocities (m/s).
    pub velocities: &'a mut [Vec3],
    /// Orientations of the edges.
    pub orientations: &'a mut [Quat],
    /// Their angular velocities (rad/s); empty if not needed.
    pub spins: &'a mut [Vec3],
}

#[cfg(feature = "debug")]
impl GuideOffsets {
    /// The indices of its guides.
    pub(super) fn guides(&self) -> impl Iterator<Item = u32> {
        self.guides.iter().map(|(guide, _)| *guide)
    }
}

/// Access for compute shaders, which move followers as well.
#[cfg(feature = "gpu")]
impl GuideOffsets {
    /// Time constant with which a follower's relative motion decays (s).
    pub(crate) const OWN_MOTION: f32 = OWN_MOTION;

    /// Whether nothing is left of a motion of its own after so long (s).
    #[cfg(feature = "gpu")]
    pub(crate) fn are_settled(since: f32) -> bool {
        since > OWN_LASTS * OWN_MOTION
    }

    /// Of each edge and guide, edge by edge: the edge's frame in that of the guide, its segment in its own
    /// frame (m), and the guide's edge beside it, with the share toward the next.
    pub(crate) fn edges(&self) -> impl Iterator<Item = (Quat, Vec3, f32)> + '_ {
        self.edges.iter().map(|offset| (offset.relative, offset.segment, offset.at))
    }

    /// Angular velocity of each edge relative to its guides when they were assigned (rad/s), none once that has
    /// decayed, and the time since (s).
    pub(crate) fn own_motion(&self) -> (&[Vec3], f32) {
        (&self.own, self.since)
    }

    /// It has followed for so long elsewhere (s).
    pub(crate) fn pass(&mut self, seconds: f32) {
        self.since += seconds;
        if self.since > OWN_LASTS * OWN_MOTION {
            self.own.clear();
        }
    }
}

impl GuideOffsets {
    /// Of a strand in its present pose to guides in theirs, with their weights.
    pub fn new<'a>(
        strand: StrandState<'_>,
        guides: impl IntoIterator<Item = (u32, f32, StrandState<'a>)>,
    ) -> Self {
        let guides: Vec<_> = guides.into_iter().take(GUIDES).collect();
        let mut edges = Vec::with_capacity(guides.len() * strand.lengths.len());
        let mut own = Vec::with_capacity(strand.lengths.len());
        let mut distance = 0.0;
        for (i, (length, turn)) in strand.lengths.iter().zip(strand.turns).enumerate() {
            let mut spin = strand.spin(i);
            let segment = strand.positions.get(i..i + 2).map_or(Vec3::ZERO, |p| p[1] - p[0]);
            let segment = turn.conjugate() * segment;
            for (_, weight, guide) in &guides {
                let at = edge_at(guide.lengths, distance + 0.5 * length);
                let relative = between(guide.turns, at).conjugate() * *turn;
                edges.push(EdgeOffset { relative, segment, at });
                spin -= guide.spin((at + 0.5) as usize) * *weight;
            }
            own.push(spin);
            distance += length;
        }
        Self {
            guides: guides.into_iter().map(|(index, weight, _)| (index, weight)).collect(),
            edges,
            own,
            since: 0.0,
        }
    }

    /// Whether they fit a strand with this number of edges.
    pub fn fit(&self, edges: usize) -> bool {
        !self.guides.is_empty() && self.edges.len() == edges * self.guides.len()
    }

    /// Follows the guides, whose frames `turns` gives: `None` for an invalid one. Velocities are those of
    /// the motion in `dt` (s), in which points at rest in the world moved by `frame`. Returns
    /// whether there was a valid guide; without one the strand is left at rest.
    pub fn follow<'a>(
        &mut self,
        pose: &mut StrandPose<'_>,
        turns: impl Fn(u32) -> Option<&'a [Quat]>,
        frame: &Frame,
        dt: f32,
    ) -> bool {
        let frames: [_; GUIDES] =
            core::array::from_fn(|g| self.guides.get(g).and_then(|guide| turns(guide.0)));
        let root = pose.positions.first().copied().unwrap_or(Vec3::NAN);
        if frames.iter().all(Option::is_none)
            || !root.is_finite()
            || !self.fit(pose.orientations.len())
        {
            pose.velocities.fill(Vec3::ZERO);
            pose.spins.fill(Vec3::ZERO);
            return false;
        }
        self.since += dt;
        if self.since > OWN_LASTS * OWN_MOTION {
            self.own.clear();
        }
        // Starts with the initial relative velocity and returns to zero displacement.
        let own_motion = self.since * ops::exp(-self.since / OWN_MOTION);
        let per_second = 1.0 / dt;
        let finite = |v: Vec3| if v.is_finite() { v } else { Vec3::ZERO };
        let mut p = root;
        if let Some(v) = pose.velocities.first_mut() {
            *v = Vec3::ZERO;
        }
        let (stays, has_spins) = (frame.0.is_none(), !pose.spins.is_empty());
        let nodes = pose.positions.iter_mut().zip(pose.velocities.iter_mut()).skip(1);
        let edges = self.edges.chunks_exact(self.guides.len()).zip(pose.orientations.iter_mut());
        for (i, ((offsets, orientation), (position, velocity))) in edges.zip(nodes).enumerate() {
            let mut turn = self.turn(offsets, &frames);
            if let Some(own) = self.own.get(i) {
                turn = Quat::from_scaled_axis(*own * own_motion) * turn;
            }
            if !turn.is_finite() {
                turn = Quat::IDENTITY;
            }
            p += finite(turn * offsets[0].segment);
            let before = core::mem::replace(position, p);
            if let Some(kept) = pose.before.get_mut(i + 1) {
                *kept = before;
            }
            let place = if stays { before } else { frame.place(before) };
            *velocity = finite((p - place) * per_second);
            let before = core::mem::replace(orientation, turn);
            if has_spins && let Some(spins) = pose.spins.get_mut(i) {
                *spins = finite(spin(frame.turned(before), turn) * per_second);
            }
        }
        true
    }

    pub(super) fn prefetch(&self) {
        prefetch(&self.guides);
        prefetch(&self.edges);
    }

    /// The frame of an edge that its guides give it.
    #[inline]
    fn turn(&self, offsets: &[EdgeOffset], frames: &[Option<&[Quat]>; GUIDES]) -> Quat {
        // Fast path: at coarse levels followers have one guide.
        if let ([offset], Some(turns)) = (offsets, frames[0]) {
            return between(turns, offset.at) * offset.relative;
        }
        let mut first = None;
        let mut sum = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        for ((offset, turns), (_, weight)) in offsets.iter().zip(frames).zip(&self.guides) {
            let Some(turns) = turns else { continue };
            let one = between(turns, offset.at) * offset.relative;
            // q and −q are the same rotation.
            let like = *first.get_or_insert(one);
            sum += one * if like.dot(one) < 0.0 { -*weight } else { *weight };
        }
        let square = sum.length_squared();
        // Opposite rotations have no mean.
        if square > 1e-3 { sum * (1.0 / square.sqrt()) } else { first.unwrap_or(Quat::IDENTITY) }
    }
}

/// The edge at `distance` (m) from the root, by edges' middles, with the fraction toward the next.
fn edge_at(lengths: &[f32], distance: f32) -> f32 {
    let (mut middle, mut before) = (0.0, 0.0);
    for (i, length) in lengths.iter().enumerate() {
        middle += 0.5 * length;
        if distance <= middle {
            if i == 0 {
                return 0.0;
            }
            let share = (distance - before) / (middle - before);
            // Equal segments map edge to edge, which is cheaper.
            return match share {
                share if share > 0.99 => i as f32,
                share if share < 0.01 => i as f32 - 1.0,
                share => i as f32 - 1.0 + share,
            };
        }
        before = middle;
        middle += 0.5 * length;
    }
    lengths.len().saturating_sub(1) as f32
}

/// The frame between two edges, or of one.
#[inline]
fn between(turns: &[Quat], at: f32) -> Quat {
    let i = at as usize;
    let share = at - i as f32;
    match (turns.get(i), turns.get(i + 1)) {
        (Some(one), Some(next)) if share > 0.0 => {
            let next = if one.dot(*next) < 0.0 { -*next } else { *next };
            (*one * (1.0 - share) + next * share).normalize()
        }
        (Some(one), _) => *one,
        _ => turns.last().copied().unwrap_or(Quat::IDENTITY),
    }
}

/// The rotation vector from one orientation to another (rad), accurate to a thousandth up to a tenth of
/// a turn.
#[inline]
fn spin(before: Quat, now: Quat) -> Vec3 {
    let turn = now * before.conjugate();
    turn.xyz() * if turn.w < 0.0 { -2.0 } else { 2.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::rod::frame::parallel_transport;

    /// A strand's parts: positions, orientations and lengths.
    type Parts = (Vec<Vec3>, Vec<Quat>, Vec<f32>);

    fn strand(points: impl Iterator<Item = Vec3>) -> Parts {
        let positions: Vec<Vec3> = points.collect();
        let orientations = parallel_transport(&positions, None);
        let lengths = positions.windows(2).map(|p| p[0].distance(p[1])).collect();
        (positions, orientations, lengths)
    }

    /// A curl with this number of nodes.
    fn curl(nodes: u32, phase: f32) -> Parts {
        strand((0..nodes).map(|i| {
            let angle = 0.5 * i as f32 + phase;
            Vec3::new(0.01 * angle.cos(), -0.01 * i as f32, 0.01 * angle.sin())
        }))
    }

    fn straight(root: Vec3, nodes: u32, segment: f32) -> Parts {
        strand((0..nodes).map(|i| root + Vec3::NEG_Y * (segment * i as f32)))
    }

    fn state_of(parts: &Parts) -> StrandState<'_> {
        StrandState { positions: &parts.0, velocities: &[], turns: &parts.1, lengths: &parts.2 }
    }

    fn offsets_of(own: &Parts, guides: &[(&Parts, f32)]) -> GuideOffsets {
        let guides = guides.iter().zip(0..);
        GuideOffsets::new(
            state_of(own),
            guides.map(|((parts, weight), i)| (i, *weight, state_of(parts))),
        )
    }

    #[test]
    fn a_follower_starts_with_its_own_velocity_which_decays() {
        let guide = straight(Vec3::ZERO, 9, 0.02);
        let mut own = straight(Vec3::X * 0.01, 9, 0.02);
        let before = own.clone();
        // The strand swings about its root, the guide rests.
        let speed: Vec<Vec3> = (0..9).map(|i| Vec3::Z * (0.04 * i as f32)).collect();
        let velocities = vec![Vec3::ZERO; 9];
        let strand = StrandState { velocities: &speed, ..state_of(&own) };
        let guides = [(0, 1.0, StrandState { velocities: &velocities, ..state_of(&guide) })];
        let mut offsets = GuideOffsets::new(strand, guides);
        let mut step = |own: &mut Parts| {
            let (mut v, mut w) = (vec![Vec3::ZERO; 9], vec![Vec3::ZERO; 8]);
            let mut pose = StrandPose {
                positions: &mut own.0,
                before: &mut [],
                velocities: &mut v,
                orientations: &mut own.1,
                spins: &mut w,
            };
            offsets.follow(&mut pose, |_| Some(&guide.1[..]), &Frame::default(), 1.0 / 60.0);
            v
        };
        let first = step(&mut own);
        assert!(first[8].distance(speed[8]) < 0.2 * speed[8].length(), "{}", first[8]);
        let mut farthest = 0.0_f32;
        for _ in 0..120 {
            step(&mut own);
            farthest = farthest.max(own.0[8].distance(before.0[8]));
        }
        assert!((0.01..0.03).contains(&farthest), "{farthest} m");
        assert!(own.0[8].distance(before.0[8]) < 1e-5, "{}", own.0[8]);
    }

    /// Moves a follower; returns whether it followed, and its velocities.
    fn moved(
        offsets: &mut GuideOffsets,
        own: &mut Parts,
        guides: &[Option<&[Quat]>],
    ) -> (bool, Vec<Vec3>) {
        let mut velocities = vec![Vec3::NAN; own.0.len()];
        let mut spins = vec![Vec3::NAN; own.1.len()];
        let (was, mut before) = (own.0.clone(), own.0.clone());
        before[1..].fill(Vec3::NAN);
        let mut pose = StrandPose {
            positions: &mut own.0,
            before: &mut before,
            velocities: &mut velocities,
            orientations: &mut own.1,
            spins: &mut spins,
        };
        let went = offsets.follow(&mut pose, |i| guides[i as usize], &Frame::default(), 0.1);
        assert!(velocities.iter().chain(&spins).all(|v| v.is_finite()));
        assert!(!went || before == was, "where it was is kept");
        (went, velocities)
    }

    #[test]
    fn a_follower_stays_where_it_is_until_guides_move() {
        let guides = [curl(9, 0.0), curl(12, 2.0), straight(Vec3::X, 5, 0.03)];
        let before = curl(9, 1.0);
        let mut own = before.clone();
        let mut offsets =
            offsets_of(&own, &[(&guides[0], 0.5), (&guides[1], 0.3), (&guides[2], 0.2)]);
        let turns = guides.each_ref().map(|g| Some(&g.1[..]));
        let (went, velocities) = moved(&mut offsets, &mut own, &turns);
        assert!(went && offsets.fit(8) && !offsets.fit(9));
        for (a, b) in own.0.iter().zip(&before.0) {
            assert!(a.distance(*b) < 1e-6, "{a} {b}");
        }
        assert!(velocities.iter().all(|v| v.length() < 1e-5));
    }

    #[test]
    fn a_guide_that_turns_as_a_whole_turns_the_strand_about_its_own_root() {
        let guide = straight(Vec3::ZERO, 9, 0.02);
        let before = curl(9, 0.7);
        let mut own = before.clone();
        let mut offsets = offsets_of(&own, &[(&guide, 1.0)]);
        let turn = Quat::from_rotation_z(0.8);
        let turned: Vec<Quat> = guide.1.iter().map(|q| turn * *q).collect();
        let (_, velocities) = moved(&mut offsets, &mut own, &[Some(&turned)]);
        for (i, p) in own.0.iter().enumerate() {
            let expected = before.0[0] + turn * (before.0[i] - before.0[0]);
            assert!(p.distance(expected) < 1e-6);
            let moved = (expected - before.0[i]) / 0.1;
            assert!(velocities[i].distance(moved) < 1e-4, "as fast as it went");
        }
    }

    #[test]
    fn lengths_stay_for_any_motion_and_node_count_of_guides() {
        let (a, b) = (straight(Vec3::ZERO, 9, 0.02), straight(Vec3::X, 4, 0.07));
        let mut own = curl(14, 0.3);
        let mut offsets = offsets_of(&own, &[(&a, 0.7), (&b, 0.3)]);
        let bent = |parts: &Parts, by: f32| -> Vec<Quat> {
            let turn = |i: usize| Quat::from_rotation_x(by * i as f32) * Quat::from_rotation_y(by);
            parts.1.iter().enumerate().map(|(i, q)| turn(i) * *q).collect()
        };
        let (to, other) = (bent(&a, 0.2), bent(&b, -0.3));
        moved(&mut offsets, &mut own, &[Some(&to), Some(&other)]);
        let now = own.0.windows(2).map(|p| p[0].distance(p[1]));
        assert!(now.zip(&own.2).all(|(now, rest)| (now / rest - 1.0).abs() < 1e-4));
        // Opposite turns have no mean: the first guide's is taken.
        let half = |q: &Quat| Quat::from_rotation_x(core::f32::consts::PI) * *q;
        let turned: Vec<Quat> = a.1.iter().map(half).collect();
        let (went, _) = moved(&mut offsets, &mut own, &[Some(&turned), Some(&b.1)]);
        assert!(went && own.0.iter().all(|p| p.is_finite()));
    }

    #[test]
    fn a_guide_is_followed_at_the_same_distance_from_the_root() {
        assert_eq!(edge_at(&[0.02; 8], 0.01), 0.0);
        assert_eq!(edge_at(&[0.02; 8], 0.0501), 2.0, "edge by edge");
        assert_eq!(edge_at(&[0.02; 8], 9.0), 7.0, "beyond the tip its last one");
        assert!((edge_at(&[0.02; 8], 0.04) - 1.5).abs() < 1e-5);
        assert!((edge_at(&[0.01, 0.03], 0.01) - 0.25).abs() < 1e-5);
        assert_eq!(edge_at(&[], 0.1), 0.0);
        let turns = [Quat::IDENTITY, -Quat::from_rotation_x(0.4)];
        assert!(between(&turns, 0.5).angle_between(Quat::from_rotation_x(0.2)) < 1e-3);
        assert_eq!(between(&[], 0.5), Quat::IDENTITY);
    }

    #[test]
    fn without_a_guide_a_strand_stays_at_rest() {
        let guide = straight(Vec3::ZERO, 9, 0.02);
        let before = curl(9, 0.7);
        let mut own = before.clone();
        let mut offsets = offsets_of(&own, &[(&guide, 1.0)]);
        let (went, velocities) = moved(&mut offsets, &mut own, &[None]);
        assert!(!went && own.0 == before.0 && velocities == [Vec3::ZERO; 9]);
        assert!(!moved(&mut GuideOffsets::default(), &mut own, &[]).0);
        own.0[0] = Vec3::NAN;
        assert!(!moved(&mut offsets, &mut own, &[Some(&guide.1)]).0);
        assert_eq!(own.0[1..], before.0[1..]);
    }

    #[test]
    fn points_at_rest_in_the_world_have_no_velocity_in_a_moving_frame() {
        let guide = straight(Vec3::ZERO, 9, 0.02);
        let mut own = straight(Vec3::X * 0.01, 9, 0.02);
        let mut offsets = offsets_of(&own, &[(&guide, 1.0)]);
        let turn = Quat::from_rotation_y(0.3);
        let mut frame = Frame::default();
        // The root stays in the frame; were it where the world is, all would be at rest.
        frame.then(turn, own.0[0] - turn * own.0[0]);
        frame.then(Quat::IDENTITY, Vec3::ZERO);
        let turned: Vec<Quat> = guide.1.iter().map(|q| turn * *q).collect();
        let (mut v, mut w) = (vec![Vec3::ONE; 9], vec![Vec3::ONE; 8]);
        let mut pose = StrandPose {
            positions: &mut own.0,
            before: &mut [],
            velocities: &mut v,
            orientations: &mut own.1,
            spins: &mut w,
        };
        offsets.follow(&mut pose, |_| Some(&turned[..]), &frame, 0.1);
        assert!(v.iter().chain(&w).all(|v| v.length() < 1e-4), "{v:?} {w:?}");
    }
}
