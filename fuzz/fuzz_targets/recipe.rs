//! `cargo +nightly fuzz run recipe`: any bytes are a recipe or an error.
#![no_main]

use bevy::{ecs::reflect::AppTypeRegistry, prelude::*};
use bevy_keratin::prelude::*;
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static TYPES: LazyLock<AppTypeRegistry> = LazyLock::new(|| {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()));
    app.world().resource::<AppTypeRegistry>().clone()
});

fuzz_target!(|file: &[u8]| {
    if let Ok(recipe) = HairRecipe::from_ron(file, &TYPES.read()) {
        _ = (recipe.planting(&Scalp::default()), recipe.hairline(), recipe.settings());
    }
});
