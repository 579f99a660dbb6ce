//! Every public type that can be reflected is registered: inspectors and scene files know it.

use bevy::{
    asset::AssetPlugin,
    ecs::reflect::{AppTypeRegistry, ReflectComponent},
    prelude::*,
    reflect::{TypeInfo, enums::VariantInfo},
    render::storage::ShaderBuffer,
};
use bevy_keratin::prelude::*;
use std::{collections::BTreeSet, fs, path::Path};

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), HairPlugins::default()))
        .init_asset::<Mesh>()
        .init_asset::<ShaderBuffer>();
    #[cfg(feature = "debug")]
    app.add_plugins(HairDebugPlugin);
    app.finish();
    app
}

#[test]
fn the_prelude_has_every_type_that_a_field_of_its_types_needs() {
    let words = |text: &str| -> BTreeSet<String> {
        let words = text.split(|c: char| !c.is_alphanumeric());
        words.filter(|word| word.starts_with(char::is_uppercase)).map(str::to_owned).collect()
    };
    let mut prelude = BTreeSet::new();
    for room in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).unwrap() {
        let Ok(text) = fs::read_to_string(room.unwrap().path().join("mod.rs")) else { continue };
        let list = text.split_once("pub mod prelude {").map_or("", |(_, rest)| rest);
        prelude.extend(words(list.split("\n}").next().unwrap()));
    }
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let mut missing = BTreeSet::new();
    for info in registry.iter().map(|registration| registration.type_info()) {
        let table = info.type_path_table();
        let own = table.crate_name() == Some("bevy_keratin");
        if !own || !table.ident().is_some_and(|ident| prelude.contains(ident)) {
            continue;
        }
        let mut fields: Vec<&str> = Vec::new();
        match info {
            TypeInfo::Struct(s) => fields.extend(s.iter().map(|field| field.type_path())),
            TypeInfo::TupleStruct(s) => fields.extend(s.iter().map(|field| field.type_path())),
            TypeInfo::Enum(e) => e.iter().for_each(|variant| match variant {
                VariantInfo::Struct(v) => fields.extend(v.iter().map(|f| f.type_path())),
                VariantInfo::Tuple(v) => fields.extend(v.iter().map(|f| f.type_path())),
                VariantInfo::Unit(_) => {}
            }),
            _ => {}
        }
        let needed = fields.into_iter().filter(|path| path.contains("bevy_keratin::"));
        for path in needed {
            let last = path.rsplit("bevy_keratin::").next().unwrap();
            let needs = words(last.rsplit("::").next().unwrap());
            missing.extend(needs.difference(&prelude).map(|needs| format!("{needs} of {path}")));
        }
    }
    assert!(missing.is_empty(), "not in the prelude: {missing:#?}");
}

#[test]
fn every_public_reflected_type_is_registered() {
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let mut missing = Vec::new();
    let mut known = 0;
    for (name, file) in public_reflected(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src")) {
        // A generic type is registered for each of its parameters.
        let is_registered = registry.get_with_short_type_path(&name).is_some()
            || registry.iter().any(|t| t.type_info().type_path().contains(&format!("::{name}<")));
        if is_registered {
            known += 1;
        } else {
            missing.push(format!("{name} of {file}"));
        }
    }
    assert!(missing.is_empty(), "not registered: {missing:#?}");
    assert!(known > 60, "only {known} types were found");
}

#[test]
fn scenes_leave_out_what_follows_from_other_state() {
    let app = app();
    let registry = app.world().resource::<AppTypeRegistry>().read();
    let is_written = |name: &str| {
        let kind = registry.get_with_short_type_path(name).expect(name);
        kind.data::<ReflectComponent>().is_some()
    };
    let derived = [
        "AddedMass",
        "BlownAir",
        "Guides",
        "HairBuffers",
        "LockNeighbours",
        "Obstacles",
        "RestShape",
        "SleepPose",
        "StrandHistory",
        "TickPose",
        "TiedRoots",
    ];
    assert_eq!(derived.into_iter().find(|name| is_written(name)), None);
    let state =
        ["Bonds", "HairStyle", "Moisture", "RootsOnMesh", "Strand", "Treatments", "WearHair"];
    assert_eq!(state.into_iter().find(|name| !is_written(name)), None);
}

/// The names of public structs and enums that derive `Reflect`, with their files.
fn public_reflected(folder: &Path) -> Vec<(String, String)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(public_reflected(&path));
            continue;
        }
        let avian = path.ends_with("avian.rs") && !cfg!(feature = "avian");
        if avian || path.extension().is_none_or(|e| e != "rs") {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        let mut reflected = false;
        for line in text.split("\n#[cfg(test)]\nmod tests").next().unwrap().lines() {
            let line = line.trim_start();
            if line.starts_with("#[derive(") {
                reflected = line.contains("Reflect");
            }
            let item = ["pub struct ", "pub enum "].iter().find_map(|kind| line.strip_prefix(kind));
            if let Some(item) = item.filter(|_| reflected) {
                let end = item.find(|c: char| !c.is_alphanumeric()).unwrap_or(item.len());
                found.push((item[..end].to_owned(), path.display().to_string()));
                reflected = false;
            }
        }
    }
    found
}
