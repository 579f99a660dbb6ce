//! Draws the hair.

use bevy::prelude::*;

/// Draws the hair.
pub struct HairRenderPlugin;

impl Plugin for HairRenderPlugin {
    fn build(&self, _app: &mut App) {}
}
