//! The numbers that differ from frame to frame besides nodes, as the shader reads them.

use super::{
    detail::DrawnShare,
    solids::{DrawnSolid, GROUP, MAX_SOLIDS, bounds},
    volume::{HairVolume, LIGHTS},
};
use bevy::{math::Affine3A, prelude::*};

/// `DrawnFrame` of `strands.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct PackedFrame {
    share: f32,
    fade: f32,
    wider: f32,
    solid_count: u32,
    volume_begin: Vec3,
    volume_side: u32,
    volume_cell: Vec3,
    unused: u32,
    /// Towards which fibres are counted: in the world's frame, for the shader to know them by, and in the
    /// hair's.
    lights: [Vec4; LIGHTS],
    local_lights: [Vec4; LIGHTS],
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
            volume_begin: Vec3::ZERO,
            volume_side: 0,
            volume_cell: Vec3::ONE,
            unused: 0,
            lights: [Vec4::ZERO; LIGHTS],
            local_lights: [Vec4::ZERO; LIGHTS],
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

    /// The grid in which fibres are counted, and the lights in the world's frame.
    pub(super) fn set_volume(
        &mut self,
        volume: HairVolume,
        lights: [Vec4; LIGHTS],
        from_world: &Affine3A,
    ) {
        (self.volume_begin, self.volume_cell) = (volume.begin, volume.cell);
        self.volume_side = volume.side;
        self.lights = lights;
        let to_local = Mat4::from(*from_world);
        self.local_lights = lights.map(|light| to_local * light);
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
#[component(clone_behavior = Ignore)]
pub(super) struct DrawnFrame {
    pub(super) packed: PackedFrame,
    /// Size of a pixel where a camera is nearest, in the hair's frame (m); unknown before the first view.
    pub(super) pixel: Option<f32>,
    pub(super) level: u32,
    pub(super) volume: HairVolume,
}
