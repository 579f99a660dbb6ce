//! What is drawn, and in which colour.

use bevy::prelude::*;

/// What [`HairDebugPlugin`](super::HairDebugPlugin) draws, and in which colour; `None` is not drawn. A group of Bevy's
/// `GizmoConfigStore`, which also has its line width, depth bias and whether it is enabled.
#[derive(Reflect, GizmoConfigGroup, Clone, Debug)]
#[reflect(Default, Clone)]
pub struct HairGizmos {
    /// Strands that the CPU simulates. Default green.
    pub simulated: Option<Color>,
    /// Strands that sleep. Default grey.
    pub asleep: Option<Color>,
    /// Strands that follow simulated ones. Default blue.
    pub followers: Option<Color>,
    /// Strands of hair whose level of detail simulates none. Default white.
    pub frozen: Option<Color>,
    /// Strands of hair on the GPU, where they were when last read back. Default violet.
    pub gpu: Option<Color>,
    /// Strands of hair that settles, which is hidden otherwise. Default yellow.
    pub settling: Option<Color>,
    /// From the root of a follower to the roots of its guides. Default pale blue.
    pub guides: Option<Color>,
    /// Nodes and edges of strands that touch each other, each pair as a line. Default red.
    pub contacts: Option<Color>,
    /// [`HairCollider`](crate::HairCollider)s: distance grids and hulls by three sections, planes by a square. Default orange.
    pub colliders: Option<Color>,
    /// [`WindZone`](crate::WindZone)s, where they are full and, fainter, where they end, with their velocity. Default
    /// cyan.
    pub wind_zones: Option<Color>,
    /// [`Blower`](crate::Blower)s and the way they blow. Default cyan.
    pub blowers: Option<Color>,
    /// [`PermRod`](crate::PermRod)s. Default pink.
    pub perm_rods: Option<Color>,
    /// [`WaterVolume`](crate::WaterVolume)s. Default blue.
    pub water_volumes: Option<Color>,
}

impl Default for HairGizmos {
    fn default() -> Self {
        let rgb = |r, g, b| Some(Color::srgb(r, g, b));
        Self {
            simulated: rgb(0.2, 0.9, 0.3),
            asleep: rgb(0.5, 0.5, 0.5),
            followers: rgb(0.2, 0.5, 1.0),
            frozen: rgb(1.0, 1.0, 1.0),
            gpu: rgb(0.7, 0.3, 1.0),
            settling: rgb(1.0, 0.9, 0.2),
            guides: rgb(0.6, 0.8, 1.0),
            contacts: rgb(1.0, 0.1, 0.1),
            colliders: rgb(1.0, 0.5, 0.1),
            wind_zones: rgb(0.3, 0.9, 0.9),
            blowers: rgb(0.3, 0.9, 0.9),
            perm_rods: rgb(1.0, 0.5, 0.7),
            water_volumes: rgb(0.2, 0.4, 1.0),
        }
    }
}
