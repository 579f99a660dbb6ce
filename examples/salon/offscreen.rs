//! Pictures without a window: exactly one tick an update, drawn at the frames asked for.

use crate::{Arguments, orbit, picture::Pictures, scenes::Scene};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use std::{
    io,
    path::{Path, PathBuf},
};

/// Runs the scene and writes a PNG for every frame asked for into the folder, which is there. Gives
/// the files' paths.
pub fn run(
    app: &mut App,
    scene: Scene,
    arguments: &Arguments,
    folder: &Path,
) -> io::Result<Vec<PathBuf>> {
    let mut frames = arguments.frames.clone().unwrap_or_else(|| scene.kind.shown().to_vec());
    frames.sort_unstable();
    frames.dedup();

    let pictures =
        Pictures::new(app, arguments.size, arguments.supersample, orbit::bundle(scene.kind));

    let mut written = Vec::new();
    let mut ticks = 0;
    for frame in frames {
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        while ticks < frame {
            app.update();
            ticks += 1;
        }
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
        let name = format!("{}-{}-{frame}.png", scene.kind.name(), scene.variant);
        let path = folder.join(name);
        pictures.take(app, &path)?;
        written.push(path);
    }
    Ok(written)
}
