//! A walk through a small world: rain, a lake to wade into, a campfire to dry at, a crowd of passers-by, a barber's
//! chair in the pause menu, and a saved game.
//!
//! Arrows walk, space jumps, R is rain, H puts a hat on, T ties a ponytail, X cuts to the chin, P pauses, F5 saves, F9 loads.
//! Without a key the character goes its round by itself.
//!
//! `cargo run --release --example game`

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
        // Hair dries in minutes, players wait seconds.
        .insert_resource(HairProcessTime(60.0))
        // The hero comes first by its importance.
        .insert_resource(HairBudget { milliseconds: 8.0, ..default() })
        .init_resource::<Saved>()
        .insert_resource(ClearColor(Color::srgb(0.45, 0.52, 0.6)))
        .add_systems(Startup, (world, characters))
        .add_systems(Update, (walk, stroll, turn_heads, follow, weather, barber, report))
        .add_systems(Update, (pause, save_or_load))
        .add_observer(remember);
    register(&mut app);
    app.run();
}

/// Who the player is.
#[derive(Component, Default)]
struct Hero {
    /// Above the ground (m), and upward (m/s).
    height: f32,
    rise: f32,
    /// Since a key moved it (s).
    idle: f32,
}

/// A passer-by, with its own place on the round.
#[derive(Component)]
struct Walker(f32);

#[derive(Component)]
struct Hat;

/// The saved game: the hairdos of hair and beard.
#[derive(Resource, Default)]
struct Saved(Vec<Vec<u8>>);

const LAKE: Vec3 = Vec3::new(-5.0, 0.0, 0.0);
const FIRE: Vec3 = Vec3::new(3.0, 0.0, 0.0);

/// Height of the ground; the lake is as deep as a character's shoulders are high.
fn ground(at: Vec3) -> f32 {
    let shore = (3.2 - at.with_y(0.0).distance(LAKE)).clamp(0.0, 1.6) / 1.6;
    -1.4 * shore * shore * (3.0 - 2.0 * shore)
}

fn world(mut commands: Commands, assets: Res<AssetServer>) {
    let plain = |color: Color| MeshMaterial3d(assets.add(StandardMaterial::from(color)));
    commands.spawn((
        Mesh3d(assets.add(Plane3d::default().mesh().size(60.0, 60.0).build())),
        plain(Color::srgb(0.3, 0.38, 0.22)),
    ));
    commands.spawn((HairCollider::plane(Dir3::Y), Transform::from_xyz(0.0, -1.4, 0.0)));
    let lying = Quat::from_rotation_x(-core::f32::consts::FRAC_PI_2);
    commands.spawn((
        Mesh3d(assets.add(Circle::new(3.0).mesh().build())),
        plain(Color::srgb(0.15, 0.28, 0.36)),
        Transform::from_translation(LAKE + Vec3::Y * 0.01).with_rotation(lying),
    ));
    if let Ok(lake) = WaterVolume::pool(Vec3::new(3.0, 0.7, 3.0)) {
        commands.spawn((lake, Transform::from_translation(LAKE - Vec3::Y * 0.7)));
    }
    commands.spawn((
        WindZone::fire(),
        Transform::from_translation(FIRE),
        Mesh3d(assets.add(Cone::new(0.3, 0.4).mesh().build())),
        plain(Color::srgb(0.4, 0.38, 0.36)),
        PointLight { color: Color::srgb(1.0, 0.6, 0.3), intensity: 200_000.0, ..default() },
    ));
    commands.insert_resource(HairWind { velocity: Vec3::X * 1.5, ..default() });
    commands.spawn((
        DirectionalLight { illuminance: 7000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(2.0, 4.0, 3.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((Camera3d::default(), AmbientLight { brightness: 400.0, ..default() }, {
        Transform::from_xyz(0.0, 1.8, 6.0).looking_at(Vec3::Y * 1.4, Vec3::Y)
    }));
}

fn characters(mut commands: Commands, assets: Res<AssetServer>) {
    let figure: Handle<_> = assets.load(GltfAssetLabel::Scene(0).from_asset("figure.glb"));
    let detail = HairLod { importance: 10.0, ..default() };
    commands
        .spawn((
            Hero { idle: 10.0, ..default() },
            WorldAssetRoot(figure.clone()),
            WearHair::new(HairPreset::Long).and(HairPreset::Beard),
            detail,
        ))
        .observe(|failed: On<HairNotWorn>| error!("{}", failed.error));
    let crowd = [HairPreset::Curly, HairPreset::Short, HairPreset::Bob];
    for (i, preset) in (0..).zip(crowd) {
        commands.spawn((
            Walker(i as f32),
            WorldAssetRoot(figure.clone()),
            WearHair { seed: i, ..WearHair::new(preset) },
            HairLod::default(),
        ));
    }
}

/// The player's character: by keys, and by itself when there were none for a while.
fn walk(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    hero: Single<(&mut Hero, &mut Transform)>,
) {
    let (mut hero, mut at) = hero.into_inner();
    let dt = time.delta_secs();
    let axis = |more: KeyCode, less: KeyCode| {
        f32::from(u8::from(keys.pressed(more))) - f32::from(u8::from(keys.pressed(less)))
    };
    let mut way = Vec3::new(axis(ArrowRight, ArrowLeft), 0.0, axis(ArrowDown, ArrowUp));
    hero.idle = if way == Vec3::ZERO { hero.idle + dt } else { 0.0 };
    if hero.idle > 10.0 {
        // Between the lake and the fire.
        let goal = (LAKE + FIRE) * 0.5 + (LAKE - FIRE) * 0.5 * (0.25 * time.elapsed_secs()).sin();
        way = (goal + Vec3::Z - at.translation).with_y(0.0);
    }
    let way = way.clamp_length_max(1.0);
    at.translation += 1.6 * dt * way;
    if let Some(ahead) = way.try_normalize() {
        let facing = Transform::default().looking_to(-ahead, Vec3::Y).rotation;
        at.rotation = at.rotation.slerp(facing, (6.0 * dt).min(1.0));
    }
    if hero.height == 0.0 {
        hero.rise = if keys.just_pressed(Space) { 4.0 } else { 0.0 };
    }
    hero.rise -= 9.81 * dt;
    hero.height = (hero.height + hero.rise * dt).max(0.0);
    at.translation.y = ground(at.translation) + hero.height;
}

/// The crowd goes round and round.
fn stroll(time: Res<Time>, mut crowd: Query<(&Walker, &mut Transform)>) {
    for (Walker(place), mut at) in &mut crowd {
        let (sine, cosine) = (0.3 * time.elapsed_secs() + 2.1 * place).sin_cos();
        at.translation = Vec3::new(3.0 * cosine, 0.0, -3.5 + 1.5 * sine);
        at.look_to(Vec3::new(3.0 * sine, 0.0, -1.5 * cosine), Vec3::Y);
    }
}

/// Stands for an animation.
fn turn_heads(time: Res<Time>, mut bones: Query<(Entity, &Name, &mut Transform)>) {
    for (bone, _, mut at) in bones.iter_mut().filter(|(_, name, _)| name.as_str() == "Head") {
        let phase = 1.3 * time.elapsed_secs() + bone.index_u32() as f32;
        at.rotation = Quat::from_rotation_y(0.5 * phase.sin());
    }
}

fn follow(
    hero: Single<&Transform, With<Hero>>,
    mut camera: Single<&mut Transform, (With<Camera3d>, Without<Hero>)>,
) {
    let at = hero.translation.with_y(0.6 * hero.translation.y);
    camera.translation = camera.translation.lerp(at + Vec3::new(0.5, 1.75, 2.2), 0.08);
    camera.look_at(at + Vec3::Y * 1.35, Vec3::Y);
}

fn weather(
    keys: Res<ButtonInput<KeyCode>>,
    hero: Single<&Transform, With<Hero>>,
    mut rain: Query<(Entity, &mut Transform), (With<Shower>, Without<Hero>)>,
    mut commands: Commands,
) {
    let falls = !rain.is_empty();
    for (shower, mut at) in &mut rain {
        // Rain falls everywhere; it is simulated where the hero is.
        at.translation = at.translation.with_x(hero.translation.x).with_z(hero.translation.z);
        if keys.just_pressed(KeyR) {
            commands.entity(shower).despawn();
        }
    }
    if keys.just_pressed(KeyR) && !falls {
        commands.spawn(Shower::rain_on(hero.translation + Vec3::Y * 1.7));
    }
}

/// In the pause menu too. What is put on goes with the hair.
fn barber(
    keys: Res<ButtonInput<KeyCode>>,
    hero: Single<(Entity, &WornHair), With<Hero>>,
    (ties, hats): (Query<Entity, With<HairTie>>, Query<Entity, With<Hat>>),
    assets: Res<AssetServer>,
    mut commands: Commands,
) -> Result {
    let (hero, worn) = hero.into_inner();
    let Some(hair) = worn.iter().next() else { return Ok(()) };
    if keys.just_pressed(KeyX) {
        let level = CutBy::Plane { point: Vec3::NEG_Y * 0.09, normal: Vec3::NEG_Y };
        commands.trigger(CutHair::all(hero, level));
    }
    if keys.just_pressed(KeyT) && !ties.is_empty() {
        ties.iter().for_each(|tie| commands.entity(tie).despawn());
    } else if keys.just_pressed(KeyT) {
        let out = Vec3::new(0.0, 0.3, 0.95).normalize();
        let behind = Transform::from_translation(0.12 * out)
            .with_rotation(Quat::from_rotation_arc(Vec3::Y, out));
        let tie = commands.spawn((HairTie::default(), behind, ChildOf(hair))).id();
        commands.trigger(TieHair::all(hair, tie));
    }
    if keys.just_pressed(KeyH) && !hats.is_empty() {
        hats.iter().for_each(|hat| commands.entity(hat).despawn());
    } else if keys.just_pressed(KeyH) {
        let straw = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.7, 0.55, 0.3))));
        let part = |radius: f32, height: f32, at: f32| {
            let place = Transform::from_xyz(0.0, at, 0.0).with_scale(Vec3::new(1.0, 1.0, 1.2));
            (Mesh3d(assets.add(Cylinder::new(radius, height).mesh().build())), straw.clone(), place)
        };
        let parts = children![part(0.1, 0.08, 0.09), part(0.17, 0.005, 0.05)];
        let inside = HairCollider::inside(Vec3::new(0.1, 0.13, 0.12), 0.05)?;
        commands.spawn((Hat, inside, Visibility::default(), ChildOf(hair), parts));
    }
    Ok(())
}

fn pause(keys: Res<ButtonInput<KeyCode>>, mut time: ResMut<Time<Virtual>>) {
    if keys.just_pressed(KeyP) {
        if time.is_paused() { time.unpause() } else { time.pause() }
    }
}

fn save_or_load(
    keys: Res<ButtonInput<KeyCode>>,
    hero: Single<Entity, With<Hero>>,
    mut saved: ResMut<Saved>,
    mut commands: Commands,
) -> Result {
    if keys.just_pressed(F5) {
        saved.0.clear();
        commands.trigger(CaptureHairdo { entity: *hero });
    }
    for bytes in saved.0.iter().filter(|_| keys.just_pressed(F9)) {
        commands.trigger(ApplyHairdo { entity: *hero, hairdo: Hairdo::from_bytes(bytes)? });
    }
    Ok(())
}

fn remember(taken: On<HairdoCaptured>, mut saved: ResMut<Saved>) {
    saved.0.push(taken.hairdo.to_bytes());
}

fn report(
    time: Res<Time>,
    hero: Single<&WornHair, With<Hero>>,
    condition: HairCondition,
    estimate: Res<HairEstimate>,
) {
    if time.elapsed_secs() % 5.0 < time.delta_secs() {
        for hair in hero.iter() {
            let wet = 100.0 * condition.wetness(hair);
            info!("{wet:.0} % wet, all hair {:.1} ms a tick", estimate.present);
        }
    }
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
