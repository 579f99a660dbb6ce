//! What happens when, in seconds of the scene's own clock.

use super::{
    Model, Prop, Scene, SceneKind, Strewn, TWO_HAIRS, Treated, locks,
    measure::{Lift, heights, shapes, tips, weighted_rate},
};
use bevy::{ecs::system::SystemParam, prelude::*};
use bevy_keratin::{Shower, WindReceived, prelude::*};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// The clock of a scene, and what it has seen.
#[derive(Resource, Clone, Debug, Default)]
pub struct Director {
    /// Ticks directed so far.
    pub frame: u32,
    /// Scene time (s).
    pub seconds: f32,
    /// Ω of every joint just before lifting or releasing, by strand in spawn order.
    pub held: Vec<Vec<Vec3>>,
    /// shower: the hydrogen bonds' rates when pressing begins, and after the second shower.
    pub rates: [Vec<Vec<f32>>; 2],
    /// shower: what the bonds alone keep of the held shape, before the second shower.
    pub kept_dried: Option<f64>,
    /// Whether the story has ended: the head stays where it is, nothing happens any more.
    pub ended: bool,
    /// wet: mean nearest distance between tips, dry (m).
    pub dry_spacing: Option<f64>,
}

impl Director {
    /// The hydrogen bonds' rate at one of the moments of [`Self::rates`], weighted by the held shape.
    pub fn rate(&self, moment: usize) -> Option<f64> {
        (!self.held.is_empty() && !self.rates[moment].is_empty())
            .then(|| weighted_rate(&self.rates[moment], &self.held))
    }
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
    /// wet: the hair has settled, droplets fall.
    pub const STREWN: f32 = 4.0;
    /// shower: on, and off again.
    pub const SHOWER: [f32; 2] = [1.0, 6.0];
    /// shower: the head comes down.
    pub const LYING: f32 = 10.0;
    /// shower: the night, until the head is lifted.
    pub const NIGHT: [f32; 2] = [13.0, 19.0];
    /// shower: a second time.
    pub const REWET: [f32; 2] = [24.0, 29.0];
    /// shower: dries hanging.
    pub const DRYING: f32 = 33.0;
}

/// How much faster than life water goes in a night.
const NIGHT_PROCESS: f32 = 900.0;

/// Time that winding takes (s).
const WINDING: f32 = 4.0;
/// How high the roots are in the air, and on the floor (m).
const HIGH: f32 = 0.28;
const LOW: f32 = 0.04;
const PERM_HIGH: f32 = 0.60;
pub const BUST_HIGH: f32 = 0.40;
/// How far the head slides while it comes down, so that the hair lies to one side (m).
const SLIDE: f32 = -0.08;

/// Where the scalp is at a time of the scene (m).
pub fn root_path(kind: SceneKind, t: f32) -> Vec3 {
    let (down, up) = match kind {
        SceneKind::Perm => return Vec3::Y * PERM_HIGH,
        SceneKind::Wet => return Vec3::Y * BUST_HIGH,
        SceneKind::Shower => ((t - Moment::LYING) / 2.0, (t - Moment::NIGHT[1]) / 2.5),
        _ => (t / Moment::PRESSED, (t - Moment::LIFTED) / 2.5),
    };
    let (down, up) = (smooth(down), smooth(up));
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
    mut hair: Single<(Entity, &mut Transform, &Strands), With<Treated>>,
    strands: Query<&Strand>,
    bonds: Query<&Bonds>,
    tools: Query<Entity, Or<(With<PermRod>, With<Blower>)>>,
    mut treat: MessageWriter<HairTreatment>,
    mut water: Water,
) {
    if director.ended {
        return;
    }
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
                treat.write(HairTreatment::wet(hair));
            }
            if passes(Moment::TREATED) && variant == "treated" {
                treat.write(HairTreatment::dry(hair).over(3.0));
            }
        }
        SceneKind::BlowDry => {
            if passes(0.0) {
                treat.write(HairTreatment::wet(hair));
            }
            if passes(Moment::TREATED) {
                let drying = if variant == "treated" { 0.3 } else { 0.0 };
                // From behind and above, so that the wind crosses the hair on the floor.
                commands.spawn((
                    Prop,
                    Model::Blower,
                    Blower { strength: 3.33, drying, ..default() },
                    Transform::from_xyz(0.0, 0.12, -0.25)
                        .looking_at(Vec3::new(0.01, 0.0, 0.0), Vec3::Y),
                ));
                if variant == "uniform" {
                    treat.write(HairTreatment::dry(hair).over(6.5));
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
                        PermWinding { from_node: 2, pitch: 0.0, seconds: WINDING },
                    ));
                }
            }
            if passes(Moment::TREATED) {
                match variant {
                    "treated" | "cut-only" => _ = treat.write(HairTreatment::lotion(hair)),
                    "water-set" => _ = treat.write(HairTreatment::shampoo(hair)),
                    _ => {}
                }
            }
            if passes(Moment::RINSED) && matches!(variant, "treated" | "water-set") {
                treat.write(HairTreatment::neutraliser(hair).over(1.0));
                treat.write(HairTreatment::dry(hair).over(1.0));
            }
        }
        SceneKind::Wet | SceneKind::Shower => {}
    }
    if scene.kind == SceneKind::Wet && passes(Moment::STREWN) {
        let own = || members.iter().filter_map(|s| strands.get(s).ok());
        director.dry_spacing = Some(locks::tip_spacing(&tips(own())));
        water.lift.dry = heights(own());
        let center = transform.translation;
        scatter_droplets(&mut commands, *water.strewn, own(), center);
    }
    if scene.kind == SceneKind::Shower {
        let all = || members.iter().filter_map(|s| bonds.get(s).ok());
        if passes(Moment::LYING) {
            director.rates[0] = hydrogen_rates(all());
        }
        if passes(Moment::REWET[0]) {
            director.kept_dried = Some(super::measure::kept_at_rest(all(), &director.held));
        }
        if passes(Moment::DRYING) {
            director.rates[1] = hydrogen_rates(all());
        }
        let [first, second] = [Moment::SHOWER, Moment::REWET];
        let wets = ["treated", TWO_HAIRS].contains(&variant);
        if wets && passes(first[0]) || passes(second[0]) {
            commands.spawn(shower(transform.translation));
        }
        if passes(first[1]) || passes(second[1]) {
            water.showers.iter().for_each(|shower| commands.entity(shower).despawn());
        }
        if variant == "dried-free" && passes(first[0]) {
            water.soak.write(SoakHair { target: hair, wetness: 1.0 });
        }
        let free = variant == "dried-free" && (2.0..Moment::LYING).contains(&now);
        let night = (Moment::NIGHT[0]..Moment::NIGHT[1]).contains(&now) || now > Moment::DRYING;
        water.process.0 = if free || night { NIGHT_PROCESS } else { 60.0 };
    }
    let end = match scene.kind {
        SceneKind::Perm => Moment::RELEASED,
        SceneKind::Wet => f32::INFINITY,
        SceneKind::Shower => Moment::NIGHT[1],
        _ => Moment::LIFTED,
    };
    if passes(end) {
        director.held = shapes(members.iter().filter_map(|s| strands.get(s).ok()));
        for tool in &tools {
            commands.entity(tool).despawn();
        }
    }
}

/// What the scenes with water move.
#[derive(SystemParam)]
pub struct Water<'w, 's> {
    strewn: Res<'w, Strewn>,
    showers: Query<'w, 's, Entity, With<Shower>>,
    process: ResMut<'w, HairProcessTime>,
    soak: MessageWriter<'w, SoakHair>,
    lift: ResMut<'w, Lift>,
}

/// A hand shower beside the roots of the hair that hangs from `scalp`: water runs down from there.
fn shower(scalp: Vec3) -> impl Bundle {
    let head = scalp + Vec3::new(-0.30, -0.05, 0.0);
    (
        Prop,
        Model::Shower,
        Shower {
            rate: 800.0,
            drop_radius: 2e-3,
            speed: 4.0,
            spread: 0.25,
            opening: 0.04,
            ..default()
        },
        Transform::from_translation(head).looking_at(scalp - Vec3::Y * 0.01, Vec3::Y),
    )
}

/// Droplets on nodes chosen by a seed: [W]'s experiment.
fn scatter_droplets<'a>(
    commands: &mut Commands,
    drops: Strewn,
    strands: impl Iterator<Item = &'a Strand>,
    center: Vec3,
) {
    let nodes: Vec<Vec3> = strands.flat_map(|s| s.positions().iter().skip(1)).copied().collect();
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let Strewn { count, radius } = drops;
    let volume = 4.0 / 3.0 * core::f64::consts::PI * f64::from(radius).powi(3);
    for _ in 0..if nodes.is_empty() { 0 } else { count } {
        let place = center + nodes[random.random_range(0..nodes.len())];
        let drop = Droplet::new(place, volume).and_then(|d| d.with_influence(radius, 5.0 * radius));
        commands.spawn(drop.expect("a drop of some millimetres on a finite node"));
    }
}

fn hydrogen_rates<'a>(bonds: impl Iterator<Item = &'a Bonds>) -> Vec<Vec<f32>> {
    bonds.map(|b| b.rates(BondKind::Hydrogen).collect()).collect()
}

/// Σ |Δv_w| of every joint, by strand in spawn order (m/s).
pub fn wind_received<'a>(strands: impl Iterator<Item = &'a WindReceived>) -> Vec<Vec<f32>> {
    strands.map(|w| w.total.clone()).collect()
}
