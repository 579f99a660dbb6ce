//! Evenly spaced roots by eliminating the most crowded of many candidates.
//!
//! Weighted sample elimination after Yuksel 2015 ("Sample Elimination for Generating Poisson Disk
//! Sample Sets"), with distances that adapt to the density map.

use super::{
    error::PlantError,
    map::PlantingMaps,
    recipe::MAX_ROOTS,
    surface::{Root, Surface},
};
use crate::base::{
    grid::{UniformGrid, compact_groups},
    lanes::LANES,
};
use core::cmp::Ordering;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use std::collections::BinaryHeap;

/// Candidates per root.
const CANDIDATES: f64 = 5.0;
/// The maximum number of candidates drawn; the density map rejects most of them on most meshes.
const MAX_DRAWN: f64 = 1e8;
/// Below this share of the density spacing does not grow any more: the radius of the neighbour
/// search would grow without limit.
const SPARSE: f32 = 0.25;

/// Roots at `density` (1/m²) times the density map.
pub(super) fn scatter(
    surface: &Surface,
    density: f32,
    seed: u64,
    maps: &PlantingMaps,
) -> Result<Vec<Root>, PlantError> {
    let unmasked = surface.area() * f64::from(density);
    let drawn = (unmasked * CANDIDATES).ceil().max(1.0);
    if drawn > MAX_DRAWN {
        return Err(PlantError::TooMany { found: unmasked });
    }
    // Whole strata; otherwise density would be wrong on meshes with few strands.
    let share = unmasked / drawn;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut choice = Xoshiro256PlusPlus::seed_from_u64(seed ^ 0x5eed_0f3a);
    let mut wanted = 0.0;
    let mut candidates = Vec::new();
    for root in surface.draw(drawn as usize, &mut random) {
        let density = maps.density_at(&root.place);
        wanted += share * f64::from(density);
        if choice.random::<f32>() < density {
            if candidates.len() >= MAX_ROOTS * CANDIDATES as usize * 2 {
                return Err(PlantError::TooMany { found: unmasked });
            }
            candidates.push((root, density.max(SPARSE)));
        }
    }
    if wanted.round() > MAX_ROOTS as f64 {
        return Err(PlantError::TooMany { found: wanted });
    }
    let wanted = wanted.round() as usize;
    let none = PlantError::NoRoots { area: surface.area() as f32, density };
    if wanted == 0 || candidates.is_empty() {
        return Err(none);
    }
    let kept = eliminate(&candidates, density, wanted);
    let least = 0.5 / density.sqrt();
    let roots = apart(kept.into_iter().map(|i| candidates[i].0).collect(), least);
    // Spatial order, because neighbours are solved side by side and share their contacts.
    let places: Vec<_> = roots.iter().map(|root| root.place.position).collect();
    Ok(compact_groups(&places, LANES).into_iter().map(|i| roots[i as usize]).collect())
}

/// Indices of the `wanted` candidates that are left, in order.
fn eliminate(candidates: &[(Root, f32)], density: f32, wanted: usize) -> Vec<usize> {
    // Twice the largest radius at which as many discs fit on the plane.
    let reach = (2.0 / (3.0_f32.sqrt() * density)).sqrt();
    let sparsest = candidates.iter().map(|c| c.1).fold(1.0, f32::min);
    let mut grid = UniformGrid::default();
    let places = || candidates.iter().map(|c| c.0.place.position).zip(0u32..);
    grid.build(reach / sparsest.sqrt(), places());
    let crowding = |i: usize, j: u32| {
        let ((a, wide), (b, narrow)) = (&candidates[i], &candidates[j as usize]);
        let square = a.place.position.distance_squared(b.place.position) * 0.5 * (wide + narrow);
        let share = 1.0 - square.sqrt() / reach;
        if i == j as usize || share <= 0.0 {
            return 0.0;
        }
        let square = share * share;
        (square * square) * (square * square)
    };
    let mut weights = vec![0.0; candidates.len()];
    for (i, weight) in weights.iter_mut().enumerate() {
        grid.for_each_near(candidates[i].0.place.position, |j| *weight += crowding(i, j));
    }
    let entry = |index: usize, weight: f32| Crowded { weight, index };
    let mut heap: BinaryHeap<_> = weights.iter().enumerate().map(|(i, w)| entry(i, *w)).collect();
    let mut is_left = vec![true; candidates.len()];
    let mut left = candidates.len();
    while left > wanted {
        let Some(top) = heap.pop() else {
            break;
        };
        // Weights only decrease, so an outdated entry is pushed back with its present weight.
        if top.weight > weights[top.index] {
            heap.push(entry(top.index, weights[top.index]));
            continue;
        }
        is_left[top.index] = false;
        left -= 1;
        grid.for_each_near(candidates[top.index].0.place.position, |j| {
            let less = weights[j as usize] - crowding(top.index, j);
            weights[j as usize] = less.max(0.0);
        });
    }
    (0..candidates.len()).filter(|i| is_left[*i]).collect()
}

/// Removes roots nearer than `least` (m) to an earlier one; these exist only where surfaces overlap.
fn apart(roots: Vec<Root>, least: f32) -> Vec<Root> {
    let mut grid = UniformGrid::default();
    grid.build(least, roots.iter().map(|r| r.place.position).zip(0u32..));
    let mut is_kept = vec![true; roots.len()];
    for i in 0..roots.len() {
        let place = roots[i].place.position;
        let mut is_free = true;
        grid.for_each_near(place, |j| {
            let other = j as usize;
            if other < i && is_kept[other] {
                is_free &= place.distance(roots[other].place.position) >= least;
            }
        });
        is_kept[i] = is_free;
    }
    roots.into_iter().zip(is_kept).filter_map(|(root, kept)| kept.then_some(root)).collect()
}

/// A candidate in the queue: the most crowded first, of equals the later one.
struct Crowded {
    weight: f32,
    index: usize,
}

impl Ord for Crowded {
    fn cmp(&self, other: &Self) -> Ordering {
        self.weight.total_cmp(&other.weight).then(self.index.cmp(&other.index))
    }
}

impl PartialOrd for Crowded {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Crowded {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Crowded {}
