//! Groups of strands, set by set.

use crate::authoring::groom::GroomGroup;
use bevy::platform::collections::HashMap;

/// More are not kept: each strand may name its own.
const MOST: usize = 1024;
/// Names are cut to so many characters.
const LONGEST: usize = 200;

#[derive(Default)]
pub struct Groups {
    pub all: Vec<GroomGroup>,
    /// Indices into them, or beyond; one a strand.
    pub of_strands: Vec<u32>,
    /// Whether a set has numbers or names of groups.
    pub is_known: bool,
    pub sets: usize,
}

impl Groups {
    /// The curves of a set, by the numbers of their groups and their index; names are one for all, or one a curve.
    pub fn add(
        &mut self,
        curves: impl Iterator<Item = (Option<i32>, usize)>,
        names: &[&str],
        path: &str,
    ) {
        self.sets += 1;
        self.is_known |= !names.is_empty();
        let whole = path.rsplit('/').next().unwrap_or_default();
        let mut known: HashMap<(i32, &str), u32> = HashMap::default();
        for (id, curve) in curves {
            self.is_known |= id.is_some();
            let own = if names.len() == 1 { names.first() } else { names.get(curve) };
            let (id, name) = (id.unwrap_or(0), own.copied().unwrap_or(whole));
            let next = self.all.len();
            let index = match known.get(&(id, name)) {
                Some(index) => *index,
                None if next < MOST => {
                    let name_kept = name.chars().take(LONGEST).collect();
                    self.all.push(GroomGroup { id, name: name_kept, path: path.to_owned() });
                    known.insert((id, name), next as u32);
                    next as u32
                }
                None => u32::MAX,
            };
            self.of_strands.push(index);
        }
    }
}
