//! Writes Alembic archives.

use crate::authoring::groom::{
    Groom, GroomCache, GroomError, GroomGroup,
    curve_sets::{COLOR, DAMPING, GROUP, GROUP_NAME, GUIDE, ROOT_UV, STIFFNESS, from_the_top},
};
use bevy::prelude::*;

const DATA: u64 = 1 << 63;
/// The length of a cycle of times that have none.
const ACYCLIC: f64 = f64::MAX / 32.0;
/// The version of the library whose files these are like.
const LIBRARY: i32 = 10_803;
const CURVES: &str = "schema=AbcGeom_Curve_v2;schemaBaseType=AbcGeom_GeomBase_v1";
const XFORM: &str = "schema=AbcGeom_Xform_v3";

/// What a number is, with its size in bytes.
#[derive(Clone, Copy)]
pub(super) enum Pod {
    U8 = 1,
    I16 = 4,
    I32 = 6,
    #[cfg_attr(not(test), allow(dead_code, reason = "read, but not written"))]
    F16 = 9,
    F32 = 10,
    F64 = 11,
    Text = 12,
}

/// A property or object that is written, before what holds it is.
#[derive(Clone)]
pub(super) struct Written {
    header: Vec<u8>,
    at: u64,
}

/// An archive on its way: parts before what they are in.
pub(super) struct Archive {
    file: Vec<u8>,
    metadata: Vec<String>,
    /// When samples are (s), of all that is in it.
    times: Vec<f64>,
}

impl Archive {
    pub(super) fn new() -> Self {
        // The mark of a finished file and the root's position come last.
        let file = b"Ogawa\0\0\x01\0\0\0\0\0\0\0\0".to_vec();
        Self { file, metadata: vec![String::new()], times: vec![0.0] }
    }

    pub(super) fn animated(times: &[f32]) -> Self {
        Self { times: times.iter().copied().map(f64::from).collect(), ..Self::new() }
    }

    fn data(&mut self, parts: &[&[u8]]) -> u64 {
        let len: usize = parts.iter().map(|part| part.len()).sum();
        if len == 0 {
            return DATA;
        }
        let at = self.file.len() as u64;
        self.file.extend((len as u64).to_le_bytes());
        parts.iter().for_each(|part| self.file.extend_from_slice(part));
        at | DATA
    }

    /// A sample behind a key, which is the same only for the same bytes.
    fn sample(&mut self, bytes: &[u8]) -> u64 {
        // FNV-1a of 64 bits from two beginnings.
        let hash = |start: u64| {
            let next = |hash: u64, byte: &u8| {
                (hash ^ u64::from(*byte)).wrapping_mul(0x0000_0100_0000_01b3)
            };
            bytes.iter().fold(start, next).to_le_bytes()
        };
        let key = [hash(0xcbf2_9ce4_8422_2325), hash(0x9e37_79b9_7f4a_7c15)].concat();
        if bytes.is_empty() { DATA } else { self.data(&[&key, bytes]) }
    }

    fn group(&mut self, children: impl IntoIterator<Item = u64>) -> u64 {
        let children: Vec<u64> = children.into_iter().collect();
        if children.is_empty() {
            return 0;
        }
        let at = self.file.len() as u64;
        self.file.extend((children.len() as u64).to_le_bytes());
        self.file.extend(children.into_iter().flat_map(u64::to_le_bytes));
        at
    }

    /// Index of metadata among those that are shared.
    fn shared(&mut self, metadata: &str) -> u32 {
        let found = self.metadata.iter().position(|other| other == metadata);
        found.unwrap_or_else(|| {
            self.metadata.push(metadata.to_owned());
            self.metadata.len() - 1
        }) as u32
    }

    /// Parts in a compound or object, with their headers.
    fn holding(&mut self, before: &[u64], parts: Vec<Written>, hashes: &[u8]) -> u64 {
        let headers: Vec<u8> = parts.iter().flat_map(|part| part.header.iter().copied()).collect();
        if headers.is_empty() && hashes.is_empty() {
            return 0;
        }
        let headers = self.data(&[&headers, hashes]);
        let parts = parts.into_iter().map(|part| part.at);
        self.group(before.iter().copied().chain(parts).chain([headers]))
    }

    fn property(&mut self, name: &str, info: u32, samples: Option<usize>, at: u64) -> Written {
        // Lengths of 32 bits, samples of one size, constant ones, times other than those of what stands still.
        let (count, is_animated) = (self.times.len() as u32, self.times.len() > 1);
        let of_samples = samples.map_or(0, |stored| {
            0x400 | if stored == 1 { 0x800 } else { 0 } | if is_animated { 0x100 } else { 0 }
        });
        let mut header = (info | 0b1000 | of_samples).to_le_bytes().to_vec();
        if samples.is_some() {
            header.extend(count.to_le_bytes());
            header.extend(is_animated.then_some(1u32.to_le_bytes()).into_iter().flatten());
        }
        header.extend((name.len() as u32).to_le_bytes());
        header.extend(name.bytes());
        Written { header, at }
    }

    pub(super) fn compound(&mut self, name: &str, metadata: &str, of: Vec<Written>) -> Written {
        let info = self.shared(metadata) << 20;
        let at = self.holding(&[], of, &[]);
        self.property(name, info, None, at)
    }

    pub(super) fn scalar(
        &mut self,
        name: &str,
        metadata: &str,
        (pod, extent): (Pod, u32),
        bytes: &[u8],
    ) -> Written {
        self.scalars(name, metadata, (pod, extent), &[bytes])
    }

    pub(super) fn scalars(
        &mut self,
        name: &str,
        metadata: &str,
        (pod, extent): (Pod, u32),
        samples: &[&[u8]],
    ) -> Written {
        let info = self.shared(metadata) << 20 | extent << 12 | (pod as u32) << 4 | 1;
        let parts: Vec<u64> = samples.iter().map(|s| self.sample(s)).collect();
        let at = self.group(parts);
        self.property(name, info, Some(samples.len()), at)
    }

    pub(super) fn array(
        &mut self,
        name: &str,
        metadata: &str,
        (pod, extent): (Pod, u32),
        samples: &[&[u8]],
    ) -> Written {
        let info = self.shared(metadata) << 20 | extent << 12 | (pod as u32) << 4 | 2;
        let parts: Vec<u64> = samples.iter().flat_map(|s| [self.sample(s), DATA]).collect();
        let at = self.group(parts);
        self.property(name, info, Some(samples.len()), at)
    }

    pub(super) fn object(
        &mut self,
        name: &str,
        metadata: &str,
        properties: Vec<Written>,
        children: Vec<Written>,
    ) -> Written {
        let properties = self.holding(&[], properties, &[]);
        let at = self.holding(&[properties], children, &[0; 32]);
        let mut header = (name.len() as u32).to_le_bytes().to_vec();
        header.extend(name.bytes());
        header.push(self.shared(metadata) as u8);
        Written { header, at }
    }

    pub(super) fn finished(mut self, top: Vec<Written>) -> Vec<u8> {
        let top = self.holding(&[0], top, &[0; 32]);
        let mut metadata = Vec::new();
        for text in &self.metadata[1..] {
            metadata.push(text.len() as u8);
            metadata.extend(text.bytes());
        }
        let mut times = 1u32.to_le_bytes().to_vec();
        times.extend(1f64.to_le_bytes());
        times.extend(1u32.to_le_bytes());
        times.extend(0f64.to_le_bytes());
        if self.times.len() > 1 {
            let count = (self.times.len() as u32).to_le_bytes();
            times.extend(count);
            times.extend(ACYCLIC.to_le_bytes());
            times.extend(count);
            times.extend(self.times.iter().flat_map(|time| time.to_le_bytes()));
        }
        let parts = [
            self.data(&[&0i32.to_le_bytes()]),
            self.data(&[&LIBRARY.to_le_bytes()]),
            top,
            self.data(&[b"_ai_Application=bevy_keratin"]),
            self.data(&[&times]),
            self.data(&[&metadata]),
        ];
        let root = self.group(parts);
        self.file[5] = 0xff;
        self.file[8..16].copy_from_slice(&root.to_le_bytes());
        self.file
    }

    /// An attribute: what it is of, and its numbers.
    pub(super) fn attribute(
        &mut self,
        (name, scope): (&str, &str),
        (pod, extent): (Pod, u32),
        bytes: &[u8],
    ) -> Written {
        let kind = match pod {
            Pod::U8 => "uint8_t",
            Pod::I16 => "int16_t",
            Pod::I32 => "int32_t",
            Pod::F16 => "float16_t",
            Pod::F32 => "float32_t",
            Pod::F64 => "float64_t",
            Pod::Text => "string",
        };
        let meaning = if extent == 2 { "interpretation=vector;" } else { "" };
        let metadata = format!(
            "arrayExtent=1;geoScope={scope};{meaning}isGeomParam=true;podExtent={extent};podName={kind}"
        );
        self.array(name, &metadata, (pod, extent), &[bytes])
    }
}

pub(super) fn floats(numbers: impl IntoIterator<Item = f32>) -> Vec<u8> {
    numbers.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// The bytes of an `.abc` file (Ogawa) of this groom, in metres and with Y up: one set of linear curves
/// below a transform. Widths become `width`; UVs of roots, colours without alpha and guides the attributes
/// that Unreal Engine reads (`groom_root_uv`, `groom_color`, `groom_guide`, `groom_group_id`, `groom_group_name`), and
/// stiffness `groom_stiffness`.
///
/// Reading what was written gives the same groom, but for alpha and the paths of groups, and writing that the same bytes.
///
/// ```no_run
/// # use bevy_keratin::authoring::groom::{Groom, alembic};
/// fn save(groom: &Groom) -> std::io::Result<()> {
///     let file = alembic::write(groom).map_err(std::io::Error::other)?;
///     std::fs::write("bob.abc", file)
/// }
/// ```
///
/// # Errors
/// When the groom is empty.
pub fn write(groom: &Groom) -> Result<Vec<u8>, GroomError> {
    write_samples(groom, &[groom.points()], Archive::new())
}

/// The same of a groom that moves: a sample of the nodes for each frame, at its time.
///
/// # Errors
/// When the cache is empty.
pub fn write_cache(cache: &GroomCache) -> Result<Vec<u8>, GroomError> {
    let frames: Vec<&[Vec3]> = (0..cache.len()).map(|frame| cache.frame(frame)).collect();
    if frames.is_empty() {
        return Err(GroomError::Empty);
    }
    write_samples(cache.groom(), &frames, Archive::animated(cache.times()))
}

fn write_samples(
    groom: &Groom,
    frames: &[&[Vec3]],
    mut archive: Archive,
) -> Result<Vec<u8>, GroomError> {
    groom.extents().ok_or(GroomError::Empty)?;
    let all = || frames.iter().flat_map(|frame| frame.iter());
    let low = all().fold(Vec3::INFINITY, |low, p| low.min(*p));
    let high = all().fold(Vec3::NEG_INFINITY, |high, p| high.max(*p));
    let bounds = [low, high].map(|corner| corner.to_array().map(f64::from)).concat();
    let bounds: Vec<u8> = bounds.into_iter().flat_map(f64::to_le_bytes).collect();
    let points: Vec<Vec<u8>> =
        frames.iter().map(|frame| floats(frame.iter().flat_map(Vec3::to_array))).collect();
    let points: Vec<&[u8]> = points.iter().map(Vec::as_slice).collect();
    let counts = groom.strands().flat_map(|s| (s.points.len() as i32).to_le_bytes());
    let counts: Vec<u8> = counts.collect();
    // Linear, open, no basis.
    let kind = [1, 0, 0, 0];
    let mut set = vec![
        archive.scalar(".selfBnds", "interpretation=box", (Pod::F64, 6), &bounds),
        archive.array("P", "geoScope=vtx;interpretation=point", (Pod::F32, 3), &points),
        archive.array("nVertices", "", (Pod::I32, 1), &[&counts]),
        archive.scalar("curveBasisAndType", "", (Pod::U8, 4), &kind),
    ];
    if !groom.widths.is_empty() {
        let widths = floats(groom.widths.iter().copied());
        set.push(archive.attribute(("width", "vtx"), (Pod::F32, 1), &widths));
    }
    let mut attributes = Vec::new();
    if !groom.uvs.is_empty() {
        let uvs = floats(groom.uvs.iter().flat_map(|uv| from_the_top(uv.to_array())));
        attributes.push(archive.attribute((ROOT_UV, "uni"), (Pod::F32, 2), &uvs));
    }
    if !groom.colors.is_empty() {
        let colors = floats(groom.colors.iter().flat_map(|c| c.to_f32_array_no_alpha()));
        attributes.push(archive.attribute((COLOR, "vtx"), (Pod::F32, 3), &colors));
    }
    if !groom.guides.is_empty() {
        let guides = groom.guides.iter().flat_map(|guide| i16::from(*guide).to_le_bytes());
        let guides: Vec<u8> = guides.collect();
        attributes.push(archive.attribute((GUIDE, "uni"), (Pod::I16, 1), &guides));
    }
    if !groom.stiffness.is_empty() {
        let shares = floats(groom.stiffness.iter().copied());
        attributes.push(archive.attribute((STIFFNESS, "uni"), (Pod::F32, 1), &shares));
    }
    if !groom.damping.is_empty() {
        let shares = floats(groom.damping.iter().copied());
        attributes.push(archive.attribute((DAMPING, "uni"), (Pod::F32, 1), &shares));
    }
    if !groom.groups.is_empty() {
        let unnamed = GroomGroup::default();
        let of = || groom.strands().map(|strand| strand.group.unwrap_or(&unnamed));
        let ids: Vec<u8> = of().flat_map(|group| group.id.to_le_bytes()).collect();
        attributes.push(archive.attribute((GROUP, "uni"), (Pod::I32, 1), &ids));
        let names: Vec<u8> =
            of().flat_map(|group| group.name.bytes().filter(|b| *b != 0).chain([0])).collect();
        attributes.push(archive.attribute((GROUP_NAME, "uni"), (Pod::Text, 1), &names));
    }
    if !attributes.is_empty() {
        set.push(archive.compound(".arbGeomParams", "", attributes));
    }
    let set = archive.compound(".geom", CURVES, set);
    let title = |schema, name| format!("{schema};schemaObjTitle=AbcGeom_{name}");
    let curves = title(CURVES, "Curve_v2:.geom");
    let strands = archive.object("strands", &curves, vec![set], Vec::new());
    let place = archive.compound(".xform", XFORM, Vec::new());
    let xform = title(XFORM, "Xform_v3:.xform");
    let top = archive.object("groom", &xform, vec![place], vec![strands]);
    Ok(archive.finished(vec![top]))
}
