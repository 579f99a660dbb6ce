//! How many rings a hair has room for on the device: the places between the straight segments of its strands.

use super::{kernel::has_compute, ribbon_mesh::RibbonLevel};
use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    render::renderer::{RenderAdapter, RenderDevice},
};
use core::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

/// Bytes of `PackedRing` of `rings.wgsl`.
const RING: u64 = 32;

/// The rings of a hair that there is room for, rank by rank of its strands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rings {
    /// How many strands have any; 0 where each vertex computes its own.
    pub(super) ranks: u32,
    /// Of how many rings one is there.
    pub(super) every: u32,
    /// How many of a strand are there.
    of_strand: u32,
}

impl Default for Rings {
    fn default() -> Self {
        Self { ranks: 0, every: 1, of_strand: 0 }
    }
}

impl Rings {
    pub(super) fn count(self) -> u64 {
        u64::from(self.ranks) * u64::from(self.of_strand)
    }

    /// Straight segments of a strand.
    pub(super) fn segments(self) -> u32 {
        self.of_strand.saturating_sub(1)
    }

    /// Size of their buffer (bytes), if there is any.
    pub(super) fn size(self) -> Option<usize> {
        (self.ranks > 0).then_some((RING * self.count()) as usize)
    }
}

/// Tells whether the device can compute rings and hold them.
#[derive(SystemParam)]
pub(super) struct RoomForRings<'w> {
    adapter: Option<Res<'w, RenderAdapter>>,
    device: Option<Res<'w, RenderDevice>>,
    broken: Option<Res<'w, Broken>>,
}

impl RoomForRings<'_> {
    /// The rings of the strands of a level; none if they are too many.
    pub(super) fn of(&self, level: RibbonLevel) -> Rings {
        let rings = Rings { ranks: level.ranks(), every: level.every(), of_strand: level.rings() };
        let size = RING * rings.count();
        let fits = self.device.as_ref().is_some_and(|device| {
            let limits = device.limits();
            size <= limits.max_storage_buffer_binding_size && size <= limits.max_buffer_size
        });
        let can = self.adapter.as_deref().is_some_and(has_compute);
        let is_broken = self.broken.as_ref().is_some_and(|broken| broken.0.load(Ordering::Relaxed));
        if can && fits && !is_broken { rings } else { Rings::default() }
    }
}

/// Whether the kernel cannot be compiled, as both worlds know.
#[derive(Resource, Clone, Default)]
pub(super) struct Broken(pub(super) Arc<AtomicBool>);
