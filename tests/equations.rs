//! The crate docs list every equation of both papers, and each link leads to an item whose own docs name
//! the equation.

use std::{fs, path::Path};

const GLOSSARY: &str = include_str!("../src/guide/glossary.md");

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
fn every_link_leads_to_an_item_whose_docs_name_its_equation() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for (paper, from, to, link) in rows() {
        let path: Vec<&str> = link.split("::").collect();
        let item = path[path.len() - 1];
        // The item may be re-exported by its room: it is in one of the room's files.
        let files = fs::read_dir(src.join(path[0])).unwrap();
        let mut texts =
            files.map(|file| fs::read_to_string(file.unwrap().path()).unwrap_or_default());
        let docs = texts.find_map(|text| docs_of(&text, item));
        let docs = docs.unwrap_or_else(|| panic!("{link} does not exist"));
        let about = |number: u32| {
            let mut numbers = docs.split(|c: char| !c.is_ascii_digit());
            numbers.any(|found| found == number.to_string())
        };
        assert!(docs.to_lowercase().contains("equation"), "{link} names no equation");
        assert!(about(from) && about(to), "{link} does not name {paper} {from} to {to}");
    }
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
