//! Alembic archives (`.abc`) with curves, read and written: hair as Blender, Maya, Houdini and Unreal's users
//! export it.
//!
//! The container is Ogawa; archives of before 2013 are HDF5 and not read. All curve sets of a file become one
//! groom, in the order of the file and with the transforms above them applied. Of what is animated a [`Groom`] has the first
//! sample, and a [`GroomCache`](super::GroomCache) all. The format specifies neither unit nor axes: see
//! [`GroomSettings`](super::GroomSettings).
//!
//! | curves | become |
//! |---|---|
//! | linear of any basis, Catmull-Rom | their points, joined |
//! | Bezier | anchors, and two nodes between each two on the curve |
//! | B-spline, variable order (NURBS) | as many nodes as points, even in the parameter; without knots from end to end |
//! | closed | opened at the first point |
//!
//! | numbers | where |
//! |---|---|
//! | diameters | `groom_width`, else `width`; scaled with the transforms |
//! | UVs of roots | `groom_root_uv`, else `uv`; V counts from the bottom there, from the top in a [`Groom`] |
//! | colours | `groom_color`, else `Cd` |
//! | guides | `groom_guide`: see [`Groom::with_guides`] |
//! | groups | `groom_group_id` and `groom_group_name`; else each set of several is one: see [`Groom::groups`] |
//! | stiffness, damping | `groom_stiffness`, `groom_damping`, our own: see [`Groom::with_stiffness`] |
//!
//! Each may be one for the set, one a curve or one a point; sets that have none where others do take the mean
//! of those (zero for UVs, 1 for stiffness).

mod ogawa;

#[cfg(test)]
mod tests;
mod write;

pub use write::{write, write_cache};

use super::{
    Groom, GroomCacheError, GroomFileError, GroomLosses,
    bytes::value,
    curve_sets::{
        Attributes, COLOR, CurveSet, CurveSets, Curves, DAMPING, GROUP, GROUP_NAME, GUIDE, Kind,
        Knots, Numbers, Param, ROOT_UV, STIFFNESS, WIDTH,
    },
    intake::Intake,
    losses::GroomPlace,
};
use bevy::{
    math::{DAffine3, DMat3, DQuat, DVec3},
    prelude::*,
};
use ogawa::{Children, Compound, EXPORT_AGAIN, Object, Ogawa, Property, Values};

/// Objects nested deeper are refused.
const DEEPEST: usize = 256;

/// A groom from the bytes of an `.abc` file, in the file's own unit and axes, and what was left out.
///
/// Hidden objects and those in them are left out and counted, and so are meshes and instances, sets without
/// curves, further samples, and arrays of which a groom has none. Strands with a number that is not finite
/// or a width that is negative are left out and counted.
///
/// ```
/// # use bevy_keratin::authoring::groom::{Groom, alembic}; use bevy::prelude::*;
/// let groom = Groom::from_polylines([[Vec3::ZERO, Vec3::Y * 0.1]]).unwrap();
/// let file = alembic::write(&groom).unwrap();
/// assert_eq!(alembic::read(&file).unwrap().0, groom);
/// ```
///
/// # Errors
/// When the container is broken or unfinished, points and counts of a set contradict each other, its basis is
/// Hermite or power, or no strand is left.
pub fn read(file: &[u8]) -> Result<(Groom, GroomLosses), GroomFileError> {
    intake(file).map(|intake| (intake.groom, intake.losses))
}

pub(super) fn intake(file: &[u8]) -> Result<Intake, GroomFileError> {
    let archive = Ogawa::open(file)?;
    Ok(Reading::of(&archive, Read::All)?.sets.finish()?)
}

/// Calls `take` for each sample of what moves nodes: with the count of all, the time (s), and the groom without
/// anything but nodes, whatever numbers they are.
pub(super) fn each_frame(
    file: &[u8],
    mut take: impl FnMut(u64, f64, Groom) -> Result<(), GroomCacheError>,
) -> Result<(), GroomCacheError> {
    let mut archive = Ogawa::open(file)?;
    let Moments { count, times } = Reading::of(&archive, Read::Nodes)?.moments;
    for sample in 0..count {
        archive.sample = sample;
        archive.look_again();
        let time = if count == 1 { 0.0 } else { archive.time(times, sample)? };
        take(count, time, Reading::of(&archive, Read::Nodes)?.sets.nodes())?;
    }
    Ok(())
}

/// When nodes move.
#[derive(Clone, Copy)]
struct Moments {
    count: u64,
    /// By their [kind](Property::times).
    times: u64,
}

/// An object that others are in.
struct Open<'a> {
    name: &'a str,
    children: Children<'a>,
    space: DAffine3,
    hidden: bool,
}

struct Reading<'a> {
    archive: &'a Ogawa<'a>,
    sets: CurveSets,
    /// Of what has the most samples of all that moves nodes.
    moments: Moments,
    read: Read,
}

/// How much of curves is read.
#[derive(Clone, Copy, PartialEq)]
enum Read {
    All,
    Nodes,
}

impl Numbers for Values<'_> {
    fn len(self) -> usize {
        Values::len(&self)
    }

    fn get(self, i: usize) -> f64 {
        Values::get(&self, i)
    }
}

fn path_of(open: &[Open<'_>], object: Object<'_>) -> String {
    let above = open.iter().skip(1).map(|open| open.name);
    let path = above.chain([object.name]).fold(String::new(), |path, name| path + "/" + name);
    path.chars().take(200).collect()
}

impl<'a> Reading<'a> {
    fn of(archive: &'a Ogawa<'a>, read: Read) -> Result<Self, GroomFileError> {
        let (sets, moments) = (CurveSets::of(archive.len()), Moments { count: 1, times: 0 });
        let mut reading = Self { archive, sets, moments, read };
        reading.walk()?;
        if reading.sets.is_empty() {
            let hint = "export hair curves or particle hair with it, visible";
            let found = format!("without curves ({})", reading.sets.losses);
            return value(8, "the archive", found, "one with AbcGeom_Curve", hint);
        }
        Ok(reading)
    }

    /// Notes what moves nodes.
    fn moves(&mut self, property: Property<'a>) {
        if property.moments() > self.moments.count {
            self.moments = Moments { count: property.moments(), times: property.times };
        }
    }

    fn walk(&mut self) -> Result<(), GroomFileError> {
        let archive = self.archive;
        let top = archive.top();
        let (space, hidden) = (DAffine3::IDENTITY, false);
        let mut open = vec![Open { name: "", children: archive.children(top)?, space, hidden }];
        while let Some(within) = open.last_mut() {
            let Some(object) = archive.next(&mut within.children)? else {
                open.pop();
                continue;
            };
            let (mut space, mut hidden) = (within.space, within.hidden);
            let properties = archive.properties_of(object)?;
            if let Some(visible) = archive.find_values(properties, "visible")? {
                hidden |= visible.get(0) == 0.0;
            }
            let schema = object.schema();
            if object.is_instance() {
                let path = format!("{}, an instance", path_of(&open, object));
                self.sets.losses.skipped_primitives.add(GroomPlace::Part(path));
            } else if schema.starts_with("AbcGeom_Xform") {
                space = self.transform(archive.find_compound(properties, ".xform")?, space)?;
            } else if schema.starts_with("AbcGeom_Curve") {
                let path = path_of(&open, object);
                match hidden {
                    true => self.sets.losses.hidden_curves.add(GroomPlace::Part(path)),
                    false => {
                        let set = archive.find_compound(properties, ".geom")?;
                        self.curves(set, &space, &path)?;
                    }
                }
            } else if schema.starts_with("AbcGeom_") && !schema.starts_with("AbcGeom_FaceSet") {
                let path = path_of(&open, object);
                self.sets.losses.skipped_primitives.add(GroomPlace::Part(path));
            }
            if open.len() >= DEEPEST {
                let expected = format!("at most {DEEPEST}");
                return value(8, "the depth of objects", "more", expected, EXPORT_AGAIN);
            }
            let children = archive.children(object)?;
            open.push(Open { name: object.name, children, space, hidden });
        }
        Ok(())
    }

    /// The space of a transform's children. Operations are listed outermost first.
    fn transform(
        &mut self,
        properties: Compound<'a>,
        above: DAffine3,
    ) -> Result<DAffine3, GroomFileError> {
        if let Some(moving) = self.archive.find(properties, ".vals")? {
            self.moves(moving);
        }
        let find = |name| self.archive.find_values(properties, name);
        let inherits = find(".inherits")?.is_none_or(|inherits| inherits.get(0) != 0.0);
        let mut space = if inherits { above } else { DAffine3::IDENTITY };
        let (Some(operations), values) = (find(".ops")?, find(".vals")?) else {
            return Ok(space);
        };
        let mut at = 0;
        for operation in operations.iter() {
            let number = |k: usize| values.map_or(f64::NAN, |values| values.get(at + k));
            let vector = |k: usize| DVec3::new(number(k), number(k + 1), number(k + 2));
            let turned = |axis, degrees: f64| {
                DAffine3::from_quat(DQuat::from_axis_angle(axis, degrees.to_radians()))
            };
            let (local, count) = match operation as u32 >> 4 {
                0 => (DAffine3::from_scale(vector(0)), 3),
                1 => (DAffine3::from_translation(vector(0)), 3),
                2 => (turned(vector(0).normalize_or(DVec3::X), number(3)), 4),
                3 => {
                    // Row vectors: rows are the images of the axes.
                    let axes = DMat3::from_cols(vector(0), vector(4), vector(8));
                    (DAffine3::from_mat3_translation(axes, vector(12)), 16)
                }
                4 => (turned(DVec3::X, number(0)), 1),
                5 => (turned(DVec3::Y, number(0)), 1),
                6 => (turned(DVec3::Z, number(0)), 1),
                other => {
                    let expected = "0 to 6, a scale, translation, rotation or matrix";
                    let what = "the kind of a transform's operation";
                    return value(operations.at, what, other, expected, EXPORT_AGAIN);
                }
            };
            at += count;
            if values.is_none_or(|values| values.len() < at) {
                let what = "the count of a transform's numbers";
                let found = values.map_or(0, |values| values.len());
                let expected = format!("{at} or more");
                return value(operations.at, what, found, expected, EXPORT_AGAIN);
            }
            space *= local;
        }
        Ok(space)
    }

    fn curves(
        &mut self,
        set: Compound<'a>,
        space: &DAffine3,
        path: &str,
    ) -> Result<(), GroomFileError> {
        let archive = self.archive;
        let place = || GroomPlace::Part(path.to_owned());
        let positions = archive.find(set, "P")?;
        let counts = archive.find_values(set, "nVertices")?;
        let points = positions.map_or(Ok(None), |positions| archive.values(positions))?;
        let (Some(positions), Some(points), Some(counts)) = (positions, points, counts) else {
            self.sets.losses.empty_curves.add(place());
            return Ok(());
        };
        let (kind, is_closed) = kind_of(archive.find_values(set, "curveBasisAndType")?, path)?;
        let curves = self.curves_of(kind, points, counts, path)?;
        self.moves(positions);
        if let Some(more @ 1..) = positions.samples.checked_sub(1) {
            self.sets.losses.unread_samples.add_many(more as usize, place());
        }
        if is_closed {
            self.sets.losses.opened_loops.add_many(curves.len(), place());
        }
        let attributes = match self.read {
            Read::All => self.attributes(set, &curves, path)?,
            Read::Nodes => Attributes::default(),
        };
        let find = |name| archive.find_values(set, name);
        let (weights, orders) = (find("w")?, find(".orders")?);
        let knots = find(".knots")?.map_or(Knots::Clamped, Knots::Given);
        let set = CurveSet { curves, points, weights, orders, knots, space, path };
        Ok(self.sets.add(&set, &attributes)?)
    }

    /// The curves of a set, whose counts fit its points.
    fn curves_of(
        &self,
        kind: Kind,
        points: Values<'a>,
        counts: Values<'a>,
        path: &str,
    ) -> Result<Curves, GroomFileError> {
        let found = points.len() / 3;
        if let Some(most) = self.sets.beyond(found, counts.len()) {
            let found = format!("{most} in {path}");
            let expected = format!("at most {}, as the file's size justifies", self.sets.limit);
            let hint = "apply instances before the export";
            return value(points.at, "the count of nodes and strands", found, expected, hint);
        }
        Curves::of(kind, counts, found).or_else(|sum| {
            let found = format!("{found} in {path}");
            let expected = format!("{sum}, the sum of nVertices, each 0 or more");
            value(points.at, "the count of points", found, expected, EXPORT_AGAIN)
        })
    }

    /// The optional numbers of a set.
    fn attributes(
        &mut self,
        set: Compound<'a>,
        curves: &Curves,
        path: &str,
    ) -> Result<Attributes<'a, Values<'a>>, GroomFileError> {
        let archive = self.archive;
        let own = archive.find_compound(set, ".arbGeomParams")?;
        let first_of = |among: [(Compound<'a>, &str); 2]| {
            let [first, second] = among.map(|(compound, name)| archive.find(compound, name));
            Ok::<_, GroomFileError>(first?.or(second?))
        };
        let widths = first_of([(own, WIDTH), (set, "width")])?;
        let colors = first_of([(own, COLOR), (own, "Cd")])?;
        let given = if colors.is_some_and(|color| color.extent() == 4) { 4 } else { 3 };
        let uvs = first_of([(own, ROOT_UV), (set, "uv")])?;
        let names = archive.find(own, GROUP_NAME)?;
        let names = names.map_or(Ok(Vec::new()), |names| archive.texts(names, curves.len()))?;
        let mut one =
            |name| Ok::<_, GroomFileError>(self.param(archive.find(own, name)?, 1, curves, path));
        let (guides, groups) = (one(GUIDE)?, one(GROUP)?);
        let (stiffness, damping) = (one(STIFFNESS)?, one(DAMPING)?);
        let attributes = Attributes {
            widths: self.param(widths, 1, curves, path),
            colors: self.param(colors, given, curves, path),
            uvs: self.param(uvs, 2, curves, path),
            guides,
            stiffness,
            damping,
            groups,
            group_names: names,
        };
        let losses = &mut self.sets.losses;
        let mut unread = |name: &str| {
            losses.unread_arrays.add(GroomPlace::Part(format!("{path}.{name}")));
        };
        archive.visit(own, |property| {
            // Of `groom_version_major` and others, which say nothing about strands, as of those that are read.
            let is_known = READ.contains(&property.name) || NOTES.contains(&property.name);
            if !is_known && (property.samples > 0 || property.is_compound()) {
                unread(property.name);
            }
            false
        })?;
        for name in ["N", ".velocities"] {
            if archive.find_values(set, name)?.is_some() {
                unread(name);
            }
        }
        Ok(attributes)
    }

    /// An array that a set can do without, `given` numbers to an element: `None`, and counted, if it cannot be read.
    fn param<const N: usize>(
        &mut self,
        property: Option<Property<'a>>,
        given: usize,
        curves: &Curves,
        path: &str,
    ) -> Option<Param<Values<'a>, N>> {
        let property = property?;
        let text = |error: GroomFileError| error.to_string();
        let arrays = arrays_of(self.archive, property).map_err(text);
        let param = arrays.and_then(|(values, indices)| {
            let of = |values| Param::of(values, indices, given, curves);
            values.map(of).transpose()
        });
        param.unwrap_or_else(|wrong| {
            let part = format!("{path}.{}: {wrong}", property.name);
            self.sets.losses.broken_arrays.add(GroomPlace::Part(part));
            None
        })
    }
}

/// The values of a property and the indices into them, as far as there are any.
fn arrays_of<'a>(
    archive: &Ogawa<'a>,
    property: Property<'a>,
) -> Result<(Option<Values<'a>>, Option<Values<'a>>), GroomFileError> {
    if !property.is_compound() {
        return Ok((archive.values(property)?, None));
    }
    let inside = archive.inside(property)?;
    Ok((archive.find_values(inside, ".vals")?, archive.find_values(inside, ".indices")?))
}

/// Attributes that are read …
const READ: [&str; 9] = [WIDTH, COLOR, ROOT_UV, GUIDE, GROUP, GROUP_NAME, STIFFNESS, DAMPING, "Cd"];
/// … and those about the file.
const NOTES: [&str; 4] =
    ["groom_version_major", "groom_version_minor", "groom_tool", "groom_properties"];

/// How curves of a set become strands, and whether they are closed.
fn kind_of(basis_and_type: Option<Values<'_>>, path: &str) -> Result<(Kind, bool), GroomFileError> {
    let Some(numbers) = basis_and_type else {
        return Ok((Kind::Joined, false));
    };
    let [kind, wrap, basis] = [0, 1, 2].map(|k| numbers.get(k) as u8);
    let is_closed = wrap == 1;
    match (kind, basis) {
        (1, _) | (0, 0 | 3) => Ok((Kind::Joined, is_closed)),
        (0, 1) => Ok((Kind::Bezier, is_closed)),
        (0, 2) | (2, _) => Ok((Kind::Spline, is_closed)),
        _ => {
            let found = format!("type {kind} and basis {basis} in {path}");
            let expected = "linear, variable order, or cubic by Bezier, B-spline or Catmull-Rom";
            let hint = "convert the curves to linear or Catmull-Rom before the export";
            value(numbers.at, "the curves' type", found, expected, hint)
        }
    }
}
