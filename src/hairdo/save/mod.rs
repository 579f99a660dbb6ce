//! Hairdos: the present style of a hair, to be saved with the game, applied again, resampled for
//! another groom, blended and undone.
//!
//! A [`Hairdo`] holds everything that makes a style: where the nodes are, which shapes the bonds
//! remember and how many of them are closed, the water, what ties and holds it, where it is cut, the cuticle's wear, its look with
//! bleach and dye, and which preset it was made on. It does not hold the rest of a hair: roots belong to
//! the scalp, settings such as [`HairStiffness`](crate::HairStiffness) to the character, drops of
//! water to the world.
//!
//! [`Hairdo::of`] takes it from a hair, [`Hairdo::apply`] puts it on the same groom,
//! [`Hairdo::apply_resampled`] on another. Systems request both by events: [`CaptureHairdo`] and
//! [`ApplyHairdo`]. [`Hairdo::to_bytes`] and [`Hairdo::from_bytes`] convert it to a file's content:
//! compact, with a checksum, and of a numbered format ([`NEWEST_FORMAT`]); files of older formats
//! stay readable, newer ones are refused with an error. [`Hairdo::blend`] interpolates two hairdos.

mod apply;
mod blend;
mod bytes;
mod cuts;
mod error;
mod events;
mod holds;
mod looks;
mod plugin;
#[cfg(feature = "groom")]
mod regrown;
mod resample;

pub use bytes::NEWEST_FORMAT;
pub use error::HairdoError;
pub use events::{ApplyHairdo, CaptureHairdo, HairdoApplied, HairdoCaptured, HairdoRejected};
pub use plugin::SavePlugin;
#[cfg(feature = "groom")]
pub(crate) use regrown::Regrowth;

use crate::{
    base::setting::Ranged,
    hair::{
        look::{HairDye, HairLook, WornPreset},
        strand::{CutStrand, FollowerCuts, MIN_SEGMENT},
    },
    hairdo::tie::HairTie,
    keratin::bond::{BondKind, Cuticle, JointBonds},
    solver::rod::frame::darboux,
};
use bevy::prelude::*;

/// The style of one [`Hair`](crate::Hair) at one moment: nodes, bonds, water and wear of every
/// strand, in the order of [`Strands`](crate::Strands), with look and dye. Lengths are in the hair's
/// own units (m), water in m³.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_keratin::prelude::*;
///
/// # fn main() -> Result<(), HairdoError> {
/// # let mut app = App::new();
/// # app.add_plugins((MinimalPlugins, HairPlugins::default()));
/// # let world = app.world_mut();
/// # let hair = world.spawn(Hair).id();
/// # let strand = Strand::from_polyline(&[Vec3::ZERO, Vec3::Y * 0.03, Vec3::Y * 0.06]).unwrap();
/// # world.spawn((StrandOf(hair), strand));
/// // into a save game
/// let bytes = Hairdo::of(world, hair)?.to_bytes();
/// // and out of it
/// Hairdo::from_bytes(&bytes)?.apply(world, hair)?;
/// assert_eq!(Hairdo::of(world, hair)?.to_bytes(), bytes);
/// # Ok(()) }
/// ```
///
/// Every hairdo is valid: all numbers are finite and in their ranges, all arrays have matching
/// lengths.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(opaque)]
#[reflect(Default, Clone, Debug, PartialEq)]
pub struct Hairdo {
    strands: Vec<StyledStrand>,
    cuticle: Option<Cuticle>,
    look: Option<HairLook>,
    dye: HairDye,
    preset: Option<WornPreset>,
    ties: Vec<StyledTie>,
    followers: FollowerCuts,
}

/// One strand of a [`Hairdo`].
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(opaque)]
#[reflect(Default, Clone, Debug, PartialEq)]
pub struct StyledStrand {
    positions: Vec<Vec3>,
    orientations: Vec<Quat>,
    rest_lengths: Vec<f32>,
    root_frame: Quat,
    joints: Vec<JointBonds>,
    film: Vec<f64>,
    bound: Vec<f64>,
    hold: Option<Hold>,
    cut: Option<CutStrand>,
}

/// A tie of a hairdo, with its place in the hair's frame.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
struct StyledTie {
    tie: HairTie,
    place: Vec3,
    turn: Quat,
    scale: f32,
}

/// What holds a strand.
#[derive(Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
enum Hold {
    /// A node, by the hairdo's tie of this index, at a place in the tie's frame (m).
    Tied { tie: u32, node: u32, place: Vec3 },
    /// Nodes at places in the hair's frame (m).
    Nodes(Vec<(u32, Vec3)>),
}

/// The maximum water of a node (m³).
const MAX_WATER: f64 = 1.0;

impl Hairdo {
    /// The strands in their order.
    pub fn strands(&self) -> &[StyledStrand] {
        &self.strands
    }

    /// The hair's own wear of the cuticle; `None` where
    /// [`HairDefault<Cuticle>`](crate::HairDefault) held.
    pub fn cuticle(&self) -> Option<Cuticle> {
        self.cuticle
    }

    /// The hair's own look; `None` where [`HairDefault<HairLook>`](crate::HairDefault) held, and in
    /// files of format 1. Hair that such a hairdo is put on keeps its look.
    pub fn look(&self) -> Option<&HairLook> {
        self.look.as_ref()
    }

    /// Bleach and dye; without layers where there was none.
    pub fn dye(&self) -> &HairDye {
        &self.dye
    }

    /// Which preset the hair had grown from, where that is known.
    pub fn preset(&self) -> Option<&WornPreset> {
        self.preset.as_ref()
    }

    /// The same without look and dye: only the style, for hair that is to keep its colour.
    pub fn without_looks(self) -> Self {
        Self { look: None, dye: HairDye::default(), ..self }
    }

    /// The mean length of its strands (m); 0 without strands.
    pub fn length(&self) -> f32 {
        let lengths = self.strands.iter().map(|strand| strand.rest_lengths.iter().sum::<f32>());
        lengths.sum::<f32>() / self.strands.len().max(1) as f32
    }

    /// How many nodes all strands have together.
    pub fn nodes(&self) -> usize {
        self.strands.iter().map(|strand| strand.positions.len()).sum()
    }

    /// All water on and in the hair (m³).
    pub fn water(&self) -> f64 {
        self.strands.iter().map(StyledStrand::water).sum()
    }

    /// The hairdo, if all its numbers are valid.
    fn checked(self) -> Result<Self, HairdoError> {
        self.check_holds()?;
        for (index, strand) in self.strands.iter().enumerate() {
            strand.check(index)?;
        }
        if let Some(Cuticle { damage, softening }) = self.cuticle
            && !(damage.is_finite() && softening.is_finite())
        {
            return Err(HairdoError::Cuticle);
        }
        let looks = self.look.iter().flat_map(Ranged::violations);
        let preset = self.preset.iter().flat_map(Ranged::violations);
        match looks.chain(self.dye.violations()).chain(preset).next() {
            Some(wrong) => Err(wrong.into()),
            None => Ok(self),
        }
    }

    /// Checks that `self` fits a groom whose strands have these node counts.
    fn check_fit(&self, nodes: impl ExactSizeIterator<Item = usize>) -> Result<(), HairdoError> {
        if self.strands.len() != nodes.len() {
            let (found, expected) = (self.strands.len(), nodes.len());
            return Err(HairdoError::Strands { found, expected });
        }
        for (strand, (own, expected)) in self.strands.iter().zip(nodes).enumerate() {
            let found = own.positions.len();
            if found != expected {
                return Err(HairdoError::Nodes { strand, found, expected });
            }
        }
        Ok(())
    }
}

impl StyledStrand {
    /// Node positions (m) in the hair's frame, root first.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Edge orientations, root first; R(q) e3 is the tangent.
    pub fn orientations(&self) -> &[Quat] {
        &self.orientations
    }

    /// Rest lengths of the edges (m), root first.
    pub fn rest_lengths(&self) -> &[f32] {
        &self.rest_lengths
    }

    /// The scalp's frame at the root.
    pub fn root_frame(&self) -> Quat {
        self.root_frame
    }

    /// The bonds of the joints, root first; as many as edges.
    pub fn joints(&self) -> &[JointBonds] {
        &self.joints
    }

    /// The film of water on each node (m³); empty on untouched hair.
    pub fn film(&self) -> &[f64] {
        &self.film
    }

    /// The water bound at each node (m³); empty on untouched hair.
    pub fn bound(&self) -> &[f64] {
        &self.bound
    }

    /// All its water (m³).
    pub fn water(&self) -> f64 {
        self.film.iter().chain(&self.bound).sum()
    }

    /// The present shape of each joint as a Darboux vector.
    fn shape(&self) -> impl Iterator<Item = Vec3> + '_ {
        let before = core::iter::once(&self.root_frame).chain(&self.orientations);
        before.zip(&self.orientations).map(|(&before, &after)| darboux(before, after).xyz())
    }

    /// The shape that the bonds of one kind remember, joint by joint.
    fn remembered(&self, kind: BondKind) -> impl Iterator<Item = Vec3> + '_ {
        self.joints.iter().map(move |joint| joint.shapes[kind as usize])
    }

    fn check(&self, strand: usize) -> Result<(), HairdoError> {
        let found = self.positions.len();
        if found < 2 {
            return Err(HairdoError::TooFewNodes { strand, found });
        }
        let finite =
            |what, all: &mut dyn Iterator<Item = bool>| match all.enumerate().find(|(_, ok)| !ok) {
                None => Ok(()),
                Some((at, _)) => Err(HairdoError::NonFinite { what, strand, at }),
            };
        let turns = || core::iter::once(&self.root_frame).chain(&self.orientations);
        let shapes = || self.joints.iter().flat_map(|joint| joint.shapes);
        finite("position", &mut self.positions.iter().map(|p| p.is_finite()))?;
        finite("orientation", &mut turns().map(|q| q.is_finite()))?;
        finite("shape (four of each joint)", &mut shapes().map(|s| s.is_finite()))?;
        let within = |what, expected, values: &mut dyn Iterator<Item = f64>, low, high| match values
            .enumerate()
            .find(|(_, v)| !(low..=high).contains(v))
        {
            None => Ok(()),
            Some((at, v)) if !v.is_finite() => Err(HairdoError::NonFinite { what, strand, at }),
            Some((at, found)) => Err(HairdoError::OutOfRange { what, strand, at, found, expected }),
        };
        let squares = &mut turns().map(|q| f64::from(q.length_squared()));
        within("squared norm of orientation", "near 1", squares, 0.25, 4.0)?;
        let lengths = &mut self.rest_lengths.iter().map(|l| f64::from(*l));
        let (shortest, longest) = (f64::from(MIN_SEGMENT), f64::from(f32::MAX));
        within("rest length (m)", "1e-6 or more", lengths, shortest, longest)?;
        let rates = &mut self.joints.iter().flat_map(|j| j.rates).map(f64::from);
        within("rate (four of each joint)", "0 to 1", rates, 0.0, 1.0)?;
        let water = &mut self.film.iter().chain(&self.bound).copied();
        within("water (m³; film, then bound) of node", "0 to 1", water, 0.0, MAX_WATER)?;
        self.check_cut(strand)
    }
}
