//! Cutting hair.
//!
//! [`CutHair`] on a hair, or on who wears it, removes what is beyond a plane or a length from its strands, simulated
//! and drawn alike: nodes, bonds and water beyond the cut are gone, what is left keeps its shape, its bonds and its
//! water. [`HairCut`] on the hair tells how many strands were cut. A [`Hairdo`](crate::Hairdo) keeps the cut, and puts it
//! on hair that has grown from the same preset.

mod model;
mod systems;

pub use systems::CutPlugin;

use super::region::StrandRegion;
use bevy::prelude::*;

/// Where hair is cut.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub enum CutBy {
    /// Each strand at this length along it from its root (m), 1 mm or more. Shorter ones stay as they are.
    Length(f32),
    /// Each strand where it first goes through a plane: scissors that are drawn along a comb. Strands whose roots are
    /// beyond the plane are not cut.
    Plane {
        /// A point of the plane (m, in the hair's frame).
        point: Vec3,
        /// Its normal, of any length, towards what is cut off.
        normal: Vec3,
    },
}

impl Default for CutBy {
    /// A bob.
    fn default() -> Self {
        Self::Length(0.25)
    }
}

/// A request to cut a hair: an event on its entity. It is cut at once, with time paused too. The answer is [`HairCut`].
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// /// Ends 12 cm below the middle of the head, all round.
/// fn bob(mut commands: Commands, hair: Entity) {
///     let level = CutBy::Plane { point: Vec3::NEG_Y * 0.12, normal: Vec3::NEG_Y };
///     commands.trigger(CutHair::all(hair, level));
/// }
/// ```
///
/// Nodes that are held beyond the cut are free, a strand whose node in a [`HairTie`](crate::HairTie) is cut off leaves it,
/// and winding on a rod begins again. Hair on the GPU is cut on the processor and goes back. Water on what is cut off is
/// entered in the [`WaterLedger`](crate::WaterLedger) as drained. At least 1 mm stays of each strand.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct CutHair {
    /// The [`Hair`](crate::Hair), or who wears it: then all that it wears.
    #[event_target]
    pub hair: Entity,
    /// Where.
    pub by: CutBy,
    /// Which of its strands.
    pub region: StrandRegion,
}

impl CutHair {
    /// All strands.
    pub fn all(hair: Entity, by: CutBy) -> Self {
        Self { hair, by, region: StrandRegion::All }
    }
}

/// A hair has been cut: an event on the hair.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairCut {
    /// The [`Hair`](crate::Hair).
    #[event_target]
    pub hair: Entity,
    /// Where.
    pub by: CutBy,
    /// Which of its strands were to be cut.
    pub region: StrandRegion,
    /// How many simulated strands were cut.
    pub strands: usize,
    /// How many were not, because less than 1 mm would have been left of them.
    pub refused: usize,
    /// How much was cut off these strands, together (m).
    pub length: f32,
}
