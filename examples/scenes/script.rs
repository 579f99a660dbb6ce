//! What happens when, in seconds of the scene's own clock.

use super::{Model, Prop, Scene, SceneKind, measure::shapes};
use bevy::prelude::*;
use bevy_keratin::{WindReceived, prelude::*};

/// The clock of a scene, and what it has seen.
#[derive(Resource, Clone, Debug, Default)]
pub struct Director {
    /// Ticks directed so far.
    pub frame: u32,
    /// Scene time (s).
    pub seconds: f32,
    /// Ω of every joint just before lifting or releasing, by strand in spawn order.
    pub held: Vec<Vec<Vec3>>,
}

/// The moments of the stories (s).
#[derive(Clone, Copy, Debug)]
pub struct Moment;

impl Moment {
    /// bedhead, blow-dry: the head has come down.
    pub const PRESSED: f32 = 4.0;
    /// bedhead, blow-dry: drying begins; perm: the hair is wound and treated.
    pub const TREATED: f32 = 6.5;
    /// bedhead, blow-dry: lifted from here on.
    pub const LIFTED: f32 = 13.5;
    /// perm: winding begins.
    pub const WOUND: f32 = 0.5;
    /// perm: neutraliser and dryer.
    pub const RINSED: f32 = 7.5;
    /// perm: the rod is taken out.
    pub const RELEASED: f32 = 9.0;
}

/// Time that winding takes (s).
const WINDING: f32 = 4.0;
/// How high the roots are in the air, and on the floor (m).
const HIGH: f32 = 0.28;
const LOW: f32 = 0.04;
const PERM_HIGH: f32 = 0.60;
/// How far the head slides while it comes down, so that the hair lies to one side (m).
const SLIDE: f32 = -0.08;

/// Where the scalp is at a time of the scene (m).
pub fn root_path(kind: SceneKind, t: f32) -> Vec3 {
    if kind == SceneKind::Perm {
        return Vec3::Y * PERM_HIGH;
    }
    let down = smooth(t / Moment::PRESSED);
    let up = smooth((t - Moment::LIFTED) / 2.5);
    Vec3::new(SLIDE * down, HIGH + (LOW - HIGH) * (down - up), 0.0)
}

fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Moves the head and does what the story asks for at this tick.
pub fn direct(
    mut commands: Commands,
    time: Res<Time>,
    scene: Res<Scene>,
    mut director: ResMut<Director>,
    mut hair: Single<(Entity, &mut Transform, &Strands), With<Hair>>,
    strands: Query<&Strand>,
    tools: Query<Entity, Or<(With<PermRod>, With<Blower>)>>,
    mut treat: MessageWriter<Treat>,
) {
    let before = director.seconds;
    director.frame += 1;
    director.seconds += time.delta_secs();
    let now = director.seconds;
    // True in the one tick that passes the moment; 0 passes in the first.
    let passes = |moment: f32| (moment > before || before == 0.0) && moment <= now;

    let (entity, transform, members) = &mut *hair;
    transform.translation = root_path(scene.kind, now);
    let hair = *entity;
    let variant = scene.variant;
    match scene.kind {
        SceneKind::Bedhead => {
            if passes(0.0) && variant != "never-wet" {
                treat.write(Treat::wet(hair));
            }
            if passes(Moment::TREATED) && variant == "treated" {
                treat.write(Treat::dry(hair).over(3.0));
            }
        }
        SceneKind::BlowDry => {
            if passes(0.0) {
                treat.write(Treat::wet(hair));
            }
            if passes(Moment::TREATED) {
                let drying = if variant == "treated" { 0.3 } else { 0.0 };
                // From behind and above, so that the wind crosses the hair on the floor.
                commands.spawn((
                    Prop,
                    Model::Blower,
                    Blower { strength: 3.33, drying },
                    Transform::from_xyz(0.0, 0.12, -0.25)
                        .looking_at(Vec3::new(0.01, 0.0, 0.0), Vec3::Y),
                ));
                if variant == "uniform" {
                    treat.write(Treat::dry(hair).over(6.5));
                }
            }
        }
        SceneKind::Perm => {
            if passes(Moment::WOUND) {
                // Beside the hair, its middle one radius away: the strand touches it tangentially.
                let rod = PermRod { radius: 0.03, length: 0.24 };
                let rod = commands
                    .spawn((
                        Prop,
                        Model::Rod(rod.radius, rod.length),
                        rod,
                        Transform::from_translation(
                            transform.translation + Vec3::new(0.03, -0.06, 0.0),
                        )
                        .with_rotation(Quat::from_rotation_x(core::f32::consts::FRAC_PI_2)),
                    ))
                    .id();
                for strand in members.iter() {
                    commands.entity(strand).insert((
                        WoundOn(rod),
                        Winding { from_node: 2, pitch: 0.0, seconds: WINDING },
                    ));
                }
            }
            if passes(Moment::TREATED) {
                match variant {
                    "treated" | "cut-only" => _ = treat.write(Treat::lotion(hair)),
                    "water-set" => _ = treat.write(Treat::shampoo(hair)),
                    _ => {}
                }
            }
            if passes(Moment::RINSED) && matches!(variant, "treated" | "water-set") {
                treat.write(Treat::neutraliser(hair).over(1.0));
                treat.write(Treat::dry(hair).over(1.0));
            }
        }
    }
    let end = if scene.kind == SceneKind::Perm { Moment::RELEASED } else { Moment::LIFTED };
    if passes(end) {
        director.held = shapes(members.iter().filter_map(|s| strands.get(s).ok()));
        for tool in &tools {
            commands.entity(tool).despawn();
        }
    }
}

/// Σ |Δv_w| of every joint, by strand in spawn order (m/s).
pub fn wind_received<'a>(strands: impl Iterator<Item = &'a WindReceived>) -> Vec<Vec<f32>> {
    strands.map(|w| w.total.clone()).collect()
}
