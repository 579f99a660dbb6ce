//! Why hair cannot be planted.

use super::recipe::MAX_ROOTS;
use crate::{authoring::groom::GroomError, base::setting::InvalidValue};
use bevy::mesh::PrimitiveTopology;

/// Why hair cannot be planted: which value, what was expected and how to fix it.
#[derive(thiserror::Error, Clone, Debug, PartialEq)]
pub enum PlantError {
    /// A setting out of its range.
    #[error(transparent)]
    Setting(InvalidValue),
    /// A mesh of points or lines.
    #[error(
        "the mesh is a {found:?}, expected a TriangleList or TriangleStrip: plant on a surface"
    )]
    NotTriangles {
        /// What it is.
        found: PrimitiveTopology,
    },
    /// A mesh whose data is on the graphics device only.
    #[error(
        "the mesh's data has gone to the render world: give it \
         RenderAssetUsages::MAIN_WORLD as well, or plant before it is drawn"
    )]
    Extracted,
    /// A mesh without usable positions.
    #[error("the mesh has no positions of type Float32x3: insert Mesh::ATTRIBUTE_POSITION")]
    NoPositions,
    /// A mesh with fewer vertices or indices than a triangle needs.
    #[error("the mesh has no triangle, expected one or more: is it loaded yet?")]
    NoTriangles,
    /// An index beyond the vertices.
    #[error("the mesh's index is {found}, expected less than its {vertices} vertices: repair it")]
    Index {
        /// The index.
        found: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A vertex that is not finite.
    #[error("vertex {vertex} of the mesh is not finite: remove it or repair the source")]
    NonFinite {
        /// Its index.
        vertex: u32,
    },
    /// Triangles that are all points or lines.
    #[error(
        "the mesh's area is {found} m², expected more than 0: all its triangles are degenerate"
    )]
    NoArea {
        /// The area (m²).
        found: f32,
    },
    /// A mesh so far from its origin that neighbouring nodes would coincide in single precision.
    #[error(
        "vertex {vertex} of the mesh is {found} m from the origin, expected at most {most} m for \
         segments of this length: move the mesh to its origin, or plant fewer nodes"
    )]
    TooFar {
        /// The vertex' index.
        vertex: u32,
        /// Its distance (m).
        found: f32,
        /// The most that still works (m).
        most: f32,
    },
    /// A curl too tight for the number of nodes.
    #[error(
        "Planting::nodes is {nodes}, expected {expected} or more: the curl turns {turns:.1} times \
         and needs 4 nodes a turn"
    )]
    CoarseCurl {
        /// How many nodes a strand has.
        nodes: u32,
        /// How often it turns.
        turns: f32,
        /// How many nodes it needs.
        expected: u32,
    },
    /// More strands than [`MAX_ROOTS`].
    #[error(
        "the density gives {found:.0} strands, expected at most {MAX_ROOTS}: lower Planting::density \
         or mask the mesh, and fill up with followers"
    )]
    TooMany {
        /// How many it would be.
        found: f64,
    },
    /// A mesh on which not a single strand grows.
    #[error(
        "no strand grows on {area} m² at {density} per m² under these maps: raise \
         Planting::density or check the maps"
    )]
    NoRoots {
        /// The mesh's area (m²).
        area: f32,
        /// Strands per m².
        density: f32,
    },
    /// A map whose number of values does not match its rows and columns.
    #[error("the map has {found} values, expected {width} × {height}: give one for each pixel")]
    MapSize {
        /// How many values there are.
        found: usize,
        /// Pixels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// An image whose pixels cannot be read.
    #[error("the image cannot be read: {reason}; use an uncompressed 2D image in the main world")]
    Image {
        /// Bevy's reason.
        reason: String,
    },
    /// An error of the groom.
    #[error(transparent)]
    Groom(#[from] GroomError),
}

impl From<InvalidValue> for PlantError {
    fn from(value: InvalidValue) -> Self {
        Self::Setting(value)
    }
}
