//! Drawn strands at full count, planted by the scalp's mask: guides are too few for a hairline or a
//! parting.

use super::{
    error::PlantError,
    hairline::{BABY_WIDTH, Hairline},
    map::RootPlace,
    planting::Planted,
    preset::HairPreset,
    scalp::Scalp,
    surface::Surface,
};
use crate::{
    base::{grid::KdTree, setting::Ranged},
    render::{FollowerRoot, FollowerRoots},
};
use bevy::prelude::*;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// How far below the skin strands begin (m).
const BELOW: f32 = 0.3e-3;
/// Samples of the mesh for estimating the share that is scalp.
const PROBES: usize = 40_000;
/// The maximum number of samples.
const MOST: f64 = 2e7;
/// Distance from a parting within which more strands are drawn (m), and the share of their density
/// elsewhere: few drawn strands would leave a bald stripe there.
const PARTING_WIDTH: f32 = 20e-3;
const DENSITY_ELSEWHERE: f32 = 0.45;
/// How many of the nearest guides are candidates for a root, and among how many it is looked first.
const NEAR: usize = 16;
const NEAREST: usize = 6;
/// Guides of which a follower is a mean.
const GUIDES: usize = 3;
/// A follower has no guides that are so many times longer or shorter than it by their place: a fringe
/// is not blended with what is long beside it.
const OTHER_LENGTH: f32 = 2.0;
/// Deviation of a baby hair's direction from its neighbours' (rad, approximately).
const BABY_TURN: f32 = 0.5;

impl HairPreset {
    /// Roots of the drawn strands of a planted preset: up to `count` strands by the scalp's mask,
    /// sparser, shorter and finer at the hairline, with lengths interpolated from the guides. Put
    /// the result on the [`Hair`](crate::Hair) entity with the preset's settings. `planted`, `mesh`
    /// and `scalp` are those of [`plant`](Self::plant).
    ///
    /// ```
    /// # use bevy_keratin::{prelude::*, authoring::plant::*}; use bevy::prelude::*;
    /// # fn setup(mut commands: Commands) -> Result {
    /// let (head, scalp) = (Sphere::new(0.1).mesh().build(), Scalp::default());
    /// let preset = HairPreset::Long;
    /// let planted = preset.plant(&head, &scalp)?;
    /// let settings = preset.settings();
    /// let count = settings.followers.count;
    /// let roots = preset.follower_roots(&planted, &head, &scalp, &preset.hairline(), count, 0)?;
    /// commands.spawn((Hair, settings, roots));
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// When the mesh cannot be planted, or a value of `scalp` or `hairline` is out of its range.
    pub fn follower_roots(
        self,
        planted: &Planted,
        mesh: &Mesh,
        scalp: &Scalp,
        hairline: &Hairline,
        count: u32,
        seed: u64,
    ) -> Result<FollowerRoots, PlantError> {
        let (scalp, hairline) = (scalp.checked()?, hairline.checked()?);
        let planting = FollowerPlanting { preset: self, scalp, hairline, count, seed };
        planting.plant(planted, mesh, &|_| 1.0)
    }
}

/// Parameters of the followers to be planted.
pub(crate) struct FollowerPlanting {
    pub(crate) preset: HairPreset,
    pub(crate) scalp: Scalp,
    pub(crate) hairline: Hairline,
    pub(crate) count: u32,
    pub(crate) seed: u64,
}

/// A simulated strand.
struct PlantedGuide {
    place: Vec3,
    length: f32,
    /// Its place's share of that.
    share: f32,
    /// From root to tip.
    reach: Vec3,
    /// Its combing direction.
    comb: Vec3,
}

impl FollowerPlanting {
    /// Plants followers between guides, thinned by `share`.
    pub(crate) fn plant(
        &self,
        planted: &Planted,
        mesh: &Mesh,
        share: &dyn Fn(&RootPlace) -> f32,
    ) -> Result<FollowerRoots, PlantError> {
        let surface = Surface::of(mesh)?;
        let guides = self.guides(planted);
        let tree = KdTree::new(guides.iter().map(|guide| guide.place).zip(0u32..));
        let mut random = Xoshiro256PlusPlus::seed_from_u64(self.seed ^ 0x0f01_10e5);
        let growth = |place: &RootPlace| {
            let mut behind = self.preset.behind_line(&self.scalp, place.position);
            if !self.preset.is_everywhere() && self.hairline.is_ragged_at(behind) {
                behind += self.hairline.break_at(place.position);
            }
            let mut growth = self.hairline.growth(behind);
            let share = share(place).clamp(0.0, 1.0) * self.beside_parting(place.position);
            growth.density *= share;
            growth.baby *= share;
            growth
        };
        let probes = surface.draw(PROBES, &mut random).map(|root| {
            let growth = growth(&root.place);
            f64::from(growth.density + growth.baby)
        });
        let mean = probes.sum::<f64>() / PROBES as f64;
        if mean <= 0.0 || guides.is_empty() {
            return Ok(FollowerRoots::default());
        }
        // Surplus roots are thinned out evenly at the end.
        let drawn = (1.02 * f64::from(self.count) / mean).ceil().min(MOST);
        let mut roots = Vec::with_capacity(self.count as usize + self.count as usize / 8);
        let mut variation_random = Xoshiro256PlusPlus::seed_from_u64(self.seed ^ 0x4a1b_22c7);
        for root in surface.draw(drawn as usize, &mut random) {
            let [chance, long, fine, turn_x, turn_y, turn_z] =
                variation_random.random::<[f32; 6]>();
            let growth = growth(&root.place);
            if chance >= growth.density + growth.baby {
                continue;
            }
            let Some((length, reach)) = self.around(&root.place, &guides, &tree) else { continue };
            let place = root.place.position - root.place.normal * BELOW;
            let is_baby = chance >= growth.density;
            roots.push(if is_baby {
                let turn = Vec3::new(turn_x, turn_y, turn_z) * 2.0 - 1.0;
                let baby = self.hairline.baby_length * (0.2 + 0.8 * long * long);
                let length = baby.min(length);
                let direction = reach.normalize_or_zero() + turn * BABY_TURN;
                let width = BABY_WIDTH * (0.8 + 0.4 * fine);
                FollowerRoot { place, length, reach: direction.normalize_or_zero() * length, width }
            } else {
                let variation = self.length_variation();
                let own = growth.length * (1.0 - variation * long);
                let width = growth.width * (0.85 + 0.3 * fine);
                FollowerRoot { place, length: length * own, reach: reach * own, width }
            });
        }
        let count = roots.len().min(self.count as usize);
        let kept = (0..count).map(|k| roots[k * roots.len() / count]).collect();
        Ok(FollowerRoots(kept))
    }

    /// Relative density, higher near a parting, where no hair from farther up hides the scalp.
    fn beside_parting(&self, place: Vec3) -> f32 {
        if !self.preset.is_parted() {
            return 1.0;
        }
        let near = 1.0 - self.preset.aside(&self.scalp, place).abs() / PARTING_WIDTH;
        DENSITY_ELSEWHERE + (1.0 - DENSITY_ELSEWHERE) * near.clamp(0.0, 1.0).sqrt()
    }

    fn length_variation(&self) -> f32 {
        self.preset.settings().followers.length_variation
    }

    fn comb(&self, place: Vec3) -> Vec3 {
        match self.preset.is_combed() {
            true => self.preset.direction(&self.scalp, place).normalize_or_zero(),
            false => Vec3::ZERO,
        }
    }

    fn guides(&self, planted: &Planted) -> Vec<PlantedGuide> {
        let guide = |points: &[Vec3]| {
            let (first, last) = (points.first()?, points.last()?);
            let length: f32 = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
            let share = self.preset.length_share(&self.scalp, *first).max(1e-3);
            (length > 0.0).then(|| PlantedGuide {
                place: *first,
                // Without the length map, which is applied at every follower's root.
                length: length / share,
                share,
                reach: *last - *first,
                comb: self.comb(*first),
            })
        };
        planted.groom.strands().filter_map(|strand| guide(strand.points)).collect()
    }

    /// Length and reach of a follower at a place, from the nearby guides with a similar combing
    /// direction.
    fn around(
        &self,
        place: &RootPlace,
        guides: &[PlantedGuide],
        tree: &KdTree,
    ) -> Option<(f32, Vec3)> {
        let comb = self.comb(place.position);
        // Locks of guides may reach across a parting; drawn strands must not. Both sides go mostly
        // back and down, so the sideways component is compared on its own.
        let [right, ..] = self.scalp.axes();
        let aside = comb.dot(right);
        let share = self.preset.length_share(&self.scalp, place.position);
        let alike = |i: u32| {
            let guide = &guides[i as usize];
            if guide.share.max(share) > OTHER_LENGTH * guide.share.min(share) {
                return false;
            }
            comb == Vec3::ZERO
                || (guide.comb.dot(comb) > 0.2
                    && guide.reach.dot(comb) > 0.0
                    && (aside.abs() < 0.3 || guide.reach.dot(right) * aside > 0.0))
        };
        let all_alike = |near: &mut dyn Iterator<Item = (u32, f32)>| -> Vec<(u32, f32)> {
            near.filter(|(i, _)| alike(*i)).take(GUIDES).collect()
        };
        let mut chosen = all_alike(&mut tree.nearest::<NEAREST>(place.position));
        if chosen.len() < GUIDES {
            chosen = all_alike(&mut tree.nearest::<NEAR>(place.position));
        }
        if chosen.is_empty() {
            chosen.extend(tree.nearest::<1>(place.position));
        }
        let (mut sum, mut length, mut reach) = (0.0, 0.0, Vec3::ZERO);
        for (i, square) in chosen {
            let (guide, weight) = (&guides[i as usize], 1.0 / (square + 1e-6));
            sum += weight;
            length += weight * guide.length;
            reach += weight * guide.reach;
        }
        let (length, reach) = (length / sum * share, reach / sum);
        // Without a combing direction only the distance counts.
        let reach = if comb == Vec3::ZERO { Vec3::ZERO } else { reach };
        (length.is_finite() && length > 0.0 && reach.is_finite()).then_some((length, reach))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn planted_followers(preset: HairPreset, count: u32) -> (Scalp, FollowerRoots) {
        let mesh = Sphere::new(0.1).mesh().ico(24).unwrap();
        let scalp = Scalp::default();
        let planting = super::super::Planting { density: 0.2e4, ..preset.planting(&scalp) };
        let planted = preset.plant_as(&planting, &mesh, &scalp).unwrap();
        let line = preset.hairline();
        (scalp, preset.follower_roots(&planted, &mesh, &scalp, &line, count, 3).unwrap())
    }

    #[test]
    fn followers_fill_the_scalp_and_begin_under_the_skin() {
        let (scalp, roots) = planted_followers(HairPreset::Straight, 6000);
        assert_eq!(roots.0.len(), 6000);
        for root in &roots.0 {
            let depth = 0.1 - root.place.length();
            assert!((1e-4..1e-3).contains(&depth), "{depth}");
            assert!(scalp.behind_hairline(root.place) > -0.012);
            assert!(root.length > 1e-3 && root.length < 0.35 && root.width > 0.3);
        }
        assert_eq!(roots, planted_followers(HairPreset::Straight, 6000).1);
    }

    #[test]
    fn hair_falls_to_both_sides_of_a_parting() {
        let (scalp, roots) = planted_followers(HairPreset::Straight, 6000);
        let [right, _, front] = scalp.axes();
        let (mut wrong, mut all) = (0, 0);
        for root in roots.0.iter().filter(|root| root.length > 0.1) {
            let aside = root.place.dot(right);
            if root.place.dot(front) < 0.0 || !(6e-3..0.02).contains(&aside.abs()) {
                continue;
            }
            all += 1;
            wrong += u32::from(root.reach.dot(right) * aside < 0.0);
        }
        println!("{wrong} of {all} go to the other side");
        assert!(all > 50 && wrong * 50 < all, "{wrong} of {all}");
    }

    /// Nothing covers the scalp there but what grows there.
    #[test]
    fn strands_are_denser_along_a_parting() {
        let (scalp, roots) = planted_followers(HairPreset::Straight, 20_000);
        let [right, up, front] = scalp.axes();
        let on_top = |p: Vec3| p.dot(up) > 0.07 && p.dot(front).abs() < 0.05;
        let between = |from: f32, to: f32| {
            let aside = |r: &&FollowerRoot| (from..to).contains(&r.place.dot(right).abs());
            roots.0.iter().filter(|r| on_top(r.place)).filter(aside).count() as f32
        };
        let (near, far) = (between(0.0, 0.008), between(0.03, 0.038));
        println!("{near} roots at the parting, {far} aside");
        assert!(near > 1.6 * far && near < 2.6 * far, "{near} and {far}");
    }

    /// T13. Density must rise gradually behind the line, and the line must be ragged. Followers between guides went
    /// from 10 to 90 % in 4 mm, and their foremost ones stood in a straight line for 10 mm.
    #[test]
    fn the_hairline_is_a_ramp_independent_of_the_guides() {
        let (scalp, roots) = planted_followers(HairPreset::Straight, 40_000);
        let [_, _, front] = scalp.axes();
        // In front, where lines of equal distance are as long.
        let ahead = |p: Vec3| p.normalize().dot(front) > 0.25 && p.x.abs() < 0.04;
        let mut bins = [0u32; 8];
        for root in roots.0.iter().filter(|r| r.length > 0.03 && ahead(r.place)) {
            let behind = scalp.behind_hairline(root.place) / 4e-3;
            if (0.0..8.0).contains(&behind) {
                bins[behind as usize] += 1;
            }
        }
        println!("roots by 4 mm behind the line: {bins:?}");
        let full = bins[4..].iter().sum::<u32>() as f32 / 4.0;
        assert!((bins[0] as f32) < 0.4 * full, "{bins:?}");
        assert!((bins[3] as f32) > 0.7 * full, "{bins:?}");
        assert!(bins[..4].is_sorted(), "{bins:?}");
        // The foremost root of each column of 2 mm: no run of more than 8 mm in one line.
        let mut foremost = [f32::MAX; 40];
        for root in roots.0.iter().filter(|r| r.length > 0.03 && ahead(r.place)) {
            let column = ((root.place.x + 0.04) / 2e-3).floor();
            if (0.0..40.0).contains(&column) {
                let least = &mut foremost[column as usize];
                *least = least.min(scalp.behind_hairline(root.place));
            }
        }
        let (mut run, mut longest) = (1, 1);
        for pair in foremost.windows(2) {
            run = if (pair[1] - pair[0]).abs() < 0.4e-3 { run + 1 } else { 1 };
            longest = longest.max(run);
        }
        println!("longest straight run {} mm", 2 * longest);
        assert!(longest <= 4, "{longest} columns of 2 mm: {foremost:?}");
    }

    #[test]
    fn a_mesh_without_scalp_grows_nothing_and_invalid_settings_are_errors() {
        let (head, scalp) = (Sphere::new(0.1).mesh().build(), Scalp::default());
        let planted = HairPreset::Short.plant(&head, &scalp).unwrap();
        let bald = Scalp { recede: 3.0, ..scalp };
        let preset = HairPreset::Short;
        let line = Hairline::default();
        let none = preset.follower_roots(&planted, &head, &bald, &line, 100, 0).unwrap();
        assert!(none.0.is_empty());
        let wrong = Hairline { ragged: f32::NAN, ..line };
        assert!(preset.follower_roots(&planted, &head, &scalp, &wrong, 100, 0).is_err());
    }
}
