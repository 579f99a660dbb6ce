//! State as plain bytes, and back: what lists its fields once is written and read in the same order.

use bevy::prelude::*;
use bytemuck::{AnyBitPattern, NoUninit, Zeroable, bytes_of_mut, cast_slice, cast_slice_mut};

/// Takes values down, or puts them back.
pub(crate) enum Tape<'a> {
    /// Appends them.
    Write(&'a mut Vec<u8>),
    /// Reads them from what is left; `None` once a value was not there, from when on nothing is changed.
    Read(Option<&'a [u8]>),
}

impl<'a> Tape<'a> {
    /// To read from.
    pub(crate) fn of(bytes: &'a [u8]) -> Self {
        Self::Read(Some(bytes))
    }

    /// Whether all that was asked for was there.
    pub(crate) fn is_whole(&self) -> bool {
        !matches!(self, Self::Read(None))
    }

    /// Whether all was there, and nothing more.
    pub(crate) fn is_at_end(&self) -> bool {
        matches!(self, Self::Read(Some([])))
    }

    /// The next bytes to read.
    pub(crate) fn next(&mut self, count: usize) -> Option<&'a [u8]> {
        let Self::Read(rest) = self else { return None };
        let (next, after) = rest.and_then(|rest| rest.split_at_checked(count)).unzip();
        *rest = after;
        next
    }

    /// A number, or some.
    pub(crate) fn value<T: NoUninit + AnyBitPattern>(&mut self, value: &mut T) {
        match self {
            Self::Write(out) => out.extend_from_slice(bytes_of_mut(value)),
            Self::Read(_) => {
                if let Some(bytes) = self.next(size_of::<T>()) {
                    bytes_of_mut(value).copy_from_slice(bytes);
                }
            }
        }
    }

    /// Several numbers.
    pub(crate) fn values<T: NoUninit + AnyBitPattern, const N: usize>(
        &mut self,
        values: [&mut T; N],
    ) {
        values.into_iter().for_each(|value| self.value(value));
    }

    /// Truths.
    pub(crate) fn flags<const N: usize>(&mut self, flags: [&mut bool; N]) {
        for flag in flags {
            let mut byte = u8::from(*flag);
            self.value(&mut byte);
            *flag = byte != 0;
        }
    }

    /// A length, of items of at least `size` bytes each.
    pub(crate) fn count(&mut self, count: usize, size: usize) -> usize {
        let mut written = count as u32;
        self.value(&mut written);
        match self {
            Self::Write(_) => count,
            Self::Read(Some(rest)) if written as usize <= rest.len() / size.max(1) => {
                written as usize
            }
            Self::Read(rest) => {
                *rest = None;
                count
            }
        }
    }

    /// Numbers, whose length is written, too. Reading reuses the allocation.
    pub(crate) fn list<T: NoUninit + AnyBitPattern + Zeroable>(&mut self, values: &mut Vec<T>) {
        let count = self.count(values.len(), size_of::<T>());
        match self {
            Self::Write(out) => out.extend_from_slice(cast_slice(values)),
            Self::Read(_) => {
                if let Some(bytes) = self.next(count * size_of::<T>()) {
                    values.resize(count, T::zeroed());
                    cast_slice_mut(values).copy_from_slice(bytes);
                }
            }
        }
    }

    /// The same of numbers that often are all zero.
    pub(crate) fn sparse_list<T: NoUninit + AnyBitPattern + Zeroable>(
        &mut self,
        values: &mut Vec<T>,
    ) {
        let mut is_zero = cast_slice::<T, u8>(values).iter().all(|byte| *byte == 0);
        self.flags([&mut is_zero]);
        if !is_zero {
            self.list(values);
            return;
        }
        let mut count = values.len() as u32;
        self.value(&mut count);
        // No strand has more.
        if let (Self::Read(Some(_)), true) = (&self, count <= 1 << 20) {
            values.clear();
            values.resize(count as usize, T::zeroed());
        }
    }

    /// A value that may not be there.
    pub(crate) fn option<T: Default>(
        &mut self,
        option: &mut Option<T>,
        record: impl FnOnce(&mut Self, &mut T),
    ) {
        let mut is_some = option.is_some();
        self.flags([&mut is_some]);
        if is_some && self.is_whole() {
            record(self, option.get_or_insert_default());
        } else if self.is_whole() {
            *option = None;
        }
    }

    /// An entity of this world.
    pub(crate) fn entity(&mut self, entity: &mut Entity) {
        let mut bits = entity.to_bits();
        self.value(&mut bits);
        *entity = Entity::try_from_bits(bits).unwrap_or(Entity::PLACEHOLDER);
    }
}

/// A hash of 64 bits, for comparing states and not against attacks: eight bytes at a time, as in FNV-1a.
pub(crate) fn hash(bytes: &[u8]) -> u64 {
    let mix = |hash: u64, word: u64| {
        let hash = (hash ^ word).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        hash ^ hash >> 32
    };
    let (words, rest) = bytes.as_chunks::<8>();
    let start = mix(0xcbf2_9ce4_8422_2325, bytes.len() as u64);
    let hash = words.iter().fold(start, |hash, word| mix(hash, u64::from_le_bytes(*word)));
    rest.iter().fold(hash, |hash, byte| mix(hash, u64::from(*byte)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Debug, Default, PartialEq)]
    struct State {
        speed: f32,
        is_wet: bool,
        places: Vec<Vec3>,
        spins: Vec<f32>,
        rider: Option<u64>,
    }

    fn record(state: &mut State, tape: &mut Tape<'_>) {
        tape.value(&mut state.speed);
        tape.flags([&mut state.is_wet]);
        tape.list(&mut state.places);
        tape.sparse_list(&mut state.spins);
        tape.option(&mut state.rider, Tape::value);
    }

    #[test]
    fn what_is_taken_down_is_put_back_and_what_is_cut_short_is_noticed() {
        for (spins, rider) in [(vec![0.0; 5], None), (vec![0.0, -0.0, 2.0], Some(7))] {
            let places = vec![Vec3::X, Vec3::splat(f32::MIN_POSITIVE)];
            let mut state = State { speed: -0.0, is_wet: true, places, spins, rider };
            let mut bytes = Vec::new();
            record(&mut state, &mut Tape::Write(&mut bytes));
            let mut found = State { rider: Some(3), places: vec![Vec3::Y; 9], ..default() };
            let mut tape = Tape::of(&bytes);
            record(&mut found, &mut tape);
            assert!(tape.is_whole() && found == state && found.speed.is_sign_negative());
            for cut in 0..bytes.len() {
                let mut tape = Tape::of(&bytes[..cut]);
                record(&mut State::default(), &mut tape);
                assert!(!tape.is_whole(), "cut to {cut} bytes");
            }
        }
    }

    #[test]
    fn one_other_bit_is_another_hash() {
        let bytes: Vec<u8> = (0..83).collect();
        let mut seen = vec![hash(&bytes), hash(&bytes[..82]), hash(&[])];
        for bit in 0..8 * bytes.len() {
            let mut other = bytes.clone();
            other[bit / 8] ^= 1 << (bit % 8);
            seen.push(hash(&other));
        }
        let count = seen.len();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), count);
    }
}
