//! The step against an independent dense solve.

use super::*;
use serde::Deserialize;

/// A case of `data/direct.json`, made in another language.
#[derive(Deserialize)]
struct Case {
    name: String,
    dt: f64,
    damping: f64,
    #[serde(default = "isotropic")]
    torsion: f32,
    gravity: [f64; 3],
    held: Vec<bool>,
    from: Vec<[f64; 3]>,
    p: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    mass: Vec<f64>,
    q: Vec<[f64; 4]>,
    rest: Vec<[f64; 4]>,
    l: Vec<f64>,
    k: Vec<f64>,
    axial: Vec<f64>,
    tension: Vec<f64>,
    root: [f64; 4],
    root_from: [f64; 4],
    after: After,
}

fn isotropic() -> f32 {
    1.0
}

#[derive(Deserialize)]
struct After {
    p: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    q: Vec<[f64; 4]>,
    tension: Vec<f64>,
}

#[derive(Deserialize)]
struct Golden {
    cases: Vec<Case>,
}

#[test]
fn in_f64_a_substep_is_that_of_a_dense_solve() {
    let golden = include_str!("../../../../../tests/data/direct.json");
    let golden: Golden = serde_json::from_str(golden).unwrap();
    assert_eq!(golden.cases.len(), 11);
    for c in golden.cases {
        let (w, theta) = (Single::<f64>::default(), f64::from(THETA));
        let node = |i: usize| {
            let [from, p, v] = [c.from[i], c.p[i], c.v[i]].map(DVec3::from);
            let p = if c.held[i] { p } else { from + theta * c.dt * v };
            NodeLanes {
                p: p.to_array(),
                from: from.to_array(),
                v: v.to_array(),
                w: if c.held[i] { 0.0 } else { 1.0 },
                mass: c.mass[i],
                push: c.gravity,
                ..Default::default()
            }
        };
        let edge = |i: usize| EdgeLanes {
            q: c.q[i],
            rest: c.rest[i],
            l: c.l[i],
            k: c.k[i],
            axial: c.axial[i],
            tension: c.tension[i],
            ..Default::default()
        };
        let between =
            DQuat::from_array(c.root_from).lerp(DQuat::from_array(c.root), theta).to_array();
        let mut strand = Strands {
            nodes: (0..c.p.len()).map(node).collect(),
            edges: (0..c.l.len()).map(edge).collect(),
            root: c.root,
            root_from: c.root_from,
            root_between: between,
            theta,
            max_twist: f64::INFINITY,
            twice: 0.0,
        };
        let step = Step { dt: c.dt as f32, damping: c.damping, torsion: c.torsion };
        assert_eq!(strand.solve::<_, false>(w, &step), 0.0);
        let close = |what: &str, found: &[f64], expected: &[f64], scale: f64| {
            for (found, expected) in found.iter().zip(expected) {
                let off = (found - expected).abs();
                // The step's time is a number of single precision.
                assert!(off < 1e-6 * scale, "{}: {what} {found}, expected {expected}", c.name);
            }
        };
        for (n, (p, v)) in strand.nodes.iter().zip(c.after.p.iter().zip(&c.after.v)) {
            close("position", &n.p, p, 0.1);
            close("velocity", &n.v, v, 10.0);
        }
        for (e, (q, tension)) in strand.edges.iter().zip(c.after.q.iter().zip(&c.after.tension)) {
            close("frame", &e.q, q, 1.0);
            close("tension", &[e.tension], &[*tension], 1e5);
        }
    }
}
