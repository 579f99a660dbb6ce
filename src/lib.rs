// Only where it is shown or tried: an edit of it builds nothing else again.
#![cfg_attr(any(doc, doctest), doc = include_str!("../README.md"))]
#![cfg_attr(not(any(doc, doctest)), doc = "Hair for the Bevy game engine that remembers.")]
#![doc = include_str!("base/guide/substep.md")]
#![doc = include_str!("base/guide/glossary.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![deny(unsafe_code)]

#[cfg(feature = "groom")]
pub mod authoring;
pub mod base;
pub mod debug;
pub mod forces;
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod hair;
pub mod hairdo;
pub mod keratin;
pub mod plugins;
#[cfg(feature = "render")]
pub mod render;
pub mod simulation;
pub mod solver;
pub mod water;

#[doc(inline)]
pub use prelude::*;

/// All types of components, resources, settings, events and errors that games use. Each room lists its own.
pub mod prelude {
    #[cfg(feature = "groom")]
    pub use crate::authoring::prelude::*;
    #[cfg(feature = "gpu")]
    pub use crate::gpu::prelude::*;
    #[cfg(feature = "render")]
    pub use crate::render::prelude::*;
    pub use crate::{
        base::prelude::*,
        debug::prelude::*,
        forces::prelude::*,
        hair::prelude::*,
        hairdo::prelude::*,
        keratin::prelude::*,
        plugins::{HairPlugins, run_ticks},
        simulation::prelude::*,
        solver::prelude::*,
        water::prelude::*,
    };
}

/// The book's samples, as doc tests.
#[cfg(all(doctest, feature = "groom", feature = "render", feature = "save", feature = "gpu"))]
mod book {
    macro_rules! chapters {
        ($($name:ident: $file:literal,)*) => {$(#[doc = include_str!(concat!("../docs/src/", $file))] struct $name;)*};
    }
    chapters! {
        Blender: "blender.md",
        Character: "character.md",
        Colliders: "colliders.md",
        Contact: "contact.md",
        Debug: "debug.md",
        FirstHour: "first-hour.md",
        Grooms: "grooms.md",
        Recipes: "recipes.md",
        Rollback: "rollback.md",
        Saving: "saving.md",
        Styling: "styling.md",
        Water: "water.md",
        Weather: "weather.md",
        Worlds: "worlds.md",
    }
}
