//! Hair sags, swings, curls and twists as rods do, at any segment count and step: through an app,
//! against theory that shares nothing with the crate.

mod fast;
mod hard;
mod lab;
mod lying;
mod obstacles;
mod settled;
mod swings;
mod theory;
use crate::trace;
mod twisted;

/// G J / E I of a dry fibre.
const TORSION: f64 = 0.46;
