//! Golden vectors of the direct solver through the shader: a dense solve in another language. Those of the
//! paper's projections are in `sweeps`.

use crate::{
    lab::{Device, LabStrand, plain},
    vectors::{Substep, substeps},
};
use bevy::prelude::*;
use bevy_keratin::{
    gpu::{GpuStrands, KinematicTarget, SOURCE, SubstepRecord, TreatmentRecord},
    keratin::bond::model::JointBonds,
};

/// Masses and stiffnesses as the vectors have them, in place of what hair makes of its lengths. They stand where
/// treatments of no joint do, and where a wind is that takes nothing along.
const WEIGH: &str = "
fn weigh() {
    density = 1.0;
    bending = 1.0;
    axial_stiffness = record.wind.x;
    firmest = 1e30;
    max_twist = 1e6;
    for (var i = 0u; i <= edges; i++) {
        let given = record.treatment[i / 4u];
        let e = edge(i);
        let weight = select(given.share[i % 4u], 0.0, is_held(e.z));
        rest[slot(i, 1u, 2u)] = vec4(e.x, given.change[i % 4u], weight, e.w);
    }
}
";

impl Substep {
    fn strand(&self) -> LabStrand {
        let turns = |all: &[[f32; 4]]| all.iter().map(|q| Quat::from_array(*q)).collect();
        let places = |all: &[[f32; 3]]| all.iter().map(|p| Vec3::from(*p)).collect();
        let joint = |rest: &[f32; 4]| JointBonds::closed(Quat::from_array(*rest).xyz());
        LabStrand {
            positions: places(&self.from),
            velocities: places(&self.v),
            orientations: turns(&self.q),
            root_frame: Quat::from_array(self.root_from),
            lengths: self.l.clone(),
            tensions: self.tension.clone(),
            spins: Vec::new(),
            joints: self.rest.iter().map(joint).collect(),
        }
    }

    fn record(&self) -> SubstepRecord {
        let given: Vec<[f32; 2]> = (0..self.mass.len())
            .map(|i| {
                let length = |i: Option<usize>| i.and_then(|i| self.l.get(i)).copied();
                let before = length(i.checked_sub(1)).unwrap_or(0.0);
                let sum = before + length(Some(i)).unwrap_or(0.0);
                [self.k.get(i).map_or(0.0, |k| k * sum), 2.0 * self.mass[i] / sum]
            })
            .collect();
        let four = |some: &[[f32; 2]], which: usize| {
            core::array::from_fn(|i| some.get(i).map_or(0.0, |given| given[which]))
        };
        let treatments = given.chunks(4).map(|some| TreatmentRecord {
            change: four(some, 0),
            share: four(some, 1),
            joints: 0..0,
        });
        let root = KinematicTarget {
            strand: 0,
            node: 0,
            place: Some(self.p[0].into()),
            frame: Quat::from_array(self.root),
        };
        SubstepRecord {
            dt: self.dt,
            gravity: self.gravity.into(),
            damping: self.damping,
            torsion: self.torsion,
            retained: 1.0,
            wind: Vec3::X * (self.axial[0] * self.l[0]),
            limiter_steps: 0,
            treatments: treatments.collect(),
            targets: vec![root],
            ..plain()
        }
    }
}

pub fn a_substep_of_the_direct_solver() {
    let device = Device::get();
    let usual = "fn weigh() {";
    assert_eq!(SOURCE.matches(usual).count(), 1);
    let source = SOURCE.replace(usual, "fn weigh_as_usual() {") + WEIGH;
    let kernels = device.kernels.clone().with_substep(&device.device, &source);
    for c in substeps() {
        let strand = c.strand();
        let mut on = GpuStrands::new(&device.device, &kernels, &[strand.view()]);
        on.run(&device.device, &device.queue, &kernels, &[c.record()]);
        let found = on.read(&device.device, &device.queue).unwrap().remove(0);
        let mut off = [0.0_f32; 3];
        let mut moved = 0.0_f32;
        for i in 0..c.p.len() {
            let [p, v] = [c.after.p[i], c.after.v[i]].map(Vec3::from);
            moved = moved.max(p.distance(c.from[i].into()));
            off[0] = off[0].max(found.positions[i].distance(p));
            off[1] = off[1].max(found.velocities[i].distance(v));
        }
        for (found, q) in found.orientations.iter().zip(&c.after.q) {
            off[2] = off[2].max(found.angle_between(Quat::from_array(*q).normalize()));
        }
        println!("{}: off by {off:?}; moved {moved} m", c.name);
        // The bounds of the lanes (tests/golden.rs).
        assert!(off[0] < 1e-6 + 1e-4 * moved, "{}: {} m of {moved}", c.name, off[0]);
        assert!(off[1] * c.dt < 2e-6 + 2e-4 * moved, "{}: {} m/s", c.name, off[1]);
        assert!(off[2] < 2e-3, "{}: {} rad", c.name, off[2]);
    }
}
