//! A time budget for all hair of an app.

use super::LodLevel;
use crate::base::setting::setting;
use bevy::prelude::*;
use core::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

setting! {
    /// How long a tick may take for all hair. A resource.
    ///
    /// When the hair would take longer at the levels chosen by its size on the screen, the least
    /// important hair, by [`HairLod::importance`](super::HairLod::importance) times its share of the
    /// view, takes coarser levels until all of it fits. The time is estimated from numbers of segments
    /// and substeps, not measured: the same game has the same hair on any machine and in any replay.
    /// [`HairEstimate`] holds the result. A budget that the coarsest levels exceed is reported once as a
    /// [`HairFault`](crate::HairFault).
    ///
    /// The coarsest of the default levels is frozen, and a small budget takes hair there however near it
    /// is: it goes with its head and does not move otherwise. A hero's
    /// [`importance`](super::HairLod::importance) makes it the last to be frozen; without
    /// [`LodLevel::FROZEN`] among its levels it never is, nor when it is far. Hair without levels
    /// ([`HairLod`](super::HairLod)) is counted, wet hair with its water, but simulated in full, and the other hair
    /// has what is left. Where a hair has no `HairLod` while others are made coarser for the budget, that is
    /// reported once as a [`HairFault`](crate::HairFault); a `HairLod` of no levels says that it is meant.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut app = App::new();
    /// // 6 ms of one thread, on machines of half the speed of the one that the estimates are from
    /// app.insert_resource(HairBudget { milliseconds: 6.0, slowness: 2.0 });
    /// // last to be made coarser, and never frozen
    /// let levels = vec![LodLevel::NEAR, LodLevel::BACKGROUND];
    /// app.world_mut().spawn((Hair, HairLod { levels, importance: 10.0, ..default() }));
    /// ```
    #[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Resource, Default, Clone, PartialEq)]
    pub struct HairBudget {
        /// Time that a tick may take on one thread. Infinite by default.
        pub milliseconds: f32 = f32::INFINITY, "ms" in MILLISECONDS: 0.0..=f32::INFINITY,
            safe 0.5..=16.0, "a tick of 1/60 s has 16.7";
        /// How many times longer than estimated hair takes on the players' machines. Estimates are of
        /// one core, with AVX-512, of a server that others use too.
        pub slowness: f32 = 1.0, in SLOWNESS: 1e-3..=1e3, safe 0.5..=10.0,
            "2 is a machine of half the speed";
    }
}

/// The estimated time of a tick of all hair, compared with the [`HairBudget`]. A resource, kept by the
/// tick.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct HairEstimate {
    /// At the levels chosen by size on the screen alone (ms a tick on one thread).
    pub unbudgeted: f32,
    /// At the present levels (ms a tick on one thread).
    pub present: f32,
}

/// Time of a simulated segment in a substep (ms). The presets, walking, with contact and a body,
/// took 115 to 240 ns in `cargo bench --bench game`; the median of seven is 170.
const SEGMENT: f32 = 170e-6;

/// Time of a follower's segment, each tick (ms): from the same bench's twenty hairs in the
/// background, without their simulated part.
const FOLLOWER_SEGMENT: f32 = 90e-6;

/// Time of any segment, each tick, at every level (ms): the same bench's hundred frozen hairs took
/// 13 ns, which includes their [`HAIR`].
const KEPT_SEGMENT: f32 = 10e-6;

/// Fixed time of a hair, each tick (ms).
const HAIR: f32 = 0.01;

/// How many times longer a simulated segment takes on wet hair, with its film, bridges and droplets: a worn head takes
/// 1.4 times as long in rain, 1.3 to 2.5 times dripping and drying.
const WET: f32 = 2.0;

/// Factor by which importance grows with each level that the budget has made a hair coarser: about the
/// ratio of successive levels' limits.
const COARSENESS_WEIGHT: f32 = 3.0;

/// A hair's input to the budget.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// Hair with less is made coarser first.
    pub importance: f32,
    /// The level that it would have without a budget.
    pub wanted: usize,
    /// Time at each level (ms), the full one first.
    pub costs: Vec<f32>,
}

/// Time of a hair of `segments` segments in full and at each of its levels (ms per tick).
pub(super) fn costs(
    levels: &[LodLevel],
    segments: usize,
    substeps: u32,
    is_wet: bool,
) -> impl Iterator<Item = f32> {
    let full = LodLevel { substeps: 2, strands: 1.0, ..default() };
    core::iter::once(full).chain(levels.iter().copied()).map(move |level| {
        let steps = substeps.div_ceil(level.substeps.max(full.substeps)) as f32;
        let wet = if is_wet { WET } else { 1.0 };
        let simulated = wet * SEGMENT * level.strands * steps;
        let followers =
            if level.strands > 0.0 { FOLLOWER_SEGMENT * (1.0 - level.strands) } else { 0.0 };
        HAIR + segments as f32 * (KEPT_SEGMENT + simulated + followers)
    })
}

/// The level of each hair with which all fit into `budget` (ms), or their coarsest ones.
pub(super) fn fit(hairs: &[Candidate], budget: f32) -> Vec<usize> {
    let mut levels: Vec<usize> = hairs.iter().map(|h| h.wanted).collect();
    let mut left: f32 = budget - hairs.iter().map(|h| h.costs[h.wanted]).sum::<f32>();
    if left >= 0.0 {
        return levels;
    }
    let next = |i: usize, level: usize| {
        let hair = &hairs[i];
        let weight = COARSENESS_WEIGHT.powi((level - hair.wanted) as i32);
        (level + 1 < hair.costs.len()).then_some(Reverse(Next(hair.importance * weight, i)))
    };
    let mut coarser: BinaryHeap<_> = (0..hairs.len()).filter_map(|i| next(i, levels[i])).collect();
    while left < 0.0
        && let Some(Reverse(Next(_, i))) = coarser.pop()
    {
        left += hairs[i].costs[levels[i]] - hairs[i].costs[levels[i] + 1];
        levels[i] += 1;
        coarser.extend(next(i, levels[i]));
    }
    levels
}

/// A hair that may become coarser, by its weighted importance; of equal ones the first.
struct Next(f32, usize);

impl Ord for Next {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(self.1.cmp(&other.1))
    }
}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Next {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Next {}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hair(importance: f32) -> Candidate {
        Candidate { importance, wanted: 0, costs: vec![4.0, 2.0, 0.5, 0.01] }
    }

    #[test]
    fn the_least_important_gets_coarser_first_and_a_large_budget_changes_nothing() {
        let hairs = [hair(1.0), hair(0.1), hair(0.2)];
        assert_eq!(fit(&hairs, f32::INFINITY), [0, 0, 0]);
        assert_eq!(fit(&hairs, 12.0), [0, 0, 0]);
        assert_eq!(fit(&hairs, 11.0), [0, 1, 0]);
        assert_eq!(fit(&hairs, 9.0), [0, 1, 1]);
        assert_eq!(fit(&hairs, 5.5), [0, 2, 2]);
        assert_eq!(fit(&hairs, 0.0), [3, 3, 3], "as little as there is");
        assert_eq!(fit(&[], 0.0), [] as [usize; 0]);
    }

    #[test]
    fn a_city_of_hairs_is_fitted_in_a_frame() {
        let hairs: Vec<_> = (0..30_000).map(|i| hair(1.0 + (i * 7919 % 30_000) as f32)).collect();
        let start = std::time::Instant::now();
        let levels = fit(&hairs, 0.2 * 30_000.0);
        let seconds = start.elapsed().as_secs_f32();
        let of = |importance: f32| {
            levels[hairs.iter().position(|h| h.importance == importance).unwrap()]
        };
        assert_eq!((of(1.0), of(30_000.0)), (3, 2));
        // Hundredths of a second; of the order of the square it would be tens of seconds.
        assert!(seconds < 3.0, "{seconds} s");
    }

    #[test]
    fn coarser_levels_are_estimated_to_be_cheaper() {
        let levels = [LodLevel::NEAR, LodLevel::BACKGROUND, LodLevel::FROZEN];
        let costs: Vec<f32> = costs(&levels, 10_000, 6, false).collect();
        assert!(costs.windows(2).all(|c| c[1] < 0.6 * c[0]), "{costs:?}");
        assert!(costs[3] < 0.03 * costs[0]);
    }

    proptest! {
        #[test]
        fn what_fits_fits_and_nothing_gets_finer_than_it_wants(
            given in proptest::collection::vec((0.0f32..1.0, 0usize..4), 0..20),
            budget in 0.0f32..40.0,
        ) {
            let hairs: Vec<_> =
                given.iter().map(|(importance, wanted)| Candidate { wanted: *wanted, ..hair(*importance) }).collect();
            let levels = fit(&hairs, budget);
            let cost: f32 = hairs.iter().zip(&levels).map(|(h, l)| h.costs[*l]).sum();
            prop_assert!(cost <= budget + 1e-3 || levels.iter().all(|l| *l == 3));
            prop_assert!(hairs.iter().zip(&levels).all(|(h, l)| *l >= h.wanted));
        }
    }
}
