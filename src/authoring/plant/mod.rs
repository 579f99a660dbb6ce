//! Planting: procedural hair for a mesh.
//!
//! [`Planting`] holds density, length, direction and curl; [`PlantingMaps`] vary them over the
//! mesh; [`Planting::plant`] makes a [`Groom`](crate::authoring::groom::Groom) and the triangle of each root.
//! The same settings, mesh and seed give the same bits.
//!
//! ```
//! # use bevy_keratin::authoring::plant::*; use bevy::prelude::*;
//! let head = Sphere::new(0.09).mesh().build();
//! let upper = |place: &RootPlace| if place.position.y > 0.03 { 1.0 } else { 0.0 };
//! let fringe = Planting { density: 5e3, length: 0.06, ..default() };
//! let planted = fringe.plant_with(&head, &PlantingMaps::new().density(&upper)).unwrap();
//! assert!(planted.groom.len() > 80);
//! ```

mod error;
#[cfg(feature = "render")]
mod followers;
mod grow;
mod hairline;
mod map;
mod place;
mod planting;
mod preset;
mod preset_field;
#[cfg(feature = "render")]
mod preset_look;
mod recipe;
mod scalp;
mod scatter;
mod shell;
mod surface;

pub use error::PlantError;
#[cfg(feature = "render")]
pub(crate) use followers::FollowerPlanting;
pub use hairline::Hairline;
pub use map::{ImageMap, MapChannel, PlantingMaps, RootPlace, vertex_color};
pub(crate) use place::{SurfacePoint, surface_points};
pub use planting::{Planted, RootOnMesh};
pub use preset::{HairPreset, PresetSettings};
pub use recipe::{
    Clump, CombPattern, Curl, CurlPhase, Cut, Drape, HUMAN_DENSITY, MAX_ROOTS, Planting,
};
pub use scalp::Scalp;

use bevy::prelude::*;

/// Registers the settings of planting for reflection: inspectors, scene files.
#[derive(Clone, Copy, Debug, Default)]
pub struct PlantPlugin;

impl Plugin for PlantPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Planting>()
            .register_type::<Planted>()
            .register_type::<HairPreset>()
            .register_type::<Hairline>()
            .register_type::<PresetSettings>()
            .register_type::<Scalp>()
            .register_type::<ImageMap>()
            .register_type::<MapChannel>()
            .register_type::<RootPlace>();
    }
}
