//! Hair covers as much of a picture as its strands do, from near and far, at root and tip.

use crate::linear::{light_at, measure};
use crate::offscreen::{Offscreen, head_of_guides};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// 500 strands at random over 0.3 m, 0.2 m long.
fn curtain() -> Vec<Vec<Vec3>> {
    let strand = |i: u32| {
        let x = 0.3 * ((i as f32 * 0.618_034).fract() - 0.5);
        (0..9).map(|n| Vec3::new(x, 0.1 - 0.025 * n as f32, 0.0)).collect()
    };
    (0..500).map(strand).collect()
}

/// The area (m²) that is covered between two heights (m), the mean over views some pixels aside:
/// the coverage of thin strands is stochastic.
fn area(scene: &mut Offscreen, height: f32, bands: &[(f32, f32)]) -> Vec<f32> {
    let mut areas = vec![0.0; bands.len()];
    const VIEWS: u32 = 6;
    for view in 0..VIEWS {
        let pixel = height / 256.0;
        let shift = Vec3::X * (3.0 * pixel * view as f32);
        scene.look(Vec3::new(0.0, 0.0, 0.5) + shift, shift);
        let picture = if view == 0 { scene.draw() } else { scene.draw_now() };
        let y = |row: u32| 0.5 * height - (row as f32 + 0.5) * pixel;
        for (area, (from, to)) in areas.iter_mut().zip(bands) {
            for row in 0..picture.height {
                // Rows that the band cuts count in part, or far pictures would have none.
                let (low, high) = (y(row) - 0.5 * pixel, y(row) + 0.5 * pixel);
                let part = ((high.min(*from) - low.max(*to)) / pixel).clamp(0.0, 1.0);
                let line = (0..picture.width).map(|x| light_at(&picture, x, row).x);
                *area += line.sum::<f32>() * part * pixel * pixel / VIEWS as f32;
            }
        }
    }
    areas
}

pub fn strands_cover_as_much_from_near_and_far_and_at_their_tips() {
    let mut scene = Offscreen::new(256, 256);
    let world = scene.app.world_mut();
    // Unlit and red: what a pixel holds is how much of it is covered.
    let look = HairLook { width: 0.1e-3, taper: 1.0, ..default() };
    let view = HairView::Bond(BondKind::Hydrogen);
    let hair = world.spawn((Hair, look, HairFollowers::none(), view)).id();
    for points in curtain() {
        world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    let camera = scene.camera;
    // Whole, root, middle and the last twentieth.
    let bands = [(0.2, -0.2), (0.1, 0.08), (0.01, -0.01), (-0.09, -0.1)];
    for msaa in [Msaa::Sample4, Msaa::Off] {
        scene.app.world_mut().entity_mut(camera).insert(msaa);
        let areas = [0.35, 0.8, 1.6].map(|height| {
            measure(&mut scene, height, height);
            area(&mut scene, height, &bands)
        });
        for (i, (from, to)) in bands.into_iter().enumerate() {
            let truth = 500.0 * 0.1e-3 * (f32::min(from, 0.1) - f32::max(to, -0.1));
            let areas = [areas[0][i], areas[1][i], areas[2][i]];
            println!("{msaa:?}, {from} to {to} m: {areas:.6?} m² for {truth:.6}");
            // Without samples a pixel is lit or not: few pixels of a band say little.
            let slack = match (i, msaa) {
                (0, _) => 0.05,
                (_, Msaa::Off) => 0.25,
                _ => 0.1,
            };
            for area in areas {
                // Where strands are drawn in one pixel they hide one another: a sixth is covered.
                assert!(area < (1.0 + slack) * truth && area > (0.92 - slack) * truth);
            }
        }
    }
}

/// T6. Its aims, 6 % in the mean and 25 % at worst, are missed: four samples hold strands a tenth of a pixel wide.
/// Ribbons that were a pixel wide and covered all of it had 0.205 and 1.03 of their own finer picture, of which nine
/// tenths of the tips were missing; twice as good would be 0.10 and 0.51. Without `HairSmoothing` it is 0.244 and 1.91.
pub fn edges_are_those_of_a_picture_with_sixteen_times_the_pixels() {
    let head = |size: u32| {
        let mut scene = Offscreen::new(size, size);
        scene.look(Vec3::new(0.1, 0.05, 0.45), Vec3::new(0.0, -0.02, 0.0));
        let world = scene.app.world_mut();
        let look = HairLook { melanin: Melanin::BLOND, width: 0.15e-3, ..default() };
        let hair = world.spawn((Hair, look, HairFollowers::new(8000))).id();
        for points in head_of_guides(200, 0.09, 0.2, 12) {
            world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
        }
        let sun = DirectionalLight { illuminance: 6000.0, ..default() };
        let place = Transform::from_xyz(0.4, 0.7, 1.0).looking_at(Vec3::ZERO, Vec3::Y);
        world.spawn((sun, place));
        scene.draw()
    };
    let (plain, fine) = (head(256), head(1024));
    if let Some(folder) = std::env::var_os("REFERENCE") {
        let save = |picture: &crate::offscreen::Picture, name: &str| {
            picture.save(std::path::Path::new(&folder).join(name).to_str().unwrap());
        };
        save(&plain, "plain.png");
        save(&fine, "fine.png");
    }
    let (mut errors, mut sum) = (Vec::new(), 0.0);
    for y in 0..256 {
        for x in 0..256 {
            let near = (0..16).map(|i| light_at(&fine, 4 * x + i % 4, 4 * y + i / 4));
            let truth = near.sum::<Vec3>() / 16.0;
            if truth.max_element() > 0.002 {
                errors.push((light_at(&plain, x, y) - truth).abs().element_sum() / 3.0);
                sum += truth.element_sum() / 3.0;
            }
        }
    }
    let mean = sum / errors.len() as f32;
    errors.sort_by(f32::total_cmp);
    let error = errors.iter().sum::<f32>() / errors.len() as f32 / mean;
    let worst = errors[errors.len() * 99 / 100] / mean;
    println!("error of one pixel {error:.3}, of the worst in a hundred {worst:.3} of the mean");
    assert!(error < 0.125 && worst < 1.1);
}

/// Marks of hair in the alpha channel are gone afterwards, and nothing but hair is averaged.
pub fn smoothing_changes_hair_alone_and_leaves_no_mark() {
    const SIZE: u32 = 128;
    let mut scene = Offscreen::new(SIZE, SIZE);
    scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
    let camera = scene.camera;
    let world = scene.app.world_mut();
    let ball = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(0.06));
    let skin = world.resource_mut::<Assets<StandardMaterial>>().add(Color::srgb(0.8, 0.3, 0.2));
    for i in 0..8 {
        let at = Vec3::new(0.06 * i as f32 - 0.2, if i % 2 == 0 { 0.1 } else { -0.1 }, -0.1);
        let parts = (Mesh3d(ball.clone()), MeshMaterial3d(skin.clone()));
        world.spawn((parts, Transform::from_translation(at)));
    }
    world.spawn((DirectionalLight::default(), Transform::default().looking_to(-Vec3::Z, Vec3::Y)));
    let draw = |scene: &mut Offscreen, reach: f32| {
        let smoothing = HairSmoothing { reach, ..default() };
        scene.app.world_mut().entity_mut(camera).insert(smoothing);
        scene.draw()
    };
    let bare = draw(&mut scene, 3.0);
    let look = HairLook { width: 0.1e-3, ..default() };
    let world = scene.app.world_mut();
    let hair = world.spawn((Hair, look, HairFollowers::new(1500))).id();
    for i in 0..8 {
        let root = Vec3::new(-0.15 + 0.02 * i as f32, 0.12, 0.0);
        let points = (0..8).map(|k| root + Vec3::new(0.01, -0.03, 0.0) * k as f32);
        let points: Vec<Vec3> = points.collect();
        world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    let smooth = draw(&mut scene, 3.0);
    let grain = draw(&mut scene, 0.0);
    assert!(grain == draw(&mut scene, f32::NAN), "NaN switches it off");
    assert!(smooth == draw(&mut scene, 3.0), "it is switched on again");
    for picture in [&bare, &smooth, &grain] {
        assert!(picture.rgba.chunks_exact(4).all(|p| p[3] == 255), "marks are left");
    }
    let is_hair = |x: u32, y: u32| bare.at(x, y) != grain.at(x, y);
    let (mut near, mut changed) = (0, 0);
    for (x, y) in (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y))) {
        let around = |i: u32| {
            (x.saturating_add(i % 3).clamp(1, SIZE), y.saturating_add(i / 3).clamp(1, SIZE))
        };
        let beside = (0..9).map(around).any(|(x, y)| is_hair(x - 1, y - 1));
        let differs = smooth.at(x, y) != grain.at(x, y);
        assert!(beside || !differs, "{x}, {y} is no hair");
        near += u32::from(beside);
        changed += u32::from(differs);
    }
    println!("{changed} of {near} pixels of hair and beside it are averaged");
    assert!(2 * changed > near && near > 500);

    // Where alpha says what is seen through, hair is as smooth, and so is its alpha.
    let mut seen = scene.app.world_mut().get_mut::<Camera>(camera).unwrap();
    seen.clear_color = ClearColorConfig::Custom(Color::NONE);
    let through = draw(&mut scene, 3.0);
    assert!(through != draw(&mut scene, 0.0));
    let alphas = |most: u8| through.rgba.chunks_exact(4).filter(|p| p[3] <= most).count();
    println!("{} pixels are seen through, {} in part", alphas(0), alphas(254) - alphas(0));
    assert!(alphas(0) > 1000 && alphas(254) > alphas(0));
}

/// A tuft of 3,000 strands at random, unlit and red, that a camera sees from `from` metres in some steps to
/// `to` metres, with as many pixels for an angle as a screen of 1,080 lines: the area (m²) that it covers in
/// each picture, and by how much each picture differs from the one before, a share of its light.
fn flight(detail: HairDetail, (from, to): (f32, f32)) -> (Vec<f32>, Vec<f32>) {
    const SIZE: u32 = 96;
    let mut scene = Offscreen::new(SIZE, SIZE);
    let half = 22.5f32.to_radians().tan() * SIZE as f32 / 1080.0;
    let camera = scene.camera;
    let world = scene.app.world_mut();
    let view = PerspectiveProjection { fov: 2.0 * half.atan(), ..default() };
    world.entity_mut(camera).insert(Projection::Perspective(view));
    let look = HairLook { width: 0.2e-3, taper: 1.0, ..default() };
    let view = HairView::Bond(BondKind::Hydrogen);
    let followers = HairFollowers { segments: 4, ..HairFollowers::none() };
    let hair = world.spawn((Hair, look, followers, view, detail)).id();
    for i in 0..3000 {
        let share = |k: f32| (i as f32 * k).fract() - 0.5;
        let x = 0.2 * share(0.754_877_7);
        let lean = Vec3::new(0.05 * share(0.569_840_3), -1.0, 0.05 * share(0.818_917_3));
        let points = [0.0, 0.1, 0.2].map(|y| Vec3::new(x, 0.1, 0.0) + lean * y);
        world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    let (mut areas, mut steps) = (Vec::new(), Vec::new());
    let mut before: Option<crate::offscreen::Picture> = None;
    const STEPS: u32 = 16;
    for step in 0..=STEPS {
        let away = from * (to / from).powf(step as f32 / STEPS as f32);
        scene.look(Vec3::new(0.0, 0.0, away), Vec3::ZERO);
        let picture = if step == 0 { scene.draw() } else { scene.draw_now() };
        let pixel = 2.0 * away * half / SIZE as f32;
        let red = |p: [u8; 3]| crate::linear::linear(p[0]);
        let light: f32 = picture.pixels().map(red).sum();
        areas.push(light * pixel * pixel);
        if let Some(before) = before.replace(picture.clone()) {
            let apart = picture.pixels().zip(before.pixels());
            steps.push(apart.map(|(a, b)| (red(a) - red(b)).abs()).sum::<f32>() / light);
        }
    }
    (areas, steps)
}

pub fn nothing_pops_as_a_camera_flies_away() {
    let all = HairDetail { least_width: 0.0, ..default() };
    let few = HairDetail { least_strands: 100, ..default() };
    // Near, where not all is in sight, and far.
    for path in [(0.5, 4.0), (4.0, 20.0)] {
        let ((_, whole), (areas, steps)) = (flight(all, path), flight(few, path));
        let most = |steps: &[f32]| steps.iter().copied().fold(0.0, f32::max);
        let mean = |steps: &[f32]| steps.iter().sum::<f32>() / steps.len() as f32;
        println!(
            "{path:?} m, change with all strands: mean {:.3}, most {:.3}",
            mean(&whole),
            most(&whole)
        );
        println!("with fewer and wider ones: mean {:.3}, most {:.3}", mean(&steps), most(&steps));
        // The picture shrinks by a tenth from frame to frame, which changes it in any case; fewer strands
        // have more of a share in that each.
        assert!(mean(&steps) < 1.3 * mean(&whole), "{steps:.3?}");
        assert!(most(&steps) < 1.6 * most(&whole), "{steps:.3?}");
        if path.0 > 1.0 {
            let jumps = areas.windows(2).map(|w| (w[1] / w[0] - 1.0).abs());
            let jump = jumps.fold(0.0, f32::max);
            println!("area {areas:.5?} m², largest step {jump:.4}");
            assert!(jump < 0.15, "{jump}");
        }
    }
}
