//! Forces on submerged hair as pure functions: buoyancy, drag and added mass.
//!
//! A strand stands for a lock of fibres with water between them: a long cylinder as thick as the
//! lock, or a single fibre. The water inside moves with it, and as much again is displaced when it
//! moves across its axis (added mass of a cylinder; along the axis there would be none).

use crate::hair::strand::InWater;
use bevy::{math::ops, prelude::*};

/// Smallest Reynolds number that was measured; smaller ones are clamped to it.
const MIN_REYNOLDS: f32 = 1e-4;

/// Reynolds number times drag coefficient of a long cylinder across a flow.
///
/// c_D = 6.8/Re^0.89 + 1.96/√Re + 1.18, which fits measurements from Re = 10⁻⁴ to that of a
/// turbulent wake (Sucker & Brauer, *Fluiddynamik bei quer angeströmten Zylindern*, 1975).
pub fn drag_across(reynolds: f32) -> f32 {
    let re = reynolds.max(MIN_REYNOLDS);
    6.8 * ops::powf(re, 0.11) + 1.96 * re.sqrt() + 1.18 * re
}

/// The same for a flow along the cylinder: half of that across at low Reynolds numbers, as for all
/// slender bodies (Batchelor 1970); only friction at higher ones.
pub fn drag_along(reynolds: f32) -> f32 {
    3.4 * ops::powf(reynolds.max(MIN_REYNOLDS), 0.11)
}

/// The water around submerged hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Water {
    /// Density (kg/m³).
    pub density: f32,
    /// Dynamic viscosity (Pa s).
    pub viscosity: f32,
    /// Velocity (m/s).
    pub current: Vec3,
}

/// A lock, per metre of its length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lock {
    /// Its diameter (m).
    pub diameter: f32,
    /// Dry mass of its fibres (kg/m).
    pub dry_mass: f32,
    /// Cross-section of its fibres (m²).
    pub fibres: f32,
}

impl Lock {
    fn section(&self) -> f32 {
        0.25 * core::f32::consts::PI * self.diameter * self.diameter
    }

    /// Its weight under water per unit of gravity (kg/m); negative if it floats.
    pub fn submerged_mass(&self, water: &Water) -> f32 {
        self.dry_mass - water.density * self.fibres
    }

    /// Drag on a metre of it that moves relative to the water by `through` (m/s): force over speed
    /// (N s/m²), across and along its axis. Along is never more than across.
    pub fn drag(&self, through: Vec3, tangent: Vec3, water: &Water) -> [f32; 2] {
        let per_speed = water.density * self.diameter / water.viscosity;
        let along = through.dot(tangent);
        let across = (through - tangent * along).length();
        let friction = drag_along(through.length() * per_speed);
        // Pressure drag depends on the flow across alone, friction on all of it.
        let pressed = drag_across(across * per_speed).max(2.0 * friction);
        [pressed, friction].map(|drag| 0.5 * water.viscosity * drag)
    }

    /// The velocity (m/s) after drag in a substep of `dt` (s), without gravity, of a node of which
    /// a `share` is under water, and its effective inertia and weight. `load` is its added mass
    /// over its dry mass.
    ///
    /// Drag is implicit: the node is heavier by drag · dt for all forces. Drag along the strand is
    /// smaller, which is corrected in the velocity. So nodes sink at their terminal speed and come
    /// to rest in equilibrium at any substep.
    pub(crate) fn immerse(
        &self,
        velocity: Vec3,
        tangent: Vec3,
        load: f32,
        (share, water): (f32, &Water),
        dt: f32,
    ) -> (Vec3, InWater) {
        let own = self.dry_mass * (1.0 + load);
        // Water between the fibres and displaced water.
        let displaced = water.density * (2.0 * self.section() - self.fibres);
        let inert = own + share * displaced;
        let through = velocity - water.current;
        let [across, along] = self.drag(through, tangent, water).map(|d| share * d * dt / inert);
        let retained = 1.0 / (1.0 + across);
        let correction = tangent * (through.dot(tangent) * (across - along));
        let slowed = (velocity + water.current * across + correction) * retained;
        let weight = own + share * (self.submerged_mass(water) - own);
        let in_water = InWater {
            share,
            inertia: inert / (retained * own),
            gravity: weight * retained / inert,
            retained,
        };
        (slowed, in_water)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const STILL: Water = Water { density: 1000.0, viscosity: 1e-3, current: Vec3::ZERO };

    /// A lock of so many fibres of 70 µm, packed by `packing`.
    fn lock(fibres: f32, packing: f32) -> Lock {
        let section = fibres * core::f32::consts::PI * 35e-6 * 35e-6;
        let diameter = 2.0 * (section / packing / core::f32::consts::PI).sqrt();
        Lock { diameter, dry_mass: 1310.0 * section, fibres: section }
    }

    #[test]
    fn drag_is_lambs_in_creeping_flow_and_that_of_experiments_beyond() {
        // Lamb: c_D Re = 8π / ln(7.406 / Re), to the first order of a small Re.
        for re in [1e-3_f32, 1e-2, 0.1] {
            let lamb = 8.0 * core::f32::consts::PI / (7.406 / re).ln();
            assert!((drag_across(re) / lamb - 1.0).abs() < 0.16, "{re}: {}", drag_across(re));
        }
        // Tritton 1959: c_D of 10.6 at Re 1, 2.8 at 10, 1.4 at 100; a wake has 1.2.
        for (re, expected) in [(1.0, 10.6), (10.0, 2.8), (100.0, 1.4), (3e4, 1.2)] {
            let found = drag_across(re) / re;
            assert!((found / expected - 1.0).abs() < 0.13, "{re}: {found}");
        }
        assert!(drag_along(1e-3) / drag_across(1e-3) > 0.48);
        assert_eq!(drag_across(0.0), drag_across(1e-5), "at rest it is not nothing");
    }

    /// The speed at which drag bears the weight under water, by halving.
    fn terminal(lock: &Lock, tangent: Vec3, gravity: f32) -> f32 {
        let weight = lock.submerged_mass(&STILL) * gravity;
        let drag = |speed: f32| {
            let [across, along] = lock.drag(Vec3::NEG_Y * speed, tangent, &STILL);
            speed * if tangent.y == 0.0 { across } else { along }
        };
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if drag(middle) < weight { low = middle } else { high = middle }
        }
        low
    }

    #[test]
    fn locks_and_fibres_sink_at_their_terminal_speed_whatever_the_substep() {
        for (fibres, packing) in [(1.0, 1.0), (10.0, 0.6), (500.0, 0.6)] {
            let lock = lock(fibres, packing);
            for tangent in [Vec3::X, Vec3::Y] {
                let expected = terminal(&lock, tangent, 9.8);
                for dt in [1.0 / 1440.0, 1.0 / 360.0, 1.0 / 30.0] {
                    let mut v = Vec3::ZERO;
                    for _ in 0..(60.0 / dt) as u32 {
                        let (slowed, water) = lock.immerse(v, tangent, 0.0, (1.0, &STILL), dt);
                        v = slowed + Vec3::NEG_Y * (9.8 * water.gravity * dt);
                    }
                    assert!((-v.y / expected - 1.0).abs() < 2e-3, "{fibres} {tangent} {dt}: {v}");
                }
            }
        }
        // Lamb's law for a fibre that lies: 4πμU / ln(7.406/Re) = 310 kg/m³ g πr².
        let fibre = lock(1.0, 1.0);
        let (mut speed, weight) = (3e-3_f32, 310.0 * fibre.fibres * 9.8);
        for _ in 0..50 {
            let re = speed * 70e-6 / 1e-6;
            speed = weight * (7.406 / re).ln() / (4.0 * core::f32::consts::PI * 1e-3);
        }
        let found = terminal(&fibre, Vec3::X, 9.8);
        assert!((found / speed - 1.0).abs() < 0.05, "{found} m/s, {speed} by Lamb's law");
    }

    #[test]
    fn what_rests_weighs_what_buoyancy_leaves() {
        let lock = lock(500.0, 0.6);
        for share in [0.0, 0.3, 1.0] {
            let (v, water) = lock.immerse(Vec3::ZERO, Vec3::X, 0.2, (share, &STILL), 1.0 / 360.0);
            assert_eq!(v, Vec3::ZERO);
            // Weight over dry weight: with its load in the air, less what it displaces under water.
            let weight = 1.2 * water.inertia * water.gravity;
            let expected = 1.2 * (1.0 - share) + share * (1.0 - 1000.0 / 1310.0);
            assert!((weight - expected).abs() < 1e-5, "{share}: {weight}");
        }
        let (_, dry) = lock.immerse(Vec3::X, Vec3::X, 0.2, (0.0, &STILL), 1.0 / 360.0);
        assert_eq!(dry, InWater::default());
    }

    proptest! {
        #[test]
        fn drag_never_adds_to_motion_through_the_water(
            v in proptest::array::uniform3(-1e3f32..1e3),
            u in proptest::array::uniform3(-10.0f32..10.0),
            t in proptest::array::uniform3(-1.0f32..1.0),
            (fibres, share, dt) in (1.0f32..1e4, 0.0f32..1.0, 1e-5f32..1.0),
            (density, viscosity) in (1.0f32..2e4, 1e-6f32..1e3),
        ) {
            let water = Water { density, viscosity, current: Vec3::from(u) };
            let tangent = Vec3::from(t).normalize_or(Vec3::X);
            let (after, in_water) =
                lock(fibres, 0.6).immerse(Vec3::from(v), tangent, 0.0, (share, &water), dt);
            let through = Vec3::from(v) - water.current;
            let left = after - water.current;
            prop_assert!(left.length() <= through.length() * 1.001 + 1e-3, "{} of {}", left, through);
            prop_assert!(left.dot(through) >= -1e-3 * (1.0 + through.length_squared()));
            prop_assert!(in_water.inertia.is_finite() && in_water.inertia >= 1.0 - 1e-5);
            prop_assert!((0.0..=1.0).contains(&in_water.retained) && in_water.gravity <= 1.0);
        }
    }
}
