//! Wind, rain, and a jump: what the keys do.

use crate::{Arguments, figure::Figure};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// What of the weather is on.
#[derive(Resource, Default)]
pub struct Weather {
    pub wind: bool,
    pub rain: bool,
}

/// The rain's cloud.
#[derive(Component)]
struct Cloud;

/// How fast the wind blows (m/s), and from where.
const WIND: f32 = 4.0;
const WIND_TOWARD: Vec3 = Vec3::new(-0.9, 0.0, -0.43);
/// Drops a second on a disc of this radius (m).
const RAIN: f32 = 1500.0;
const RAIN_RADIUS: f32 = 0.22;
/// How far a jump goes (m).
const JUMP: f32 = 3.0;

pub struct WeatherPlugin;

impl Plugin for WeatherPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Weather>()
            .add_systems(Startup, begin)
            .add_systems(Update, (keys, (blow, rain)).chain());
    }
}

fn begin(arguments: Res<Arguments>, mut weather: ResMut<Weather>) {
    *weather = Weather { wind: arguments.wind, rain: arguments.rain };
}

fn keys(
    mut commands: Commands,
    keys: Option<Res<ButtonInput<KeyCode>>>,
    mut weather: ResMut<Weather>,
    mut time: ResMut<Time<Virtual>>,
    mut figures: Query<&mut Figure>,
    hairs: Query<Entity, With<Hair>>,
) {
    let Some(keys) = keys else { return };
    if keys.just_pressed(KeyCode::KeyW) {
        weather.wind ^= true;
    }
    if keys.just_pressed(KeyCode::KeyR) {
        weather.rain ^= true;
    }
    if keys.just_pressed(KeyCode::KeyT) {
        for mut figure in &mut figures {
            figure.place.x = if figure.place.x == 0.0 { JUMP } else { 0.0 };
        }
        hairs.iter().for_each(|hair| {
            commands.entity(hair).queue(Hair::teleport);
        });
    }
    if keys.just_pressed(KeyCode::Space) {
        if time.is_paused() { time.unpause() } else { time.pause() }
    }
}

/// Air that moves drags as still air does, from its own speed: a steady pull of rate · wind. In gusts.
fn blow(
    time: Res<Time>,
    weather: Res<Weather>,
    hairs: Query<&AirDrag, With<Hair>>,
    mut gravity: ResMut<HairGravity>,
) {
    let rate = hairs.iter().next().copied().unwrap_or_default().rate;
    let t = time.elapsed_secs();
    let gust = 1.0 + 0.45 * (1.7 * t).sin() * (0.6 * t + 1.0).sin() + 0.2 * (5.3 * t).sin();
    let wind = if weather.wind { WIND_TOWARD * (WIND * gust * rate) } else { Vec3::ZERO };
    gravity.set_if_neq(HairGravity(HairGravity::default().0 + wind));
}

/// The cloud goes along.
fn rain(
    mut commands: Commands,
    weather: Res<Weather>,
    mut clouds: Query<(Entity, &mut Transform), With<Cloud>>,
    figures: Query<&Transform, (With<Figure>, Without<Cloud>)>,
) -> Result {
    let Some(figure) = figures.iter().next() else { return Ok(()) };
    let above = figure.translation + Vec3::Y * 2.7 + figure.forward() * -0.1;
    let place = Transform::from_translation(above).looking_to(Vec3::NEG_Y, Vec3::X);
    match (clouds.iter_mut().next(), weather.rain) {
        (Some((_, mut cloud)), true) => *cloud = place,
        (Some((cloud, _)), false) => commands.entity(cloud).despawn(),
        (None, true) => {
            // A soaking of minutes, in seconds.
            commands.insert_resource(HairProcessTime(30.0));
            commands.spawn((Cloud, Shower::rain(RAIN, RAIN_RADIUS)?, place));
        }
        (None, false) => {}
    }
    Ok(())
}
