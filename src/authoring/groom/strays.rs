//! Strands that do not belong: a node far away from everything, roots that an exporter did not find.
//!
//! Everything is judged in comparison with the groom itself, by medians, so that no unit has to be known
//! and what is judged does not count.

use super::{Groom, GroomLosses, intake::Intake, losses::GroomLoss};
use crate::base::grid::KdTree;
use bevy::{math::DVec3, prelude::*};

/// Fewer strands are not judged.
const FEWEST: usize = 8;
/// A strand is far away if it reaches so many times as far from the middle as half of the strands do.
const FAR: f64 = 30.0;
/// A segment jumps if it is so many times as long as that reach …
const JUMP: f64 = 3.0;
/// … and as the strand's own median segment.
const OWN_JUMP: f32 = 20.0;
/// A root alone is a stray if the nearest other is so many times as far as the middle of roots is from half
/// of them …
const ALONE: f32 = 3.0;
/// … and roots at one place if it is so many times as far …
const TOGETHER: f32 = 0.3;
/// … and so many times as far as roots usually are from each other.
const SPACINGS: f32 = 4.0;
/// Roots at one place are strays if they are this share of all at most: more are meant.
const SHARE: f32 = 0.1;
/// Where this share of the strands looks like strays, they are no strays.
const MOST: f32 = 0.25;

impl Intake {
    /// Leaves out strands that reach far away from all others, and strays.
    pub fn leave_out_strays(&mut self) {
        type Find = fn(&Groom) -> Vec<Option<usize>>;
        type Loss = fn(&mut GroomLosses) -> &mut GroomLoss;
        let kinds: [(Find, Loss); 2] =
            [(far, |losses| &mut losses.far_strands), (stray, |losses| &mut losses.stray_strands)];
        for (find, loss) in kinds {
            let all = self.groom.len();
            if all < FEWEST {
                return;
            }
            let found = find(&self.groom);
            let share = found.iter().flatten().count() as f32 / all as f32;
            if share == 0.0 || share > MOST {
                continue;
            }
            for (i, node) in found.iter().enumerate() {
                if let Some(node) = node {
                    let number = self.number(i);
                    loss(&mut self.losses).add_node(number, *node);
                }
            }
            self.keep((0..all).filter(|i| found[*i].is_none()).collect());
        }
    }
}

/// The median of each axis.
pub(super) fn middle(points: impl Iterator<Item = Vec3> + Clone) -> DVec3 {
    let axis = |k: usize| f64::from(median(points.clone().map(|p| p[k]).collect()));
    DVec3::new(axis(0), axis(1), axis(2))
}

/// The median; 0 of nothing.
pub(super) fn median(mut numbers: Vec<f32>) -> f32 {
    let half = numbers.len() / 2;
    match numbers.is_empty() {
        true => 0.0,
        false => *numbers.select_nth_unstable_by(half, f32::total_cmp).1,
    }
}

/// How far each strand reaches from the middle of all nodes, and by which node.
fn reaches(groom: &Groom) -> Vec<(f64, usize)> {
    let middle = middle(groom.points().iter().copied());
    let reach = |points: &[Vec3]| {
        let off = points.iter().enumerate().map(|(k, p)| (p.as_dvec3().distance(middle), k));
        off.fold((0.0, 0), |most, off| if off.0 > most.0 { off } else { most })
    };
    groom.strands().map(|strand| reach(strand.points)).collect()
}

fn typical(reaches: &[(f64, usize)]) -> f64 {
    f64::from(median(reaches.iter().map(|r| r.0 as f32).collect()))
}

/// The farthest node of strands that are far away.
fn far(groom: &Groom) -> Vec<Option<usize>> {
    let reaches = reaches(groom);
    let most = FAR * typical(&reaches);
    reaches.iter().map(|(reach, node)| (most > 0.0 && *reach > most).then_some(*node)).collect()
}

/// The odd node of strays.
fn stray(groom: &Groom) -> Vec<Option<usize>> {
    let reaches = reaches(groom);
    let most = JUMP * typical(&reaches);
    let mut found = apart(groom);
    for ((strand, (_, farthest)), found) in groom.strands().zip(reaches).zip(&mut found) {
        let segments: Vec<f32> =
            strand.points.windows(2).map(|pair| pair[0].distance(pair[1])).collect();
        let longest = segments.iter().copied().fold(0.0, f32::max);
        let jumps = segments.len() > 1
            && most > 0.0
            && f64::from(longest) > most
            && longest > OWN_JUMP * median(segments);
        *found = found.or(jumps.then_some(farthest));
    }
    found
}

/// Node 0 of strands whose root lies apart from the others, alone or with some at exactly the same place.
fn apart(groom: &Groom) -> Vec<Option<usize>> {
    let mut found = vec![None; groom.len()];
    let roots: Vec<Vec3> = groom.roots().collect();
    let bits = |i: u32| roots[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..roots.len() as u32).collect();
    order.sort_by_key(|i| bits(*i));
    let places: Vec<&[u32]> = order.chunk_by(|a, b| bits(*a) == bits(*b)).collect();
    if places.len() < FEWEST / 2 {
        return found;
    }
    let at = |place: &[u32]| roots[place[0] as usize];
    let tree = KdTree::new((0..).zip(&places).map(|(k, place)| (at(place), k)));
    let gap = |(k, place): (u32, &&[u32])| {
        let nearest = tree.nearest_of::<1, _>(at(place), |other, _| other != k).next();
        nearest.map_or(0.0, |(_, square)| square.sqrt())
    };
    let gaps: Vec<f32> = (0..).zip(&places).map(gap).collect();
    let spacing = median(gaps.clone());
    let middle = middle(roots.iter().copied()).as_vec3();
    let spread = median(roots.iter().map(|r| r.distance(middle)).collect());
    for (place, gap) in places.iter().zip(gaps) {
        let is_apart = match place.len() {
            1 => gap > ALONE * spread,
            few => {
                few as f32 <= SHARE * roots.len() as f32
                    && gap > TOGETHER * spread
                    && gap > SPACINGS * spacing
            }
        };
        if is_apart {
            place.iter().for_each(|i| found[*i as usize] = Some(0));
        }
    }
    found
}
