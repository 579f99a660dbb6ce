//! A strand's own fields, taken down and put back.

use super::{AddedMass, HeldNodes, Strand};
use crate::base::tape::Tape;
use bevy::prelude::*;

impl Strand {
    /// Its state between substeps.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.list(&mut self.positions);
        tape.list(&mut self.velocities);
        tape.list(&mut self.orientations);
        tape.sparse_list(&mut self.angular_velocities);
        tape.list(&mut self.rest_lengths);
        tape.sparse_list(&mut self.tensions);
        tape.value(&mut self.root_frame);
        tape.option(&mut self.root_before, |tape, (place, frame): &mut (Vec3, Quat)| {
            tape.value(place);
            tape.value(frame);
        });
        tape.value(&mut self.fault_cooldown);
        self.blown.clear();
    }

    /// Whether it has as many nodes, and all that belongs to them.
    pub(crate) fn has_nodes(&self, nodes: usize) -> bool {
        let edges = nodes.saturating_sub(1);
        self.nodes() == nodes
            && self.velocities.len() == nodes
            && self.orientations.len() == edges
            && self.angular_velocities.len() == edges
            && self.rest_lengths.len() == edges
            && self.tensions.len() == edges
    }
}

impl AddedMass {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.list(&mut self.mass);
        tape.list(&mut self.softening);
        tape.flags([&mut self.moves_bonds]);
        tape.list(&mut self.in_water);
    }
}

impl HeldNodes {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let targets = tape.count(self.targets.len(), 1);
        self.targets.resize(targets, None);
        self.targets.iter_mut().for_each(|target| tape.option(target, Tape::value));
        let frames = tape.count(self.frames.len(), 1);
        self.frames.resize(frames, None);
        self.frames.iter_mut().for_each(|frame| tape.option(frame, Tape::value));
    }
}
