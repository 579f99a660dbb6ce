//! Errors of baking points and triangles.

use bevy::prelude::*;

/// Why a [`ConvexHull`](super::super::ConvexHull) cannot be made.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub enum HullError {
    /// A point that is not finite.
    #[error("point {point} is not finite: leave it out")]
    NonFinite {
        /// Which.
        point: usize,
    },
    /// Points that enclose no volume.
    #[error(
        "{found} points span no volume, expected at least four that are not in one plane: give the \
         hull a thickness, or use a cuboid"
    )]
    Flat {
        /// How many distinct points there are.
        found: usize,
    },
    /// Points whose extent is out of range.
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
    /// A mesh without any triangle that has an area.
    #[error("there is no triangle with an area, expected a surface: give positions and triangles")]
    NoTriangles,
    /// A mesh without a needed attribute.
    #[error(
        "the mesh has no {what} in the main world, expected a triangle list or strip of three \
         floats a position: load it with RenderAssetUsages::MAIN_WORLD"
    )]
    NoAttribute {
        /// Which.
        what: &'static str,
    },
    /// A vertex that is not finite.
    #[error("vertex {vertex} is not finite: repair the mesh")]
    NonFinite {
        /// Which.
        vertex: usize,
    },
    /// A triangle that refers to a vertex that does not exist.
    #[error("a triangle names vertex {vertex}, expected less than {vertices}: repair the indices")]
    UnknownVertex {
        /// The vertex.
        vertex: usize,
        /// How many there are.
        vertices: usize,
    },
    /// A mesh whose extent is out of range.
    #[error("the mesh spans {found} m, expected 1e-4 to 5e3: check its unit")]
    Size {
        /// How much.
        found: f32,
    },
    /// A cell size or a thickness that is out of range.
    #[error("{what} is {found} m, expected more than 0 and less than the mesh's {size} m")]
    Length {
        /// Which.
        what: &'static str,
        /// Its value.
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
        /// The requested cell size.
        cell: f32,
        /// How many points it would take.
        found: u64,
        /// How many are allowed.
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
    /// A surface thinner than the grid resolves.
    #[error(
        "no point of the grid is inside the surface, expected it to be thicker than a cell of \
         {cell} m: take smaller cells, or bake it with Openings::Shell"
    )]
    Thin {
        /// The cell size.
        cell: f32,
    },
}
