//! Which strands are in streaks.

use crate::base::setting::setting;
use bevy::{platform::collections::HashMap, prelude::*};

setting! {
    /// Dye on some strands only: streaks, or single strands as highlights.
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct Streaks {
        /// The share of strands that are dyed.
        pub share: f32 = 0.3, in SHARE: 0.0..=1.0, "0.3 are highlights";
        /// How wide a streak is at the scalp. At 0 each strand is dyed or not by itself.
        pub width: f32 = 8e-3, "m" in WIDTH: 0.0..=10.0, safe 0.0..=0.1, "0.008 is a foil's";
        /// The same seed chooses the same strands.
        pub seed: u32 = 0;
    }
}

/// Narrower streaks (m) are single strands.
const MIN_WIDTH: f32 = 1e-6;

impl Streaks {
    /// Which of the strands with roots at `places` (m) are in streaks.
    ///
    /// The scalp is divided into cells about as wide as a streak. Cells are chosen in a random
    /// order given by the seed, until their strands come nearest to the share: a larger share
    /// includes all strands of a smaller one.
    pub fn chosen(&self, places: &[Vec3]) -> Vec<bool> {
        let mut cells = HashMap::<IVec4, (u32, Vec<usize>)>::new();
        for (i, place) in places.iter().enumerate() {
            let cell = self.cell_of(*place).map_or(IVec4::new(i as i32, 0, 0, 1), |c| c.extend(0));
            let entry = cells.entry(cell).or_insert_with(|| (mixed(cell, self.seed), Vec::new()));
            entry.1.push(i);
        }
        let mut order: Vec<_> =
            cells.into_iter().map(|(cell, (hash, of))| (hash, cell.to_array(), of)).collect();
        order.sort_by_key(|(hash, cell, _)| (*hash, *cell));
        let wanted = f64::from(self.share) * places.len() as f64;
        let (mut chosen, mut count) = (vec![false; places.len()], 0.0);
        for (.., strands) in order {
            let with = count + strands.len() as f64;
            if with - wanted > wanted - count {
                break;
            }
            count = with;
            strands.into_iter().for_each(|i| chosen[i] = true);
        }
        chosen
    }

    /// The Voronoi cell of a root, of jittered points a width apart. `None` where there are no
    /// cells.
    fn cell_of(&self, place: Vec3) -> Option<IVec3> {
        if self.width < MIN_WIDTH || !place.is_finite() {
            return None;
        }
        let at = place / self.width;
        if at.abs().max_element() > 1e6 {
            return None;
        }
        let home = at.floor().as_ivec3();
        let near = (0..27).map(|k| home + IVec3::new(k % 3, k / 3 % 3, k / 9) - 1);
        let apart = |cell: &IVec3| {
            let hash = |axis: u32| share_of(mixed(cell.extend(2), self.seed ^ axis));
            at.distance_squared(cell.as_vec3() + Vec3::new(hash(11), hash(22), hash(33)))
        };
        near.min_by(|a, b| apart(a).total_cmp(&apart(b)))
    }
}

fn share_of(hash: u32) -> f32 {
    (hash >> 8) as f32 / 16_777_216.0
}

/// A hash of a cell.
fn mixed(cell: IVec4, seed: u32) -> u32 {
    let parts = cell.to_array().map(i32::cast_unsigned);
    parts.into_iter().fold(seed, |state, part| pcg(state ^ pcg(part)))
}

fn pcg(seed: u32) -> u32 {
    let state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}
