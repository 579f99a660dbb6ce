//! Counts of what reading and reshaping a groom left out.

use bevy::prelude::*;
use core::{fmt, ops::AddAssign};

/// Counts of what was left out of a groom when it was read. Loading logs it once;
/// [`Display`](fmt::Display) gives the sentence.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub struct GroomLosses {
    /// Strands left out because they have no segment or no length.
    pub short_strands: usize,
    /// Strands left out because the settings ask for fewer.
    pub thinned_strands: usize,
    /// Nodes merged with the one before, because segments were shorter than the settings allow.
    pub merged_nodes: usize,
    /// Nodes besides the root that the file marks as fixed; only roots are held.
    pub freed_nodes: usize,
    /// Arrays of the file that a groom cannot hold.
    pub unread_arrays: usize,
    /// Primitives of a glTF file that are no lines.
    pub skipped_primitives: usize,
    /// Closed lines opened at their first node.
    pub opened_loops: usize,
    /// Nodes where a line branched and was split.
    pub split_branches: usize,
}

impl GroomLosses {
    fn counts(&self) -> [(usize, &'static str); 8] {
        [
            (self.short_strands, "strands without length left out"),
            (self.thinned_strands, "strands left out by the settings"),
            (self.merged_nodes, "nodes merged with the one before"),
            (self.freed_nodes, "fixed nodes besides roots set free"),
            (self.unread_arrays, "arrays not read"),
            (self.skipped_primitives, "primitives skipped that are no lines"),
            (self.opened_loops, "closed lines opened"),
            (self.split_branches, "branching lines split"),
        ]
    }

    /// Whether nothing was left out.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl AddAssign for GroomLosses {
    fn add_assign(&mut self, other: Self) {
        self.short_strands += other.short_strands;
        self.thinned_strands += other.thinned_strands;
        self.merged_nodes += other.merged_nodes;
        self.freed_nodes += other.freed_nodes;
        self.unread_arrays += other.unread_arrays;
        self.skipped_primitives += other.skipped_primitives;
        self.opened_loops += other.opened_loops;
        self.split_branches += other.split_branches;
    }
}

impl fmt::Display for GroomLosses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (count, what) in self.counts() {
            if count > 0 {
                write!(f, "{separator}{count} {what}")?;
                separator = ", ";
            }
        }
        if separator.is_empty() { f.write_str("nothing left out") } else { Ok(()) }
    }
}
