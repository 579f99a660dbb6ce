//! Drops of water as entities, and where they come from.

use super::model::{ball_radius, ball_volume};
use crate::{
    setting::{Bound, InvalidValue, Notes},
    strand::TickPose,
};
use bevy::prelude::*;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// A drop of water: falls, lands on strands, rides on one and pulls others to it (\[W\] equation 2),
/// soaks in, merges, drips off. Spawn it to wet hair; its water is counted until it has evaporated
/// or left [`DropletRules`](crate::water::DropletRules).
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
    /// Its centre in the world (m).
    pub position: Vec3,
    /// Its velocity (m/s).
    pub velocity: Vec3,
    /// Its volume (m³), 1e-15…1e-3. `f64`, for what goes from drop to hair is counted.
    pub volume: f64,
    /// Distance within which it keeps strands off its core (m).
    pub r_min: f32,
    /// Distance up to which it pulls strands (m), more than `r_min`.
    pub r_max: f32,
    pub(super) ride: Option<Ride>,
    /// Where it was a substep ago.
    pub(super) before: Vec3,
    /// How much of it the ledger knows (m³).
    pub(super) counted: f64,
    /// How many strands are at it.
    pub(super) company: u32,
    /// For how long it has lain on a collider (s).
    pub(crate) lying: f32,
}

/// What carries a drop.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
pub struct Ride {
    /// The strand.
    pub strand: Entity,
    /// Where on it, in segments from the root.
    pub at: f32,
}

/// r_max over r_min where nobody says otherwise, as in the clumping experiment.
const INFLUENCE: f32 = 5.0;

const VOLUME: Bound = Bound::new("Droplet::volume (m³)", 1e-15, 1e-3, "4.2e-9 is a drop of 1 mm");
const R_MIN: Bound = Bound::new("Droplet::r_min (m)", 1e-6, 1.0, "about the drop's own radius");
const COORDINATE: Bound =
    Bound::new("Droplet::position (m)", -1e6, 1e6, "a finite place in the world");
const SPEED: Bound = Bound::new("Droplet::velocity (m/s)", -1e3, 1e3, "rain falls at 6");

impl Default for Droplet {
    /// A drop of 1 mm at the origin.
    fn default() -> Self {
        Self::ball(Vec3::ZERO, 1e-3)
    }
}

impl Droplet {
    /// A drop at rest, of `volume` (m³), that pulls up to five times its radius.
    ///
    /// # Errors
    /// When the place is not finite or the volume outside 1e-15…1e-3 m³.
    pub fn new(position: Vec3, volume: f64) -> Result<Self, InvalidValue> {
        position.to_array().into_iter().try_for_each(|x| COORDINATE.check(x).map(drop))?;
        VOLUME.check(volume as f32)?;
        Ok(Self { volume, ..Self::ball(position, ball_radius(volume)) })
    }

    /// The same drop with other influence radii (m), \[W\] equation 2.
    ///
    /// # Errors
    /// When `r_min` is not positive or `r_max` not larger.
    pub fn with_influence(mut self, r_min: f32, r_max: f32) -> Result<Self, InvalidValue> {
        self.r_min = R_MIN.check(r_min)?;
        self.r_max = r_max_bound(r_min).check(r_max)?;
        Ok(self)
    }

    /// The same drop, moving (m/s).
    ///
    /// # Errors
    /// When the velocity is not finite or beyond 1000 m/s.
    pub fn with_velocity(mut self, velocity: Vec3) -> Result<Self, InvalidValue> {
        velocity.to_array().into_iter().try_for_each(|x| SPEED.check(x).map(drop))?;
        self.velocity = velocity;
        Ok(self)
    }

    /// `count` drops of `radius` (m) strewn evenly over a box, the same for the same seed.
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
    pub fn ride(&self) -> Option<Ride> {
        self.ride
    }

    /// How strongly it pulls: 1 from the size on that its r_min is made for, less when it has given
    /// water away.
    pub fn strength(&self) -> f32 {
        (self.radius() / self.r_min).min(1.0)
    }

    pub(super) fn ball(position: Vec3, radius: f32) -> Self {
        Self {
            position,
            velocity: Vec3::ZERO,
            volume: ball_volume(radius),
            r_min: radius,
            r_max: radius * INFLUENCE,
            ride: None,
            before: position,
            counted: 0.0,
            company: 1,
            lying: 0.0,
        }
    }

    /// Brings what was written into it back into its ranges. Water that was known is never lost: an
    /// impossible volume counts as unchanged.
    pub(super) fn mend(&mut self, notes: &Notes) {
        if !(self.volume >= 0.0 && VOLUME.check(self.volume.max(1e-15) as f32).is_ok()) {
            VOLUME.mend(self.volume as f32, 0.0, notes);
            self.volume = self.counted;
        }
        let finite =
            |v: Vec3, bound: &Bound| v.to_array().into_iter().all(|x| bound.check(x).is_ok());
        if !finite(self.position, &COORDINATE) {
            COORDINATE.mend(f32::NAN, 0.0, notes);
            self.position = if finite(self.before, &COORDINATE) { self.before } else { Vec3::ZERO };
        }
        if !finite(self.velocity, &SPEED) {
            SPEED.mend(f32::NAN, 0.0, notes);
            self.velocity = Vec3::ZERO;
        }
        self.r_min = R_MIN.mend(self.r_min, 1e-3, notes);
        let least = r_max_bound(self.r_min);
        self.r_max = least.mend(self.r_max, self.r_min * INFLUENCE, notes);
    }
}

fn r_max_bound(r_min: f32) -> Bound {
    Bound::new("Droplet::r_max (m)", r_min * 1.001, 10.0, "more than r_min, five times as a rule")
}

/// A shower head, or with [`Shower::rain`] a cloud: makes drops and sends them along its transform's
/// forward direction (−Z). The same drops for the same seed.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
#[require(Transform, TickPose)]
pub struct Shower {
    /// Drops per second. Default 200, safe 0…2000; 0 is off.
    pub rate: f32,
    /// Radius of a drop (m). Default 1.5e-3, safe 0.3e-3…3e-3.
    pub drop_radius: f32,
    /// Speed of drops at the head (m/s). Default 2, safe 0…10.
    pub speed: f32,
    /// Half angle of the cone (rad). Default 0.15, safe 0…1.5.
    pub spread: f32,
    /// Radius of the head (m). Default 0.06, safe 0…10.
    pub opening: f32,
    /// r_max over r_min of its drops. Default 5, safe 1.5…10.
    pub influence: f32,
    /// Seed of the drops' places and directions.
    pub seed: u64,
    /// How many drops it has made.
    pub made: u64,
    /// The part of the next drop that is due.
    pub owed: f32,
}

impl Default for Shower {
    fn default() -> Self {
        Self {
            rate: 200.0,
            drop_radius: 1.5e-3,
            speed: 2.0,
            spread: 0.15,
            opening: 0.06,
            influence: INFLUENCE,
            seed: 1,
            made: 0,
            owed: 0.0,
        }
    }
}

const RATE: Bound = Bound::new("Shower::rate (1/s)", 0.0, 1e5, "200 is a gentle shower");
const DROP_RADIUS: Bound =
    Bound::new("Shower::drop_radius (m)", 1e-5, 0.05, "rain has 0.5e-3 to 3e-3");
const OUTLET: Bound = Bound::new("Shower::speed (m/s)", 0.0, 100.0, "2 is a shower head");
const SPREAD: Bound = Bound::new("Shower::spread (rad)", 0.0, 1.57, "0.15 is a narrow cone");
const OPENING: Bound = Bound::new("Shower::opening (m)", 0.0, 1e3, "0.06 is a shower head");
const INFLUENCES: Bound = Bound::new("Shower::influence", 1.01, 100.0, "5 is usual");

impl Shower {
    /// A shower head of `rate` drops per second, each of `drop_radius` (m).
    ///
    /// # Errors
    /// When one of them is negative, zero for the radius, or not finite.
    pub fn new(rate: f32, drop_radius: f32) -> Result<Self, InvalidValue> {
        RATE.check(rate)?;
        DROP_RADIUS.check(drop_radius)?;
        Ok(Self { rate, drop_radius, ..default() })
    }

    /// Rain of `rate` drops per second over a disc of `radius` (m), falling at its terminal speed.
    ///
    /// # Errors
    /// When one of them is negative or not finite.
    pub fn rain(rate: f32, radius: f32) -> Result<Self, InvalidValue> {
        RATE.check(rate)?;
        OPENING.check(radius)?;
        Ok(Self { rate, opening: radius, drop_radius: 1e-3, speed: 6.5, spread: 0.0, ..default() })
    }

    pub(super) fn mended(&self, notes: &Notes) -> Self {
        let d = Self::default();
        Self {
            rate: RATE.mend(self.rate, d.rate, notes),
            drop_radius: DROP_RADIUS.mend(self.drop_radius, d.drop_radius, notes),
            speed: OUTLET.mend(self.speed, d.speed, notes),
            spread: SPREAD.mend(self.spread, d.spread, notes),
            opening: OPENING.mend(self.opening, d.opening, notes),
            influence: INFLUENCES.mend(self.influence, d.influence, notes),
            ..self.clone()
        }
    }

    /// The drops of the next `seconds`, seen from the head (drops leave along −Z). Settings must be
    /// valid.
    pub(super) fn make(&mut self, seconds: f32) -> impl Iterator<Item = Droplet> + use<> {
        let owed = self.owed + self.rate * seconds;
        let count = owed as u64;
        self.owed = owed - count as f32;
        let first = self.made;
        self.made += count;
        let Self { drop_radius, speed, spread, opening, influence, seed, .. } = *self;
        (first..first + count).map(move |number| {
            let mut random = Xoshiro256PlusPlus::seed_from_u64(
                seed ^ number.wrapping_mul(0x9E37_79B9_7F4A_7C15),
            );
            // Evenly over the disc, evenly over the cone.
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
    fn bad_drops_are_refused() {
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
    fn nonsense_written_later_is_mended_and_its_water_kept() {
        let mut drop = Droplet::new(Vec3::ONE, 4e-9).unwrap();
        drop.counted = 4e-9;
        drop.volume = f64::NAN;
        drop.position = Vec3::NAN;
        drop.velocity = Vec3::NAN;
        drop.r_max = 0.0;
        let notes = Notes::default();
        drop.mend(&notes);
        assert_eq!(notes.into_inner().len(), 4);
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
