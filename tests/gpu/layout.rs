//! Where strands lie on the GPU, and what a record holds. Needs no device.

use crate::lab::{LabStrand, Random};
use bevy::prelude::*;
use bevy_keratin::{
    gpu::{BlowerRecord, Contents, GROUP_SIZE, Layout, MAX_BLOWERS, MAX_OBSTACLES, SubstepRecord},
    solver::rod::obstacle::{Obstacle, Solid},
};
use proptest::prelude::*;

pub fn slots_never_overlap_and_lie_within() {
    proptest!(|(nodes in proptest::collection::vec(2usize..70, 0..150))| {
        let layout = Layout::of(&nodes);
        let mut taken = vec![false; layout.vectors(3)];
        for (strand, count) in nodes.iter().enumerate() {
            prop_assert_eq!(layout.nodes(strand), *count);
            for node in 0..*count {
                for part in 0..3 {
                    let taken = &mut taken[layout.index(strand, node, part, 3)];
                    prop_assert!(!core::mem::replace(taken, true));
                }
            }
        }
        let strands: u32 = layout.blocks().iter().map(|block| block[2]).sum();
        prop_assert_eq!(strands as usize, nodes.len());
        // Numbers on the GPU go through the blocks' lanes one by one, neighbours side by side.
        for [first, _, strands, number] in layout.blocks() {
            for lane in 0..*strands {
                let strand = layout.strand_of(number + lane).unwrap();
                let index = layout.index(strand, 0, 0, 1);
                prop_assert_eq!(index, *first as usize * GROUP_SIZE + lane as usize);
            }
        }
        prop_assert_eq!(layout.strand_of(strands), None);
    });
}

pub fn what_is_put_is_what_is_got() {
    proptest!(|(nodes in proptest::collection::vec(2usize..20, 1..80))| {
        let mut random = Random(9);
        let layout = Layout::of(&nodes);
        let strands: Vec<LabStrand> =
            nodes.iter().map(|nodes| LabStrand::random(&mut random, *nodes, 1.0)).collect();
        let views: Vec<_> = strands.iter().map(LabStrand::view).collect();
        let contents = Contents::of(&layout, &views);
        for (i, strand) in strands.iter().enumerate() {
            let got = contents.get(&layout, i);
            prop_assert_eq!(&got.positions, &strand.positions);
            prop_assert_eq!(&got.velocities, &strand.velocities);
            prop_assert_eq!(&got.orientations, &strand.orientations);
            prop_assert_eq!(&got.tensions, &strand.tensions);
            prop_assert_eq!(&got.joints, &strand.joints);
            prop_assert_eq!(got.root_frame, strand.root_frame);
        }
    });
}

pub fn a_record_is_as_long_whatever_it_holds() {
    let ball = Solid::Capsule { a: Vec3::ZERO, b: Vec3::ZERO, radius: 0.1 };
    let obstacle = Obstacle { solid: ball, motion: None, friction: 0.3 };
    let words = |blowers, obstacles| {
        let mut words = vec![7];
        SubstepRecord {
            blowers: vec![BlowerRecord::default(); blowers],
            obstacles: vec![obstacle.clone(); obstacles],
            ..default()
        }
        .write(&mut words);
        words
    };
    let empty = words(0, 0).len();
    assert_eq!((empty - 1) % 64, 0, "uniform buffers are bound at multiples of 256 bytes");
    for (blowers, obstacles) in [(2, 5), (4, 64), (9, 99)] {
        let words = words(blowers, obstacles);
        assert_eq!(words.len(), empty);
        let counts = [blowers.min(MAX_BLOWERS), obstacles.min(MAX_OBSTACLES)];
        assert_eq!([words[39], words[40]].map(|count| count as usize), counts);
    }
}
