//! What a scene came to, in numbers.

use super::{Director, Treated};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// The largest segment strain since the scene began.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct StrainPeak(pub f32);

pub fn watch_strain(strands: Query<&Strand>, mut peak: ResMut<StrainPeak>) {
    // A NaN must not pass for no strain.
    peak.0 = strands
        .iter()
        .map(Strand::peak_strain)
        .fold(peak.0, |a, b| if b <= a || a.is_nan() { a } else { b });
}

/// wet: what droplets have done to hair that had settled dry.
#[derive(Resource, Clone, Debug, Default)]
pub struct Lift {
    /// How high each node was, strand by strand (m); empty until droplets fall.
    pub dry: Vec<f32>,
    /// How much higher than that any has come since, and is now (m).
    pub highest: f32,
    pub now: f32,
    /// The most droplets that there were at a time.
    pub droplets: usize,
}

/// How high each node is, strand by strand (m).
pub fn heights<'a>(strands: impl Iterator<Item = &'a Strand>) -> Vec<f32> {
    strands.flat_map(|s| s.positions()).map(|p| p.y).collect()
}

pub fn watch_lift(
    hairs: Query<&Strands, With<Treated>>,
    strands: Query<&Strand>,
    droplets: Query<&Droplet>,
    mut lift: ResMut<Lift>,
) {
    if lift.dry.is_empty() {
        return;
    }
    let own = hairs.iter().flat_map(|members| members.iter());
    let rise = heights(own.filter_map(|s| strands.get(s).ok()))
        .into_iter()
        .zip(&lift.dry)
        .map(|(now, dry)| now - dry);
    let now = rise.fold(0.0, f32::max);
    (lift.highest, lift.now) = (lift.highest.max(now), now);
    lift.droplets = lift.droplets.max(droplets.iter().len());
}

/// Ω of every joint, by strand.
pub fn shapes<'a>(strands: impl Iterator<Item = &'a Strand>) -> Vec<Vec<Vec3>> {
    strands.map(|s| (0..s.edges()).map(|i| s.darboux(i).xyz()).collect()).collect()
}

/// The share of `held` that is in `now`: Σ Ω·Ω_held / Σ Ω_held². NaN before anything was held.
pub fn kept(now: &[Vec<Vec3>], held: &[Vec<Vec3>]) -> f64 {
    let (mut dot, mut norm) = (0.0, 0.0);
    for (now, held) in now.iter().flatten().zip(held.iter().flatten()) {
        dot += now.dot(*held) as f64;
        norm += held.length_squared() as f64;
    }
    dot / norm
}

/// The mean radius of curvature from sin(θ/2) = l/(2R) (m), over the joints that are on the curl:
/// those that `held` bends at least three quarters as much as its most bent one, so not the one where it
/// goes on the rod. None for straight hair.
pub fn curl_radius(shapes: &[Vec<Vec3>], held: &[Vec<Vec3>], segment: f32) -> Option<f64> {
    let most = held.iter().flatten().map(|o| o.length()).fold(0.0, f32::max);
    let (mut sum, mut n) = (0.0, 0);
    for (now, held) in shapes.iter().flatten().zip(held.iter().flatten()) {
        if held.length() >= 0.75 * most {
            sum += f64::from(segment / (2.0 * now.length()));
            n += 1;
        }
    }
    let mean = sum / f64::from(n.max(1));
    (n > 0 && mean < 10.0).then_some(mean)
}

/// How many turns a strand makes from root to tip, on average: the angle of all its joints' rotation
/// taken together.
pub fn turns(shapes: &[Vec<Vec3>]) -> f64 {
    let angle = |o: &Vec3| (2.0 * o.length().min(1.0).asin()) as f64;
    let total: f64 = shapes.iter().flatten().map(angle).sum();
    total / core::f64::consts::TAU / shapes.len().max(1) as f64
}

/// Least, mean and most of the hydrogen bonds' rates.
pub fn hydrogen<'a>(bonds: impl Iterator<Item = &'a Bonds>) -> (f32, f64, f32) {
    let (mut low, mut high, mut sum, mut n) = (f32::INFINITY, f32::NEG_INFINITY, 0.0, 0);
    for b in bonds.flat_map(|b| b.rates(BondKind::Hydrogen)) {
        (low, high, sum, n) = (low.min(b), high.max(b), sum + b as f64, n + 1);
    }
    (low, sum / n.max(1) as f64, high)
}

/// What the bonds alone would rest in, by strand.
pub fn remembered<'a>(
    bonds: impl Iterator<Item = &'a Bonds>,
    influence: &BondInfluence,
) -> Vec<Vec<Vec3>> {
    let f = influence.as_array();
    bonds.map(|b| b.joints.iter().map(|j| j.relaxed(&f)).collect()).collect()
}

/// The share of `held` that the bonds alone would rest in.
pub fn kept_at_rest<'a>(bonds: impl Iterator<Item = &'a Bonds>, held: &[Vec<Vec3>]) -> f64 {
    kept(&remembered(bonds, &BondInfluence::default()), held)
}

/// The mean of the joints' rates, weighted by how much each is bent: Σ b Ω² / Σ Ω².
pub fn weighted_rate(rates: &[Vec<f32>], held: &[Vec<Vec3>]) -> f64 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for (rate, shape) in rates.iter().flatten().zip(held.iter().flatten()) {
        let bent = f64::from(shape.length_squared());
        sum += f64::from(*rate) * bent;
        weight += bent;
    }
    sum / weight
}

/// The strands' tips (m).
pub fn tips<'a>(strands: impl Iterator<Item = &'a Strand>) -> Vec<Vec3> {
    strands.filter_map(|s| s.positions().last().copied()).collect()
}

/// Spearman's rank correlation.
pub fn rank_correlation(pairs: &[(f32, f32)]) -> f64 {
    let ranks = |pick: fn(&(f32, f32)) -> f32| {
        let mut order: Vec<usize> = (0..pairs.len()).collect();
        order.sort_by(|a, b| pick(&pairs[*a]).total_cmp(&pick(&pairs[*b])));
        let mut rank = vec![0.0; pairs.len()];
        order.iter().enumerate().for_each(|(r, i)| rank[*i] = r as f64);
        rank
    };
    let (a, b) = (ranks(|p| p.0), ranks(|p| p.1));
    let mean = (pairs.len() as f64 - 1.0) / 2.0;
    let sum = |f: &dyn Fn(usize) -> f64| (0..pairs.len()).map(f).sum::<f64>();
    let covariance = sum(&|i| (a[i] - mean) * (b[i] - mean));
    let (va, vb) = (sum(&|i| (a[i] - mean).powi(2)), sum(&|i| (b[i] - mean).powi(2)));
    covariance / (va * vb).sqrt()
}

/// The share of what was held that is in the strands now; NaN before.
pub fn kept_now<'a>(director: &Director, strands: impl Iterator<Item = &'a Strand>) -> f64 {
    kept(&shapes(strands), &director.held)
}
