//! What a layer claims about itself, checked before the library believes it: it allocates what counts say, follows
//! offsets without end and nested brackets down the stack.

use crate::authoring::groom::{
    GroomFileError,
    bytes::{Bytes, value, words},
};

/// Larger layers are refused.
const LARGEST: usize = 1 << 30;
/// Nested deeper are neither prims nor brackets nor dictionaries.
const DEEPEST: usize = 64;
/// So many elements an array may have whatever the file's size; else as many as the file has bytes.
const ELEMENTS: u64 = 1 << 20;
/// Texts of paths and lists together.
const TEXTS: u64 = 1 << 28;
/// LZ4 makes no more of a byte.
const UNPACKED: u64 = 255;
const EXPORT_AGAIN: &str = "the file is broken: export it again";

pub fn check(layer: &[u8]) -> Result<(), GroomFileError> {
    if layer.len() > LARGEST {
        let expected = format!("at most {LARGEST} bytes");
        return value(0, "the size of the layer", layer.len(), expected, "leave out strands");
    }
    match layer {
        [b'P', b'X', b'R', ..] => Crate::check(layer),
        _ => text(layer),
    }
}

/// Checks how deep brackets are nested, and that vectors have as many numbers as their type: the library takes what
/// is missing from uninitialised memory.
fn text(layer: &[u8]) -> Result<(), GroomFileError> {
    let mut depth = 0;
    // Numbers in a vector of the type that was named last.
    let mut numbers = None;
    let mut at = 0;
    while let Some(&byte) = layer.get(at) {
        let rest = &layer[at..];
        at += match byte {
            b'#' => rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len()),
            b'"' | b'\'' => quoted(rest, byte),
            b'@' if rest.starts_with(b"@@@") => 3 + find(&rest[3..], b"@@@"),
            b'@' => 1 + find(&rest[1..], b"@"),
            b'(' if let Some((found, length)) = vector(rest) => {
                if let Some(expected) = numbers.filter(|numbers| *numbers != found) {
                    return value(
                        at as u64,
                        "a vector's count of numbers",
                        found,
                        expected,
                        EXPORT_AGAIN,
                    );
                }
                length
            }
            b'(' | b'[' | b'{' => {
                depth += 1;
                if depth > DEEPEST {
                    let expected = format!("at most {DEEPEST}");
                    return value(
                        at as u64,
                        "the depth of brackets",
                        "more",
                        expected,
                        EXPORT_AGAIN,
                    );
                }
                1
            }
            b')' | b']' | b'}' => {
                depth = depth.saturating_sub(1);
                1
            }
            b'A'..=b'Z' | b'a'..=b'z' | b'_' => {
                let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || b"_:.".contains(byte);
                let end = rest.iter().position(|byte| !is_part(byte)).unwrap_or(rest.len());
                numbers = numbers_of(&rest[..end]).or(numbers);
                end
            }
            _ => 1,
        };
    }
    Ok(())
}

/// How long a quoted text is, with its quotes.
fn quoted(text: &[u8], quote: u8) -> usize {
    let triple = [quote; 3];
    let end: &[u8] = if text.starts_with(&triple) { &triple } else { &triple[..1] };
    let mut at = end.len();
    while at < text.len() && !text[at..].starts_with(end) {
        at += if text[at] == b'\\' { 2 } else { 1 };
    }
    at + end.len()
}

/// Where a text ends with this, or the whole ends.
fn find(text: &[u8], end: &[u8]) -> usize {
    let at = text.windows(end.len()).position(|part| part == end);
    at.map_or(text.len(), |at| at + end.len())
}

/// How many numbers a vector has, and how many bytes; `None` if these brackets hold something else.
fn vector(text: &[u8]) -> Option<(usize, usize)> {
    let end = text.iter().position(|byte| b")[]{}=\"'@<".contains(byte))?;
    let inside = text.get(1..end).filter(|_| text[end] == b')')?;
    let is_between = |byte: &u8| byte.is_ascii_whitespace() || b",;".contains(byte);
    let parts = inside.split(is_between).filter(|part| !part.is_empty());
    (!inside.contains(&b'(')).then(|| (parts.count(), end + 1))
}

/// How many numbers an element of a type has, if it is one of vectors.
fn numbers_of(word: &[u8]) -> Option<usize> {
    const VECTORS: [&[u8]; 10] = [
        b"float",
        b"double",
        b"half",
        b"int",
        b"point",
        b"normal",
        b"vector",
        b"color",
        b"texCoord",
        b"matrix",
    ];
    match word {
        b"quatf" | b"quatd" | b"quath" | b"frame4d" => return Some(4),
        _ => {}
    }
    let digit = word.iter().position(u8::is_ascii_digit)?;
    let (name, rest) = word.split_at(digit);
    let is_vector = VECTORS.contains(&name) && matches!(rest, [b'2'..=b'4'] | [b'2'..=b'4', _]);
    is_vector.then(|| usize::from(rest[0] - b'0'))
}

/// A `.usdc` whose structure is walked.
struct Crate<'a> {
    file: Bytes<'a>,
    version: [u8; 3],
    /// How many elements an array may have.
    limit: u64,
    /// How many values may still be visited, and bytes of texts and samples made of them.
    visits: u64,
    made: u64,
    /// Lengths of tokens, and the tokens that strings are.
    tokens: Vec<u32>,
    strings: Vec<u32>,
    /// How many paths there are.
    paths: u64,
}

impl<'a> Crate<'a> {
    fn check(layer: &'a [u8]) -> Result<(), GroomFileError> {
        let limit = ELEMENTS.max(layer.len() as u64);
        let mut this = Self {
            file: Bytes(layer),
            version: [0; 3],
            limit,
            visits: limit,
            made: TEXTS + 16 * layer.len() as u64,
            tokens: Vec::new(),
            strings: Vec::new(),
            paths: 0,
        };
        let header = this.file.array(0, 1, 88, "the header")?;
        this.version = [header[8], header[9], header[10]];
        if this.version < [0, 4, 0] || this.version >= [0, 13, 0] {
            let [major, minor, patch] = this.version;
            let found = format!("{major}.{minor}.{patch}");
            let hint = "convert it by usdcat to a version of today";
            return value(8, "the version of the crate", found, "0.4.0 to 0.12", hint);
        }
        this.tokens()?;
        this.strings()?;
        if let Some(at) = this.section("SPECS")? {
            let (count, mut at) = (this.count(at, 1, "SPECS")?, at + 8);
            for _ in 0..3 {
                at = this.ints(at, count)?.1;
            }
        }
        if let Some(at) = this.section("FIELDSETS")? {
            let count = this.count(at, 1, "FIELDSETS")?;
            this.ints(at + 8, count)?;
        }
        this.paths()?;
        this.fields()
    }

    fn u64(&self, at: u64, what: &'static str) -> Result<u64, GroomFileError> {
        let bytes = self.file.array(at, 1, 8, what)?;
        Ok(bytes.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes)))
    }

    /// Where a section begins, if there is one.
    fn section(&self, name: &str) -> Result<Option<u64>, GroomFileError> {
        const WHAT: &str = "the table of contents";
        let at = self.u64(16, WHAT)?;
        let count = self.u64(at, WHAT)?;
        let all = self.file.array(at.saturating_add(8), count.min(64), 32, WHAT)?;
        let found = all
            .chunks_exact(32)
            .find(|section| section.starts_with(name.as_bytes()) && section[name.len()] == 0);
        let start = found.and_then(|section| section[16..].first_chunk());
        Ok(start.map(|start| u64::from_le_bytes(*start)))
    }

    /// A count of elements, which the file can hold: of `size` bytes each, or packed ones if that is 1.
    fn count(&self, at: u64, size: u64, what: &'static str) -> Result<u64, GroomFileError> {
        let count = self.u64(at, what)?;
        self.allowed(at, count, what)?;
        if size > 1 {
            self.file.array(at + 8, count, size, what)?;
        }
        Ok(count)
    }

    fn allowed(&self, at: u64, count: u64, what: &'static str) -> Result<(), GroomFileError> {
        if count > self.limit {
            let found = format!("{count} elements");
            let expected = format!("at most {}, as the file's size justifies", self.limit);
            return value(at, what, found, expected, EXPORT_AGAIN);
        }
        Ok(())
    }

    /// The bytes of a packed block, which are no more than so many, and where it ends.
    fn block(&self, at: u64, most: u64) -> Result<(Vec<u8>, u64), GroomFileError> {
        const WHAT: &str = "a packed block";
        let size = self.u64(at, WHAT)?;
        let packed = self.file.array(at.saturating_add(8), size, 1, WHAT)?;
        let [0, packed @ ..] = packed else {
            return value(at + 8, WHAT, "empty or in chunks", "one chunk", EXPORT_AGAIN);
        };
        let mut bytes = vec![0; most.min(UNPACKED * size) as usize];
        match lz4_flex::block::decompress_into(packed, &mut bytes) {
            Ok(length) => {
                bytes.truncate(length);
                Ok((bytes, at + 8 + size))
            }
            Err(error) => value(at, WHAT, error, "bytes packed by LZ4", EXPORT_AGAIN),
        }
    }

    /// Packed integers, and where they end.
    fn ints(&self, at: u64, count: u64) -> Result<(Vec<i32>, u64), GroomFileError> {
        let codes = count.div_ceil(4);
        let (bytes, end) = self.block(at, 4 + codes + 4 * count)?;
        let Some((common, rest)) = bytes.split_first_chunk().filter(|_| count > 0) else {
            let none =
                if count == 0 { Ok(()) } else { value(at, "integers", 0, count, EXPORT_AGAIN) };
            return none.map(|()| (Vec::new(), end));
        };
        let common = i32::from_le_bytes(*common);
        let Some((codes, mut deltas)) = rest.split_at_checked(codes as usize) else {
            return value(at, "packed integers", rest.len(), codes, EXPORT_AGAIN);
        };
        let mut take = |size: usize| {
            let (delta, rest) = deltas.split_at_checked(size)?;
            deltas = rest;
            Some(match *delta {
                [a] => i32::from(a as i8),
                [a, b] => i32::from(i16::from_le_bytes([a, b])),
                [a, b, c, d] => i32::from_le_bytes([a, b, c, d]),
                _ => common,
            })
        };
        let (mut last, mut all) = (0_i32, Vec::with_capacity(count as usize));
        for k in 0..count as usize {
            let size = [0, 1, 2, 4][usize::from(codes[k / 4] >> (2 * (k % 4)) & 3)];
            let Some(delta) = take(size) else {
                return value(at, "packed integers", k, count, EXPORT_AGAIN);
            };
            last = last.wrapping_add(delta);
            all.push(last);
        }
        Ok((all, end))
    }

    fn tokens(&mut self) -> Result<(), GroomFileError> {
        const WHAT: &str = "TOKENS";
        let Some(at) = self.section(WHAT)? else {
            return Ok(());
        };
        let (count, size) = (self.count(at, 1, WHAT)?, self.u64(at + 8, WHAT)?);
        let (bytes, _) = self.block(at + 16, size)?;
        let ends = bytes.iter().filter(|byte| **byte == 0).count() as u64;
        if ends != count || bytes.len() as u64 != size {
            return value(at, "the count of tokens", count, ends, EXPORT_AGAIN);
        }
        let ended = bytes.strip_suffix(&[0]).unwrap_or_default();
        self.tokens = ended.split(|byte| *byte == 0).map(|token| token.len() as u32).collect();
        Ok(())
    }

    fn strings(&mut self) -> Result<(), GroomFileError> {
        const WHAT: &str = "STRINGS";
        if let Some(at) = self.section(WHAT)? {
            let count = self.count(at, 4, WHAT)?;
            let all = self.file.array(at + 8, count, 4, WHAT)?;
            self.strings = words(all).collect();
            for token in &self.strings {
                self.token(at, (*token).into())?;
            }
        }
        Ok(())
    }

    /// Walks the tree of paths as the library does.
    fn paths(&mut self) -> Result<(), GroomFileError> {
        const WHAT: &str = "PATHS";
        let Some(at) = self.section(WHAT)? else {
            return Ok(());
        };
        self.paths = self.count(at, 1, WHAT)?;
        let count = self.count(at + 8, 1, WHAT)?;
        let (indices, end) = self.ints(at + 16, count)?;
        let (elements, end) = self.ints(end, count)?;
        let (jumps, _) = self.ints(end, count)?;
        for (k, (index, element)) in indices.iter().zip(&elements).enumerate() {
            self.path(at, u64::from(index.cast_unsigned()))?;
            if k > 0 {
                self.token(at, element.unsigned_abs().into())?;
            }
        }
        let (mut pending, mut visited) = (vec![(0, 0, 0)], 0);
        while let Some((first, mut depth, mut length)) = pending.pop() {
            for index in first.. {
                let (Some(element), Some(&jump)) = (elements.get(index), jumps.get(index)) else {
                    // The root of a file without any.
                    let is_empty = count == 0;
                    let none = value(at, "a jump in the paths", index, count, EXPORT_AGAIN);
                    return if is_empty { Ok(()) } else { none };
                };
                visited += 1;
                let token = element.unsigned_abs() as usize;
                let own = u64::from(self.tokens.get(token).copied().unwrap_or_default()) + 1;
                self.make(at, length + own)?;
                if visited > count || depth > 2 * DEEPEST {
                    let expected = format!("{count} paths, at most {} deep", 2 * DEEPEST);
                    return value(at, "the tree of paths", "larger", expected, EXPORT_AGAIN);
                }
                let (has_child, has_sibling) = (jump > 0 || jump == -1, jump >= 0);
                if has_child {
                    if has_sibling {
                        pending.push((index + jump as usize, depth, length));
                    }
                    (depth, length) = (depth + 1, length + own);
                } else if !has_sibling {
                    break;
                }
            }
        }
        Ok(())
    }

    /// Checks an index of a token …
    fn token(&self, at: u64, index: u64) -> Result<(), GroomFileError> {
        self.index(at, "the index of a token", index, self.tokens.len() as u64)
    }

    /// … of a string …
    fn string(&self, at: u64, index: u64) -> Result<(), GroomFileError> {
        self.index(at, "the index of a string", index, self.strings.len() as u64)
    }

    /// … and of a path.
    fn path(&self, at: u64, index: u64) -> Result<(), GroomFileError> {
        self.index(at, "the index of a path", index, self.paths)
    }

    fn index(&self, at: u64, what: &'static str, of: u64, all: u64) -> Result<(), GroomFileError> {
        match of < all {
            true => Ok(()),
            false => value(at, what, of, format!("less than {all}"), EXPORT_AGAIN),
        }
    }

    /// Checks pairs of a string or path and one more.
    fn pairs(
        &self,
        at: u64,
        checks: [fn(&Self, u64, u64) -> Result<(), GroomFileError>; 2],
    ) -> Result<(), GroomFileError> {
        let count = self.count(at, 8, "pairs")?;
        let all = self.file.array(at + 8, count, 8, "pairs")?;
        words(all)
            .zip(checks.into_iter().cycle())
            .try_for_each(|(i, check)| check(self, at, i.into()))
    }

    /// Takes from what may be made of the file.
    fn make(&mut self, at: u64, bytes: u64) -> Result<(), GroomFileError> {
        match self.made.checked_sub(bytes) {
            Some(left) => self.made = left,
            None => return value(at, "the size unpacked", "more", "less", EXPORT_AGAIN),
        }
        Ok(())
    }

    fn fields(&mut self) -> Result<(), GroomFileError> {
        const WHAT: &str = "FIELDS";
        let Some(at) = self.section(WHAT)? else {
            return Ok(());
        };
        let count = self.count(at, 1, WHAT)?;
        let (_, end) = self.ints(at + 8, count)?;
        let (values, _) = self.block(end, 8 * count)?;
        if values.len() as u64 != 8 * count {
            return value(end, "the count of values", values.len() / 8, count, EXPORT_AGAIN);
        }
        for value in values.as_chunks().0 {
            self.value(Value(u64::from_le_bytes(*value)), 0)?;
        }
        Ok(())
    }

    fn value(&mut self, of: Value, depth: usize) -> Result<(), GroomFileError> {
        const WHAT: &str = "a value";
        let at = of.at();
        let Some(left) = self.visits.checked_sub(1).filter(|_| depth <= DEEPEST) else {
            return value(at, "the nesting of values", "more", "less", EXPORT_AGAIN);
        };
        self.visits = left;
        if of.is_array() && (of.is_inlined() || of.is_packed() && !of.is_number()) {
            return value(at, WHAT, "inlined or packed", "neither", EXPORT_AGAIN);
        }
        if of.is_inlined() {
            let index = at & u64::from(u32::MAX);
            return match of.kind() {
                10 => self.string(at, index),
                11 | 12 | 53 | 57 => self.token(at, index),
                _ => Ok(()),
            };
        }
        match of.kind() {
            // Texts are lists also where they are arrays; single ones are indices.
            10 | 12 | 57 if of.is_array() => self.texts(at, true).map(drop),
            10 | 12 | 57 => self.string(at, self.file.u32(at, WHAT)?.into()),
            11 if of.is_array() => {
                self.array(of, 4)?;
                let (at, count) = if at > 0 { self.length(of)? } else { (0, 0) };
                let all = self.file.array(at, count, 4, WHAT)?;
                words(all).try_for_each(|token| self.token(at, token.into()))
            }
            11 | 53 => self.token(at, self.u64(at, WHAT)?),
            47 => self.target(at),
            50 => self.texts(at, true).map(drop),
            // Paths, tokens.
            40 => self.targets(at).map(drop),
            41 => self.texts(at, false).map(drop),
            // Lists with operations, by what they are of.
            32 | 33 | 34 | 54 => self.list(at, |this, at| match of.kind() {
                32 => this.texts(at, false),
                33 | 54 => this.texts(at, true),
                _ => this.targets(at),
            }),
            36 | 38 => self.list(at, |this, at| Ok(at + 8 + 4 * this.count(at, 4, WHAT)?)),
            37 | 39 => self.list(at, |this, at| Ok(at + 8 + 8 * this.count(at, 8, WHAT)?)),
            35 => self.list(at, |this, at| {
                let (count, mut at) = (this.count(at, 24, "references")?, at + 8);
                for _ in 0..count {
                    this.target(at)?;
                    at = this.dictionary(at + 24, depth)?;
                }
                Ok(at)
            }),
            55 => self.list(at, |this, at| {
                let size = if this.version < [0, 8, 0] { 8 } else { 24 };
                let count = this.count(at, size, "payloads")?;
                (0..count).try_for_each(|i| this.target(at + 8 + size * i))?;
                Ok(at + 8 + size * count)
            }),
            31 => self.dictionary(at, depth).map(drop),
            // Selections of variants, relocations, offsets of layers.
            45 => self.pairs(at, [Self::string, Self::string]),
            58 => self.pairs(at, [Self::path, Self::path]),
            49 => self.count(at, 16, WHAT).map(drop),
            46 => self.samples(at, depth),
            48 => self.array(of, 8),
            kind if of.is_array() => match size_of_kind(kind) {
                Some(size) => self.array(of, size),
                None => Ok(()),
            },
            _ => Ok(()),
        }
    }

    /// The asset and the prim of a reference or payload.
    fn target(&self, at: u64) -> Result<(), GroomFileError> {
        const WHAT: &str = "a reference";
        self.string(at, self.file.u32(at, WHAT)?.into())?;
        self.path(at + 4, self.file.u32(at + 4, WHAT)?.into())
    }

    /// A list of paths, and where it ends.
    fn targets(&self, at: u64) -> Result<u64, GroomFileError> {
        const WHAT: &str = "a list of paths";
        let count = self.count(at, 4, WHAT)?;
        let all = self.file.array(at + 8, count, 4, WHAT)?;
        words(all).try_for_each(|path| self.path(at, path.into()))?;
        Ok(at + 8 + 4 * count)
    }

    /// A list of indices of tokens or strings, whose texts are copied, and where it ends.
    fn texts(&mut self, at: u64, is_strings: bool) -> Result<u64, GroomFileError> {
        const WHAT: &str = "a list of texts";
        let count = self.count(at, 4, WHAT)?;
        let all = self.file.array(at + 8, count, 4, WHAT)?;
        let mut sum = 24 * count;
        for index in words(all) {
            let token = if is_strings {
                self.string(at, index.into())?;
                self.strings[index as usize]
            } else {
                index
            };
            self.token(at, token.into())?;
            sum += u64::from(self.tokens[token as usize]);
        }
        self.make(at, sum)?;
        Ok(at + 8 + 4 * count)
    }

    /// The lists of a list with operations.
    fn list(
        &mut self,
        at: u64,
        mut items: impl FnMut(&mut Self, u64) -> Result<u64, GroomFileError>,
    ) -> Result<(), GroomFileError> {
        let [flags] = *self.file.array(at, 1, 1, "a list's operations")? else {
            return Ok(());
        };
        let mut at = at + 1;
        for _ in 0..(flags >> 1).count_ones().min(6) {
            at = items(self, at)?;
        }
        Ok(())
    }

    /// A dictionary, and where it ends.
    fn dictionary(&mut self, at: u64, depth: usize) -> Result<u64, GroomFileError> {
        const WHAT: &str = "a dictionary";
        let (count, mut at) = (self.count(at, 1, WHAT)?, at + 8);
        for _ in 0..count {
            self.string(at, self.file.u32(at, WHAT)?.into())?;
            let from = self.offset(at + 4)?;
            let of = Value(self.u64(from, WHAT)?);
            self.value(of, depth + 1)?;
            at = from + 8;
        }
        Ok(at)
    }

    /// Where an offset leads.
    fn offset(&self, at: u64) -> Result<u64, GroomFileError> {
        let offset = self.u64(at, "an offset")? as i64;
        match at.checked_add_signed(offset).filter(|to| *to < self.file.len()) {
            Some(to) => Ok(to),
            None => value(at, "an offset", offset, "one within the file", EXPORT_AGAIN),
        }
    }

    fn samples(&mut self, at: u64, depth: usize) -> Result<(), GroomFileError> {
        const WHAT: &str = "samples of time";
        let times = self.offset(at)?;
        self.value(Value(self.u64(times, WHAT)?), depth + 1)?;
        let values = self.offset(times + 8)?;
        let count = self.count(values, 8, WHAT)?;
        for i in 0..count {
            let of = Value(self.u64(values + 8 + 8 * i, WHAT)?);
            self.value(of, depth + 1)?;
            // All are unpacked at once.
            if let Some(size) = size_of_kind(of.kind()).filter(|_| of.is_array() && of.at() > 0) {
                let (_, count) = self.length(of)?;
                self.make(at, count.saturating_mul(size))?;
            }
        }
        Ok(())
    }

    /// Where an array's elements begin, and how many there are.
    fn length(&self, of: Value) -> Result<(u64, u64), GroomFileError> {
        const WHAT: &str = "the length of an array";
        let at = of.at() + if self.version < [0, 5, 0] { 4 } else { 0 };
        Ok(match self.version < [0, 7, 0] {
            true => (at + 4, self.file.u32(at, WHAT)?.into()),
            false => (at + 8, self.u64(at, WHAT)?),
        })
    }

    /// An array of numbers, packed or not.
    fn array(&self, of: Value, size: u64) -> Result<(), GroomFileError> {
        const WHAT: &str = "an array";
        if of.at() == 0 {
            return Ok(());
        }
        let (at, count) = self.length(of)?;
        self.allowed(at, count, WHAT)?;
        let is_int = of.is_int();
        let since = if is_int { [0, 5, 0] } else { [0, 6, 0] };
        let is_packed = of.is_packed() && of.is_number() && self.version >= since;
        if !is_packed || count < 4 {
            return self.file.array(at, count, size, WHAT).map(drop);
        }
        if is_int && size == 8 {
            return self.block(at, 8 + count.div_ceil(4) + 8 * count).map(drop);
        }
        if is_int {
            return self.ints(at, count).map(drop);
        }
        // Integers, or indices of a table.
        match *self.file.array(at, 1, 1, WHAT)? {
            [b't'] => {
                let length = u64::from(self.file.u32(at + 1, WHAT)?);
                self.file.array(at + 5, length, size, WHAT)?;
                let (indices, _) = self.ints(at + 5 + size * length, count)?;
                indices.iter().try_for_each(|index| {
                    self.index(at, "the index of a number", index.cast_unsigned().into(), length)
                })
            }
            _ => self.ints(at + 1, count).map(drop),
        }
    }
}

/// A value as a file has it: its kind, and either itself or where it is.
#[derive(Clone, Copy)]
struct Value(u64);

impl Value {
    fn kind(self) -> u8 {
        (self.0 >> 48) as u8
    }

    fn at(self) -> u64 {
        self.0 & ((1 << 48) - 1)
    }

    fn is_int(self) -> bool {
        matches!(self.kind(), 3..=6)
    }

    /// Whether it may be packed.
    fn is_number(self) -> bool {
        matches!(self.kind(), 3..=9 | 48 | 56)
    }

    fn is_array(self) -> bool {
        self.0 >> 63 & 1 == 1
    }

    fn is_inlined(self) -> bool {
        self.0 >> 62 & 1 == 1
    }

    fn is_packed(self) -> bool {
        self.0 >> 61 & 1 == 1
    }
}

/// Bytes of an element of each kind that arrays are of: numbers and indices of texts, matrices, quaternions, vectors.
const SIZES: [u8; 31] = [
    0, 1, 1, 4, 4, 8, 8, 2, 4, 8, 4, 4, 4, 32, 72, 128, 32, 16, 8, 16, 8, 4, 8, 24, 12, 6, 12, 32,
    16, 8, 16,
];

fn size_of_kind(kind: u8) -> Option<u64> {
    match kind {
        56 => Some(8),
        57 => Some(4),
        kind => SIZES.get(usize::from(kind)).map(|size| u64::from(*size)),
    }
}
