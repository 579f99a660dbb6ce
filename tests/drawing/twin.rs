//! The shader's curve and follower maths against its Rust twin, on random data: dry and wet strands,
//! in this frame and in the one before.

use crate::{
    fibre::{Angles, Optics, Passage},
    offscreen::Offscreen,
};
use bevy::{
    math::Affine3A,
    prelude::*,
    render::{
        RenderApp,
        render_resource::{
            BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, BufferDescriptor,
            BufferInitDescriptor, BufferUsages, ComputePipelineDescriptor, MapMode, PipelineCache,
            PollType, ShaderStages,
            binding_types::{
                storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer_sized,
            },
        },
        renderer::{RenderDevice, RenderQueue},
    },
    shader::ShaderDefVal,
};
use bevy_keratin::{
    forces::contact::ColliderShape,
    render::{
        DrawnStrand, HairFollowers, LockOffset,
        curve::{CurvePoint, DrawnSolid, Guide, GuideEnd, arrange, packed_frame, strand_point},
    },
};

const SAMPLES: usize = 24;
const SHADER: &str = "
#import bevy_keratin::strands::{strands, strand_point, strand_state, past_strand_position}
#import bevy_keratin::rings::{ring_of, packed, unpacked}
@group(0) @binding(6) var<storage, read_write> out: array<vec4<f32>>;
@compute @workgroup_size(1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let t = f32(id.y) / f32(SAMPLES - 1u);
    let point = strand_point(strands[id.x], t);
    let at = 6u * (id.x * SAMPLES + id.y);
    out[at] = vec4(point.position, 1.0);
    out[at + 1u] = vec4(point.slope, 1.0);
    out[at + 2u] = vec4(past_strand_position(strands[id.x], t), 1.0);
    let state = strand_state(strands[id.x], point);
    let ring = unpacked(packed(ring_of(strands[id.x], t)));
    out[at + 3u] = vec4(ring.position, f32(ring.shown));
    out[at + 4u] = vec4(ring.tangent, ring.state.moisture - state.moisture);
    out[at + 5u] = vec4(ring.outward - point.outward, ring.state.strain - state.strain);
}
const SAMPLES: u32 = 24u;
";

/// A fixed sequence of numbers in 0…1.
struct Random(u32);

impl Random {
    fn share(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 16_777_216.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.share(), self.share(), self.share()) - 0.5
    }
}

/// A guide of random nodes, their moisture, and how they moved since the frame before (m/1024): both
/// in steps that an f16 holds.
#[derive(Default)]
struct RandomGuide {
    nodes: Vec<Vec3>,
    moisture: Vec<f32>,
    motion: Vec<Vec3>,
    /// Every third one has been cut.
    end: Option<GuideEnd>,
}

impl RandomGuide {
    fn past(&self) -> Vec<Vec3> {
        self.nodes.iter().zip(&self.motion).map(|(p, m)| p - m / 1024.0).collect()
    }

    /// As the node buffer holds them.
    fn packed(&self) -> impl Iterator<Item = [u32; 8]> + '_ {
        let shown = half(1.0) << 16;
        self.nodes.iter().zip(&self.moisture).zip(&self.motion).map(move |((p, wet), m)| {
            let [x, y, z] = p.to_array().map(f32::to_bits);
            let motion = [half(m.x) | half(m.y) << 16, half(m.z) | shown];
            [x, y, z, 0, half(*wet) << 16, 0, motion[0], motion[1]]
        })
    }
}

/// The f16 that is `x`.
fn half(x: f32) -> u32 {
    u32::from(half::f16::from_f32(x).to_bits())
}

fn random_guides(random: &mut Random) -> Vec<RandomGuide> {
    (0..20)
        .map(|k| {
            let mut p = random.vector() * 0.1;
            let mut guide = RandomGuide::default();
            for _ in 0..2 + k % 9 {
                p += random.vector() * 0.06 - Vec3::Y * 0.02;
                guide.nodes.push(p);
                // Every other guide is dry.
                let wet = (random.share() * 5.0).floor() / 4.0;
                guide.moisture.push(if k % 2 == 0 { 0.0 } else { wet });
                guide.motion.push((random.vector() * 16.0).round());
            }
            let last = guide.nodes.len() as f32 - 2.0;
            let end = last + 0.2 + 0.9 * random.share();
            guide.end =
                (k % 3 == 0).then_some(GuideEnd { edges: last + 2.0 + (k % 4) as f32, end });
            guide
        })
        .collect()
}

fn random_strand(random: &mut Random, k: u32) -> DrawnStrand {
    if k < 20 {
        return DrawnStrand::guide(k);
    }
    let mut guide = || (random.share() * 20.0) as u32;
    let guides = [guide(), guide(), guide()];
    let (u, v) = (0.5 * random.share(), 0.5 * random.share());
    DrawnStrand {
        guides,
        weights: [1.0 - 0.5 * (u + v), 0.5 * u, 0.5 * v],
        length: 1.4 - 0.8 * random.share(),
        root: random.vector() * 0.01,
        phase: 0.1 * random.share(),
        stray: random.vector() * 0.02,
        seed: (random.share() * 1e6) as u32,
        size: 0.3 * random.share(),
        // As exact as it is packed.
        cut: if k.is_multiple_of(2) {
            1.0
        } else {
            (65535.0 * (0.3 + 0.7 * random.share())).round() / 65535.0
        },
        locks: [(); 3].map(|()| random_lock(random)),
        ..default()
    }
}

fn random_lock(random: &mut Random) -> LockOffset {
    let (u, v) = (random.share() - 0.5, random.share() - 0.5);
    LockOffset { root: random.vector() * 0.02, weights: [-u - v, u, v] }
}

/// What a compute shader writes to its last binding, given a uniform and five buffers.
fn compute(
    scene: &mut Offscreen,
    source: &'static str,
    shader_defs: Vec<ShaderDefVal>,
    inputs: [&[u32]; 6],
    [x, y]: [u32; 2],
    numbers: usize,
) -> Vec<f32> {
    let shader = Shader::from_wgsl(source, "twin.wgsl");
    let shader = scene.app.world_mut().resource_mut::<Assets<Shader>>().add(shader);
    let read = || storage_buffer_read_only_sized(false, None);
    let layout = BindGroupLayoutDescriptor::new(
        "twin",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                uniform_buffer_sized(false, None),
                read(),
                read(),
                read(),
                read(),
                read(),
                storage_buffer_sized(false, None),
            ),
        ),
    );
    scene.app.update();
    let render = scene.app.sub_app_mut(RenderApp).world_mut();
    let pipelines = render.remove_resource::<PipelineCache>().unwrap();
    let id = pipelines.queue_compute_pipeline(ComputePipelineDescriptor {
        layout: vec![layout.clone()],
        shader,
        shader_defs,
        ..default()
    });
    render.insert_resource(pipelines);
    for _ in 0..50 {
        scene.app.update();
        let render = scene.app.sub_app(RenderApp).world();
        if render.resource::<PipelineCache>().get_compute_pipeline(id).is_some() {
            break;
        }
    }

    let render = scene.app.sub_app(RenderApp).world();
    let pipelines = render.resource::<PipelineCache>();
    let device = render.resource::<RenderDevice>();
    let Some(pipeline) = pipelines.get_compute_pipeline(id) else {
        panic!("the pipeline is not ready: {:?}", scene.unready_pipelines());
    };
    let buffer = |words: &[u32], usage| {
        let contents: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
        let contents = &contents;
        device.create_buffer_with_data(&BufferInitDescriptor { label: None, contents, usage })
    };
    let storage = BufferUsages::STORAGE;
    let size = 4 * numbers as u64;
    let made = |usage| {
        device.create_buffer(&BufferDescriptor {
            label: None,
            size,
            usage,
            mapped_at_creation: false,
        })
    };
    let out = made(storage | BufferUsages::COPY_SRC);
    let back = made(BufferUsages::MAP_READ | BufferUsages::COPY_DST);
    let uniform = buffer(inputs[0], BufferUsages::UNIFORM);
    let [a, b, c, d, e] = [1, 2, 3, 4, 5].map(|i| buffer(inputs[i], storage));
    let group = device.create_bind_group(
        None,
        &pipelines.get_bind_group_layout(&layout),
        &BindGroupEntries::sequential((
            uniform.as_entire_binding(),
            a.as_entire_binding(),
            b.as_entire_binding(),
            c.as_entire_binding(),
            d.as_entire_binding(),
            e.as_entire_binding(),
            out.as_entire_binding(),
        )),
    );
    let mut encoder = device.create_command_encoder(&default());
    {
        let mut pass = encoder.begin_compute_pass(&default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(x, y, 1);
    }
    encoder.copy_buffer_to_buffer(&out, 0, &back, 0, size);
    render.resource::<RenderQueue>().submit([encoder.finish()]);
    device.map_buffer(&back.slice(..), MapMode::Read, |mapped| mapped.unwrap());
    device.poll(PollType::wait_indefinitely()).unwrap();
    let bytes = back.slice(..).get_mapped_range().to_vec();
    bytes.chunks_exact(4).map(|word| f32::from_le_bytes(word.try_into().unwrap())).collect()
}

pub fn the_shader_puts_strands_where_its_rust_twin_does() {
    let mut scene = Offscreen::new(16, 16);
    let followers = HairFollowers {
        clump: 0.3,
        parting: 2.0,
        wet_clump: 0.6,
        locks: Vec3::new(0.3, 0.5, 0.7),
        lock_shape: 1.3,
        frizz: 0.4e-3,
        ..HairFollowers::none()
    };
    let mut random = Random(7);
    let guides = random_guides(&mut random);
    let strands: Vec<_> = (0..120).map(|k| random_strand(&mut random, k)).collect();

    let mut nodes: Vec<[u32; 8]> = Vec::new();
    let mut ranges: Vec<[u32; 4]> = Vec::new();
    for guide in &guides {
        let whole = guide.nodes.len() as f32 - 1.0;
        let GuideEnd { edges, end } = guide.end.unwrap_or(GuideEnd { edges: whole, end: whole });
        ranges.push([nodes.len() as u32, guide.nodes.len() as u32, edges.to_bits(), end.to_bits()]);
        nodes.extend(guide.packed());
    }
    // Of the size of the shader's uniform: no dye, so only its head counts.
    let mut ribbon = [0.0f32; 76];
    ribbon[22] = followers.frizz;
    ribbon[24..27].copy_from_slice(&followers.locks.to_array());
    ribbon[27] = followers.lock_shape;
    (ribbon[15], ribbon[16], ribbon[17]) =
        (followers.clump, followers.parting, followers.wet_clump);
    // Two solids among the strands, one of them turned, a hat that holds them and one that keeps them out, and many
    // small ones that overlap.
    let place = Affine3A::from_rotation_translation(Quat::from_rotation_z(0.7), Vec3::Y * -0.1);
    let capsule = ColliderShape::Capsule(Capsule3d::new(0.03, 0.05));
    let mut solids = vec![
        DrawnSolid::ball(Vec3::new(0.02, -0.03, 0.01), 0.04).unwrap(),
        DrawnSolid::new(&capsule, &place, false).unwrap(),
    ];
    let hat = |at: Vec3, turn: f32, size: f32, holds: bool| {
        let shape = ColliderShape::Hat {
            radii: size * Vec3::new(1.0, 1.2, 1.1),
            rim: 0.3 * size,
            hides: false,
        };
        let place = Affine3A::from_rotation_translation(Quat::from_rotation_x(turn), at);
        DrawnSolid::new(&shape, &place, holds).unwrap()
    };
    let hats =
        [hat(Vec3::Y * 0.01, 0.2, 0.1, true), hat(Vec3::new(0.0, -0.1, 0.05), -0.5, 0.05, false)];
    solids.extend(hats);
    // And one that hides what is above its rim.
    let helmet = Affine3A::from_rotation_translation(Quat::from_rotation_x(0.4), Vec3::Y * -0.07);
    let shape = ColliderShape::Hat { radii: Vec3::splat(0.1), rim: 0.02, hides: true };
    solids.push(DrawnSolid::new(&shape, &helmet, true).unwrap());
    let above_rim = |p: Vec3| helmet.inverse().transform_point3(p).y - 0.02;
    solids.extend((0..60).map(|_| DrawnSolid::ball(0.08 * random.vector(), 0.012).unwrap()));
    arrange(&mut solids);
    let frame = packed_frame(&solids);
    let packed: Vec<[u32; 32]> = strands.iter().map(DrawnStrand::packed).collect();

    let defs =
        vec![ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), 0), "MOTION_VECTOR_PREPASS".into()];
    let inputs = [
        &ribbon.map(f32::to_bits)[..],
        nodes.as_flattened(),
        ranges.as_flattened(),
        packed.as_flattened(),
        &[0][..],
        &frame,
    ];
    let groups = [strands.len() as u32, SAMPLES as u32];
    let out = compute(&mut scene, SHADER, defs, inputs, groups, strands.len() * SAMPLES * 24);
    let vector = |i: usize| Vec3::new(out[4 * i], out[4 * i + 1], out[4 * i + 2]);

    let past: Vec<Vec<Vec3>> = guides.iter().map(RandomGuide::past).collect();
    let now = |k: u32| {
        let RandomGuide { nodes, moisture, end, .. } = &guides[k as usize];
        Guide { nodes, moisture, end: *end }
    };
    let before = |k: u32| Guide { nodes: &past[k as usize], ..now(k) };
    let dry = |k: u32| Guide { moisture: &[], ..now(k) };
    let parted = HairFollowers { parting: 1e6, ..followers };
    let [mut worst, mut worst_past, mut worst_ring] = [0.0f32; 3];
    let [mut parts, mut drawn_in, mut pushed, mut cut, mut hatted, mut hidden] = [0; 6];
    let bare: Vec<DrawnSolid> =
        solids.iter().filter(|solid| !hats.contains(solid)).copied().collect();
    for (k, strand) in strands.iter().enumerate() {
        for i in 0..SAMPLES {
            let t = i as f32 / (SAMPLES - 1) as f32;
            let twin = strand_point(strand, now, t, &followers, &solids);
            let at = 6 * (k * SAMPLES + i);
            worst = worst.max(vector(at).distance(twin.position));
            worst = worst.max(vector(at + 1).distance(twin.slope) * 0.01);
            // What pushes a point may take it across the rim.
            let above = above_rim(twin.position);
            if out[4 * at + 15] == 0.0 {
                assert!(above > -0.025, "hidden {above} m above the rim");
                hidden += 1;
                continue;
            }
            assert!(above < 0.025, "drawn {above} m above the rim");
            // A ring is as exact as its halves and sixteen bits of an octahedron are.
            assert!(vector(at + 3) == vector(at) && out[4 * at + 15] == 1.0);
            worst_ring =
                worst_ring.max(vector(at + 4).distance(vector(at + 1).normalize_or(Vec3::Y)));
            worst_ring = worst_ring.max(out[4 * at + 19].abs().max(out[4 * at + 23].abs()));
            worst_ring = worst_ring.max(vector(at + 5).length() * 10.0);
            let past = strand_point(strand, before, t, &followers, &solids).position;
            worst_past = worst_past.max(vector(at + 2).distance(past));
            let differs = |other: CurvePoint| other.position.distance(twin.position) > 1e-4;
            parts += u32::from(differs(strand_point(strand, now, t, &parted, &solids)));
            drawn_in += u32::from(differs(strand_point(strand, dry, t, &followers, &solids)));
            pushed += u32::from(differs(strand_point(strand, now, t, &followers, &[])));
            hatted += u32::from(differs(strand_point(strand, now, t, &followers, &bare)));
            let grown = |k: u32| Guide { end: None, ..now(k) };
            cut += u32::from(differs(strand_point(strand, grown, t, &followers, &solids)));
        }
    }
    println!("largest difference {worst} m, in the frame before {worst_past} m");
    println!("rings lose {worst_ring}");
    println!(
        "{parts} points of parted guides, {drawn_in} drawn in by water, {pushed} pushed out, {hatted} by hats, {cut} cut, {hidden} hidden"
    );
    assert!(worst < 1e-5 && worst_past < 1e-5, "shader and twin differ by {worst}, {worst_past} m");
    assert!((1e-6..1e-3).contains(&worst_ring), "packing a ring loses {worst_ring}");
    assert!(
        parts.min(drawn_in).min(hatted).min(cut).min(hidden) > 100,
        "the data must contain all kinds"
    );
}

const FIBRE: &str = "
#import bevy_keratin::fibre::{Optics, Passage, angles_of, scattered}
@group(0) @binding(0) var<uniform> tangent: vec4<f32>;
@group(0) @binding(1) var<storage, read> fibres: array<array<vec4<f32>, 4>>;
@group(0) @binding(2) var<storage, read> unused: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> unused_too: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> out: array<vec4<f32>>;
@compute @workgroup_size(1)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    let f = fibres[id.x];
    let a = angles_of(tangent.xyz, f[2].xyz, f[3].xyz);
    let o = Optics(f[0].xyz, f[0].w, 0.8, 1.2, f[1].x, f[2].w, 1.5 * f[1].x, 0.7 * f[1].x, 0.2 * f[1].y);
    let keep = (unused[0].x + unused_too[0].x) * 0.0;
    out[id.x] = vec4(scattered(a, o, Passage(f[1].y, f[1].z, f[1].w), f[3].w, 1.5 * f[3].w) + keep, 1.0);
}
";

pub fn the_shader_lights_fibres_as_its_rust_twin_does() {
    let mut scene = Offscreen::new(16, 16);
    const COUNT: usize = 400;
    let mut random = Random(11);
    let fibres: Vec<[Vec4; 4]> = (0..COUNT)
        .map(|_| {
            let absorption = 4.0 * (random.vector() + 0.5).powf(3.0);
            let lit = random.share();
            [
                absorption.extend(0.003 + 0.3 * random.share()),
                Vec4::new(random.share(), lit, 9.0 * random.share(), 9.0 * random.share()),
                random.vector().normalize_or(Vec3::X).extend(0.05 * (random.share() - 0.5)),
                random.vector().normalize_or(Vec3::Z).extend(30.0 * random.share()),
            ]
        })
        .collect();
    let tangent = Vec3::new(0.48, 0.6, 0.64);
    let bits = |v: &Vec4| v.to_array().map(f32::to_bits);
    let words: Vec<u32> = fibres.iter().flatten().flat_map(bits).collect();
    let tangent_words = bits(&tangent.extend(0.0));
    let none = &[0; 4][..];
    let inputs = [&tangent_words[..], &words[..], none, none, none, none];
    let out = compute(&mut scene, FIBRE, Vec::new(), inputs, [COUNT as u32, 1], 4 * COUNT);
    let (mut worst, mut sum) = (0.0f32, 0.0);
    for (f, sent) in fibres.iter().zip(out.chunks_exact(4)) {
        let fibre = Optics {
            absorption: f[0].truncate(),
            variance: f[0].w,
            gloss: 0.8,
            through: 1.2,
            wet: f[1].x,
            tilt: f[2].w,
            film: 1.5 * f[1].x,
            lock: 0.7 * f[1].x,
            disarray: 0.2 * f[1].y,
        };
        let angles = Angles::of(tangent, f[2].truncate(), f[3].truncate());
        let passage = Passage { lit: f[1].y, depth: f[1].z, behind: f[1].w };
        let twin = fibre.scattered(&angles, &passage, f[3].w, 1.5 * f[3].w);
        let sent = Vec3::new(sent[0], sent[1], sent[2]);
        worst = worst.max(((sent - twin).abs() / (twin.abs() + 1e-3)).max_element());
        sum += twin.element_sum();
    }
    println!("largest difference {worst} of what is sent, {sum} in all");
    assert!(worst < 0.01 && sum > 1.0, "shader and twin differ by {worst}");
}
