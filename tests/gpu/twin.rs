//! A substep of one strand in f64, written for itself: dense matrices, no lanes. What the lanes and the
//! shader are both measured against.

mod sweep;

use crate::lab::LabStrand;
use bevy::math::{DAffine3, DMat3, DQuat, DVec3, Isometry3d, Quat, Vec3};
use bevy_keratin::{
    gpu::SubstepRecord,
    keratin::bond::model::cuticle_factor,
    solver::rod::{
        obstacle::{Obstacle, Solid},
        shape::{Placed, Shape},
    },
};

const THETA: f64 = 0.65;
const HOLD: f64 = 1e5;
const FIRMNESS: f64 = 0.95;
const REVERSING: f64 = 1e-7;
const MOST_STEPS: usize = 4;
const ROUNDING: f64 = 1.5e-7;
const TOUCHING: f64 = 1e-5;
const LEAVING: usize = 16;
const NEARER: f64 = 0.98;
const MAX_STRAIN: f64 = 0.5;
const FOLDING: f64 = 0.125;
const TOLERANCE: f64 = 5e-4;
const TORN: f64 = 0.01;
const REPAIRS: u32 = 4;
const GRAVITY: f64 = 9.8_f32 as f64;

fn d(v: Vec3) -> DVec3 {
    v.as_dvec3()
}

fn dq(q: Quat) -> DQuat {
    q.as_dquat()
}

fn tangent(q: DQuat) -> DVec3 {
    q * DVec3::Z
}

fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

fn cross_matrix(v: DVec3) -> DMat3 {
    DMat3::from_cols(v.cross(DVec3::X), v.cross(DVec3::Y), v.cross(DVec3::Z))
}

/// q turned the shortest way so that its tangent is along e, and twice the turn's vector part.
fn parallel_transport(q: DQuat, e: DVec3) -> (DQuat, DVec3) {
    let (t, len) = (tangent(q), e.length());
    let cosine = len + t.dot(e);
    let turn = if cosine < len * 1e-6 {
        DQuat::from_vec4((q * DVec3::X).extend(0.0))
    } else {
        let scale = 1.0 / (2.0 * len * cosine).sqrt();
        DQuat::from_vec4((t.cross(e) * scale).extend(cosine * scale))
    };
    ((turn * q).normalize(), 2.0 * turn.xyz())
}

fn moment(before: DQuat, q: DQuat, rest: DQuat, k: f64) -> DVec3 {
    let apart = q * (before * rest).conjugate();
    apart.xyz() * if apart.w < 0.0 { -2.0 * k } else { 2.0 * k }
}

/// Ω with real part ≥ 0.
fn darboux(before: DQuat, q: DQuat) -> DQuat {
    let omega = before.conjugate() * q;
    if omega.w < 0.0 { -omega } else { omega }
}

/// What friction does in a pass over the contacts.
#[derive(Clone, Copy, PartialEq)]
enum FrictionPass {
    None,
    Depth,
    Between,
    Assumed,
    Judged,
    Solved,
}

pub struct Twin {
    pub p: Vec<DVec3>,
    pub v: Vec<DVec3>,
    pub q: Vec<DQuat>,
    pub tension: Vec<f64>,
    /// Angular velocities of the edges, where the paper's projections solve.
    pub spins: Vec<DVec3>,
    /// Remembered shape and rate of each joint's kinds.
    pub bonds: Vec<[(DVec3, f64); 4]>,
    from: Vec<DVec3>,
    root: DQuat,
    l: Vec<f64>,
    k: Vec<f64>,
    axial: Vec<f64>,
    taken: Vec<f64>,
    /// Largest twist that counts in the Hessian, as a moment over EI.
    max_twist: f64,
    rest: Vec<DQuat>,
    mass: Vec<f64>,
    support: Vec<DVec3>,
    sticks: Vec<bool>,
    drag: Vec<f64>,
    anchor: Vec<DVec3>,
    /// What holds it, as a displacement of a free node in the substep.
    reaction: Vec<DVec3>,
    drying: Vec<f64>,
    push: Vec<DVec3>,
    touched: bool,
    sweeps: bool,
    /// Length from the root on that may be in what the root lies in.
    escape_length: f64,
    trapped: bool,
    /// Rounds in which it got out of what it was deep in.
    pub rounds: usize,
}

impl Twin {
    pub fn of(s: &LabStrand) -> Self {
        let edges = s.lengths.len();
        let kinds = |j: usize| {
            let joint = &s.joints[j];
            core::array::from_fn(|kind| (d(joint.shapes[kind]), f64::from(joint.rates[kind])))
        };
        Self {
            p: s.positions.iter().map(|p| d(*p)).collect(),
            v: s.velocities.iter().map(|v| d(*v)).collect(),
            q: s.orientations.iter().map(|q| dq(*q)).collect(),
            tension: s.tensions.iter().map(|t| f64::from(*t)).collect(),
            spins: s.spins.iter().map(|omega| d(*omega)).collect(),
            bonds: (0..edges).map(kinds).collect(),
            from: vec![DVec3::ZERO; edges + 1],
            root: dq(s.root_frame),
            l: s.lengths.iter().map(|l| f64::from(*l)).collect(),
            k: vec![0.0; edges],
            axial: vec![0.0; edges],
            taken: vec![0.0; edges],
            max_twist: 0.0,
            rest: vec![DQuat::IDENTITY; edges],
            mass: vec![0.0; edges + 1],
            support: vec![DVec3::ZERO; edges + 1],
            sticks: vec![false; edges + 1],
            drag: vec![0.0; edges + 1],
            anchor: vec![DVec3::ZERO; edges + 1],
            reaction: vec![DVec3::ZERO; edges + 1],
            drying: vec![0.0; edges],
            push: vec![DVec3::ZERO; edges + 1],
            touched: false,
            sweeps: false,
            escape_length: 0.0,
            trapped: false,
            rounds: 0,
        }
    }

    fn edges(&self) -> usize {
        self.l.len()
    }

    fn w(&self, i: usize) -> f64 {
        if i == 0 { 0.0 } else { 1.0 / self.mass[i] }
    }

    pub fn substep(&mut self, r: &SubstepRecord) {
        let dt = f64::from(r.dt);
        let mut root_from = self.root;
        let mut root_place = self.p[0];
        if let Some(Isometry3d { rotation, translation }) = r.frame_motion {
            let (turn, way) = (dq(rotation), d(translation.into()));
            root_place = turn * self.p[0] + way;
            self.p.iter_mut().skip(1).for_each(|p| *p = turn * *p + way);
            self.v.iter_mut().for_each(|v| *v = turn * *v);
            self.q.iter_mut().for_each(|q| *q = (turn * *q).normalize());
            root_from = turn * self.root;
        }
        if r.sweeps.is_some() {
            return self.sweep(r);
        }
        self.blow(r);
        self.shape(r);
        self.weigh(r);
        self.from.clone_from(&self.p);
        self.from[0] = root_place;
        self.v[0] = DVec3::ZERO;
        let theta = self.predict(r);
        let fast = self.whips(dt);
        let twice = self.touched || fast;
        let share = if root_from.dot(self.root) < 0.0 { -theta } else { theta };
        let between = (root_from * (1.0 - theta) + self.root * share).normalize();
        let turn = between * root_from.conjugate();
        let root_turn = turn.xyz() * if turn.w < 0.0 { -2.0 } else { 2.0 };
        let damping = (f64::from(r.damping) - (2.0 * theta - 1.0) * dt).max(0.0);
        let stage = (theta, between, root_turn, damping, twice);
        self.newton(r, stage, if twice { 1.0 } else { 1.0 / theta }, false);
        for step in 1..if twice && !self.trapped { MOST_STEPS } else { 1 } {
            let changed = self.contacts(r, FrictionPass::Judged);
            if changed || (fast && step == 1) {
                self.newton(r, stage, 1.0 / theta, true);
            } else {
                break;
            }
        }
        self.contacts(r, FrictionPass::Solved);
        for pass in 0..r.limiter_steps {
            if !self.limit(if pass == 0 { -1.0 } else { TOLERANCE }) {
                break;
            }
            self.contacts(r, FrictionPass::Between);
            let repairs = if pass + 1 == r.limiter_steps { REPAIRS + 1 } else { 0 };
            for repair in 0..repairs {
                let is_last = repair == REPAIRS;
                let most = if self.trapped { TORN } else { MAX_STRAIN };
                if !self.clamp_lengths(if is_last { most } else { TORN }) || is_last {
                    break;
                }
                self.contacts(r, FrictionPass::Between);
            }
        }
        self.finish(dt, theta);
        self.remember(r);
    }

    fn blow(&mut self, r: &SubstepRecord) {
        let (dt, retained) = (f64::from(r.dt), f64::from(r.retained));
        let edges = self.edges();
        for i in 0..=edges {
            let e = i.min(edges - 1);
            let edge = self.p[e + 1] - self.p[e];
            let (mut acceleration, mut drying) = (DVec3::ZERO, 0.0);
            let (mut shares, mut carried) = (0.0, DVec3::ZERO);
            for b in &r.blowers {
                let (to, aim) = (self.p[i] - d(b.nozzle), d(b.aim));
                let along = to.dot(aim);
                if along > 0.0 {
                    let sine = aim.cross(edge).length() / edge.length();
                    let apart = (to - aim * along).length();
                    let wind = f64::from(b.strength) * sine / (apart / 0.01 + 1.0);
                    acceleration += aim * wind;
                    drying += f64::from(b.drying) * wind;
                    let core = f64::from(b.core);
                    let share = core / along.max(core) / (apart / 0.01 + 1.0);
                    let motion = d(b.velocity) + d(b.spin).cross(self.p[i] - d(b.center));
                    (shares, carried) = (shares + share, carried + motion * share);
                }
            }
            let still = d(r.wind) - d(r.headwind);
            let flow = d(r.wind) + (carried - still * shares) / f64::max(shares, 1.0);
            let before = self.v[i];
            self.v[i] =
                before * retained + d(r.gravity) * dt + acceleration * dt + flow * (1.0 - retained);
            self.push[i] = if i == 0 { DVec3::ZERO } else { (self.v[i] - before) / dt };
            if i < edges {
                self.drying[i] = drying * dt;
            }
        }
    }

    fn omega(&self, i: usize) -> DQuat {
        darboux(if i == 0 { self.root } else { self.q[i - 1] }, self.q[i])
    }

    fn shape(&mut self, r: &SubstepRecord) {
        let mut distance = 0.0;
        for i in 0..self.edges() {
            let (mut sum, mut closed, mut total) = (DVec3::ZERO, 0.0, 0.0);
            for ((shape, rate), f) in self.bonds[i].iter().zip(r.influence) {
                let f = f64::from(f);
                (sum, closed, total) = (sum + *shape * f * *rate, closed + f * rate, total + f);
            }
            let share = closed / total;
            self.rest[i] = if share < 1e-3 {
                self.omega(i)
            } else {
                let v = sum / closed;
                DQuat::from_vec4(v.extend((1.0 - v.length_squared()).max(0.0).sqrt()))
            };
            let factor = cuticle_factor(distance as f32, r.cuticle.damage, r.cuticle.softening);
            self.k[i] = share.max(1e-3) * f64::from(factor);
            distance += self.l[i];
        }
    }

    fn weigh(&mut self, r: &SubstepRecord) {
        let sum: f64 = self.l.iter().sum();
        let count = self.edges() as f64;
        let density = count / sum;
        let stiff = f64::from(r.bending_length).min(6.0 * sum);
        let bending = density * 2.0 * GRAVITY * stiff.powi(3);
        let firmest = 2.5e10 / (count * count * f64::from(r.dt).powi(2));
        let stiffest = (0.5 * bending).min(firmest / density.powi(3));
        let held = (3.0 * density / (stiffest * f64::from(r.dt).powi(2))).powf(0.25);
        self.max_twist = held.max(8.99 / sum);
        let mut before = 0.0;
        for i in 0..=self.edges() {
            let after = self.l.get(i).copied().unwrap_or(0.0);
            if i < self.edges() {
                self.k[i] = (self.k[i] * bending / (before + after)).min(firmest * after * after);
                let least = (5.0 * bending / after.powi(3)).min(firmest / 16.0);
                self.axial[i] = (GRAVITY * count / 1e-4 / after).min(firmest).max(least);
            }
            self.mass[i] = (before + after) * density * 0.5;
            before = after;
        }
    }

    fn predict(&mut self, r: &SubstepRecord) -> f64 {
        let dt = f64::from(r.dt);
        self.v.iter_mut().zip(&self.push).for_each(|(v, push)| *v -= *push * dt);
        self.support.fill(DVec3::ZERO);
        self.reaction.fill(DVec3::ZERO);
        let depths = r.obstacles.iter().map(|o| depth(&o.solid, self.p[0], r.skin).1);
        self.escape_length = 2.0 * depths.fold(0.0, f64::max);
        self.trapped = false;
        self.surface(r);
        let mut theta = THETA;
        self.advance(r, dt * theta);
        if self.touched {
            theta = 1.0;
            let edges = self.edges();
            self.p[1..=edges].copy_from_slice(&self.from[1..=edges]);
            self.advance(r, dt);
        }
        theta
    }

    /// How deep node `i`, which began at `from`, may be in an obstacle: one that the root lies in, or, of a trapped
    /// strand, as deep as it was.
    fn allowed(&self, o: &Obstacle, i: usize, skin: f32, from: DVec3) -> f64 {
        let trapped = match self.trapped {
            true => depth(&o.solid, along(o, from), skin).1.max(0.0),
            false => 0.0,
        };
        let way = self.l[..i].iter().sum::<f64>();
        let root = depth(&o.solid, self.p[0], skin).1;
        if way >= self.escape_length || root <= 0.0 {
            return trapped;
        }
        if self.l.iter().sum::<f64>() < 2.0 * root {
            return f64::INFINITY;
        }
        let deepest = self.escape_length / 2.0;
        let share = (2.0 * root / deepest).clamp(0.0, 1.0);
        ((deepest - (way / 2.0).powi(2) / deepest).max(0.0) * share).max(trapped)
    }

    fn advance(&mut self, r: &SubstepRecord, ahead: f64) {
        self.sweeps = false;
        for i in 1..=self.edges() {
            let mut from = self.p[i];
            for o in &r.obstacles {
                let (start, may_be) = (along(o, from), self.allowed(o, i, r.skin, from));
                if let Some((out, ..)) = push_out(o, start, (r.skin, may_be)) {
                    from += out - start;
                }
            }
            self.from[i] = from;
            let mut to = from + self.v[i] * ahead;
            for o in &r.obstacles {
                let far = to + self.push[i] * (f64::from(r.dt) * ahead);
                let (place, fast, normal) = swept(o, along(o, from), far, r.skin);
                let stopped = normal != DVec3::ZERO && self.allowed(o, i, r.skin, from) <= 0.0;
                to = if stopped { place } else { to };
                self.sweeps |= fast;
            }
            self.p[i] = to;
        }
        self.contacts(r, FrictionPass::Assumed);
    }

    /// How deep it is in obstacles beyond what its root allows: the most, and the sum.
    fn penetration(&self, r: &SubstepRecord) -> (f64, f64) {
        let (mut deepest, mut sum) = (0.0_f64, 0.0);
        for (i, p) in self.p.iter().enumerate().skip(1) {
            for o in &r.obstacles {
                let deep = depth(&o.solid, along(o, *p), r.skin).1 - self.allowed(o, i, r.skin, *p);
                deepest = deepest.max(deep);
                sum += deep.max(0.0);
            }
        }
        (deepest, sum)
    }

    fn surface(&mut self, r: &SubstepRecord) {
        let deep = self.l[0] * 0.25;
        let (deepest, before) = self.penetration(r);
        if deepest <= deep {
            return;
        }
        self.sweeps = false;
        let edges = self.edges();
        self.from[1..=edges].copy_from_slice(&self.p[1..=edges]);
        for _ in 0..LEAVING.min(2 * edges) {
            self.rounds += 1;
            self.contacts(r, FrictionPass::None);
            if !self.limit(TORN) {
                return;
            }
        }
        let strain = |i: usize| (self.p[i + 1].distance(self.p[i]) / self.l[i] - 1.0).abs();
        let torn = (0..edges).any(|i| strain(i) > TORN);
        self.clamp_lengths(TORN);
        let (deepest, after) = self.penetration(r);
        self.trapped = torn || deepest > deep;
        if self.trapped && after >= NEARER * before {
            self.p[1..=edges].copy_from_slice(&self.from[1..=edges]);
        }
    }

    fn whips(&self, dt: f64) -> bool {
        let fast = |i: usize| ((self.v[i + 1] - self.v[i]) / self.l[i]).length_squared();
        (0..self.edges()).map(fast).fold(0.0, f64::max) > (0.03 / dt).powi(2)
    }

    /// Whether a node has been found to stick, slide, rest or leave that did not.
    fn contacts(&mut self, r: &SubstepRecord, pass: FrictionPass) -> bool {
        self.touched = false;
        let mut changed = false;
        for i in 0..=self.edges() {
            let state = |t: &Self| (t.support[i] != DVec3::ZERO, t.sticks[i], t.drag[i] > 0.0);
            let before = state(self);
            self.touch(r, i, pass);
            changed |= before != state(self);
        }
        changed
    }

    fn touch(&mut self, r: &SubstepRecord, i: usize, pass: FrictionPass) {
        let (from, rested) = (self.from[i], self.support[i] != DVec3::ZERO);
        let (mut p, mut support, mut touched) = (self.p[i], DVec3::ZERO, false);
        let (mut sticks, mut drag, mut deepest) = (false, 0.0, -1.0);
        let (bearing, slid) = (self.support[i].dot(self.reaction[i]), self.drag[i] > 0.0);
        if matches!(pass, FrictionPass::Between | FrictionPass::Solved) {
            (sticks, drag) = (self.sticks[i], self.drag[i]);
        }
        if pass == FrictionPass::Between && rested {
            (support, touched) = (self.support[i], true);
        }
        for o in &r.obstacles {
            let may_be = self.allowed(o, i, r.skin, from);
            let start = along(o, from);
            if self.sweeps {
                let (place, _, normal) = swept(o, start, p, r.skin);
                if normal != DVec3::ZERO && may_be <= 0.0 {
                    (p, support, touched) = (if i == 0 { p } else { place }, normal, true);
                }
            }
            let layer = (r.skin, may_be);
            let mut push = push_out(o, p, layer);
            let mut stays = false;
            if pass == FrictionPass::Assumed {
                let (normal, depth) = depth(&o.solid, start, r.skin);
                stays = depth - may_be > -TOUCHING;
                if stays {
                    let pushed = push.map_or(0.0, |(.., depth)| depth);
                    push = Some((start + normal * (depth - may_be).max(0.0), normal, pushed));
                }
            }
            if matches!(pass, FrictionPass::Judged | FrictionPass::Solved) && rested {
                let (normal, depth) = depth(&o.solid, p, r.skin);
                let depth = depth - may_be;
                if depth > -TOUCHING && bearing > 0.0 {
                    push = Some((p + normal * depth.max(0.0), normal, bearing));
                } else if depth > -TOUCHING && depth < TOUCHING {
                    push = None;
                }
            }
            let Some((out, normal, depth)) = push else { continue };
            touched = true;
            let bears = pass == FrictionPass::Depth || depth > deepest;
            if bears {
                (deepest, support) = (depth, normal);
                if matches!(pass, FrictionPass::Assumed | FrictionPass::Judged) {
                    self.anchor[i] = start;
                }
            }
            let slip = out - start;
            let slip = slip - normal * slip.dot(normal);
            let most = f64::from(o.friction) * depth;
            let coulomb = (most / slip.length().max(1e-12)).min(1.0);
            let holding = self.reaction[i] - normal * self.reaction[i].dot(normal);
            let held = match pass {
                FrictionPass::None => 0.0,
                FrictionPass::Depth => coulomb,
                FrictionPass::Assumed => {
                    sticks = if bears { stays } else { sticks };
                    0.0
                }
                FrictionPass::Judged => {
                    let pull = if slid { holding } else { holding - slip };
                    let size = holding.length().max(1e-12);
                    let holds = match slid {
                        true => slip.dot(holding) > REVERSING * size,
                        false => pull.length() < most,
                    };
                    if bears {
                        (sticks, drag) = (rested && holds, if rested { most } else { drag });
                        self.anchor[i] = if holds { start } else { out + pull };
                    }
                    0.0
                }
                FrictionPass::Solved if sticks => 1.0,
                FrictionPass::Between if drag > 0.0 => 0.0,
                FrictionPass::Solved if drag > 0.0 => {
                    if slip.dot(holding) > 0.0 {
                        1.0
                    } else {
                        0.0
                    }
                }
                FrictionPass::Solved | FrictionPass::Between => coulomb,
            };
            p = if i == 0 { p } else { out - slip * held };
        }
        (self.p[i], self.support[i]) = (p, support);
        self.sticks[i] = sticks && touched;
        self.drag[i] = if touched && !sticks { drag } else { 0.0 };
        self.touched |= touched;
    }

    /// One Newton step, all at once.
    fn newton(
        &mut self,
        r: &SubstepRecord,
        (theta, between, root_turn, damping, twice): (f64, DQuat, DVec3, f64, bool),
        beyond: f64,
        second: bool,
    ) {
        let edges = self.edges();
        let ahead = theta * f64::from(r.dt);
        let (inertia, damped) = (1.0 / (ahead * ahead), damping / ahead);
        let mut at = self.p.clone();
        at[0] = self.from[0] + (self.p[0] - self.from[0]) * theta;
        // Blocks of edges: the diagonal, with the edge before, and the gradient.
        let mut h = vec![DMat3::ZERO; edges];
        let mut coupled = vec![DMat3::ZERO; edges];
        let mut pull = vec![DVec3::ZERO; edges];
        let (mut q_before, mut t_before, mut r_before) = (between, tangent(between), 0.0);
        // With twist, and without.
        let (mut turn_before, mut swing_before) = (root_turn, root_turn);
        for j in 0..edges {
            let e = at[j + 1] - at[j];
            let (l, length, axial) = (self.l[j], e.length(), self.axial[j]);
            let crushed = length < 0.5 * l;
            let (carried, mut turn) = parallel_transport(self.q[j], e);
            let q = if crushed { self.q[j] } else { carried };
            let lever = length.max(0.2 * l);
            let inverse = 1.0 / lever;
            let t = if crushed { tangent(q) } else { e * inverse };
            if second {
                let e = self.from[j + 1] - self.from[j];
                let cosine = e.length() + e.dot(t);
                turn = e.cross(t) * (2.0 / (2.0 * e.length() * cosine).sqrt());
            }
            let swing = if crushed { DVec3::ZERO } else { turn };
            let turn = swing + t * turn_before.dot(t);
            self.q[j] = q;
            let stretch = if crushed { t.dot(e) } else { length } - l;
            let rounding = ROUNDING * at[j + 1].length();
            let taut = self.tension[j];
            if !second {
                let wanted = taut / axial;
                self.taken[j] = (wanted.min(0.02 * l) - wanted.min(5e-4 * l)).max(0.0);
            }
            let strained = stretch + self.taken[j];
            let kept = (taut / axial).clamp(strained - rounding, strained + rounding);
            self.tension[j] = axial * kept;
            let tension = (axial * kept).max(taut).max(0.0);
            let k = self.k[j];
            let elastic = moment(q_before, q, self.rest[j], k);
            let rate = turn - turn_before;
            let taken = rate.dot(swing - swing_before) / rate.length_squared().max(1e-30);
            let couple = elastic + rate * (k * damped * taken.clamp(0.0, 1.0));
            let stiff = k * (1.0 + damped);
            let bent = |t: DVec3, r: f64| (DMat3::IDENTITY - outer(t, t)) * (stiff * r * r);
            let across = if crushed { axial } else { tension * inverse };
            h[j] += outer(t, t) * axial + (DMat3::IDENTITY - outer(t, t)) * across;
            h[j] += bent(t, inverse);
            pull[j] += couple.cross(t) * inverse + (e + t * (kept - stretch - l)) * axial;
            if j > 0 {
                h[j - 1] += bent(t_before, r_before);
                pull[j - 1] -= couple.cross(t_before) * r_before;
                let most = k * lever * self.max_twist;
                let twist = elastic.dot(t).clamp(-most, most) * -0.25 * inverse * r_before;
                coupled[j] = (outer(t_before, t) - DMat3::IDENTITY * t.dot(t_before))
                    * (stiff * inverse * r_before)
                    + cross_matrix((t + t_before) * twist);
            }
            (q_before, t_before, r_before) = (q, t, inverse);
            (turn_before, swing_before) = (turn, swing);
        }
        // Nodes 1 to n; the root is held.
        let size = 3 * edges;
        let (mut a, mut b) = (vec![vec![0.0; size]; size], vec![0.0; size]);
        let mut add = |row: usize, column: usize, m: DMat3| {
            if row > 0 && column > 0 {
                for x in 0..3 {
                    for y in 0..3 {
                        a[3 * (row - 1) + x][3 * (column - 1) + y] += m.col(y)[x];
                    }
                }
            }
        };
        for j in 0..edges {
            for (row, s) in [(j + 1, 1.0), (j, -1.0)] {
                for (column, t) in [(j + 1, 1.0), (j, -1.0)] {
                    add(row, column, h[j] * (s * t));
                }
                if j > 0 {
                    for (column, t) in [(j, 1.0), (j - 1, -1.0)] {
                        add(row, column, coupled[j] * (s * t));
                        add(column, row, coupled[j].transpose() * (s * t));
                    }
                }
            }
        }
        for i in 1..=edges {
            let inert = self.mass[i] * inertia;
            let n = self.support[i];
            let mut diagonal = DMat3::IDENTITY * inert;
            let mut force = self.push[i] * self.mass[i] - pull[i - 1];
            force += pull.get(i).copied().unwrap_or(DVec3::ZERO);
            if twice {
                let back = self.anchor[i] - self.p[i];
                let back = back - n * back.dot(n);
                diagonal += match self.sticks[i] {
                    true => DMat3::IDENTITY * (inert * HOLD),
                    false => outer(n, n) * (inert * HOLD),
                };
                let friction = match self.sticks[i] {
                    true => back * HOLD,
                    false => back * (self.drag[i] / back.length().max(1e-12)),
                };
                force += (self.from[i] + self.v[i] * ahead - self.p[i] + friction) * inert;
            }
            add(i, i, diagonal);
            b[3 * (i - 1)..3 * i].copy_from_slice(&force.to_array());
        }
        let x = solve(a, b);
        let mut ways = vec![DVec3::ZERO; edges + 1];
        for i in 1..=edges {
            let solved = DVec3::from_slice(&x[3 * (i - 1)..3 * i]);
            ways[i] = solved;
            let n = self.support[i];
            if twice && n != DVec3::ZERO {
                let back = self.anchor[i] - self.p[i];
                let back = back - n * back.dot(n);
                ways[i] = if self.sticks[i] { back } else { solved - n * n.dot(solved) };
                let slows = back * (self.drag[i] / back.length().max(1e-12));
                self.reaction[i] = (ways[i] - solved) * HOLD + slows;
            }
            self.p[i] = self.from[i] + (at[i] + ways[i] - self.from[i]) * beyond;
        }
        for j in 0..edges {
            let along = tangent(self.q[j]).dot(ways[j + 1] - ways[j]);
            self.tension[j] += self.axial[j] * along;
        }
    }

    fn limit(&mut self, tolerance: f64) -> bool {
        let edges = self.edges();
        let way = |i: usize| self.p[i + 1] - self.p[i];
        let strain = |i: usize| way(i).length() / self.l[i] - 1.0;
        if (0..edges).map(|i| strain(i).abs()).fold(0.0, f64::max) <= tolerance {
            return false;
        }
        let stretch = |i: usize| {
            (self.tension[i] / self.axial[i]).clamp(-TOLERANCE * self.l[i], TOLERANCE * self.l[i])
        };
        let off: Vec<f64> = (0..edges).map(|i| way(i).length() - self.l[i] - stretch(i)).collect();
        let t: Vec<DVec3> = (0..edges).map(|i| way(i).normalize()).collect();
        let presses = |i: usize| self.reaction[i].dot(self.support[i]) > 0.0;
        let pressed: Vec<bool> = (0..=edges).map(presses).collect();
        let firm = |i: usize| if pressed[i] && i != edges { 1.0 } else { FIRMNESS };
        let mobile = |i: usize, x: DVec3, y: DVec3| {
            let n = self.support[i];
            let stuck = if self.sticks[i] { 1.0 } else { 0.0 };
            self.w(i) * ((1.0 - stuck) * x.dot(y) - (firm(i) - stuck) * x.dot(n) * y.dot(n))
        };
        let mut a = vec![vec![0.0; edges]; edges];
        for i in 0..edges {
            a[i][i] = mobile(i, t[i], t[i]) + mobile(i + 1, t[i], t[i]);
            if off[i] < 0.0 {
                a[i][i] *= 1.0 + FOLDING * (-strain(i) - TOLERANCE).max(0.0);
            }
            if i > 0 {
                let coupling = -mobile(i, t[i - 1], t[i]);
                (a[i][i - 1], a[i - 1][i]) = (coupling, coupling);
            }
        }
        let lambda = solve(a, off);
        for i in 0..edges {
            let next = if i + 1 < edges { t[i + 1] * lambda[i + 1] } else { DVec3::ZERO };
            let mut force = next - t[i] * lambda[i];
            if i + 1 < edges {
                let taut = (0.5 * (lambda[i] + lambda[i + 1])).max(0.0);
                let stiff = taut * self.w(i + 1) / self.l[i];
                force -= (t[i + 1] - t[i]) * (taut * stiff / (1.0 + stiff));
            }
            let n = self.support[i + 1];
            let lift = force.dot(n);
            let far = lift * self.w(i + 1) > TOUCHING;
            let force = if lift > 0.0 && (far || !pressed[i + 1]) {
                (self.support[i + 1], self.sticks[i + 1]) = (DVec3::ZERO, false);
                force
            } else {
                let stuck = if self.sticks[i + 1] { 1.0 } else { 0.0 };
                let firm = if lift > 0.0 { 1.0 } else { firm(i + 1) };
                force * (1.0 - stuck) - n * ((firm - stuck) * lift)
            };
            let w = self.w(i + 1);
            self.p[i + 1] += force * w;
        }
        true
    }

    fn clamp_lengths(&mut self, torn: f64) -> bool {
        let mut any = false;
        for i in 0..self.edges() {
            let way = self.p[i + 1] - self.p[i];
            if (way.length() / self.l[i] - 1.0).abs() > torn {
                any = true;
                self.p[i + 1] = self.p[i] + way.normalize() * self.l[i];
            }
        }
        any
    }

    fn finish(&mut self, dt: f64, theta: f64) {
        let edges = self.edges();
        for i in 0..=edges {
            let moved = (self.p[i] - self.from[i]) / dt;
            self.v[i] = if i == 0 { moved } else { (moved + self.v[i] * (theta - 1.0)) / theta };
        }
        // Diagonal, coupling with the edge before, and what turns it.
        let mut rows = vec![[0.0; 3]; edges];
        let (mut q_before, mut t_before) = (self.root, tangent(self.root));
        for i in 0..edges {
            let e = self.p[i + 1] - self.p[i];
            if e.length() >= 0.5 * self.l[i] {
                self.q[i] = parallel_transport(self.q[i], e).0;
            }
            let (t, k) = (tangent(self.q[i]), self.k[i]);
            let elastic = moment(q_before, self.q[i], self.rest[i], k);
            rows[i][0] += k;
            rows[i][2] -= elastic.dot(t);
            if i > 0 {
                rows[i - 1][0] += k;
                rows[i - 1][2] += elastic.dot(t_before);
                rows[i][1] = -k * t.dot(t_before);
            }
            (q_before, t_before) = (self.q[i], t);
        }
        for i in 1..edges {
            let share = rows[i][1] / rows[i - 1][0];
            rows[i][0] -= share * rows[i][1];
            rows[i][2] -= share * rows[i - 1][2];
        }
        // An edge that would turn too far is stopped, and those before it take account of that.
        let (mut turn, mut coupling) = (0.0, 0.0);
        for (q, [diagonal, before, rhs]) in self.q.iter_mut().zip(rows).rev() {
            turn = ((rhs - coupling * turn) / diagonal).clamp(-1.5_f64, 1.5);
            coupling = before;
            *q = (DQuat::from_vec4((tangent(*q) * (0.5 * turn)).extend(1.0)) * *q).normalize();
        }
    }

    fn remember(&mut self, r: &SubstepRecord) {
        for i in 0..self.edges() {
            let omega = self.omega(i);
            for kind in 0..4 {
                let mut change = f64::from(r.change[kind]);
                if kind == 0 {
                    change += self.drying[i];
                }
                let (shape, rate) = &mut self.bonds[i][kind];
                let to = (*rate + change).clamp(0.0, 1.0);
                let formed = to - *rate;
                if formed > 0.0 {
                    let full = (1.0 - shape.length_squared()).max(0.0).sqrt();
                    let near = omega.xyz().dot(*shape) + omega.w * full >= 0.0;
                    let present = if near { omega.xyz() } else { -omega.xyz() };
                    *shape = (*shape * *rate + present * formed) / to;
                }
                *rate = to;
            }
        }
    }
}

fn along(o: &Obstacle, p: DVec3) -> DVec3 {
    o.motion.map_or(p, |motion| {
        let [x, y, z, w] = [
            motion.matrix3.x_axis.into(),
            motion.matrix3.y_axis.into(),
            motion.matrix3.z_axis.into(),
            motion.translation.into(),
        ]
        .map(|v: Vec3| d(v));
        DAffine3::from_cols(x, y, z, w).transform_point3(p)
    })
}

/// Half axes (m) and axes of an ellipsoid.
fn ellipsoid(placed: &Placed) -> (DVec3, DMat3) {
    let Shape::Ellipsoid { radii } = placed.shape else {
        unreachable!("the shaders have no other shapes")
    };
    (d(radii) * f64::from(placed.scale), placed.axes.as_dmat3())
}

/// Normal and distance of an ellipsoid's surface nearest to a point in its frame: the point is
/// r²p/(r² + t), where t is found by bisection.
fn off_ellipsoid(r: DVec3, p: DVec3) -> (DVec3, f64) {
    let on = |t: f64| r * r * p / (r * r + t);
    let is_out = |t: f64| (on(t) / r).length_squared() > 1.0;
    let (mut low, mut high) = (-r.min_element().powi(2), p.length() * r.max_element() + 1.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        (low, high) = if is_out(middle) { (middle, high) } else { (low, middle) };
    }
    let place = on(0.5 * (low + high));
    let normal = (place / (r * r)).normalize();
    (normal, (p - place).dot(normal))
}

fn depth(solid: &Solid, p: DVec3, skin: f32) -> (DVec3, f64) {
    let skin = f64::from(skin);
    match *solid {
        Solid::Placed(ref placed) => {
            let (half, axes) = ellipsoid(placed);
            let (normal, distance) = off_ellipsoid(half, axes.transpose() * (p - d(placed.center)));
            (axes * normal, skin - distance)
        }
        Solid::HalfSpace { normal, point } => (d(normal), skin - (p - d(point)).dot(d(normal))),
        Solid::Capsule { a, b, radius } => {
            let (axis, rel) = (d(b) - d(a), p - d(a));
            let share = (rel.dot(axis) / axis.length_squared().max(1e-20)).clamp(0.0, 1.0);
            let off = rel - axis * share;
            (off.normalize_or(DVec3::Y), f64::from(radius) + skin - off.length())
        }
        Solid::Cylinder { center, axis, radius, half_height } => {
            let (u, rel) = (d(axis), p - d(center));
            let along = rel.dot(u);
            let off = rel - u * along;
            let side = f64::from(radius) + skin - off.length();
            let cap = f64::from(half_height) + skin - along.abs();
            match cap < side {
                true => (u * along.signum(), cap),
                false => (off.normalize_or(DVec3::Y), side),
            }
        }
    }
}

/// Out of a solid with a skin, where it is deeper than it may be: where to, the normal there, and how deep it was.
fn push_out(o: &Obstacle, p: DVec3, (skin, may_be): (f32, f64)) -> Option<(DVec3, DVec3, f64)> {
    let (normal, depth) = depth(&o.solid, p, skin);
    let depth = depth - may_be;
    (depth > 0.0).then(|| (p + normal * depth, normal, depth))
}

/// Where a node gets to, whether it might pass through, and the normal of what stops it.
fn swept(o: &Obstacle, start: DVec3, p: DVec3, skin: f32) -> (DVec3, bool, DVec3) {
    let (thickness, center, axis) = match o.solid {
        Solid::HalfSpace { .. } => return (p, false, DVec3::ZERO),
        Solid::Placed(ref placed) => {
            (ellipsoid(placed).0.min_element() as f32, placed.center, Vec3::Y)
        }
        Solid::Capsule { a, b, radius } => (radius, a, (b - a).normalize_or_zero()),
        Solid::Cylinder { center, axis, radius, half_height } => {
            (radius.min(half_height), center, axis)
        }
    };
    let (thickness, axis, way) = (f64::from(thickness), d(axis), p - start);
    if way.length_squared() <= 0.2 * thickness * thickness {
        return (p, false, DVec3::ZERO);
    }
    let (facing, outside) = depth(&o.solid, start, skin);
    let across = |v: DVec3| v - axis * v.dot(axis);
    let (from, flat) = (across(start - d(center)), across(way));
    let (from, flat) = match &o.solid {
        Solid::Placed(placed) => {
            let (half, axes) = ellipsoid(placed);
            [start - d(center), way].map(|v| axes.transpose() * v / half).into()
        }
        _ => (from, flat),
    };
    let nearest = (-from.dot(flat) / flat.length_squared().max(1e-20)).clamp(0.0, 1.0);
    let looks = [nearest, 0.5, 1.0].map(|share| depth(&o.solid, start + way * share, skin));
    let deepest = looks.iter().map(|look| look.1).fold(f64::NEG_INFINITY, f64::max);
    if deepest > 0.0 && looks[2].0.dot(facing) < 0.0 && outside < 1e-3 * thickness {
        let behind = (outside - way.dot(facing)).max(0.0);
        return (p + facing * behind, true, facing);
    }
    (p, true, DVec3::ZERO)
}

/// Of a symmetric positive definite system, by Gauss without pivoting, within its band.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let size = b.len();
    let reach = |(i, row): (usize, &Vec<f64>)| {
        let last = row.iter().rposition(|x| *x != 0.0).unwrap_or(i);
        last.saturating_sub(i)
    };
    let band = a.iter().enumerate().map(reach).max().unwrap_or(0);
    for i in 0..size {
        let end = size.min(i + band + 1);
        let (above, below) = a.split_at_mut(i + 1);
        let row = &above[i];
        for (k, other) in below.iter_mut().enumerate().take(band) {
            let share = other[i] / row[i];
            (i..end).for_each(|c| other[c] -= share * row[c]);
            b[i + 1 + k] -= share * b[i];
        }
    }
    for i in (0..size).rev() {
        let end = size.min(i + band + 1);
        let known: f64 = (i + 1..end).map(|c| a[i][c] * b[c]).sum();
        b[i] = (b[i] - known) / a[i][i];
    }
    b
}
