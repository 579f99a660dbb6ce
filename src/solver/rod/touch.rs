//! Nodes against obstacles: prediction, and push-out with friction.

use super::{
    block::{BlockLanes, EdgeLanes, NodeLanes},
    near::ESCAPE_RATIO,
    obstacle::{NearObstacles, Obstacle, Push, continuous_collision, push_out},
};
use crate::base::lanes::{LANES, Real, V3, inlined, load, load3, store3};
use fearless_simd::{Simd, f32x16, mask32x16, prelude::*};

/// Computes for each node how deep it may be in obstacles: nearer to a root that lies in one than that is deep, it
/// cannot get out without being torn off; and a strand whose length does not let it out at all stays as deep as it
/// begins.
pub(super) struct PenetrationLimits<S: Simd> {
    root: V3<f32x16<S>>,
    escape_length: f32x16<S>,
    length: f32x16<S>,
    trapped: Option<f32x16<S>>,
    any_inside: bool,
    along: f32x16<S>,
}

impl<S: Simd> PenetrationLimits<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, b: &BlockLanes) -> Self {
        let root = b.nodes.first().map(|n| load3(simd, &n.p));
        let zero = f32x16::splat(simd, 0.0);
        let any_inside = b.escape_length != [0.0; LANES];
        let mut length = zero;
        for edge in b.edges.iter().filter(|_| any_inside) {
            length += load(simd, &edge.l);
        }
        Self {
            length,
            root: root.unwrap_or(V3::new(zero, zero, zero)),
            escape_length: load(simd, &b.escape_length),
            trapped: (b.trapped != [0.0; LANES]).then(|| load(simd, &b.trapped)),
            any_inside,
            along: zero,
        }
    }

    /// Of node `i`, to be asked node after node; `None` where it may be nowhere inside.
    #[inline(always)]
    pub(super) fn at(&mut self, edges: &[EdgeLanes], i: usize) -> Option<AllowedPenetration<S>> {
        if !self.any_inside && self.trapped.is_none() {
            return None;
        }
        let simd = self.escape_length.simd;
        let is_within = Real::lt(self.along, self.escape_length);
        let along = self.along;
        if let Some(edge) = edges.get(i) {
            self.along += load(simd, &edge.l);
        }
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let deepest = self.escape_length * f32x16::splat(simd, 1.0 / ESCAPE_RATIO);
        let lanes = Real::select(is_within, one, zero);
        let near_root = is_within.any_true();
        let (root, trapped) = (self.root, self.trapped);
        let length = self.length;
        let limit = AllowedPenetration { root, length, near_root, deepest, along, lanes, trapped };
        (near_root || trapped.is_some()).then_some(limit)
    }
}

/// Height above an obstacle up to which a node begins the substep on it (m): push-out leaves them there.
pub(crate) const TOUCHING: f32 = 1e-5;

/// Where a root lies in several obstacles, as in balls that together are a head, it has to get out of the deepest:
/// those in which it is at least half as deep allow as much.
pub(crate) const DEPTH_RATIO: f32 = 2.0;

/// How deep a node may be.
pub(super) struct AllowedPenetration<S: Simd> {
    root: V3<f32x16<S>>,
    /// The strand's length.
    length: f32x16<S>,
    /// Whether any lane's node is near a root that lies inside.
    near_root: bool,
    /// The root's depth in what it is deepest in.
    deepest: f32x16<S>,
    along: f32x16<S>,
    lanes: f32x16<S>,
    /// 1 in lanes whose strand is trapped.
    trapped: Option<f32x16<S>>,
}

impl<S: Simd> AllowedPenetration<S> {
    /// How deep it may be in this obstacle, if it began the substep at `from`.
    #[inline(always)]
    pub(super) fn allowed(
        &self,
        obstacle: &Obstacle,
        clearance: f32,
        from: V3<f32x16<S>>,
    ) -> f32x16<S> {
        let near_root = self.near_root(obstacle, clearance);
        let Some(trapped) = self.trapped else { return near_root };
        let start = obstacle.moved_with(from);
        if obstacle.solid.is_clear(start, clearance) {
            return near_root;
        }
        Real::max(near_root, trapped * obstacle.solid.depth(start, clearance).1)
    }

    #[inline(always)]
    fn near_root(&self, obstacle: &Obstacle, clearance: f32) -> f32x16<S> {
        let zero = f32x16::splat(self.along.simd, 0.0);
        if !self.near_root || obstacle.solid.is_clear(self.root, clearance) {
            return zero;
        }
        let depth = obstacle.solid.depth(self.root, clearance).1;
        let share = depth * f32x16::splat(zero.simd, DEPTH_RATIO) / self.deepest;
        let share = Real::min(share, f32x16::splat(zero.simd, 1.0));
        // Less and less, at last by as much as it gets out straight on: so it may first go along another one.
        let along = self.along * f32x16::splat(zero.simd, 1.0 / ESCAPE_RATIO);
        let left = self.lanes * (self.deepest - along * along / self.deepest) * share;
        let left = Real::select(Real::lt(zero, left), left, zero);
        // A strand that is too short to get out is not moved by it: that would only crumple it.
        let never = Real::lt(self.length, depth * f32x16::splat(zero.simd, ESCAPE_RATIO));
        Real::select(never, f32x16::splat(zero.simd, f32::INFINITY), left)
    }
}

/// Predicts p* = p + v dt. With `pushed`, the length of the substep (s), by velocities before its forces: these count
/// only where nodes may pass through an obstacle.
#[inline(never)]
pub(crate) fn predict_nodes<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    dt: f32x16<S>,
    pushed: Option<f32x16<S>>,
    clearance: f32,
    obstacles: &[Obstacle],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = f32x16::splat(simd, 0.0);
            b.has_fast_nodes = false;
            let mut limits = PenetrationLimits::new(simd, b);
            for (i, (n, near)) in b.nodes.iter_mut().zip(&b.near_obstacles).enumerate() {
                let limit = limits.at(&b.edges, i);
                let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
                let p = load3(simd, &n.p);
                // Nodes that begin inside an obstacle are placed on its surface before the step, so
                // that the push-out adds no velocity. A moving obstacle does add its own.
                let mut from = p;
                for o in near.of(obstacles) {
                    let start = o.moved_with(from);
                    let allowed = match &limit {
                        Some(limit) => limit.allowed(o, clearance, from),
                        None => zero,
                    };
                    if let Some(push) = push_out(o, start, clearance, allowed) {
                        from = V3::select(held, from, from + (push.to - start));
                    }
                }
                let v = load3(simd, &n.v);
                let v = if pushed.is_some() { v - load3(simd, &n.kick) } else { v };
                // Held nodes have their start in `from` and their target in `p`.
                let start_position = V3::select(held, load3(simd, &n.from), from);
                store3(&mut n.from, start_position);
                let mut to = v.scale_add(dt, from);
                let farthest = inlined(
                    #[inline(always)]
                    |to: V3<f32x16<S>>| {
                        let Some(time) = pushed else { return to };
                        let push = load3(simd, &n.push).scale_add(time, load3(simd, &n.kick));
                        push.scale_add(dt, to)
                    },
                );
                for o in near.of(obstacles) {
                    if let Some((before, normal)) =
                        continuous_collision(o, o.moved_with(from), farthest(to), clearance)
                    {
                        let allowed = match &limit {
                            Some(limit) => limit.allowed(o, clearance, from),
                            None => zero,
                        };
                        let stopped = Real::lt(zero, normal.dot(normal));
                        let stopped = stopped & !(held | Real::lt(zero, allowed));
                        (to, b.has_fast_nodes) = (V3::select(stopped, before, to), true);
                    }
                }
                store3(&mut n.p, V3::select(held, p, to));
            }
        },
    );
}

/// What friction does in a pass over the contacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FrictionPass {
    /// No friction.
    None,
    /// Coulomb friction, whose normal force is the depth that the node is pushed out by.
    Depth,
    /// The same between steps on the lengths: what has touched goes on to, though it may not be inside now.
    Between,
    /// Before the first Newton step: nodes stick where they are.
    Assumed,
    /// After the first Newton step, which leaves a depth as the support's force: nodes for which friction does not
    /// suffice slide.
    Judged,
    /// After the last Newton step: nodes that stick are where they were.
    Solved,
    /// Coulomb friction whose normal force is all that the node has been pushed out by in this substep, as it holds all
    /// that it has slipped: friction of a pass alone is too weak where the one before has pushed the node out, and lets
    /// hair creep.
    Summed,
}

/// Pushes nodes out of obstacles, with friction, and records what touches.
#[inline(always)]
pub(crate) fn contacts<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    clearance: f32,
    obstacles: &[Obstacle],
) {
    contacts_with(simd, b, clearance, obstacles, FrictionPass::Depth, f32x16::splat(simd, 1.0));
}

/// [`contacts`] with another friction, in the lanes that are not 0.
#[inline(never)]
pub(crate) fn contacts_with<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    clearance: f32,
    obstacles: &[Obstacle],
    pass: FrictionPass,
    lanes: f32x16<S>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            (b.touched, b.changed) = ([0.0; LANES], [0.0; LANES]);
            if !b.is_near_obstacles() {
                return;
            }
            let zero = f32x16::splat(simd, 0.0);
            let (mut touched, mut changed) = (zero, zero);
            let near = b.near_obstacles.iter().zip(&b.close_obstacles);
            let mut limits = PenetrationLimits::new(simd, b);
            for (i, (n, (near, close))) in b.nodes.iter_mut().zip(near).enumerate() {
                let limit = limits.at(&b.edges, i);
                if *near == NearObstacles::NONE {
                    continue;
                }
                // What is passed on the way may be farther off.
                let near = match b.has_fast_nodes {
                    true => *near,
                    false => close.at(load3(simd, &n.p), *near),
                };
                let judged = pass == FrictionPass::Judged;
                let before = if judged { contact_state(simd, n) } else { zero };
                if near == NearObstacles::NONE {
                    n.release();
                } else {
                    let fast = b.has_fast_nodes;
                    let touches =
                        touch(simd, n, near, fast, clearance, obstacles, pass, lanes, limit);
                    touched = Real::max(touched, touches);
                }
                if judged {
                    let off = before - contact_state(simd, n);
                    changed = Real::max(changed, off * off);
                }
            }
            touched.store_array(&mut b.touched);
            let one = f32x16::splat(simd, 1.0);
            Real::min(changed, one).store_array(&mut b.changed);
        },
    );
}

/// A number for each way in which a node may touch: not at all, resting without friction, sticking, sliding.
#[inline(always)]
fn contact_state<S: Simd>(simd: S, n: &NodeLanes) -> f32x16<S> {
    let [zero, one, two] = [0.0, 1.0, 2.0].map(|number| f32x16::splat(simd, number));
    let rested = n.support(simd);
    let rests = Real::select(Real::lt(zero, rested.dot(rested)), one, zero);
    let slides = Real::select(Real::lt(zero, load(simd, &n.drag)), two, zero);
    rests + slides + load(simd, &n.sticks)
}

/// Pushes one node out of obstacles, with friction, and records the normal that it rests on. Returns 1
/// where it rests on any.
#[inline(never)]
pub(super) fn touch<S: Simd>(
    simd: S,
    n: &mut NodeLanes,
    near: NearObstacles,
    has_fast_nodes: bool,
    clearance: f32,
    obstacles: &[Obstacle],
    pass: FrictionPass,
    lanes: f32x16<S>,
    limit: Option<AllowedPenetration<S>>,
) -> f32x16<S> {
    simd.vectorize(
        #[inline(always)]
        || {
            let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
            let none = V3::new(zero, zero, zero);
            let held = Real::lt(load(simd, &n.w) * lanes, f32x16::splat(simd, 1e-12));
            let from = load3(simd, &n.from);
            let rested = n.support(simd);
            let is_rested = Real::lt(zero, rested.dot(rested));
            let (mut p, mut rests_on, mut touched) = (load3(simd, &n.p), none, zero);
            if pass == FrictionPass::Between {
                (rests_on, touched) = (rested, Real::select(is_rested, one, zero));
            }
            let mut friction = Friction::of(simd, n, pass);
            let bearing = rested.dot(friction.reaction);
            let mut deepest = f32x16::splat(simd, -1.0);
            for o in near.of(obstacles) {
                let allowed = match &limit {
                    Some(limit) => limit.allowed(o, clearance, from),
                    None => zero,
                };
                // Tunnelling has to be stopped in every pass: the shortest way out may be on the wrong
                // side.
                if has_fast_nodes
                    && let Some((before, normal)) =
                        continuous_collision(o, o.moved_with(from), p, clearance)
                {
                    let may_be = Real::lt(zero, allowed);
                    p = V3::select(held | may_be, p, before);
                    let stopped = Real::lt(zero, normal.dot(normal) * lanes);
                    let stopped = stopped & !may_be;
                    rests_on = V3::select(stopped, normal, rests_on);
                    touched = Real::select(stopped, one, touched);
                }
                let push = match pass {
                    FrictionPass::Assumed => rest_on(o, p, from, clearance, allowed),
                    FrictionPass::Judged | FrictionPass::Solved => {
                        bear_on(o, p, is_rested, bearing, clearance, allowed)
                    }
                    FrictionPass::Summed => {
                        lie_on(o, p, is_rested, friction.reaction, clearance, allowed)
                    }
                    _ => push_out(o, p, clearance, allowed).map(|push| (push, zero)),
                };
                if let Some((push, stays)) = push {
                    let pushed = Real::lt(zero, push.normal.dot(push.normal) * lanes);
                    // Between two solids it rests on the one that bears more.
                    let bears = pushed & Real::lt(deepest, push.depth);
                    let is_swept = matches!(pass, FrictionPass::Depth | FrictionPass::Summed);
                    let bears = if is_swept { pushed } else { bears };
                    let out = friction.after(&push, o, from, is_rested, pushed, bears, stays);
                    p = V3::select(held, p, out);
                    deepest = Real::select(bears, push.depth, deepest);
                    rests_on = V3::select(bears, push.normal, rests_on);
                    touched = Real::select(pushed, one, touched);
                }
            }
            store3(&mut n.p, p);
            let active = Real::lt(zero, lanes);
            if pass == FrictionPass::Judged {
                rests_on = V3::select(active, rests_on, rested);
            }
            store3(&mut n.rests_on, rests_on);
            friction.put(n, touched, active);
            touched
        },
    )
}

/// [`push_out`], and 1 in lanes where `from` begins the substep on the surface: there the node stays at first, because
/// contact that holds against elastic forces is not found by falling alone and would come and go.
#[inline(always)]
fn rest_on<S: Simd>(
    o: &Obstacle,
    p: V3<f32x16<S>>,
    from: V3<f32x16<S>>,
    clearance: f32,
    allowed: f32x16<S>,
) -> Option<(Push<S>, f32x16<S>)> {
    let zero = f32x16::splat(p.x.simd, 0.0);
    let start = o.moved_with(from);
    if o.solid.is_clear(start, clearance + TOUCHING) {
        return push_out(o, p, clearance, allowed).map(|push| (push, zero));
    }
    let (normal, depth) = o.solid.depth(start, clearance);
    let depth = depth - allowed;
    let stays = Real::lt(f32x16::splat(p.x.simd, -TOUCHING), depth);
    let other = push_out(o, p, clearance, allowed);
    if stays.to_bitmask() == 0 {
        return other.map(|push| (push, zero));
    }
    let none = V3::new(zero, zero, zero);
    let other = other.unwrap_or(Push { to: p, normal: none, depth: zero });
    let to = V3::select(stays, normal.scale_add(Real::max(depth, zero), start), other.to);
    let normal = V3::select(stays, normal, other.normal);
    let one = f32x16::splat(p.x.simd, 1.0);
    Some((Push { to, normal, depth: other.depth }, Real::select(stays, one, zero)))
}

/// [`push_out`] of nodes that were free in the Newton step before; those that were `rested` on the surface go on to if
/// it bears them. `bearing`: its force, as a displacement of a free node in the substep, which is their depth here.
#[inline(always)]
fn bear_on<S: Simd>(
    o: &Obstacle,
    p: V3<f32x16<S>>,
    rested: mask32x16<S>,
    bearing: f32x16<S>,
    clearance: f32,
    allowed: f32x16<S>,
) -> Option<(Push<S>, f32x16<S>)> {
    let zero = f32x16::splat(p.x.simd, 0.0);
    if o.solid.is_clear(p, clearance + TOUCHING) {
        return None;
    }
    let other = push_out(o, p, clearance, allowed);
    let (normal, depth) = o.solid.depth(p, clearance);
    let depth = depth - allowed;
    let touching = f32x16::splat(p.x.simd, TOUCHING);
    let is_on = rested & Real::lt(-touching, depth);
    let stays = is_on & Real::lt(zero, bearing);
    let leaves = is_on & !Real::lt(zero, bearing) & Real::lt(depth, touching);
    let none = V3::new(zero, zero, zero);
    let other = other.unwrap_or(Push { to: p, normal: none, depth: zero });
    let on = normal.scale_add(Real::max(depth, zero), p);
    let to = V3::select(stays, on, V3::select(leaves, p, other.to));
    let normal = V3::select(stays, normal, V3::select(leaves, none, other.normal));
    let depth = Real::select(stays, bearing, Real::select(leaves, zero, other.depth));
    Some((Push { to, normal, depth }, zero))
}

/// [`push_out`]; and nodes that are `rested` and have hardly left the surface are drawn back to it, by as much as they
/// have been pushed out at most: their depth is negative. `reaction`: what contact has moved them by in this substep.
#[inline(always)]
fn lie_on<S: Simd>(
    o: &Obstacle,
    p: V3<f32x16<S>>,
    rested: mask32x16<S>,
    reaction: V3<f32x16<S>>,
    clearance: f32,
    allowed: f32x16<S>,
) -> Option<(Push<S>, f32x16<S>)> {
    let zero = f32x16::splat(p.x.simd, 0.0);
    if o.solid.is_clear(p, clearance + TOUCHING) {
        return None;
    }
    let (normal, depth) = o.solid.depth(p, clearance);
    let depth = depth - allowed;
    let lies = rested & Real::lt(f32x16::splat(p.x.simd, -TOUCHING), depth);
    let pushed = lies | Real::lt(zero, depth);
    if pushed.to_bitmask() == 0 {
        return None;
    }
    let bearing = Real::max(reaction.dot(normal), zero);
    let depth = Real::select(pushed, Real::max(depth, -bearing), zero);
    let none = V3::new(zero, zero, zero);
    let normal = V3::select(pushed, normal, none);
    Some((Push { to: normal.scale_add(depth, p), normal, depth }, zero))
}

/// Friction on a node in a pass.
struct Friction<S: Simd> {
    pass: FrictionPass,
    sticks: f32x16<S>,
    drag: f32x16<S>,
    /// Above 0 if it slid in the Newton step before.
    slid: f32x16<S>,
    anchor: V3<f32x16<S>>,
    /// What has held it in that step, as a displacement of a free node in the substep (m); or in all passes so far.
    reaction: V3<f32x16<S>>,
}

/// Way back in a substep above which a node that slides has come to rest (m).
pub(crate) const REVERSING: f32 = 1e-7;

impl<S: Simd> Friction<S> {
    #[inline(always)]
    fn of(simd: S, n: &NodeLanes, pass: FrictionPass) -> Self {
        // What sticks has no drag.
        let slid = load(simd, &n.drag);
        let (sticks, drag) = match pass {
            FrictionPass::Solved | FrictionPass::Between => (load(simd, &n.sticks), slid),
            _ => (f32x16::splat(simd, 0.0), f32x16::splat(simd, 0.0)),
        };
        let (anchor, reaction) = (load3(simd, &n.anchor), load3(simd, &n.reaction));
        Self { pass, sticks, drag, anchor, reaction, slid }
    }

    /// Where a node gets to that is pushed out of `o`. `rested`: before this pass; `bears`: more than others so far;
    /// `stays`: 1 where it begins the substep on the surface.
    #[inline(always)]
    fn after(
        &mut self,
        push: &Push<S>,
        o: &Obstacle,
        from: V3<f32x16<S>>,
        rested: mask32x16<S>,
        pushed: mask32x16<S>,
        bears: mask32x16<S>,
        stays: f32x16<S>,
    ) -> V3<f32x16<S>> {
        if self.pass == FrictionPass::None {
            return push.to;
        }
        let lit = |value: f32| f32x16::splat(from.x.simd, value);
        let (zero, one) = (lit(0.0), lit(1.0));
        let start = o.moved_with(from);
        if self.pass == FrictionPass::Assumed {
            self.sticks = Real::select(bears, stays, self.sticks);
            self.anchor = V3::select(bears, start, self.anchor);
            return push.to;
        }
        let (slip, length) = push.slip(start);
        if self.pass == FrictionPass::Summed {
            let before = self.reaction.dot(push.normal);
            let bearing = Real::max(before + push.depth, zero);
            let held = self.reaction - push.normal.scale(before);
            let pull = held - slip;
            let size = Real::sqrt(Real::max(pull.dot(pull), lit(1e-24)));
            let pull = pull.scale(Real::min(one, lit(o.friction) * bearing / size));
            let reaction = push.normal.scale_add(bearing, pull);
            self.reaction = V3::select(pushed, reaction, self.reaction);
            return V3::select(pushed, push.to + (pull - held), push.to);
        }
        let most = lit(o.friction) * push.depth;
        if self.pass == FrictionPass::Judged {
            // What would have to pull it back: by what it has been held with, or else by what it has slipped.
            let held = self.reaction - push.normal.scale(self.reaction.dot(push.normal));
            let slid = Real::lt(zero, self.slid);
            let pull = V3::select(slid, held, held - slip);
            let suffices = Real::lt(pull.dot(pull), most * most);
            let size = Real::sqrt(Real::max(held.dot(held), lit(1e-24)));
            let reverses = Real::lt(lit(REVERSING) * size, slip.dot(held));
            let holds = pushed & rested & ((slid & reverses) | (suffices & !slid));
            // The solid that bears more decides.
            self.sticks = Real::select(bears, Real::select(holds, one, zero), self.sticks);
            self.drag = Real::select(bears & rested, most, self.drag);
            let ahead = V3::select(holds, start, push.to + pull);
            self.anchor = V3::select(bears, ahead, self.anchor);
            return push.to;
        }
        // Static where friction suffices, else sliding.
        let held = Real::min(one, most / Real::max(length, lit(1e-12)));
        let held = match self.pass {
            // Friction has acted in the solve: here what it holds stays, and what slides does not go back.
            FrictionPass::Solved => {
                let along = self.reaction - push.normal.scale(self.reaction.dot(push.normal));
                let reverses = Real::lt(zero, slip.dot(along));
                let slides = Real::select(reverses, one, zero);
                Real::max(self.sticks, Real::select(Real::lt(zero, self.drag), slides, held))
            }
            FrictionPass::Between => Real::select(Real::lt(zero, self.drag), zero, held),
            _ => held,
        };
        V3::select(pushed, slip.scale_add(-held, push.to), push.to)
    }

    /// Leaves in the node what holds it, unless it touches nothing.
    #[inline(always)]
    fn put(self, n: &mut NodeLanes, touched: f32x16<S>, active: mask32x16<S>) {
        let simd = touched.simd;
        if self.pass == FrictionPass::Summed {
            return store3(&mut n.reaction, self.reaction.scale(touched));
        }
        let (mut sticks, mut anchor) = (self.sticks * touched, self.anchor);
        let mut drag = self.drag * touched * (f32x16::splat(simd, 1.0) - sticks);
        if self.pass == FrictionPass::Judged {
            sticks = Real::select(active, sticks, load(simd, &n.sticks));
            drag = Real::select(active, drag, load(simd, &n.drag));
            anchor = V3::select(active, anchor, load3(simd, &n.anchor));
        }
        sticks.store_array(&mut n.sticks);
        drag.store_array(&mut n.drag);
        store3(&mut n.anchor, anchor);
    }
}
