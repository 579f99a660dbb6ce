//! The README's samples can be pasted: they are whole, and name the Bevy that the crate is built on.
//! That they compile is seen by the doc tests, which are made of them.

use bevy::{
    asset::RenderAssetUsages,
    image::{CompressedImageFormats, ImageSampler, ImageType},
    prelude::*,
};

const README: &str = include_str!("../../README.md");
const MANIFEST: &str = include_str!("../../Cargo.toml");

/// The blocks of code that begin so, without the fences.
fn blocks(language: &str) -> Vec<Vec<&'static str>> {
    let mut found = Vec::new();
    let mut lines = README.lines();
    while let Some(line) = lines.next() {
        let Some(fence) = line.strip_prefix("```") else { continue };
        let block: Vec<_> = lines.by_ref().take_while(|line| !line.starts_with("```")).collect();
        if fence.split(',').next() == Some(language) {
            found.push(block);
        }
    }
    found
}

#[test]
fn samples_are_whole() {
    let samples = blocks("rust");
    assert!(samples.len() >= 8, "only {} samples", samples.len());
    for sample in samples {
        let text = sample.join("\n");
        // Hidden lines are hidden in the docs only: who pastes from the README has them.
        assert!(!sample.iter().any(|line| line.trim_start().starts_with("# ")), "{text}");
        assert!(text.contains("use bevy::prelude::*;"), "{text}");
        assert!(text.contains("use bevy_keratin::"), "{text}");
        let is_item = |line: &&str| {
            ["use ", "fn ", "#[", "struct ", "//"].iter().any(|w| line.starts_with(w))
        };
        let is_inside = |line: &&str| line.is_empty() || line.starts_with([' ', '}', ')']);
        let stray = sample.iter().find(|line| !is_item(line) && !is_inside(line));
        assert_eq!(stray, None, "a statement outside of a function:\n{text}");
    }
}

#[test]
fn the_bevy_that_is_named_is_the_one_that_it_is_built_on() {
    let version = |text: &str, before: &str| {
        let at = text.find(before).unwrap_or_else(|| panic!("no {before}")) + before.len();
        text[at..].split('"').next().unwrap().to_owned()
    };
    let built_on = version(MANIFEST, "bevy = { version = \"");
    let install = blocks("toml").into_iter().find(|block| block[0] == "[dependencies]").unwrap();
    assert_eq!(version(&install.join("\n"), "bevy = \""), built_on);
}

#[test]
fn examples_that_are_named_are_there() {
    let words = README.split("--example ").skip(1);
    let names = words.filter_map(|rest| rest.split([' ', '\n', '`']).next());
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let mut count = 0;
    for name in names {
        let is_there = folder.join(format!("{name}.rs")).exists()
            || folder.join(name).join("main.rs").exists()
            || MANIFEST.contains(&format!("name = \"{name}\"\npath = \"examples/"));
        assert!(is_there, "--example {name}");
        count += 1;
    }
    assert!(count >= 8, "only {count} examples are named");
}

/// Pictures from before the renderer that there is: their colours are those of a palette. None is the aim.
const OF_OLD: [&str; 3] = ["shower-lifted", "shower-on", "shower-pressed"];

/// T17. What is shown has all its colours, is not burnt out, and stands out from its ground.
#[test]
fn pictures_have_many_colours_and_contrast() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let [r, g, b, _] = bevy_keratin::render::heat(1.0).to_srgba().to_u8_array();
    let heat_end = [r, g, b];
    let mut count = 0;
    for part in README.split("](assets/").skip(1) {
        let name = part.split(')').next().unwrap();
        let bytes = std::fs::read(folder.join("assets").join(name)).unwrap();
        assert!(bytes.len() < 5_000_000, "{name} is too large to be loaded with a page");
        let Some(stem) = name.strip_suffix(".png") else { continue };
        if OF_OLD.contains(&stem) {
            continue;
        }
        // Depth and kind of a PNG's colours: 8 bits, RGB.
        assert_eq!(bytes[24..26], [8, 2], "{name}");
        let picture = Image::from_buffer(
            &bytes,
            ImageType::Extension("png"),
            CompressedImageFormats::NONE,
            true,
            ImageSampler::Default,
            RenderAssetUsages::MAIN_WORLD,
        );
        let data = picture.unwrap().data.unwrap();
        let mut pixels: Vec<[u8; 3]> = data.chunks_exact(4).map(|p| [p[0], p[1], p[2]]).collect();
        // The end of a heat map's scale is no light.
        let is_burnt = |p: &[u8; 3]| p.contains(&255) && *p != heat_end;
        let burnt = pixels.iter().filter(|p| is_burnt(p)).count() as f32;
        let burnt = burnt / pixels.len() as f32;
        let mut light: Vec<f32> =
            pixels.iter().map(|[r, g, b]| Color::srgb_u8(*r, *g, *b).luminance()).collect();
        light.sort_by(f32::total_cmp);
        let (dark, bright) = (light[light.len() / 20], light[light.len() * 19 / 20]);
        pixels.sort_unstable();
        pixels.dedup();
        let colours = pixels.len();
        println!("{name}: {colours} colours, {burnt:.4} burnt out, light {dark:.3} to {bright:.3}");
        assert!(colours > 20_000, "{name}: {colours} colours");
        assert!(burnt < 0.005, "{name}: {burnt} burnt out");
        assert!((bright + 0.05) / (dark + 0.05) > 1.6, "{name}: {dark} to {bright}");
        count += 1;
    }
    assert!(count >= 3, "only {count} pictures");
}
