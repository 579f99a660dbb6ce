//! How wet strands look.

use bevy::prelude::*;

/// How wet each node of a strand looks, root first: 0 dry, 1 soaked. Component of a strand for those
/// who know better than its water ([`Moisture::sheen`](crate::Moisture::sheen)), which is what shows
/// where this is absent. Wet hair is drawn darker, in tighter locks with a film's sheen on each ([`HairFollowers::wet_clump`](super::HairFollowers::wet_clump)).
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct WetLook(pub Vec<f32>);
