//! What a recorded swing says: one number a substep, the first one at time 0.

/// Period of a swing about 0 that is let go at its greatest (s), from its zeros; `None` where it
/// does not swing to and fro.
pub fn period(swing: &[f64], substep: f64) -> Option<f64> {
    let zeros: Vec<f64> = (swing.windows(2).enumerate())
        .filter(|(_, w)| w[0] * w[1] < 0.0)
        .map(|(i, w)| i as f64 + w[0] / (w[0] - w[1]))
        .take(ZEROS)
        .collect();
    // Whole periods: then it does not matter if zero is a little beside the middle.
    let whole = zeros.len().checked_sub(1)? / 2;
    (whole > 0).then(|| (zeros[2 * whole] - zeros[0]) / whole as f64 * substep)
}

/// Two whole periods.
pub const ZEROS: usize = 5;

/// Rate at which the energy of a swing dies (1/s): twice that of its extremes, the first of which is
/// where it is let go. `None` if it has no other.
pub fn decay(swing: &[f64], substep: f64) -> Option<f64> {
    let extreme = |w: &[f64]| (w[1] - w[0]) * (w[2] - w[1]) <= 0.0;
    let middle = swing.windows(3).enumerate().filter(|(_, w)| extreme(w)).map(|(i, _)| i + 1);
    let extremes: Vec<(f64, f64)> = (core::iter::once(0).chain(middle))
        .map(|i| (i as f64 * substep, swing[i].abs().max(f64::MIN_POSITIVE).ln()))
        .collect();
    if extremes.len() < 2 {
        return None;
    }
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| {
        extremes.iter().map(f).sum::<f64>() / extremes.len() as f64
    };
    let (t, y) = (mean(&|e| e.0), mean(&|e| e.1));
    Some(-2.0 * mean(&|e| (e.0 - t) * (e.1 - y)) / mean(&|e| (e.0 - t).powi(2)))
}

/// When a height that falls from its first value is lowest for the first time (s): its least before
/// it has come halfway back. `None` while it has not.
pub fn first_low(height: &[f64], substep: f64) -> Option<f64> {
    let mut low = 0;
    for (i, h) in height.iter().enumerate() {
        if *h < height[low] {
            low = i;
        } else if *h - height[low] > 0.5 * (height[0] - height[low]) && low > 0 {
            // The vertex of the parabola through the lowest and its neighbours.
            let [a, b, c] = [height[low - 1], height[low], height[low + 1]];
            return Some((low as f64 + 0.5 * (a - c) / (a - 2.0 * b + c)) * substep);
        }
    }
    None
}
