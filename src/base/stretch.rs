//! Non-uniform scale: what a transform's axes have beside the mean scale of its pose.

use super::{
    fault::{FaultKind, HairChecks, HairFault},
    schedule::{HairSystems, HairTick, first_substep},
    setting::Ranged,
};
use bevy::{prelude::*, utils::prelude::ShortName};
use core::marker::PhantomData;

/// Scales along the axes count as equal if they differ by less than this share, and axes as
/// perpendicular if their cosine is less.
const ALIKE: f32 = 1e-3;

/// A component that fills space around its entity.
pub(crate) trait Stretched: Component + Clone + Ranged {
    /// The factors along its axes that it can have in place of these.
    fn suitable(&self, factors: Vec3) -> Vec3;

    /// It, larger by these factors along its axes.
    fn stretched(self, factors: Vec3) -> Self;
}

/// How much larger than the mean scale of its pose an entity's transform is along its axes, for its
/// component `T`. Found once a tick.
#[derive(Component)]
pub(crate) struct Stretch<T> {
    factors: Vec3,
    /// What is to be reported, and whether anything has been.
    refused: Option<Refused>,
    is_reported: bool,
    of: PhantomData<fn() -> T>,
}

/// A scale that a component cannot have, and that which it has instead.
struct Refused {
    wanted: Vec3,
    used: Vec3,
    is_sheared: bool,
}

impl<T> Default for Stretch<T> {
    fn default() -> Self {
        Self { factors: Vec3::ONE, refused: None, is_reported: false, of: PhantomData }
    }
}

impl<T: Stretched> Stretch<T> {
    /// The component with valid values, as it acts where its pose has the mean scale.
    pub(crate) fn of(&self, component: &T) -> T {
        let valid = component.clamped();
        if self.factors == Vec3::ONE { valid } else { valid.stretched(self.factors) }
    }
}

/// `component` with valid values, as it acts at a transform.
#[cfg(feature = "debug")]
pub(crate) fn acting<T: Stretched>(component: &T, at: &GlobalTransform) -> T {
    let valid = component.clamped();
    match Axes::of(at) {
        Some(axes) => Stretch { factors: valid.suitable(axes.factors), ..default() }.of(&valid),
        None => valid,
    }
}

/// Finds the stretch of all `T`, and reports those that cannot be as drawn.
pub(crate) fn plugin<T: Stretched>(app: &mut App) {
    app.add_systems(HairChecks, report_stretches::<T>).add_systems(
        HairTick,
        find_stretches::<T>.in_set(HairSystems::Poses).run_if(first_substep),
    );
}

fn are_alike(scale: Vec3) -> bool {
    let scale = scale.abs();
    scale.max_element() - scale.min_element() <= ALIKE * scale.max_element()
}

/// The axes of a transform that does not scale evenly.
struct Axes {
    mean: f32,
    /// Over the mean.
    factors: Vec3,
    is_sheared: bool,
}

impl Axes {
    fn of(transform: &GlobalTransform) -> Option<Self> {
        let m = Mat3::from(transform.affine().matrix3);
        let lengths = Vec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length());
        let mean = lengths.element_product().cbrt();
        // Others have no pose.
        if !(mean.is_finite() && mean > 1e-9) {
            return None;
        }
        let [x, y, z] = [m.x_axis / lengths.x, m.y_axis / lengths.y, m.z_axis / lengths.z];
        let cosines = Vec3::new(x.dot(y), y.dot(z), z.dot(x)).abs();
        let is_sheared = cosines.max_element() > ALIKE;
        (is_sheared || !are_alike(lengths)).then(|| Self {
            mean,
            factors: lengths / mean,
            is_sheared,
        })
    }
}

fn find_stretches<T: Stretched>(
    transforms: TransformHelper,
    chain: Query<(&Transform, Option<&ChildOf>)>,
    mut all: Query<(Entity, &T, &Transform, Option<&ChildOf>, &mut Stretch<T>)>,
) {
    // Most have even scales all the way up, and stand beside others with the same parent.
    let mut last: Option<(Entity, bool)> = None;
    let mut is_even_above = |parent: Option<&ChildOf>| {
        let Some(parent) = parent.map(ChildOf::parent) else { return true };
        if let Some((known, is_even)) = last
            && known == parent
        {
            return is_even;
        }
        let (mut at, mut is_even) = (Some(parent), true);
        while let Some((transform, above)) = at.and_then(|at| chain.get(at).ok()) {
            is_even &= are_alike(transform.scale);
            at = above.map(ChildOf::parent).filter(|_| is_even);
        }
        last = Some((parent, is_even));
        is_even
    };
    for (entity, component, transform, parent, mut stretch) in &mut all {
        let axes = if are_alike(transform.scale) && is_even_above(parent) {
            None
        } else {
            transforms.compute_global_transform(entity).ok().and_then(|at| Axes::of(&at))
        };
        let stretch = stretch.bypass_change_detection();
        let Some(Axes { mean, factors, is_sheared }) = axes else {
            stretch.factors = Vec3::ONE;
            continue;
        };
        let used = component.clamped().suitable(factors);
        stretch.factors = used;
        let is_drawn = !is_sheared && (used / factors - 1.0).abs().max_element() <= ALIKE;
        if !is_drawn && !stretch.is_reported {
            stretch.refused =
                Some(Refused { wanted: factors * mean, used: used * mean, is_sheared });
        }
    }
}

fn report_stretches<T: Stretched>(
    mut all: Query<(Entity, &mut Stretch<T>)>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, mut stretch) in &mut all {
        let stretch = stretch.bypass_change_detection();
        let Some(Refused { wanted, used, is_sheared }) = stretch.refused.take() else { continue };
        stretch.is_reported = true;
        let (by, what) = (ShortName::of::<T>(), if is_sheared { " and shears it" } else { "" });
        let [wanted, used] =
            [wanted, used].map(|Vec3 { x, y, z }| format!("{x:.3}, {y:.3}, {z:.3}"));
        let message = format!(
            "the transform of a `{by}` scales it by {wanted}{what}, which it cannot follow: it acts as if \
             scaled by {used}"
        );
        faults.write(HairFault::new(FaultKind::Transform, message).of(entity));
    }
}
