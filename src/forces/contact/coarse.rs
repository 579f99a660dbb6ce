//! Coarse sampling for contact of strands with segments much shorter than the contact radius.
//!
//! Equation 18 sums over all edges within reach of a node: a strand of 1,000 nodes a tenth of a
//! millimetre apart would push forty times as hard as the same strand with usual nodes, and cost a
//! thousand times as much. So contact samples nodes that are about half the reach apart, and
//! interpolates the result for the nodes between.

use glam::Vec3;

/// Sampled segments are no shorter than this share of the reach.
const FINEST: f32 = 0.5;

/// Strands with fewer nodes are not resampled.
const MIN_RESAMPLED_NODES: usize = 32;

/// Contact samples every how many nodes of a strand with these rest lengths (m): 1 for all but very
/// fine strands.
pub(super) fn stride(lengths: &[f32], reach: f32) -> usize {
    if lengths.len() < MIN_RESAMPLED_NODES {
        return 1;
    }
    let length: f32 = lengths.iter().sum();
    // `as` saturates, and NaN becomes 0.
    ((FINEST * reach * lengths.len() as f32 / length) as usize).clamp(1, lengths.len())
}

/// The sampled nodes of all strands.
#[derive(Clone, Debug, Default)]
pub(super) struct Coarse {
    /// For each strand its number of nodes and of sampled edges.
    strands: Vec<[usize; 2]>,
    nodes: usize,
    is_any: bool,
    places: Vec<Vec3>,
}

/// The node of the `k`-th sample, of a strand of `nodes` with `edges` sampled edges: root and tip are
/// always sampled.
fn node(k: usize, [nodes, edges]: [usize; 2]) -> usize {
    k * nodes.saturating_sub(1) / edges.max(1)
}

impl Coarse {
    pub fn clear(&mut self) {
        self.strands.clear();
        (self.nodes, self.is_any) = (0, false);
    }

    /// The number of nodes, sampled or not.
    pub fn nodes(&self) -> usize {
        self.nodes
    }

    /// Adds a strand. Returns the positions that are sampled.
    pub fn add<'a>(&'a mut self, nodes: &'a [Vec3], stride: usize) -> &'a [Vec3] {
        let edges = nodes.len().saturating_sub(1);
        let seen = [nodes.len(), (edges / stride.max(1)).max(edges.min(1))];
        self.strands.push(seen);
        self.nodes += nodes.len();
        if seen[1] == edges {
            return nodes;
        }
        self.is_any = true;
        self.places.clear();
        self.places.extend((0..=seen[1]).map(|k| nodes[node(k, seen)]));
        &self.places
    }

    /// Keeps the rows of the sampled nodes, of one row for each node.
    pub fn pick<T: Copy>(&self, rows: &mut Vec<T>) {
        if !self.is_any {
            return;
        }
        let (mut first, mut picked) = (0, 0);
        for &seen in &self.strands {
            // Writes never overtake reads.
            for k in 0..seen[0].min(seen[1] + 1) {
                rows[picked] = rows[first + node(k, seen)];
                picked += 1;
            }
            first += seen[0];
        }
        rows.truncate(picked);
    }

    /// Interpolates values of the sampled nodes to all nodes.
    pub fn spread<T: Copy>(
        &self,
        values: impl Iterator<Item = T>,
        lerp: fn(T, T, f32) -> T,
    ) -> impl Iterator<Item = T> {
        let mut values = values.fuse();
        // No strand is resampled: nothing to interpolate.
        let count = if self.is_any { self.strands.len() } else { 0 };
        let mut strands = self.strands[..count].iter();
        let mut between: Option<Between<T>> = None;
        core::iter::from_fn(move || {
            if count == 0 {
                return values.next();
            }
            loop {
                if let Some(b) = &mut between {
                    if b.at < b.next {
                        let t = (b.at - b.last) as f32 / (b.next - b.last) as f32;
                        b.at += 1;
                        return Some(lerp(b.from, b.to, t));
                    }
                    if b.k < b.seen[1] {
                        b.k += 1;
                        (b.last, b.next) = (b.next, node(b.k, b.seen));
                        (b.from, b.to) = (b.to, values.next()?);
                        continue;
                    }
                    let tip = b.to;
                    between = None;
                    return Some(tip);
                }
                let seen = *strands.next()?;
                if seen[0] > 0 {
                    let root = values.next()?;
                    let (k, last, next, at) = (0, 0, 0, 0);
                    between = Some(Between { seen, k, last, next, at, from: root, to: root });
                }
            }
        })
    }
}

/// State of the interpolation within a strand.
struct Between<T> {
    seen: [usize; 2],
    /// The index of `next` among the sampled nodes.
    k: usize,
    last: usize,
    next: usize,
    /// The node to be interpolated next.
    at: usize,
    from: T,
    to: T,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn only_very_fine_strands_are_resampled() {
        assert_eq!(stride(&[0.03; 8], 2e-3), 1);
        assert_eq!(stride(&[1e-4; 16], 2e-3), 1, "a strand of few nodes");
        assert_eq!(stride(&[2.4e-3; 100], 2e-3), 1);
        assert_eq!(stride(&[9e-5; 1000], 2e-3), 11);
        assert_eq!(stride(&[1e-6; 1000], 2.0), 1000);
        assert_eq!(stride(&[f32::NAN; 1000], 2e-3), 1);
        assert_eq!(stride(&[0.0; 1000], 2e-3), 1000);
    }

    proptest! {
        #[test]
        fn values_are_spread_evenly_and_rows_picked_to_match(
            strands in proptest::collection::vec((1usize..40, 1usize..50), 1..8),
        ) {
            let mut coarse = Coarse::default();
            let (mut all, mut seen) = (Vec::new(), Vec::new());
            for (s, &(nodes, stride)) in strands.iter().enumerate() {
                // Linear along the strand: what is spread is what there was.
                let values: Vec<Vec3> =
                    (0..nodes).map(|i| Vec3::new(i as f32, s as f32, 0.0)).collect();
                seen.extend_from_slice(coarse.add(&values, stride));
                all.extend(values);
            }
            prop_assert_eq!(coarse.nodes(), all.len());
            let mut picked = all.clone();
            coarse.pick(&mut picked);
            prop_assert_eq!(&picked, &seen);
            let spread: Vec<Vec3> = coarse.spread(seen.into_iter(), Vec3::lerp).collect();
            prop_assert_eq!(spread.len(), all.len());
            for (a, b) in spread.iter().zip(&all) {
                prop_assert!(a.distance(*b) < 1e-4, "{} against {}", a, b);
            }
        }
    }
}
