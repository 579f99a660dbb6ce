//! The paper's projections in a substep of one strand in f64, written for itself.

use super::{FIRMNESS, FrictionPass, GRAVITY, Twin, along, dq, push_out, solve, swept};
use bevy::math::{DQuat, DVec3, DVec4};
use bevy_keratin::{StretchProjection, gpu::SubstepRecord, keratin::bond::model::cuticle_factor};

const DT: f64 = 1.0 / 360.0;
const EPSILON: f64 = 1e-6;

fn plus(q: DQuat, v: DQuat) -> DQuat {
    DQuat::from_vec4(DVec4::from(q) + DVec4::from(v)).normalize()
}

fn pure(v: DVec3) -> DQuat {
    DQuat::from_vec4(v.extend(0.0))
}

fn times(q: DQuat, s: f64) -> DQuat {
    DQuat::from_vec4(DVec4::from(q) * s)
}

impl Twin {
    pub(super) fn sweep(&mut self, r: &SubstepRecord) {
        let dt = f64::from(r.dt);
        if let Some(motion) = r.frame_motion {
            let turn = dq(motion.rotation);
            self.spins.iter_mut().for_each(|omega| *omega = turn * *omega);
        }
        let retained = f64::from(r.retained);
        self.spins.iter_mut().for_each(|omega| *omega *= retained);
        self.blow(r);
        let wq = self.weigh_swept(r);
        self.v[0] = DVec3::ZERO;
        self.fall_swept(r);
        let start = self.q.clone();
        for (q, omega) in self.q.iter_mut().zip(&self.spins) {
            *q = plus(*q, times(pure(*omega) * *q, 0.5 * dt));
        }
        let Some(sweeps) = r.sweeps else { return };
        let projection = sweeps.settings.projection;
        for _ in 0..sweeps.settings.iterations {
            self.touched = false;
            self.sweep_over(r, projection, &wq);
        }
        for _ in 0..r.limiter_steps {
            self.limit_all();
            self.contacts(r, FrictionPass::Depth);
            for _ in 0..2 {
                if self.touched {
                    self.limit_all();
                    self.contacts(r, FrictionPass::Depth);
                }
            }
        }
        for i in 0..=self.edges() {
            self.v[i] = (self.p[i] - self.from[i]) / dt;
        }
        for (i, before) in start.into_iter().enumerate() {
            let turn = self.q[i] * before.conjugate();
            self.spins[i] = turn.xyz() * (if turn.w < 0.0 { -2.0 } else { 2.0 } / dt);
        }
        let left = (-f64::from(sweeps.settings.internal_damping) * dt).exp();
        for i in 1..self.edges() {
            let change = (self.spins[i] - self.spins[i - 1]) * (0.5 * (1.0 - left));
            self.spins[i - 1] += change;
            self.spins[i] -= change;
        }
        self.remember(r);
    }

    /// Masses, rest shapes and stiffness per iteration; returns inverse rotational masses.
    fn weigh_swept(&mut self, r: &SubstepRecord) -> Vec<f64> {
        let settings = r.sweeps.map(|sweeps| sweeps.settings).unwrap_or_default();
        let edges = self.edges();
        let mean = self.l.iter().sum::<f64>() / edges as f64;
        let k = f64::from(settings.bend);
        let longer = f64::from(r.dt) / DT;
        let mut distance = 0.0;
        for i in 0..edges {
            let omega = self.omega(i);
            let (mut sum, mut total) = (DVec3::ZERO, 0.0);
            for ((shape, rate), f) in self.bonds[i].iter().zip(r.influence) {
                let f = f64::from(f);
                let full = (1.0 - shape.length_squared()).max(0.0).sqrt();
                let near = omega.xyz().dot(*shape) + omega.w * full >= 0.0;
                let present = if near { omega.xyz() } else { -omega.xyz() };
                sum += (*shape + (present - *shape) * (1.0 - rate)) * f;
                total += f;
            }
            let v = sum / total;
            self.rest[i] = DQuat::from_vec4(v.extend((1.0 - v.length_squared()).max(0.0).sqrt()));
            let factor = cuticle_factor(distance as f32, r.cuticle.damage, r.cuticle.softening);
            let stiff = k / (1.0 - k) * longer * longer * f64::from(factor);
            self.k[i] = 1.0 - (1.0 + stiff).powf(-1.0 / f64::from(settings.iterations));
            distance += self.l[i];
        }
        let mut before = 0.0;
        for i in 0..=edges {
            let after = self.l.get(i).copied().unwrap_or(0.0);
            self.mass[i] = 0.5 * (before + after) / mean;
            before = after;
        }
        let lg3 = f64::from(r.bending_length).powi(3);
        let weight = |l: f64| match settings.orientation_weight {
            Some(chi) => f64::from(chi) / (l * mean),
            None => k / (8.0 * (1.0 - k) * lg3 * DT * DT * GRAVITY) * mean * l,
        };
        self.l.iter().map(|l| weight(*l)).collect()
    }

    fn fall_swept(&mut self, r: &SubstepRecord) {
        let dt = f64::from(r.dt);
        self.sweeps = false;
        self.support.fill(DVec3::ZERO);
        self.from.clone_from(&self.p);
        for i in 1..=self.edges() {
            let mut from = self.p[i];
            for o in &r.obstacles {
                let start = along(o, from);
                if let Some((out, ..)) = push_out(o, start, (r.skin, 0.0)) {
                    from += out - start;
                }
            }
            self.from[i] = from;
            let mut to = from + self.v[i] * dt;
            for o in &r.obstacles {
                let (place, fast, _) = swept(o, along(o, from), to, r.skin);
                to = place;
                self.sweeps |= fast;
            }
            self.p[i] = to;
        }
    }

    /// An iteration: at each edge its joint, then its stretch and shear, then its start against obstacles.
    fn sweep_over(&mut self, r: &SubstepRecord, projection: StretchProjection, wq: &[f64]) {
        let edges = self.edges();
        for i in 0..edges {
            let (q1, q2) = (if i == 0 { self.root } else { self.q[i - 1] }, self.q[i]);
            let (w1, w2) = (if i == 0 { 0.0 } else { wq[i - 1] }, wq[i]);
            let omega = q1.conjugate() * q2;
            let near = if omega.dot(self.rest[i]) < 0.0 { -self.rest[i] } else { self.rest[i] };
            let off = omega.xyz() - near.xyz();
            let share = self.k[i] / (w1 + w2 + EPSILON);
            if i > 0 {
                self.q[i - 1] = plus(q1, times(q2 * pure(off), share * w1));
            }
            let q = plus(q2, times(q1 * pure(off), -share * w2));
            let (w1, w2, l) = (self.w(i), self.w(i + 1), self.l[i]);
            let t = q * DVec3::Z;
            let c = (self.p[i + 1] - self.p[i]) / l - t;
            let (axial, all) = (w1 + w2 + EPSILON * l, 4.0 * wq[i] * l * l);
            let along = t * c.dot(t);
            let (gamma, turning) = match projection {
                StretchProjection::Split => {
                    (along / axial + (c - along) / (axial + all), (c - along) / (axial + all))
                }
                _ => (c / (axial + all), c / (axial + all)),
            };
            let twice = if projection == StretchProjection::Printed { 1.0 } else { 2.0 };
            self.p[i] += gamma * (w1 * l);
            self.p[i + 1] -= gamma * (w2 * l);
            let e = pure(DVec3::Z).conjugate();
            self.q[i] = plus(q, times(pure(turning) * q * e, twice * wq[i] * l * l));
            self.touch(r, i, FrictionPass::Depth);
        }
        self.touch(r, edges, FrictionPass::Depth);
    }

    /// One Newton step on all lengths.
    fn limit_all(&mut self) {
        let edges = self.edges();
        let way = |i: usize| self.p[i + 1] - self.p[i];
        let t: Vec<DVec3> = (0..edges).map(|i| way(i).normalize()).collect();
        let off: Vec<f64> = (0..edges).map(|i| way(i).length() - self.l[i]).collect();
        let mobile = |i: usize, x: DVec3, y: DVec3| {
            let n = self.support[i];
            self.w(i) * (x.dot(y) - FIRMNESS * x.dot(n) * y.dot(n))
        };
        let mut a = vec![vec![0.0; edges]; edges];
        for i in 0..edges {
            a[i][i] = mobile(i, t[i], t[i]) + mobile(i + 1, t[i], t[i]);
            if i > 0 {
                let coupling = -mobile(i, t[i - 1], t[i]);
                (a[i][i - 1], a[i - 1][i]) = (coupling, coupling);
            }
        }
        let lambda = solve(a, off);
        for i in 0..edges {
            let next = if i + 1 < edges { t[i + 1] * lambda[i + 1] } else { DVec3::ZERO };
            let mut force = next - t[i] * lambda[i];
            let lift = force.dot(self.support[i + 1]);
            if lift > 0.0 {
                self.support[i + 1] = DVec3::ZERO;
            } else {
                force -= self.support[i + 1] * (FIRMNESS * lift);
            }
            let w = self.w(i + 1);
            self.p[i + 1] += force * w;
        }
    }
}
