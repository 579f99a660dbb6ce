//! What hair costs to draw: draw calls, and for the record frames a second.

use crate::offscreen::{Offscreen, head_of_guides};
use bevy::{
    core_pipeline::{
        core_3d::{AlphaMask3d, Opaque3d},
        prepass::{AlphaMask3dPrepass, DepthPrepass, MotionVectorPrepass, NormalPrepass},
    },
    light::CascadeShadowConfigBuilder,
    pbr::Shadow,
    prelude::*,
    render::{
        RenderApp,
        render_phase::{BinnedPhaseItem, ViewBinnedRenderPhases},
        sync_world::MainEntity,
        view::NoIndirectDrawing,
    },
};
use bevy_keratin::{
    prelude::*,
    render::{HairBuffers, HairPhase},
};

/// In how many draw calls of how many views an entity takes part.
fn draws<I: BinnedPhaseItem>(scene: &Offscreen, drawn: Entity) -> (usize, usize) {
    let render = scene.app.sub_app(RenderApp).world();
    let drawn = MainEntity::from(drawn);
    let phases = render.resource::<ViewBinnedRenderPhases<I>>();
    let calls = phases.values().map(|phase| {
        // Without indirect drawing each bin is one call.
        let bins = phase.batchable_meshes.values().filter(|b| b.entities().contains_key(&drawn));
        let alone = phase.unbatchable_meshes.values();
        bins.count() + alone.filter(|b| b.entities.contains_key(&drawn)).count()
    });
    let calls: Vec<usize> = calls.filter(|calls| *calls > 0).collect();
    (calls.iter().sum(), calls.len())
}

pub fn a_hair_is_one_draw_call_in_every_view_and_one_of_depth_before_it_in_pictures() {
    let mut scene = Offscreen::new(64, 64);
    scene.look(Vec3::new(0.3, 0.1, 0.8), Vec3::ZERO);
    let camera = scene.camera;
    let world = scene.app.world_mut();
    let prepasses = (DepthPrepass, NormalPrepass, MotionVectorPrepass);
    world.entity_mut(camera).insert((NoIndirectDrawing, prepasses));
    let mut hairs = Vec::new();
    for k in 0..2 {
        let parts = (HairFollowers::new(2000), Transform::from_xyz(0.2 * k as f32, 0.0, 0.0));
        let hair = world.spawn((Hair, parts)).id();
        for points in head_of_guides(40, 0.09, 0.2, 9) {
            world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
        }
        hairs.push(hair);
    }
    let at = Transform::from_xyz(0.5, 0.6, 0.7).looking_at(Vec3::ZERO, Vec3::Y);
    let cascades =
        CascadeShadowConfigBuilder { num_cascades: 2, maximum_distance: 3.0, ..default() };
    let sun = DirectionalLight { shadow_maps_enabled: true, ..default() };
    world.spawn((sun, cascades.build(), at));
    world.spawn((SpotLight { shadow_maps_enabled: true, ..default() }, at));
    scene.draw();
    // The frame in which the picture came back has drawn nothing.
    scene.app.update();
    assert_eq!(scene.unready_pipelines(), Vec::<String>::new());
    for hair in hairs {
        let world = scene.app.world();
        let drawn = world.get::<HairBuffers>(hair).unwrap().drawn;
        let depth = world.get::<Children>(drawn).unwrap()[0];
        // What is seen is found out first, then lit.
        assert_eq!(draws::<HairPhase<false>>(&scene, depth), (1, 1));
        assert_eq!(draws::<Opaque3d>(&scene, depth), (0, 0), "in a pass of their own");
        assert_eq!(draws::<AlphaMask3d>(&scene, drawn), (0, 0));
        assert_eq!(draws::<Shadow>(&scene, depth), (0, 0));
        let camera = draws::<HairPhase<true>>(&scene, drawn);
        let prepass = draws::<AlphaMask3dPrepass>(&scene, drawn);
        let (shadow, views) = draws::<Shadow>(&scene, drawn);
        println!(
            "2040 strands: {camera:?} camera, {prepass:?} prepass, {shadow} in {views} shadows"
        );
        assert_eq!(camera, (1, 1));
        assert_eq!(prepass, (1, 1), "the prepasses are one pass");
        assert_eq!(shadow, views, "one for each shadow map");
        assert!((2..=3).contains(&views), "two cascades, of which one may be empty, and a spot");
    }
}

pub fn frames_a_second() {
    for (width, height) in [(1280, 720), (1920, 1080)] {
        for (count, share) in [(1500, 1.0), (12_000, 1.0), (12_000, 0.5), (12_000, 0.25)] {
            let mut scene = Offscreen::new(width, height);
            scene.look(Vec3::new(0.22, 0.08, 0.5), Vec3::new(0.0, -0.05, 0.0));
            let world = scene.app.world_mut();
            let detail = HairDetail { strands: share, ..default() };
            let hair = world.spawn((Hair, HairFollowers::new(count), detail)).id();
            for points in head_of_guides(220, 0.09, 0.26, 16) {
                world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
            }
            let at = Transform::from_xyz(0.5, 0.6, 0.7).looking_at(Vec3::ZERO, Vec3::Y);
            world.spawn((SpotLight { shadow_maps_enabled: true, ..default() }, at));
            scene.draw();
            let start = std::time::Instant::now();
            const FRAMES: u32 = 2;
            for _ in 0..FRAMES {
                scene.draw_now();
            }
            let frame = start.elapsed() / FRAMES;
            let rate = 1.0 / frame.as_secs_f32();
            println!(
                "{width}x{height}, {share} of {count} followers: {frame:?}, {rate:.1} a second"
            );
        }
    }
}

/// Far heads draw few strands, from meshes that all share.
pub fn a_hundred_heads_share_a_mesh_of_few_strands() {
    let mut scene = Offscreen::new(128, 96);
    scene.look(Vec3::new(0.0, 2.0, 9.0), Vec3::ZERO);
    let guides = head_of_guides(20, 0.09, 0.2, 5);
    let world = scene.app.world_mut();
    let look = HairLook { width: 0.2e-3, ..default() };
    let view = HairView::Bond(BondKind::Hydrogen);
    let mut hairs = Vec::new();
    for k in 0..100 {
        let place = Transform::from_xyz((k % 10) as f32 - 4.5, 0.0, -0.8 * (k / 10) as f32);
        let hair = world.spawn((Hair, look.clone(), HairFollowers::new(10_000), view, place)).id();
        for points in &guides {
            world.spawn((StrandOf(hair), Strand::from_polyline(points).unwrap()));
        }
        hairs.push(hair);
    }
    let start = std::time::Instant::now();
    let picture = scene.draw_once();
    println!("{:?} until the picture is there", start.elapsed());
    if let Ok(folder) = std::env::var("REFERENCE") {
        picture.save(&format!("{folder}/crowd.png"));
    }
    let mut used = std::collections::BTreeSet::new();
    let mut triangles = 0;
    for hair in &hairs {
        let drawn = scene.app.world().get::<HairBuffers>(*hair).unwrap().drawn;
        let mesh = scene.app.world().get::<Mesh3d>(drawn).unwrap().0.clone();
        let meshes = scene.app.world().resource::<Assets<Mesh>>();
        triangles += meshes.get(&mesh).unwrap().indices().unwrap().len() / 3;
        used.insert(mesh.id());
    }
    let all = 100 * (10_000 + guides.len()) * 16 * 2;
    println!("{triangles} triangles of {all}, {} meshes", used.len());
    assert!(triangles < all / 6 && used.len() <= 3);
    let lit = picture.pixels().filter(|p| p[0] > 12).count();
    println!("{lit} pixels show hair");
    assert!(lit > 300, "{lit}");
}

/// A head that fills the picture: what each stage costs, and what the quality switches save.
pub fn what_each_stage_costs() {
    let mut scene = Offscreen::new(480, 360);
    scene.look(Vec3::new(0.22, 0.08, 0.5), Vec3::new(0.0, -0.05, 0.0));
    let camera = scene.camera;
    let world = scene.app.world_mut();
    let look = HairLook { width: 0.15e-3, ..default() };
    let hair = world.spawn((Hair, HairFollowers::new(20_000), look.clone())).id();
    for points in head_of_guides(220, 0.09, 0.26, 16) {
        world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    let at = Transform::from_xyz(0.5, 0.6, 0.7).looking_at(Vec3::ZERO, Vec3::Y);
    let cascades =
        CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 1.5, ..default() };
    let sun = DirectionalLight { shadow_maps_enabled: true, ..default() };
    let sun = world.spawn((sun, cascades.build(), at)).id();
    let unlit = HairView::Bond(BondKind::Hydrogen);
    let kajiya = HairLook { shading: HairShading::KajiyaKay, ..look.clone() };
    let share = |strands| HairDetail { strands, ..default() };
    let rows = [
        ("all", look.clone(), HairView::Natural, share(1.0), true, false),
        ("with a depth prepass", look.clone(), HairView::Natural, share(1.0), true, true),
        ("without shadow maps", look.clone(), HairView::Natural, share(1.0), false, false),
        ("unlit, without shadow maps", look.clone(), unlit, share(1.0), false, false),
        ("Kajiya-Kay", kajiya, HairView::Natural, share(1.0), true, false),
        ("half the strands", look.clone(), HairView::Natural, share(0.5), true, false),
        ("a quarter", look.clone(), HairView::Natural, share(0.25), true, false),
        ("a quarter and prepass", look.clone(), HairView::Natural, share(0.25), true, true),
        ("a tenth", look, HairView::Natural, share(0.1), true, false),
    ];
    for (what, look, view, detail, shadows, prepass) in rows {
        let world = scene.app.world_mut();
        world.entity_mut(hair).insert((look, view, detail));
        world.get_mut::<DirectionalLight>(sun).unwrap().shadow_maps_enabled = shadows;
        match prepass {
            true => world.entity_mut(camera).insert(DepthPrepass),
            false => world.entity_mut(camera).remove::<DepthPrepass>(),
        };
        let picture = scene.draw();
        if let Ok(folder) = std::env::var("REFERENCE") {
            picture.save(&format!("{folder}/{what}.png"));
        }
        let frame = || {
            let start = std::time::Instant::now();
            scene.app.update();
            start.elapsed()
        };
        let least = core::iter::repeat_with(frame).take(4).min().unwrap();
        println!("{what}: {least:?} a frame");
    }
}
