//! What rods do, worked out in double precision with nothing of the crate: references for its tests.
//!
//! Units: SI with mass per length μ = 1, so that E I = g L_g³, g = 9.8 m/s².

pub mod planar;
pub mod spatial;
pub mod twist;

/// The gravity in the definition of the gravity-bending length (m/s²).
pub const GRAVITY: f64 = 9.8;

/// E I of hair with the gravity-bending length L_g (m), for μ = 1.
pub fn bending_stiffness(bending_length: f64) -> f64 {
    GRAVITY * bending_length.powi(3)
}

#[track_caller]
pub fn near(found: f64, expected: f64, share: f64) {
    let off = found / expected - 1.0;
    assert!(off.abs() <= share, "{found}, expected {expected}: off by {:.3} %", off * 100.0);
}
