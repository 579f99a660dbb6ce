//! Where hair is simulated, where it is asked to be, and why it is elsewhere.

use crate::base::setting::{Ranged, setting};
use bevy::prelude::*;
use core::fmt;

/// Where a hair is asked to be simulated. Component of a [`Hair`](crate::Hair); where absent,
/// [`HairDefault<SimulateOn>`](crate::HairDefault) holds. [`HairResidence`] says where it is.
///
/// Hair is on the GPU only while all that acts on it is supported there, and comes back by
/// itself where something else does. There it sleeps ([`SleepSettings`](crate::SleepSettings)) as a whole, once all its
/// strands would.
///
/// Where game code writes to strands on the GPU, the hair comes back with what was written. That is noticed in
/// the next tick, of more than 16,384 strands on the GPU after as many ticks as there are times that number.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn crowd(mut commands: Commands) {
///     let free = StrandContact { strength: 0.0, ..default() };
///     commands.spawn((Hair, SimulateOn::Gpu, free));
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub enum SimulateOn {
    /// On the CPU.
    #[default]
    Cpu,
    /// By compute shaders on the GPU, as far as that can.
    Gpu,
}

impl Ranged for SimulateOn {}

/// Where a [`Hair`](crate::Hair) is simulated, and why. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[component(clone_behavior = Ignore)]
#[reflect(Component, Default, Clone, PartialEq)]
pub enum HairResidence {
    /// On the GPU.
    Gpu,
    /// On its way back, at rest on its head for some frames.
    Returning(WhyCpu),
    /// On the CPU.
    Cpu(WhyCpu),
}

impl Default for HairResidence {
    fn default() -> Self {
        Self::Cpu(WhyCpu::NotAsked)
    }
}

/// Why hair is simulated on the CPU.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Clone, PartialEq)]
#[non_exhaustive]
pub enum WhyCpu {
    /// [`SimulateOn::Cpu`], the default, asks for it.
    NotAsked,
    /// The app has no GPU, or no assets for its shaders.
    NoRenderer,
    /// The device has no compute shaders with eight storage buffers.
    NoCompute,
    /// The device is software on the processor, such as Mesa's, slower than the tick itself; see
    /// [`HairGpu::software`].
    Software,
    /// The kernels are being compiled.
    Compiling,
    /// The kernels cannot be compiled; the log says why.
    Broken,
    /// The GPU was lost. It goes there again when there is another.
    DeviceLost,
    /// The device cannot hold that many strands in one buffer.
    TooLarge,
    /// It has just come back, and stays for a second.
    JustBack,
    /// Something acts on it that is not supported there.
    Unsupported(Unsupported),
}

/// What keeps hair on the CPU.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Clone, PartialEq)]
#[non_exhaustive]
pub enum Unsupported {
    /// Strands push each other ([`StrandContact`](crate::StrandContact)); with a radius or strength of 0 they do not.
    StrandContact,
    /// Water on the hair, droplets, showers or volumes of water anywhere.
    Water,
    /// Hair made of [`Springs`](crate::Springs).
    Springs,
    /// Gusts of wind, or a [`WindZone`](crate::WindZone).
    UnsteadyWind,
    /// More than four blowers.
    Blowers,
    /// More than 128 colliders near.
    Colliders,
    /// A collider near that is no ball, ellipsoid, capsule, cylinder or half-space.
    ColliderShape,
    /// Held nodes ([`HeldNodes`](crate::HeldNodes)) that are roots, have frames, or have to give way.
    HeldNodes,
    /// Strands of which winding on a [`PermRod`](crate::PermRod), or gathering to a [`HairTie`](crate::HairTie),
    /// begins.
    Winding,
    /// Roots that are being tied to a mesh.
    MovingRoots,
    /// A level of detail at which no strand is simulated, or a change of which strands are. A level that a
    /// [`HairBudget`](crate::HairBudget) gives it does not keep it here: it goes at that of its size on the screen.
    LevelOfDetail,
    /// It is still [`Settling`](crate::Settling).
    Settling,
    /// It is recorded (`RecordGroomCache`), or plays what was (`PlayGroomCache`).
    GroomCache,
    /// Its [`HairStyle`](crate::HairStyle) is watched.
    WatchedStyle,
    /// Strands that are stiffer, softer or damped otherwise than others ([`StrandMaterial`](crate::StrandMaterial)).
    StrandMaterial,
    /// Its strands count the wind that they receive ([`WindReceived`](crate::WindReceived)).
    WindReceived,
    /// A treatment of single strands, or of more than eight ranges of joints.
    Treatments,
    /// It has no strands, or strands that cannot be simulated.
    Strands,
    /// Strands have come or gone.
    Regroomed,
    /// Its [`HairSolver::method`](crate::HairSolver::method) has changed. It goes there again in the next tick.
    OtherSolver,
    /// The game wrote to a strand or its bonds.
    Written,
    /// A request that needs its strands on the CPU.
    Requested,
}

impl fmt::Display for WhyCpu {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotAsked => "SimulateOn::Gpu is not set",
            Self::NoRenderer => "the app has no GPU",
            Self::NoCompute => "the GPU lacks compute shaders with 8 storage buffers",
            Self::Software => "the GPU is software; HairGpu { software: true } takes it",
            Self::Compiling => "its kernels are being compiled",
            Self::Broken => "its kernels cannot be compiled on this device",
            Self::DeviceLost => "the GPU was lost",
            Self::TooLarge => "it is too large for one buffer of the GPU",
            Self::JustBack => "it has just come back",
            Self::Unsupported(what) => return what.fmt(f),
        })
    }
}

impl fmt::Display for Unsupported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StrandContact => "contact between strands is not supported there",
            Self::Water => "water is not supported there",
            Self::Springs => "springs are not supported there",
            Self::UnsteadyWind => "gusts and wind zones are not supported there",
            Self::Blowers => "more than four blowers are not supported there",
            Self::Colliders => "more than 128 colliders are not supported there",
            Self::ColliderShape => {
                "colliders other than balls, ellipsoids, capsules, cylinders and half-spaces are not supported there"
            }
            Self::HeldNodes => {
                "held roots, held nodes with frames and those that have to give way are not supported there"
            }
            Self::Winding => "its strands begin to be wound on a rod or gathered to a tie",
            Self::MovingRoots => "its roots are being tied to a mesh",
            Self::LevelOfDetail => "at its level of detail other strands are simulated, or none",
            Self::Settling => "it is still settling",
            Self::GroomCache => "it is recorded, or plays a groom cache",
            Self::WatchedStyle => "its style is watched",
            Self::StrandMaterial => "strands of their own stiffness or damping are not supported there",
            Self::WindReceived => "the wind that it receives is counted",
            Self::Treatments => "treatments of single strands are not supported there",
            Self::Strands => "it has no strands that can be simulated",
            Self::Regroomed => "strands have come or gone",
            Self::OtherSolver => "another method solves it from now on",
            Self::Written => "the game wrote to its strands",
            Self::Requested => "its strands were asked for",
        })
    }
}

setting! {
    /// How the GPU is used for hair.
    #[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Resource, Default, Clone, PartialEq)]
    pub struct HairGpu {
        /// Whether a software device counts. It is slower than the CPU by itself; tests want it. Mesa's ends all
        /// loops of eight strands after 65,535 passes together: a substep of long strands that begin deep in
        /// colliders is not finished there, which no graphics card does to them.
        pub software: bool = false;
        /// Whether the tick waits for hair that comes back, where it otherwise rests on its head for some
        /// frames. For tests and loading screens.
        pub blocking: bool = false;
        /// Ticks of a hair that a frame runs at most; more wait for the next frames, in their order, so that a
        /// pause of the game does not make the next one. After a pause Bevy's clock owes 15. Hair that is asked
        /// for, or more than 60 ticks late, is run up to the present at once. The result is the same.
        pub ticks_a_frame: u32 = 8, in TICKS: 1.0..=1000.0, "8 catches up in two frames";
        /// How often the state of hair is kept for the case that the device is lost; 0 never, then such
        /// hair goes on from where it was handed over. A copy takes 128 bytes a node over the bus, by the
        /// paper's projections 144.
        pub checkpoint: f32 = 1.0, "s" in CHECKPOINT: 0.0..=1e6, "1 loses a second";
    }
}
