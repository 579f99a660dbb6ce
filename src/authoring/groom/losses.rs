//! Everything that reading a groom left out or changed: how often, and where.

use super::GroomError;
use bevy::prelude::*;
use core::{fmt, ops::AddAssign};

/// Where in a file something was left out. Strands and nodes have the numbers that they have in the file,
/// from 0.
#[derive(Reflect, Clone, Debug, PartialEq, Eq)]
#[reflect(Clone, PartialEq)]
pub enum GroomPlace {
    /// A strand.
    Strand(usize),
    /// A node, from the root.
    Node {
        /// Its strand.
        strand: usize,
        /// Its number on it.
        node: usize,
    },
    /// A byte of the file.
    Byte(u64),
    /// A part of the file by its name, with what is wrong with it.
    Part(String),
}

impl fmt::Display for GroomPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Strand(strand) => write!(f, "strand {strand}"),
            Self::Node { strand, node } => write!(f, "strand {strand} node {node}"),
            Self::Byte(byte) => write!(f, "from byte {byte}"),
            Self::Part(part) => f.write_str(part),
        }
    }
}

/// How often something was left out, and where first.
#[derive(Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub struct GroomLoss {
    /// How often.
    pub count: usize,
    /// Where, up to [`MOST_PLACES`](Self::MOST_PLACES) of them.
    pub places: Vec<GroomPlace>,
}

impl GroomLoss {
    /// How many places are kept of each kind of loss.
    pub const MOST_PLACES: usize = 16;

    pub(super) fn add(&mut self, place: GroomPlace) {
        self.add_many(1, place);
    }

    pub(super) fn add_many(&mut self, count: usize, first: GroomPlace) {
        self.count += count;
        if self.places.len() < Self::MOST_PLACES {
            self.places.push(first);
        }
    }

    pub(super) fn add_node(&mut self, strand: usize, node: usize) {
        self.add(GroomPlace::Node { strand, node });
    }
}

impl AddAssign for GroomLoss {
    fn add_assign(&mut self, other: Self) {
        self.count += other.count;
        let room = Self::MOST_PLACES.saturating_sub(self.places.len());
        self.places.extend(other.places.into_iter().take(room));
    }
}

macro_rules! losses {
    ($($(#[$doc:meta])* $field:ident: $what:literal, $broken:literal;)*) => {
        /// What was left out of a groom, or changed, when it was read: the one place where all of it is
        /// counted. Loading logs it once; [`Display`](fmt::Display) gives the sentence.
        #[derive(Reflect, Clone, Debug, Default, PartialEq, Eq)]
        #[reflect(Default, Clone, PartialEq)]
        pub struct GroomLosses {
            $($(#[$doc])* pub $field: GroomLoss,)*
        }

        impl GroomLosses {
            /// Each with what it says, and whether the file is broken there.
            fn all(&self) -> impl Iterator<Item = (&GroomLoss, &'static str, bool)> {
                [$((&self.$field, $what, $broken)),*].into_iter()
            }

            fn all_mut(&mut self) -> impl Iterator<Item = &mut GroomLoss> {
                [$(&mut self.$field),*].into_iter()
            }
        }

        impl AddAssign for GroomLosses {
            fn add_assign(&mut self, other: Self) {
                $(self.$field += other.$field;)*
            }
        }
    };
}

losses! {
    /// Strands left out because a number of theirs is not finite or cannot be, such as a negative width.
    broken_strands: "strands with a broken number left out", true;
    /// Strands left out because a node is many times as far away as all others.
    far_strands: "strands that reach far away from all others left out", true;
    /// Strands left out because their root lies apart from all others, alone or with others at exactly the
    /// same place, or because one segment jumps across the whole groom. Exporters put roots that they do not
    /// find at the origin.
    stray_strands: "strays left out", true;
    /// Optional arrays left out because they have no data, the wrong length, or numbers that most strands
    /// cannot have.
    broken_arrays: "broken arrays left out", true;
    /// Weights of bones left out because the bone is not there, or they are negative or not finite.
    broken_bones: "weights of bones left out that cannot be", true;
    /// Roots that no bone of a `.tfxbone` moves: they stay with the hair.
    unbound_roots: "roots without bones", true;
    /// Bytes behind the end of what the file's header gives.
    unread_bytes: "bytes after the end not read", true;
    /// Strands left out because they have no segment or no length.
    short_strands: "strands without length left out", false;
    /// Strands left out because the settings ask for fewer.
    thinned_strands: "strands left out by the settings", false;
    /// Strands stored from tip to root, turned.
    turned_strands: "strands stored tip first turned", false;
    /// Nodes merged with the one before, because segments were shorter than the settings allow.
    merged_nodes: "nodes merged with the one before", false;
    /// Nodes besides the root that the file marks as fixed; only roots are held.
    freed_nodes: "fixed nodes besides roots set free", false;
    /// Roots that a `.tfxbone` does not name and that follow the bones of the last one that it does.
    assumed_bones: "roots bound like the last one of the bones' file", false;
    /// Arrays of the file that a groom cannot hold, or of a type that is not read.
    unread_arrays: "arrays not read", false;
    /// Other files that a USD file refers to, which are not read.
    unread_files: "other files not read: flatten the file by usdcat --flatten, or pack them by usdzip", false;
    /// Primitives of a glTF file, and objects of an Alembic archive or a USD file, that are no lines.
    skipped_primitives: "primitives skipped that are no lines", false;
    /// Curve sets that are hidden, by themselves or with what they are in.
    hidden_curves: "hidden curve sets left out", false;
    /// Curve sets without any curve.
    empty_curves: "empty curve sets left out", false;
    /// Samples of animated curves after the first.
    unread_samples: "samples of animated curves after the first not read (a GroomCache has them)", false;
    /// Closed lines opened at their first node.
    opened_loops: "closed lines opened", false;
    /// Nodes where a line branched and was split.
    split_branches: "branching lines split", false;
}

impl GroomLosses {
    /// Whether nothing was left out.
    pub fn is_empty(&self) -> bool {
        self.all().all(|(loss, ..)| loss.count == 0)
    }

    /// Whether something was left out because the file is broken there, which
    /// [`GroomSettings::strict`](super::GroomSettings::strict) refuses.
    pub fn is_broken(&self) -> bool {
        self.all().any(|(loss, _, broken)| broken && loss.count > 0)
    }

    /// An error if something was left out because the file is broken.
    pub(super) fn refuse_broken(&self) -> Result<(), GroomError> {
        let broken = self.sentence(|broken| broken);
        if broken.is_empty() { Ok(()) } else { Err(GroomError::Strict { broken }) }
    }

    /// Gives strands the numbers that they have in the file.
    pub(super) fn renumber(&mut self, numbers: &[u32]) {
        for place in self.all_mut().flat_map(|loss| &mut loss.places) {
            if let GroomPlace::Strand(strand) | GroomPlace::Node { strand, .. } = place {
                *strand = numbers.get(*strand).map_or(*strand, |number| *number as usize);
            }
        }
    }

    fn sentence(&self, which: impl Fn(bool) -> bool) -> String {
        let found = self.all().filter(|(loss, _, broken)| loss.count > 0 && which(*broken));
        let found = found.map(|(loss, what, _)| {
            let mut places: Vec<String> = loss.places.iter().map(ToString::to_string).collect();
            if places.len() < loss.count && places.len() == GroomLoss::MOST_PLACES {
                places.push("…".to_owned());
            }
            match places.is_empty() {
                true => format!("{} {what}", loss.count),
                false => format!("{} {what} ({})", loss.count, places.join(", ")),
            }
        });
        found.collect::<Vec<_>>().join("; ")
    }
}

impl fmt::Display for GroomLosses {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let all = self.sentence(|_| true);
        f.write_str(if all.is_empty() { "nothing left out" } else { &all })
    }
}
