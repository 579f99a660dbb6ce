//! The impulse between two edges that touch, before a substep: soft contact, approach to the firm cores, friction.
//!
//! A node that many pairs push takes a share of its mass in each (mass splitting, Tonge et al. 2012): each impulse is at
//! most that of the exact implicit step of two bodies, so their sum never overshoots.

use super::geometry::Seen;
use crate::base::lanes::{Real, V3};

/// The damping ratio of soft contact.
const DAMPING: f64 = 0.3;

/// The share of what two cores share already that a substep may undo.
const CORE_RECOVERY: f64 = 0.2;

/// The share of the reach within which a pair begins to act.
const BEGINNING: f64 = 0.05;

/// The share of a substep in what a pair has borne.
pub(super) const BEARING: f64 = 0.2;

/// The share of a pair's slip since it stuck that friction takes back in a substep.
const ANCHOR: f64 = 0.5;

/// What contact is like. Masses are in metres of a dry strand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Contact<R> {
    /// The distance of axes at which strands touch, 2r (m).
    pub reach: R,
    /// That at which their firm cores do (m).
    pub core: R,
    /// α: the acceleration of strands whose axes coincide (m/s²).
    pub strength: R,
    /// μ.
    pub friction: R,
    /// What holds strands that touch besides what presses them together (m/s²).
    pub cohesion: R,
    /// The substep (s).
    pub dt: R,
}

impl Contact<f32> {
    /// The same in all lanes that `like` has.
    #[inline(always)]
    pub(super) fn splat<R: Real>(self, like: R) -> Contact<R> {
        let lit = |value: f32| like.lit(value.into());
        Contact {
            reach: lit(self.reach),
            core: lit(self.core),
            strength: lit(self.strength),
            friction: lit(self.friction),
            cohesion: lit(self.cohesion),
            dt: lit(self.dt),
        }
    }
}

/// The four nodes of two edges, a's first.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moving<R> {
    /// Velocities, without what the forces of this substep add: of hair at rest elastic forces take that back.
    pub velocities: [V3<R>; 4],
    /// Inverse masses; 0 is held.
    pub w: [R; 4],
    /// How many pairs push each.
    pub counts: [R; 4],
}

/// What a pair's past has left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Past<R> {
    /// How far it has slid since it stuck (m).
    pub slip: V3<R>,
    /// The impulse that has pressed it in the last substeps, in the mean.
    pub bearing: R,
    /// 1 where cores may not touch, 0 where they have overlapped from the start.
    pub firm: R,
}

/// The part of each node in a point on its edge.
#[inline(always)]
pub(super) fn parts<R: Real>([s, t]: [R; 2]) -> [R; 4] {
    let one = s.lit(1.0);
    [one - s, s, one - t, t]
}

/// The velocity of a's point relative to b's.
#[inline(always)]
fn relative<R: Real>(parts: [R; 4], v: [V3<R>; 4]) -> V3<R> {
    let a = v[0].scale(parts[0]) + v[1].scale(parts[1]);
    let b = v[2].scale(parts[2]) + v[3].scale(parts[3]);
    a - b
}

/// How fast two edges may approach until their cores touch at the end of the substep (m/s); below zero where they have
/// to part.
#[inline(always)]
fn allowed<R: Real>(seen: &Seen<R>, contact: &Contact<R>) -> R {
    let off = (seen.distance - contact.core) / contact.dt;
    let recovery = off.lit(CORE_RECOVERY);
    R::select(off.lt(off.lit(0.0)), off * recovery, off)
}

/// 1 where a pair pushes in this substep, 0 where it does not, and between the two where it begins to, so that others at
/// its nodes do not feel it at once.
#[inline(always)]
pub(super) fn acts<R: Real>(
    seen: &Seen<R>,
    moving: [V3<R>; 4],
    firm: R,
    contact: &Contact<R>,
) -> R {
    let (zero, one) = (contact.dt.lit(0.0), contact.dt.lit(1.0));
    let speed = seen.normal.dot(relative(parts(seen.at), moving));
    let beginning = contact.dt.lit(1.0 / BEGINNING) / contact.reach;
    let deep = R::select(zero.lt(seen.length), contact.reach - seen.distance, zero);
    let nears = -(speed + allowed(seen, contact)) * contact.dt * firm;
    let acts = (deep.max(nears) * beginning).max(zero).min(one);
    // There is no direction where they cross.
    R::select(zero.lt(seen.normal.dot(seen.normal)), acts, zero)
}

/// The impulse on a, and minus that on b, of a pair that acts.
#[inline(always)]
pub(super) fn kick<R: Real>(
    seen: &Seen<R>,
    moving: &Moving<R>,
    past: &mut Past<R>,
    contact: &Contact<R>,
) -> V3<R> {
    let Contact { reach, strength, friction, cohesion, dt, .. } = *contact;
    let (zero, one) = (dt.lit(0.0), dt.lit(1.0));
    let parts = parts(seen.at);
    let mut split = zero;
    let mut whole = zero;
    for ((part, w), count) in parts.into_iter().zip(moving.w).zip(moving.counts) {
        let light = part * part * w;
        whole = whole + light;
        split = light.mul_add(count, split);
    }
    let is_held = whole.lt(dt.lit(1e-12));
    let split = R::select(is_held, one, split);
    let whole = R::select(is_held, one, whole);
    let v = relative(parts, moving.velocities);
    let speed = seen.normal.dot(v);

    // Implicit: while it acts it parts the two.
    let line = strength / reach;
    let stiff = line * seen.length;
    let damping = dt.lit(2.0 * DAMPING) * (stiff / whole).sqrt();
    let yielding = dt * (dt * stiff + damping);
    let soft = (dt * line * seen.overlap - yielding * speed) / (one + yielding * split);
    let soft = R::select(zero.lt(stiff), soft.max(zero), zero);
    // What soft contact leaves of the way to each other that cores have to stop.
    let firm = -(speed + allowed(seen, contact)) / split - soft;
    let firm = firm.max(zero) * past.firm;
    let press = soft + firm;
    let share = dt.lit(BEARING);
    past.bearing = past.bearing.mul_add(one - share, press * share);

    let across = seen.normal.scale_add(-speed, v);
    let slip = v.scale_add(dt, past.slip);
    // What does not touch yet has not slid on anything.
    let touches = R::select(seen.distance.lt(reach), one, zero);
    let slip = slip.scale(touches);
    let slip = seen.normal.scale_add(-slip.dot(seen.normal), slip);
    let anchored = dt.lit(ANCHOR) / dt;
    let wanted = slip.scale_add(anchored, across).scale(-one / split);
    let size = wanted.dot(wanted).max(dt.lit(1e-30)).sqrt();
    let most = friction * (past.bearing + cohesion * dt * seen.length);
    let held = (most / size).min(one);
    let far = slip.dot(slip).max(dt.lit(1e-30)).sqrt();
    let farthest = most * split / anchored;
    past.slip = slip.scale((farthest / far).min(one));
    let impulse = wanted.scale_add(held, seen.normal.scale(press));
    V3::select(is_held, seen.normal.scale(zero), impulse)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forces::contact::pairs::geometry::{Edge, see};
    use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

    type V = V3<f64>;

    fn contact(dt: f64) -> Contact<f64> {
        Contact { reach: 2e-3, core: 7e-4, strength: 20.0, friction: 0.2, cohesion: 0.0, dt }
    }

    fn none() -> Past<f64> {
        Past { slip: V3::new(0.0, 0.0, 0.0), bearing: 0.0, firm: 1.0 }
    }

    fn random_vector(random: &mut Xoshiro256PlusPlus, size: f64) -> V {
        let mut at = || random.random_range(-size..size);
        V3::new(at(), at(), at())
    }

    #[test]
    fn free_edges_that_meet_fast_part_with_the_common_speed_at_their_cores() {
        let v = |x, y, z| V3::new(x, y, z);
        // Each moves as one, and they cross at their middles; each node has half the mass of its edge.
        let a = Edge { start: v(-0.005, 0.0, 1.5e-3), end: v(0.005, 0.0, 1.5e-3) };
        let b = Edge { start: v(0.0, -0.005, 0.0), end: v(0.0, 0.005, 0.0) };
        let seen = see(a, b, 2e-3);
        let contact = contact(1.0 / 180.0);
        for (heavy, speed) in [(1.0, 2.0), (3.0, 5.0)] {
            let (down, up) = (v(0.0, 0.0, -speed), v(0.0, 0.0, 0.0));
            let w = [200.0, 200.0, 200.0 / heavy, 200.0 / heavy];
            let moving = Moving { velocities: [down, down, up, up], w, counts: [1.0; 4] };
            let kick = kick(&seen, &moving, &mut none(), &contact);
            let (after_a, after_b) = (-speed + kick.z * 100.0, -kick.z * 100.0 / heavy);
            let left = (1.5e-3 - 7e-4) / contact.dt;
            assert!((after_b - after_a - left).abs() < 1e-9, "{after_a} {after_b}");
            // Each by its mass.
            let common = -speed / (1.0 + heavy);
            let expected = common - left * heavy / (1.0 + heavy);
            assert!((after_a - expected).abs() < 1e-9, "{after_a}, not {expected}");
        }
    }

    #[test]
    fn no_impulse_raises_the_energy_beyond_what_contact_has_stored() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut acted = 0;
        for _ in 0..3000 {
            let edge = |random: &mut Xoshiro256PlusPlus| Edge {
                start: random_vector(random, 2e-3),
                end: random_vector(random, 5e-3),
            };
            let (a, b) = (edge(&mut random), edge(&mut random));
            let seen = see(a, b, 2e-3);
            let contact = contact(1.0 / random.random_range(60.0..1000.0));
            let velocities = core::array::from_fn(|_| random_vector(&mut random, 0.5));
            let w: [f64; 4] = core::array::from_fn(|_| random.random_range(0.0..200.0));
            let moving = Moving { velocities, w, counts: [1.0; 4] };
            if acts(&seen, velocities, 1.0, &contact) == 0.0 {
                continue;
            }
            acted += 1;
            let impulse = kick(&seen, &moving, &mut none(), &contact);
            let parts = parts(seen.at);
            let energy = |v: [V; 4]| -> f64 { (0..4).map(|k| 0.5 * v[k].dot(v[k]) / w[k]).sum() };
            let mut after = velocities;
            for k in 0..4 {
                let sign = if k < 2 { 1.0 } else { -1.0 };
                after[k] = impulse.scale_add(sign * parts[k] * w[k], after[k]);
            }
            let stiff = contact.strength * seen.length / contact.reach;
            let deep = seen.overlap / seen.length.max(1e-12);
            let cores = (contact.core - seen.distance).max(0.0);
            // Cores that share a place part by a fifth of it.
            let parting = (CORE_RECOVERY * cores / contact.dt).powi(2);
            let light: f64 = (0..4).map(|k| parts[k] * parts[k] * w[k]).sum();
            let stored = 0.5 * stiff * deep * deep + 0.5 * parting / light.max(1e-9);
            let gained = energy(after) - energy(velocities);
            assert!(gained <= stored * (1.0 + 1e-9) + 1e-12, "{gained} of {stored}: {seen:?}");
        }
        assert!(acted > 500, "{acted}");
    }

    #[test]
    fn friction_holds_up_to_its_share_of_the_pressure_and_remembers_where() {
        let v = |x, y, z| V3::new(x, y, z);
        let contact = contact(1.0 / 180.0);
        let dt = contact.dt;
        // a lies on b, which is held, by its weight, and is pulled aside by a share of it.
        for (share, sticks) in [(0.19, true), (0.24, false)] {
            let (mut past, mut x, mut motion) = (none(), v(0.0, 0.0, 1.8e-3), v(0.0, 0.0, 0.0));
            let mut start = v(0.0, 0.0, 0.0);
            for step in 0..3000 {
                // It comes to rest first, and what begins at once slips until it has stuck again.
                if step == if sticks { 1500 } else { 1000 } {
                    start = x;
                }
                let half = v(0.005, 0.0, 0.0);
                let b = Edge { start: v(x.x, -0.005, 0.0), end: v(x.x, 0.005, 0.0) };
                let seen = see(Edge { start: x - half, end: x + half }, b, 2e-3);
                let still = v(0.0, 0.0, 0.0);
                let moving = Moving {
                    velocities: [motion, motion, still, still],
                    w: [2e4, 2e4, 0.0, 0.0],
                    counts: [1.0; 4],
                };
                let aside = if step < 1000 { 0.0 } else { share };
                let impulse = kick(&seen, &moving, &mut past, &contact);
                motion = impulse.scale_add(1e4, motion) + v(aside * 9.81 * dt, 0.0, -9.81 * dt);
                x = motion.scale_add(dt, x);
            }
            let (seconds, slid) = (2000.0 * dt, x.x - start.x);
            let free = 0.5 * (share - 0.2) * 9.81 * seconds * seconds;
            let fits = if sticks {
                slid.abs() < 1e-6 && motion.x.abs() < 1e-9
            } else {
                (slid / free - 1.0).abs() < 0.02
            };
            assert!(fits, "{share}: {slid} m, {} m/s, by theory {free}", motion.x);
        }
    }
}
