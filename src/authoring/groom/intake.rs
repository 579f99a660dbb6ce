//! A groom on its way in from a file: strands that cannot be are left out, and those that stay keep the
//! numbers that they have in the file.

use super::{Groom, GroomError, GroomLosses, RootBones, UpAxis, losses::GroomPlace};
use bevy::utils::default;

/// A groom with the number that each strand has in its file, and what was left out.
#[derive(Clone, Debug, Default)]
pub(super) struct Intake {
    pub groom: Groom,
    numbers: Vec<u32>,
    all: usize,
    /// The numbers of strands that were stored from tip to root.
    pub(super) turned: Vec<usize>,
    pub losses: GroomLosses,
    /// Metres per unit and the axis that is up, where the file says them.
    pub scale: Option<f32>,
    pub up: Option<UpAxis>,
}

impl Intake {
    /// A valid groom.
    pub fn of(groom: Groom) -> Result<Self, GroomError> {
        groom.check()?;
        Ok(Self::new(groom, GroomLosses::default()))
    }

    fn new(groom: Groom, losses: GroomLosses) -> Self {
        let all = groom.len();
        Self { numbers: (0..all as u32).collect(), all, groom, losses, ..default() }
    }

    /// A groom as a file has it, whose numbers may be any: without strands of a single node or with a broken
    /// number. An optional array that would break more than half of them is left out instead.
    ///
    /// # Errors
    /// When no strand is left, or its arrays do not fit each other.
    pub fn cleaned(groom: Groom, losses: GroomLosses) -> Result<Self, GroomError> {
        let mut intake = Self::new(groom, losses);
        while intake.leave_out_array() {}
        let mut kept = Vec::with_capacity(intake.groom.len());
        for (i, strand) in intake.groom.strands().enumerate() {
            match strand.check(i) {
                Ok(()) => kept.push(i),
                Err(GroomError::NonFinite { node: at, .. } | GroomError::OutOfRange { at, .. }) => {
                    intake.losses.broken_strands.add_node(i, at);
                }
                Err(_) => intake.losses.short_strands.add(GroomPlace::Strand(i)),
            }
        }
        intake.keep(kept);
        if intake.groom.is_empty() {
            return Err(GroomError::AllLeftOut { losses: intake.losses.to_string() });
        }
        intake.groom.check()?;
        Ok(intake)
    }

    /// Leaves out an optional array that breaks more than half of the strands, if there is one.
    fn leave_out_array(&mut self) -> bool {
        let arrays: [(&str, fn(&mut Groom)); 5] = [
            (Groom::WIDTH, |groom| groom.widths.clear()),
            (Groom::COLOUR, |groom| groom.colors.clear()),
            (Groom::UV, |groom| groom.uvs.clear()),
            (Groom::STIFFNESS, |groom| groom.stiffness.clear()),
            (Groom::DAMPING, |groom| groom.damping.clear()),
        ];
        let Groom { widths, colors, uvs, stiffness, damping, .. } = &self.groom;
        let optional = [widths.len(), colors.len(), uvs.len(), stiffness.len(), damping.len()];
        if optional == [0; 5] {
            return false;
        }
        let mut broken: [(usize, Option<GroomError>); 5] = default();
        for (i, strand) in self.groom.strands().enumerate() {
            let Err(fault @ GroomError::OutOfRange { what, .. }) = strand.check(i) else {
                continue;
            };
            for ((name, _), (count, first)) in arrays.iter().zip(&mut broken) {
                if *name == what {
                    *count += 1;
                    first.get_or_insert_with(|| fault.clone());
                }
            }
        }
        for ((_, clear), (count, first)) in arrays.into_iter().zip(broken) {
            let Some(first) = first.filter(|_| 2 * count > self.groom.len()) else {
                continue;
            };
            self.losses.broken_arrays.add(GroomPlace::Part(first.to_string()));
            clear(&mut self.groom);
            return true;
        }
        false
    }

    /// Keeps these strands only.
    pub fn keep(&mut self, strands: Vec<usize>) {
        if strands.len() < self.groom.len() {
            self.numbers = strands.iter().map(|i| self.numbers[*i]).collect();
            self.groom = self.groom.picked(strands);
        }
    }

    /// The strands of another groom of as many strands as the file has that are kept here, root first.
    pub fn same_of(&self, mut all: Groom) -> Groom {
        self.turned.iter().for_each(|i| all.turn_strand(*i));
        all.picked(self.numbers.iter().map(|i| *i as usize))
    }

    /// How many strands the file has.
    pub fn all(&self) -> usize {
        self.all
    }

    /// Binds the roots to bones, of at most as many strands as the file has.
    pub fn bind(&mut self, mut bones: RootBones, losses: GroomLosses) {
        self.losses += losses;
        let first = bones.strands.len();
        let assumed = bones.extend(self.all);
        if assumed > 0 {
            self.losses.assumed_bones.add_many(assumed, GroomPlace::Strand(first));
        }
        bones.strands = self.numbers.iter().map(|i| bones.strands[*i as usize]).collect();
        self.groom.bones = bones;
    }

    /// The number in the file of a strand.
    pub fn number(&self, strand: usize) -> usize {
        self.numbers[strand] as usize
    }

    /// Adds losses whose strands are numbered as they are now.
    pub fn add(&mut self, mut losses: GroomLosses) {
        losses.renumber(&self.numbers);
        self.losses += losses;
    }
}

/// At most `count` of these, taken evenly from their order.
pub(super) fn evenly(of: Vec<usize>, count: usize) -> Vec<usize> {
    let (all, kept) = (of.len() as u128, count.min(of.len()));
    if kept == of.len() {
        return of;
    }
    (0..kept as u128).map(|i| of[(i * all / kept as u128) as usize]).collect()
}
