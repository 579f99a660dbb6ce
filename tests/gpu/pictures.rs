//! Hair that is drawn from where it was simulated looks as it does when it is packed on the CPU.

use crate::{
    offscreen::{Offscreen, Picture},
    stage::{Stage, curls},
};
use bevy::{light::NotShadowCaster, prelude::*};
use bevy_keratin::{
    gpu::HairResidence,
    prelude::*,
    render::{HairBuffers, HairFollowers, HairView},
};

/// Pixels that differ by more than 2 of 255.
fn different(a: &Picture, b: &Picture) -> usize {
    let far = |(a, b): &([u8; 3], [u8; 3])| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 2);
    a.pixels().zip(b.pixels()).filter(far).count()
}

fn scene(on: SimulateOn) -> (Offscreen, Entity) {
    let mut scene = Offscreen::new(160, 160);
    Stage::furnish(&mut scene.app);
    scene.ticking(0);
    scene.look(Vec3::new(0.0, 0.1, 0.55), Vec3::new(0.0, 0.03, 0.0));
    let world = scene.app.world_mut();
    let light = DirectionalLight { illuminance: 8000.0, shadow_maps_enabled: true, ..default() };
    world.spawn((light, Transform::from_xyz(1.0, 2.0, 2.0).looking_at(Vec3::ZERO, Vec3::Y)));
    // What hair casts its shadow on.
    let floor = world.resource_mut::<Assets<Mesh>>().add(Plane3d::new(Vec3::Y, Vec2::splat(0.4)));
    let grey = StandardMaterial { perceptual_roughness: 1.0, ..Color::srgb(0.5, 0.5, 0.5).into() };
    let grey = world.resource_mut::<Assets<StandardMaterial>>().add(grey);
    world.spawn((Mesh3d(floor), MeshMaterial3d(grey), Transform::from_xyz(0.0, -0.11, 0.0)));
    let hair = Stage::spawn(&mut scene.app, on, curls(60, 9));
    scene.app.world_mut().entity_mut(hair).insert(HairFollowers::new(600));
    (scene, hair)
}

pub fn pictures_of_hair_on_the_device_and_at_home_are_the_same() {
    let (mut scene, hair) = scene(SimulateOn::Gpu);
    scene.app.world_mut().write_message(HairTreatment::wet(hair).joints(4..8));
    scene.ticking(1);
    for _ in 0..60 {
        scene.app.update();
    }
    let at = |scene: &Offscreen| *scene.app.world().get::<HairResidence>(hair).unwrap();
    assert_eq!(at(&scene), HairResidence::Gpu);
    scene.ticking(0);
    let views = [HairView::Natural, HairView::Bond(BondKind::Hydrogen), HairView::Strain];
    let mut pictures = Vec::new();
    for view in views {
        scene.app.insert_resource(HairDefault(view));
        pictures.push(scene.draw());
    }
    // The same moment, on the CPU.
    assert!(Hairdo::default().apply(scene.app.world_mut(), hair).is_err());
    assert!(matches!(at(&scene), HairResidence::Cpu(_)));
    for (view, there) in views.into_iter().zip(pictures) {
        scene.app.insert_resource(HairDefault(view));
        let home = scene.draw();
        let covered = home.covered([0; 3]);
        let off = different(&there, &home);
        println!("{view:?}: {covered} pixels of hair and floor, {off} differ");
        assert!(covered > 1000 && off <= home.rgba.len() / 4 / 100, "{off}");
    }
    // There were shadows in them.
    scene.app.insert_resource(HairDefault(HairView::Natural));
    let drawn = scene.app.world().get::<HairBuffers>(hair).unwrap().drawn;
    let shadowed = scene.draw();
    scene.app.world_mut().entity_mut(drawn).insert(NotShadowCaster);
    let shadows = different(&shadowed, &scene.draw());
    println!("{shadows} pixels of shadow");
    assert!(shadows > 300, "{shadows}");
    // And it is where it has come to, not where it was handed over.
    let grown = curls(60, 9);
    let members: Vec<Entity> = scene.app.world().get::<Strands>(hair).unwrap().iter().collect();
    let tip = |strand: &Strand| *strand.positions().last().unwrap();
    let moved = members.iter().zip(&grown).filter(|(e, grown)| {
        tip(scene.app.world().get::<Strand>(**e).unwrap()).distance(tip(grown)) > 0.01
    });
    assert!(moved.count() > 20);
}

/// Bevy quits when the device is lost, unless the app says how to go on.
pub fn hair_goes_on_from_its_checkpoint_when_the_device_is_lost() {
    use bevy::render::{
        error_handler::{RenderErrorHandler, RenderErrorPolicy},
        render_resource::PollType,
        renderer::RenderDevice,
        settings::WgpuSettings,
    };
    let mut stage = Stage::new(SimulateOn::Gpu, curls(6, 6));
    stage.compile();
    stage.app.world_mut().resource_mut::<HairGpu>().checkpoint = 0.1;
    stage.run(60);
    assert!(stage.is_on_gpu());
    stage.app.insert_resource(RenderErrorHandler(|error, _, _| {
        println!("{:?}: {}", error.ty, error.description);
        RenderErrorPolicy::Recover(WgpuSettings::default().into())
    }));
    let tip = |strands: &[Strand]| *strands[2].positions().last().unwrap();
    let before = tip(&stage.strands());
    let device = stage.app.world().resource::<RenderDevice>().clone();
    device.wgpu_device().destroy();
    let start = std::time::Instant::now();
    while stage.is_on_gpu() {
        assert!(start.elapsed().as_secs() < 120, "it was never brought home");
        let _ = device.poll(PollType::Poll);
        stage.run(1);
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    println!("{:?}", stage.residence());
    let after = stage.strands();
    assert!(after.iter().all(Strand::is_finite));
    assert!(tip(&after).distance(before) < 0.02, "{} and {before}", tip(&after));
    // And there again, on the other device.
    for _ in 0..2000 {
        stage.run(1);
        if stage.is_on_gpu() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    stage.run(5);
    assert!(stage.is_on_gpu(), "{:?}", stage.residence());
    assert!(stage.strands().iter().all(Strand::is_finite));
}

pub fn kernels_that_cannot_be_compiled_leave_hair_at_home() {
    use bevy::shader::Shader;
    let mut stage = Stage::new(SimulateOn::Gpu, curls(3, 6));
    let mut shaders = stage.app.world_mut().resource_mut::<Assets<Shader>>();
    let own = shaders.iter().find(|(_, shader)| shader.path.contains("gpu/substep")).unwrap().0;
    let path = "bevy_keratin/gpu/substep.wgsl";
    shaders.insert(own, Shader::from_wgsl("fn substep() -> nothing {}", path)).unwrap();
    stage.run(30);
    assert_eq!(stage.residence(), HairResidence::Cpu(bevy_keratin::gpu::WhyCpu::Broken));
    let members = stage.members();
    let strand = stage.app.world().get::<Strand>(members[0]).unwrap();
    assert!(strand.positions()[3].distance(curls(3, 6)[0].positions()[3]) > 1e-4, "and moves");
}
