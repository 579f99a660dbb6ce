//! What a window leaves out where there is no graphics card.

use bevy::{prelude::*, render::renderer::RenderAdapterInfo};
use bevy_keratin::{prelude::*, render::HairFollowers};
use core::fmt;

/// What a window leaves out where there is no graphics card.
#[derive(Resource, Clone, Copy, Debug)]
pub struct Spared {
    /// The drawn strands of a hair at most.
    pub strands: u32,
}

impl Spared {
    /// By how much strands are wider where fewer than `count` are drawn.
    pub fn wider(&self, count: u32) -> f32 {
        (count as f32 / self.strands as f32).sqrt().clamp(1.0, 2.5)
    }
}

impl fmt::Display for Spared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Drawn in software: at most {} thicker strands a hair, no shadows, hardly any light \
             from behind, plain edges. With a graphics card, or by --offscreen, all is drawn.",
            self.strands
        )
    }
}

/// Drawn strands of a hair, where there is no graphics card.
const SPARED: u32 = 4000;

/// Hair that brings its own followers has as few as all.
pub fn strands(
    spared: Option<Res<Spared>>,
    mut hairs: Query<&mut HairFollowers, Added<HairFollowers>>,
) {
    let Some(spared) = spared else { return };
    for mut followers in &mut hairs {
        followers.count = followers.count.min(spared.strands);
    }
}

/// Without a graphics card a window is drawn with fewer strands and plain edges, or it would crawl.
pub fn software(
    mut commands: Commands,
    adapter: Option<Res<RenderAdapterInfo>>,
    mut followers: ResMut<HairDefault<HairFollowers>>,
    mut lights: Query<(&mut SpotLight, &Transform)>,
    mut edges: Query<&mut Msaa>,
) {
    if adapter.is_some_and(|a| format!("{:?}", a.device_type) == "Cpu") {
        commands.insert_resource(Spared { strands: SPARED });
        followers.count = followers.count.min(SPARED);
        for (mut light, place) in &mut lights {
            light.shadow_maps_enabled = false;
            // Without shadows light from behind would shine through the head.
            if place.translation.z < 0.0 {
                light.intensity *= 0.1;
            }
        }
        edges.iter_mut().for_each(|mut edges| *edges = Msaa::Off);
    }
}
