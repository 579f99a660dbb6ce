//! Who moves a hair, and who moves a strand: the one answer for all rooms.

use bevy::prelude::*;

/// Who moves a [`Hair`](crate::Hair) now. Component of a hair, kept by the tick: written once a tick, after sleep has been
/// decided, and at once where a hair begins to settle or changes between processor and GPU.
///
/// | owner | its strands are moved | begins | ends | what acts on it |
/// |---|---|---|---|---|
/// | [`Simulated`](Self::Simulated) | by the tick, here | by default | | everything |
/// | [`Settling`](Self::Settling) | by the tick, and by more ticks ahead ([`SettleTick`](crate::SettleTick)) | [`Settling`] is inserted | it is at rest, and [`Settling`] is removed | everything in the tick; ahead of it no bonds, water and treatments. It is not drawn, and at each level of detail all its strands are simulated |
/// | [`Frozen`](Self::Frozen) | not at all: they keep their shape on the head | a level without simulated strands ([`LodLevel::strands`](crate::LodLevel::strands)) | another level | bonds, water and treatments |
/// | [`Played`](Self::Played) | by a recorded or animated groom (`PlayGroomCache`, feature `groom`) | it is loaded | the component is removed | water, drying and treatments; not settling, and lakes only once it ends |
/// | [`Asleep`](Self::Asleep) | not at all: all its strands sleep ([`SleepSettings`](crate::SleepSettings)) | the last of them falls asleep | one wakes | what wakes it; treatments and water |
/// | [`Gpu`](Self::Gpu) | by compute shaders | it is handed over | it has come back | what a shader knows of; no system here touches its strands |
/// | [`AsleepOnGpu`](Self::AsleepOnGpu) | not at all, on the GPU | the GPU reports that all are still | something disturbs it | what wakes it |
///
/// Single strands of hair that is simulated or settles may sleep, or follow guides: see [`StrandSleep`](crate::StrandSleep).
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[component(clone_behavior = Ignore)]
#[reflect(Component, Default, Clone, PartialEq)]
pub enum MotionOwner {
    /// The tick, on the processor.
    #[default]
    Simulated,
    /// The tick, and ticks ahead of it.
    Settling,
    /// Nobody: its level of detail simulates no strand.
    Frozen,
    /// A cache of a groom's motion.
    Played,
    /// Nobody: all its strands sleep.
    Asleep,
    /// Compute shaders.
    Gpu,
    /// Nobody, on the GPU: all its strands sleep.
    AsleepOnGpu,
}

impl MotionOwner {
    /// Whether its strands change their shape or place in this tick.
    pub fn moves(self) -> bool {
        matches!(self, Self::Simulated | Self::Settling | Self::Played | Self::Gpu)
    }

    /// Whether all its strands sleep.
    pub fn sleeps(self) -> bool {
        matches!(self, Self::Asleep | Self::AsleepOnGpu)
    }

    /// Whether its present state is on the GPU.
    pub fn is_on_gpu(self) -> bool {
        matches!(self, Self::Gpu | Self::AsleepOnGpu)
    }
}

/// Makes a [`Hair`](crate::Hair) settle before it is first drawn, as [`SettleSettings`](crate::SettleSettings) says; removed by
/// the tick once it has. Presets' settings include it; insert it on hair made by hand. Hair that `WearHair` puts on has
/// settled by then.
///
/// While the game's time stands still or goes slowly it settles on another thread, without ticks.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn grow(mut commands: Commands) {
///     let hair = commands.spawn((Hair, Settling::default())).id();
///     let level = Strand::from_polyline(&[Vec3::ZERO, Vec3::X * 0.05, Vec3::X * 0.1]).unwrap();
///     commands.spawn((StrandOf(hair), level));
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct Settling {
    /// How many ticks it has been simulated ahead.
    pub done: u32,
    /// For how long it has been still (s).
    pub still: f32,
}

/// Marks a hair that something else moves in place of the tick, strand by strand: it is left alone, but for levels of detail.
#[derive(Component, Clone, Copy, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[cfg_attr(not(feature = "groom"), allow(dead_code))]
pub(crate) struct PlayedHair;

/// Marks a hair whose strands something reads in each tick: it stays here.
#[derive(Component, Clone, Copy, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[cfg_attr(not(feature = "groom"), allow(dead_code))]
pub(crate) struct RecordedHair;
