//! What drawing reads, written by the GPU: the layout that `HairBuffers` documents.

use crate::lab::{Device, LabStrand, Random, plain};
use bevy::{
    prelude::*,
    render::render_resource::{BufferDescriptor, BufferUsages, MapMode, PollType},
};
use bevy_keratin::gpu::{DrawnMoment, DrawnNodes, GpuStrands};
use half::f16;

fn half_of(word: u32, high: bool) -> f32 {
    f16::from_bits((if high { word >> 16 } else { word }) as u16).to_f32()
}

pub fn drawn_nodes_are_those_of_the_strands_between_the_last_two_ticks() {
    let device = Device::get();
    let mut random = Random(21);
    let strands: Vec<LabStrand> =
        (0..45).map(|i| LabStrand::random(&mut random, 2 + i * 5 % 17, 1.0)).collect();
    let counts: Vec<u32> = strands.iter().map(|s| s.positions.len() as u32).collect();
    let firsts: Vec<u32> = (0..counts.len()).map(|i| counts[..i].iter().sum()).collect();
    let size = 32 * u64::from(counts.iter().sum::<u32>());
    let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
    let buffer = |usage| {
        let label = None;
        let mapped_at_creation = false;
        device.device.create_buffer(&BufferDescriptor { label, size, usage, mapped_at_creation })
    };
    let nodes = buffer(usage);
    let mut on = device.hand_over(&strands);
    let mut first = plain();
    first.notes_before = true;
    let drawn = DrawnNodes::new(&device.device, &device.kernels, &on, &nodes, &firsts);
    let show = |on: &GpuStrands, overstep: f32, known: bool, roots: &[Option<Vec3>]| {
        let moment = DrawnMoment { overstep, known, roots };
        let mut encoder = device.device.create_command_encoder(&default());
        drawn.encode(&device.queue, &device.kernels, on, &mut encoder, &moment);
        let back = buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        encoder.copy_buffer_to_buffer(&nodes, 0, &back, 0, size);
        device.queue.submit([encoder.finish()]);
        device.device.map_buffer(&back.slice(..), MapMode::Read, |mapped| mapped.unwrap());
        device.device.poll(PollType::wait_indefinitely()).unwrap();
        let bytes = back.slice(..).get_mapped_range().to_vec();
        let words: Vec<u32> =
            bytes.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect();
        words.as_chunks::<8>().0.to_vec()
    };
    let appeared = show(&on, 1.0, false, &[]);
    let after = device.run(&mut on, &[first, plain()]);
    let shown = show(&on, 0.25, true, &[]);
    // As on a skinned mesh, which is drawn elsewhere than it is simulated.
    let aside = |i: usize| (!i.is_multiple_of(3)).then_some(Vec3::new(0.3, 0.02 * i as f32, 0.0));
    let roots: Vec<Option<Vec3>> = (0..strands.len()).map(aside).collect();
    let rooted = show(&on, 0.25, true, &roots);
    let place = |node: &[u32; 8]| Vec3::from([node[0], node[1], node[2]].map(f32::from_bits));
    for (i, (strand, state)) in strands.iter().zip(&after).enumerate() {
        let mut rest = 0.0;
        for node in 0..counts[i] as usize {
            let at = firsts[i] as usize + node;
            let (old, new) = (&appeared[at], &shown[at]);
            assert_eq!(place(old), strand.positions[node]);
            assert_eq!((old[6], half_of(old[7], false)), (0, 0.0), "what appears has not moved");
            assert_eq!(state.before[node], strand.positions[node]);
            let between = strand.positions[node].lerp(state.positions[node], 0.25);
            assert!(place(new).distance(between) < 1e-6, "{i}, {node}");
            let root = strand.positions[0].lerp(state.positions[0], 0.25);
            let expected = between + roots[i].map_or(Vec3::ZERO, |drawn| drawn - root);
            assert!(place(&rooted[at]).distance(expected) < 1e-6, "{i}, {node}");
            let moved = (between - strand.positions[node]) * 1024.0;
            let found =
                Vec3::new(half_of(new[6], false), half_of(new[6], true), half_of(new[7], false));
            assert!(found.distance(moved) < 2e-3 * moved.length() + 1e-3, "{found}, not {moved}");
            assert_eq!(half_of(new[7], true), 1.0);
            assert!((f32::from_bits(new[5]) - rest).abs() < 1e-6);
            rest += strand.lengths.get(node).copied().unwrap_or(0.0);
            let rates = state.joints[node.min(state.joints.len() - 1)].rates;
            assert_eq!(new[3].to_le_bytes(), rates.map(|r| (r * 255.0 + 0.5) as u8));
            let edges = [node.wrapping_sub(1), node];
            let strains: Vec<f32> = (edges.into_iter().filter(|e| *e < strand.lengths.len()))
                .map(|e| {
                    let length = state.positions[e].distance(state.positions[e + 1]);
                    (length / strand.lengths[e] - 1.0).abs()
                })
                .collect();
            let strain = strains.iter().sum::<f32>() / strains.len() as f32;
            assert!((half_of(new[4], false) - strain).abs() < 1e-3 * strain + 1e-5);
            assert_eq!(half_of(new[4], true), 0.0, "dry");
        }
    }
}
