//! Which strands of a groom are simulated: few, but spread evenly.

use super::Groom;
use bevy::prelude::*;

impl Groom {
    /// Indices of `count` strands (or of all, if there are fewer) whose roots are spread evenly:
    /// each one is the farthest from all before it, the first the nearest to the middle. The same
    /// groom always gives the same ones, and fewer are the first of more.
    ///
    /// 500 of 50,000 take some 30 ms, ten times as many ten times as long.
    ///
    /// ```
    /// # use bevy_keratin::groom::Groom; use bevy::prelude::*;
    /// let roots = (0..5).map(|i| Vec3::X * i as f32);
    /// let groom = Groom::from_polylines(roots.map(|r| [r, r + Vec3::Y])).unwrap();
    /// assert_eq!(groom.guides(3), [2, 0, 4]);
    /// ```
    pub fn guides(&self, count: usize) -> Vec<usize> {
        let roots: Vec<Vec3> = self.roots().collect();
        let count = count.min(roots.len());
        let middle = roots.iter().map(|r| r.as_dvec3()).sum::<bevy::math::DVec3>()
            / roots.len().max(1) as f64;
        let middle = middle.as_vec3();
        // A strand that is chosen is as near as it gets, nearer than one in the same place.
        const CHOSEN: f32 = -1.0;
        let mut apart = vec![f32::MAX; roots.len()];
        let by_middle = |a: &usize, b: &usize| {
            let square = |i: usize| roots[i].distance_squared(middle);
            square(*a).total_cmp(&square(*b)).then(a.cmp(b))
        };
        let mut next = (0..roots.len()).min_by(by_middle);
        let mut chosen = Vec::with_capacity(count);
        while chosen.len() < count
            && let Some(i) = next
        {
            chosen.push(i);
            apart[i] = CHOSEN;
            let from = roots[i];
            let (mut farthest, mut distance) = (None, CHOSEN);
            for (k, (root, apart)) in roots.iter().zip(&mut apart).enumerate() {
                *apart = apart.min(root.distance_squared(from));
                if *apart > distance {
                    (farthest, distance) = (Some(k), *apart);
                }
            }
            next = farthest;
        }
        chosen
    }

    /// Where the strands grow (m).
    pub fn roots(&self) -> impl ExactSizeIterator<Item = Vec3> {
        (0..self.len()).map(|i| self.points[self.nodes_of(i).start])
    }

    /// The mean diameter of all nodes (m), if the groom has widths.
    pub fn mean_width(&self) -> Option<f32> {
        let sum: f64 = self.widths.iter().map(|w| f64::from(*w)).sum();
        (!self.widths.is_empty()).then(|| (sum / self.widths.len() as f64) as f32)
    }

    /// The mean colour of all nodes, if the groom has colours.
    pub fn mean_color(&self) -> Option<LinearRgba> {
        let sum = self.colors.iter().fold([0.0_f64; 4], |sum, c| {
            let c = c.to_f32_array().map(f64::from);
            core::array::from_fn(|k| sum[k] + c[k])
        });
        let count = self.colors.len() as f64;
        (!self.colors.is_empty())
            .then(|| LinearRgba::from_f32_array(sum.map(|s| (s / count) as f32)))
    }
}
