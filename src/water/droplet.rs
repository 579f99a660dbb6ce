//! Drops of water as entities, and showers that spawn them.

use super::{
    Counted,
    model::{ball_radius, ball_volume},
};
use crate::{
    base::{
        setting::{InvalidValue, Ranged, ValueRange, Violations, setting},
        tape::Tape,
    },
    hair::strand::TickPose,
};
use bevy::prelude::*;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

setting! {
    /// A drop of water: falls, lands on strands, slides along one and pulls others to it (\[W\]
    /// equation 2), soaks in, merges, drips off. Spawn it to wet hair; its water is accounted for until it
    /// has evaporated or is far from all hair, by [`DropletRules`](crate::water::DropletRules). A clone adds
    /// its water to the world.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # fn drip(mut commands: Commands) -> Result {
    /// // 14 µl: a drop of 1.5 mm
    /// commands.spawn(Droplet::new(Vec3::Y * 1.9, 14e-9)?);
    /// # Ok(()) }
    /// ```
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct Droplet {
        /// Its centre in the world.
        pub position: Vec3 = Vec3::ZERO, "m" in POSITION: -1e6..=1e6,
            "a finite place in the world";
        /// Its velocity.
        pub velocity: Vec3 = Vec3::ZERO, "m/s" in VELOCITY: -1e3..=1e3, "rain falls at 6";
        /// Its volume; `f64` for the exact balance of water.
        pub volume: f64 = ball_volume(1e-3), "m³" in VOLUME: 1e-15..=1e-3, safe 1e-10..=2e-7,
            "4.2e-9 is a drop of 1 mm";
        /// Distance within which it repels strands.
        pub r_min: f32 = 1e-3, "m" in R_MIN: 1e-6..=1.0, "about the drop's own radius";
        /// Distance up to which it pulls strands, more than `r_min`.
        pub r_max: f32 = 1e-3 * INFLUENCE, "m" in R_MAX: 1e-6..=10.0,
            "more than r_min, usually five times as much";
        pub(super) ride: Option<StrandPoint> = None => Ranged::clamp_values;
        /// The hair that carries it, or that it came off.
        pub(super) hair: Option<Entity> = None;
        /// Where it was a substep ago.
        pub(super) before: Vec3 = Vec3::ZERO, "m" in BEFORE: -1e6..=1e6, "where it was";
        /// For how long it has yet to move (s); negative where it came into being within a substep.
        pub(super) lag: f32 = 0.0, "s" in LAG: -1e3..=1e3, "0 is up to date";
        /// How much of it the ledger has counted (m³).
        #[reflect(ignore)]
        pub(super) counted: Counted = Counted(0.0);
        /// Number of strands that touch it.
        pub(super) touch_count: u32 = 1;
        /// Whether it is a drip: it detached from a film on hair.
        pub(super) drip: bool = false;
        /// How long it has lain on a collider (s).
        pub(crate) lying: f32 = 0.0, "s" in LYING: 0.0..=1e9, "0 has just come to lie";
    }
    then Self::check_radii
}

/// The strand that carries a drop.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
pub struct StrandPoint {
    /// The strand.
    pub strand: Entity,
    /// Where on it, in segments from the root.
    pub at: f32,
}

impl Ranged for StrandPoint {
    fn clamp_values(&mut self, violations: &mut Violations) {
        const AT: ValueRange =
            ValueRange::new("StrandPoint::at", 0.0..=65536.0, "segments from the root");
        AT.clamp(&mut self.at, || 0.0, violations);
    }
}

/// Default of r_max over r_min, as in the clumping experiment.
const INFLUENCE: f32 = 5.0;

impl Droplet {
    /// A drop at rest, of `volume` (m³), that pulls up to five times its radius.
    ///
    /// # Errors
    /// When the place is not finite or the volume outside [`VOLUME`](Self::VOLUME).
    pub fn new(position: Vec3, volume: f64) -> Result<Self, InvalidValue> {
        Self::VOLUME.check(volume)?;
        Self { volume, ..Self::ball(position, ball_radius(volume)) }.checked()
    }

    /// The same drop with other influence radii (m), \[W\] equation 2.
    ///
    /// # Errors
    /// When `r_min` is not positive or `r_max` not larger.
    pub fn with_influence(self, r_min: f32, r_max: f32) -> Result<Self, InvalidValue> {
        Self { r_min, r_max, ..self }.checked()
    }

    /// The same drop, moving (m/s).
    ///
    /// # Errors
    /// When the velocity is outside [`VELOCITY`](Self::VELOCITY).
    pub fn with_velocity(self, velocity: Vec3) -> Result<Self, InvalidValue> {
        Self { velocity, ..self }.checked()
    }

    /// `count` drops of `radius` (m) at random in a box; the same seed gives the same drops.
    ///
    /// # Errors
    /// When the box or the radius is not valid for a drop.
    pub fn scatter(
        center: Vec3,
        half_extents: Vec3,
        count: usize,
        radius: f32,
        seed: u64,
    ) -> Result<Vec<Self>, InvalidValue> {
        let drop = Self::new(center + half_extents.abs(), ball_volume(radius))?;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut share = || random.random_range(-1.0..=1.0);
        Ok((0..count)
            .map(|_| {
                let position = center + half_extents * Vec3::new(share(), share(), share());
                Self { position, before: position, ..drop.clone() }
            })
            .collect())
    }

    /// Its radius as a ball (m).
    pub fn radius(&self) -> f32 {
        ball_radius(self.volume)
    }

    /// The strand that carries it, if any.
    pub fn ride(&self) -> Option<StrandPoint> {
        self.ride
    }

    /// The [`Hair`](crate::Hair) that carries it or that it came off, if any: it is drawn where that is.
    pub fn hair(&self) -> Option<Entity> {
        self.hair
    }

    /// Strength of its pull: 1 if its radius is at least r_min, less once it has lost water.
    pub fn strength(&self) -> f32 {
        (self.radius() / self.r_min).min(1.0)
    }

    pub(super) fn ball(position: Vec3, radius: f32) -> Self {
        Self {
            position,
            volume: ball_volume(radius),
            r_min: radius,
            r_max: radius * INFLUENCE,
            before: position,
            ..default()
        }
    }

    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.values([&mut self.position, &mut self.velocity, &mut self.before]);
        tape.values([&mut self.volume, &mut self.counted.0]);
        tape.values([&mut self.r_min, &mut self.r_max, &mut self.lag, &mut self.lying]);
        tape.value(&mut self.touch_count);
        tape.flags([&mut self.drip]);
        let mut hair = self.hair.unwrap_or(Entity::PLACEHOLDER);
        tape.entity(&mut hair);
        self.hair = (hair != Entity::PLACEHOLDER).then_some(hair);
        let mut is_carried = self.ride.is_some();
        tape.flags([&mut is_carried]);
        if !is_carried {
            self.ride = None;
            return;
        }
        let ride = StrandPoint { strand: Entity::PLACEHOLDER, at: 0.0 };
        let ride = self.ride.get_or_insert(ride);
        tape.entity(&mut ride.strand);
        tape.value(&mut ride.at);
    }

    /// The ledger counts none of its water.
    pub(crate) fn forget(&mut self) {
        self.counted.0 = 0.0;
    }

    /// What droplets that are taken one after the other are sorted by: their rows change with what else lives in the
    /// world. Equal ones are where it does not matter.
    pub(super) fn order(&self) -> ([u32; 3], u64, [u32; 3]) {
        let bits = |v: Vec3| v.to_array().map(f32::to_bits);
        (bits(self.position), self.volume.to_bits(), bits(self.velocity))
    }

    fn check_radii(&mut self, violations: &mut Violations) {
        let ValueRange { what, valid, hint, .. } = Self::R_MAX;
        // A value that is out of the setting's own range has been reported already.
        let mut known = Violations::new();
        let is_reported = violations.iter().any(|violation| violation.what == what);
        ValueRange::new(what, self.r_min * 1.001..=*valid.end(), hint).clamp(
            &mut self.r_max,
            || self.r_min * INFLUENCE,
            if is_reported { &mut known } else { violations },
        );
    }

    /// Clamps positions and velocities that the tick itself may drive out of range, such as of a drop on
    /// hair far from the origin or under extreme gravity. Not reported as a fault.
    pub(super) fn keep_in_range(&mut self) {
        let mut known = Violations::new();
        Self::POSITION.clamp(&mut self.position, || self.before, &mut known);
        Self::VELOCITY.clamp(&mut self.velocity, || Vec3::ZERO, &mut known);
    }

    /// Clamps values written from outside. Counted water is never lost: an invalid volume is replaced by
    /// the counted one.
    pub(super) fn repair(&mut self, violations: &mut Violations) {
        let Self { volume, position, velocity, .. } = *self;
        // An empty drop is despawned at the end of the substep.
        let is_empty = (0.0..1e-15).contains(&volume);
        if is_empty {
            self.volume = 1e-15;
        }
        self.clamp_values(violations);
        if is_empty {
            self.volume = volume;
        } else if self.volume != volume {
            self.volume = self.counted.0;
        }
        if self.position != position {
            self.position = Self::POSITION.check(self.before).unwrap_or(Vec3::ZERO);
        }
        if self.velocity != velocity {
            self.velocity = Vec3::ZERO;
        }
    }
}

setting! {
    /// A shower head, or with [`Shower::rain`] a cloud: emits drops along its transform's forward
    /// direction (−Z). The same seed gives the same drops.
    ///
    /// Wetting takes time: of 300 drops a second over 15 cm, a bob holds 20 g after a minute and 29 g after two; film
    /// soaks in with a time constant of 2 minutes ([`HairWetting::soaking`]), to a
    /// [wetness](crate::HairCondition::wetness) of 0.2 and 0.4 by then, and makes hair look wet before.
    /// [`HairProcessTime`](crate::HairProcessTime) makes soaking and drying faster, not the shower: far above
    /// 1, hair dries while it rains. Wind carries drops away. For hair that is wet at once send
    /// [`SoakHair`](crate::SoakHair).
    ///
    /// [`HairWetting::soaking`]: crate::HairWetting::soaking
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(Transform, TickPose)]
    pub struct Shower {
        /// Drops per second; 0 is off.
        pub rate: f32 = 200.0, "1/s" in RATE: 0.0..=1e5, safe 0.0..=2000.0,
            "200 is a gentle shower";
        /// Radius of a drop.
        pub drop_radius: f32 = 1.5e-3, "m" in DROP_RADIUS: 1e-5..=0.05, safe 0.3e-3..=3e-3,
            "rain has 0.5e-3 to 3e-3";
        /// Speed of drops at the head.
        pub speed: f32 = 2.0, "m/s" in SPEED: 0.0..=100.0, safe 0.0..=10.0, "2 is a shower head";
        /// Half angle of the cone.
        pub spread: f32 = 0.15, "rad" in SPREAD: 0.0..=1.57, safe 0.0..=1.5,
            "0.15 is a narrow cone";
        /// Radius of the head.
        pub opening: f32 = 0.06, "m" in OPENING: 0.0..=1e3, safe 0.0..=10.0,
            "0.06 is a shower head";
        /// r_max over r_min of its drops.
        pub influence: f32 = INFLUENCE, in INFLUENCE: 1.01..=100.0, safe 1.5..=10.0, "5 is usual";
        /// Seed of the drops' places and directions.
        pub seed: u64 = 1;
        /// Number of drops that it has emitted.
        pub emitted: u64 = 0;
        /// Fraction of the next drop that is due.
        pub due: f32 = 0.0, "drops" in DUE: 0.0..=1.0, "less than one drop";
        /// Whether the last substep would have emitted more than [`Shower::MAX_DROPS`]; reported when
        /// this begins.
        pub is_limited: bool = false;
    }
}

impl Shower {
    /// What it has emitted.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.value(&mut self.emitted);
        tape.value(&mut self.due);
        tape.flags([&mut self.is_limited]);
    }

    /// Largest number of drops per substep: that of the highest rate in 1/50 s. A longer substep
    /// leaves the rest out, which is reported.
    pub const MAX_DROPS: u64 = 2000;

    /// A shower head of `rate` drops per second, each of `drop_radius` (m).
    ///
    /// # Errors
    /// When one of them is negative, zero for the radius, or not finite.
    pub fn new(rate: f32, drop_radius: f32) -> Result<Self, InvalidValue> {
        Self { rate, drop_radius, ..default() }.checked()
    }

    /// Rain of `rate` drops per second over a disc of `radius` (m), falling at its terminal speed.
    ///
    /// 300 drops a second over 15 cm are 1.3 ml/s. See [`Shower`] for how soon hair is wet.
    ///
    /// # Errors
    /// When one of them is negative or not finite.
    pub fn rain(rate: f32, radius: f32) -> Result<Self, InvalidValue> {
        Self { rate, opening: radius, drop_radius: 1e-3, speed: 6.5, spread: 0.0, ..default() }
            .checked()
    }

    /// Rain on a head at `center` (m): 1,000 drops a second over a disc of 0.3 m, from 1 m above it.
    ///
    /// That is a cloudburst of 53 mm an hour. See [`Shower`] for how soon hair is wet;
    /// [`SoakHair`](crate::SoakHair) is at once.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # fn setup(mut commands: Commands) {
    /// commands.spawn(Shower::rain_on(Vec3::new(0.0, 1.6, 0.0)));
    /// # }
    /// ```
    pub fn rain_on(center: Vec3) -> (Self, Transform) {
        let from_above = Transform::from_translation(center + Vec3::Y);
        let rain = Self {
            rate: 1000.0,
            opening: 0.3,
            drop_radius: 1e-3,
            speed: 6.5,
            spread: 0.0,
            ..default()
        };
        (rain, from_above.looking_to(Dir3::NEG_Y, Dir3::X))
    }

    /// The drops of the next `seconds` in the head's frame (drops leave along −Z), at most
    /// [`Shower::MAX_DROPS`]. Settings must be valid.
    pub(super) fn make(&mut self, seconds: f32) -> impl Iterator<Item = Droplet> + use<> {
        let due = self.due + self.rate * seconds;
        self.due = due.fract();
        self.is_limited = due as u64 > Self::MAX_DROPS;
        let count = (due as u64).min(Self::MAX_DROPS);
        let first = self.emitted;
        self.emitted = first.wrapping_add(count);
        let Self { drop_radius, speed, spread, opening, influence, seed, .. } = *self;
        (0..count).map(move |i| {
            let number = first.wrapping_add(i);
            let mut random = Xoshiro256PlusPlus::seed_from_u64(
                seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15),
            );
            // Uniform over the disc and over the cone.
            let mut in_disc = || {
                let (sine, cosine) =
                    bevy::math::ops::sin_cos(random.random_range(0.0..core::f32::consts::TAU));
                Vec2::new(cosine, sine) * random.random_range(0.0f32..1.0).sqrt()
            };
            let place = in_disc() * opening;
            let aside = in_disc() * bevy::math::ops::tan(spread);
            let mut drop = Droplet::ball(place.extend(0.0), drop_radius);
            drop.r_max = drop.r_min * influence;
            drop.velocity = aside.extend(-1.0).normalize() * speed;
            drop
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_drops_are_refused() {
        assert!(Droplet::new(Vec3::NAN, 1e-9).is_err());
        for volume in [0.0, -1e-9, f64::NAN, f64::INFINITY] {
            let error = Droplet::new(Vec3::ZERO, volume).unwrap_err().to_string();
            assert!(error.contains("volume"), "{error}");
        }
        let drop = Droplet::new(Vec3::ZERO, 1e-9).unwrap();
        assert!(drop.clone().with_influence(0.003, 0.003).is_err());
        assert!(drop.clone().with_influence(0.0, 0.01).is_err());
        assert!(drop.clone().with_influence(0.003, f32::NAN).is_err());
        assert!(drop.clone().with_influence(0.003, 0.015).is_ok());
        assert!(drop.with_velocity(Vec3::splat(f32::INFINITY)).is_err());
        assert!(Droplet::scatter(Vec3::ZERO, Vec3::ONE, 3, 0.0, 1).is_err());
        assert_eq!(Droplet::scatter(Vec3::ZERO, Vec3::ONE, 0, 0.001, 1).unwrap().len(), 0);
        assert!(Shower::new(-1.0, 1e-3).is_err() && Shower::rain(f32::NAN, 1.0).is_err());
    }

    #[test]
    fn invalid_values_written_later_are_repaired_and_water_is_kept() {
        let mut drop = Droplet::new(Vec3::ONE, 4e-9).unwrap();
        drop.counted = Counted(4e-9);
        drop.volume = f64::NAN;
        drop.position = Vec3::NAN;
        drop.velocity = Vec3::NAN;
        drop.r_max = 0.0;
        let mut violations = Violations::new();
        drop.repair(&mut violations);
        assert_eq!(violations.len(), 4);
        assert!(violations[0].found.is_nan(), "what was written: {}", violations[0]);
        assert_eq!((drop.volume, drop.position, drop.velocity), (4e-9, Vec3::ONE, Vec3::ZERO));
        assert!(drop.r_max > drop.r_min);
    }

    #[test]
    fn a_shower_is_repeatable_and_makes_its_rate() {
        let mut a = Shower::default();
        let all: Vec<Droplet> = (0..360).flat_map(|_| a.make(1.0 / 360.0)).collect();
        assert!((199..=201).contains(&all.len()), "{}", all.len());
        let mut b = Shower::default();
        let again: Vec<Droplet> = (0..60).flat_map(|_| b.make(1.0 / 60.0)).collect();
        assert_eq!(all[..150], again[..150]);
        assert!(all.iter().all(|d| d.position.length() <= 0.0601 && d.velocity.z < -1.9));
        let same = Droplet::scatter(Vec3::Y, Vec3::ONE, 10, 1e-3, 7).unwrap();
        assert_eq!(same, Droplet::scatter(Vec3::Y, Vec3::ONE, 10, 1e-3, 7).unwrap());
    }
}
