//! Mass-spring strands as mathematics: \[W\] equation 1, stepped without a limit to the step.
//!
//! Print's damper, c |v_b − v_a|, has no sign and feeds energy in; a true one acts on how fast the
//! spring gets longer. An explicit step of stiff springs blows up beyond √(2m/k), here 1 ms. So each
//! spring is solved for the end of the step, one after the other, on positions (compliant position
//! based dynamics): as explicit in cost, and the stiffer the spring the nearer to its length. What few
//! iterations leave undone cannot feed energy in either: a step that would end with more than it began
//! with is shortened, and its speeds with it.

use super::Springs;
use glam::Vec3;

/// Equation 1 on node b, the opposite on a: f = −k(|d| − l) u − c (ḋ·u) u, with d from a to b.
pub fn force(d: Vec3, rate: Vec3, length: f32, stiffness: f32, damping: f32) -> Vec3 {
    let distance = d.length();
    if distance < 1e-12 {
        return Vec3::ZERO;
    }
    let u = d / distance;
    u * (-stiffness * (distance - length) - damping * rate.dot(u))
}

/// A spring between two nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    a: usize,
    b: usize,
    length: f32,
    stiffness: f32,
    /// Force it holds, times dt² (m, per mass of a node).
    force: f32,
}

/// What a step needs beside the strand, kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct Scratch {
    springs: Vec<Spring>,
    from: Vec<Vec3>,
}

/// All springs of a strand: to the next node and to the next but one, straight at rest.
pub fn springs_of(lengths: &[f32], settings: &Springs) -> impl Iterator<Item = Spring> {
    (0..lengths.len()).flat_map(move |i| {
        let next =
            Spring { a: i, b: i + 1, length: lengths[i], stiffness: settings.stretch, force: 0.0 };
        let over = lengths.get(i + 1).map(|second| Spring {
            b: i + 2,
            length: lengths[i] + second,
            stiffness: settings.bend,
            ..next
        });
        core::iter::once(next).chain(over).filter(|s| s.stiffness > 0.0)
    })
}

/// One step: positions from velocities, springs and dampers, `push_out` (with the place before the
/// step), velocities from the change. `inverse_mass` 0 holds a node, which goes where its velocity
/// takes it. `gravity` (m/s²) is in the velocities already; it is asked for what it gave.
pub fn step(
    positions: &mut [Vec3],
    velocities: &mut [Vec3],
    lengths: &[f32],
    inverse_mass: impl Fn(usize) -> f32,
    settings: &Springs,
    gravity: Vec3,
    dt: f32,
    scratch: &mut Scratch,
    mut push_out: impl FnMut(Vec3, Vec3) -> Vec3,
) {
    let Scratch { springs, from } = scratch;
    from.clear();
    from.extend_from_slice(positions);
    springs.clear();
    springs.extend(springs_of(lengths, settings));
    let mut pushed = false;
    let moving = |i: usize, v: Vec3| match inverse_mass(i) {
        0.0 => 0.0,
        w => 0.5 * v.length_squared() / w,
    };
    let mut energy = stored(springs, positions);
    for (i, (p, v)) in positions.iter_mut().zip(&*velocities).enumerate() {
        *p += *v * dt;
        energy += moving(i, *v - gravity * dt);
        pushed |= inverse_mass(i) == 0.0 && *v != Vec3::ZERO;
    }
    for _ in 0..settings.iterations {
        for spring in springs.iter_mut() {
            let Spring { a, b, length, stiffness, .. } = *spring;
            let (wa, wb) = (inverse_mass(a), inverse_mass(b));
            let d = positions[b] - positions[a];
            let distance = d.length();
            if distance < 1e-12 || wa + wb == 0.0 {
                continue;
            }
            let u = d / distance;
            let compliance = 1.0 / (stiffness * dt * dt);
            let friction = settings.damping / (stiffness * dt);
            let moved = ((positions[b] - from[b]) - (positions[a] - from[a])).dot(u);
            let change = (length - distance - compliance * spring.force - friction * moved)
                / ((1.0 + friction) * (wa + wb) + compliance);
            spring.force += change;
            positions[a] -= u * (wa * change);
            positions[b] += u * (wb * change);
        }
        for (i, (p, from)) in positions.iter_mut().zip(&*from).enumerate() {
            if inverse_mass(i) > 0.0 {
                let out = push_out(*p, *from);
                pushed |= out != *p;
                *p = out;
            }
        }
    }
    // Whoever is pushed or held by something else may get energy from there.
    let budget = |positions: &[Vec3]| {
        let fallen = |(i, (p, from)): (usize, (&Vec3, &Vec3))| match inverse_mass(i) {
            0.0 => 0.0,
            w => gravity.dot(*p - *from) / w,
        };
        let fallen: f32 = positions.iter().zip(&*from).enumerate().map(fallen).sum();
        energy + fallen - stored(springs, positions)
    };
    let mut left = budget(positions);
    if !pushed {
        for _ in 0..8 {
            if left >= 0.0 {
                break;
            }
            for (p, from) in positions.iter_mut().zip(&*from) {
                *p = from.lerp(*p, 0.5);
            }
            left = budget(positions);
        }
        if left < 0.0 {
            positions.copy_from_slice(from);
        }
    }
    let mut speeds = 0.0;
    for (i, ((v, p), from)) in velocities.iter_mut().zip(&*positions).zip(&*from).enumerate() {
        *v = (*p - *from) / dt;
        speeds += moving(i, *v);
    }
    if !pushed && speeds > left {
        let slower = (left.max(0.0) / speeds.max(1e-30)).sqrt();
        velocities.iter_mut().for_each(|v| *v *= slower);
    }
}

/// What the springs store, per mass of a node (J/kg).
fn stored(springs: &[Spring], positions: &[Vec3]) -> f32 {
    let one = |s: &Spring| {
        let x = positions[s.a].distance(positions[s.b]) - s.length;
        0.5 * s.stiffness * x * x
    };
    springs.iter().map(one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn energy(p: &[Vec3], v: &[Vec3], lengths: &[f32], settings: &Springs, gravity: f32) -> f64 {
        let moving: f64 = v[1..].iter().map(|v| 0.5 * f64::from(v.length_squared())).sum();
        let height: f64 = p[1..].iter().map(|p| f64::from(gravity * p.y)).sum();
        let stretched: f64 = springs_of(lengths, settings)
            .map(|s| {
                let x = f64::from(p[s.a].distance(p[s.b]) - s.length);
                0.5 * f64::from(s.stiffness) * x * x
            })
            .sum();
        moving + height + stretched
    }

    #[test]
    fn the_printed_damper_feeds_energy_and_the_true_one_takes_it() {
        // A pair that closes in: the damper's power is f·ḋ.
        let (d, rate) = (Vec3::X, Vec3::X * -2.0);
        assert!(force(d, rate, 1.0, 10.0, 3.0).dot(rate) < 0.0);
        let printed = -d * (3.0 * rate.length());
        assert!(printed.dot(rate) > 0.0, "print pulls a closing pair together");
    }

    #[test]
    fn a_hanging_spring_stretches_by_its_load() {
        let settings = Springs { stretch: 1e5, ..Springs::default() };
        let (lengths, mut scratch) = ([0.03; 8], Scratch::default());
        let mut p: Vec<Vec3> = (0..9).map(|i| Vec3::NEG_Y * (0.03 * i as f32)).collect();
        let mut v = vec![Vec3::ZERO; 9];
        for _ in 0..3000 {
            v[1..].iter_mut().for_each(|v| *v = *v * 0.99 + Vec3::NEG_Y * (9.8 / 360.0));
            let w = |i: usize| if i == 0 { 0.0 } else { 1.0 };
            let g = Vec3::NEG_Y * 9.8;
            step(&mut p, &mut v, &lengths, w, &settings, g, 1.0 / 360.0, &mut scratch, |p, _| p);
        }
        // Eight masses hang on the first spring; the long ones beside it carry a tenth of it.
        let stretch = p[0].distance(p[1]) - 0.03;
        let expected = 8.0 * 9.8 / 1e5;
        assert!(stretch > 0.7 * expected && stretch < expected, "{stretch} {expected}");
        assert!(v.iter().all(|v| v.length() < 1e-2));
    }

    #[test]
    fn a_swing_at_sixty_hertz_never_rises_above_its_start() {
        for stretch in [1e4, 1e6, 1e9] {
            let settings = Springs { stretch, damping: 0.0, ..Springs::default() };
            let (lengths, mut scratch) = ([0.03; 8], Scratch::default());
            let mut p: Vec<Vec3> = (0..9).map(|i| Vec3::X * (0.03 * i as f32)).collect();
            let mut v = vec![Vec3::ZERO; 9];
            let mut lowest = 0.0_f32;
            for i in 0..1200 {
                v[1..].iter_mut().for_each(|v| v.y -= 9.8 / 60.0);
                let w = |i: usize| if i == 0 { 0.0 } else { 1.0 };
                let g = Vec3::NEG_Y * 9.8;
                step(&mut p, &mut v, &lengths, w, &settings, g, 1.0 / 60.0, &mut scratch, |p, _| p);
                let now = energy(&p, &v, &lengths, &settings, 9.8);
                // It falls by 10.6 J/kg.
                assert!(now < 0.01, "{stretch} {i}: {now}");
                lowest = lowest.min(p[8].y);
            }
            assert!(lowest < -0.2, "it swings: {lowest}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]
        #[test]
        fn energy_never_grows_without_input(
            shape in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), 12),
            speeds in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), 12),
            rate in prop_oneof![Just(60.0f32), Just(120.0), Just(360.0)],
            stretch in 3.0f32..8.0,
            bend in 0.0f32..7.0,
            damping in 0.0f32..100.0,
        ) {
            let settings = Springs {
                stretch: 10f32.powf(stretch), bend: 10f32.powf(bend), damping, ..Springs::default()
            };
            let lengths = [0.03f32; 11];
            let vector = |&(x, y, z): &(f32, f32, f32)| Vec3::new(x, y, z);
            let mut at = Vec3::ZERO;
            let mut p: Vec<Vec3> = shape.iter().map(|s| {
                let here = at;
                at += (vector(s) + Vec3::NEG_Y * 1.1).normalize() * 0.031;
                here
            }).collect();
            let mut v: Vec<Vec3> = speeds.iter().map(vector).collect();
            v[0] = Vec3::ZERO;
            let mut scratch = Scratch::default();
            let mut before = energy(&p, &v, &lengths, &settings, 0.0);
            let scale = before.abs().max(1.0);
            for i in 0..240 {
                let w = |i: usize| if i == 0 { 0.0 } else { 1.0 };
                step(&mut p, &mut v, &lengths, w, &settings, Vec3::ZERO, 1.0 / rate, &mut scratch, |p, _| p);
                let now = energy(&p, &v, &lengths, &settings, 0.0);
                prop_assert!(now <= before + 1e-3 * scale, "step {i}: {before} to {now}");
                before = now;
            }
        }
    }
}
