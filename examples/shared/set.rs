//! What every showing of a scene shares: the scene, the hair, the studio.

use crate::{
    environment,
    scenes::{self, Scene, ScenePlugin},
    stage,
};
use bevy::prelude::*;
use bevy_keratin::{
    prelude::*,
    render::{HairView, WetLook},
};

/// Puts a scene into the studio.
pub fn furnish(app: &mut App, scene: Scene, view: HairView) {
    app.insert_resource(ClearColor(Color::srgb(0.2, 0.21, 0.23)))
        .add_plugins(ScenePlugin(scene))
        .insert_resource(HairDefault(view))
        .add_systems(Startup, stage::build.before(scenes::spawn_scene))
        .add_systems(PreUpdate, surround)
        .add_systems(PostUpdate, (stage::embody, stage::slide).before(TransformSystems::Propagate))
        .add_systems(Update, look_wet);
}

/// Gives each camera the studio to be reflected, which is also what light comes from all around.
fn surround(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    mut ambient: ResMut<GlobalAmbientLight>,
    cameras: Query<Entity, Added<Camera3d>>,
) {
    for camera in &cameras {
        commands.entity(camera).insert(environment::studio(&mut images, 450.0));
        ambient.brightness = 0.0;
    }
}

/// Water that only cuts bonds, as the bonds' paper has it, shows, too: hair looks as wet as its hydrogen
/// bonds are open, where it carries no water.
fn look_wet(
    mut commands: Commands,
    strands: Query<(Entity, &Bonds, &Moisture, Option<&WetLook>), With<StrandOf>>,
) {
    for (strand, bonds, moisture, look) in &strands {
        let mut open: Vec<f32> =
            bonds.rates(BondKind::Hydrogen).map(|rate| (1.0 - rate).clamp(0.0, 1.0)).collect();
        let is_wet = moisture.is_untouched() && open.iter().any(|open| *open > 0.01);
        open.extend(open.last().copied());
        match look {
            Some(_) if !is_wet => _ = commands.entity(strand).remove::<WetLook>(),
            Some(look) if look.0 == open => {}
            _ if is_wet => _ = commands.entity(strand).insert(WetLook(open)),
            _ => {}
        }
    }
}
