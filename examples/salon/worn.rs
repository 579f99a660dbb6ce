//! A head that wears one of the presets, in place of a scene.

use crate::{
    dressed, head, mannequin,
    orbit::HEAD as HIGH,
    scenes::{Prop, Scene, Treated},
    solid::{Paint, lathe},
    stage::Studio,
};
use bevy::{ecs::system::SystemState, math::ops::sin, prelude::*};
use bevy_keratin::{
    Settling,
    authoring::plant::HairPreset,
    base::setting::HairSetting,
    prelude::*,
    render::{HairFollowers, HairLook},
};

/// Those that can be picked.
pub const PRESETS: [HairPreset; HairPreset::ALL.len()] = HairPreset::ALL;

/// What is on the stage.
#[derive(Resource, Clone, Copy, Debug, PartialEq)]
pub enum Shown {
    Scene(Scene),
    Preset(HairPreset),
}

/// Shakes the head.
#[derive(Message, Clone, Copy, Debug)]
pub struct Shake;

/// A shake: its time (s), its turns a second, its angle to either side (rad).
const SHAKE: (f32, f32, f32) = (1.6, 1.9, 0.6);

/// The head that wears, and the time since it is shaken (s).
#[derive(Component)]
struct Wearer(f32);

/// A head's skin without and with hair on it: it is tinted once the hair is there.
#[derive(Component)]
struct Tinted(Handle<Mesh>);

/// The settings of scenes, while a preset has its own.
#[derive(Resource, Clone)]
struct Before {
    stiffness: HairStiffness,
    wetting: HairWetting,
    contact: StrandContact,
    solver: HairSolver,
    look: HairLook,
    followers: HairFollowers,
}

pub struct WornPlugin(pub Scene);

impl Plugin for WornPlugin {
    fn build(&self, app: &mut App) {
        app.insert_resource(Shown::Scene(self.0))
            .add_message::<Shake>()
            .add_systems(FixedUpdate, shake)
            .add_systems(Update, tint);
    }
}

fn now<T: HairSetting + Clone>(world: &World) -> T {
    world.resource::<HairDefault<T>>().0.clone()
}

/// The mannequin lies; this puts it upright, turned by an angle (rad).
fn place(turn: f32) -> Transform {
    let upright = Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X);
    let rotation = Quat::from_rotation_y(turn) * Quat::from_mat3(&upright);
    Transform::from_xyz(0.0, HIGH, 0.0).with_rotation(rotation)
}

/// Spawns a head with this hair on a stage that has been cleared. Its settings are those of all hair, so
/// that the sliders move them.
pub fn put_on(world: &mut World, preset: HairPreset) -> Result {
    if !world.contains_resource::<Before>() {
        let before = Before {
            stiffness: now(world),
            wetting: now(world),
            contact: now(world),
            solver: now(world),
            look: now(world),
            followers: now(world),
        };
        world.insert_resource(before);
    }
    let settings = preset.settings();
    let mut followers = settings.followers;
    let mut look = settings.look.clone();
    if let Some(spared) = world.get_resource::<crate::spare::Spared>() {
        look.width *= spared.wider(followers.count);
        followers.count = followers.count.min(spared.strands);
    }
    world.insert_resource(HairDefault(settings.stiffness));
    world.insert_resource(HairDefault(settings.wetting));
    world.insert_resource(HairDefault(settings.contact));
    world.insert_resource(HairDefault(look));
    world.insert_resource(HairDefault(followers));

    let scalp = dressed::scalp();
    let bare = world.resource::<Studio>().bare.clone();
    let planted = preset.plant(&bare, &scalp)?;
    let count = settings.followers.count;
    let roots = preset.follower_roots(&planted, &bare, &scalp, &preset.hairline(), count, 0)?;
    let tinted = head::with_scalp(bare, &scalp, preset);
    let face = dressed::face(Vec3::ONE, dressed::brows(settings.look.melanin))?;
    let skin = world.resource::<Studio>().skin.clone();
    let head = world.resource::<Studio>().bare_mesh.clone();

    let mut state = SystemState::<(Commands, Paint)>::new(world);
    let (mut commands, mut paint) = state.get_mut(world)?;
    let hair = commands.spawn((
        Prop,
        Treated,
        Wearer(f32::INFINITY),
        (Hair, place(0.0), Visibility::default()),
        Settling::default(),
        roots,
    ));
    let hair = hair.id();
    for strand in planted.groom.strands() {
        commands.spawn((StrandOf(hair), Strand::from_polyline(strand.points)?));
    }
    let tinted = Tinted(paint.meshes.add(tinted));
    let body = commands.spawn((Mesh3d(head), MeshMaterial3d(skin), tinted, Transform::default()));
    let body = body.id();
    let face = face.spawn(&mut commands);
    commands.entity(hair).add_children(&[body, face]);
    let lying = place(0.0).rotation.inverse();
    for (collider, at) in head::close_fit()? {
        let at = Transform::from_rotation(lying) * at;
        commands.spawn((collider, at, ChildOf(hair)));
    }
    let end = mannequin::BUST_END;
    let column = [
        Vec2::new(0.125, -HIGH - 0.012),
        Vec2::new(0.125, -HIGH + 0.012),
        Vec2::new(0.118, -HIGH + 0.019),
        Vec2::new(0.040, -HIGH + 0.024),
        Vec2::new(0.030, -HIGH + 0.040),
        Vec2::new(0.030, end - 0.014),
        Vec2::new(0.060, end - 0.006),
        Vec2::new(0.060, end + 0.01),
        Vec2::new(0.0, end + 0.01),
    ];
    let dark = paint.matte(Color::srgb(0.09, 0.085, 0.085), 0.45);
    let column = paint.meshes.add(lathe(&column, 64));
    let foot = Transform::from_xyz(0.0, HIGH, -0.02);
    commands.spawn((Prop, Mesh3d(column), MeshMaterial3d(dark), foot));
    state.apply(world);
    Ok(())
}

/// Gives the scenes their settings back.
pub fn take_off(world: &mut World) {
    let Some(before) = world.remove_resource::<Before>() else { return };
    world.insert_resource(HairDefault(before.stiffness));
    world.insert_resource(HairDefault(before.wetting));
    world.insert_resource(HairDefault(before.contact));
    world.insert_resource(HairDefault(before.solver));
    world.insert_resource(HairDefault(before.look));
    world.insert_resource(HairDefault(before.followers));
}

fn shake(
    time: Res<Time>,
    mut shakes: MessageReader<Shake>,
    mut heads: Query<(&mut Wearer, &mut Transform)>,
) {
    let begins = shakes.read().count() > 0;
    for (mut wearer, mut transform) in &mut heads {
        if begins {
            wearer.0 = 0.0;
        }
        let (seconds, often, wide) = SHAKE;
        if wearer.0 < seconds {
            wearer.0 += time.delta_secs();
            let share = (wearer.0 / seconds).min(1.0);
            let fades = 4.0 * share * (1.0 - share);
            let turn = wide * fades * sin(core::f32::consts::TAU * often * wearer.0);
            *transform = place(turn);
        }
    }
}

/// A head is tinted by its hair once that is drawn: until then there is neither.
fn tint(mut heads: Query<(&mut Mesh3d, &Tinted, &ChildOf)>, settling: Query<(), With<Settling>>) {
    for (mut mesh, tinted, hair) in &mut heads {
        if mesh.0 != tinted.0 && !settling.contains(hair.parent()) {
            mesh.0 = tinted.0.clone();
        }
    }
}
