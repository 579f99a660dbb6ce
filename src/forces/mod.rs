//! What acts on hair from outside: [`environment`], gravity, wind and air, and [`contact`] with colliders
//! and between strands.

pub mod contact;
pub mod environment;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    #[cfg(feature = "avian")]
    pub use crate::forces::contact::{AvianHairCollider, AvianShapeError};
    pub use crate::forces::contact::{
        Bake, BakeError, ColliderShape, ContactMethod, ConvexHull, DistanceGrid, HairCollider,
        Openings, StrandContact,
    };
    pub use crate::forces::environment::{
        AirDrag, Blower, HairClimate, HairGravity, HairWind, WindReceived, WindTravel, WindZone,
        ZoneShape,
    };
}
