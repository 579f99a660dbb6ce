//! The golden vectors: `data/cosserat.json` of a published reference implementation against the paper's coupled
//! projection, `data/direct.json` of a dense solve in another language. Both tell their conventions in `meta`.
#![allow(dead_code, reason = "each test that includes this takes its part")]

use serde::Deserialize;

#[derive(Deserialize)]
pub struct Projections {
    pub stretch_shear: Vec<Stretch>,
    pub bend_twist: Vec<Bend>,
}

#[derive(Deserialize)]
pub struct Stretch {
    pub p0: [f64; 3],
    pub w0: f64,
    pub p1: [f64; 3],
    pub w1: f64,
    pub q: [f64; 4],
    pub wq: f64,
    pub l: f64,
    pub corr0: [f64; 3],
    pub corr1: [f64; 3],
    pub corrq: [f64; 4],
    pub q_after: [f64; 4],
}

#[derive(Deserialize)]
pub struct Bend {
    pub q0: [f64; 4],
    pub w0: f64,
    pub q1: [f64; 4],
    pub w1: f64,
    pub rest_darboux: [f64; 4],
    pub corrq0: [f64; 4],
    pub corrq1: [f64; 4],
    pub q0_after: [f64; 4],
    pub q1_after: [f64; 4],
}

/// Of each kind of projection, with full stiffness.
pub fn projections() -> Projections {
    let all: Projections = serde_json::from_str(include_str!("../data/cosserat.json")).unwrap();
    assert_eq!((all.stretch_shear.len(), all.bend_twist.len()), (48, 48));
    all
}

#[derive(Deserialize)]
struct Substeps {
    cases: Vec<Substep>,
}

#[derive(Deserialize)]
pub struct Substep {
    pub name: String,
    pub dt: f32,
    pub damping: f32,
    #[serde(default = "isotropic")]
    pub torsion: f32,
    pub gravity: [f32; 3],
    pub held: Vec<bool>,
    pub from: Vec<[f32; 3]>,
    pub p: Vec<[f32; 3]>,
    pub v: Vec<[f32; 3]>,
    pub mass: Vec<f32>,
    pub q: Vec<[f32; 4]>,
    pub rest: Vec<[f32; 4]>,
    pub l: Vec<f32>,
    pub k: Vec<f32>,
    pub axial: Vec<f32>,
    pub tension: Vec<f32>,
    pub root: [f32; 4],
    pub root_from: [f32; 4],
    pub after: After,
}

fn isotropic() -> f32 {
    1.0
}

#[derive(Deserialize)]
pub struct After {
    pub p: Vec<[f32; 3]>,
    pub v: Vec<[f32; 3]>,
    pub q: Vec<[f32; 4]>,
}

/// Of the direct solver.
pub fn substeps() -> Vec<Substep> {
    let all: Substeps = serde_json::from_str(include_str!("../data/direct.json")).unwrap();
    assert_eq!(all.cases.len(), 11);
    all.cases
}
