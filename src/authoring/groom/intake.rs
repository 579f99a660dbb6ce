//! A groom on its way in from a file: strands that cannot be are left out, and those that stay keep the
//! numbers that they have in the file.

use super::{Groom, GroomError, GroomLosses, losses::GroomPlace};

/// A groom with the number that each strand has in its file, and what was left out.
#[derive(Clone, Debug, Default)]
pub(super) struct Intake {
    pub groom: Groom,
    numbers: Vec<u32>,
    pub losses: GroomLosses,
}

impl Intake {
    /// A valid groom.
    pub fn of(groom: Groom) -> Result<Self, GroomError> {
        groom.check()?;
        Ok(Self::new(groom, GroomLosses::default()))
    }

    fn new(groom: Groom, losses: GroomLosses) -> Self {
        Self { numbers: (0..groom.len() as u32).collect(), groom, losses }
    }

    /// A groom as a file has it, whose numbers may be any: without strands of a single node or with a broken
    /// number. An optional array that would break more than half of them is left out instead.
    ///
    /// # Errors
    /// When no strand is left, or its arrays do not fit each other.
    pub fn cleaned(groom: Groom, losses: GroomLosses) -> Result<Self, GroomError> {
        let mut intake = Self::new(groom, losses);
        let faults = loop {
            let strands = intake.groom.strands().enumerate();
            let faults: Vec<_> = strands.map(|(i, strand)| strand.check(i).err()).collect();
            if !intake.leave_out_array(&faults) {
                break faults;
            }
        };
        let mut kept = Vec::with_capacity(faults.len());
        for (i, fault) in faults.into_iter().enumerate() {
            match fault {
                None => kept.push(i),
                Some(
                    GroomError::NonFinite { node: at, .. } | GroomError::OutOfRange { at, .. },
                ) => {
                    intake.losses.broken_strands.add_node(i, at);
                }
                Some(_) => intake.losses.short_strands.add(GroomPlace::Strand(i)),
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
    fn leave_out_array(&mut self, faults: &[Option<GroomError>]) -> bool {
        let arrays: [(&str, fn(&mut Groom)); 3] = [
            (Groom::WIDTH, |groom| groom.widths.clear()),
            (Groom::COLOUR, |groom| groom.colors.clear()),
            (Groom::UV, |groom| groom.uvs.clear()),
        ];
        for (name, clear) in arrays {
            let of_it = |fault: &&GroomError| matches!(fault, GroomError::OutOfRange { what, .. } if *what == name);
            let mut broken = faults.iter().flatten().filter(of_it);
            let Some(first) = broken.next() else {
                continue;
            };
            if 2 * (broken.count() + 1) > faults.len() {
                self.losses.broken_arrays.add(GroomPlace::Part(first.to_string()));
                clear(&mut self.groom);
                return true;
            }
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
