//! The wet-hair paper's strand: masses and springs, for comparison and for cheap distant hair.
//!
//! \[W\] equation 1 with a true damper, springs to the next and to the next-but-one node, stepped so
//! that no step can blow up. The same forces, droplets, colliders and contacts act on it as on rods.
//! Side-chain bonds do **not**: it is straight at rest and remembers nothing. Choose it with
//! [`StrandModel::MassSpring`](crate::StrandModel) on a [`Hair`](crate::Hair).

pub(crate) mod block;
pub mod model;

use crate::base::setting::setting;
use bevy::prelude::*;

setting! {
    /// The springs of a mass-spring strand, per mass of a node. Component of a [`Hair`](crate::Hair);
    /// where absent, [`HairDefault<Springs>`](crate::HairDefault) holds.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct Springs {
        /// k/m of springs to the next node. High, because a drop weighs fifty times as much as the node
        /// that bears it.
        pub stretch: f32 = 1e7, "1/s²" in STRETCH: 1.0..=1e12, safe 1e4..=1e8,
            "1e7 hardly stretches";
        /// k/m of springs to the next-but-one node, which resist bending. A straight pair of segments
        /// hardly resists a small bend: a property of the model.
        pub bend: f32 = 1e4, "1/s²" in BEND: 0.0..=1e12, safe 0.0..=1e7, "1e4 bends easily";
        /// c/m of the dampers along the springs. They hardly act on a swing, which changes no spring's length: the air
        /// brings it to rest, by a factor e a second at the default [`AirDrag`](crate::AirDrag).
        pub damping: f32 = 10.0, "1/s" in DAMPING: 0.0..=1e6, safe 0.0..=1000.0,
            "10 calms stretching within a second";
        /// Iterations per substep: more make bending more accurate.
        pub iterations: u32 = 2, in ITERATIONS: 1.0..=1000.0, safe 1.0..=50.0, "2 are usual";
    }
}
