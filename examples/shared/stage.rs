//! The studio: three lights, a backdrop, the stand, and the models of head, rod and blower.

use crate::{
    dressed::{self, Carried},
    mannequin,
    scenes::{BUST_HIGH, HEAD_RADIUS, Model, Scene, SceneKind},
    solid::{Paint, lathe},
    studio,
};
use bevy::prelude::*;
use bevy_keratin::{authoring::plant::Hairline, render::Melanin};
use core::f32::consts::{FRAC_PI_2, PI};

/// The skull is slimmer than the ball that the hair of a bust feels by that much.
const BROAD: Vec3 = Vec3::new(1.0, 1.0, 1.12);
/// Where the stand's pole is (m).
const POLE: Vec3 = Vec3::new(-0.60, 0.0, -0.03);

/// What is made once.
#[derive(Resource)]
pub struct Studio {
    /// The head without hair.
    pub bare: Mesh,
    pub bare_mesh: Handle<Mesh>,
    /// Its scalp tinted by hair.
    head: Handle<Mesh>,
    /// Brows and lashes, of a head as it is and of one as broad as a bust's.
    faces: [Carried; 2],
    /// What is not let down of a lying head's hair.
    up: Carried,
    pub skin: Handle<StandardMaterial>,
    chrome: Handle<StandardMaterial>,
}

/// The sleeve by which the head's arm hangs on the pole.
#[derive(Component)]
pub struct Sleeve;

/// The stand's pole: away while nothing hangs on it.
#[derive(Component)]
pub struct Pole;

/// Lights, backdrop and stand, which every scene shares.
pub fn build(mut commands: Commands, mut paint: Paint) -> Result {
    let bare = mannequin::mesh();
    let faces = [
        dressed::face(Vec3::ONE, Melanin::DARK_BROWN)?,
        dressed::face(BROAD, Melanin::DARK_BROWN)?,
    ];
    let up = dressed::up(&bare)?;
    let hair = Melanin::DARK_BROWN.color();
    let mut head = bare.clone();
    dressed::scalp().tint(&mut head, &Hairline::default(), hair, 0.9);
    let head = paint.meshes.add(head);
    let bare_mesh = paint.meshes.add(bare.clone());
    let skin = paint.matte(Color::WHITE, 0.46);
    let chrome = paint.metal(Color::srgb(0.72, 0.73, 0.75));

    studio::light(&mut commands, studio::FOCUS, 1.0);
    studio::room(&mut commands, &mut paint, -0.012, 1.0);
    // Its top is the floor that the hair feels.
    let cloth = paint.matte(Color::srgb(0.80, 0.77, 0.71), 0.9);
    commands.spawn((
        Mesh3d(paint.meshes.add(lathe(
            &[
                Vec2::new(0.36, -0.012),
                Vec2::new(0.362, -0.004),
                Vec2::new(0.358, -0.0012),
                Vec2::new(0.352, -0.0006),
                Vec2::new(0.0, -0.0006),
            ],
            96,
        ))),
        MeshMaterial3d(cloth),
        Transform::from_xyz(0.03, 0.0, 0.0),
    ));
    let base = [
        Vec2::new(0.13, -0.012),
        Vec2::new(0.13, 0.004),
        Vec2::new(0.12, 0.012),
        Vec2::new(0.016, 0.018),
        Vec2::new(0.014, 0.03),
        Vec2::new(0.014, 0.96),
        Vec2::new(0.010, 0.968),
        Vec2::new(0.0, 0.97),
    ];
    commands.spawn((
        Pole,
        Mesh3d(paint.meshes.add(lathe(&base, 48))),
        MeshMaterial3d(chrome.clone()),
        Transform::from_translation(POLE),
    ));
    commands.insert_resource(Studio { bare, bare_mesh, head, faces, up, skin, chrome });
    Ok(())
}

/// Gives a body to every model that has appeared or changed.
pub fn embody(
    mut commands: Commands,
    mut paint: Paint,
    studio: Res<Studio>,
    scene: Res<Scene>,
    models: Query<(Entity, &Model), Changed<Model>>,
) {
    for (entity, model) in &models {
        commands.entity(entity).despawn_related::<Children>().insert(Visibility::default());
        match *model {
            Model::Head(_) => head(&mut commands, &mut paint, &studio, entity, scene.kind),
            Model::Rod(radius, length) => rod(&mut commands, &mut paint, entity, radius, length),
            Model::Blower => blower(&mut commands, &mut paint, entity),
            Model::Shower => shower(&mut commands, &mut paint, &studio, entity),
            Model::Bust(radius) => bust(&mut commands, &mut paint, &studio, entity, radius),
        }
    }
}

type Part = (Mesh3d, MeshMaterial3d<StandardMaterial>, Transform);

fn part(mesh: Handle<Mesh>, material: Handle<StandardMaterial>, place: Transform) -> Part {
    (Mesh3d(mesh), MeshMaterial3d(material), place)
}

fn head(commands: &mut Commands, paint: &mut Paint, studio: &Studio, on: Entity, kind: SceneKind) {
    let along_x = Quat::from_rotation_z(FRAC_PI_2);
    let end = Vec3::new(mannequin::BUST_END, -0.03, 0.0);
    let arm = paint.meshes.add(Cylinder::new(0.009, 0.5));
    let sleeve = paint.meshes.add(Cuboid::new(0.05, 0.045, 0.085));
    let dark = paint.matte(Color::srgb(0.05, 0.05, 0.06), 0.5);
    let worn = [studio.faces[0].spawn(commands), studio.up.spawn(commands)];
    commands.entity(on).add_children(&worn).with_children(|head| {
        head.spawn(part(studio.head.clone(), studio.skin.clone(), default()));
        head.spawn(part(
            arm,
            studio.chrome.clone(),
            Transform::from_translation(end - Vec3::X * 0.24).with_rotation(along_x),
        ));
        let place = Transform::from_translation(end.with_z(0.5 * POLE.z));
        head.spawn((Sleeve, part(sleeve, dark.clone(), place)));
        if kind == SceneKind::Perm {
            // The row is wider than the head: a bar clamps it, as for a weft.
            let bar = paint.meshes.add(Cuboid::new(0.014, 0.012, 0.215));
            let place = Transform::from_xyz(0.0, 0.005 - HEAD_RADIUS, 0.0);
            head.spawn(part(bar, dark, place));
        }
    });
}

/// The training head upright on a column, its crown where the ball's is that the hair feels.
fn bust(commands: &mut Commands, paint: &mut Paint, studio: &Studio, on: Entity, radius: f32) {
    // It is made lying: the crown at +X, the face at +Y.
    let upright = Quat::from_rotation_y(FRAC_PI_2) * Quat::from_rotation_z(FRAC_PI_2);
    const CROWN: f32 = 0.118;
    let end = radius - CROWN + mannequin::BUST_END;
    // From the floor up to within the bust, which is a little behind its own axis.
    let column = [
        Vec2::new(0.125, -BUST_HIGH - 0.012),
        Vec2::new(0.125, -BUST_HIGH + 0.012),
        Vec2::new(0.118, -BUST_HIGH + 0.019),
        Vec2::new(0.050, -BUST_HIGH + 0.022),
        Vec2::new(0.042, -BUST_HIGH + 0.032),
        Vec2::new(0.042, end - 0.012),
        Vec2::new(0.060, end - 0.004),
        Vec2::new(0.060, end + 0.01),
        Vec2::new(0.0, end + 0.01),
    ];
    let column = paint.meshes.add(lathe(&column, 64));
    let dark = paint.matte(Color::srgb(0.09, 0.085, 0.085), 0.45);
    let place = Transform::from_xyz(0.0, radius - CROWN, 0.0).with_rotation(upright);
    let face = studio.faces[1].spawn(commands);
    commands.entity(face).insert(place);
    commands.entity(on).add_child(face).with_children(|head| {
        head.spawn(part(studio.head.clone(), studio.skin.clone(), place.with_scale(BROAD)));
        head.spawn(part(column, dark, Transform::from_xyz(0.0, 0.0, -0.02)));
    });
}

/// A hand shower: its plate at the origin looks along −Z.
fn shower(commands: &mut Commands, paint: &mut Paint, studio: &Studio, on: Entity) {
    let back = Transform::from_rotation(Quat::from_rotation_x(FRAC_PI_2));
    let bell = [
        Vec2::new(0.0, 0.0),
        Vec2::new(0.041, 0.0),
        Vec2::new(0.044, 0.003),
        Vec2::new(0.043, 0.008),
        Vec2::new(0.030, 0.018),
        Vec2::new(0.014, 0.026),
        Vec2::new(0.0, 0.027),
    ];
    let bell = paint.meshes.add(lathe(&bell, 40));
    let handle = paint.meshes.add(Capsule3d::new(0.011, 0.13));
    let hose = paint.meshes.add(Capsule3d::new(0.006, 0.2));
    let dark = paint.matte(Color::srgb(0.08, 0.08, 0.09), 0.4);
    commands.entity(on).with_children(|shower| {
        shower.spawn(part(bell, studio.chrome.clone(), back));
        let grip =
            Transform::from_xyz(0.0, -0.07, 0.04).with_rotation(Quat::from_rotation_x(-0.35));
        shower.spawn(part(handle, studio.chrome.clone(), grip));
        // From the end of the handle on.
        let hangs = Transform::from_xyz(0.0, -0.238, 0.067);
        shower.spawn(part(hose, dark, hangs));
    });
}

/// Keeps sleeves on the pole while the head moves.
pub fn slide(
    mut sleeves: Query<(&mut Transform, &ChildOf), With<Sleeve>>,
    mut poles: Query<&mut Visibility, With<Pole>>,
    places: Query<&GlobalTransform>,
) {
    let wanted = if sleeves.is_empty() { Visibility::Hidden } else { Visibility::Inherited };
    for mut pole in &mut poles {
        pole.set_if_neq(wanted);
    }
    for (mut sleeve, parent) in &mut sleeves {
        if let Ok(head) = places.get(parent.parent()) {
            sleeve.translation.x = POLE.x - head.translation().x;
        }
    }
}

fn rod(commands: &mut Commands, paint: &mut Paint, on: Entity, radius: f32, length: f32) {
    let half = 0.5 * length;
    // A slim barrel with grooves, so that hair lies on its nominal radius.
    let mut barrel = vec![Vec2::new(0.0, -half)];
    let rings = 12;
    for i in 0..=rings {
        let y = (2.0 * i as f32 / rings as f32 - 1.0) * half;
        let groove = if i % 2 == 0 { 0.0012 } else { 0.0022 };
        barrel.push(Vec2::new((radius - groove).max(0.001), y));
    }
    barrel.push(Vec2::new(0.0, half));
    let collar = [
        Vec2::new(0.0, -0.004),
        Vec2::new(radius + 0.003, -0.004),
        Vec2::new(radius + 0.004, -0.002),
        Vec2::new(radius + 0.004, 0.002),
        Vec2::new(radius + 0.003, 0.004),
        Vec2::new(0.008, 0.004),
        Vec2::new(0.007, 0.012),
        Vec2::new(0.0, 0.013),
    ];
    let plastic = paint.matte(Color::srgb(0.55, 0.33, 0.62), 0.35);
    let white = paint.matte(Color::srgb(0.86, 0.85, 0.83), 0.4);
    let barrel = paint.meshes.add(lathe(&barrel, 40));
    let collar = paint.meshes.add(lathe(&collar, 40));
    commands.entity(on).with_children(|rod| {
        rod.spawn(part(barrel, plastic, default()));
        rod.spawn(part(collar.clone(), white.clone(), Transform::from_xyz(0.0, half, 0.0)));
        let other = Transform::from_xyz(0.0, -half, 0.0).with_rotation(Quat::from_rotation_x(PI));
        rod.spawn(part(collar, white, other));
    });
}

fn blower(commands: &mut Commands, paint: &mut Paint, on: Entity) {
    // Its mouth is at the origin and looks along −Z; the lathe turns round Y.
    let back = Transform::from_rotation(Quat::from_rotation_x(FRAC_PI_2));
    let nozzle = [
        Vec2::new(0.026, 0.052),
        Vec2::new(0.021, 0.004),
        Vec2::new(0.023, 0.0),
        Vec2::new(0.025, 0.001),
        Vec2::new(0.031, 0.055),
    ];
    let mut nozzle = nozzle;
    nozzle.reverse();
    let body = [
        Vec2::new(0.030, 0.05),
        Vec2::new(0.036, 0.06),
        Vec2::new(0.041, 0.09),
        Vec2::new(0.043, 0.14),
        Vec2::new(0.041, 0.175),
        Vec2::new(0.034, 0.195),
        Vec2::new(0.026, 0.2),
    ];
    let grill = [Vec2::new(0.027, 0.199), Vec2::new(0.02, 0.202), Vec2::new(0.0, 0.203)];
    let hot = paint.glow(Color::srgb(1.0, 0.35, 0.12), 1.2);
    let red = paint.matte(Color::srgb(0.66, 0.10, 0.12), 0.3);
    let dark = paint.matte(Color::srgb(0.04, 0.04, 0.045), 0.5);
    let nozzle = paint.meshes.add(lathe(&nozzle, 40));
    let body = paint.meshes.add(lathe(&body, 40));
    let grill = paint.meshes.add(lathe(&grill, 40));
    let coil = paint.meshes.add(Torus::new(0.010, 0.014));
    let handle = paint.meshes.add(Capsule3d::new(0.0165, 0.1));
    let switch = paint.meshes.add(Cuboid::new(0.008, 0.026, 0.006));
    let lean = Quat::from_rotation_x(-0.18);
    commands.entity(on).with_children(|blower| {
        blower.spawn(part(nozzle, dark.clone(), back));
        blower.spawn(part(body, red.clone(), back));
        blower.spawn(part(grill, dark.clone(), back));
        let inside =
            Transform::from_xyz(0.0, 0.0, 0.03).with_rotation(Quat::from_rotation_x(FRAC_PI_2));
        blower.spawn(part(coil, hot, inside));
        let grip = Transform::from_xyz(0.0, -0.09, 0.145).with_rotation(lean);
        blower.spawn(part(handle, red, grip));
        let thumb = Transform::from_xyz(0.0, -0.075, 0.127).with_rotation(lean);
        blower.spawn(part(switch, dark, thumb));
    });
}
