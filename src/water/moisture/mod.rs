//! Water on and in a strand: a film on its surface, bound water inside, and their transport.
//!
//! Two volumes per node (m³ in `f64`, so that nothing is lost by rounding): the **film** on the
//! lock flows down, creeps along and drips; the **bound** water has soaked into the fibres, where
//! it opens hydrogen bonds. The film dries first, then the bound water.

mod flow;

pub(crate) use flow::{Exposure, WaterConditions, WaterLoss};

use super::{Counted, drag::Lock};
use crate::base::{parallel::prefetch, setting::setting, tape::Tape};
use crate::forces::environment::vapour::WATER;
use bevy::prelude::*;
use core::f32::consts::PI;

/// Density of dry keratin (kg/m³).
const KERATIN: f32 = 1310.0;
/// Share of a lock's cross-section that its fibres fill.
const PACKING: f32 = 0.6;
/// Bound water of soaked hair beyond the regain at room humidity, as a share of the dry mass.
const SATURATION: f32 = 0.31 - 0.0957;

setting! {
    /// How hair absorbs and loses water, and the forces of water on it. Component of a
    /// [`Hair`](crate::Hair); where absent, [`HairDefault<HairWetting>`](crate::HairDefault) holds.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairWetting {
        /// How many fibres a simulated strand stands for; with the diameter it gives the strand's
        /// mass, thickness and water capacity. 200 strands of 500 are a head of hair.
        pub fibres: f32 = 500.0, in FIBRES: 1.0..=1e6, safe 1.0..=1e4,
            "500 on each of 200 strands";
        /// Diameter of a fibre.
        pub fibre_diameter: f32 = 70e-6, "m" in FIBRE_DIAMETER: 1e-6..=1e-3, safe 40e-6..=120e-6,
            "hair has 50e-6 to 100e-6";
        /// Largest acceleration that a droplet gives a node, \[W\] equation 2; the paper has 1
        /// without a unit. Less for droplets smaller than their r_min, and for nodes that water has
        /// made heavy.
        pub adhesion: f32 = 30.0, "m/s²" in ADHESION: 0.0..=1e3, safe 0.0..=100.0,
            "30 clumps soft hair";
        /// Largest acceleration with which the film between two strands draws them together; 0 for
        /// none. Capillary forces give up to 2σ/λ, 57 m/s² for the default's mass λ of a metre of
        /// strand, where all of an edge is bridged.
        pub cohesion: f32 = 10.0, "m/s²" in COHESION: 0.0..=1e3, safe 0.0..=50.0, "10 holds locks";
        /// Rate at which the relative velocity of strands decays where a film or a droplet joins them;
        /// 0 lets them slip.
        pub film_drag: f32 = 30.0, "1/s" in FILM_DRAG: 0.0..=1e6, safe 0.0..=1000.0,
            "30 holds locks";
        /// Rate at which a droplet spreads into the film of strands that it touches; 0 leaves
        /// droplets whole.
        pub uptake: f32 = 20.0, "1/s" in UPTAKE: 0.0..=1e4, safe 0.0..=100.0,
            "20 absorbs a drop at once";
        /// Rate at which film soaks into the fibres. 1/120 is virgin hair; bleached hair is two to
        /// four times as fast.
        pub soaking: f32 = 1.0 / 120.0, "1/s" in SOAKING: 0.0..=1e3, safe 0.0..=1.0,
            "1/120 is virgin hair";
        /// Diffusivity of the film along the strand by capillary action.
        pub wicking: f32 = 1e-5, "m²/s" in WICKING: 0.0..=1.0, safe 0.0..=1e-3,
            "1e-5 creeps along";
        /// Rate of evaporation as a multiple of that of a lock in free air; less deep inside dense
        /// hair, 0 never dries.
        pub evaporation: f32 = 1.0, in EVAPORATION: 0.0..=1e3, safe 0.0..=10.0,
            "1 is a lock in free air";
        /// Time constant with which hydrogen bonds follow the water; 0 follows at once.
        pub bond_time: f32 = 1.0, "s" in BOND_TIME: 0.0..=1e4, safe 0.0..=60.0,
            "1 follows water closely";
        /// Share of its stiffness that soaked hair loses beyond its open hydrogen bonds. With the 0.67
        /// that they leave, 0.33 gives wet hair 0.45 of its dry stiffness, as measured.
        pub softening: f32 = 0.33, in SOFTENING: 0.0..=0.95, safe 0.0..=0.9, "0.33 is measured";
        /// Time constant of a 1 mm droplet that slides down a strand: the speed that gravity's pull
        /// along it gives in this time; 0 pins droplets where they land.
        pub sliding: f32 = 0.01, "s" in SLIDING: 0.0..=10.0, safe 0.0..=0.1, "0.01 slides, 0 pins";
    }
}

impl HairWetting {
    /// Radius of a bundle of `strands` strands' fibres that holds a drop together, √N r (m).
    pub fn bundle(&self, strands: f32) -> f32 {
        (self.fibres * strands).sqrt() * 0.5 * self.fibre_diameter
    }

    /// Radius of the lock that a strand stands for (m).
    pub fn lock_radius(&self) -> f32 {
        self.bundle(1.0) / PACKING.sqrt()
    }

    /// Dry mass of a metre of strand (kg/m).
    pub fn dry_mass(&self) -> f32 {
        let radius = 0.5 * self.fibre_diameter;
        self.fibres * KERATIN * PI * radius * radius
    }

    /// The strand as a lock, on which surrounding water acts.
    pub(super) fn lock(&self) -> Lock {
        let dry_mass = self.dry_mass();
        Lock { diameter: 2.0 * self.lock_radius(), dry_mass, fibres: dry_mass / KERATIN }
    }

    /// The share of the difference by which hydrogen bonds follow the water in some seconds.
    pub(super) fn bonds_follow(&self, seconds: f32) -> f32 {
        1.0 - bevy::math::ops::exp(-seconds / self.bond_time.max(1e-9))
    }

    /// Capacity for bound water of a metre of strand, beyond the regain at room humidity (m³/m).
    pub fn capacity(&self) -> f64 {
        f64::from(self.dry_mass() * SATURATION) / WATER
    }
}

/// The water of a strand, node by node, root first. Empty on hair that has had no water: such hair
/// costs nothing, and its hydrogen bonds are left to [`HairTreatment`](crate::HairTreatment) and
/// equation 19.
///
/// Where there is water, hydrogen bonds follow it. The tick writes it; to wet hair from game code
/// spawn a [`Droplet`](crate::Droplet) or send a [`SoakHair`](crate::SoakHair). A clone brings its water
/// into the world: the [`WaterLedger`](crate::WaterLedger) counts it as it appears.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct Moisture {
    film: Vec<f64>,
    bound: Vec<f64>,
    wetness: Vec<f32>,
    sheen: Vec<f32>,
    /// How far the wetness or the bonds of hair without a film have moved since that last woke it.
    #[reflect(ignore)]
    drift: f32,
    /// Whether it was set at once and bonds have yet to follow.
    #[reflect(ignore)]
    hurries: bool,
    /// How much of it the ledger has counted (m³).
    #[reflect(ignore)]
    counted: Counted,
}

/// Share of a node's film capacity that stays after a drop has detached.
pub(super) const AFTER_DRIP: f64 = 0.7;

/// Share of a node's film capacity at which it looks fully wet.
const SHINES_AT: f64 = 0.15;

/// Change of wetness or of bonds that moves nodes by less than can be seen.
const SMALL: f32 = 0.01;

impl Moisture {
    /// Whether the strand has had no water since it was last dry.
    pub fn is_untouched(&self) -> bool {
        self.film.is_empty()
    }

    /// Whether there is a film on it: then it is wet. Hair whose water is all bound is damp.
    pub fn has_film(&self) -> bool {
        self.film.iter().any(|film| *film > 0.0)
    }

    /// The film on each node (m³).
    pub fn film(&self) -> &[f64] {
        &self.film
    }

    /// The water bound at each node beyond the regain at room humidity (m³).
    pub fn bound(&self) -> &[f64] {
        &self.bound
    }

    /// Bound water of each node as a share of its capacity: 0 dry, 1 soaked.
    pub fn wetness(&self) -> &[f32] {
        &self.wetness
    }

    /// How wet each node looks: soaked, or covered by film. 0 dry, 1 dripping.
    pub fn sheen(&self) -> &[f32] {
        &self.sheen
    }

    /// All its water (m³).
    pub fn volume(&self) -> f64 {
        self.film.iter().chain(&self.bound).sum()
    }

    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.list(&mut self.film);
        tape.list(&mut self.bound);
        tape.list(&mut self.wetness);
        tape.list(&mut self.sheen);
        tape.value(&mut self.drift);
        tape.flags([&mut self.hurries]);
        tape.value(&mut self.counted.0);
    }

    /// Whether all is known of each node.
    pub(crate) fn is_even(&self) -> bool {
        let nodes = self.film.len();
        self.bound.len() == nodes && self.wetness.len() == nodes && self.sheen.len() == nodes
    }

    /// Resizes to `nodes`. Returns the water of removed nodes (m³).
    pub(super) fn fit(&mut self, nodes: usize) -> f64 {
        if self.film.len() == nodes {
            return 0.0;
        }
        let cut = |water: &mut Vec<f64>| water.drain(nodes.min(water.len())..).sum::<f64>();
        let lost = cut(&mut self.film) + cut(&mut self.bound);
        self.film.resize(nodes, 0.0);
        self.bound.resize(nodes, 0.0);
        self.wetness.resize(nodes, 0.0);
        self.sheen.resize(nodes, 0.0);
        self.counted.0 -= lost;
        lost
    }

    /// Repairs values written by reflection: arrays of equal length, volumes finite and not negative.
    /// Returns the first invalid value.
    pub(super) fn repair(&mut self) -> Option<String> {
        let nodes = self.film.len();
        self.hurries = nodes > 0;
        let mut found = None;
        for (name, volumes) in [("film", &mut self.film), ("bound water", &mut self.bound)] {
            if volumes.len() != nodes {
                let length = volumes.len();
                found.get_or_insert_with(|| {
                    format!(
                        "{name} of {length} nodes, expected {nodes}: truncated or padded with 0"
                    )
                });
                volumes.resize(nodes, 0.0);
            }
            for (i, volume) in volumes.iter_mut().enumerate() {
                if !(0.0..1.0).contains(volume) {
                    found.get_or_insert_with(|| {
                        format!("{name} of node {i} is {volume} m³, expected 0 to 1: set to 0")
                    });
                    *volume = 0.0;
                }
            }
        }
        for (name, shares) in [("wetness", &mut self.wetness), ("sheen", &mut self.sheen)] {
            shares.resize(nodes, 0.0);
            for (i, share) in shares.iter_mut().enumerate() {
                if !(0.0..=1.0).contains(share) {
                    found.get_or_insert_with(|| {
                        format!("{name} of node {i} is {share}, expected 0 to 1: set to 0")
                    });
                    *share = 0.0;
                }
            }
        }
        found
    }

    pub(super) fn add_film(&mut self, node: usize, volume: f64) {
        self.film[node] += volume;
        self.counted.0 += volume;
    }

    /// Sets bound water to a share of each node's capacity and the film to `film` (m³) on each node.
    /// Returns the change of volume (m³).
    pub(super) fn soak(
        &mut self,
        share: f32,
        film: f64,
        capacities: impl Iterator<Item = f64>,
    ) -> f64 {
        self.hurries = true;
        self.film.fill(film);
        for ((bound, wetness), capacity) in
            self.bound.iter_mut().zip(&mut self.wetness).zip(capacities)
        {
            *bound = capacity * f64::from(share);
            *wetness = share;
        }
        self.recount()
    }

    /// Replaces the water by film and bound water (m³) of each node, or none. Returns the change of
    /// volume (m³).
    #[cfg(feature = "save")]
    pub(crate) fn replace(
        &mut self,
        film: &[f64],
        bound: &[f64],
        lengths: &[f32],
        wetting: &HairWetting,
        gravity: f32,
    ) -> f64 {
        let counted = core::mem::take(&mut self.counted);
        let held = super::model::clinging(wetting.bundle(1.0), gravity);
        *self = Self {
            film: film.to_vec(),
            bound: bound.to_vec(),
            counted,
            hurries: true,
            ..default()
        };
        for ((film, bound), length) in film.iter().zip(bound).zip(node_lengths(lengths)) {
            let capacity = wetting.capacity() * f64::from(length);
            let wetness = ((bound / capacity) as f32).clamp(0.0, 1.0);
            self.wetness.push(wetness);
            self.sheen.push(sheen(*film, wetness, held));
        }
        self.recount()
    }

    /// After a cut: `within` says what is left of what nodes carry. Returns the loss (m³).
    pub(crate) fn cut(&mut self, within: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
        if self.is_untouched() {
            return 0.0;
        }
        (self.film, self.bound) = (within(&self.film), within(&self.bound));
        // Recomputed in the next exchange.
        self.wetness.resize(self.film.len(), 0.0);
        self.sheen.resize(self.film.len(), 0.0);
        self.hurries = true;
        -self.recount()
    }

    /// Marks its water as counted. Returns the difference to what was counted before (m³).
    pub(super) fn recount(&mut self) -> f64 {
        let volume = self.volume();
        // What an inspector has spoiled counts as before until the next tick has mended it.
        if !volume.is_finite() {
            return 0.0;
        }
        volume - core::mem::replace(&mut self.counted, Counted(volume)).0
    }

    /// How much of its water the ledger has counted (m³).
    pub(super) fn counted(&self) -> f64 {
        self.counted.0
    }

    /// Marks its water as not counted and returns it (m³): a removed component may be inserted elsewhere.
    pub(super) fn take_counted(&mut self) -> f64 {
        core::mem::take(&mut self.counted).0
    }

    /// Whether it changes so fast that every substep counts: there is a film, or bonds have yet to follow.
    pub(super) fn is_busy(&self) -> bool {
        self.hurries || self.has_film()
    }

    /// Notes by how much wetness or bonds have changed, and how far bonds would go in the next second.
    /// Returns whether the sum of the changes has to wake the strand.
    pub(super) fn note_change(&mut self, by: f32, to_come: f32) -> bool {
        self.drift += by;
        self.hurries = to_come > SMALL;
        let wakes = self.drift > SMALL;
        if wakes {
            self.drift = 0.0;
        }
        wakes
    }

    /// Prefetches it.
    pub(super) fn prefetch(&self) {
        prefetch(&self.film);
        prefetch(&self.bound);
        prefetch(&self.wetness);
        prefetch(&self.sheen);
    }

    /// Removes all water and returns its volume (m³).
    pub(super) fn clear(&mut self) -> f64 {
        let rest = self.volume();
        *self = Self::default();
        rest
    }
}

/// Apparent wetness of a node that can hold a film of `held` (m³).
fn sheen(film: f64, wetness: f32, held: f64) -> f32 {
    wetness.max((film / (SHINES_AT * held)).min(1.0) as f32)
}

/// Half the segments on either side of each node (m): the length of strand that it stands for.
pub(crate) fn node_lengths(lengths: &[f32]) -> impl Iterator<Item = f32> + '_ {
    (0..=lengths.len()).map(|i| {
        let before = if i == 0 { 0.0 } else { lengths[i - 1] };
        0.5 * (before + lengths.get(i).copied().unwrap_or(0.0))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_head_of_hair_weighs_and_holds_what_is_measured() {
        // 100,000 fibres of 25 cm: 127 g, 30 % of it water when soaked.
        let w = HairWetting { fibres: 100_000.0, ..default() };
        assert!((w.dry_mass() * 0.25 - 0.126).abs() < 0.002);
        let room_to_soaked = w.capacity() * 0.25 * WATER / f64::from(w.dry_mass() * 0.25);
        assert!((room_to_soaked - 0.214).abs() < 0.002);
        let lock = HairWetting::default();
        assert!((lock.lock_radius() - 1.0e-3).abs() < 2e-5);
    }
}
