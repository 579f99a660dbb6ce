//! Strands that do not belong: a node far away from everything, roots that an exporter did not find.
//!
//! Everything is judged in comparison with the groom itself, by medians, so that no unit has to be known
//! and what is judged does not count.

use super::{Groom, GroomLosses, intake::Intake, losses::GroomLoss};
use crate::base::grid::KdTree;
use bevy::{math::DVec3, platform::collections::HashMap, prelude::*};

/// Fewer strands are not judged.
const MIN_STRANDS: usize = 8;
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
const MAX_COINCIDENT_SHARE: f32 = 0.1;
/// Nodes that are enough to find the middle of all.
const SAMPLE: usize = 1 << 16;
/// Where this share of the strands looks like strays, they are no strays.
const MAX_STRAY_SHARE: f32 = 0.25;

impl Intake {
    /// Leaves out strands that reach far away from all others, and strays.
    pub fn leave_out_strays(&mut self) {
        type Find = fn(&Groom, &Reaches) -> Vec<Option<usize>>;
        type Loss = fn(&mut GroomLosses) -> &mut GroomLoss;
        let kinds: [(Find, Loss); 2] =
            [(far, |losses| &mut losses.far_strands), (stray, |losses| &mut losses.stray_strands)];
        let mut reaches = None;
        for (find, loss) in kinds {
            let all = self.groom.len();
            if all < MIN_STRANDS {
                return;
            }
            let found = find(&self.groom, reaches.get_or_insert_with(|| Reaches::of(&self.groom)));
            let share = found.iter().flatten().count() as f32 / all as f32;
            if share == 0.0 || share > MAX_STRAY_SHARE {
                continue;
            }
            for (i, node) in found.iter().enumerate() {
                if let Some(node) = node {
                    let number = self.number(i);
                    loss(&mut self.losses).add_node(number, *node);
                }
            }
            self.keep((0..all).filter(|i| found[*i].is_none()).collect());
            reaches = None;
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

/// Numbers below `count`, at most twice `most` of them and evenly spread: by an odd step, so that of strands of 16
/// nodes every one comes up.
pub(super) fn sampled(count: usize, most: usize) -> impl Iterator<Item = usize> + Clone {
    (0..count).step_by((count / most).max(1) | 1)
}

/// How far strands reach from the middle of all nodes.
struct Reaches {
    middle: DVec3,
    /// Of each strand.
    each: Vec<f64>,
    /// Of half of them.
    typical: f64,
}

impl Reaches {
    fn of(groom: &Groom) -> Self {
        let points = groom.points();
        let middle = middle(sampled(points.len(), SAMPLE).map(|i| points[i]));
        let square = |p: &Vec3| p.as_dvec3().distance_squared(middle);
        // Not `f64::max`, which looks at NaN in between: there is none.
        let larger = |a: f64, b: f64| if b > a { b } else { a };
        let reach = |points: &[Vec3]| points.iter().map(square).fold(0.0, larger).sqrt();
        let each: Vec<f64> = groom.strands().map(|strand| reach(strand.points)).collect();
        let typical = f64::from(median(each.iter().map(|reach| *reach as f32).collect()));
        Self { middle, each, typical }
    }

    /// The node that is farthest.
    fn farthest(&self, strand: &[Vec3]) -> usize {
        let off = strand.iter().enumerate().map(|(k, p)| (p.as_dvec3().distance(self.middle), k));
        off.fold((0.0, 0), |most, off| if off.0 > most.0 { off } else { most }).1
    }
}

/// The farthest node of strands that are far away.
fn far(groom: &Groom, reaches: &Reaches) -> Vec<Option<usize>> {
    let most = FAR * reaches.typical;
    let is_far = |reach: &f64| most > 0.0 && *reach > most;
    let each = groom.strands().zip(&reaches.each);
    each.map(|(strand, reach)| is_far(reach).then(|| reaches.farthest(strand.points))).collect()
}

/// The odd node of strays.
fn stray(groom: &Groom, reaches: &Reaches) -> Vec<Option<usize>> {
    let most = JUMP * reaches.typical;
    let mut found = apart(groom);
    for (strand, found) in groom.strands().zip(&mut found) {
        let segments = || strand.points.windows(2).map(|pair| pair[0].distance_squared(pair[1]));
        let longest = segments().fold(0.0, |a, b| if b > a { b } else { a }).sqrt();
        let jumps = strand.points.len() > 2
            && most > 0.0
            && f64::from(longest) > most
            && longest > OWN_JUMP * median(segments().map(f32::sqrt).collect());
        *found = found.or_else(|| jumps.then(|| reaches.farthest(strand.points)));
    }
    found
}

/// Whether every root has one at another place within `near`. May say no where that takes too long to find out.
fn all_have_company(roots: &[Vec3], near: f32) -> bool {
    /// So many are compared with all others.
    const LONE: usize = 64;
    // Two in a cell are nearer than that.
    let cell = |root: &Vec3| (root / (0.5 * near)).floor().to_array().map(|x| x as i32);
    let is_cell = |cell: &[i32; 3]| cell.iter().all(|x| x.unsigned_abs() < 1 << 30);
    let mut cells: HashMap<[i32; 3], (Vec3, bool)> = HashMap::new();
    for root in roots {
        let (first, several) = cells.entry(cell(root)).or_insert((*root, false));
        *several |= first != root;
    }
    let has = |root: &Vec3| {
        let cell = cell(root);
        is_cell(&cell) && cells.get(&cell).is_some_and(|(_, several)| *several)
    };
    let lone: Vec<&Vec3> = roots.iter().filter(|root| !has(root)).take(LONE + 1).collect();
    let is_near = |root: &&Vec3| roots.iter().any(|r| r != *root && r.distance(**root) <= near);
    near > 0.0 && lone.len() <= LONE && lone.iter().all(is_near)
}

/// Node 0 of strands whose root lies apart from the others, alone or with some at exactly the same place.
fn apart(groom: &Groom) -> Vec<Option<usize>> {
    let mut found = vec![None; groom.len()];
    let roots: Vec<Vec3> = groom.roots().collect();
    let middle = middle(roots.iter().copied()).as_vec3();
    let spread = median(roots.iter().map(|r| r.distance(middle)).collect());
    if all_have_company(&roots, TOGETHER * spread) {
        return found;
    }
    let bits = |i: u32| roots[i as usize].to_array().map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..roots.len() as u32).collect();
    order.sort_by_key(|i| bits(*i));
    let places: Vec<&[u32]> = order.chunk_by(|a, b| bits(*a) == bits(*b)).collect();
    if places.len() < MIN_STRANDS / 2 {
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
    for (place, gap) in places.iter().zip(gaps) {
        let is_apart = match place.len() {
            1 => gap > ALONE * spread,
            few => {
                few as f32 <= MAX_COINCIDENT_SHARE * roots.len() as f32
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
