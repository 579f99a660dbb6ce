//! The training head upright, with a preset's hair, in light that flatters it.

use crate::{dressed, environment, head, mannequin, renderer};
use bevy::{core_pipeline::prepass::DepthPrepass, light::DirectionalLightShadowMap, prelude::*};
use bevy_keratin::{authoring::plant::HairPreset, prelude::*, render::HairFollowers};

/// Seconds until hair has settled.
pub const SETTLING: f32 = 2.0;

/// The mannequin lies; its crown is at +X and its face at +Y. This puts it upright.
pub fn upright() -> Transform {
    Transform::from_matrix(Mat4::from_mat3(Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X)))
}

/// What stands out from the hair: dark behind pale hair, pale behind dark.
pub fn ground(preset: HairPreset) -> Color {
    match preset.settings().look.melanin.color().luminance() {
        pale if pale > 0.1 => Color::srgb(0.13, 0.14, 0.16),
        dark if dark < 0.005 => Color::srgb(0.62, 0.63, 0.64),
        _ => Color::srgb(0.44, 0.46, 0.48),
    }
}

/// An app without a window.
pub fn app(title: &str, ground: Color) -> App {
    let mut app = renderer::app(title, (0, 0), true, default());
    app.insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(DirectionalLightShadowMap { size: 4096 })
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(ClearColor(ground));
    app
}

/// The camera's components.
pub fn camera(app: &mut App) -> impl Bundle + use<> {
    let mut images = app.world_mut().resource_mut::<Assets<Image>>();
    let surroundings = environment::studio(&mut images, 450.0);
    (Camera3d::default(), Msaa::Sample4, DepthPrepass, surroundings)
}

/// Puts all cameras there.
pub fn look(app: &mut App, from: Vec3, to: Vec3) {
    let place = Transform::from_translation(from).looking_at(to, Vec3::Y);
    let mut cameras = app.world_mut().query_filtered::<&mut Transform, With<Camera>>();
    cameras.iter_mut(app.world_mut()).for_each(|mut camera| *camera = place);
}

/// Lights the head.
pub fn light(app: &mut App) {
    environment::lights(app.world_mut(), 1.0);
}

/// Hair of so few drawn strands is drawn whole.
const MIN_DRAWN: u32 = 2000;

/// Draws no more than so many strands of a head of 40,000, of others in proportion: those wider and of
/// fewer segments.
pub fn thin_out(app: &mut App, strands: u32) {
    let share = (strands as f32 / 40_000.0).min(1.0);
    // Brows and lashes stay.
    let thin = move |count: u32| ((count as f32 * share) as u32).max(MIN_DRAWN).min(count);
    let coarse =
        move |segments: u32| ((segments as f32 * share.sqrt()) as u32).max(12).min(segments);
    let wider = |before: u32, now: u32| (before as f32 / now.max(1) as f32).sqrt();
    let world = app.world_mut();
    if let Some(mut followers) = world.get_resource_mut::<HairDefault<HairFollowers>>() {
        let before = followers.count;
        followers.count = thin(before);
        followers.segments = coarse(followers.segments);
        let times = wider(before, followers.count);
        if let Some(mut look) = world.get_resource_mut::<HairDefault<HairLook>>() {
            look.width *= times;
        }
    }
    app.add_systems(
        PreUpdate,
        move |mut hairs: Query<
            (&mut HairFollowers, Option<&mut HairLook>),
            Added<HairFollowers>,
        >| {
            for (mut followers, look) in &mut hairs {
                let before = followers.count;
                followers.count = thin(before);
                followers.segments = coarse(followers.segments);
                if let Some(mut look) = look {
                    look.width *= wider(before, followers.count);
                }
            }
        },
    );
}

/// A head with hair.
pub struct Bust {
    /// Turn this, and all of it turns.
    pub hair: Entity,
    /// How many strands are simulated.
    pub guides: usize,
}

/// The head with the preset's hair; with a beard short hair of the same colour.
pub fn wear(app: &mut App, preset: HairPreset) -> Result<Bust> {
    let scalp = dressed::scalp();
    let bare = mannequin::mesh();
    let melanin = preset.settings().look.melanin;
    let (hair, guides) = grow(app, preset, &bare, melanin)?;
    let mut mesh = head::with_scalp(bare.clone(), &scalp, preset);
    if preset == HairPreset::Beard {
        let (above, _) = grow(app, HairPreset::Short, &bare, melanin)?;
        app.world_mut().entity_mut(above).insert((Transform::default(), ChildOf(hair)));
        mesh = head::with_scalp(mesh, &scalp, HairPreset::Short);
    }
    let face = dressed::face(Vec3::ONE, dressed::brows(melanin))?;
    let world = app.world_mut();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
    let skin = StandardMaterial { perceptual_roughness: 0.46, ..default() };
    let skin = world.resource_mut::<Assets<StandardMaterial>>().add(skin);
    world.spawn((Mesh3d(mesh), MeshMaterial3d(skin), ChildOf(hair)));
    let lying = Transform::from_rotation(upright().rotation.inverse());
    for (collider, place) in head::close_fit()? {
        world.spawn((collider, lying * place, ChildOf(hair)));
    }
    let face = face.spawn(&mut world.commands());
    world.flush();
    world.entity_mut(hair).add_child(face);
    Ok(Bust { hair, guides })
}

/// The hair of a preset in that colour, upright, and how many of its strands are simulated.
fn grow(
    app: &mut App,
    preset: HairPreset,
    mesh: &Mesh,
    melanin: Melanin,
) -> Result<(Entity, usize)> {
    let scalp = dressed::scalp();
    let mut settings = preset.settings();
    settings.look.melanin = melanin;
    let planted = preset.plant(mesh, &scalp)?;
    let (line, count) = (preset.hairline(), settings.followers.count);
    let roots = preset.follower_roots(&planted, mesh, &scalp, &line, count, 0)?;
    let world = app.world_mut();
    let hair = world.spawn((Hair, upright(), Visibility::default(), settings, roots)).id();
    for strand in planted.groom.strands() {
        world.spawn((StrandOf(hair), Strand::from_polyline(strand.points)?));
    }
    Ok((hair, planted.groom.len()))
}
