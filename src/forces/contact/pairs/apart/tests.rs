//! Tests of strands that are driven at each other.

use super::{super::state::PairNode, *};
use glam::DVec3;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// A strand that bends freely, and keeps its lengths.
#[derive(Clone)]
struct Rope {
    places: Vec<Vec3>,
    velocities: Vec<Vec3>,
    is_held: bool,
}

const NODES: usize = 16;
const EDGE: f32 = 0.01;

impl Rope {
    fn new(middle: Vec3, along: Vec3, velocity: Vec3) -> Self {
        let place = |k: usize| middle + along * (EDGE * (k as f32 - 7.5));
        let places = (0..NODES).map(place).collect();
        Self { places, velocities: vec![velocity; NODES], is_held: false }
    }

    fn held(self) -> Self {
        Self { is_held: true, ..self }
    }

    fn mass(&self, k: usize) -> f32 {
        match k {
            _ if self.is_held => 0.0,
            _ if k == 0 || k == NODES - 1 => 0.5 * EDGE,
            _ => EDGE,
        }
    }

    fn middle(&self) -> Vec3 {
        let sum: Vec3 = (0..NODES).map(|k| self.places[k] * self.mass(k)).sum();
        sum / (EDGE * (NODES - 1) as f32)
    }
}

/// Whether two edges that move steadily from their first to their second places pass each other, by the roots of their
/// coplanarity.
fn pass(a: [[Vec3; 2]; 2], b: [[Vec3; 2]; 2]) -> bool {
    let at = |e: [[Vec3; 2]; 2], t: f64| -> [DVec3; 2] {
        [0, 1].map(|k| e[0][k].as_dvec3().lerp(e[1][k].as_dvec3(), t))
    };
    let volume = |t: f64| {
        let (a, b) = (at(a, t), at(b, t));
        (b[0] - a[0]).dot((a[1] - a[0]).cross(b[1] - b[0]))
    };
    let meet = |t: f64| {
        let ([a0, a1], [b0, b1]) = (at(a, t), at(b, t));
        let (u, v, r) = (a1 - a0, b1 - b0, a0 - b0);
        let det = u.dot(u) * v.dot(v) - u.dot(v).powi(2);
        let s = (u.dot(v) * v.dot(r) - u.dot(r) * v.dot(v)) / det;
        let t = (u.dot(u) * v.dot(r) - u.dot(v) * u.dot(r)) / det;
        (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t)
    };
    let samples = 64;
    (0..samples).any(|k| {
        let [mut low, mut high] = [k, k + 1].map(|k| f64::from(k) / f64::from(samples));
        if volume(low) * volume(high) > 0.0 {
            return false;
        }
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if volume(low) * volume(middle) > 0.0 { low = middle } else { high = middle }
        }
        meet(low)
    })
}

struct Crossing {
    passed: bool,
    /// Of momentum, over that of a rope.
    error: f64,
    strain: f32,
    /// The largest gain of kinetic energy in a substep, over that at the start.
    gain: f64,
}

const CONTACT: Contact<f32> = Contact {
    reach: 2e-3,
    core: 7e-4,
    strength: 20.0,
    friction: 0.2,
    cohesion: 0.0,
    dt: 1.0 / 180.0,
};

/// Steps ropes under gravity.
fn step(pairs: &mut Pairs, ropes: &mut [Rope], contact: Contact<f32>, gravity: Vec3) {
    let dt = contact.dt;
    pairs.clear();
    for rope in &*ropes {
        let nodes = rope.places.iter().zip(&rope.velocities).enumerate();
        let node = |(k, (p, v)): (usize, (&Vec3, &Vec3))| PairNode {
            place: *p,
            velocity: *v,
            mass: rope.mass(k),
        };
        pairs.add(&rope.places, 1, nodes.map(node));
    }
    pairs.find(contact);
    let (mut ends, mut lengths, mut kicks) = (Vec::new(), Vec::new(), pairs.kicks.iter());
    for rope in &mut *ropes {
        let own = ends.len();
        for k in 0..rope.places.len() {
            let mass = rope.mass(k);
            let w = if mass > 0.0 { 1.0 / mass } else { 0.0 };
            rope.velocities[k] += kicks.next().unwrap();
            if mass > 0.0 {
                rope.velocities[k] += gravity * dt;
            }
            ends.push((rope.places[k] + rope.velocities[k] * dt).extend(w).to_array());
            lengths.push(EDGE);
        }
        (0..4).for_each(|_| limit_lengths(&mut ends[own..], &lengths[own..]));
    }
    pairs.keep_apart(&mut ends, &lengths, &contact, |_, p| p);
    let mut ends = ends.iter();
    for rope in ropes {
        for (p, v) in rope.places.iter_mut().zip(&mut rope.velocities) {
            let end = place(ends.next().unwrap());
            *v = (end - *p) / dt;
            *p = end;
        }
    }
}

fn cross(ropes: &mut [Rope; 2], seconds: f32) -> Crossing {
    let contact = Contact { cohesion: 0.2, ..CONTACT };
    let momentum = |ropes: &[Rope; 2]| -> DVec3 {
        let of = |rope: &Rope| -> DVec3 {
            let each = rope.velocities.iter().enumerate();
            each.map(|(k, v)| v.as_dvec3() * f64::from(rope.mass(k))).sum()
        };
        of(&ropes[0]) + of(&ropes[1])
    };
    let energy = |ropes: &[Rope; 2]| -> f64 {
        let each = ropes
            .iter()
            .flat_map(|rope| rope.velocities.iter().enumerate().map(|(k, v)| (rope.mass(k), v)));
        each.map(|(mass, v)| 0.5 * f64::from(mass) * v.as_dvec3().length_squared()).sum()
    };
    let (before, first) = (momentum(ropes), energy(ropes));
    let of_one = (2.0 * first * 0.15 / 2.0).sqrt();
    let mut pairs = Pairs::default();
    let mut result = Crossing { passed: false, error: 0.0, strain: 0.0, gain: 0.0 };
    for _ in 0..(seconds / contact.dt) as usize {
        let (last, starts) = (energy(ropes), ropes.clone());
        step(&mut pairs, ropes, contact, Vec3::ZERO);
        for rope in &*ropes {
            let strains = rope.places.windows(2).map(|w| (w[0].distance(w[1]) / EDGE - 1.0).abs());
            result.strain = strains.fold(result.strain, f32::max);
        }
        let edge = |rope: usize, k: usize| {
            [&starts[rope], &ropes[rope]].map(|r| [r.places[k], r.places[k + 1]])
        };
        let nodes = 0..NODES - 1;
        result.passed |= nodes.clone().any(|i| nodes.clone().any(|j| pass(edge(0, i), edge(1, j))));
        result.gain = result.gain.max((energy(ropes) - last) / first);
    }
    result.error = (momentum(ropes) - before).length() / of_one;
    result
}

fn random_crossing(random: &mut Xoshiro256PlusPlus, speed: f32) -> [Rope; 2] {
    let mut vector =
        |size: f32| Vec3::from_array(core::array::from_fn(|_| random.random_range(-size..size)));
    let (a, b) = (vector(1.0).normalize(), vector(1.0).normalize());
    let across = a.cross(b).normalize();
    let middle = 0.004 * across + a * 0.03 * vector(1.0).x + b * 0.03 * vector(1.0).y;
    [
        Rope::new(0.5 * middle, a, -0.5 * speed * across),
        Rope::new(-0.5 * middle, b, 0.5 * speed * across),
    ]
}

#[test]
fn strands_that_are_driven_at_each_other_do_not_pass() {
    for speed in [0.1, 0.5, 2.0, 5.0, 8.0] {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
        let (mut passed, mut error, mut strain, mut gain) = (0, 0.0f64, 0.0f32, 0.0f64);
        for _ in 0..100 {
            let mut ropes = random_crossing(&mut random, speed);
            let seconds = (0.02 / speed).clamp(0.02, 0.1);
            let result = cross(&mut ropes, seconds);
            passed += usize::from(result.passed);
            error = error.max(result.error);
            strain = strain.max(result.strain);
            gain = gain.max(result.gain);
        }
        println!(
            "{speed} m/s: {passed} pass, momentum {error:.1e}, strain {strain:.4}, gain {gain:.1e}"
        );
        assert_eq!(passed, 0, "at {speed} m/s");
        assert!(error < 1e-4 && strain < 1e-3, "at {speed} m/s: {error}, {strain}");
    }
}

#[test]
fn a_strand_on_others_stays_below_the_angle_of_friction_and_slides_above() {
    for (share, seconds) in [(0.5, 5.0), (0.94, 5.0), (1.06, 0.5), (1.5, 0.2)] {
        let tan: f32 = share * CONTACT.friction;
        let (sin, cos) = (tan / (1.0 + tan * tan).sqrt(), 1.0 / (1.0 + tan * tan).sqrt());
        // Rails across, on which a strand slides along itself.
        let mut ropes: Vec<Rope> = (-40..90)
            .map(|k| Rope::new(Vec3::X * (2.5e-3 * k as f32), Vec3::Y, Vec3::ZERO).held())
            .collect();
        ropes.push(Rope::new(Vec3::new(0.0, 1e-4, 1.9e-3), Vec3::X, Vec3::ZERO));
        let contact = Contact { strength: 200.0, ..CONTACT };
        let mut pairs = Pairs::default();
        let count = |seconds: f32| (seconds / CONTACT.dt) as usize;
        let down = 9.81 * Vec3::NEG_Z;
        (0..count(2.0)).for_each(|_| step(&mut pairs, &mut ropes, contact, down));
        let gravity = 9.81 * Vec3::new(sin, 0.0, -cos);
        // What begins at once slips until it has stuck again.
        (0..count(0.3)).for_each(|_| step(&mut pairs, &mut ropes, contact, gravity));
        let at = |ropes: &[Rope]| ropes.last().unwrap().middle().x;
        let from = at(&ropes);
        (0..count(seconds)).for_each(|_| step(&mut pairs, &mut ropes, contact, gravity));
        let way = at(&ropes) - from;
        println!("{share}: {:.4} mm in {seconds} s", 1e3 * way);
        let fits = if share < 1.0 { way.abs() < 2e-5 } else { way > 5e-3 };
        assert!(fits, "at {share} of the angle of friction it went {way} m in {seconds} s");
    }
}
