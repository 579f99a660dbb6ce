//! Which strands are drawn: guides, and followers scattered between them; and where they end.

use super::{
    drawn_strand::{DrawnStrand, GuideEnd, GuideRoot, direction},
    follower_roots::{FollowerRoots, lay_followers},
    followers::HairFollowers,
    locks::draw_together,
};
use crate::{base::grid::KdTree, hair::strand::FollowerCuts};
use bevy::prelude::*;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// The drawn strands of a groom: the guides in their order, then the followers.
pub(super) fn scatter(
    roots: &[GuideRoot],
    follower_roots: Option<&FollowerRoots>,
    followers: &HairFollowers,
) -> Vec<DrawnStrand> {
    let guide = |(root, i): (&GuideRoot, u32)| {
        let size = if root.length.is_finite() { root.length } else { 0.0 };
        DrawnStrand { size, ..DrawnStrand::guide(i) }
    };
    let mut drawn: Vec<_> = roots.iter().zip(0..).map(guide).collect();
    match follower_roots {
        Some(follower_roots) => drawn.extend(lay_followers(&follower_roots.0, roots, followers)),
        None => scatter_followers(&mut drawn, roots, followers),
    }
    draw_together(&mut drawn[roots.len()..], roots, followers);
    drawn
}

/// What [`FollowerCuts`] have for a whole follower.
pub(super) const WHOLE: f32 = u16::MAX as f32;
/// The least that is left of a follower, a share of its length.
pub(super) const LEAST: f32 = 0.01;

/// Ends drawn strands where their guides end, and followers where `cuts` says if it is of these.
pub(super) fn shorten(drawn: &mut [DrawnStrand], ends: &[GuideEnd], cuts: Option<&FollowerCuts>) {
    let (guides, followers) = drawn.split_at_mut(ends.len());
    let cuts = cuts.filter(|cuts| cuts.0.len() == followers.len());
    if cuts.is_none() && ends.iter().all(|end| end.end == end.edges) {
        return;
    }
    for (guide, end) in guides.iter_mut().zip(ends) {
        guide.cut = share(end);
    }
    for (i, follower) in followers.iter_mut().enumerate() {
        let end = |k: usize| &ends[follower.guides[k] as usize];
        // No farther beyond its nearest guide than an edge: the others may have parted from it.
        let farthest = (end(0).end + 1.0) / end(0).edges.max(1.0);
        let mean = || (0..3).map(|k| follower.weights[k] * share(end(k))).sum::<f32>();
        let own = cuts.map(|cuts| f32::from(cuts.0[i]) / WHOLE);
        let guided = own.map_or_else(mean, |_| 1.0).min(farthest);
        // From a share of the guides to one of its own.
        let (begin, whole) = (follower.phase, follower.length.min(1.0));
        let guided = if guided < whole { (guided - begin) / (whole - begin) } else { 1.0 };
        follower.cut = own.unwrap_or(1.0).min(guided).clamp(LEAST, 1.0);
    }
}

fn share(end: &GuideEnd) -> f32 {
    if end.end < end.edges { end.end / end.edges } else { 1.0 }
}

/// Adds followers evenly between the guides.
fn scatter_followers(drawn: &mut Vec<DrawnStrand>, roots: &[GuideRoot], followers: &HairFollowers) {
    if roots.is_empty() || followers.count == 0 {
        return;
    }
    drawn.reserve(followers.count as usize);
    let cells = fans(roots);
    let total: f32 = cells.iter().map(|fan| fan.area).sum();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(followers.seed.into());
    let (mut near, mut passed) = (0, 0.0);
    for i in 0..followers.count {
        // Equal density per area; equal numbers per guide where there is no area.
        if total > 0.0 {
            let target = (i as f32 + 0.5) / followers.count as f32 * total;
            while near + 1 < cells.len() && passed + cells[near].area < target {
                passed += cells[near].area;
                near += 1;
            }
        } else {
            near = i as usize % cells.len();
        }
        drawn.push(follower(near, roots, &cells[near], followers, &mut random));
    }
}

fn follower(
    near: usize,
    roots: &[GuideRoot],
    fan: &Fan,
    settings: &HairFollowers,
    random: &mut Xoshiro256PlusPlus,
) -> DrawnStrand {
    let a = near as u32;
    let (guides, weights) = fan.pick(a, random);
    let GuideRoot { normal, length, .. } = roots[near];
    let root = if fan.triangles.is_empty() {
        let (across, along) = normal.try_normalize().unwrap_or(Vec3::Y).any_orthonormal_pair();
        let (sin, cos) = (random.random::<f32>() * core::f32::consts::TAU).sin_cos();
        let radius = settings.lock_radius * random.random::<f32>().sqrt();
        (across * cos + along * sin) * radius
    } else {
        Vec3::ZERO
    };
    // Most strands stay near their lock, few leave it far.
    let far = random.random::<f32>().powi(3) * 2.0 + 0.3;
    let seed = random.random();
    let share = 1.0 - settings.length_variation * random.random::<f32>();
    DrawnStrand {
        guides,
        seed,
        weights,
        length: share,
        root,
        phase: settings.phase_variation * random.random::<f32>(),
        stray: direction(random) * (settings.stray * length * far),
        size: if length.is_finite() { length * share } else { 0.0 },
        ..default()
    }
}

/// The triangles that a guide makes with its neighbours around it.
#[derive(Clone, Debug, Default)]
struct Fan {
    triangles: Vec<(u32, u32, f32)>,
    area: f32,
    nearest: Option<u32>,
}

impl Fan {
    /// Guides and weights of a point in the guide's own part of the fan.
    fn pick(&self, own: u32, random: &mut Xoshiro256PlusPlus) -> ([u32; 3], [f32; 3]) {
        if self.triangles.is_empty() {
            let Some(other) = self.nearest else {
                return ([own; 3], [1.0, 0.0, 0.0]);
            };
            let share = 0.5 * random.random::<f32>();
            return ([own, other, own], [1.0 - share, share, 0.0]);
        }
        let mut target = random.random::<f32>() * self.area;
        let mut chosen = self.triangles[self.triangles.len() - 1];
        for &triangle in &self.triangles {
            if target < triangle.2 {
                chosen = triangle;
                break;
            }
            target -= triangle.2;
        }
        let (mut u, mut v) = (random.random::<f32>(), random.random::<f32>());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        // Reflected into this guide's corner, so that it is the nearest.
        let mut w = 1.0 - u - v;
        if u > w && u >= v {
            core::mem::swap(&mut u, &mut w);
        } else if v > w {
            core::mem::swap(&mut v, &mut w);
        }
        ([own, chosen.0, chosen.1], [w, u, v])
    }
}

const NEIGHBOURS: usize = 8;

fn fans(roots: &[GuideRoot]) -> Vec<Fan> {
    let tree = KdTree::new(roots.iter().map(|root| root.place).zip(0..));
    // Guides in the same place make no triangle.
    let is_apart = |_, square| square > 1e-12;
    let near = |root: &GuideRoot| tree.nearest_of::<NEIGHBOURS, _>(root.place, is_apart);
    roots.iter().map(|root| fan_of(root, near(root), roots)).collect()
}

fn fan_of(root: &GuideRoot, near: impl Iterator<Item = (u32, f32)>, roots: &[GuideRoot]) -> Fan {
    let mut near = near.peekable();
    let nearest = near.peek().map(|n| n.0);
    let (x, y) = root.normal.try_normalize().unwrap_or(Vec3::Y).any_orthonormal_pair();
    let mut around: Vec<(f32, u32)> = near
        .map(|(i, _)| {
            let way = roots[i as usize].place - root.place;
            (way.dot(y).atan2(way.dot(x)), i)
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut fan = Fan { nearest, ..default() };
    for (k, &(angle, b)) in around.iter().enumerate() {
        let (next, c) = around[(k + 1) % around.len()];
        let gap = (next - angle).rem_euclid(core::f32::consts::TAU);
        // With a larger gap there is no neighbour on that side: the hairline.
        if b == c || gap > 2.2 {
            continue;
        }
        let (b_place, c_place) = (roots[b as usize].place, roots[c as usize].place);
        let area = (b_place - root.place).cross(c_place - root.place).length();
        if area > 1e-12 {
            fan.triangles.push((b, c, area));
            fan.area += area;
        }
    }
    fan
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(n: usize) -> Vec<GuideRoot> {
        (0..n * n)
            .map(|i| GuideRoot {
                place: Vec3::new((i % n) as f32, 0.0, (i / n) as f32) * 0.01,
                normal: Vec3::Y,
                length: 0.2,
                reach: Vec3::Y * 0.2,
            })
            .collect()
    }

    #[test]
    fn followers_cover_the_scalp_evenly_and_near_their_first_guide() {
        let roots = field(10);
        let drawn = scatter(&roots, None, &HairFollowers::new(9000));
        assert_eq!(drawn.len(), 9100);
        let mut cells = [0u32; 81];
        for strand in &drawn[100..] {
            let place: Vec3 =
                (0..3).map(|k| roots[strand.guides[k] as usize].place * strand.weights[k]).sum();
            let sum: f32 = strand.weights.iter().sum();
            assert!((sum - 1.0).abs() < 1e-5);
            assert!(strand.weights[0] >= strand.weights[1].max(strand.weights[2]));
            let cell = (place / 0.01).floor().clamp(Vec3::ZERO, Vec3::splat(8.0));
            cells[cell.x as usize + 9 * cell.z as usize] += 1;
        }
        let (least, most) = (cells.iter().min().unwrap(), cells.iter().max().unwrap());
        assert!(*least > 50 && *most < 220, "{least}…{most} where 111 is even");
    }

    #[test]
    fn odd_grooms_give_the_count_too() {
        let one = [GuideRoot::default()];
        let same = [GuideRoot::default(); 5];
        let row: Vec<_> = (0..7)
            .map(|i| GuideRoot {
                place: Vec3::X * i as f32,
                normal: Vec3::Y,
                length: 1.0,
                reach: Vec3::Y,
            })
            .collect();
        let broken =
            [GuideRoot { place: Vec3::NAN, normal: Vec3::NAN, length: f32::NAN, reach: Vec3::NAN };
                3];
        for roots in [&one[..], &same, &row, &broken] {
            assert_eq!(scatter(roots, None, &HairFollowers::new(50)).len(), roots.len() + 50);
        }
        assert!(scatter(&[], None, &HairFollowers::new(50)).is_empty());
    }
}
