//! A character from a glTF file wears a preset. Keys 1 to 7 change it.
//!
//! `cargo run --release --example preset_on_gltf`

use bevy::{
    camera::{
        primitives::Aabb,
        visibility::{DynamicSkinnedMeshBounds, NoFrustumCulling, VisibilityClass},
    },
    gltf::{GltfMaterialName, GltfMeshName, GltfSceneName},
    mesh::skinning::SkinnedMesh,
    prelude::{KeyCode::*, *},
    transform::components::TransformTreeChanged,
};
use bevy_keratin::prelude::*;

fn main() {
    let mut app = App::new();
    app.add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, (turn, change));
    register(&mut app);
    app.run();
}

/// What glTF scenes are made of. Leave it out where Bevy has its default features: `reflect_auto_register` does this.
fn register(app: &mut App) {
    app.register_type::<Transform>()
        .register_type::<GlobalTransform>()
        .register_type::<TransformTreeChanged>()
        .register_type::<Visibility>()
        .register_type::<InheritedVisibility>()
        .register_type::<ViewVisibility>()
        .register_type::<VisibilityClass>()
        .register_type::<DynamicSkinnedMeshBounds>()
        .register_type::<NoFrustumCulling>()
        .register_type::<Aabb>()
        .register_type::<Name>()
        .register_type::<Children>()
        .register_type::<ChildOf>()
        .register_type::<Mesh3d>()
        .register_type::<MeshMaterial3d<StandardMaterial>>()
        .register_type::<SkinnedMesh>()
        .register_type::<GltfSceneName>()
        .register_type::<GltfMaterialName>()
        .register_type::<GltfMeshName>();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let figure = assets.load(GltfAssetLabel::Scene(0).from_asset("figure.glb"));
    // The head bone is found by its name, and where the face looks by the feet.
    commands
        .spawn((WorldAssetRoot(figure), WearHair::new(HairPreset::Curly)))
        .observe(|worn: On<HairWorn>| info!("hair {} is worn", worn.hair))
        .observe(|failed: On<HairNotWorn>| error!("{}", failed.error));
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.4, 1.62, 0.9).looking_at(Vec3::Y * 1.52, Vec3::Y),
    ));
}

/// Stands for an animation.
fn turn(time: Res<Time>, mut bones: Query<(&Name, &mut Transform)>) {
    for (_, mut bone) in bones.iter_mut().filter(|(name, _)| name.as_str() == "Head") {
        bone.rotation = Quat::from_rotation_y(0.6 * (1.5 * time.elapsed_secs()).sin());
    }
}

fn change(keys: Res<ButtonInput<KeyCode>>, mut figure: Single<&mut WearHair>) {
    let digits = [Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7];
    if let Some(pressed) = digits.into_iter().position(|key| keys.just_pressed(key)) {
        // The old hair stays until the new one is ready.
        **figure = WearHair::new(HairPreset::ALL[pressed]);
    }
}
