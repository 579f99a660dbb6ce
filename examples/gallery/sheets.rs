//! The sheets: stills of several pictures.

use crate::{
    Arguments, bust,
    loops::{FROM, MIDDLE, settled, settled_before},
    orbit,
    picture::{self, Pictures},
    renderer,
    scenes::{Scene, SceneKind},
    set,
};
use bevy::{core_pipeline::prepass::DepthPrepass, prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{
    authoring::plant::HairPreset,
    prelude::*,
    render::{HairFollowers, HairView},
};

/// Lets time pass (ticks).
fn run(app: &mut App, ticks: u32) {
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    (0..ticks).for_each(|_| app.update());
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
}

/// A scene at one of its frames.
fn scene(arguments: &Arguments, scene: Scene, view: HairView, frame: u32) -> Result<Image> {
    let mut app = renderer::app("", (0, 0), true, default());
    set::furnish(&mut app, scene, view);
    arguments.thin_out(&mut app);
    let camera = (orbit::bundle(scene.kind), DepthPrepass);
    let size = arguments.scaled(400, 400);
    let pictures = Pictures::new(&mut app, size, arguments.supersample, camera);
    let mut orbits = app.world_mut().query::<(&mut orbit::Orbit, &mut Transform)>();
    for (mut orbit, mut place) in orbits.iter_mut(app.world_mut()) {
        // What is treated is in the middle.
        orbit.distance *= 0.62;
        orbit.focus.x += 0.02;
        *place = orbit.pose();
    }
    run(&mut app, frame);
    Ok(pictures.draw(&mut app)?)
}

/// Three heads of hair, turned to each other, before one ground.
pub fn hero(arguments: &Arguments) -> Result {
    let size = arguments.scaled(400, 520);
    let ground = Color::srgb(0.13, 0.14, 0.16);
    let heads = [
        (HairPreset::Wavy, Vec3::new(0.34, 0.05, 0.61)),
        (HairPreset::Long, Vec3::new(0.10, 0.05, 0.69)),
        (HairPreset::Curly, Vec3::new(-0.34, 0.05, 0.61)),
    ];
    let mut drawn = Vec::new();
    for (preset, from) in heads {
        let (mut app, _, pictures) = settled_before(ground, arguments, preset, size)?;
        bust::look(&mut app, from, MIDDLE);
        drawn.push(pictures.draw(&mut app)?);
    }
    Ok(arguments.save(picture::beside(&drawn), "hero")?)
}

/// Dry and, below, soaked; untreated and permed; as it looks and its hydrogen bonds: by the same camera and light.
pub fn before(arguments: &Arguments) -> Result {
    let size = arguments.scaled(400, 400);
    let (mut app, bust, pictures) = settled(arguments, HairPreset::Long, size)?;
    bust::look(&mut app, FROM * Vec3::new(0.0, 1.0, 1.05), MIDDLE);
    run(&mut app, 0);
    let dry = pictures.draw(&mut app)?;
    app.world_mut().write_message(SoakHair { target: bust.hair, wetness: 1.0 });
    run(&mut app, if arguments.most > 1 { 60 } else { 2 });
    let wet = pictures.draw(&mut app)?;
    if arguments.most == 1 {
        return Ok(arguments.save(picture::below(&[dry, wet]), "before-after")?);
    }
    let perm = |variant| {
        let scene_of = Scene::new(SceneKind::Perm, Some(variant))?;
        scene(arguments, scene_of, HairView::Natural, 900)
    };
    let dried = Scene::new(SceneKind::BlowDry, None)?;
    let natural = scene(arguments, dried, HairView::Natural, 1170)?;
    let bonds = scene(arguments, dried, HairView::Bond(BondKind::Hydrogen), 1170)?;
    let before = picture::beside(&[dry, perm("untreated")?, natural]);
    let after = picture::beside(&[wet, perm("treated")?, bonds]);
    Ok(arguments.save(picture::below(&[before, after]), "before-after")?)
}

/// Seven pigments across; dry, damp and soaked down.
pub fn melanin(arguments: &Arguments) -> Result {
    let pigments = [
        Melanin::BLACK,
        Melanin::DARK_BROWN,
        Melanin::BROWN,
        Melanin::AUBURN,
        Melanin::RED,
        Melanin::BLOND,
        Melanin::PLATINUM,
    ];
    let size = arguments.scaled(180, 220);
    let (mut app, bust, pictures) = settled(arguments, HairPreset::Wavy, size)?;
    bust::look(&mut app, Vec3::new(0.44, 0.07, 0.46), MIDDLE);
    let few = if arguments.most > 1 { pigments.len() } else { 2 };
    let mut rows = Vec::new();
    for wetness in [0.0, 0.5, 2.0] {
        if wetness > 0.0 {
            app.world_mut().write_message(SoakHair { target: bust.hair, wetness });
            run(&mut app, if arguments.most > 1 { 30 } else { 2 });
        }
        let mut row = Vec::new();
        for melanin in pigments.into_iter().take(few) {
            if let Some(mut look) = app.world_mut().get_mut::<HairLook>(bust.hair) {
                look.melanin = melanin;
            }
            run(&mut app, 0);
            row.push(pictures.draw(&mut app)?);
        }
        rows.push(picture::beside(&row));
    }
    Ok(arguments.save(picture::below(&rows), "melanin-moisture")?)
}

/// All presets, each from in front and from behind.
pub fn presets(arguments: &Arguments) -> Result {
    const IN_A_ROW: usize = 7;
    let size = arguments.scaled(240, 290);
    // In a hurry one stands for all.
    let few = if arguments.most > 1 { HairPreset::ALL.len() } else { 1 };
    let mut front = Vec::new();
    let mut back = Vec::new();
    for (i, preset) in HairPreset::ALL.into_iter().take(few).enumerate() {
        let (mut app, _, pictures) = settled(arguments, preset, size)?;
        // Turned differently.
        let aside = if i % 2 == 0 { 1.0 } else { -1.0 };
        let mut from = |from: Vec3| {
            bust::look(&mut app, from * Vec3::new(aside, 1.0, 1.0), MIDDLE);
            Ok::<_, BevyError>(pictures.draw(&mut app)?)
        };
        front.push(from(FROM)?);
        back.push(from(FROM * Vec3::new(1.0, 1.8, -1.0))?);
    }
    // What is left of a row is ground.
    let blank = {
        let mut blank = front[0].clone();
        if let Some(data) = blank.data.as_mut() {
            let ground: Vec<u8> = data[..4].to_vec();
            data.chunks_exact_mut(4).for_each(|pixel| pixel.copy_from_slice(&ground));
        }
        blank
    };
    let row = |pictures: &[Image]| {
        let mut row = pictures.to_vec();
        row.resize(IN_A_ROW.min(few), blank.clone());
        picture::beside(&row)
    };
    let pairs = front.chunks(IN_A_ROW).zip(back.chunks(IN_A_ROW));
    let rows: Vec<Image> = pairs.flat_map(|(front, back)| [row(front), row(back)]).collect();
    Ok(arguments.save(picture::below(&rows), "presets")?)
}

/// One sample a pixel, four of the hardware's, and those at two and four times the size; the mean error
/// against the last, as a share of its mean light, is printed.
pub fn quality(arguments: &Arguments) -> Result {
    let size = arguments.scaled(300, 360);
    let mut drawn = Vec::new();
    let few = if arguments.most > 1 { 4 } else { 2 };
    for (edges, times) in
        [(Msaa::Off, 1), (Msaa::Sample4, 1), (Msaa::Sample4, 2), (Msaa::Sample4, 4)]
            .into_iter()
            .take(few)
    {
        let mut app = bust::app("", bust::ground(HairPreset::Curly));
        bust::light(&mut app);
        arguments.thin_out(&mut app);
        bust::wear(&mut app, HairPreset::Curly)?;
        let camera = bust::camera(&mut app);
        let pictures = Pictures::new(&mut app, size, times, camera);
        let mut cameras = app.world_mut().query_filtered::<&mut Msaa, With<Camera3d>>();
        cameras.iter_mut(app.world_mut()).for_each(|mut msaa| *msaa = edges);
        bust::look(&mut app, Vec3::new(0.26, 0.05, 0.46), Vec3::new(0.02, -0.02, 0.03));
        run(&mut app, if arguments.most > 1 { 120 } else { 2 });
        drawn.push(pictures.draw(&mut app)?);
    }
    let light = |image: &Image| -> Vec<f32> {
        let bytes = image.data.as_deref().unwrap_or_default();
        let pixels = bytes.chunks(4).map(|p| Color::srgb_u8(p[0], p[1], p[2]).luminance());
        pixels.collect()
    };
    let Some((best, others)) = drawn.split_last() else { return Ok(()) };
    let best = light(best);
    let mean = best.iter().sum::<f32>() / best.len() as f32;
    for (image, name) in others.iter().zip(["1 sample", "MSAA 4", "2 × 2 × MSAA 4"]) {
        let off = light(image).iter().zip(&best).map(|(a, b)| (a - b).abs()).sum::<f32>();
        println!("{name}: {:.1} % off", 100.0 * off / best.len() as f32 / mean);
    }
    Ok(arguments.save(picture::beside(&drawn), "quality")?)
}

/// Locks of one curl, straight at first, which hang as a hook where twist is as dear as bending, and as a ringlet where
/// it is as cheap as in a hair.
pub fn ringlet(arguments: &Arguments) -> Result {
    /// Length, radius of the curl, how far its weight bends it (m).
    const CURL: [f32; 3] = [0.12, 0.02, 0.045];
    const SEGMENTS: usize = 32;
    let mut app = bust::app("", Color::srgb(0.44, 0.46, 0.48));
    bust::light(&mut app);
    arguments.thin_out(&mut app);
    let world = app.world_mut();
    let [length, radius, bending_length] = CURL;
    // Held by nothing but themselves, until they are at rest.
    world.insert_resource(HairDefault(StrandContact { strength: 0.0, ..default() }));
    world.insert_resource(HairDefault(AirDrag { rate: 4.0 }));
    for (torsion, x) in [(1.0, -0.04), (0.46, 0.04)] {
        let stiffness = HairStiffness { bending_length, torsion, ..default() };
        let followers = HairFollowers { count: 1500, segments: 64, ..default() };
        let hair = world.spawn((Hair, stiffness, followers, Transform::from_xyz(x, 0.0, 0.0)));
        let hair = hair.id();
        for i in 0..37 {
            // Roots as the seeds of a sunflower.
            let angle = 2.4 * i as f32;
            let root = Quat::from_rotation_y(angle) * Vec3::X * (0.004 * (i as f32 / 37.0).sqrt());
            let at = |k: usize| length * k as f32 / SEGMENTS as f32;
            let arc = |k| {
                let (sine, cosine) = (at(k) / radius).sin_cos();
                root + radius * Vec3::new(1.0 - cosine, -sine, 0.0)
            };
            let points: Vec<_> = (0..=SEGMENTS).map(arc).collect();
            let mut strand = Strand::from_polyline(&points)?;
            for (k, place) in strand.positions_mut().iter_mut().enumerate() {
                let aside = 1e-3 * at(k) * at(k) / length;
                *place = root + Vec3::new(0.0, -at(k), aside);
            }
            world.spawn((StrandOf(hair), strand));
        }
    }
    let camera = bust::camera(&mut app);
    let size = arguments.scaled(720, 480);
    let pictures = Pictures::new(&mut app, size, arguments.supersample, camera);
    // A long lens.
    let world = app.world_mut();
    for mut lens in world.query::<&mut Projection>().iter_mut(world) {
        if let Projection::Perspective(lens) = &mut *lens {
            lens.fov *= 0.55;
        }
    }
    bust::look(&mut app, Vec3::new(0.016, -0.035, 0.24), Vec3::new(0.016, -0.035, 0.0));
    run(&mut app, if arguments.most > 1 { 1800 } else { 2 });
    Ok(arguments.save(pictures.draw(&mut app)?, "ringlet")?)
}
