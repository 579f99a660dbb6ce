//! How hair gathers in locks, in numbers: over the tips of its strands.

use bevy::prelude::*;
use bevy_keratin::base::grid::UniformGrid;

/// The mean distance from each tip to the nearest other one (m).
pub fn tip_spacing(tips: &[Vec3]) -> f64 {
    let nearest = nearest_distances(tips);
    nearest.iter().map(|d| f64::from(*d)).sum::<f64>() / nearest.len().max(1) as f64
}

fn nearest_distances(tips: &[Vec3]) -> Vec<f32> {
    let mut grid = UniformGrid::default();
    let mut best = vec![f32::INFINITY; tips.len()];
    // Cells grow until each tip has another in the cells around.
    let mut cell = 2e-3;
    while cell < 100.0 && best.iter().any(|d| !d.is_finite()) {
        grid.build(cell, tips.iter().zip(0..).map(|(p, i)| (*p, i)));
        for (i, p) in tips.iter().enumerate() {
            if best[i].is_finite() {
                continue;
            }
            let mut nearest = f32::INFINITY;
            grid.for_each_near(*p, |j| {
                if j as usize != i {
                    nearest = nearest.min(tips[j as usize].distance(*p));
                }
            });
            // Farther than a cell there may be a nearer one that was not looked at.
            if nearest <= cell {
                best[i] = nearest;
            }
        }
        cell *= 2.0;
    }
    best
}

/// The share of strands whose tip is in a cluster of at least three, tips within `link` (m) of each
/// other being one cluster.
pub fn clustered_share(tips: &[Vec3], link: f32) -> f64 {
    let mut grid = UniformGrid::default();
    grid.build(link.max(1e-6), tips.iter().zip(0..).map(|(p, i)| (*p, i)));
    let mut cluster: Vec<usize> = (0..tips.len()).collect();
    fn root(of: &mut [usize], mut i: usize) -> usize {
        while of[i] != i {
            of[i] = of[of[i]];
            i = of[i];
        }
        i
    }
    for (i, p) in tips.iter().enumerate() {
        grid.for_each_near(*p, |j| {
            if tips[j as usize].distance(*p) <= link {
                let (a, b) = (root(&mut cluster, i), root(&mut cluster, j as usize));
                cluster[a.max(b)] = a.min(b);
            }
        });
    }
    let mut size = vec![0usize; tips.len()];
    let roots: Vec<usize> = (0..tips.len()).map(|i| root(&mut cluster, i)).collect();
    roots.iter().for_each(|r| size[*r] += 1);
    roots.iter().filter(|r| size[**r] >= 3).count() as f64 / tips.len().max(1) as f64
}
