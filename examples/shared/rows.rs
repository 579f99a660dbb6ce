//! Measurements against what is expected, one row each.

use serde::Serialize;

/// A figure that is measured, and what it should be.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub test: String,
    pub expected: f64,
    pub got: f64,
    /// How far `got` may be from `expected`.
    pub tolerance: f64,
    pub within: bool,
    /// Γ, or the load over the stiffness, of a strand that is held against theory.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gamma: Option<f64>,
    /// How many segments it has.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub segments: Option<usize>,
}

impl Row {
    pub fn new(test: impl Into<String>, expected: f32, got: f32, tolerance: f32) -> Self {
        let [expected, got, tolerance] = [expected, got, tolerance].map(f64::from);
        let within = (got - expected).abs() <= tolerance;
        Self { test: test.into(), expected, got, tolerance, within, gamma: None, segments: None }
    }

    /// The same, of a strand.
    #[allow(dead_code, reason = "not every target holds strands against theory")]
    pub fn of(self, gamma: f32, segments: usize) -> Self {
        Self { gamma: Some(gamma.into()), segments: Some(segments), ..self }
    }

    /// Nothing above a limit.
    pub fn at_most(test: impl Into<String>, got: f32, limit: f32) -> Self {
        Self::new(test, 0.0, got, limit)
    }
}

/// All rows of a table.
#[derive(Clone, Debug, Serialize)]
pub struct Rows {
    pub rows: Vec<Row>,
}
