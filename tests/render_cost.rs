//! What hair costs to draw: draw calls, and for the record frames a second.

mod common;
#[path = "common/offscreen.rs"]
mod offscreen;

use bevy::{
    core_pipeline::{
        core_3d::AlphaMask3d,
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
use bevy_keratin::{prelude::*, render::HairBuffers};
use offscreen::{Offscreen, head_of_guides};

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

#[test]
fn a_hair_is_one_draw_call_in_every_view() {
    let Some(mut scene) = Offscreen::new(64, 64) else {
        return;
    };
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
    assert_eq!(scene.unready_pipelines(), Vec::<String>::new());
    for hair in hairs {
        let drawn = scene.app.world().get::<HairBuffers>(hair).unwrap().drawn;
        let camera = draws::<AlphaMask3d>(&scene, drawn);
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

#[test]
#[ignore = "a timing, to be read"]
fn frames_a_second() {
    for (width, height) in [(1280, 720), (1920, 1080)] {
        for count in [1500, 12_000] {
            let Some(mut scene) = Offscreen::new(width, height) else {
                return;
            };
            scene.look(Vec3::new(0.22, 0.08, 0.5), Vec3::new(0.0, -0.05, 0.0));
            let world = scene.app.world_mut();
            let hair = world.spawn((Hair, HairFollowers::new(count))).id();
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
            // A picture comes back with the second frame.
            let frame = start.elapsed() / (2 * FRAMES);
            let rate = 1.0 / frame.as_secs_f32();
            println!("{width}x{height}, {count} followers: {frame:?} a frame, {rate:.1} a second");
        }
    }
}
