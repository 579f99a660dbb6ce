//! How wet strands look.

use bevy::prelude::*;

/// How wet each node of a strand looks, root first: 0 dry, 1 soaked. Optional component of a strand
/// that overrides its water ([`Moisture::sheen`](crate::Moisture::sheen)) in drawing. Wet hair is
/// drawn darker, with a film's sheen and in tighter locks
/// ([`HairFollowers::wet_clump`](super::HairFollowers::wet_clump)).
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct WetLook(pub Vec<f32>);
