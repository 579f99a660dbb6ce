//! Followers: the strands between the simulated ones. Where they grow and which guides they go with
//! is decided once for a groom; where they are is computed in the vertex shader (and in
//! [`curve`](super::curve)).

use super::given::{FollowerRoots, grow};
use crate::{grid::UniformGrid, setting::setting};
use bevy::prelude::*;

setting! {
    /// How many strands are drawn between the simulated ones, and how they differ. Component of a
    /// [`Hair`](crate::Hair), may change at any time; where absent,
    /// [`HairDefault<HairFollowers>`](crate::HairDefault) holds.
    ///
    /// A follower grows between up to three near guides and takes their shape in shares. Guides that
    /// move apart let go of it: it stays with its nearest. [`FollowerRoots`] says where followers grow if
    /// that is known.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairFollowers {
        /// How many strands are drawn besides the guides, at most as many as [`FollowerRoots`] if the
        /// hair has them; 0 draws guides only. A real head carries 100,000.
        // With more the mesh outgrows what a GPU buffer holds everywhere (256 MiB).
        pub count: u32 = 12_000, in COUNT: 0.0..=1e5, "20000 suit a head";
        /// Straight pieces drawn for each strand, along a smooth curve; for curls at least as many as
        /// the guides have edges.
        pub segments: u32 = 16, in SEGMENTS: 1.0..=64.0, safe 2.0..=64.0, "16 suit most hair";
        /// The same seed gives the same followers.
        pub seed: u32 = 0;
        /// How much shorter than its guides a follower may be, a share.
        pub length_variation: f32 = 0.15, in LENGTH_VARIATION: 0.0..=0.95, safe 0.0..=0.9,
            "0.15 is natural";
        /// By how much a follower's waves may be shifted against its guides', as a share of the
        /// length.
        pub phase_variation: f32 = 0.03, in PHASE_VARIATION: 0.0..=0.5, safe 0.0..=0.3,
            "0.03 is natural";
        /// How far strays leave their lock at the tip, as a share of the length.
        pub stray: f32 = 0.03, in STRAY: 0.0..=1.0, safe 0.0..=0.5, "0.03 is natural";
        /// How much tips draw together around their guide, a share.
        pub clump: f32 = 0.25, in CLUMP: 0.0..=1.0, "0.25 is natural";
        /// How far water draws the strands of a lock to their guide where it soaks them, a share of
        /// the way.
        pub wet_clump: f32 = 0.75, in WET_CLUMP: 0.0..=1.0, safe 0.0..=0.95, "0.75 is natural";
        /// How many times farther apart than at the scalp guides may be before they stop blending.
        /// Guides that go ways more than 60° to 90° apart, as at a parting, stop in any case.
        pub parting: f32 = 4.0, in PARTING: 1.0..=1e6, safe 1.5..=100.0, "4 suits most hair";
        /// How far around it followers grow where a guide stands alone.
        pub lock_radius: f32 = 6e-3, "m" in LOCK_RADIUS: 0.0..=10.0, "locks have 0.006";
    }
}

impl HairFollowers {
    /// Only the simulated strands.
    pub fn none() -> Self {
        Self { count: 0, ..default() }
    }

    /// So many followers, the rest by default.
    pub fn new(count: u32) -> Self {
        Self { count, ..default() }
    }
}

/// A strand as it is drawn: which guides it goes with and how it differs from them. 64 bytes in the
/// buffer, see [`HairBuffers`](super::HairBuffers).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DrawnStrand {
    /// Indices of its guides, nearest first; unused ones repeat the first and weigh nothing.
    pub guides: [u32; 3],
    /// From which it takes whatever is random in the shader.
    pub seed: u32,
    /// Shares of the guides, sum 1.
    pub weights: [f32; 3],
    /// Where on the guides it ends, a share of their length. Above 1 it ends at their tips and is as
    /// many times as large.
    pub length: f32,
    /// The root's place besides the weighted roots of the guides (m).
    pub root: Vec3,
    /// Where on the guides it begins, a share of their length.
    pub phase: f32,
    /// By how much its tip leaves the lock (m).
    pub stray: Vec3,
    /// Whether it is a guide itself.
    pub is_guide: bool,
}

impl DrawnStrand {
    /// Guide `index` itself.
    pub fn guide(index: u32) -> Self {
        Self {
            guides: [index; 3],
            seed: hash(index),
            weights: [1.0, 0.0, 0.0],
            length: 1.0,
            is_guide: true,
            ..default()
        }
    }

    /// As the shader reads it.
    pub fn packed(&self) -> [u32; 16] {
        let [a, b, c] = self.guides;
        let [u, v, w] = self.weights.map(f32::to_bits);
        let [rx, ry, rz] = self.root.to_array().map(f32::to_bits);
        let [sx, sy, sz] = self.stray.to_array().map(f32::to_bits);
        let (length, phase) = (self.length.to_bits(), self.phase.to_bits());
        let guide = f32::from(u8::from(self.is_guide)).to_bits();
        [a, b, c, self.seed, u, v, w, length, rx, ry, rz, phase, sx, sy, sz, guide]
    }
}

/// Where a guide grows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GuideRoot {
    pub(super) place: Vec3,
    /// Which way it leaves the scalp.
    pub(super) normal: Vec3,
    pub(super) length: f32,
    /// From root to tip (m).
    pub(super) reach: Vec3,
}

/// The drawn strands of a groom: the guides in their order, then the followers.
pub(super) fn scatter(
    roots: &[GuideRoot],
    given: Option<&FollowerRoots>,
    followers: &HairFollowers,
) -> Vec<DrawnStrand> {
    let mut drawn: Vec<_> = (0..roots.len() as u32).map(DrawnStrand::guide).collect();
    if let Some(given) = given {
        drawn.extend(grow(&given.0, roots, followers));
        return drawn;
    }
    if roots.is_empty() || followers.count == 0 {
        return drawn;
    }
    drawn.reserve(followers.count as usize);
    let cells = fans(roots);
    let total: f32 = cells.iter().map(|fan| fan.area).sum();
    let mut random = Random(hash(followers.seed ^ 0x9e37_79b9));
    let (mut near, mut passed) = (0, 0.0);
    for i in 0..followers.count {
        // As many followers per area everywhere; equally many per guide where there is no area.
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
    drawn
}

fn follower(
    near: usize,
    roots: &[GuideRoot],
    fan: &Fan,
    settings: &HairFollowers,
    random: &mut Random,
) -> DrawnStrand {
    let a = near as u32;
    let (guides, weights) = fan.pick(a, random);
    let GuideRoot { normal, length, .. } = roots[near];
    let root = if fan.triangles.is_empty() {
        let (across, along) = normal.try_normalize().unwrap_or(Vec3::Y).any_orthonormal_pair();
        let (sin, cos) = (random.share() * core::f32::consts::TAU).sin_cos();
        let radius = settings.lock_radius * random.share().sqrt();
        (across * cos + along * sin) * radius
    } else {
        Vec3::ZERO
    };
    // Most strands keep to their lock, few leave it far.
    let far = random.share().powi(3) * 2.0 + 0.3;
    DrawnStrand {
        guides,
        seed: random.next(),
        weights,
        length: 1.0 - settings.length_variation * random.share(),
        root,
        phase: settings.phase_variation * random.share(),
        stray: random.direction() * (settings.stray * length * far),
        is_guide: false,
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
    fn pick(&self, own: u32, random: &mut Random) -> ([u32; 3], [f32; 3]) {
        if self.triangles.is_empty() {
            let Some(other) = self.nearest else {
                return ([own; 3], [1.0, 0.0, 0.0]);
            };
            let share = 0.5 * random.share();
            return ([own, other, own], [1.0 - share, share, 0.0]);
        }
        let mut target = random.share() * self.area;
        let mut chosen = self.triangles[self.triangles.len() - 1];
        for &triangle in &self.triangles {
            if target < triangle.2 {
                chosen = triangle;
                break;
            }
            target -= triangle.2;
        }
        let (mut u, mut v) = (random.share(), random.share());
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        // Folded into this guide's corner, so that it is the nearest.
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
    let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
    for root in roots {
        (low, high) = (low.min(root.place), high.max(root.place));
    }
    // About so far are guides apart if they cover the box's largest side.
    let spacing = (high - low).length() / (roots.len() as f32).sqrt();
    let mut grid = UniformGrid::default();
    let places = || roots.iter().zip(0u32..).map(|(root, i)| (root.place, i));
    grid.build((2.0 * spacing).max(1e-6), places());
    let mut near: Vec<(f32, u32)> = Vec::new();
    (roots.iter().zip(0u32..))
        .map(|(root, own)| {
            near.clear();
            let mut consider = |i: u32| {
                let square = root.place.distance_squared(roots[i as usize].place);
                if i != own && square > 1e-12 && square.is_finite() {
                    near.push((square, i));
                }
            };
            grid.for_each_near(root.place, &mut consider);
            if near.len() < 3 && roots.len() <= 4096 {
                near.clear();
                (0..roots.len() as u32).for_each(|i| {
                    let square = root.place.distance_squared(roots[i as usize].place);
                    if i != own && square > 1e-12 && square.is_finite() {
                        near.push((square, i));
                    }
                });
            }
            near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            near.dedup_by_key(|n| n.1);
            near.truncate(NEIGHBOURS);
            fan_of(root, &near, roots)
        })
        .collect()
}

fn fan_of(root: &GuideRoot, near: &[(f32, u32)], roots: &[GuideRoot]) -> Fan {
    let nearest = near.first().map(|n| n.1);
    let (x, y) = root.normal.try_normalize().unwrap_or(Vec3::Y).any_orthonormal_pair();
    let mut around: Vec<(f32, u32)> = near
        .iter()
        .map(|&(_, i)| {
            let way = roots[i as usize].place - root.place;
            (way.dot(y).atan2(way.dot(x)), i)
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut fan = Fan { nearest, ..default() };
    for (k, &(angle, b)) in around.iter().enumerate() {
        let (next, c) = around[(k + 1) % around.len()];
        let gap = (next - angle).rem_euclid(core::f32::consts::TAU);
        // Beyond this gap there is no neighbour on that side: the hairline.
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

/// The PCG hash; the shader's twin gives the same numbers.
pub(super) fn hash(seed: u32) -> u32 {
    let state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A small generator of our own: followers must not change with a dependency's version.
pub(super) struct Random(pub(super) u32);

impl Random {
    pub(super) fn next(&mut self) -> u32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9);
        hash(self.0)
    }

    pub(super) fn share(&mut self) -> f32 {
        (self.next() >> 8) as f32 / 16_777_216.0
    }

    pub(super) fn direction(&mut self) -> Vec3 {
        let v = Vec3::new(self.share(), self.share(), self.share()) * 2.0 - 1.0;
        v.normalize_or(Vec3::X)
    }
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
