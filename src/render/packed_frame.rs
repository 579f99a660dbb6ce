//! The numbers that differ from frame to frame besides nodes, as the shader reads them.

use super::{
    detail::DrawnShare,
    solids::{DrawnSolid, MAX_SOLIDS},
};
use bevy::prelude::*;

/// `DrawnFrame` of `strands.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct PackedFrame {
    share: f32,
    fade: f32,
    wider: f32,
    solid_count: u32,
    solids: [DrawnSolid; MAX_SOLIDS],
}

impl Default for PackedFrame {
    fn default() -> Self {
        Self::new(DrawnShare::ALL)
    }
}

impl PackedFrame {
    pub(super) fn new(drawn: DrawnShare) -> Self {
        Self {
            share: drawn.share,
            fade: drawn.fade,
            wider: drawn.wider(),
            solid_count: 0,
            solids: [DrawnSolid::default(); MAX_SOLIDS],
        }
    }

    pub(super) fn push(&mut self, solid: DrawnSolid) {
        if let Some(free) = self.solids.get_mut(self.solid_count as usize) {
            *free = solid;
            self.solid_count += 1;
        }
    }
}

/// A hair's frame.
#[derive(Component, Clone, Debug, Default)]
pub(super) struct DrawnFrame {
    pub(super) packed: PackedFrame,
    /// Size of a pixel where a camera is nearest, in the hair's frame (m); unknown before the first view.
    pub(super) pixel: Option<f32>,
    pub(super) level: u32,
}
