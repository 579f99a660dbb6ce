//! What points and triangles cannot be baked, and why.

use bevy::prelude::*;

/// Why a [`ConvexHull`](super::super::ConvexHull) cannot be made.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub enum HullError {
    /// A point that is no point.
    #[error("point {point} is not finite: leave it out")]
    NonFinite {
        /// Which.
        point: usize,
    },
    /// Points that enclose nothing.
    #[error(
        "{found} points span no volume, expected at least four that are not in one plane: give the \
         hull a thickness, or use a cuboid"
    )]
    Flat {
        /// How many different ones there are.
        found: usize,
    },
    /// What is as small as dust or as large as a town.
    #[error("the points span {found} m, expected 1e-4 to 5e3: check their unit")]
    Size {
        /// How much.
        found: f32,
    },
}

/// Why a [`DistanceGrid`](super::super::DistanceGrid) cannot be baked.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub enum BakeError {
    /// A mesh of which there is nothing to bake.
    #[error("there is no triangle with an area, expected a surface: give positions and triangles")]
    NoTriangles,
    /// A mesh without what is needed.
    #[error(
        "the mesh has no {what} in the main world, expected a triangle list or strip of three \
         floats a position: load it with RenderAssetUsages::MAIN_WORLD"
    )]
    NoAttribute {
        /// What it lacks.
        what: &'static str,
    },
    /// A vertex that is nowhere.
    #[error("vertex {vertex} is not finite: mend the mesh")]
    NonFinite {
        /// Which.
        vertex: usize,
    },
    /// A triangle with a vertex that is not there.
    #[error("a triangle names vertex {vertex}, expected less than {vertices}: mend the indices")]
    UnknownVertex {
        /// The vertex.
        vertex: usize,
        /// How many there are.
        vertices: usize,
    },
    /// What is as small as dust or as large as a town.
    #[error("the mesh spans {found} m, expected 1e-4 to 5e3: check its unit")]
    Size {
        /// How much.
        found: f32,
    },
    /// A cell size or a thickness that is none.
    #[error("{what} is {found} m, expected more than 0 and less than the mesh's {size} m")]
    Length {
        /// Which.
        what: &'static str,
        /// What it is.
        found: f32,
        /// The longest side of the mesh.
        size: f32,
    },
    /// A grid that would be too large.
    #[error(
        "cells of {cell} m make {found} points, expected at most {most}: take cells of {enough} m, \
         or bake a part of the mesh"
    )]
    TooManyPoints {
        /// The cell size that was asked for.
        cell: f32,
        /// How many points it would take.
        found: u64,
        /// How many there may be.
        most: u64,
        /// Cells that are large enough.
        enough: f32,
    },
    /// A surface with no inside.
    #[error(
        "{edges} edges have a triangle on one side only, expected a closed surface: close it, or \
         bake it with Openings::Fill where holes are small, with Openings::Shell where it is a sheet"
    )]
    Open {
        /// How many.
        edges: usize,
    },
    /// What falls through the grid.
    #[error(
        "no point of the grid is inside of the surface, expected it to be thicker than a cell of \
         {cell} m: take smaller cells, or bake it with Openings::Shell"
    )]
    Thin {
        /// The cell size.
        cell: f32,
    },
}
