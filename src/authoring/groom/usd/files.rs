//! The layers of a USD file in memory: one, or those of a `.usdz` package.

use crate::authoring::groom::{
    GroomFileError,
    bytes::{Bytes, value},
};
use bevy::platform::collections::HashMap;
use openusd::ar::{Asset, ResolvedPath, Resolver};
use std::{io, path::Path};

/// What a package's end begins with, and how long it is without its comment.
const END: &[u8] = b"PK\x05\x06";
const END_SIZE: usize = 22;
const LONGEST_COMMENT: usize = u16::MAX as usize;
const ENTRY: u32 = 0x0201_4b50;
const LOCAL: u32 = 0x0403_4b50;
const PACK_AGAIN: &str = "pack it again by usdzip, which does not compress";

/// Layers by their names; the first is the root.
pub struct Files<'a> {
    pub root: String,
    pub all: Vec<(String, &'a [u8])>,
}

impl<'a> Files<'a> {
    /// A file, or what is in it if it is a package.
    pub fn of(file: &'a [u8]) -> Result<Self, GroomFileError> {
        let all = match file {
            [b'P', b'K', 3, 4, ..] => unpacked(file)?,
            [b'#', ..] => vec![("groom.usda".to_owned(), file)],
            _ => vec![("groom.usdc".to_owned(), file)],
        };
        let root = all.first().map(|(name, _)| name.clone()).unwrap_or_default();
        Ok(Self { root, all })
    }

    /// Finds these layers, and no other files.
    pub fn resolver(&self) -> impl Resolver + use<> {
        let all = self.all.iter().map(|(name, bytes)| (name.clone(), bytes.to_vec()));
        InMemory(all.collect())
    }
}

/// The layers of a package, which are stored as they are.
fn unpacked(file: &[u8]) -> Result<Vec<(String, &[u8])>, GroomFileError> {
    let bytes = Bytes(file);
    let half = |at: u64, what| {
        bytes.array(at, 1, 2, what).map(|two| u64::from(u16::from_le_bytes([two[0], two[1]])))
    };
    let word = |at: u64, what| bytes.u32(at, what).map(u64::from);
    let tail = file.len().saturating_sub(END_SIZE + LONGEST_COMMENT);
    let Some(end) = file[tail..].windows(END.len()).rposition(|part| part == END) else {
        let hint = "the package is cut short: fetch or export it again";
        return value(file.len() as u64, "the end of the package", "missing", "PK 5 6", hint);
    };
    let end = (tail + end) as u64;
    bytes.array(end, 1, END_SIZE as u64, "the end of the package")?;
    let (count, mut at) = (half(end + 10, "the package's end")?, word(end + 16, "its directory")?);
    let mut all = Vec::new();
    for _ in 0..count {
        const WHAT: &str = "an entry of the package";
        if word(at, WHAT)? != u64::from(ENTRY) {
            return value(at, WHAT, "something else", "PK 1 2", PACK_AGAIN);
        }
        let (method, size) = (half(at + 10, WHAT)?, word(at + 24, WHAT)?);
        let lengths = half(at + 30, WHAT)? + half(at + 32, WHAT)?;
        let (length, local) = (half(at + 28, WHAT)?, word(at + 42, WHAT)?);
        let name = String::from_utf8_lossy(bytes.array(at + 46, length, 1, WHAT)?).into_owned();
        if is_layer(&name) {
            if method != 0 {
                let found = format!("{method} of {name:?}");
                return value(at + 10, "the method of compression", found, 0, PACK_AGAIN);
            }
            if word(local, WHAT)? != u64::from(LOCAL) {
                return value(local, WHAT, "something else", "PK 3 4", PACK_AGAIN);
            }
            let start = local + 30 + half(local + 26, WHAT)? + half(local + 28, WHAT)?;
            all.push((normal(&name), bytes.array(start, size, 1, "a layer of the package")?));
        }
        at += 46 + length + lengths;
    }
    if all.is_empty() {
        let hint = "pack the layer first, by usdzip";
        return value(end, "the package", "without layers", "a .usd, .usda or .usdc", hint);
    }
    Ok(all)
}

/// Whether a file of this name has a layer.
fn is_layer(name: &str) -> bool {
    let extension = Path::new(name).extension().and_then(|e| e.to_str()).unwrap_or_default();
    ["usd", "usda", "usdc"].contains(&extension)
}

/// A path without `.` and `..`; what would lead out of the package stays in it.
fn normal(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => drop(parts.pop()),
            part => parts.push(part),
        }
    }
    parts.join("/")
}

struct InMemory(HashMap<String, Vec<u8>>);

impl Resolver for InMemory {
    fn create_identifier(&self, asset_path: &str, anchor: Option<&ResolvedPath>) -> String {
        let folder = anchor.and_then(|anchor| anchor.parent()).and_then(|folder| folder.to_str());
        match folder {
            Some(folder) if !asset_path.starts_with('/') => {
                normal(&format!("{folder}/{asset_path}"))
            }
            _ => normal(asset_path),
        }
    }

    fn resolve(&self, asset_path: &str) -> Option<ResolvedPath> {
        self.0.contains_key(asset_path).then(|| ResolvedPath::new(asset_path))
    }

    fn resolve_for_new_asset(&self, _: &str) -> Option<ResolvedPath> {
        None
    }

    fn open_asset(&self, path: &ResolvedPath) -> io::Result<Box<dyn Asset>> {
        let bytes = path.to_str().and_then(|path| self.0.get(path));
        let bytes = bytes.ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))?;
        Ok(Box::new(io::Cursor::new(bytes.clone())))
    }

    fn get_modification_timestamp(
        &self,
        _: &str,
        _: &ResolvedPath,
    ) -> Option<std::time::SystemTime> {
        None
    }
}
