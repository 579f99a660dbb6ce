//! Twist: a strand whose tip is turned by a crank.
//!
//! Beyond the clamped tip the strand goes on as an arm across, at rest with that corner. Its nodes
//! are held and moved round the axis, so the corner turns the strand, as a handle does.

use super::{TORSION, lab::*, theory::*};
use bevy::prelude::*;
use bevy_keratin::{HairStep, prelude::*};

/// Length (m) and edges that are free; then one on the axis and one across, both held.
const SPAN: f32 = 0.24;
const FREE: usize = 32;
const EDGE: f32 = SPAN / FREE as f32;

/// What stiff hair twists quickly enough not to swing much (m).
const BENDING_LENGTH: f32 = 0.3;

/// From the root's clamp to the middle of the held edge, which is the tip's (m).
const CLAMPED: f64 = (FREE as f64 + 0.5) * EDGE as f64;

#[derive(Resource)]
struct Crank {
    strand: Entity,
    angle: f64,
    /// How fast it turns (rad/s).
    rate: f64,
    /// Where on the axis the tip is; `None`: it is free to come closer.
    tip: Option<f32>,
}

/// A tip that is free to come closer along the axis has no tension but what the corner needs.
fn turn(
    step: Res<HairStep>,
    mut crank: ResMut<Crank>,
    mut strands: Query<(&Strand, &mut HeldNodes)>,
) {
    crank.angle += crank.rate * f64::from(step.dt);
    let (strand, mut held) = strands.get_mut(crank.strand).unwrap();
    let free = &strand.positions()[..=FREE];
    let along: f64 = free.windows(2).map(|p| f64::from(EDGE * (p[1] - p[0]).normalize().x)).sum();
    let at = free[FREE].x;
    let tip = Vec3::X * crank.tip.map_or(along as f32, |tip| at + (tip - at).clamp(-1e-4, 1e-4));
    let (sine, cosine) = crank.angle.sin_cos();
    let arm = Vec3::new(0.0, cosine as f32, sine as f32) * EDGE;
    let corner = tip + Vec3::X * EDGE;
    held.targets = vec![None; FREE];
    held.targets.extend([tip, corner, corner + arm].map(Some));
}

struct Cranked {
    lab: Lab,
    strand: Entity,
}

impl Cranked {
    fn new(mut lab: Lab) -> Self {
        // It would only slow down how the strand bows.
        lab.undamped();
        lab.torsion(TORSION);
        lab.gravity(Vec3::ZERO);
        let mut points = line(SPAN + EDGE, FREE + 1, Vec3::X);
        points.push(Vec3::new(SPAN + EDGE, EDGE, 0.0));
        let strand = lab.strand(BENDING_LENGTH, &points);
        lab.app.world_mut().entity_mut(strand).insert(HeldNodes::default());
        lab.app
            .insert_resource(Crank { strand, angle: 0.0, rate: 0.0, tip: None })
            .add_systems(HairTick, turn.in_set(HairSystems::First));
        lab.drag(2.0);
        Self { lab, strand }
    }

    fn turn(&mut self, rate: f64) {
        self.lab.app.world_mut().resource_mut::<Crank>().rate = rate;
    }

    fn move_tip(&mut self, to: f32) {
        self.lab.app.world_mut().resource_mut::<Crank>().tip = Some(to);
    }

    /// Twist of the joints between free edges, and the half cells' at the ends twice (rad).
    fn twists(&self) -> Vec<f64> {
        let strand = self.lab.get(self.strand);
        let twist = |j: usize| 2.0 * f64::from(strand.darboux(j).z).asin();
        (0..=FREE).map(|j| if j == 0 { 2.0 * twist(j) } else { twist(j) }).collect()
    }

    /// M L / E I of the mean twist.
    fn moment(&self) -> f64 {
        let twists = self.twists();
        let rate = twists.iter().sum::<f64>() / twists.len() as f64 / f64::from(EDGE);
        TORSION * rate * CLAMPED
    }

    /// How far the strand has left its axis, as a share of its length.
    fn bow(&self) -> f64 {
        let away = |p: &Vec3| f64::from(p.yz().length());
        self.lab.get(self.strand).positions()[..FREE].iter().map(away).fold(0.0, f64::max) / CLAMPED
    }
}

#[test]
fn twist_is_uniform_and_stays() {
    Lab::both().into_iter().for_each(|(substep, lab)| keep_twist(substep, lab));
}

fn keep_twist(substep: &str, lab: Lab) {
    let mut cranked = Cranked::new(lab);
    // Half of what buckles it, in two seconds.
    cranked.turn(0.25 * twist::buckling() / TORSION);
    cranked.lab.run(2.0);
    cranked.turn(0.0);
    cranked.lab.run(1.0);
    let twists = cranked.twists();
    let whole: f64 = twists.iter().sum();
    let mean = whole / twists.len() as f64;
    println!("{substep}: M L / E I {:.3}, twists {twists:.4?}", cranked.moment());
    assert!((0.4..0.55).contains(&(cranked.moment() / twist::buckling())), "{mean} a joint");
    for (j, twist) in twists.iter().enumerate() {
        assert!((twist / mean - 1.0).abs() < 0.01, "joint {j} is twisted by {twist}, mean {mean}");
    }
    // Let loose, whirled about and drawn out again, it is twisted as before: nothing of it leaks away.
    cranked.move_tip(0.95 * SPAN);
    cranked.lab.gravity(Vec3::new(0.0, -30.0, 10.0));
    cranked.lab.run(1.0);
    assert!(cranked.bow() > 0.1, "{}", cranked.bow());
    cranked.lab.gravity(Vec3::ZERO);
    cranked.move_tip(SPAN);
    cranked.lab.settle(4.0);
    assert!(cranked.bow() < 0.01, "{}", cranked.bow());
    let left = cranked.twists().iter().sum::<f64>();
    println!("{substep}: {left} is left of {whole}");
    assert!((left / whole - 1.0).abs() < 0.01, "{left} is left of {whole}");
}

#[test]
fn a_twisted_strand_buckles_as_michell_says() {
    Lab::both().into_iter().for_each(|(substep, lab)| buckle(substep, lab));
}

fn buckle(substep: &str, lab: Lab) {
    let mut cranked = Cranked::new(lab);
    // A breath across makes it choose a side.
    cranked.lab.gravity(Vec3::Y * 0.2);
    let buckling = twist::buckling();
    let mut reached = 0.0_f64;
    cranked.turn(0.5 * buckling / TORSION);
    while cranked.bow() < 0.01 {
        cranked.lab.run(1.0 / 60.0);
        reached = reached.max(cranked.moment());
        if reached > 0.8 * buckling {
            cranked.turn(0.1 * buckling / TORSION);
        }
        assert!(reached < 1.3 * buckling, "it does not buckle at M L / E I = {reached}");
        let angle = cranked.lab.app.world().resource::<Crank>().angle;
        assert!(angle < 2.0 * buckling / TORSION, "no twist at {angle} rad, only {reached}");
    }
    println!("{substep}: buckles at M L / E I = {reached:.3}, theory {buckling:.3}");
    assert!((reached / buckling - 1.0).abs() < 0.1, "{reached}, theory {buckling}");
}

/// The strand is straight between two clamps whose orientations differ by an angle about it, and by a tilt that an edge
/// between two held nodes cannot have.
#[test]
fn a_clamped_frame_twists_what_lies_between() {
    for angle in [0.0, 1.2, -2.0] {
        let mut lab = Lab::usual();
        lab.torsion(TORSION);
        lab.gravity(Vec3::ZERO);
        let points = line(SPAN + EDGE, FREE + 1, Vec3::X);
        let strand = lab.strand(BENDING_LENGTH, &points);
        let targets = points.iter().map(|p| (p.x > SPAN - 0.5 * EDGE).then_some(*p)).collect();
        let tilt = Quat::from_rotation_z(0.3);
        let frame = tilt * Quat::from_rotation_x(angle) * lab.get(strand).root_frame();
        let mut frames = vec![None; FREE + 1];
        frames.push(Some(frame));
        lab.app.world_mut().entity_mut(strand).insert(HeldNodes { targets, frames });
        lab.settle(4.0);
        let strand = lab.get(strand);
        // Half a cell at the root, whole ones between edges; the last edge is held.
        let twists = (0..=FREE).map(|j| 2.0 * strand.darboux(j).z.asin());
        let expected = angle / (FREE as f32 + 0.5);
        for (j, twist) in twists.enumerate() {
            let expected = if j == 0 { 0.5 * expected } else { expected };
            assert!((twist - expected).abs() < 1e-3, "{angle}: {twist} at {j}, not {expected}");
        }
    }
}
