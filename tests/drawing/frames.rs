//! What is drawn, looked at by a camera without a window. Skipped, with the reason printed, where
//! nothing can draw.

use crate::offscreen::{Offscreen, Picture, luma};
use bevy::{light::CascadeShadowConfigBuilder, prelude::*};
use bevy_keratin::{
    prelude::*,
    render::{curve::Guide, *},
};

const BLACK: [u8; 3] = [0; 3];

/// Hair of the given guides in the scene.
fn hair(scene: &mut Offscreen, guides: &[Vec<Vec3>], parts: impl Bundle) -> Entity {
    let world = scene.app.world_mut();
    let hair = world.spawn((Hair, parts)).id();
    for points in guides {
        let strand = Strand::from_polyline(points).unwrap();
        let bonds = Bonds::of(&strand);
        world.spawn((StrandOf(hair), strand, bonds));
    }
    hair
}

fn set(scene: &mut Offscreen, hair: Entity, parts: impl Bundle) {
    scene.app.world_mut().entity_mut(hair).insert(parts);
}

fn strands_of(scene: &Offscreen, hair: Entity) -> Vec<Entity> {
    let strands = scene.app.world().get::<Strands>(hair);
    strands.map_or(Vec::new(), |s| s.iter().collect())
}

/// A curtain of hanging guides in the plane z = 0, 0.2 m wide, around the origin.
fn curtain(count: usize, length: f32) -> Vec<Vec<Vec3>> {
    let node = |x: f32, i: usize| Vec3::new(x, length * (0.5 - i as f32 / 8.0), 0.0);
    (0..count)
        .map(|k| 0.2 * (k as f32 / (count - 1).max(1) as f32 - 0.5))
        .map(|x| (0..9).map(|i| node(x, i)).collect())
        .collect()
}

fn wide(width: f32) -> HairLook {
    HairLook { width, taper: 1.0, ..default() }
}

fn sun(scene: &mut Offscreen, from: Vec3, shadows: bool) -> Entity {
    let cascades =
        CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 3.0, ..default() };
    let light = DirectionalLight { illuminance: 8000.0, shadow_maps_enabled: shadows, ..default() };
    let place = Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::X);
    let world = scene.app.world_mut();
    world.spawn((light, cascades.build(), place)).id()
}

pub fn hair_is_where_the_guides_are_and_shows_their_rates() {
    let mut scene = Offscreen::new(200, 200);
    scene.look(Vec3::new(0.1, 0.1, 0.7), Vec3::ZERO);
    let wave = |x: f32, i: usize| {
        let s = i as f32 / 11.0;
        Vec3::new(x + 0.03 * (7.0 * s).sin(), 0.2 - 0.4 * s, 0.02 * (5.0 * s + x * 20.0).cos())
    };
    let guides: Vec<Vec<Vec3>> =
        (0..12).map(|k| (0..12).map(|i| wave(-0.2 + 0.036 * k as f32, i)).collect()).collect();
    let view = HairView::Bond(BondKind::Disulfide);
    let parts = (wide(8e-3), HairFollowers::none(), view);
    let hair = hair(&mut scene, &guides, parts);
    // A head that is turned and moved carries its hair along in the same frame.
    let place = Transform::from_xyz(0.02, -0.03, 0.05).with_rotation(Quat::from_rotation_y(0.4));
    set(&mut scene, hair, place);
    for (k, strand) in strands_of(&scene, hair).into_iter().enumerate() {
        let mut bonds = scene.app.world_mut().get_mut::<Bonds>(strand).unwrap();
        let rate = k as f32 / 11.0;
        bonds.joints.iter_mut().for_each(|j| j.rates = [1.0, 0.5, rate, 1.0]);
    }
    let picture = scene.draw();
    let (mut samples, mut hit, mut right) = (0, 0, 0);
    for (k, nodes) in guides.iter().enumerate() {
        let expected = heat(k as f32 / 11.0).to_srgba().to_u8_array();
        for i in 1..40 {
            let point = Guide::new(nodes).point(i as f32 / 40.0).position;
            let at = scene.project(place.transform_point(point)).unwrap();
            let pixel = picture.at(at.x as u32, at.y as u32);
            samples += 1;
            hit += u32::from(pixel != BLACK);
            right += u32::from((0..3).all(|c| pixel[c].abs_diff(expected[c]) <= 4));
        }
    }
    println!("{hit} hit and {right} of the right colour of {samples}");
    assert!(hit as f32 >= 0.95 * samples as f32, "{hit} of {samples} are covered");
    // Where guides cross, another's colour is in front.
    assert!(right as f32 >= 0.8 * samples as f32, "{right} of {samples} show their rate");
}

/// Two pictures of the same hair: hardly a channel differs by more than rounding. How many pixels it covers.
fn agree(one: &Picture, other: &Picture) -> usize {
    let pairs = one.rgba.iter().zip(&other.rgba);
    let differ = pairs.filter(|(a, b)| a.abs_diff(**b) > 2).count();
    let covered = one.covered(BLACK);
    println!("{differ} channels of {covered} pixels differ");
    assert!(differ * 1000 < 3 * covered, "{differ} channels of {covered} pixels");
    covered
}

pub fn rings_of_a_frame_draw_what_each_vertex_would_compute() {
    let mut scene = Offscreen::new(160, 160);
    // A sample that differs would spread.
    scene.leave_grain();
    scene.look(Vec3::new(0.1, 0.1, 0.6), Vec3::ZERO);
    sun(&mut scene, Vec3::new(0.3, 0.5, 1.0), true);
    let parts = (wide(1e-3), HairFollowers::new(400));
    let hair = hair(&mut scene, &curtain(12, 0.3), parts);
    for strand in strands_of(&scene, hair) {
        scene.app.world_mut().entity_mut(strand).insert(WetLook(vec![0.5; 9]));
    }
    let of_rings = scene.draw();
    // A game may take them away; a device that cannot compute them has none.
    let mut buffers = scene.app.world_mut().get_mut::<HairBuffers>(hair).unwrap();
    assert!(buffers.rings.take().is_some(), "this device can");
    let of_vertices = scene.draw();
    let covered = agree(&of_rings, &of_vertices);
    assert!(covered > 2000 && of_rings != of_vertices, "they must come by different ways");

    // Fewer rings, a second hair with numbers of its own, and far away another level's.
    set(&mut scene, hair, HairFollowers { segments: 7, ..HairFollowers::new(3000) });
    let red = HairLook { melanin: Melanin::RED, ..wide(1e-3) };
    let place = Transform::from_xyz(0.0, 0.0, -0.2);
    let other = self::hair(&mut scene, &curtain(5, 0.4), (red, HairFollowers::new(2000), place));
    for away in [1.0, 8.0] {
        scene.look(Vec3::new(0.1, 0.1, 0.6) * away, Vec3::ZERO);
        let of_rings = scene.draw();
        let taken = [hair, other].map(|hair| {
            let mut buffers = scene.app.world_mut().get_mut::<HairBuffers>(hair).unwrap();
            buffers.rings.take().is_some()
        });
        let of_vertices = scene.draw();
        let covered = agree(&of_rings, &of_vertices);
        // What has been taken stays so at the same level.
        assert!(taken[0] && covered > 50, "{covered} pixels {away} times as far, {taken:?}");
    }
}

pub fn followers_cover_more_frames_repeat_and_wet_is_darker() {
    let mut scene = Offscreen::with_hair_first(160, 160);
    scene.leave_grain();
    scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
    sun(&mut scene, Vec3::new(0.3, 0.5, 1.0), false);
    let hair = hair(&mut scene, &curtain(12, 0.3), wide(0.5e-3));
    let mut covered = Vec::new();
    for count in [0, 150, 600] {
        set(&mut scene, hair, HairFollowers::new(count));
        covered.push(scene.draw().covered(BLACK));
    }
    println!("covered pixels with 0, 150 and 600 followers: {covered:?}");
    assert!(covered[1] as f32 > 1.5 * covered[0] as f32);
    assert!(covered[2] as f32 > 1.2 * covered[1] as f32);

    let dry = scene.draw_now();
    assert!(dry == scene.draw_now(), "two frames of the same differ");
    for strand in strands_of(&scene, hair) {
        let wet = WetLook(vec![1.0; 9]);
        scene.app.world_mut().entity_mut(strand).insert(wet);
    }
    let wet = scene.draw();
    println!("mean luma dry {} wet {}", dry.mean_luma(), wet.mean_luma());
    assert!(wet.mean_luma() < 0.9 * dry.mean_luma());
    set(&mut scene, hair, HairView::Moisture);
    let red = scene.draw().pixels().filter(|p| p[0] > 240 && p[2] < 20).count();
    assert!(red > 500, "{red} pixels show soaked hair");
}

/// The brightness of each row.
fn rows(picture: &Picture) -> Vec<f32> {
    let row = |y| (0..picture.width).map(move |x| luma(picture.at(x, y))).sum();
    (0..picture.height).map(row).collect()
}

pub fn the_highlight_lies_across_and_moves_with_the_light() {
    let mut scene = Offscreen::new(120, 160);
    scene.look(Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO);
    for shading in [HairShading::Fibre, HairShading::KajiyaKay] {
        let look = HairLook {
            melanin: Melanin::BLACK,
            variation: 0.0,
            roughness: 0.25,
            shading,
            ..wide(1e-3)
        };
        let hair = hair(&mut scene, &curtain(12, 0.4), (look, HairFollowers::new(300)));
        let mut peaks = Vec::new();
        for height in [0.25, -0.25] {
            let light = sun(&mut scene, Vec3::new(0.0, height, 1.0), false);
            let rows = rows(&scene.draw());
            // Middle rows only: the curtain's ends are ragged.
            let middle = 15..145;
            let sum: f32 = middle.clone().map(|y| rows[y]).sum();
            let centre = middle.clone().map(|y| y as f32 * rows[y]).sum::<f32>() / sum;
            let brightest = middle.clone().map(|y| rows[y]).fold(0.0, f32::max);
            let mean = sum / middle.len() as f32;
            println!("{shading:?}, light at {height}: centre {centre}, peak {}", brightest / mean);
            assert!(brightest > 1.2 * mean, "no band across the strands");
            peaks.push(centre);
            scene.app.world_mut().despawn(light);
        }
        // The image's rows run downward: light from above shines on upper hair.
        assert!(peaks[0] + 8.0 < peaks[1], "{peaks:?}");
        scene.app.world_mut().despawn(hair);
    }
}

pub fn hair_receives_and_casts_shadow() {
    let mut scene = Offscreen::new(160, 120);
    let world = scene.app.world_mut();
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Rectangle::new(3.0, 3.0));
    let white = StandardMaterial {
        base_color: Color::WHITE,
        perceptual_roughness: 1.0,
        double_sided: true,
        cull_mode: None,
        ..default()
    };
    let white = world.resource_mut::<Assets<StandardMaterial>>().add(white);
    let wall = Transform::from_xyz(0.0, 0.0, -0.2);
    world.spawn((Mesh3d(mesh.clone()), MeshMaterial3d(white.clone()), wall));
    scene.look(Vec3::new(0.0, 0.0, 0.9), Vec3::ZERO);
    // Its shadow falls on the wall beside it.
    let light = sun(&mut scene, Vec3::new(-1.0, 0.0, 0.8), false);
    let hair = hair(&mut scene, &curtain(12, 0.3), (wide(1e-3), HairFollowers::new(300)));
    let shadows = |scene: &mut Offscreen, on: bool| {
        let mut sun = scene.app.world_mut().get_mut::<DirectionalLight>(light).unwrap();
        sun.shadow_maps_enabled = on;
        scene.draw()
    };
    let mean = |picture: &Picture, at: Vec2| {
        let near = (-4..=4).flat_map(|x| (-4..=4).map(move |y| (x, y)));
        let near =
            near.map(|(x, y)| picture.at((at.x as i32 + x) as u32, (at.y as i32 + y) as u32));
        near.map(luma).sum::<f32>() / 81.0
    };
    scene.draw();
    let beside = scene.project(Vec3::new(0.25, 0.0, -0.2)).unwrap();
    let on_hair = scene.project(Vec3::ZERO).unwrap();
    let (free, shaded) = (shadows(&mut scene, false), shadows(&mut scene, true));
    let (lit, dark) = (mean(&free, beside), mean(&shaded, beside));
    println!("wall {lit} without and {dark} with hair's shadow");
    assert!(dark < 0.75 * lit);

    let screen = Transform::from_xyz(-0.6, 0.0, 0.5).looking_at(Vec3::ZERO, Vec3::Y);
    let screen = screen.with_scale(Vec3::splat(0.25));
    scene.app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(white), screen));
    let (free, shaded) = (shadows(&mut scene, false), shadows(&mut scene, true));
    let (lit, dark) = (mean(&free, on_hair), mean(&shaded, on_hair));
    println!("hair {lit} lit and {dark} in shadow");
    assert!(dark < 0.3 * lit && lit > 5.0);
    scene.app.world_mut().despawn(hair);
}

pub fn bad_hair_neither_panics_nor_leaves_a_stale_picture() {
    let mut scene = Offscreen::new(100, 100);
    scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
    let view = HairView::Bond(BondKind::Hydrogen);
    let parts = || (wide(4e-3), HairFollowers::new(40), view);
    let empty = hair(&mut scene, &[], parts());
    assert_eq!(scene.draw().covered(BLACK), 0, "no strands, no hair");

    // One guide, then others with other numbers of nodes, then a strand that is not one.
    let down = |x: f32, nodes: usize| -> Vec<Vec3> {
        let node = |i| Vec3::new(x, 0.1 - 0.2 * i as f32 / (nodes - 1) as f32, 0.0);
        (0..nodes).map(node).collect()
    };
    let mut covered = Vec::new();
    for (x, nodes) in [(0.0, 2), (0.05, 9), (-0.05, 30)] {
        let strand = Strand::from_polyline(&down(x, nodes)).unwrap();
        scene.app.world_mut().spawn((StrandOf(empty), strand));
        covered.push(scene.draw().covered(BLACK));
    }
    println!("covered with one, two, three guides: {covered:?}");
    assert!(covered[0] > 100 && covered[1] > covered[0] && covered[2] > covered[1]);
    scene.app.world_mut().spawn((StrandOf(empty), Strand::default()));
    assert_eq!(scene.draw().covered(BLACK), covered[2]);

    // Broken nodes, then a broken strand, then a broken transform.
    let strands = strands_of(&scene, empty);
    let break_nodes = |scene: &mut Offscreen, from: usize| {
        let mut strand = scene.app.world_mut().get_mut::<Strand>(strands[1]).unwrap();
        strand.positions_mut()[from..].fill(Vec3::NAN);
    };
    break_nodes(&mut scene, 5);
    let half = scene.draw().covered(BLACK);
    break_nodes(&mut scene, 0);
    let none = scene.draw().covered(BLACK);
    println!("a guide broken half way and all along: {half}, {none}");
    assert!(none < half && half < covered[2] && none > 0);
    set(&mut scene, empty, Transform::from_xyz(f32::NAN, 0.0, 0.0));
    scene.draw();
    set(&mut scene, empty, Transform::IDENTITY);
    assert_eq!(scene.draw().covered(BLACK), none, "back after a broken transform");

    // Gone while drawn: its strands, the hair's mark, the hair.
    for strand in strands {
        scene.app.world_mut().despawn(strand);
    }
    assert_eq!(scene.draw().covered(BLACK), 0, "strands are gone, their picture too");
    let second = hair(&mut scene, &curtain(5, 0.2), parts());
    assert!(scene.draw().covered(BLACK) > 500);
    scene.app.world_mut().entity_mut(second).remove::<Hair>();
    assert_eq!(scene.draw().covered(BLACK), 0, "no longer hair");
    let third = hair(&mut scene, &curtain(5, 0.2), parts());
    assert!(scene.draw().covered(BLACK) > 500);
    scene.app.world_mut().despawn(third);
    assert_eq!(scene.draw().covered(BLACK), 0, "despawned hair is gone at once");
}

pub fn every_kind_of_light_lights_hair_through_every_kind_of_camera() {
    use bevy::{camera::Hdr, core_pipeline::prepass::DepthPrepass, light::EnvironmentMapLight};
    let mut scene = Offscreen::new(60, 60);
    scene.look(Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO);
    let look = HairLook { melanin: Melanin::BLOND, ..wide(3e-3) };
    hair(&mut scene, &curtain(12, 0.3), (look, HairFollowers::new(60)));
    assert!(scene.draw().mean_luma() < 0.5, "no light, no hair to be seen");

    let camera = scene.camera;
    let at = Transform::from_xyz(0.2, 0.3, 0.6).looking_at(Vec3::ZERO, Vec3::Y);
    let lit = |scene: &mut Offscreen, what: &str, light: Entity| {
        let luma = scene.draw().mean_luma();
        println!("{what}: mean luma {luma}");
        assert!(luma > 2.0, "{what} does not light hair");
        scene.app.world_mut().despawn(light);
    };
    let spawn = |scene: &mut Offscreen, light: &str| {
        let world = scene.app.world_mut();
        let mut entity = world.spawn(at);
        match light {
            "point" => entity.insert(PointLight {
                intensity: 60_000.0,
                shadow_maps_enabled: true,
                ..default()
            }),
            "spot" => entity.insert(SpotLight {
                intensity: 60_000.0,
                shadow_maps_enabled: true,
                ..default()
            }),
            "rect" => entity.insert(RectLight {
                intensity: 60_000.0,
                width: 0.3,
                height: 0.3,
                ..default()
            }),
            _ => entity.insert(DirectionalLight { shadow_maps_enabled: true, ..default() }),
        };
        entity.id()
    };
    for light in ["point", "spot", "rect", "directional"] {
        let entity = spawn(&mut scene, light);
        lit(&mut scene, light, entity);
    }
    let none = scene.app.world_mut().spawn_empty().id();
    scene.app.insert_resource(GlobalAmbientLight { brightness: 2000.0, ..default() });
    lit(&mut scene, "ambient", none);
    scene.app.insert_resource(GlobalAmbientLight::NONE);
    let world = scene.app.world_mut();
    let sky = EnvironmentMapLight {
        intensity: 2000.0,
        ..EnvironmentMapLight::solid_color(&mut world.resource_mut::<Assets<Image>>(), Color::WHITE)
    };
    let none = world.spawn_empty().id();
    world.entity_mut(camera).insert(sky);
    lit(&mut scene, "environment", none);
    scene.app.world_mut().entity_mut(camera).remove::<EnvironmentMapLight>();

    let cameras: [(&str, fn(EntityWorldMut)); 5] = [
        ("without samples", |mut c| {
            c.insert(Msaa::Off);
        }),
        ("of high range", |mut c| {
            c.insert(Hdr);
        }),
        ("with a depth prepass", |mut c| {
            c.insert(DepthPrepass);
        }),
        ("in fog", |mut c| {
            c.insert(DistanceFog::default());
        }),
        ("orthographic", |mut c| {
            c.insert(Projection::Orthographic(OrthographicProjection {
                scale: 0.005,
                ..OrthographicProjection::default_3d()
            }));
        }),
    ];
    for (what, make) in cameras {
        make(scene.app.world_mut().entity_mut(camera));
        let light = spawn(&mut scene, "directional");
        lit(&mut scene, what, light);
    }
    assert_eq!(scene.unready_pipelines(), Vec::<String>::new());
}

/// The forward pass draws what is as near as the prepass found: ribbons that differed in a bit would
/// be holes. Without samples, so that every pixel is one depth.
pub fn prepasses_leave_no_holes_and_motion_moves_nothing() {
    use bevy::core_pipeline::prepass::{DepthPrepass, MotionVectorPrepass, NormalPrepass};
    let mut scene = Offscreen::new(160, 160);
    scene.look(Vec3::new(0.1, 0.05, 0.5), Vec3::ZERO);
    sun(&mut scene, Vec3::new(0.3, 0.5, 1.0), true);
    let hair = hair(&mut scene, &curtain(12, 0.3), (wide(1e-3), HairFollowers::new(200)));
    let camera = scene.camera;
    for msaa in [Msaa::Off, Msaa::Sample4] {
        scene.app.world_mut().entity_mut(camera).insert(msaa);
        let without = scene.draw();
        let prepasses = (DepthPrepass, NormalPrepass, MotionVectorPrepass);
        scene.app.world_mut().entity_mut(camera).insert(prepasses);
        let with = scene.draw();
        // A head that moves: the frame before differs from this one.
        for x in [0.03, 0.06, 0.0] {
            set(&mut scene, hair, Transform::from_xyz(x, 0.0, 0.0));
            scene.app.update();
        }
        let back = scene.draw();
        assert_eq!(scene.unready_pipelines(), Vec::<String>::new());
        type Prepasses = (DepthPrepass, NormalPrepass, MotionVectorPrepass);
        scene.app.world_mut().entity_mut(camera).remove::<Prepasses>();
        let differ = |a: &Picture, b: &Picture| {
            a.pixels().zip(b.pixels()).filter(|(a, b)| (luma(*a) - luma(*b)).abs() > 8.0).count()
        };
        let (holes, moved) = (differ(&without, &with), differ(&with, &back));
        println!("{msaa:?}: {holes} and {moved} of {} pixels differ", without.covered(BLACK));
        assert!(without.covered(BLACK) > 2000 && holes < 20 && moved < 20);
    }
}

pub fn followers_are_laid_out_again_when_roots_are_edited_and_rest() {
    let mut scene = Offscreen::new(120, 120);
    scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
    let hair = hair(&mut scene, &curtain(6, 0.2), (wide(2e-3), HairFollowers::new(60)));
    scene.draw();
    let buffers = |scene: &Offscreen| scene.app.world().get::<HairBuffers>(hair).cloned().unwrap();
    let first = buffers(&scene);
    let shift = |scene: &mut Offscreen, strand: Entity, by: Vec3| {
        let mut strand = scene.app.world_mut().get_mut::<Strand>(strand).unwrap();
        strand.positions_mut().iter_mut().for_each(|p| *p += by);
    };
    // The leftmost guide goes to the far right in steps, as by a hand.
    let mover = strands_of(&scene, hair)[0];
    for _ in 0..6 {
        shift(&mut scene, mover, Vec3::X * 0.04);
        scene.app.update();
        assert_eq!(buffers(&scene).strands, first.strands, "not while it moves");
    }
    for _ in 0..3 {
        scene.app.update();
    }
    let second = buffers(&scene);
    assert_ne!(second.strands, first.strands, "its neighbours are others now");
    assert_eq!((second.drawn, second.strand_count), (first.drawn, first.strand_count));
    shift(&mut scene, mover, Vec3::X * 1e-4);
    for _ in 0..4 {
        scene.app.update();
    }
    assert_eq!(buffers(&scene).strands, second.strands, "a nudge changes no neighbours");
}

pub fn wet_locks_are_tighter() {
    let mut scene = Offscreen::new(160, 160);
    scene.look(Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO);
    let followers = HairFollowers { stray: 0.1, ..HairFollowers::new(400) };
    let parts = (wide(0.5e-3), followers, HairView::Strain);
    let hair = hair(&mut scene, &curtain(5, 0.3), parts);
    let dry = scene.draw().covered(BLACK);
    for strand in strands_of(&scene, hair) {
        scene.app.world_mut().entity_mut(strand).insert(WetLook(vec![1.0; 9]));
    }
    let wet = scene.draw().covered(BLACK);
    println!("{dry} pixels of dry hair, {wet} of wet");
    assert!((wet as f32) < 0.75 * dry as f32 && wet > 500);
}

pub fn coincident_guides_and_nodes_are_drawn() {
    let mut scene = Offscreen::new(100, 100);
    scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
    let same = vec![curtain(1, 0.2)[0].clone(); 4];
    let view = HairView::Bond(BondKind::Hydrogen);
    let hair = hair(&mut scene, &same, (wide(4e-3), HairFollowers::new(40), view));
    assert!(scene.draw().covered(BLACK) > 100, "guides in one place");
    // All nodes of one, then of all of them, come to lie in one point.
    for strand in strands_of(&scene, hair) {
        let mut strand = scene.app.world_mut().get_mut::<Strand>(strand).unwrap();
        let root = strand.positions()[0];
        strand.positions_mut().fill(root);
        scene.draw();
    }
    assert!(scene.draw().covered(BLACK) < 2000, "followers stay with their roots");
}

pub fn water_is_drawn_as_beads_as_long_as_there_is_any() {
    let mut scene = Offscreen::new(160, 160);
    scene.look(Vec3::new(0.0, 0.0, 0.3), Vec3::ZERO);
    sun(&mut scene, Vec3::new(0.5, 0.8, 1.0), false);
    let bead = |x: f32, y: f32, velocity: Vec3| Bead {
        position: Vec3::new(x, y, 0.0),
        radius: 15e-3,
        velocity,
        layers_of: None,
    };
    #[derive(Resource, Default)]
    struct Wanted(Vec<Bead>);
    let add = |wanted: Res<Wanted>, mut beads: ResMut<HairBeads>| {
        if !(wanted.0.is_empty() && beads.is_empty()) {
            **beads = wanted.0.clone();
        }
    };
    let add = add.after(HairBeadSystems).before(HairRenderSystems);
    scene.app.init_resource::<Wanted>().add_systems(PostUpdate, add);
    let mut draw = |beads: Vec<Bead>| {
        scene.app.world_mut().resource_mut::<Wanted>().0 = beads;
        let picture = scene.draw();
        assert_eq!(scene.unready_pipelines(), Vec::<String>::new());
        picture
    };
    assert_eq!(draw(vec![]).covered(BLACK), 0);
    let still = draw(vec![bead(0.0, 0.0, Vec3::ZERO)]);
    let fast = draw(vec![bead(0.0, 0.0, Vec3::Y * 8.0)]);
    let tall = |picture: &Picture| {
        let bright = |y: &u32| (0..picture.width).any(|x| luma(picture.at(x, *y)) > 3.0);
        (0..picture.height).filter(bright).count()
    };
    if let Ok(folder) = std::env::var("BEADS") {
        still.save(&format!("{folder}/bead.png"));
        fast.save(&format!("{folder}/bead_fast.png"));
    }
    println!("a bead is {} pixels tall, a fast one {}", tall(&still), tall(&fast));
    assert!(tall(&still) > 10 && tall(&fast) as f32 > 1.5 * tall(&still) as f32);
    let most = still.pixels().map(luma).fold(0.0, f32::max);
    assert!(most > 150.0, "a bead glitters, this one has {most}");

    // More than there was room for, then broken ones, then none.
    let many: Vec<Bead> = (0..300)
        .map(|i| bead((i % 20) as f32 * 0.008 - 0.08, (i / 20) as f32 * 0.008 - 0.06, Vec3::ZERO))
        .collect();
    assert!(draw(many).covered(BLACK) > 5 * still.covered(BLACK));
    let broken = Bead { position: Vec3::NAN, ..bead(0.0, 0.0, Vec3::ZERO) };
    assert_eq!(draw(vec![broken; 3]).covered(BLACK), 0);
    assert_eq!(draw(vec![]).covered(BLACK), 0, "no water, no beads");
}

pub fn soaked_hair_is_darker_and_droplets_are_seen() {
    let mut scene = Offscreen::new(160, 160);
    scene.look(Vec3::new(0.0, 0.0, 0.7), Vec3::ZERO);
    sun(&mut scene, Vec3::new(0.3, 0.5, 1.0), false);
    // Locks do not draw together, so that the same pixels are compared.
    let followers = HairFollowers { wet_clump: 0.0, ..HairFollowers::new(300) };
    let hair = hair(&mut scene, &curtain(12, 0.3), (wide(1e-3), followers));
    let tick = |scene: &mut Offscreen| {
        scene.ticking(1);
        (0..2).for_each(|_| scene.app.update());
        scene.ticking(0);
        scene.draw()
    };
    let brightness = |picture: &Picture| {
        picture.mean_luma() * (picture.width * picture.height) as f32
            / picture.covered(BLACK) as f32
    };
    let dry = tick(&mut scene);
    scene.app.world_mut().write_message(SoakHair { target: hair, wetness: 1.0 });
    let wet = tick(&mut scene);
    let (light, dark) = (brightness(&dry), brightness(&wet));
    println!("hair has a mean luma of {light} dry, {dark} soaked");
    assert!(dry.covered(BLACK) > 1000 && dark < 0.85 * light);
    scene.app.world_mut().write_message(SoakHair { target: hair, wetness: 0.0 });
    let again = brightness(&tick(&mut scene));
    println!("and {again} dried");
    assert!((again - light).abs() < 0.03 * light);

    scene.app.world_mut().despawn(hair);
    assert_eq!(scene.draw().covered(BLACK), 0);
    // A drop of 25 mm, which is where it is as soon as it is, and gone as soon as it is gone.
    let place = Vec3::new(0.05, -0.03, 0.0);
    let drop = Droplet::new(place, 6.5e-5).unwrap();
    let drop = scene.app.world_mut().spawn(drop).id();
    for place in [place, Vec3::new(-0.06, 0.05, 0.1)] {
        scene.app.world_mut().get_mut::<Droplet>(drop).unwrap().position = place;
        let picture = scene.draw();
        let at = scene.project(place).unwrap();
        let bright: Vec<Vec2> = (0..160 * 160)
            .map(|i| UVec2::new(i % 160, i / 160))
            .filter(|p| luma(picture.at(p.x, p.y)) > 3.0)
            .map(|p| p.as_vec2())
            .collect();
        let centre = bright.iter().sum::<Vec2>() / bright.len().max(1) as f32;
        println!("a drop at {at} is seen around {centre} on {} pixels", bright.len());
        assert!(bright.len() > 15 && centre.distance(at) < 5.0);
    }
    scene.app.world_mut().despawn(drop);
    assert_eq!(scene.draw().covered(BLACK), 0, "no water, no beads");
}

/// A second view of another format beside it, and one that has no pixels.
pub fn views_do_not_disturb_each_other_nor_does_a_minimised_window() {
    use bevy::{
        camera::{Hdr, RenderTarget},
        render::render_resource::TextureFormat,
        window::{WindowRef, WindowResolution},
    };
    let mut scene = Offscreen::new(80, 80);
    scene.look(Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO);
    sun(&mut scene, Vec3::new(1.0, 2.0, 2.0), true);
    let view = HairView::Bond(BondKind::Hydrogen);
    let parts = (wide(2e-3), HairFollowers::new(60), HairLod::default(), view);
    let hair = hair(&mut scene, &curtain(12, 0.2), parts);
    let alone = scene.draw();
    assert!(alone.covered(BLACK) > 500);
    let world = scene.app.world_mut();
    let image = Image::new_target_texture(40, 30, TextureFormat::Rgba16Float, None);
    let image = world.resource_mut::<Assets<Image>>().add(image);
    let close = Transform::from_xyz(0.1, 0.0, 0.2).looking_at(Vec3::ZERO, Vec3::Y);
    let after = |order| Camera { order, ..default() };
    let target = RenderTarget::Image(image.into());
    world.spawn((Camera3d::default(), after(1), target, Hdr, Msaa::Off, close));
    let size = WindowResolution::new(0, 0);
    let window = world.spawn(Window { resolution: size, ..default() }).id();
    let target = RenderTarget::Window(WindowRef::Entity(window));
    world.spawn((Camera3d::default(), after(2), target, close));
    assert!(scene.draw() == alone, "the first view is as it was");
    let share = scene.app.world().get::<HairScreenShare>(hair).unwrap().0;
    assert!(share.is_finite() && share > 0.1, "{share}");
    assert_eq!(scene.unready_pipelines(), Vec::<String>::new());
}

/// Bevy quits when the device is lost, unless the app says how to go on.
pub fn hair_and_water_outlive_a_lost_device() {
    use bevy::light::cluster::GlobalClusterSettings;
    use bevy::render::{
        error_handler::{RenderErrorHandler, RenderErrorPolicy},
        render_resource::PollType,
        renderer::RenderDevice,
        settings::WgpuSettings,
    };
    let mut scene = Offscreen::new(120, 120);
    scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
    let view = HairView::Bond(BondKind::Hydrogen);
    let parts = (wide(2e-3), HairFollowers::new(100), view);
    let hair = hair(&mut scene, &curtain(12, 0.2), parts);
    let drop = Droplet::new(Vec3::new(0.0, 0.13, 0.0), 4.2e-6).unwrap();
    scene.app.world_mut().spawn(drop);
    scene.draw();
    // Since its buffers were made the hair has moved.
    for strand in strands_of(&scene, hair) {
        let mut strand = scene.app.world_mut().get_mut::<Strand>(strand).unwrap();
        strand.positions_mut().iter_mut().for_each(|p| p.y -= 0.03);
    }
    let before = scene.draw();
    scene.app.insert_resource(RenderErrorHandler(|error, _, _| {
        println!("{:?}: {}", error.ty, error.description);
        RenderErrorPolicy::Recover(WgpuSettings::default().into())
    }));
    let device = scene.app.world().resource::<RenderDevice>().clone();
    // Bevy 0.19.1 itself panics as it goes if it sorts lights on the device or draws meanwhile.
    let mut lights = scene.app.world_mut().resource_mut::<GlobalClusterSettings>();
    lights.gpu_clustering = None;
    let look = |scene: &mut Offscreen, on: bool| {
        scene.app.world_mut().get_mut::<Camera>(scene.camera).unwrap().is_active = on;
        (0..3).for_each(|_| scene.app.update());
    };
    look(&mut scene, false);
    device.wgpu_device().destroy();
    #[derive(Resource, Default)]
    struct Renewed(u32);
    let count = |device: Res<RenderDevice>, mut renewed: ResMut<Renewed>| {
        renewed.0 += u32::from(device.is_changed());
    };
    scene.app.init_resource::<Renewed>().add_systems(Update, count);
    // The system sees the first device as new as well. Another is made on a thread, which on a busy
    // machine takes its time.
    let start = std::time::Instant::now();
    while scene.app.world().resource::<Renewed>().0 < 2 {
        assert!(start.elapsed().as_secs() < 120, "there is no other device");
        // wgpu tells of the loss in a poll that finds the queue empty, and only then.
        let _ = device.poll(PollType::Poll);
        scene.app.update();
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    look(&mut scene, false);
    look(&mut scene, true);
    let after = scene.draw();
    assert!(before.covered(BLACK) > 1000);
    assert!(after == before, "{} and {} pixels", before.covered(BLACK), after.covered(BLACK));
}
