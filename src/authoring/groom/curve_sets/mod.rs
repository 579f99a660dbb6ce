//! Sets of curves, as Alembic and USD have them, on their way to one groom.

mod curves;
mod groups;
mod params;

pub use curves::{Curves, Kind, Numbers};
pub use params::{
    COLOR, DAMPING, GROUP, GROUP_NAME, GUIDE, Param, ROOT_UV, STIFFNESS, WIDTH, from_the_top,
};

use super::{Groom, GroomError, GroomLosses, intake::Intake, losses::GroomPlace};
use bevy::{
    math::{DAffine3, DVec3, DVec4},
    prelude::*,
};
use curves::{CUBIC, Curve};
use groups::Groups;
use params::Column;

/// So many bytes of a file justify a node, or a strand: sets may share their arrays.
pub const BYTES_PER_NODE: usize = 4;

/// One set of curves.
pub struct CurveSet<'a, V> {
    pub curves: Curves,
    /// Three to a point.
    pub points: V,
    /// Of B-splines and NURBS: weights of points, an order to a curve.
    pub weights: Option<V>,
    pub orders: Option<V>,
    pub knots: Knots<V>,
    /// From its own space to that of the groom.
    pub space: &'a DAffine3,
    /// Where it is in the file.
    pub path: &'a str,
}

/// Where the knots of splines are.
#[derive(Clone, Copy)]
pub enum Knots<V> {
    /// In the file, curve after curve.
    Given(V),
    /// Even, from one end of the points to the other.
    Clamped,
    /// Even; the curve ends before its outermost points.
    #[cfg_attr(not(feature = "usd"), allow(dead_code, reason = "curves of USD have them"))]
    Even,
}

/// What a set can do without.
pub struct Attributes<'n, V> {
    pub widths: Option<Param<V, 1>>,
    pub colors: Option<Param<V, 4>>,
    pub uvs: Option<Param<V, 2>>,
    pub guides: Option<Param<V, 1>>,
    pub stiffness: Option<Param<V, 1>>,
    pub damping: Option<Param<V, 1>>,
    pub groups: Option<Param<V, 1>>,
    /// One for all, or one a curve.
    pub group_names: Vec<&'n str>,
}

impl<V> Default for Attributes<'_, V> {
    fn default() -> Self {
        let (widths, colors, uvs, guides, stiffness, damping, groups) = default();
        Self { widths, colors, uvs, guides, stiffness, damping, groups, group_names: Vec::new() }
    }
}

/// A groom that is gathered set by set.
pub struct CurveSets {
    /// How many nodes, and strands, the groom may have.
    pub limit: usize,
    groom: Groom,
    widths: Column<1>,
    colors: Column<4>,
    uvs: Column<2>,
    guides: Column<1>,
    stiffness: Column<1>,
    damping: Column<1>,
    groups: Groups,
    pub losses: GroomLosses,
}

impl CurveSets {
    /// None yet, from a file of so many bytes.
    pub fn of(bytes: usize) -> Self {
        Self {
            limit: bytes / BYTES_PER_NODE,
            groom: Groom::default(),
            widths: Column::EMPTY,
            colors: Column::EMPTY,
            uvs: Column::EMPTY,
            guides: Column::EMPTY,
            stiffness: Column::EMPTY,
            damping: Column::EMPTY,
            groups: Groups::default(),
            losses: GroomLosses::default(),
        }
    }

    pub fn is_empty(&self) -> bool {
        self.groom.is_empty()
    }

    /// How many nodes or strands there would be with these, whichever is more, if that is beyond the limit.
    pub fn beyond(&self, points: usize, curves: usize) -> Option<usize> {
        let most = (self.groom.points.len() + points).max(self.groom.len() + curves);
        (most > self.limit).then_some(most)
    }

    /// Adds a set. A broken optional array is counted, and left out when all are there.
    ///
    /// # Errors
    /// When there are too many nodes for a groom.
    pub fn add<V: Numbers>(
        &mut self,
        set: &CurveSet<'_, V>,
        attributes: &Attributes<'_, V>,
    ) -> Result<(), GroomError> {
        self.add_nodes(set)?;
        self.add_attributes(set, attributes);
        Ok(())
    }

    fn add_nodes<V: Numbers>(&mut self, set: &CurveSet<'_, V>) -> Result<(), GroomError> {
        let CurveSet { curves, points, space, path, .. } = set;
        let weights = set.weights.filter(|weights| weights.len() == points.len() / 3);
        let orders = set.orders.filter(|orders| orders.len() == curves.len());
        let wanted = |curve: Curve| orders.map_or(CUBIC, |o| o.get(curve.index) as usize);
        let point = |i: usize| {
            space.transform_point3(DVec3::from_array([0, 1, 2].map(|k| points.get(3 * i + k))))
        };
        let (mut controls, mut weighted, mut knots) = (Vec::new(), Vec::new(), Vec::new());
        let (mut next_knot, mut bad_knots) = (0_usize, 0);
        for curve in curves.iter() {
            let nodes = 0..curve.nodes;
            let (wanted, first_knot) = (wanted(curve), next_knot);
            next_knot = first_knot.saturating_add(curve.count).saturating_add(wanted);
            let made = &mut self.groom.points;
            match curves.kind {
                Kind::Joined => made.extend(curve.points().map(|i| point(i).as_vec3())),
                Kind::Bezier => {
                    controls.clear();
                    controls.extend(curve.points().map(point));
                    made.extend(nodes.map(|node| curves::bezier(&controls, node).as_vec3()));
                }
                Kind::Spline if curve.nodes > 1 => {
                    let weight = |i| weights.map_or(1.0, |weights| weights.get(i));
                    let control = |i| DVec4::from((point(i) * weight(i), weight(i)));
                    weighted.clear();
                    weighted.extend(curve.points().map(control));
                    let count = weighted.len();
                    let order = curves::order_of(wanted, count);
                    knots.clear();
                    match set.knots {
                        Knots::Given(all) => {
                            let last_knot = first_knot.saturating_add(count + order);
                            knots.extend((first_knot..last_knot).map(|i| all.get(i)));
                            bad_knots += usize::from(!curves::are_knots(&knots, count, order));
                        }
                        Knots::Clamped => {}
                        Knots::Even => curves::even_knots(count, order, &mut knots),
                    }
                    if !curves::are_knots(&knots, count, order) {
                        curves::clamped_knots(count, order, &mut knots);
                    }
                    let node = |node| curves::spline(&weighted, order, &knots, node).as_vec3();
                    made.extend(nodes.map(node));
                }
                Kind::Spline => made.extend(curve.points().map(|i| point(i).as_vec3())),
            }
            let found = made.len();
            let end = u32::try_from(found).map_err(|_| GroomError::TooMany { found })?;
            self.groom.ends.push(end);
        }
        if bad_knots > 0 {
            let part = format!("{path}.knots: of {bad_knots} curves, which have even ones instead");
            self.losses.broken_arrays.add(GroomPlace::Part(part));
        }
        Ok(())
    }

    fn add_attributes<V: Numbers>(
        &mut self,
        CurveSet { curves, space, path, .. }: &CurveSet<'_, V>,
        attributes: &Attributes<'_, V>,
    ) {
        let nodes = curves.iter().map(|curve| curve.nodes).sum();
        let each = || curves.iter().flat_map(|c| (0..c.nodes).map(move |node| (c, node)));
        let scale = space.matrix3.determinant().abs().cbrt() as f32;
        let widths = attributes.widths.as_ref().map(|width| {
            each().map(move |(curve, node)| width.at(curve, node).map(|width| width * scale))
        });
        self.widths.add(nodes, widths);
        let colors = attributes.colors.as_ref();
        self.colors.add(nodes, colors.map(|color| each().map(|(c, node)| color.at(c, node))));
        let uvs = attributes.uvs.as_ref();
        let uvs = uvs.map(|uv| curves.iter().map(|curve| from_the_top(uv.at(curve, 0))));
        self.uvs.add(curves.len(), uvs);
        let each_curve = |of: &Option<Param<V, 1>>, to: &mut Column<1>| {
            let numbers = of.as_ref().map(|of| curves.iter().map(|curve| of.at(curve, 0)));
            to.add(curves.len(), numbers);
        };
        each_curve(&attributes.guides, &mut self.guides);
        each_curve(&attributes.stiffness, &mut self.stiffness);
        each_curve(&attributes.damping, &mut self.damping);
        let ids = attributes.groups.as_ref();
        let id = |curve| ids.map(|id| id.at(curve, 0)[0] as i32);
        let ids = curves.iter().map(|curve| (id(curve), curve.index));
        self.groups.add(ids, &attributes.group_names, path);
    }

    /// The groom of all sets, of which nothing but nodes is known, and these may be any numbers.
    pub fn nodes(self) -> Groom {
        self.groom
    }

    /// The groom of all sets, without what is broken.
    ///
    /// # Errors
    /// When no strand is left.
    pub fn finish(self) -> Result<Intake, GroomError> {
        let Self {
            mut groom, widths, colors, uvs, guides, stiffness, damping, groups, losses, ..
        } = self;
        groom.widths = widths.filled(None).into_iter().map(|[width]| width).collect();
        groom.colors = colors.filled(None).into_iter().map(LinearRgba::from_f32_array).collect();
        groom.uvs = uvs.filled(Some([0.0; 2])).into_iter().map(Vec2::from_array).collect();
        let shares =
            |of: Column<1>| of.filled(Some([1.0])).into_iter().map(|[share]| share).collect();
        (groom.stiffness, groom.damping) = (shares(stiffness), shares(damping));
        if groups.is_known || groups.sets > 1 {
            (groom.groups, groom.all_groups) = (groups.of_strands.into(), groups.all.into());
        }
        groom.guides = guides.filled(Some([0.0])).into_iter().map(|[guide]| guide != 0.0).collect();
        Intake::cleaned(groom, losses)
    }
}
