//! Recipes: presets, settings and looks in files that a running app follows.
//!
//! A [`HairRecipe`] is a text file in RON: a preset, what of its planting is different, and values of components by the
//! names of their fields, each optional.
//!
//! ```ron
//! (
//!     preset: Curly,
//!     planting: (length: 0.2, curl: Some((radius: 4e-3, pitch: 15e-3))),
//!     components: {
//!         "HairLook": (melanin: (eumelanin: 0.9, pheomelanin: 0.1), roughness: 0.4),
//!         "HairStiffness": (bending_length: 0.1),
//!         "AirDrag": (rate: 3.0),
//!     },
//! )
//! ```
//!
//! `WearHair::of_recipe(assets.load("curls.recipe.ron"))` grows it; [`FollowRecipe`] puts its components on any
//! entity, such as hair from a groom. When the file is loaded again, as by Bevy's `file_watcher`, hair that grows as it did
//! gets the new settings; only where something of its growth is another it is grown again.

mod error;
mod file;
mod follow;
mod partial;
mod patch;
mod what;

pub use error::RecipeError;
pub use file::RecipeLoader;
pub use follow::FollowRecipe;
pub(crate) use follow::{Followed, apply};
pub use what::HairRecipe;

use crate::{
    base::schedule::HairFrame,
    hair::worn::{self, PassedOn},
};
use bevy::prelude::*;

/// Loads a [`HairRecipe`], and puts its components on entities with [`FollowRecipe`].
#[derive(Clone, Copy, Debug, Default)]
pub struct RecipePlugin;

impl Plugin for RecipePlugin {
    fn build(&self, app: &mut App) {
        worn::passed::<FollowRecipe>(app);
        app.register_type::<FollowRecipe>().add_observer(follow::forget);
        add_loader(app);
    }

    /// Again, for an asset server that was added later.
    fn finish(&self, app: &mut App) {
        add_loader(app);
    }
}

fn add_loader(app: &mut App) {
    let world = app.world();
    let is_there = world.contains_resource::<Assets<HairRecipe>>();
    if world.contains_resource::<AssetServer>() && !is_there {
        app.init_asset::<HairRecipe>()
            .init_asset_loader::<RecipeLoader>()
            .add_systems(HairFrame, follow::follow.after(PassedOn));
    }
}
