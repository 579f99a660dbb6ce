//! How fast water leaves into the air: vapour, wet bulbs, transfer, and the jet of a hair dryer.
//!
//! Sources: Magnus' formula for the pressure of vapour; Churchill and Bernstein's law for a
//! cylinder in a cross flow; a hand dryer's air at 15, 10 and 5 cm has 47, 61 and 95 °C and
//! dries a tress in 60, 30 and 15 s (Lee 2011).

use super::HairClimate;
use bevy::{
    math::ops::{exp, powf},
    prelude::Resource,
};

/// Density of water (kg/m³).
pub const WATER: f64 = 1000.0;
/// Diffusivity of vapour in air (m²/s).
const DIFFUSIVITY: f32 = 2.6e-5;
/// Kinematic viscosity of air (m²/s).
const VISCOSITY: f32 = 1.5e-5;
/// Latent heat of a kilogram of vapour, over the heat capacity of a cubic metre of air and Lewis'
/// factor between transfer of heat and of mass (K m³/kg).
const WET_BULB: f32 = 2.45e6 / 1085.0;

/// Density of saturated vapour (kg/m³) at a temperature (°C).
pub(crate) fn saturated(celsius: f32) -> f32 {
    let pressure = 610.94 * exp(17.625 * celsius / (celsius + 243.04));
    pressure * 0.018_015 / (8.314 * (celsius + 273.15))
}

/// The drive of evaporation: how much denser vapour is at a wet surface at its wet-bulb temperature than
/// in the air (kg/m³). `vapour` is the density in the air.
///
/// The surface has its wet-bulb temperature, where the heat it takes from the air is the heat that
/// evaporation takes.
pub(crate) fn drive(celsius: f32, vapour: f32) -> f32 {
    // The balance is monotonic in the surface temperature: bisection.
    let (mut low, mut high) = (-80.0_f32, celsius);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let gained = celsius - middle;
        let lost = WET_BULB * (saturated(middle) - vapour);
        if lost > gained { high = middle } else { low = middle }
    }
    (saturated(0.5 * (low + high)) - vapour).max(0.0)
}

/// Transfer of vapour from a cylinder of `diameter` (m) across air of `speed` (m/s), as a speed
/// (m/s): Sh D/d with Churchill and Bernstein's Sh.
#[inline]
#[doc(hidden)]
pub fn transfer(speed: f32, diameter: f32) -> f32 {
    const SCHMIDT: f32 = VISCOSITY / DIFFUSIVITY;
    // 0.62 Sc^(1/3) / (1 + (0.4/Sc)^(2/3))^(1/4), a constant of the air.
    const FACTOR: f32 = 0.445;
    const _: () = assert!(SCHMIDT > 0.57 && SCHMIDT < 0.58);
    let reynolds = speed * diameter / VISCOSITY;
    (0.3 + FACTOR * reynolds.sqrt()) * DIFFUSIVITY / diameter
}

/// Water that hair holds in air of a relative humidity, as a share of its dry mass (regain).
pub fn regain(humidity: f32) -> f32 {
    0.31 * (0.61 * humidity + 0.39 * powf(humidity, 7.2))
}

/// The humidity of a room, at which hair counts as dry.
pub(crate) const ROOM_HUMIDITY: f32 = 0.5;

/// The relative humidity of air that counts as saturated: in air without any drive hair would not take up
/// vapour either.
const SATURATED: f32 = 0.995;

/// The wetness that hair takes on in air of a relative humidity: 0 in a room and in drier air, 1 in
/// saturated air.
pub(crate) fn equilibrium(humidity: f32) -> f32 {
    let dry = regain(ROOM_HUMIDITY);
    ((regain(humidity) - dry) / (regain(1.0) - dry)).clamp(0.0, 1.0)
}

/// How far from the nozzle a dryer's air keeps its speed and temperature (m).
pub(crate) const JET_CORE: f32 = 0.045;

/// The share of its speed, and of its warmth above the room's, that a dryer's air has left at a
/// distance along its axis (m): a free round jet falls as 1/x beyond its core.
#[inline]
pub fn jet(along: f32) -> f32 {
    JET_CORE / along.max(JET_CORE)
}

/// A table of evaporation's drive over temperature: solving for the wet bulb at every node is too
/// slow. The resource holds the air of the [`HairClimate`].
#[derive(Resource, Clone, Debug)]
#[doc(hidden)]
pub struct DryingAir {
    /// Temperature of the room (°C).
    pub celsius: f32,
    /// Speed of its draught (m/s).
    pub draught: f32,
    /// The wetness that hair takes on in it.
    pub equilibrium: f32,
    drives: [f32; Self::ENTRIES],
}

impl Default for DryingAir {
    fn default() -> Self {
        Self::of(&HairClimate::default())
    }
}

impl DryingAir {
    const ENTRIES: usize = 48;
    const STEP: f32 = 4.0;

    /// The air of a room; temperature in °C, relative humidity 0…1, draught in m/s.
    pub fn new(celsius: f32, humidity: f32, draught: f32) -> Self {
        let humidity = humidity.min(SATURATED);
        let vapour = humidity * saturated(celsius);
        let drives = core::array::from_fn(|i| drive(celsius + i as f32 * Self::STEP, vapour));
        Self { celsius, draught, equilibrium: equilibrium(humidity), drives }
    }

    /// The air of a climate, whose values are valid.
    pub fn of(&HairClimate { celsius, humidity, draught }: &HairClimate) -> Self {
        Self::new(celsius, humidity, draught)
    }

    /// Evaporation's drive (kg/m³) in this air, warmed by `warmth` (K).
    #[inline]
    pub fn drive(&self, warmth: f32) -> f32 {
        let x = (warmth / Self::STEP).clamp(0.0, Self::ENTRIES as f32 - 1.001);
        let i = x as usize;
        let t = x - i as f32;
        self.drives[i] * (1.0 - t) + self.drives[i + 1] * t
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vapour_is_that_of_the_tables() {
        // 20 °C: 17.3 g/m³, 0 °C: 4.85 g/m³
        assert!((saturated(20.0) - 0.0173).abs() < 1e-4);
        assert!((saturated(0.0) - 0.004_85).abs() < 5e-5);
        let vapour = 0.5 * saturated(22.0);
        // A psychrometer at 22 °C and 50 % shows 15.4 °C.
        let wet = drive(22.0, vapour) + vapour;
        assert!((wet - saturated(15.4)).abs() < 4e-4, "{wet}");
        assert!(drive(22.0, saturated(22.0)) < 1e-5, "saturated air dries nothing");
    }

    #[test]
    fn transfer_is_churchill_and_bernsteins() {
        for (u, d) in [(0.1_f32, 70e-6_f32), (1.0, 70e-6), (5.0, 2e-3)] {
            let sc = VISCOSITY / DIFFUSIVITY;
            let re = u * d / VISCOSITY;
            let sh = 0.3
                + 0.62 * re.sqrt() * sc.powf(1.0 / 3.0)
                    / (1.0 + (0.4 / sc).powf(2.0 / 3.0)).powf(0.25);
            let expected = sh * DIFFUSIVITY / d;
            assert!((transfer(u, d) / expected - 1.0).abs() < 0.01, "{u} {d}");
        }
    }

    #[test]
    fn regain_is_the_measured_table() {
        for (rh, percent) in [(0.3, 6.0), (0.5, 9.8), (0.65, 12.8), (0.8, 17.5), (0.9, 23.0)] {
            assert!((100.0 * regain(rh) - percent).abs() < 0.7, "{rh}");
        }
    }

    /// Of what hair binds beyond the regain in a room, by the same table; 31 % in saturated air.
    #[test]
    fn wetness_in_damp_air_is_that_of_the_table() {
        for (rh, percent) in [(0.3, 6.0), (0.5, 9.8), (0.65, 12.8), (0.8, 17.5), (0.9, 23.0)] {
            let wetness = (percent - 9.8) / (31.0 - 9.8_f32);
            assert!((equilibrium(rh) - wetness.max(0.0)).abs() < 0.02, "{rh}: {}", equilibrium(rh));
        }
        for rh in [0.9, 0.97, 1.0] {
            let air = DryingAir::new(22.0, rh, 0.1);
            // How fast hair takes up vapour: the drive over what is missing to saturation.
            let uptake = air.drive(0.0) / (1.0 - air.equilibrium);
            assert!((1e-3..1.6e-3).contains(&uptake), "{rh}: {uptake}");
        }
    }

    #[test]
    fn the_table_of_drives_is_the_drive() {
        let air = DryingAir::new(22.0, 0.5, 0.1);
        for warmth in [0.0_f32, 3.0, 25.0, 39.0, 73.0, 150.0] {
            let exact = drive(22.0 + warmth, 0.5 * saturated(22.0));
            assert!((air.drive(warmth) / exact - 1.0).abs() < 0.01, "{warmth}");
        }
        assert!(air.drive(1e9).is_finite() && air.drive(-5.0).is_finite());
    }
}
