//! Nodes that something else moves: roots on a mesh, held nodes, strands on rods.

use crate::{
    residence::{grow, on_gpu},
    stage::{Stage, apart, curls},
};
use bevy::{
    asset::RenderAssetUsages,
    mesh::{Mesh, Mesh3d, PrimitiveTopology},
    prelude::*,
};
use bevy_keratin::{
    authoring::{attach::RootsOnMesh, plant::RootOnMesh},
    gpu::{HairResidence, Unsupported, WhyCpu},
    keratin::treatment::WindingProgress,
    prelude::*,
};

/// A triangle below all hair that roots are tied to.
pub fn scalp(stage: &mut Stage) -> Entity {
    let corners = vec![[0.0f32, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, -0.1]];
    let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners);
    let handle = stage.app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
    stage.app.world_mut().spawn((Mesh3d(handle), Transform::default())).id()
}

pub fn tied(mesh: Entity, strands: usize) -> RootsOnMesh {
    let root = RootOnMesh { vertices: [0, 1, 2], weights: Vec3::new(0.2, 0.4, 0.4) };
    RootsOnMesh { mesh: Some(mesh), roots: vec![root; strands], ..default() }
}

/// The scalp turns and goes about below hair that stays where it is.
pub fn moved(stage: &mut Stage, mesh: Entity, tick: usize) {
    let t = tick as f32 / 60.0;
    let turn = Quat::from_rotation_y(0.5 * (5.0 * t).sin()) * Quat::from_rotation_x(0.3 * t);
    let place = Vec3::new(0.02 * (9.0 * t).sin(), 0.01 * t, 0.0);
    let moved = Transform::from_rotation(turn).with_translation(place);
    stage.app.world_mut().entity_mut(mesh).insert(moved);
    stage.run(1);
}

pub fn roots_on_a_mesh_go_with_it_there(stage: &mut Stage) {
    let mesh = scalp(stage);
    let mut both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow(stage, SimulateOn::Cpu, curls(40, 7));
        stage.app.world_mut().entity_mut(mesh).insert(Transform::default());
        let hair = stage.hair;
        stage.app.world_mut().entity_mut(hair).insert(tied(mesh, 40));
        (0..5).for_each(|tick| moved(stage, mesh, tick));
        let before = stage.strands();
        stage.app.world_mut().entity_mut(hair).insert(on);
        (5..30).for_each(|tick| moved(stage, mesh, tick));
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
        let there = stage.strands();
        // And on the CPU on, from where it has come to.
        stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Cpu);
        (30..40).for_each(|tick| moved(stage, mesh, tick));
        assert!(!stage.is_on_gpu());
        (before, there, stage.strands())
    });
    let [cpu, gpu] = &mut both;
    let root =
        |strands: &[Strand]| -> Vec<Vec3> { strands.iter().map(|s| s.positions()[0]).collect() };
    let went =
        root(&cpu.0).iter().zip(root(&cpu.1)).map(|(a, b)| a.distance(b)).fold(0.0, f32::max);
    let off = root(&gpu.1).iter().zip(root(&cpu.1)).map(|(a, b)| a.distance(b)).fold(0.0, f32::max);
    println!("roots went {went} m, off by {off} m; nodes off by {} m", apart(&gpu.1, &cpu.1));
    assert!(went > 0.02 && off < 1e-6, "{off} m of {went} m");
    assert!(apart(&gpu.1, &cpu.1) < 1e-3 && apart(&gpu.2, &cpu.2) < 2e-3);
    // Tied anew, to roots elsewhere: on the CPU, and back.
    stage.app.world_mut().entity_mut(stage.hair).insert(SimulateOn::Gpu);
    stage.run(70);
    assert!(stage.is_on_gpu());
    let hair = stage.hair;
    stage.app.world_mut().entity_mut(hair).insert(tied(mesh, 40));
    stage.run(1);
    let why = WhyCpu::Unsupported(Unsupported::MovingRoots);
    assert_eq!(stage.residence(), HairResidence::Cpu(why));
    assert!(stage.faults().is_empty());
    stage.app.world_mut().despawn(mesh);
}

pub fn held_nodes_move_there_and_are_released(stage: &mut Stage) {
    let mut both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow(stage, on, curls(40, 7));
        stage.run(3);
        let held: Vec<Entity> = stage.members().into_iter().step_by(3).collect();
        let started = stage.strands();
        for tick in 0..24 {
            let t = tick as f32 / 60.0;
            for (i, strand) in held.iter().enumerate() {
                let at = |node: usize| started[3 * i].positions()[node];
                let by = Vec3::new(0.05 * t, 0.03 * (8.0 * t).sin(), 0.0);
                // The middle is pulled about, a tip beyond its reach.
                let mut targets = vec![None; 4];
                targets[3] = Some(at(3) + by);
                if i % 2 == 0 {
                    targets.extend([None, Some(at(5) + Vec3::X)]);
                }
                stage
                    .app
                    .world_mut()
                    .entity_mut(*strand)
                    .insert(HeldNodes { targets, ..default() });
            }
            stage.run(1);
        }
        let there = stage.strands();
        // Half of them are let go, some by an empty list.
        for (i, strand) in held.iter().enumerate() {
            let mut strand = stage.app.world_mut().entity_mut(*strand);
            match i % 3 {
                0 => _ = strand.remove::<HeldNodes>(),
                1 => strand.get_mut::<HeldNodes>().unwrap().targets.clear(),
                _ => {}
            }
        }
        stage.run(12);
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
        (started, there, stage.strands())
    });
    let [cpu, gpu] = &mut both;
    let of = |strands: &[Strand]| {
        strands.iter().step_by(3).map(|s| s.positions()[3]).collect::<Vec<_>>()
    };
    let far = |a: &[Strand], b: &[Strand]| {
        of(a).iter().zip(of(b)).map(|(a, b)| a.distance(b)).fold(0.0, f32::max)
    };
    println!(
        "moved by {}; off by {}, and {}",
        far(&cpu.0, &cpu.1),
        apart(&gpu.1, &cpu.1),
        apart(&gpu.2, &cpu.2)
    );
    assert!(far(&cpu.0, &cpu.1) > 0.015);
    assert!(far(&cpu.1, &gpu.1) < 1e-6, "held where the CPU holds them");
    assert!(apart(&gpu.1, &cpu.1) < 1e-3 && apart(&gpu.2, &cpu.2) < 2e-3);
    assert!(far(&gpu.1, &gpu.2) > 5e-3, "let go");
    // A held root is the CPU's.
    let strand = stage.members()[0];
    let root = HeldNodes { targets: vec![Some(Vec3::Y * 0.09)], ..default() };
    stage.app.world_mut().entity_mut(strand).insert(root);
    stage.run(1);
    let why = WhyCpu::Unsupported(Unsupported::HeldNodes);
    assert_eq!(stage.residence(), HairResidence::Cpu(why));
}

pub fn held_nodes_that_have_to_give_way_do_so_on_the_cpu(stage: &mut Stage) {
    let head = stage.app.world_mut().spawn(HairCollider::sphere(0.08).unwrap()).id();
    on_gpu(stage, 6, 7);
    let (strand, began) = (stage.members()[0], stage.strands().remove(0));
    let (tip, from) = (began.edges(), began.positions()[began.edges()]);
    let (mut there, mut reports, mut strains) = (0, 0, [0.0f32; 2]);
    for tick in 1..=120 {
        // Led into the head.
        let mut targets = vec![None; tip];
        targets.push(Some(from * (1.0 - 0.8 * (tick as f32 / 60.0).min(1.0))));
        stage.app.world_mut().entity_mut(strand).insert(HeldNodes { targets, ..default() });
        stage.run(1);
        reports += stage.faults().iter().filter(|fault| fault.entity == Some(strand)).count();
        if stage.is_on_gpu() {
            there = tick;
            continue;
        }
        let now = stage.app.world().get::<Strand>(strand).unwrap().peak_strain();
        let is_home = usize::from(tick > there + 2);
        strains[is_home] = strains[is_home].max(now);
    }
    println!("there for {there} ticks, comes home strained by {strains:?}");
    let why = WhyCpu::Unsupported(Unsupported::HeldNodes);
    assert_eq!(stage.residence(), HairResidence::Cpu(why));
    assert!((5..60).contains(&there) && strains[0] < 0.3 && strains[1] < 0.05, "{strains:?}");
    assert_eq!(reports, 1, "a target out of reach is told once");
    // Free again it goes back.
    stage.app.world_mut().entity_mut(strand).remove::<HeldNodes>();
    stage.run(90);
    assert!(stage.is_on_gpu(), "{:?}", stage.residence());
    stage.app.world_mut().despawn(head);
}

pub fn strands_are_wound_there_and_keep_their_curl(stage: &mut Stage) {
    let wound = |stage: &mut Stage| {
        let at = Transform::from_xyz(0.0, 0.25, 0.0)
            .with_rotation(Quat::from_rotation_x(core::f32::consts::FRAC_PI_2));
        let rod = stage.app.world_mut().spawn((PermRod::new(0.02, 0.2).unwrap(), at)).id();
        for strand in stage.members() {
            let winding = PermWinding { from_node: 2, pitch: 0.0, seconds: 0.3 };
            stage.app.world_mut().entity_mut(strand).insert((WoundOn(rod), winding));
        }
        rod
    };
    // While the tick waits for the device, winding begins there.
    on_gpu(stage, 6, 5);
    let there = stage.strands();
    let rod = wound(stage);
    stage.run(24);
    assert!(stage.is_on_gpu(), "{:?}", stage.residence());
    let members = stage.members();
    let progress = |stage: &Stage, strand: &Entity| {
        stage.app.world().get::<WindingProgress>(*strand).map(WindingProgress::progress)
    };
    assert!(members.iter().all(|strand| progress(stage, strand) == Some(1.0)));
    let hair = stage.hair;
    stage.app.world_mut().write_message(HairTreatment::set_everything(hair));
    let curled = stage.strands();
    assert!(apart(&there, &curled) > 0.03);
    assert!(curled.iter().all(|strand| strand.peak_strain() < 0.02));
    stage.run(2);
    stage.app.world_mut().despawn(rod);
    stage.run(1);
    assert!(stage.is_on_gpu());
    // Bonds that have closed on the rod keep its curl.
    let bonds = stage.bonds();
    for (strand, bonds) in curled.iter().zip(&bonds) {
        let held = strand.darboux(4).xyz();
        assert!(bonds.joints[4].rates == [1.0; 4] && held.length() > 0.2, "{held}");
    }
    // Otherwise it returns to the CPU, which winds it from where it is.
    on_gpu(stage, 6, 5);
    stage.app.world_mut().resource_mut::<HairGpu>().blocking = false;
    let rod = wound(stage);
    stage.run(1);
    let why = WhyCpu::Unsupported(Unsupported::Winding);
    assert_eq!(stage.residence(), HairResidence::Returning(why));
    stage.run(90);
    assert!(stage.is_on_gpu(), "{:?}", stage.residence());
    let members = stage.members();
    assert!(members.iter().all(|strand| progress(stage, strand) == Some(1.0)));
    stage.app.world_mut().despawn(rod);
    stage.run(1);
}
