//! Which end of a strand is its root.

use super::{
    Groom,
    intake::Intake,
    losses::GroomPlace,
    strays::{middle, sampled},
};
use bevy::prelude::*;

/// Which end of each strand in a file is its root.
#[derive(
    Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize,
)]
#[reflect(Default, Clone, PartialEq)]
pub enum RootEnd {
    /// The first node, as the formats say; but strands are turned where the groom grows on a head and their
    /// last node lies on it while the first does not. Hair that lies as close to the head at both ends, and
    /// patches too small to tell where the head is, stay as they are.
    #[default]
    Found,
    /// Always the first node.
    First,
    /// Always the last node.
    Last,
}

/// Distances from a head's middle that its scalp may be off, as a share of its radius: nine of ten roots.
const UNEVEN: f32 = 0.15;
/// So much worse than that of the other ends may the ball of first nodes fit: it is still believed.
const BELIEVED: f32 = 1.5;
/// This share of strands grows outward.
const OUTWARD: f32 = 0.9;
/// By this share of its ends' distance a strand has to rise from the head on to tell where its root is.
const RISE: f32 = 0.2;
/// A single strand among others that are right is turned if its first node is off the scalp by this share of
/// the radius.
const OFF: f32 = 0.1;
const ROUNDS: usize = 4;
/// So many strands or more tell where the head is.
const ENDS: usize = 8192;

impl Intake {
    /// Turns strands that are stored from tip to root.
    pub fn turn(&mut self, end: RootEnd) {
        let all = 0..self.groom.len();
        let turned: Vec<usize> = match end {
            RootEnd::First => return,
            RootEnd::Last => all.collect(),
            RootEnd::Found => {
                let turned = tip_first(&self.groom);
                all.filter(|i| turned.get(*i) == Some(&true)).collect()
            }
        };
        for &i in &turned {
            let number = self.number(i);
            self.losses.turned_strands.add(GroomPlace::Strand(number));
            self.turned.push(number);
            self.groom.turn_strand(i);
        }
    }
}

impl Groom {
    /// The strand from its other end.
    pub(super) fn turn_strand(&mut self, strand: usize) {
        let nodes = self.nodes_of(strand);
        self.points[nodes.clone()].reverse();
        if let Some(widths) = self.widths.get_mut(nodes.clone()) {
            widths.reverse();
        }
        if let Some(colors) = self.colors.get_mut(nodes) {
            colors.reverse();
        }
    }
}

/// Whether each strand is stored from tip to root; empty where none is.
fn tip_first(groom: &Groom) -> Vec<bool> {
    let all_ends: Vec<[Vec3; 2]> =
        groom.strands().map(|s| [s.points[0], s.points[s.points.len() - 1]]).collect();
    let ends: Vec<[Vec3; 2]> = sampled(all_ends.len(), ENDS).map(|i| all_ends[i]).collect();
    let as_stored = Ball::of(&ends).filter(|ball| ball.may_be_scalp(&ends));
    let backwards: Vec<[Vec3; 2]> = ends.iter().map(|[first, last]| [*last, *first]).collect();
    let reversed = Ball::of(&backwards).filter(|ball| ball.is_scalp(&backwards));
    let all = match (as_stored, reversed) {
        (Some(stored), Some(reversed)) => stored.uneven > BELIEVED * reversed.uneven,
        (None, Some(_)) => true,
        _ => false,
    };
    let mut roots = if all { backwards } else { ends.clone() };
    // Some strands may be stored otherwise than most.
    let mut centre = middle(roots.iter().map(|ends| ends[0])).as_vec3();
    let mut ball = None;
    for _ in 0..ROUNDS {
        for ends in &mut roots {
            if ends[1].distance(centre) < ends[0].distance(centre) {
                ends.swap(0, 1);
            }
        }
        ball = Ball::of(&roots);
        centre = ball.map_or(centre, |ball| ball.centre);
    }
    let Some(ball) = ball.filter(|ball| ball.uneven < UNEVEN) else {
        return if all { vec![true; all_ends.len()] } else { Vec::new() };
    };
    let mut off: Vec<f32> = roots.iter().map(|ends| ball.off(ends[0])).collect();
    let scalp = quantile(&mut off, 0.98);
    // Not from exactly where most roots are, because all of them may be as far off.
    let margin = OFF * ball.radius;
    let grows = |from: Vec3, to: Vec3| {
        ball.off(from) <= scalp + 0.5 * margin && ball.off(to) > scalp + margin
    };
    all_ends
        .iter()
        .map(|&[first, last]| if all { !grows(first, last) } else { grows(last, first) })
        .collect()
}

fn quantile(numbers: &mut [f32], share: f32) -> f32 {
    let at = ((numbers.len() - 1) as f32 * share) as usize;
    *numbers.select_nth_unstable_by(at, f32::total_cmp).1
}

/// The head below roots.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: Vec3,
    /// At which half of the roots are.
    radius: f32,
    /// By how much of it nine of ten roots are off it at most.
    uneven: f32,
}

impl Ball {
    /// Below the first of each two ends.
    fn of(ends: &[[Vec3; 2]]) -> Option<Self> {
        let groom = Groom::from_polylines(ends.iter().copied()).ok()?;
        let centre = Vec3::from(groom.fit_head()?.center);
        let mut off: Vec<f32> = ends.iter().map(|ends| ends[0].distance(centre)).collect();
        let radius = quantile(&mut off, 0.5);
        off.iter_mut().for_each(|off| *off = (*off - radius).abs() / radius);
        Some(Self { centre, radius, uneven: quantile(&mut off, 0.9) })
    }

    fn off(&self, point: Vec3) -> f32 {
        point.distance(self.centre)
    }

    /// The share of strands that leave it, by `least` of the distance of their ends.
    fn leaving(&self, ends: &[[Vec3; 2]], least: f32) -> f32 {
        let rise = |[root, tip]: &[Vec3; 2]| self.off(*tip) - self.off(*root);
        let leaves = |e: &&[Vec3; 2]| rise(e) > least * e[0].distance(e[1]) - 0.02 * self.radius;
        ends.iter().filter(leaves).count() as f32 / ends.len() as f32
    }

    /// Whether roots lie on it, and it is not certain that strands grow into it.
    fn may_be_scalp(&self, ends: &[[Vec3; 2]]) -> bool {
        self.uneven < UNEVEN && self.leaving(ends, 0.0) > 0.5
    }

    /// Whether roots lie on it, and strands clearly lead away.
    fn is_scalp(&self, ends: &[[Vec3; 2]]) -> bool {
        self.uneven < UNEVEN && self.leaving(ends, 0.0) > OUTWARD && self.leaving(ends, RISE) > 0.5
    }
}
