//! The crate docs list every equation of both papers, and each link leads to an item whose own docs name
//! the equation.

use std::{
    fs,
    path::{Path, PathBuf},
};

const GLOSSARY: &str = include_str!("../../src/base/guide/glossary.md");

/// The rows of the table of equations: paper, first and last number, the path they link to.
fn rows() -> Vec<(String, u32, u32, String)> {
    let rows = GLOSSARY.lines().filter(|line| line.starts_with("| \\["));
    rows.map(|row| {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let (paper, numbers) = cells[1].split_once(' ').unwrap();
        let numbers: Vec<u32> = numbers
            .split(['–', ','])
            .map(|number| number.trim().parse().expect("a number of an equation"))
            .collect();
        let link = cells[3].split('`').nth(1).unwrap().trim_end_matches("::KajiyaKay");
        let first = numbers[0];
        (paper.replace('\\', ""), first, *numbers.last().unwrap(), link.to_owned())
    })
    .collect()
}

#[test]
fn every_equation_of_both_papers_is_listed_once() {
    for (paper, count) in [("[B]", 19), ("[W]", 5)] {
        for number in 1..=count {
            let listed = rows()
                .iter()
                .filter(|(p, from, to, _)| p == paper && (*from..=*to).contains(&number))
                .count();
            assert_eq!(listed, 1, "{paper} {number}");
        }
    }
}

#[test]
fn every_link_leads_to_an_item_that_runs_and_whose_docs_name_its_equation() {
    let files = sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    for (paper, from, to, link) in rows() {
        let path: Vec<&str> = link.split("::").collect();
        let (item, rooms) = path.split_last().unwrap();
        // The item may be re-exported by its room: it is in one of the room's files.
        let room: PathBuf = rooms.iter().take(2).collect();
        let within = |file: &&(PathBuf, String)| {
            let inside = file.0.to_str().unwrap().split_once("/src/").unwrap().1;
            Path::new(inside).with_extension("").starts_with(&room)
                || Path::new(inside).starts_with(rooms[0]) && rooms.len() == 1
        };
        let docs = files.iter().filter(within).find_map(|(_, text)| docs_of(text, item));
        let docs = docs.unwrap_or_else(|| panic!("{link} does not exist"));
        let about = |number: u32| {
            let mut numbers = docs.split(|c: char| !c.is_ascii_digit());
            numbers.any(|found| found == number.to_string())
        };
        assert!(docs.to_lowercase().contains("equation"), "{link} names no equation");
        assert!(about(from) && about(to), "{link} does not name {paper} {from} to {to}");
        let calls: usize = files.iter().map(|(_, text)| uses_of(text, item)).sum();
        assert!(calls > 0, "only tests use {link}");
    }
}

/// All source files with what is compiled outside tests.
fn sources(folder: &Path) -> Vec<(PathBuf, String)> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && !path.ends_with("tests") {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
            let text = fs::read_to_string(&path).unwrap();
            let code = text.split("\n#[cfg(test)]\nmod tests {").next().unwrap().to_owned();
            files.push((path, code));
        }
    }
    files
}

/// How often code calls, constructs or names an item, outside of comments, imports and its own declaration.
fn uses_of(text: &str, item: &str) -> usize {
    let is_code = |line: &&str| {
        let line = line.trim_start();
        let declares = ["fn ", "struct ", "enum "].iter().any(|kind| {
            line.split_once(kind).is_some_and(|(before, rest)| {
                before.chars().all(|c| c.is_alphanumeric() || " ()".contains(c))
                    && rest.starts_with(item)
            })
        });
        !line.starts_with("//") && !declares
    };
    let uses = ["(", "::", "<", " {", " =>", "."].map(|after| format!("{item}{after}"));
    let lines = text.lines().filter(is_code);
    let own_word = |line: &str, at: usize| {
        !line[..at].ends_with(|c: char| c.is_alphanumeric() || "_.".contains(c))
    };
    lines
        .filter(|line| !line.trim_start().starts_with("impl"))
        .filter(|line| uses.iter().any(|u| line.match_indices(u).any(|(at, _)| own_word(line, at))))
        .count()
}

/// The doc comment in front of a public item.
fn docs_of(text: &str, item: &str) -> Option<String> {
    let lines: Vec<&str> = text.lines().collect();
    let declares = |line: &&str| {
        ["pub fn ", "pub struct ", "pub enum "].iter().any(|kind| {
            let rest = line.trim_start().strip_prefix(kind).and_then(|l| l.strip_prefix(item));
            rest.is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
        })
    };
    let at = lines.iter().position(declares)?;
    let docs = lines[..at].iter().rev();
    let docs = docs.take_while(|line| {
        line.trim_start().starts_with("//") || line.trim_start().starts_with("#[")
    });
    // Variants carry docs of their own, below.
    let below = lines[at..].iter().take_while(|line| **line != "}");
    Some(docs.chain(below).filter(|l| l.trim_start().starts_with("///")).copied().collect())
}
