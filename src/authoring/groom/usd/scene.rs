//! The prims of a USD stage, and the curve sets among them.

use super::{
    array::{Array, texts},
    error::{failed, wrong},
    transform::{self, Wrong},
};
use crate::authoring::groom::{
    Groom, GroomFileError, UpAxis,
    curve_sets::{
        Attributes, COLOR, CurveSet, CurveSets, Curves, DAMPING, GROUP, GROUP_NAME, GUIDE, Kind,
        Knots, Numbers, Param, ROOT_UV, STIFFNESS, WIDTH,
    },
    losses::GroomPlace,
};
use bevy::{math::DAffine3, platform::collections::HashSet};
use core::fmt::Display;
use openusd::{
    pcp,
    sdf::{Path, Specifier, Value},
    usd::{Prim, Stage, TimeCode},
};

/// Prims nested deeper are refused.
const DEEPEST: usize = 64;
/// So many bytes of the file justify a prim, beside …
const BYTES_PER_PRIM: usize = 8;
/// … so many: instances are prims too.
const PRIMS: usize = 50_000;
/// Paths and names are cut to so many characters.
const LONGEST: usize = 200;
const EXPORT_AGAIN: &str = "export the file again";
const CONVERT: &str = "convert the curves to linear or Catmull-Rom before the export";

/// Prims with a shape that are no curves.
const NO_CURVES: [&str; 14] = [
    "Mesh",
    "Points",
    "NurbsPatch",
    "TetMesh",
    "PointInstancer",
    "Volume",
    "Cube",
    "Sphere",
    "Cone",
    "Cylinder",
    "Cylinder_1",
    "Capsule",
    "Capsule_1",
    "Plane",
];

/// Primvars that are read …
const READ: [&str; 13] = [
    WIDTH,
    COLOR,
    ROOT_UV,
    GUIDE,
    GROUP,
    GROUP_NAME,
    STIFFNESS,
    DAMPING,
    "widths",
    "displayColor",
    "displayOpacity",
    "st",
    "surface_uv_coordinate",
];
/// … and those about the file.
const NOTES: [&str; 4] =
    ["groom_version_major", "groom_version_minor", "groom_tool", "groom_properties"];

pub struct Scene<'a> {
    stage: &'a Stage,
    bytes: usize,
    pub sets: CurveSets,
    read: Read,
    /// The prims of curves that were gathered.
    drawn: Vec<Path>,
    /// How many prims there may be.
    limit: usize,
    /// Blender writes particle hair as B-splines whose points lie on the strands.
    is_of_blender: bool,
}

/// How much of curves is read, and of when.
#[derive(Clone, Copy)]
enum Read {
    /// All, of the earliest time.
    All,
    Nodes(TimeCode),
}

/// A prim that others are in.
struct Open {
    path: Path,
    space: DAffine3,
    hidden: Option<&'static str>,
}

/// An array with the indices into it, if there are any.
struct Primvar {
    name: String,
    array: Array,
    indices: Option<Array>,
}

/// What a set of curves can do without.
#[derive(Default)]
struct Primvars {
    widths: Option<Primvar>,
    colors: Option<Primvar>,
    uvs: Option<Primvar>,
    guides: Option<Primvar>,
    stiffness: Option<Primvar>,
    damping: Option<Primvar>,
    groups: Option<Primvar>,
    group_names: Vec<String>,
}

impl From<Wrong> for GroomFileError {
    fn from(Wrong { name, found, expected }: Wrong) -> Self {
        wrong(name, found, expected, EXPORT_AGAIN)
    }
}

fn library<T>(result: Result<T, impl Display>) -> Result<T, GroomFileError> {
    // With what led to it.
    result.map_err(|error| failed(format!("{error:#}")))
}

impl<'a> Scene<'a> {
    pub fn of(stage: &'a Stage, bytes: usize) -> Result<Self, GroomFileError> {
        let (limit, sets) = (PRIMS + bytes / BYTES_PER_PRIM, CurveSets::of(bytes));
        let (read, drawn, is_of_blender) = (Read::All, Vec::new(), false);
        let mut scene = Self { stage, bytes, sets, read, drawn, limit, is_of_blender };
        let by = scene.metadata("documentation")?.map(texts).unwrap_or_default();
        scene.is_of_blender = by.iter().any(|text| text.starts_with("Blender"));
        Ok(scene)
    }

    fn metadata(&self, name: &str) -> Result<Option<Value>, GroomFileError> {
        library(self.stage.stage_metadata(name))
    }

    /// Metres per unit and the axis that is up, as far as the file says.
    pub fn unit_and_up(&self) -> Result<(Option<f32>, Option<UpAxis>), GroomFileError> {
        let unit = self.metadata("metersPerUnit")?.and_then(Array::of);
        let unit = unit.map(|unit| (&unit).get(0) as f32);
        if let Some(unit) = unit.filter(|unit| !(1e-9..=1e9).contains(unit)) {
            let hint = "correct it, or set it by usdedit";
            return Err(wrong("metersPerUnit", unit, "a length of 1e-9 to 1e9", hint));
        }
        let up = self.metadata("upAxis")?.map(texts).unwrap_or_default().pop();
        let up = match up.as_deref() {
            None => None,
            Some("X") => Some(UpAxis::X),
            Some("Y") => Some(UpAxis::Y),
            Some("Z") => Some(UpAxis::Z),
            Some(other) => return Err(wrong("upAxis", cut(other), "Y or Z", EXPORT_AGAIN)),
        };
        Ok((unit, up))
    }

    /// Time codes a second.
    pub fn rate(&self) -> Result<f64, GroomFileError> {
        let rate = self.stage.time_codes_per_second();
        if (1e-6..=1e9).contains(&rate) {
            return Ok(rate);
        }
        Err(wrong("timeCodesPerSecond", rate, "a number of 1e-6 to 1e9", "correct it by usdedit"))
    }

    /// The times (in time codes) at which curves that are drawn have samples of points or transforms, in order;
    /// the earliest time, if there are none. For what [`walk`](Self::walk) has visited.
    pub fn times(&self) -> Result<Vec<TimeCode>, GroomFileError> {
        let (mut times, mut seen) = (Vec::new(), HashSet::<String>::default());
        let mut add = |prim: &Prim, name: &str| {
            times.extend(samples_of(prim, name)?);
            Ok::<_, GroomFileError>(())
        };
        for path in &self.drawn {
            add(&self.stage.prim(path.clone()), "points")?;
            // Of what is above a prim that was seen, all is known.
            let mut above = Some(path.clone());
            while let Some(path) = above.take_if(|path| seen.insert(path.to_string())) {
                let prim = self.stage.prim(path.clone());
                for name in self.value(&prim, transform::ORDER)?.map(texts).unwrap_or_default() {
                    add(&prim, name.strip_prefix(transform::INVERTED).unwrap_or(&name))?;
                }
                above = path.parent();
            }
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        let times: Vec<TimeCode> = times.into_iter().map(TimeCode::from).collect();
        Ok(if times.is_empty() { vec![TimeCode::EARLIEST] } else { times })
    }

    /// The curves at a time, of which nothing but the nodes are known; as many at any, if they are the same.
    pub fn nodes(&mut self, at: TimeCode) -> Result<Groom, GroomFileError> {
        (self.sets, self.read) = (CurveSets::of(self.bytes), Read::Nodes(at));
        self.drawn.clear();
        self.walk().map_err(|error| match error {
            GroomFileError::Usd { place, found, expected, hint } => {
                let place = format!("{place} at time code {}", at.value());
                GroomFileError::Usd { place, found, expected, hint }
            }
            other => other,
        })?;
        Ok(core::mem::replace(&mut self.sets, CurveSets::of(0)).nodes())
    }

    /// Gathers the curves of all prims.
    pub fn walk(&mut self) -> Result<(), GroomFileError> {
        let root = Open { path: Path::abs_root(), space: DAffine3::IDENTITY, hidden: None };
        let mut open = Vec::new();
        self.open_children(&root, library(self.stage.root_prims())?, &mut open)?;
        let mut prims = 0;
        while let Some(mut at) = open.pop() {
            prims += 1;
            if prims > self.limit {
                let expected = format!("at most {}, as the file's size justifies", self.limit);
                return Err(wrong("the count of prims", "more", expected, "leave out instances"));
            }
            let prim = self.stage.prim(at.path.clone());
            let is_defined = library(prim.specifier())? == Some(Specifier::Def);
            if !is_defined || !library(prim.is_active())? {
                continue;
            }
            let kind = library(prim.type_name())?.unwrap_or_default();
            self.enter(&prim, &mut at)?;
            let path = cut(at.path.to_string());
            match kind.as_str() {
                "BasisCurves" | "NurbsCurves" | "HermiteCurves" => {
                    self.curves(&prim, kind.as_str(), &at, &path)?;
                }
                other if NO_CURVES.contains(&other) => {
                    self.sets.losses.skipped_primitives.add(GroomPlace::Part(path));
                    // What it draws is elsewhere than where its prototypes are.
                    if other == "PointInstancer" {
                        continue;
                    }
                }
                _ => {}
            }
            self.open_children(&at, library(prim.child_names())?, &mut open)?;
        }
        self.other_files();
        Ok(())
    }

    fn open_children(
        &self,
        of: &Open,
        names: Vec<openusd::tf::Token>,
        open: &mut Vec<Open>,
    ) -> Result<(), GroomFileError> {
        if !names.is_empty() && of.path.prim_element_count() >= DEEPEST {
            let expected = format!("at most {DEEPEST}");
            return Err(wrong("the depth of prims", "more", expected, EXPORT_AGAIN));
        }
        for name in names.iter().rev() {
            let path = library(of.path.append_path(name.as_str()))?;
            open.push(Open { path, space: of.space, hidden: of.hidden });
        }
        Ok(())
    }

    /// The transform of a prim, and whether it is drawn.
    fn enter(&self, prim: &Prim, at: &mut Open) -> Result<(), GroomFileError> {
        let token = |name| Ok::<_, GroomFileError>(self.value(prim, name)?.map(texts));
        let is = |token: Option<Vec<String>>, what| token.is_some_and(|token| token == [what]);
        if is(token("visibility")?, "invisible") {
            at.hidden = Some("invisible");
        }
        let purpose = token("purpose")?;
        if is(purpose.clone(), "proxy") {
            at.hidden = at.hidden.or(Some("of purpose proxy"));
        } else if is(purpose, "guide") && self.primvar(prim, &[GUIDE])?.is_none() {
            at.hidden = at.hidden.or(Some("of purpose guide"));
        }
        let order = self.value(prim, transform::ORDER)?.map(texts).unwrap_or_default();
        at.space = transform::space_of(at.space, &order, |name| self.moving(prim, name))
            .map_err(|error| in_prim(error, &at.path))?;
        Ok(())
    }

    /// The earliest value of an attribute.
    fn value(&self, prim: &Prim, name: &str) -> Result<Option<Value>, GroomFileError> {
        let value = library(prim.attribute(name).get_at::<Value>(TimeCode::EARLIEST))?;
        Ok(value.filter(|value| !matches!(value, Value::None | Value::ValueBlock)))
    }

    /// The value of an attribute that moves nodes, at the time that is read.
    fn moving(&self, prim: &Prim, name: &str) -> Result<Option<Value>, GroomFileError> {
        let Read::Nodes(time) = self.read else { return self.value(prim, name) };
        let value = library(prim.attribute(name).get_at::<Value>(time))?;
        Ok(value.filter(|value| !matches!(value, Value::None | Value::ValueBlock)))
    }

    fn array(&self, prim: &Prim, name: &str) -> Result<Option<Array>, GroomFileError> {
        Ok(self.value(prim, name)?.and_then(Array::of))
    }

    /// The first of these primvars that there is; some files have them as mere attributes.
    fn primvar(&self, prim: &Prim, names: &[&str]) -> Result<Option<Primvar>, GroomFileError> {
        for name in names {
            for full in [format!("primvars:{name}"), (*name).to_owned()] {
                if let Some(array) = self.array(prim, &full)? {
                    let indices = self.array(prim, &format!("{full}:indices"))?;
                    return Ok(Some(Primvar { name: full, array, indices }));
                }
            }
        }
        Ok(None)
    }

    fn curves(
        &mut self,
        prim: &Prim,
        kind: &str,
        at: &Open,
        path: &str,
    ) -> Result<(), GroomFileError> {
        let place = || GroomPlace::Part(path.to_owned());
        if let Some(why) = at.hidden {
            self.sets.losses.hidden_curves.add(GroomPlace::Part(format!("{path}, {why}")));
            return Ok(());
        }
        let points = self.moving(prim, "points")?.and_then(Array::of);
        let counts = self.moving(prim, "curveVertexCounts")?.and_then(Array::of);
        let (Some(points), Some(counts)) = (points, counts) else {
            self.sets.losses.empty_curves.add(place());
            return Ok(());
        };
        if counts.iter().next().is_none() {
            self.sets.losses.empty_curves.add(place());
            return Ok(());
        }
        if points.each != 3 {
            let found = format!("numbers of {}", points.each);
            return Err(wrong(format!("{path}.points"), found, "point3f[]", EXPORT_AGAIN));
        }
        let (kind, is_even) = self.kind_of(prim, kind, path)?;
        let curves = self.curves_of(kind, &points, &counts, path)?;
        self.drawn.push(at.path.clone());
        let samples = samples_of(prim, "points")?.len();
        if let Some(more @ 1..) = samples.checked_sub(1) {
            self.sets.losses.unread_samples.add_many(more, place());
        }
        if self.token(prim, "wrap")?.as_deref() == Some("periodic") {
            self.sets.losses.opened_loops.add_many(curves.len(), place());
        }
        let primvars = match self.read {
            Read::All => self.primvars(prim)?,
            Read::Nodes(_) => Primvars::default(),
        };
        let attributes = self.attributes(&primvars, &curves, path);
        if matches!(self.read, Read::All) {
            self.unread(prim, path)?;
        }
        let weights = self.array(prim, "pointWeights")?;
        let orders = self.array(prim, "order")?;
        let knots = self.array(prim, "knots")?;
        let knots = match &knots {
            Some(knots) => Knots::Given(knots),
            None if is_even => Knots::Even,
            None => Knots::Clamped,
        };
        let set = CurveSet {
            curves,
            points: &points,
            weights: weights.as_ref(),
            orders: orders.as_ref(),
            knots,
            space: &at.space,
            path,
        };
        Ok(self.sets.add(&set, &attributes)?)
    }

    fn primvars(&self, prim: &Prim) -> Result<Primvars, GroomFileError> {
        let colors = self.primvar(prim, &[COLOR, "displayColor"])?;
        // One for all is what a viewport shows, not what somebody has painted.
        let colors = colors.filter(|colors| {
            let found = colors
                .indices
                .as_ref()
                .map_or((&colors.array).len() / colors.array.each, |i| i.len());
            !colors.name.ends_with("displayColor") || found > 1
        });
        Ok(Primvars {
            widths: self.primvar(prim, &[WIDTH, "widths"])?,
            colors,
            uvs: self.primvar(prim, &[ROOT_UV, "surface_uv_coordinate", "st"])?,
            guides: self.primvar(prim, &[GUIDE])?,
            stiffness: self.primvar(prim, &[STIFFNESS])?,
            damping: self.primvar(prim, &[DAMPING])?,
            groups: self.primvar(prim, &[GROUP])?,
            group_names: self.group_names(prim)?,
        })
    }

    fn attributes<'v>(
        &mut self,
        primvars: &'v Primvars,
        curves: &Curves,
        path: &str,
    ) -> Attributes<'v, &'v Array> {
        Attributes {
            widths: self.param(&primvars.widths, 1, curves, path),
            colors: self.param(&primvars.colors, 3, curves, path),
            uvs: self.param(&primvars.uvs, 2, curves, path),
            guides: self.param(&primvars.guides, 1, curves, path),
            stiffness: self.param(&primvars.stiffness, 1, curves, path),
            damping: self.param(&primvars.damping, 1, curves, path),
            groups: self.param(&primvars.groups, 1, curves, path),
            group_names: primvars.group_names.iter().map(String::as_str).collect(),
        }
    }

    /// The curves of a set, whose counts fit its points.
    fn curves_of(
        &self,
        kind: Kind,
        points: &Array,
        counts: &Array,
        path: &str,
    ) -> Result<Curves, GroomFileError> {
        let found = points.len() / 3;
        if let Some(most) = self.sets.beyond(found, counts.len()) {
            let what = format!("the count of nodes and strands in {path}");
            let expected = format!("at most {}, as the file's size justifies", self.sets.limit);
            return Err(wrong(what, most, expected, "apply instances before the export"));
        }
        Curves::of(kind, counts, found).map_err(|sum| {
            let expected = format!("{sum}, the sum of curveVertexCounts, each 0 or more");
            wrong(format!("the count of {path}.points"), found, expected, EXPORT_AGAIN)
        })
    }

    fn token(&self, prim: &Prim, name: &str) -> Result<Option<String>, GroomFileError> {
        Ok(self.value(prim, name)?.and_then(|value| texts(value).pop()))
    }

    /// How curves of a set become strands, and whether their knots are even. What is not written is cubic, Bezier
    /// and open.
    fn kind_of(
        &self,
        prim: &Prim,
        schema: &str,
        path: &str,
    ) -> Result<(Kind, bool), GroomFileError> {
        match schema {
            "NurbsCurves" => return Ok((Kind::Spline, false)),
            "HermiteCurves" => return Ok((Kind::Joined, false)),
            _ => {}
        }
        let word = |name, otherwise: &str| {
            Ok::<_, GroomFileError>(self.token(prim, name)?.unwrap_or_else(|| otherwise.to_owned()))
        };
        let (kind, basis) = (word("type", "cubic")?, word("basis", "bezier")?);
        let is_pinned = word("wrap", "nonperiodic")? == "pinned";
        match (kind.as_str(), basis.as_str()) {
            ("linear", _) | ("cubic", "catmullRom") => Ok((Kind::Joined, false)),
            ("cubic", "bezier") => Ok((Kind::Bezier, false)),
            ("cubic", "bspline") if self.is_of_blender => Ok((Kind::Joined, false)),
            ("cubic", "bspline") => Ok((Kind::Spline, !is_pinned)),
            _ => {
                let found = format!("{} {}", cut(&kind), cut(&basis));
                let expected = "linear, or cubic by bezier, bspline or catmullRom";
                Err(wrong(format!("the type of {path}"), found, expected, CONVERT))
            }
        }
    }

    fn group_names(&self, prim: &Prim) -> Result<Vec<String>, GroomFileError> {
        for name in [format!("primvars:{GROUP_NAME}"), GROUP_NAME.to_owned()] {
            let Some(value) = self.value(prim, &name)? else {
                continue;
            };
            let names: Vec<String> = texts(value).into_iter().map(cut).collect();
            let Some(indices) = self.array(prim, &format!("{name}:indices"))? else {
                return Ok(names);
            };
            let named = indices.iter().map(|i| names.get(i as usize).cloned().unwrap_or_default());
            return Ok(named.collect());
        }
        Ok(Vec::new())
    }

    /// An array that a set can do without, of at least so many numbers to an element: `None`, and counted, if it
    /// cannot be read.
    fn param<'v, const N: usize>(
        &mut self,
        primvar: &'v Option<Primvar>,
        least: usize,
        curves: &Curves,
        path: &str,
    ) -> Option<Param<&'v Array, N>> {
        let Primvar { name, array, indices } = primvar.as_ref()?;
        let param = match array.each {
            each if each < least => Err(format!("elements of {each} numbers, expected {least}")),
            each => Param::of(array, indices.as_ref(), each, curves),
        };
        let wrong = |wrong| {
            let part = format!("{path}.{name}: {wrong}");
            self.sets.losses.broken_arrays.add(GroomPlace::Part(part));
        };
        param.map_err(wrong).ok()
    }

    /// Counts arrays that a groom has no place for.
    fn unread(&mut self, prim: &Prim, path: &str) -> Result<(), GroomFileError> {
        let mut seen: HashSet<String> = HashSet::default();
        for name in library(prim.property_names())? {
            let name = name.as_str();
            let primvar = name.strip_prefix("primvars:");
            let whole = primvar.unwrap_or(name);
            let base = whole.split(':').next().unwrap_or_default();
            let is_known = READ.contains(&base) || NOTES.contains(&base);
            let is_array = ["normals", "velocities", "accelerations"].contains(&name);
            if (is_array || primvar.is_some() && !is_known) && seen.insert(base.to_owned()) {
                let part = format!("{path}.{}", cut(name));
                self.sets.losses.unread_arrays.add(GroomPlace::Part(part));
            }
        }
        Ok(())
    }

    /// Counts other files that the file refers to.
    fn other_files(&mut self) {
        for error in self.stage.composition_errors() {
            let part = match &error {
                pcp::Error::UnresolvedLayer { asset_path, site_path, .. } => {
                    format!("{} at {}", cut(asset_path), cut(site_path.to_string()))
                }
                other => cut(other.to_string()),
            };
            self.sets.losses.unread_files.add(GroomPlace::Part(part));
        }
    }
}

/// The times of an attribute's samples, which have to ascend: the library looks for them so.
fn samples_of(prim: &Prim, name: &str) -> Result<Vec<f64>, GroomFileError> {
    let times = library(prim.attribute(name).time_sample_times())?;
    let Some(pair) = times.windows(2).find(|pair| !matches!(pair, [a, b] if a < b)) else {
        return Ok(times);
    };
    let place = format!("{}.{name}.timeSamples", cut(prim.path().to_string()));
    let found = format!("{} after {}", pair[1], pair[0]);
    Err(wrong(place, found, "times that ascend", "sort them, as usdcat does"))
}

/// The error with the prim that it is about.
fn in_prim(error: GroomFileError, path: &Path) -> GroomFileError {
    match error {
        GroomFileError::Usd { place, found, expected, hint } => {
            let place = format!("{}.{place}", cut(path.to_string()));
            GroomFileError::Usd { place, found, expected, hint }
        }
        other => other,
    }
}

fn cut(text: impl AsRef<str>) -> String {
    text.as_ref().chars().take(LONGEST).collect()
}
