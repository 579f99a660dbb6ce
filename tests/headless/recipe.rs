//! Presets, settings and looks in files that a running app follows.
#![cfg(all(feature = "groom", feature = "render", feature = "save"))]

use crate::{
    common::*,
    wear::{self, wait, worn},
    worlds_measured::wearer::character,
};
use bevy::{
    ecs::reflect::{AppTypeRegistry, ReflectComponent},
    prelude::*,
    reflect::{ReflectMut, serde::TypedReflectSerializer},
};
use bevy_keratin::{FaultKind, WearError, authoring::plant::*, prelude::*};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

const CURLS: &str = r#"(
    preset: Bob,
    planting: (density: 500, length: 0.1),
    components: {
        "HairLook": (roughness: 0.7),
        "HairStiffness": (bending_length: 0.11),
        "AirDrag": (rate: 9),
    },
)"#;

fn recipe(app: &App, text: &str) -> Result<HairRecipe, RecipeError> {
    HairRecipe::from_ron(text.as_bytes(), &app.world().resource::<AppTypeRegistry>().read())
}

fn add(app: &mut App, text: &str) -> Handle<HairRecipe> {
    let recipe = recipe(app, text).unwrap();
    app.world_mut().resource_mut::<Assets<HairRecipe>>().add(recipe)
}

/// As when the file is loaded again.
fn reload(app: &mut App, handle: &Handle<HairRecipe>, text: &str) {
    let recipe = recipe(app, text).unwrap();
    app.world_mut().resource_mut::<Assets<HairRecipe>>().insert(handle, recipe).unwrap();
    (0..3).for_each(|_| app.update());
}

fn of<C: Component + Clone>(app: &App, entity: Entity) -> C {
    app.world().get::<C>(entity).cloned().unwrap()
}

fn lengths(app: &mut App, hair: Entity) -> Vec<f32> {
    wear::strands(app, hair).iter().map(Strand::length).collect()
}

#[test]
fn a_recipe_is_a_preset_with_the_changes_of_its_file() {
    let app = wear::app();
    let scalp = Scalp::default();
    let curls = recipe(&app, CURLS).unwrap();
    let bob = HairPreset::Bob;
    assert_eq!(curls.preset(), bob);
    let expected = Planting { density: 500.0, length: 0.1, ..bob.planting(&scalp) };
    assert_eq!(curls.planting(&scalp), expected);
    assert_eq!(curls.hairline(), bob.hairline());
    let (own, of_preset) = (curls.settings(), bob.settings());
    assert_eq!(own.look, HairLook { roughness: 0.7, ..of_preset.look });
    assert_eq!(own.stiffness, HairStiffness { bending_length: 0.11, ..of_preset.stiffness });
    assert_eq!((own.contact, own.followers), (of_preset.contact, of_preset.followers));
    // Nested values, in parts as well.
    let nested = "(preset: Wavy, planting: (curl: Some((pitch: 0.1))), hairline: (baby_hair: 0.5))";
    let nested = recipe(&app, nested).unwrap();
    let wavy = HairPreset::Wavy.planting(&scalp).curl.unwrap();
    assert_eq!(nested.planting(&scalp).curl, Some(Curl { pitch: 0.1, ..wavy }));
    assert_eq!(nested.hairline().baby_hair, 0.5);
    // One that the preset does not have begins with its own defaults.
    let curly = recipe(&app, "(preset: Bob, planting: (curl: Some((pitch: 0.1))))").unwrap();
    assert_eq!(curly.planting(&scalp).curl, Some(Curl { pitch: 0.1, ..default() }));
    assert_eq!(recipe(&app, "()").unwrap().settings(), HairPreset::default().settings());
}

#[test]
fn what_is_wrong_in_a_file_is_said_with_its_place() {
    let app = wear::app();
    for (text, line, says) in [
        ("(preset: Curlie)", 1, "Curlie"),
        ("(\n  planting: (lenght: 0.2),\n)", 2, "unknown field `lenght`"),
        ("(\n  planting: (length: \"long\"),\n)", 2, "Expected float"),
        (
            "(\n  components: {\n    \"HairLooks\": (),\n  },\n)",
            3,
            "the nearest name is \"HairLook\"",
        ),
        ("(\n  components: {\n    \"HairLook\": (rouhgness: 1),\n  },\n)", 3, "rouhgness"),
        ("(components: {\"Planting\": ()})", 1, "is no component"),
        ("(components: {\"HairLook\": (), \"HairLook\": ()})", 1, "is there twice"),
        ("(preset: Bob, preset: Bob)", 1, "twice"),
        ("(colour: 1)", 1, "unknown field `colour`, expected one of"),
        ("(preset: Bob", 1, ""),
        ("(preset: Bob) and more", 1, ""),
        ("", 1, ""),
        ("{\"a\": 1}", 1, ""),
    ] {
        let error = recipe(&app, text).unwrap_err();
        println!("{text:?}: {error}");
        assert_eq!(error.line, line, "{text}: {error}");
        assert!(error.to_string().contains(says), "{text}: {error}");
    }
    assert!(
        HairRecipe::from_ron(
            &[0xff, 0xfe, 0x00],
            &app.world().resource::<AppTypeRegistry>().read()
        )
        .is_err()
    );
}

#[derive(Reflect, Clone, Debug, PartialEq)]
struct Inner {
    x: f32,
    y: f32,
}

/// Of a game's own.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default)]
struct Own {
    inners: Vec<Inner>,
}

/// With a variant that holds a struct.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default)]
struct Variants {
    of: Option<Variant>,
}

#[derive(Reflect, Clone, Debug, PartialEq)]
enum Variant {
    One,
    Two(Inner),
}

/// What cannot be copied by reflection.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default)]
struct Cape {
    stiff: f32,
    #[reflect(ignore)]
    cache: u32,
}

#[test]
fn components_that_no_file_can_hold_are_refused() {
    let mut app = wear::app();
    app.register_type::<Variants>();
    app.register_type::<Own>().register_type::<Cape>().register_type::<ChildOf>();
    for (text, says) in [
        ("(components: {\"Own\": (inners: [(x: 1)])})", "fields are missing"),
        ("(components: {\"Cape\": (stiff: 2)})", "clone"),
        ("(components: {\"HairSubsteps\": Fixed(1)})", "is a resource"),
        ("(components: {\"Variants\": (of: Some(Two((x: 1))))})", "fields are missing, y"),
        ("(components: {\"ChildOf\": (4294967000)})", "names entities"),
        ("(components: {\"StrandOf\": (1)})", "names entities"),
        ("(components: {\"WornBy\": (1)})", "names entities"),
    ] {
        let error = recipe(&app, text).unwrap_err().to_string();
        println!("{text}: {error}");
        assert!(error.contains(says), "{text}: {error}");
    }
    let whole = "(components: {\"Own\": (inners: [(x: 1, y: 2)]), \"Variants\": (of: Some(Two((x: 1, y: 2))))})";
    let handle = add(&mut app, whole);
    let own = app.world_mut().spawn(FollowRecipe(handle)).id();
    app.update();
    assert_eq!(of::<Own>(&app, own).inners, [Inner { x: 1.0, y: 2.0 }]);
    let of = of::<Variants>(&app, own).of;
    assert_eq!(of, Some(Variant::Two(Inner { x: 1.0, y: 2.0 })));
}

/// Around a struct of a game's own.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default)]
struct Around(Pair);

#[derive(Reflect, Clone, Debug, Default, PartialEq)]
struct Pair {
    x: f32,
    y: f32,
}

#[test]
fn a_struct_in_a_tuple_is_given_in_part() {
    let mut app = wear::app();
    app.register_type::<Around>();
    for (text, expected) in [
        ("((y: 3))", Pair { x: 1.0, y: 3.0 }),
        ("((x: 4))", Pair { x: 4.0, y: 2.0 }),
        ("((x: 4, y: 3))", Pair { x: 4.0, y: 3.0 }),
        ("(())", Pair { x: 1.0, y: 2.0 }),
    ] {
        let handle = add(&mut app, &format!("(components: {{\"Around\": {text}}})"));
        let own = Around(Pair { x: 1.0, y: 2.0 });
        let own = app.world_mut().spawn((own, FollowRecipe(handle))).id();
        app.update();
        assert_eq!(of::<Around>(&app, own).0, expected, "{text}");
    }
}

#[test]
fn what_was_before_is_forgotten_with_the_recipe() {
    let mut app = wear::app();
    let (hair, _) = one_strand(&mut app, 0.2, 8, Vec3::X);
    app.world_mut().entity_mut(hair).insert(AirDrag { rate: 1.0 });
    let seven = add(&mut app, "(components: {\"AirDrag\": (rate: 7)})");
    app.world_mut().entity_mut(hair).insert(FollowRecipe(seven));
    app.update();
    assert_eq!(of::<AirDrag>(&app, hair).rate, 7.0);
    app.world_mut().entity_mut(hair).remove::<FollowRecipe>().insert(AirDrag { rate: 33.0 });
    app.update();
    let other = add(&mut app, "(components: {\"HairLod\": ()})");
    app.world_mut().entity_mut(hair).insert(FollowRecipe(other));
    app.update();
    assert_eq!(of::<AirDrag>(&app, hair).rate, 33.0);
}

#[test]
fn worn_hair_follows_its_recipe_and_grows_again_only_where_it_grows_otherwise() {
    let mut app = wear::app();
    let handle = add(&mut app, CURLS);
    let wear = WearHair { style: None, ..WearHair::of_recipe(handle.clone()) };
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    let first = lengths(&mut app, hair);
    assert!(first.len() > 10, "{} strands", first.len());
    assert!(first.iter().all(|length| *length < 0.12), "{first:?}");
    let look: HairLook = of(&app, hair);
    assert_eq!((look.roughness, look.melanin), (0.7, HairPreset::Bob.settings().look.melanin));
    assert_eq!(of::<HairStiffness>(&app, hair).bending_length, 0.11);
    assert_eq!(of::<AirDrag>(&app, hair).rate, 9.0);
    assert_eq!(app.world().get::<FollowRecipe>(hair), Some(&FollowRecipe(handle.clone())));

    // Another look, without the drag: the same hair, which has the drag of all hair again.
    app.world_mut().write_message(HairTreatment::wet(hair));
    run(&mut app, 1.5);
    app.world_mut().write_message(HairTreatment::dry(hair));
    run(&mut app, 0.2);
    let before = wear::strands(&mut app, hair);
    let other =
        CURLS.replace("roughness: 0.7", "roughness: 0.3").replace("\"AirDrag\": (rate: 9),", "");
    reload(&mut app, &handle, &other);
    assert_eq!(of::<HairLook>(&app, hair).roughness, 0.3);
    assert!(app.world().get::<AirDrag>(hair).is_none(), "it had none before");
    for (now, before) in wear::strands(&mut app, hair).iter().zip(&before) {
        assert!(now.positions()[5].distance(before.positions()[5]) < 5e-3, "it stays");
    }
    // Without a look: that of the preset.
    reload(&mut app, &handle, "(preset: Bob, planting: (density: 500, length: 0.1))");
    assert_eq!(of::<HairLook>(&app, hair), HairPreset::Bob.settings().look);
    let stiffness = HairPreset::Bob.settings().stiffness;
    assert_eq!(of::<HairStiffness>(&app, hair), stiffness);

    // Longer hair is grown again, and remembers.
    app.world_mut().entity_mut(hair).insert(HairStyle { fades_below: 0.1 });
    run(&mut app, 0.1);
    app.world_mut().write_message(HairTreatment::set(hair, BondKind::Hydrogen, 0.4).unwrap());
    run(&mut app, 0.2);
    let kept = |app: &App, hair| app.world().get::<KeptStyle>(hair).and_then(KeptStyle::kept);
    let share = kept(&app, hair).expect("a style");
    let longer = recipe(&app, &CURLS.replace(", length: 0.1", ", length: 0.15")).unwrap();
    app.world_mut().resource_mut::<Assets<HairRecipe>>().insert(&handle, longer).unwrap();
    let grown = worn(&mut app);
    assert_ne!(grown, hair);
    let second = lengths(&mut app, grown);
    assert_eq!(second.len(), first.len(), "on the same roots");
    let mean = |of: &[f32]| of.iter().sum::<f32>() / of.len() as f32;
    assert!(mean(&second) > 1.2 * mean(&first), "{} from {}", mean(&second), mean(&first));
    assert_eq!(of::<HairStiffness>(&app, grown).bending_length, 0.11);
    run(&mut app, 0.1);
    let now = kept(&app, grown).expect("the style is kept");
    assert!((now - share).abs() < 0.05, "{now} of {share}");
    assert_eq!(faults(&mut app), []);
}

#[test]
fn a_recipe_that_changes_while_its_hair_is_made_wins() {
    let mut app = wear::app();
    let handle = add(&mut app, CURLS);
    let root =
        app.world_mut().spawn((Transform::default(), WearHair::of_recipe(handle.clone()))).id();
    character(&mut app, root, 1.0);
    (0..3).for_each(|_| app.update());
    reload(&mut app, &handle, &CURLS.replace(", length: 0.1", ", length: 0.2"));
    let longest = wait_for(&mut app, |app| {
        let hair = app.world().get::<WornHair>(root)?.iter().next()?;
        let longest = lengths(app, hair).into_iter().fold(0.0, f32::max);
        (longest > 0.15).then_some(longest)
    });
    assert!(longest < 0.25, "{longest}");
}

#[test]
fn settings_of_a_file_are_put_on_any_hair_and_taken_off_again() {
    let mut app = wear::app();
    let (hair, _) = one_strand(&mut app, 0.2, 8, Vec3::X);
    let own = HairStiffness { bending_length: 0.2, damping: 0.02, ..default() };
    app.world_mut().entity_mut(hair).insert(own);
    let handle =
        add(&mut app, "(components: {\"HairStiffness\": (bending_length: 0.05), \"HairLod\": ()})");
    app.world_mut().entity_mut(hair).insert(FollowRecipe(handle.clone()));
    app.update();
    let with = HairStiffness { bending_length: 0.05, ..own };
    assert_eq!(of::<HairStiffness>(&app, hair), with, "the others are the hair's own");
    assert_eq!(of::<HairLod>(&app, hair), HairLod::default());
    // A list takes the place of the one before.
    let level = "(components: {\"HairLod\": (levels: [(below: 0.3)])})";
    reload(&mut app, &handle, level);
    assert_eq!(of::<HairLod>(&app, hair).levels, [LodLevel { below: 0.3, ..default() }]);
    assert_eq!(of::<HairStiffness>(&app, hair), own, "as it was before the file");
    reload(&mut app, &handle, "()");
    assert!(app.world().get::<HairLod>(hair).is_none());
    // Values beyond their range are reported, as when they are written by an inspector.
    reload(&mut app, &handle, "(components: {\"HairStiffness\": (bending_length: -1)})");
    run(&mut app, 0.1);
    let reported = faults(&mut app);
    assert!(
        matches!(&reported[..], [f] if f.kind == FaultKind::Setting && f.message.contains("bending_length")),
        "{reported:?}"
    );
}

#[test]
fn settings_on_a_wearer_are_those_of_all_its_hair() {
    let mut app = wear::app();
    let text = "(components: {\"AirDrag\": (rate: 7), \"HairStiffness\": (damping: 0.02)})";
    let handle = add(&mut app, text);
    let wear = WearHair::new(HairPreset::Short);
    let root = app.world_mut().spawn((Transform::default(), wear, FollowRecipe(handle))).id();
    character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    (0..3).for_each(|_| app.update());
    assert_eq!(of::<AirDrag>(&app, hair).rate, 7.0);
    let of_preset = HairPreset::Short.settings().stiffness;
    let expected = HairStiffness { damping: 0.02, ..of_preset };
    assert_eq!(of::<HairStiffness>(&app, hair), expected, "the others are the preset's");
    assert!(app.world().get::<AirDrag>(root).is_none());
    app.world_mut().entity_mut(root).remove::<FollowRecipe>();
    (0..3).for_each(|_| app.update());
    assert!(app.world().get::<FollowRecipe>(hair).is_none());
    assert_eq!(of::<AirDrag>(&app, hair).rate, 7.0, "what it has stays");
}

#[test]
fn recipes_that_cannot_be_used_are_reported_once() {
    let mut app = wear::app();
    let handle = app.world().resource::<AssetServer>().load("nowhere.recipe.ron");
    let (hair, _) = one_strand(&mut app, 0.2, 8, Vec3::X);
    app.world_mut().entity_mut(hair).insert(FollowRecipe(handle.clone()));
    let reported = wait_for(&mut app, |app| {
        let reported = faults(app);
        (!reported.is_empty()).then_some(reported)
    });
    run(&mut app, 0.2);
    assert!(reported.len() == 1 && reported[0].message.contains("nowhere"), "{reported:?}");
    assert_eq!(faults(&mut app), []);

    let root = app.world_mut().spawn((Transform::default(), WearHair::of_recipe(handle))).id();
    character(&mut app, root, 1.0);
    let refused = wait(&mut app).refused;
    assert!(
        matches!(&refused[..], [(_, WearError::NotLoaded { what: "recipe", .. })]),
        "{refused:?}"
    );
    // More strands than memory holds.
    let many = "(planting: (density: 500), components: {\"HairFollowers\": (count: 4294967295)})";
    let handle = add(&mut app, many);
    app.world_mut().entity_mut(root).insert(WearHair::of_recipe(handle));
    let refused = wait(&mut app).refused;
    assert!(refused[0].1.to_string().contains("HairFollowers::count"), "{refused:?}");
    // Two that would grow from the same roots.
    let handle = add(&mut app, "(preset: Short, planting: (length: 0.1))");
    let both = WearHair::of_recipe(handle).and(HairPreset::Short);
    app.world_mut().entity_mut(root).insert(both);
    let refused = wait(&mut app).refused;
    assert!(matches!(&refused[..], [(_, WearError::Twice { .. })]), "{refused:?}");
    // A value that no hair grows by.
    let handle = add(&mut app, "(planting: (density: -4))");
    app.world_mut().entity_mut(root).insert(WearHair::of_recipe(handle));
    let refused = wait(&mut app).refused;
    assert!(refused[0].1.to_string().contains("density"), "{refused:?}");
}

#[test]
fn any_text_is_a_recipe_or_an_error() {
    let mut app = wear::app();
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let whole = include_str!("../../assets/curls.recipe.ron");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(45);
    let (mut read, hair) = (0, one_strand(&mut app, 0.2, 8, Vec3::X).0);
    for _ in 0..20_000 {
        let mut text = whole.as_bytes().to_vec();
        for _ in 0..random.random_range(1..4) {
            if text.is_empty() {
                break;
            }
            let at = random.random_range(0..text.len());
            match random.random_range(0..5) {
                0 => text[at] = random.random(),
                1 => text.truncate(at.max(1)),
                2 => _ = text.remove(at),
                3 => text.insert(at, b"(){}[],:0-e9\""[random.random_range(0..13)]),
                _ => {
                    let (from, length) = (random.random_range(0..whole.len()), 12);
                    let piece = &whole.as_bytes()[from..whole.len().min(from + length)];
                    text.splice(at..at, piece.iter().copied());
                }
            }
        }
        let recipe = HairRecipe::from_ron(&text, &registry.read());
        if let Ok(recipe) = recipe {
            read += 1;
            let scalp = Scalp::default();
            _ = (recipe.planting(&scalp), recipe.hairline(), recipe.settings());
            let handle = app.world_mut().resource_mut::<Assets<HairRecipe>>().add(recipe);
            app.world_mut().entity_mut(hair).insert(FollowRecipe(handle));
            if read % 100 == 0 {
                app.update();
            }
        }
    }
    println!("{read} of 20000 are recipes");
    assert!((100..15_000).contains(&read), "{read}");
    run(&mut app, 0.1);
    assert!(app.world().get::<Strands>(hair).is_some());
}

/// Moves the first number of a value, however deep. Whether there is one.
fn nudge(value: &mut dyn PartialReflect) -> bool {
    let moved = |number: f64| if number == 0.0 { 1e-3 } else { number * 0.75 };
    if let Some(number) = value.try_downcast_mut::<f32>() {
        *number = moved(f64::from(*number)) as f32;
        return true;
    }
    if let Some(number) = value.try_downcast_mut::<f64>() {
        *number = moved(*number);
        return true;
    }
    if let Some(flag) = value.try_downcast_mut::<bool>() {
        *flag = !*flag;
        return true;
    }
    match value.reflect_mut() {
        ReflectMut::Struct(of) => {
            (0..of.field_len()).any(|i| of.field_at_mut(i).is_some_and(nudge))
        }
        ReflectMut::TupleStruct(of) => {
            (0..of.field_len()).any(|i| of.field_mut(i).is_some_and(nudge))
        }
        ReflectMut::Enum(of) => (0..of.field_len()).any(|i| of.field_at_mut(i).is_some_and(nudge)),
        ReflectMut::List(of) => (0..of.len()).any(|i| of.get_mut(i).is_some_and(nudge)),
        _ => false,
    }
}

/// What inspectors and scene files edit: each setting, with a value that is not its default, is written as text and put
/// on from it.
#[test]
fn every_setting_is_put_on_as_it_is_written_into_a_file() {
    let mut app = wear::app();
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    // Nothing acts on them meanwhile: a shower would rain.
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    let (mut moved, mut without_a_number) = (Vec::new(), Vec::new());
    let registry = registry.read();
    let written = |value: &dyn PartialReflect, name: &str| {
        ron::to_string(&TypedReflectSerializer::new(value, &registry))
            .unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    for kind in registry.iter() {
        let table = kind.type_info().type_path_table();
        let (Some(component), Some(default)) =
            (kind.data::<ReflectComponent>(), kind.data::<ReflectDefault>())
        else {
            continue;
        };
        if table.crate_name() != Some("bevy_keratin") {
            continue;
        }
        let mut value = default.default();
        let name = table.short_path();
        let is_moved = nudge(value.as_partial_reflect_mut());
        let text = written(value.as_partial_reflect(), name);
        let file = format!("(components: {{\"{name}\": {text}}})");
        let recipe = match HairRecipe::from_ron(file.as_bytes(), &registry) {
            // What entities are of whom is no setting, nor are resources, which are components in Bevy.
            Err(error) if error.message.contains("names entities") => continue,
            Err(error) if error.message.contains("is a resource") => continue,
            read => read.unwrap_or_else(|error| panic!("{file}: {error}")),
        };
        assert_eq!(recipe.components().collect::<Vec<_>>(), [kind.type_id()], "{name}");
        let handle = app.world_mut().resource_mut::<Assets<HairRecipe>>().add(recipe);
        let entity = app.world_mut().spawn(FollowRecipe(handle)).id();
        app.update();
        let put_on = component.reflect(app.world().entity(entity));
        let put_on = put_on.unwrap_or_else(|| panic!("{name} is not there"));
        assert_eq!(written(put_on.as_partial_reflect(), name), text, "{name}");
        app.world_mut().despawn(entity);
        match is_moved {
            true => moved.push(name),
            false => without_a_number.push(name),
        }
    }
    println!("moved {moved:?}, as it is {without_a_number:?}");
    assert!(moved.len() > 40, "{}", moved.len());
}
