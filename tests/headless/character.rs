//! Hair on a character that moves: no tunnelling, no bounce after a teleport, the same at any size
//! and frame rate.

use crate::common::{app_with_meshes, one_strand, run, settle, strand, test_app};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{
    hair::strand::{StrandHistory, TickPose},
    prelude::*,
};
use core::{f32::consts::PI, time::Duration};

const HEAD: f32 = 0.09;

/// A head under `parent`'s pose with strands all over its upper half, settled.
pub fn head(app: &mut App, strands: usize, scale: f32) -> Entity {
    let place = Transform::from_xyz(0.0, 1.6, 0.0).with_scale(Vec3::splat(scale));
    let head = app.world_mut().spawn((HairCollider::sphere(HEAD).unwrap(), place)).id();
    let hair = app.world_mut().spawn((Hair, ChildOf(head))).id();
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    for i in 0..strands {
        let y = (i as f32 + 0.5) / strands as f32;
        let across = (1.0 - y * y).sqrt();
        let (sine, cosine) = (golden * i as f32).sin_cos();
        let normal = Vec3::new(across * cosine, y, across * sine);
        let points: Vec<Vec3> =
            (0..10).map(|k| normal * (HEAD + 0.002 + 0.025 * k as f32)).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    run(app, 4.0);
    head
}

pub fn all(app: &mut App) -> Vec<Strand> {
    app.world_mut().query::<&Strand>().iter(app.world()).cloned().collect()
}

pub fn move_head(app: &mut App, head: Entity, change: impl FnOnce(&mut Transform)) {
    change(&mut app.world_mut().get_mut::<Transform>(head).unwrap());
}

/// How deep any node is in the head, and the largest strain.
fn worst(app: &mut App) -> (f32, f32) {
    all(app).iter().fold((0.0, 0.0), |(deep, strain), s| {
        let deepest = s.positions()[1..].iter().map(|p| HEAD - p.length()).fold(deep, f32::max);
        (deepest, strain.max(s.peak_strain()))
    })
}

#[test]
fn a_head_that_turns_720_degrees_a_second_and_jerks_2_m_keeps_its_hair_outside() {
    let mut app = test_app(60.0);
    let head = head(&mut app, 300, 1.0);
    let (mut deep, mut strain) = worst(&mut app);
    for tick in 0..90 {
        move_head(&mut app, head, |place| {
            // Half a second each way, then a jerk of 2 m within 12 ticks while it turns on.
            let way = if tick < 60 { 1.0 } else { -1.0 };
            place.rotate_y(way * 720.0_f32.to_radians() / 60.0);
            if (60..72).contains(&tick) {
                place.translation.x += 2.0 / 12.0;
            }
        });
        app.update();
        let (d, s) = worst(&mut app);
        (deep, strain) = (deep.max(d), strain.max(s));
    }
    println!("deepest {} mm, strain {strain}", deep * 1e3);
    assert!(deep < 1e-4, "{} mm inside the head", deep * 1e3);
    assert!(strain < 0.1, "strain in motion {strain}");
    run(&mut app, 1.0);
    let (_, strain) = worst(&mut app);
    println!("strain a second later {strain}");
    assert!(strain < 0.03, "strain a second later {strain}");
}

/// A strand, and a finger of 3 cm that comes at it at 10 m/s: within a substep it goes as far as it is
/// thick.
#[test]
fn a_hand_at_10_m_per_s_does_not_pass_through() {
    for hertz in [30.0, 60.0] {
        let mut app = test_app(hertz);
        let (_, id) = one_strand(&mut app, 0.3, 30, Vec3::NEG_Y);
        settle(&mut app, id, 20.0);
        let bar = HairCollider::capsule(0.015, 0.4).unwrap();
        let along_x = Quat::from_rotation_z(PI / 2.0);
        let place = |z: f32| Transform::from_xyz(0.0, -0.15, z).with_rotation(along_x);
        let bar = app.world_mut().spawn((bar, place(-0.205))).id();
        app.update();
        let ticks = (0.3 / 10.0 * hertz).round() as usize;
        for i in 1..=ticks {
            *app.world_mut().get_mut::<Transform>(bar).unwrap() =
                place(-0.205 + 0.3 * i as f32 / ticks as f32);
            app.update();
        }
        let z = app.world().get::<Transform>(bar).unwrap().translation.z;
        let s = strand(&app, id);
        // The part of the strand at the bar's height is before it, not behind.
        let node = s.positions()[15];
        println!("{hertz} Hz: bar at {z}, node {node}, strain {}", s.peak_strain());
        assert!(node.z > z || node.y > -0.14, "{hertz} Hz: bar at {z} m, node at {node}");
        assert!(s.positions().iter().any(|p| p.z > 0.03), "it was swept along");
        // So fast that the strand cannot slide off without being stretched; it recovers.
        app.world_mut().despawn(bar);
        run(&mut app, 1.0);
        assert!(strand(&app, id).peak_strain() < 0.03);
    }
}

#[test]
fn hair_goes_along_with_a_teleport_and_is_at_rest() {
    // Long jumps are noticed; short ones are announced.
    for (announced, jump) in [(false, 100.0), (true, 0.4)] {
        let mut app = test_app(60.0);
        let head = head(&mut app, 50, 1.0);
        run(&mut app, 4.0);
        let before = all(&mut app);
        let hair = app.world_mut().query_filtered::<Entity, With<Hair>>().single(app.world());
        if announced {
            app.world_mut().commands().entity(hair.unwrap()).queue(Hair::teleport);
        }
        move_head(&mut app, head, |place| {
            place.translation += Vec3::new(jump, 0.0, 0.0);
            place.rotate_y(1.0);
        });
        app.update();
        // Gravity along the turned axis is the same, so settled hair stays as it is.
        for (a, b) in all(&mut app).iter().zip(&before) {
            for (p, q) in a.positions().iter().zip(b.positions()) {
                assert!(p.distance(*q) < 1e-4, "{announced}: {p} was {q}");
            }
            let fastest = a.velocities().iter().map(|v| v.length()).fold(0.0, f32::max);
            assert!(fastest < 5e-3, "{announced}: {fastest} m/s");
        }
        run(&mut app, 0.2);
        for (a, b) in all(&mut app).iter().zip(&before) {
            let tip = |s: &Strand| *s.positions().last().unwrap();
            assert!(tip(a).distance(tip(b)) < 2e-3, "no bounce: {announced}");
        }
    }
}

#[test]
fn a_collider_teleports_unless_it_moves_along_with_hair_that_does_not() {
    // The hair moves by 20 cm, which it takes for motion.
    for (with, teleports) in [(Vec3::X * 0.2, false), (Vec3::NEG_X * 0.2, true)] {
        let mut app = test_app(60.0);
        app.insert_resource(HairDefault(HairInertia { teleport_speed: 10.0, ..default() }));
        let (hair, _) = one_strand(&mut app, 0.5, 8, Vec3::NEG_Y);
        app.world_mut().entity_mut(hair).insert(HairInertia::default());
        let ball = (HairCollider::sphere(0.05).unwrap(), Transform::from_xyz(0.0, 0.0, 3.0));
        let ball = app.world_mut().spawn(ball).id();
        run(&mut app, 0.1);
        let moved = |app: &App, e: Entity| {
            let frame = app.world().get::<TickPose>(e).unwrap();
            frame.before() != frame.now()
        };
        assert!(!moved(&app, hair) && !moved(&app, ball));
        for (entity, by) in [(hair, Vec3::X * 0.2), (ball, with)] {
            app.world_mut().get_mut::<Transform>(entity).unwrap().translation += by;
        }
        app.update();
        assert!(moved(&app, hair));
        assert_eq!(!moved(&app, ball), teleports, "{with}");
    }
}

#[test]
fn short_moves_are_felt_as_much_as_inertia_says() {
    let stays_behind = |moving: f32| {
        let mut app = test_app(60.0);
        let (hair, id) = one_strand(&mut app, 0.2, 8, Vec3::NEG_Y);
        app.world_mut().entity_mut(hair).insert(HairInertia { moving, ..default() });
        settle(&mut app, id, 20.0);
        for _ in 0..3 {
            move_head(&mut app, hair, |place| place.translation.x += 0.01);
            app.update();
        }
        -strand(&app, id).positions().last().unwrap().x
    };
    let [all, half, none] = [1.0, 0.5, 0.0].map(stays_behind);
    println!("{all} {half} {none}");
    assert!(all > 0.015, "the tip stays behind: {all}");
    assert!((half / all - 0.5).abs() < 0.1, "{half} of {all}");
    assert!(none.abs() < 1e-4, "{none}");
}

#[test]
fn a_character_of_any_size_behaves_alike() {
    let shape = |scale: f32| {
        let mut app = test_app(60.0);
        // Air counts in metres a second of the world.
        app.insert_resource(HairDefault(AirDrag { rate: 0.0 }));
        let head = head(&mut app, 20, scale);
        for tick in 0..40 {
            move_head(&mut app, head, |place| {
                place.rotate_y(0.15);
                place.translation.x += 0.02 * scale * (tick as f32 * 0.3).sin();
            });
            app.update();
        }
        all(&mut app)
    };
    let one = shape(1.0);
    for scale in [0.01, 100.0] {
        for (a, b) in shape(scale).iter().zip(&one) {
            for (p, q) in a.positions().iter().zip(b.positions()) {
                assert!(p.distance(*q) < 5e-3, "{scale}: {p} against {q}");
            }
        }
    }
}

#[test]
fn frame_rate_does_not_matter() {
    let state = |fps: f64| {
        let mut app = test_app(60.0);
        let head = head(&mut app, 10, 1.0);
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1.0 / fps)));
        // Motion of fixed time.
        app.add_systems(FixedUpdate, move |mut places: Query<&mut Transform>| {
            places.get_mut(head).unwrap().rotate_y(0.1);
        });
        let start = app.world().resource::<Time<Fixed>>().elapsed();
        let until = start + Duration::from_secs(1);
        let mut states = Vec::new();
        while app.world().resource::<Time<Fixed>>().elapsed() < until {
            app.update();
            let now = app.world().resource::<Time<Fixed>>().elapsed();
            states.push((now, all(&mut app)));
        }
        states
    };
    let [a, b, c] = [30.0, 60.0, 144.0].map(state);
    let mut compared = 0;
    for (time, one) in &a {
        for (_, other) in b.iter().chain(&c).filter(|(t, _)| t == time) {
            compared += 1;
            for (s, o) in one.iter().zip(other) {
                assert_eq!(s.positions(), o.positions(), "at {time:?}");
            }
        }
    }
    assert!(compared > 40, "{compared} moments compared");
}

/// A head that turns evenly from frame to frame, while ticks come after two frames or three.
#[test]
fn hair_of_an_evenly_turning_head_does_not_stutter() {
    for fps in [30.0, 50.0, 144.0] {
        let mut app = test_app(60.0);
        let head = head(&mut app, 10, 1.0);
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1.0 / fps)));
        app.add_systems(Update, move |time: Res<Time>, mut places: Query<&mut Transform>| {
            places.get_mut(head).unwrap().rotate_y(6.0 * time.delta_secs());
        });
        // Until it turns along with the head.
        let frames = |seconds: f64| (seconds * fps) as usize;
        (0..frames(8.0)).for_each(|_| app.update());
        let mut low = [Vec3::INFINITY; 10];
        let mut high = [Vec3::NEG_INFINITY; 10];
        for _ in 0..frames(1.0) {
            app.update();
            let overstep = app.world().resource::<Time<Fixed>>().overstep_fraction();
            let mut strands = app.world_mut().query::<(&Strand, &StrandHistory)>();
            for (i, (strand, history)) in strands.iter(app.world()).enumerate() {
                let tip = history.drawn(strand, strand.nodes() - 1, overstep);
                (low[i], high[i]) = (low[i].min(tip), high[i].max(tip));
            }
        }
        let sways = low.iter().zip(&high).map(|(l, h)| l.distance(*h)).fold(0.0, f32::max);
        println!("{fps} fps: tips sway by {} mm", sways * 1e3);
        assert!(sways < 5e-4, "{fps} fps: tips sway by {} mm", sways * 1e3);
    }
}

#[test]
fn restyled_hair_keeps_its_shape_and_reset_brings_it_back() {
    let mut app = test_app(60.0);
    crate::common::no_gravity(&mut app);
    let (hair, id) = one_strand(&mut app, 0.2, 8, Vec3::NEG_Y);
    run(&mut app, 0.1);
    let straight = strand(&app, id).positions().to_vec();
    let bend = |app: &mut App| {
        let turn = Vec3::X * 0.15;
        app.world_mut().get_mut::<Strand>(id).unwrap().pose([turn; 8]);
        strand(app, id).positions().to_vec()
    };
    let far =
        |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    // Bent by hand it springs back.
    let bent = bend(&mut app);
    assert!(far(&bent, &straight) > 0.05);
    app.world_mut().commands().entity(hair).queue(Hair::reset);
    app.update();
    assert!(far(strand(&app, id).positions(), &straight) < 1e-4, "back in shape at once");
    // Restyled it stays.
    bend(&mut app);
    app.world_mut().commands().entity(hair).queue(Hair::restyle);
    run(&mut app, 3.0);
    assert!(far(strand(&app, id).positions(), &bent) < 1e-3, "{:?}", strand(&app, id).positions());
}

/// A strip of scalp from one joint to another, and hair on it.
mod skinned {
    use super::*;
    use bevy::{
        asset::RenderAssetUsages,
        math::Affine3A,
        mesh::{
            Indices, Mesh, Mesh3d, PrimitiveTopology, VertexAttributeValues,
            skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
        },
    };
    use bevy_keratin::authoring::{attach::RootsOnMesh, plant::RootOnMesh};

    const ROWS: u32 = 9;

    /// Along Z from 0 to 0.2 m, moved by the first joint at 0 and by the second at the end.
    fn strip() -> Mesh {
        let z = |row: u32| 0.2 * row as f32 / (ROWS - 1) as f32;
        let rows = || (0..ROWS).flat_map(|row| [(row, -0.03_f32), (row, 0.03)]);
        let share = |row: u32| row as f32 / (ROWS - 1) as f32;
        let indices = (0..ROWS - 1).flat_map(|r| {
            let i = 2 * r;
            [i, i + 2, i + 1, i + 1, i + 2, i + 3]
        });
        Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(
                Mesh::ATTRIBUTE_POSITION,
                rows().map(|(row, x)| [x, 0.0, z(row)]).collect::<Vec<_>>(),
            )
            .with_inserted_attribute(
                Mesh::ATTRIBUTE_JOINT_INDEX,
                VertexAttributeValues::Uint16x4(rows().map(|_| [0, 1, 0, 0]).collect()),
            )
            .with_inserted_attribute(
                Mesh::ATTRIBUTE_JOINT_WEIGHT,
                rows().map(|(r, _)| [1.0 - share(r), share(r), 0.0, 0.0]).collect::<Vec<_>>(),
            )
            .with_inserted_indices(Indices::U32(indices.collect()))
    }

    fn roots() -> Vec<RootOnMesh> {
        let Some(Indices::U32(indices)) = strip().indices().cloned() else { unreachable!() };
        let corners = indices.as_chunks::<3>().0.iter();
        corners.map(|c| RootOnMesh { vertices: *c, weights: Vec3::new(0.5, 0.2, 0.3) }).collect()
    }

    /// Where a root is with these joints, by the definition of skinning.
    fn on_mesh(root: &RootOnMesh, joints: [Affine3A; 2]) -> Vec3 {
        let mesh = strip();
        let positions = mesh.attribute(Mesh::ATTRIBUTE_POSITION).unwrap().as_float3().unwrap();
        let corner = |v: u32| {
            let share = (v / 2) as f32 / (ROWS - 1) as f32;
            let at = Vec3::from_array(positions[v as usize]);
            joints[0].transform_point3(at) * (1.0 - share) + joints[1].transform_point3(at) * share
        };
        let [a, b, c] = root.vertices.map(corner);
        a * root.weights.x + b * root.weights.y + c * root.weights.z
    }

    #[test]
    fn roots_are_drawn_on_the_skinned_scalp_in_every_frame() {
        // Frames that fit no tick.
        let mut app = app_with_meshes(144.0);
        let world = app.world_mut();
        let size = 2.0;
        let body =
            world.spawn(Transform::from_xyz(3.0, 1.0, -2.0).with_scale(Vec3::splat(size))).id();
        let neck = world.spawn((Transform::default(), ChildOf(body))).id();
        let end = Transform::from_xyz(0.0, 0.0, 0.2);
        let head = world.spawn((end, ChildOf(neck))).id();
        let inverse = vec![Mat4::IDENTITY, end.to_matrix().inverse()];
        let inverse_bindposes =
            world.resource_mut::<Assets<_>>().add(SkinnedMeshInverseBindposes::from(inverse));
        let mesh = world.resource_mut::<Assets<Mesh>>().add(strip());
        let skin = SkinnedMesh { inverse_bindposes, joints: vec![neck, head] };
        let mesh = world.spawn((Mesh3d(mesh), skin, ChildOf(body))).id();
        let hair = world.spawn((Hair, ChildOf(neck))).id();
        let ids: Vec<Entity> = roots()
            .iter()
            .map(|root| {
                let at = on_mesh(root, [Affine3A::IDENTITY; 2]);
                let points: Vec<Vec3> = (0..8).map(|k| at + Vec3::Y * (0.02 * k as f32)).collect();
                world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
            })
            .collect();
        world.entity_mut(hair).insert(RootsOnMesh {
            mesh: Some(mesh),
            roots: roots(),
            ..default()
        });
        // The neck turns by up to 720 degrees a second, the head bends on it.
        app.add_systems(Update, move |time: Res<Time>, mut bones: Query<&mut Transform>| {
            let t = time.elapsed_secs();
            bones.get_mut(neck).unwrap().rotation = Quat::from_rotation_y(2.0 * (6.0 * t).sin());
            bones.get_mut(head).unwrap().rotation = Quat::from_rotation_x(0.8 * (5.0 * t).sin());
        });
        let (mut worst, mut moved) = (0.0_f32, 0.0_f32);
        for i in 0..400 {
            app.update();
            if i < 8 {
                continue;
            }
            let world = app.world();
            let place = |e: Entity| world.get::<GlobalTransform>(e).unwrap().affine();
            let joints = [place(neck), place(head) * end.compute_affine().inverse()];
            let overstep = world.resource::<Time<Fixed>>().overstep_fraction();
            for (id, root) in ids.iter().zip(&roots()) {
                let strand = world.get::<Strand>(*id).unwrap();
                let history = world.get::<StrandHistory>(*id).unwrap();
                let drawn = place(hair).transform_point3(history.drawn(strand, 0, overstep));
                let scalp = on_mesh(root, joints);
                worst = worst.max(drawn.distance(scalp));
                moved = moved.max(scalp.distance(on_mesh(root, [place(neck); 2])));
            }
        }
        println!("roots at most {} mm beside, bent by {} mm", worst * 1e3, moved * 1e3);
        assert!(moved > 0.02, "the scalp bends by {moved} m");
        assert!(worst < 1e-4, "a root was drawn {} mm beside its scalp", worst * 1e3);
        // Hair has the size of the body: lengths in its frame are the mesh's.
        let strand = app.world().get::<Strand>(ids[0]).unwrap();
        assert!((strand.length() - 0.14).abs() < 1e-3, "{}", strand.length());
        assert!(strand.is_finite() && strand.peak_strain() < 0.1, "{}", strand.peak_strain());
    }
}
