//! Stiffness as a property of the hair, and the solver's weights that follow from it.
//!
//! The paper gives no weights, yet they decide everything under gravity. Small-deflection theory of
//! the projection gives the gravity-bending length L_g = (EI/(μ g))^{1/3}, with μ mass per length:
//! L_g³ = k l⁴ / (8 χ (1−k) Δt² g), χ = w_q l². Solved for χ at the paper's step and k_o it makes
//! the look independent of segment count, and k/(1−k) ∝ Δt² makes it independent of substeps.

use super::constraint::StretchProjection;
use crate::base::{
    lanes::Real,
    setting::{InvalidValue, Ranged, ValueRange, setting},
};
use bevy::prelude::*;

/// The paper's step Δt₀ (s), at which [`Sweeps::bend`] is what the paper calls k_o.
pub const REFERENCE_DT: f32 = 1.0 / 360.0;

/// The gravity (m/s²) in the definition of the gravity-bending length, as in the paper's table 1.
pub const REFERENCE_GRAVITY: f32 = 9.8;

setting! {
    /// How strongly the hair resists bending. Component of a [`Hair`](crate::Hair); where absent,
    /// [`HairDefault<HairStiffness>`](crate::HairDefault) holds.
    ///
    /// Strands much shorter than `bending_length` stand, much longer ones hang.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairStiffness {
        /// Gravity-bending length L_g, in the Hair's own length unit. A real dry hair of 70 µm has
        /// 0.045; the paper's look needs 0.12…0.2.
        pub bending_length: f32 = 0.13, "m" in BENDING_LENGTH: 1e-3..=100.0, safe 0.02..=1.0,
            "0.13 is soft hair, 0.045 a bare fibre";
        /// Internal friction as a Kelvin–Voigt time c: the moment of a joint is K (κ + c dκ/dt), so a
        /// swing of angular frequency ω decays by c ω/2 of critical, at any segment count and step.
        /// The step itself damps like 0.3 of its length, which is subtracted: smaller values have
        /// no further effect.
        ///
        /// We know of no measurement of it for locks. 0.01 dissipates as much in a swing of 2.5 Hz
        /// as a loss tangent of 0.16 would, and lets touching locks come to rest.
        pub damping: f32 = 0.01, "s" in DAMPING: 0.0..=10.0, safe 0.0..=0.02,
            "0.01 swings for a second, 0.03 is syrup";
        /// How strongly hair resists twist, over how strongly it resists bending: G J/(E I), which of a round fibre
        /// is 2 G/E. The less, the sooner a curl hangs as a ringlet rather than as a flat hook.
        ///
        /// Dry human hair has 0.46: E 3.9 GPa, G 0.9 GPa. In water G falls to about a fifth and E to 0.45, so soaked
        /// hair has 0.44 of what is set here. At the papers' 1 twist is resisted as much as bending, wet as dry;
        /// [`SolverMethod::Sweeps`] has that whatever is set here.
        pub torsion: f32 = 0.46, in TORSION: 0.05..=1.0, safe 0.15..=1.0,
            "0.46 is dry hair, 1 the papers'";
    }
}

setting! {
    /// How stiff, and how damped, a strand is beside others of its hair. Component of a [`Strand`](crate::Strand); strands
    /// without one are as [`HairStiffness`] says. Hair grown from a groom with
    /// [stiffness](crate::Groom::with_stiffness) or [damping](crate::Groom::with_damping) has it.
    ///
    /// A gravity-bending length grows with the cube root of the stiffness: a strand of 8 has twice that of its hair, and
    /// level it sags an eighth as far as long as it hardly bends. Strands of springs have it without effect, and by
    /// [`SolverMethod::Sweeps`] only the stiffness counts. Its hair is simulated on the CPU.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// fn fine_hair_at_the_temple(mut commands: Commands, strands: Query<(Entity, &Strand)>) {
    ///     for (id, strand) in strands.iter().filter(|(_, strand)| strand.positions()[0].x.abs() > 0.07) {
    ///         commands.entity(id).insert(StrandMaterial { stiffness: 0.3, ..default() });
    ///     }
    /// }
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct StrandMaterial {
        /// Its bending and twisting stiffness, E I and G J, as a share of its hair's.
        pub stiffness: f32 = 1.0, in STIFFNESS: 0.01..=100.0, safe 0.1..=10.0,
            "1 is as stiff as its hair";
        /// Its [`HairStiffness::damping`], as a share of its hair's. Less than the step damps by itself, see there, has no
        /// further effect.
        pub damping: f32 = 1.0, in DAMPING: 0.0..=100.0, safe 0.0..=10.0,
            "1 swings as long as its hair";
    }
}

/// The share of [`HairStiffness::torsion`] that a joint lacks which water has softened by so much: in soaked hair, softened
/// by 0.33, 0.56. G falls to 0.2 where E falls to 0.45.
pub(crate) fn wet_twist_loss(softening: f32) -> f32 {
    (1.7 * softening).min(0.8)
}

impl HairStiffness {
    /// Stiffness from the gravity-bending length (m).
    ///
    /// # Errors
    /// When it is outside [`BENDING_LENGTH`](Self::BENDING_LENGTH).
    pub fn from_bending_length(metres: f32) -> Result<Self, InvalidValue> {
        Self { bending_length: metres, ..default() }.checked()
    }

    /// Stiffness of a bare round fibre: Young's modulus (Pa), diameter (m), density (kg/m³).
    /// EI/μ = E d²/(16 ρ). Dry hair: 3.9e9, 70e-6, 1310.
    ///
    /// # Errors
    /// When a value is not positive, or the fibre's L_g is outside
    /// [`BENDING_LENGTH`](Self::BENDING_LENGTH).
    pub fn from_fibre(young: f32, diameter: f32, density: f32) -> Result<Self, InvalidValue> {
        const YOUNG: ValueRange =
            ValueRange::new("Young's modulus (Pa)", 1.0..=1e12, "dry hair has 3.9e9");
        const DIAMETER: ValueRange =
            ValueRange::new("fibre diameter (m)", 1e-7..=1e-2, "hair has 50e-6 to 100e-6");
        const DENSITY: ValueRange =
            ValueRange::new("fibre density (kg/m³)", 1.0..=1e5, "hair has 1310");
        YOUNG.check(young)?;
        DIAMETER.check(diameter)?;
        DENSITY.check(density)?;
        let ei_over_mu = young * diameter * diameter / (16.0 * density);
        Self::from_bending_length(bevy::math::ops::cbrt(ei_over_mu / REFERENCE_GRAVITY))
    }
}

/// Which method solves the rods.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub enum SolverMethod {
    /// One direct implicit step of a whole strand per substep ([`direct`](super::direct)): stiffness,
    /// periods, decay and sag are the hair's own at any segment count and step.
    #[default]
    Direct,
    /// The paper's Gauss–Seidel projections, as [`Sweeps`] say: to compare with \[B\]. Stiff or finely
    /// divided hair swings too slowly and sags too far.
    Sweeps,
}

setting! {
    /// How the rods are solved. Component of a [`Hair`](crate::Hair); where absent,
    /// [`HairDefault<HairSolver>`](crate::HairDefault) holds.
    ///
    /// Shorter substeps are more accurate: [`HairSubsteps`](crate::HairSubsteps) divides the tick
    /// for all hair, water and contact included, and `substep` here merges some of them for hair
    /// that needs fewer. The shape of settled hair does not depend on either; fast motion and the
    /// lengths of long, finely divided hair do.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairSolver {
        /// Which method is used.
        pub method: SolverMethod = SolverMethod::Direct;
        /// Newton steps of the length limiter of the direct method, at most: it stops where lengths
        /// are right within 0.05 %. 0 turns it off.
        pub limiter_steps: u32 = 6, in LIMITER_STEPS: 0.0..=16.0, safe 1.0..=8.0,
            "6 hold any hair";
        /// The longest substep of the direct method: as many of the tick's substeps are taken as one as
        /// fit into it, everything that moves the hair included. Dry hair settles to the same shape and
        /// swings with the same period from the default to the paper's 1/360 s, for half the time. Hair
        /// that carries water, hair of springs and [`SolverMethod::Sweeps`] take every substep.
        pub substep: f32 = 1.0 / 180.0, "s" in SUBSTEP: 1e-6..=1.0, safe 1e-3..=0.01,
            "1/180 is three of a tick at 60 Hz";
    }
}

setting! {
    /// The paper's projections, where [`SolverMethod::Sweeps`] is chosen. Component of a
    /// [`Hair`](crate::Hair); where absent, [`HairDefault<Sweeps>`](crate::HairDefault) holds.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct Sweeps {
        /// Gauss–Seidel iterations a substep, as in \[B\] table 1.
        pub iterations: u32 = 5, in ITERATIONS: 1.0..=1000.0, safe 1.0..=50.0, "5 is the paper's";
        /// How stretch–shear is projected.
        pub projection: StretchProjection = StretchProjection::Split;
        /// k_o of equation 13: the share of a bend that one substep of 1/360 s corrects, as in
        /// \[B\] table 1. A parameter of the solver, which also affects how fast hair swings.
        pub bend: f32 = 0.05, in BEND: 0.0..=1.0, safe 0.005..=0.1, "the paper uses 0.05";
        /// χ = w_q l² at the paper's step, set directly as a reader of the paper might; replaces what
        /// [`HairStiffness::bending_length`] gives.
        pub orientation_weight: Option<f32> = None, in ORIENTATION_WEIGHT: 1e-9..=1e3,
            "0.03 is 13 cm at 3 cm edges";
        /// Newton steps of the direct length limiter after the iterations. 0 turns it off; 1 leaves
        /// about ten times the strain.
        pub limiter_steps: u32 = 2, in LIMITER_STEPS: 0.0..=16.0, safe 0.0..=4.0,
            "2 hold long hair";
        /// Damping of neighbouring edges' relative rotation: damps bending vibration, not falling
        /// and swinging.
        pub internal_damping: f32 = 0.0, "1/s" in INTERNAL_DAMPING: 0.0..=1e4, safe 0.0..=100.0,
            "0 is off, 20 is syrup";
    }
}

impl Sweeps {
    /// Inverse rotational mass w_q (1/m²) of an edge of length `l` on a strand whose edges average
    /// `mean`. With equal edges it is χ/l²; otherwise it keeps EI the same in every joint.
    #[inline(always)]
    #[doc(hidden)]
    pub fn rotational_weight<R: Real>(&self, bending_length: f32, l: R, mean: R) -> R {
        match self.orientation_weight {
            Some(chi) => l.lit(chi.into()) / (l * mean),
            None => l.lit(self.spin_weight(bending_length).into()) * mean * l,
        }
    }

    /// What makes w_q of lengths, by the gravity-bending length (m): k/(8 (1−k) L_g³ Δt₀² g).
    #[inline(always)]
    pub(crate) fn spin_weight(&self, bending_length: f32) -> f32 {
        let lg3 = bending_length * bending_length * bending_length;
        let stiff = self.bend.clamp(1e-6, 0.999_999);
        stiff / (8.0 * (1.0 - stiff) * lg3 * REFERENCE_DT * REFERENCE_DT * REFERENCE_GRAVITY)
    }

    /// k of one substep of `dt` (s), from K = k/(1−k) ∝ Δt², times a `factor` on the true
    /// stiffness: cuticle (equation 13), wetness, material.
    #[doc(hidden)]
    pub fn per_substep(&self, dt: f32, factor: f32) -> f32 {
        let ratio = self.ratio(dt) * factor;
        ratio / (1.0 + ratio)
    }

    /// K = k/(1−k) of one substep of `dt` (s).
    pub(crate) fn ratio(&self, dt: f32) -> f32 {
        let k = self.bend.min(0.999_999);
        let longer = dt / REFERENCE_DT;
        k / (1.0 - k) * longer * longer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stiffness_scales_with_the_square_of_the_substep() {
        let s = Sweeps::default();
        let big = |k: f32| k / (1.0 - k);
        let (a, b) = (s.per_substep(REFERENCE_DT, 1.0), s.per_substep(REFERENCE_DT * 2.0, 1.0));
        assert!((a - 0.05).abs() < 1e-6);
        assert!((big(b) / big(a) - 4.0).abs() < 1e-4);
    }

    #[test]
    fn a_real_fibre_bends_over_four_and_a_half_centimetres() {
        let s = HairStiffness::from_fibre(3.9e9, 70e-6, 1310.0).unwrap();
        assert!((s.bending_length - 0.0453).abs() < 1e-4);
        assert!(HairStiffness::from_fibre(-1.0, 70e-6, 1310.0).is_err());
    }
}
