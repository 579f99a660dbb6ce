//! README and book: samples can be pasted, they are whole, and name the Bevy that the crate is built on; links and
//! examples are there. That samples compile is seen by the doc tests, which are made of them.

use crate::architecture::files_below;
use bevy::{
    asset::RenderAssetUsages,
    image::{CompressedImageFormats, ImageSampler, ImageType},
    prelude::*,
};
use std::{
    fs,
    path::{Path, PathBuf},
};

const README: &str = include_str!("../../README.md");
const MANIFEST: &str = include_str!("../../Cargo.toml");

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The book's chapters in their order, by file.
fn chapters() -> Vec<(PathBuf, String)> {
    let folder = root().join("docs/src");
    let summary = fs::read_to_string(folder.join("SUMMARY.md")).unwrap();
    let files =
        summary.split("](").skip(1).map(|rest| folder.join(rest.split(')').next().unwrap()));
    files.map(|file| (file.clone(), fs::read_to_string(file).unwrap())).collect()
}

/// The README and the book's chapters.
fn pages() -> Vec<(PathBuf, String)> {
    let readme = (root().join("README.md"), README.to_owned());
    core::iter::once(readme).chain(chapters()).collect()
}

#[test]
fn the_readme_is_short() {
    assert!(README.lines().count() <= 150);
}

#[test]
fn every_chapter_is_listed_and_compiled_with_its_samples() {
    let listed: Vec<_> = chapters().into_iter().map(|(file, _)| file).collect();
    let lib = fs::read_to_string(root().join("src/lib.rs")).unwrap();
    for file in fs::read_dir(root().join("docs/src")).unwrap() {
        let file = file.unwrap().path();
        let name = file.file_name().unwrap().to_str().unwrap().to_owned();
        if name != "SUMMARY.md" {
            assert!(listed.contains(&file), "{name} is not in SUMMARY.md");
            let has_samples = fs::read_to_string(&file).unwrap().contains("```rust");
            assert!(!has_samples || lib.contains(&name), "samples of {name} are not compiled");
        }
    }
}

#[test]
fn links_lead_to_files_that_are_there() {
    for (file, text) in pages() {
        for link in text.split("](").skip(1) {
            let target = link.split([')', '#']).next().unwrap();
            if !target.is_empty() && !target.starts_with("http") {
                let path = file.parent().unwrap().join(target);
                assert!(path.exists(), "{}: {target}", file.display());
            }
        }
    }
}

#[test]
fn the_index_of_words_names_each_setting() {
    let index = fs::read_to_string(root().join("docs/src/index-of-words.md")).unwrap();
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let words: Vec<&str> = index.split(|c: char| !is_part(c)).collect();
    let mut count = 0;
    for file in files_below(&root().join("src"), "rs") {
        let text = fs::read_to_string(&file).unwrap();
        let blocks = text.split("\nsetting! {\n").skip(1);
        for block in blocks.map(|rest| rest.split("\n}").next().unwrap()) {
            let Some(named) = block.split("\n    pub struct ").nth(1) else { continue };
            let name = named.split(|c: char| !is_part(c)).next().unwrap();
            assert!(words.contains(&name), "{}: {name} is not named", file.display());
            count += 1;
        }
    }
    assert!(count >= 45, "only {count} settings");
}

/// The book shows the substep as it runs.
#[test]
fn the_book_has_the_table_of_a_substep() {
    let how = fs::read_to_string(root().join("docs/src/how.md")).unwrap();
    let table = include_str!("../../src/base/guide/substep.md");
    for row in table.lines().filter(|line| line.starts_with("| ")) {
        let does = row.trim_end_matches(" |").rsplit("| ").next().unwrap();
        assert!(how.contains(does), "{row}");
    }
}

/// The blocks of code that begin so, without the fences.
fn blocks(text: &'static str, language: &str) -> Vec<Vec<&'static str>> {
    let mut found = Vec::new();
    let mut lines = text.lines();
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
    let texts = pages().into_iter().map(|(_, text)| &*text.leak());
    let samples: Vec<_> = texts.flat_map(|text| blocks(text, "rust")).collect();
    assert!(samples.len() >= 12, "only {} samples", samples.len());
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

/// Games have a second character: what asks for the only one of its kind then runs no more, in silence.
#[test]
fn samples_survive_a_second_character() {
    let docs = files_below(&root().join("src"), "rs").into_iter().map(|file| {
        let text = fs::read_to_string(&file).unwrap();
        let is_doc = |line: &&str| line.trim_start().starts_with("//");
        (file, text.lines().filter(is_doc).collect::<Vec<_>>().join("\n"))
    });
    for (file, text) in pages().into_iter().chain(docs) {
        for only in ["Single<", ".single(", ".single_mut("] {
            assert!(!text.contains(only), "{only} in {}", file.display());
        }
    }
}

/// A sample that is pasted needs the two preludes. Functions of a file format are called by its module.
#[test]
fn samples_need_only_the_prelude() {
    for (file, text) in pages() {
        let uses = text.lines().filter(|line| line.starts_with("use bevy_keratin::"));
        for line in uses {
            let is_known = line == "use bevy_keratin::prelude::*;"
                || line == "use bevy_keratin::{authoring::groom::alembic, prelude::*};";
            assert!(is_known, "{}: {line}", file.display());
        }
    }
}

#[test]
fn the_bevy_that_is_named_is_the_one_that_it_is_built_on() {
    let version = |text: &str, before: &str| {
        let at = text.find(before).unwrap_or_else(|| panic!("no {before}")) + before.len();
        text[at..].split('"').next().unwrap().to_owned()
    };
    let built_on = version(MANIFEST, "bevy = { version = \"");
    let install =
        blocks(README, "toml").into_iter().find(|block| block[0] == "[dependencies]").unwrap();
    assert_eq!(version(&install.join("\n"), "bevy = \""), built_on);
}

#[test]
fn examples_that_are_named_are_there() {
    let all: String = pages().into_iter().map(|(_, text)| text).collect();
    let words = all.split("--example ").skip(1);
    let names = words.filter_map(|rest| rest.split([' ', '\n', '`']).next());
    let folder = root().join("examples");
    let mut count = 0;
    for name in names {
        let is_there = folder.join(format!("{name}.rs")).exists()
            || folder.join(name).join("main.rs").exists()
            || MANIFEST.contains(&format!("name = \"{name}\"\npath = \"examples/"));
        assert!(is_there, "--example {name}");
        count += 1;
    }
    assert!(count >= 4, "only {count} examples are named");
}

/// Pictures from before the renderer that there is: their colours are those of a palette. None is the aim.
const OF_OLD: [&str; 3] = ["shower-lifted", "shower-on", "shower-pressed"];

/// T17. What is shown has all its colours, is not burnt out, and stands out from its ground.
#[test]
fn pictures_have_many_colours_and_contrast() {
    let [r, g, b, _] = bevy_keratin::render::heat(1.0).to_srgba().to_u8_array();
    let heat_end = [r, g, b];
    let mut count = 0;
    let all: String = pages().into_iter().map(|(_, text)| text).collect();
    for part in all.split("assets/").skip(1) {
        if !part.split(')').next().unwrap().ends_with(['g', 'p']) {
            continue;
        }
        let name = part.split(')').next().unwrap();
        let bytes = std::fs::read(root().join("assets").join(name)).unwrap();
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
