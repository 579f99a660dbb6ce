//! Which drawn strands are in the streaks of layers of dye.

use crate::hair::look::{HairDye, Streaks};
use bevy::prelude::*;

/// The streaks of each layer, of layers that have any.
#[derive(Clone, Debug, Default)]
pub(super) struct DrawnStreaks(Vec<Option<Streaks>>);

impl DrawnStreaks {
    /// Updates them; returns whether they have changed.
    pub(super) fn update(&mut self, dye: &HairDye) -> bool {
        let streaks = || dye.layers.iter().map(|layer| layer.streaks);
        let has_changed = !self.0.iter().copied().eq(streaks());
        if has_changed {
            self.0.clear();
            self.0.extend(streaks());
        }
        has_changed
    }

    /// For each drawn strand, whose root at rest is given, a bit mask of the layers whose streaks it is in; a
    /// single unused word if no layer has streaks.
    pub(super) fn pack(&self, roots: &[Vec3]) -> Vec<u8> {
        let mut words = vec![0u32; 1];
        for (layer, streaks) in self.0.iter().enumerate() {
            let Some(streaks) = streaks else { continue };
            words.resize(roots.len().max(1), 0);
            for (word, is_chosen) in words.iter_mut().zip(streaks.chosen(roots)) {
                *word |= u32::from(is_chosen) << layer;
            }
        }
        bytemuck::cast_slice(&words).to_vec()
    }
}
