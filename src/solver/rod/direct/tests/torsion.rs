//! Joints that resist twist less than bending: the moment, its derivatives, and that what they hold comes to rest.

use super::{
    super::frames::{moment, twist_stiffness},
    *,
};

const RATIOS: [f32; 3] = [1.0, 0.46, 0.18];

/// A joint: frames before and after it, and its rest shape.
#[derive(Clone, Copy)]
struct Joint {
    before: DQuat,
    q: DQuat,
    rest: DQuat,
}

fn plain(q: DQuat) -> Quaternion<f64> {
    Quaternion::new(V3::new(q.x, q.y, q.z), q.w)
}

impl Joint {
    /// Of many: bent and twisted, also in its rest shape, up to about 2 rad.
    fn some(k: u32) -> Self {
        let wave = |rate: f64| (rate * f64::from(k) + rate).sin();
        let turn = |a: f64, b: f64, c: f64, most: f64| {
            DQuat::from_scaled_axis(most * DVec3::new(wave(a), wave(b), wave(c)))
        };
        let before = turn(1.3, 2.7, 0.9, 3.0);
        let rest = turn(0.7, 1.9, 2.3, 0.6);
        let q = before * rest * turn(3.1, 1.7, 0.3, 0.6);
        Self { before, q: if k.is_multiple_of(3) { -q } else { q }, rest }
    }

    /// Over K, as the docs of the moment say.
    fn energy(&self, torsion: f64) -> f64 {
        let now = self.before.inverse() * self.q;
        let rest = if now.dot(self.rest) < 0.0 { -self.rest } else { self.rest };
        let both = now.w.hypot(now.z) * rest.w.hypot(rest.z);
        let bends = now.x * rest.x + now.y * rest.y;
        let twists = now.w * rest.w + now.z * rest.z;
        4.0 * (1.0 - both - bends) + 4.0 * torsion * (both - twists)
    }

    fn moment(&self, torsion: f32) -> DVec3 {
        let w = Single::<f64>::default();
        let [before, q, rest] = [self.before, self.q, self.rest].map(plain);
        let m = moment(w, before, q, rest, 1.0, &Torsion::new(1.0_f64, torsion));
        DVec3::new(m.x, m.y, m.z)
    }

    fn turned(&self, before: DVec3, q: DVec3) -> Self {
        let [before, q] = [before, q].map(DQuat::from_scaled_axis);
        Self { before: before * self.before, q: q * self.q, rest: self.rest }
    }
}

#[test]
fn the_moment_is_the_gradient_of_the_energy() {
    const H: f64 = 1e-5;
    for (k, torsion) in (0..300).flat_map(|k| RATIOS.map(|ratio| (k, ratio))) {
        let (joint, c) = (Joint::some(k), f64::from(torsion));
        let m = joint.moment(torsion);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let slope = |a: Joint, b: Joint| (a.energy(c) - b.energy(c)) / (2.0 * H);
            let none = DVec3::ZERO;
            let behind = slope(joint.turned(none, axis * H), joint.turned(none, axis * -H));
            let ahead = slope(joint.turned(axis * H, none), joint.turned(axis * -H, none));
            assert!((behind - m.dot(axis)).abs() < 1e-8, "{k}, {torsion}: {behind}, {m}");
            assert!((ahead + m.dot(axis)).abs() < 1e-8, "{k}, {torsion}: {ahead}, {m}");
        }
        // Bends and twists do not couple: what rests in its plane does not unwind.
        let flat = Joint { q: joint.before * joint.rest, ..joint };
        assert!(flat.moment(torsion).length() < 1e-9 && flat.energy(c).abs() < 1e-9);
    }
}

/// Pure bends resist with 2K sin(θ/2), pure twists with 2CK sin(τ/2).
#[test]
fn bends_and_twists_resist_each_in_their_own_measure() {
    for (k, torsion) in (0..40).flat_map(|k| RATIOS.map(|ratio| (k, ratio))) {
        let angle = 0.07 * f64::from(k);
        let before = Joint::some(k).before;
        for (axis, stiff) in [(DVec3::X, 1.0), (DVec3::Z, f64::from(torsion))] {
            let q = before * DQuat::from_scaled_axis(axis * angle);
            let m = Joint { before, q, rest: DQuat::IDENTITY }.moment(torsion);
            let expected = before * axis * (2.0 * stiff * (0.5 * angle).sin());
            assert!(m.distance(expected) < 1e-9, "{angle} about {axis}: {m}, {expected}");
        }
    }
}

/// The second derivatives for the tridiagonal solve of twist.
#[test]
fn twist_stiffness_is_exact_at_rest_and_an_upper_bound_elsewhere() {
    const H: f64 = 1e-4;
    for (k, torsion) in (0..300).flat_map(|k| RATIOS.map(|ratio| (k, ratio))) {
        let some = Joint::some(k);
        for joint in [some, Joint { q: some.before * some.rest, ..some }] {
            let is_at_rest = joint.q != some.q;
            let [before, q, rest] = [joint.before, joint.q, joint.rest].map(plain);
            let stiff = twist_stiffness(before, q, rest, &Torsion::new(1.0_f64, torsion));
            let [t, u] = [joint.before, joint.q].map(|q| q * DVec3::Z);
            // About the tangents, by a and b; the frame's own axis stays.
            let energy = |a: f64, b: f64| joint.turned(t * a, u * b).energy(f64::from(torsion));
            let second = |a: f64, b: f64| {
                (energy(a * H, b * H) + energy(-a * H, -b * H) - 2.0 * energy(0.0, 0.0)) / (H * H)
            };
            for (a, b) in [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, -1.0), (0.3, 0.8)] {
                let given = stiff.0 * (a * a + b * b) + 2.0 * stiff.1 * a * b;
                let found = second(a, b);
                assert!(found < given + 1e-6, "{k}, {torsion}: {found}, {given}");
                assert!(!is_at_rest || found > given - 1e-6, "{k}, {torsion}: {found}, {given}");
            }
        }
    }
}

/// Curls of many turns, with their roots down and level, in thick air: at any ratio they come to rest.
#[test]
fn curls_come_to_rest_at_any_ratio() {
    for torsion in RATIOS {
        for (gamma, edges, level) in [
            (10.0, 32, false),
            (20.0, 32, false),
            (60.0, 64, false),
            (20.0, 32, true),
            (60.0, 64, true),
        ] {
            let length = 0.12_f32;
            let way = if level { Vec3::X } else { Vec3::NEG_Y };
            let mut block = strands(edges, |lane, i| {
                let s = i as f32 / edges as f32;
                way * (length * s) + Vec3::Z * (1e-3 * length * s * s * (1 + lane % 2) as f32)
            });
            for lane in 0..LANES {
                let turns = 3.0 + lane as f32;
                let frame = take4(&block.root, lane);
                // Up, or aside.
                let axis = frame.inverse() * Vec3::Z;
                for (i, edge) in block.edges.iter_mut().enumerate() {
                    let share = if i == 0 { 0.5 } else { 1.0 };
                    let bend = Quat::from_axis_angle(axis, turns * share / edges as f32);
                    put4(&mut edge.rest, lane, bend);
                }
            }
            let params = DirectParams { torsion, dt: 1.0 / 180.0, damping: 0.01, ..params() };
            for k in 0..2400 {
                prepare_for(&mut block, length / f32::cbrt(gamma), &params);
                let retained = if k < 1800 { 0.96 } else { 0.99 };
                block.nodes.iter_mut().for_each(|n| n.v = n.v.map(|v| v.map(|v| retained * v)));
                step(Level::new(), &mut block, &params, &[]);
            }
            for lane in 0..LANES {
                let speeds = block.nodes.iter().map(|n| take3(&n.v, lane).length());
                let fastest = speeds.fold(0.0, f32::max);
                let turns = 3 + lane;
                // 2.0 mm/s at worst, where a curl of 13 rad still relaxes.
                assert!(
                    fastest < 4e-3,
                    "C {torsion}, {gamma}, {level}, {turns} rad: {fastest} m/s"
                );
            }
        }
    }
}
