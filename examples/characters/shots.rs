//! Pictures of each preset on each character, without a window.

use crate::{
    Arguments, Outcome, Shown, app, environment,
    hats::{self, bring_hat},
    picture::{self, Pictures},
    spawn,
};
use bevy::{core_pipeline::prepass::DepthPrepass, prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{authoring::plant::HairPreset, prelude::*, render::HairFollowers};
use std::{
    path::{Path, PathBuf},
    thread::sleep,
    time::{Duration, Instant},
};

/// How long a file and its hair may take.
const PATIENCE: Duration = Duration::from_secs(120);
/// Ticks in which hair settles.
const SETTLING: u32 = 150;
/// Where the pictures are taken from: right, up and front of the head, in its own size (m).
const VIEWS: [Vec3; 4] = [
    Vec3::new(0.08, 0.02, 0.5),
    Vec3::new(0.5, 0.03, 0.08),
    Vec3::new(-0.1, 0.08, -0.52),
    Vec3::new(0.06, 0.46, 0.22),
];

/// Pictures of all presets on all characters.
pub fn shoot(arguments: &Arguments, folder: &Path) -> Result {
    picture::folder(folder)?;
    for file in arguments.files()? {
        let mut app = app(arguments, true);
        let hairs = arguments.hairs(app.world().resource::<AssetServer>())?;
        let character = spawn(&mut app, file.clone(), hairs[0].wear.clone(), Transform::default());
        app.add_observer(bring_hat);
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        let surroundings = environment::studio(&mut images, 450.0);
        let camera = (Camera3d::default(), Msaa::Sample4, DepthPrepass, surroundings);
        let pictures = Pictures::new(&mut app, arguments.size, arguments.supersample, camera);
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        let name =
            PathBuf::from(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut is_lit = false;
        for Shown { name: of, wear } in hairs {
            app.world_mut().resource_mut::<Outcome>().0 = None;
            app.world_mut().entity_mut(character).insert(wear);
            let hair = wait(&mut app)?;
            thin_out(&mut app, hair, arguments.strands);
            app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
            (0..SETTLING).for_each(|_| app.update());
            if arguments.hats {
                app.world_mut()
                    .run_system_cached(hats::toggle)
                    .map_err(|error| error.to_string())?;
                (0..60).for_each(|_| app.update());
            }
            app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
            let head =
                app.world().get::<GlobalTransform>(hair).ok_or("the hair is gone")?.to_matrix();
            if !core::mem::replace(&mut is_lit, true) {
                environment::lights(app.world_mut(), head.x_axis.length());
            }
            let mut views = Vec::new();
            for from in VIEWS {
                // Long hair is seen whole.
                let away = if of == HairPreset::Long.name() { 1.7 } else { 1.0 };
                let focus = Vec3::new(0.0, -0.035 - 0.13 * (away - 1.0), 0.0);
                let [from, to] = [from * Vec3::new(1.0, 1.0, -1.0) * away + focus, focus]
                    .map(|p| head.transform_point3(p));
                let place = Transform::from_translation(from).looking_at(to, Vec3::Y);
                let mut cameras = app.world_mut().query_filtered::<&mut Transform, With<Camera>>();
                cameras.iter_mut(app.world_mut()).for_each(|mut camera| *camera = place);
                views.push(pictures.draw(&mut app)?);
            }
            if arguments.hats {
                app.world_mut()
                    .run_system_cached(hats::toggle)
                    .map_err(|error| error.to_string())?;
            }
            let path = folder.join(format!("{name}-{of}.png"));
            picture::save(picture::beside(&views), &path)?;
            println!("{}", path.display());
        }
    }
    Ok(())
}

/// Draws no more strands than this, wider ones.
fn thin_out(app: &mut App, hair: Entity, strands: u32) {
    let mut hair = app.world_mut().entity_mut(hair);
    let Some(mut followers) = hair.get_mut::<HairFollowers>() else { return };
    let before = followers.count;
    followers.count = before.min(strands);
    let wider = (before as f32 / followers.count.max(1) as f32).sqrt();
    if let Some(mut look) = hair.get_mut::<HairLook>() {
        look.width *= wider;
    }
}

/// Waits for the hair that is asked for.
fn wait(app: &mut App) -> Result<Entity> {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        app.update();
        if let Some(outcome) = app.world_mut().resource_mut::<Outcome>().0.take() {
            return Ok(outcome?);
        }
        sleep(Duration::from_millis(2));
    }
    Err("no hair came within two minutes: is there a head?".into())
}
