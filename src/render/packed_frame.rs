//! The numbers that differ from frame to frame besides nodes, as the shader reads them.

use super::{
    detail::DrawnShare,
    solids::{DrawnSolid, GROUP, MAX_SOLIDS, bounds},
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
    /// Balls around groups of solids.
    groups: [Vec4; MAX_SOLIDS / GROUP],
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
            groups: [Vec4::ZERO; MAX_SOLIDS / GROUP],
            solids: [DrawnSolid::default(); MAX_SOLIDS],
        }
    }

    /// What strands are pushed out of, arranged.
    pub(super) fn set_solids(&mut self, solids: &[DrawnSolid]) {
        for (free, solid) in self.solids.iter_mut().zip(solids) {
            *free = *solid;
        }
        for (free, group) in self.groups.iter_mut().zip(solids.chunks(GROUP)) {
            *free = bounds(group);
        }
        self.solid_count = solids.len().min(MAX_SOLIDS) as u32;
    }

    /// The part that is read, from the beginning.
    pub(super) fn bytes(&self) -> &[u8] {
        let unread = (MAX_SOLIDS - self.solid_count as usize) * size_of::<DrawnSolid>();
        let all = bytemuck::bytes_of(self);
        &all[..all.len() - unread]
    }
}

/// A frame that draws all strands, pushed out of these solids, as the shader reads it.
pub fn packed_frame(solids: &[DrawnSolid]) -> Vec<u32> {
    let mut frame = PackedFrame::default();
    frame.set_solids(solids);
    bytemuck::pod_collect_to_vec(&[frame])
}

/// A hair's frame.
#[derive(Component, Clone, Debug, Default)]
pub(super) struct DrawnFrame {
    pub(super) packed: PackedFrame,
    /// Size of a pixel where a camera is nearest, in the hair's frame (m); unknown before the first view.
    pub(super) pixel: Option<f32>,
    pub(super) level: u32,
}
