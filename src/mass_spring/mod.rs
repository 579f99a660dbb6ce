//! The wet-hair paper's strand: masses and springs, for comparison and for cheap far hair.
//!
//! \[W\] equation 1 with a true damper, springs to the next and to the next-but-one node, stepped so
//! that no step can blow up. The same forces, droplets, colliders and contacts act on it as on rods.
//! Side-chain bonds do **not**: it is straight at rest and remembers nothing. Choose it with
//! [`StrandModel::MassSpring`](crate::StrandModel) on a [`Hair`](crate::Hair).

pub(crate) mod block;
pub mod model;

use crate::setting::{Bound, HairSetting, Notes};
use bevy::prelude::*;

/// The springs of a mass-spring strand, per mass of a node. Component of a [`Hair`](crate::Hair);
/// where absent, [`HairDefault<Springs>`](crate::HairDefault) holds.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct Springs {
    /// k/m of springs to the next node (1/s²). Default 1e7, safe 1e4…1e8: a drop weighs fifty
    /// times as much as the node that bears it.
    pub stretch: f32,
    /// k/m of springs to the next-but-one node, which resist bending (1/s²). Default 1e4, safe
    /// 0…1e7. A straight pair of segments resists a small bend hardly at all: that is the model's.
    pub bend: f32,
    /// c/m of the dampers along the springs (1/s). Default 10, safe 0…1000.
    pub damping: f32,
    /// Iterations a substep. Default 2, safe 1…50: more bend more exactly.
    pub iterations: u32,
}

impl Default for Springs {
    fn default() -> Self {
        Self { stretch: 1e7, bend: 1e4, damping: 10.0, iterations: 2 }
    }
}

const STRETCH: Bound = Bound::new("Springs::stretch (1/s²)", 1.0, 1e12, "1e7 hardly stretches");
const BEND: Bound = Bound::new("Springs::bend (1/s²)", 0.0, 1e12, "1e4 bends easily");
const DAMPING: Bound = Bound::new("Springs::damping (1/s)", 0.0, 1e6, "10 calms within a second");
const ITERATIONS: Bound = Bound::new("Springs::iterations", 1.0, 1000.0, "2 are usual");

impl HairSetting for Springs {
    fn mended(&self, notes: &Notes) -> Self {
        let d = Self::default();
        Self {
            stretch: STRETCH.mend(self.stretch, d.stretch, notes),
            bend: BEND.mend(self.bend, d.bend, notes),
            damping: DAMPING.mend(self.damping, d.damping, notes),
            iterations: ITERATIONS.mend(self.iterations as f32, 2.0, notes) as u32,
        }
    }
}
