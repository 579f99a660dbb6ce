//! Hair that lies on things, and lands on them.

use super::lab::*;
use bevy::prelude::*;
use bevy_keratin::prelude::*;

const HERTZ: [f64; 5] = [60.0, 120.0, 144.0, 240.0, 1000.0];

/// Sixteen strands that are let go level above a ball, with more on its far side than on the near one.
struct Drape {
    lab: Lab,
    strands: Vec<Entity>,
}

impl Drape {
    /// In air that takes this share of velocities a second while they fall.
    fn new(hertz: f64, friction: f32, drag: f32) -> Self {
        let mut lab = Lab::new(hertz, 6);
        lab.app.insert_resource(HairDefault(HairSolver::default()));
        let ball = HairCollider::sphere(0.06).unwrap().with_friction(friction).unwrap();
        lab.app.world_mut().spawn((ball, Transform::from_xyz(0.0, -0.062, 0.01)));
        let strands: Vec<Entity> = (0..16)
            .map(|k| {
                let (x, z) = (0.07 + 1e-3 * (k * 7 % 16) as f32, 2e-3 + 1.2e-3 * k as f32);
                let aside = Vec3::new(-x, 0.0, z);
                let points = line(0.24, 24, Vec3::X).into_iter().map(|p| p + aside);
                lab.strand(0.02, &points.collect::<Vec<_>>())
            })
            .collect();
        lab.drag(drag);
        lab.run(6.0);
        lab.drag(0.0);
        Self { lab, strands }
    }

    fn places(&self) -> Vec<Vec<Vec3>> {
        self.strands.iter().map(|s| self.lab.get(*s).positions().to_vec()).collect()
    }

    /// How far each strand that still lies has moved within a time (s): by its farthest node (m), the least first.
    fn creep(&mut self, seconds: f64) -> Vec<f32> {
        let before = self.places();
        self.lab.run(seconds);
        let moved = self.strands.iter().zip(&before).map(|(strand, before)| {
            let after = self.lab.get(*strand);
            assert!(after.peak_strain() < 1e-3, "strain {}", after.peak_strain());
            farthest(after.positions(), before)
        });
        let lying = moved.zip(&self.strands).filter(|(_, strand)| self.lab.tip(**strand).x > 0.0);
        let mut moved: Vec<f32> = lying.map(|(moved, _)| moved).collect();
        moved.sort_by(f32::total_cmp);
        moved
    }
}

fn farthest(places: &[Vec3], others: &[Vec3]) -> f32 {
    places.iter().zip(others).map(|(p, q)| p.distance(*q)).fold(0.0, f32::max)
}

/// Friction holds against the tension of what hangs on, and what it holds does not creep.
#[test]
fn hair_across_a_ball_stays_where_it_lies() {
    for hertz in [60.0, 144.0] {
        stays(hertz, 20.0);
    }
}

#[test]
#[ignore = "takes minutes"]
fn hair_across_a_ball_stays_where_it_lies_at_any_rate() {
    for hertz in HERTZ {
        stays(hertz, 60.0);
    }
}

fn stays(hertz: f64, seconds: f64) {
    let [moved, without] =
        [0.5, 0.0].map(|friction| Drape::new(hertz, friction, 8.0).creep(seconds));
    let lie = moved.len();
    println!("{hertz} Hz: {lie} of 16 lie, {} without friction; moved {moved:?} m", without.len());
    // One falls at the edge of what friction holds.
    assert!(lie >= 15 && without.is_empty(), "{hertz} Hz: {lie} lie, {without:?} without friction");
    assert!(moved[lie - 1] < 2e-5, "{hertz} Hz: crept {moved:?} m");
}

/// Where hair comes to lie depends on how it got there, as friction does, but hardly on the rate of ticks.
#[test]
#[ignore = "takes a minute"]
fn hair_comes_to_lie_in_one_place_at_any_rate() {
    for (how, drag) in [("laid down", 40.0), ("dropped", 8.0)] {
        let all = HERTZ.map(|hertz| Drape::new(hertz, 0.5, drag).places());
        for (hertz, places) in HERTZ.iter().zip(&all) {
            let off = places.iter().zip(&all[4]).map(|(p, q)| farthest(p, q));
            let mut off: Vec<f32> = off.collect();
            off.sort_by(f32::total_cmp);
            println!("{how} at {hertz} Hz: {off:?} m from 1000 Hz");
            assert!(off[7] < 3e-3 && off[15] < 1e-2, "{how} at {hertz} Hz: {off:?} m off");
        }
    }
}

/// A head that turns takes what lies on it along.
#[test]
fn a_ball_that_turns_takes_its_hair_along() {
    let mut drape = Drape::new(60.0, 0.5, 8.0);
    let before = drape.places();
    let world = drape.lab.app.world_mut();
    let middle = Vec3::new(0.0, -0.062, 0.01);
    let mut turned =
        world.query_filtered::<(Entity, &Transform), Or<(With<Hair>, With<HairCollider>)>>();
    let turned: Vec<(Entity, Transform)> =
        turned.iter(world).map(|(id, place)| (id, *place)).collect();
    let (mut rate, mut angle) = (0.0_f32, 0.0);
    for _ in 0..240 {
        // Half a second to get going.
        rate = (rate + 0.5 / 30.0).min(0.5);
        angle += rate / 60.0;
        let turn = Quat::from_rotation_y(angle);
        for (id, place) in &turned {
            let translation = middle + turn * (place.translation - middle);
            *drape.lab.app.world_mut().get_mut::<Transform>(*id).unwrap() =
                Transform { translation, rotation: turn * place.rotation, ..*place };
        }
        drape.lab.app.update();
    }
    // In the frame that turns.
    let mut off: Vec<f32> =
        drape.places().iter().zip(&before).map(|(now, before)| farthest(now, before)).collect();
    off.sort_by(f32::total_cmp);
    println!("carried along but for {off:?} m");
    // What hangs free is 0.4 mm farther out; three of the sixteen slip.
    assert!(off[7] < 1.5e-3 && off[12] < 5e-3, "slipped by {off:?} m");
}

/// What lands loses energy, at any number of segments.
#[test]
#[ignore = "not reached: fine segments of stiff hair gain energy where they land tip first"]
fn landing_gains_no_energy() {
    const LENGTH: f32 = 0.2;
    let mut wrong = Vec::new();
    for (substep, mut lab) in Lab::both() {
        lab.undamped();
        let floor = HairCollider::plane(Dir3::Y).with_friction(0.3).unwrap();
        lab.app.world_mut().spawn((floor, Transform::from_xyz(0.0, -0.1, 0.0)));
        let cases: Vec<(f32, usize)> = [0.02, 0.06, 0.13]
            .into_iter()
            .flat_map(|bending| [8, 16, 32, 64].map(|n| (bending, n)))
            .collect();
        let strands: Vec<Entity> = (cases.iter())
            .map(|(bending, n)| lab.straight(*bending, LENGTH, *n, Vec3::X))
            .collect();
        let probes = (strands.iter().zip(&cases)).map(|(strand, (bending, _))| {
            let bending = f64::from(*bending);
            (*strand, Box::new(move |s: &Strand| energy(s, bending)) as Probe)
        });
        let probes = probes.collect();
        for ((bending, n), energies) in cases.iter().zip(lab.record(3.0, probes)) {
            let (mut least, mut rise) = (energies[0], 0.0_f64);
            for energy in &energies[1..] {
                rise = rise.max(energy - least);
                least = least.min(*energy);
            }
            let share = rise / (9.8 * f64::from(LENGTH * LENGTH));
            println!("{substep}, L_g {bending}, {n} segments: energy rises by {share:.1e} g L²");
            if share.is_nan() || share > 1e-4 {
                wrong.push((substep, *bending, *n, share));
            }
        }
    }
    assert!(wrong.is_empty(), "substep, L_g, segments, rise in g L²: {wrong:#?}");
}
