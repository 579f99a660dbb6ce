//! Values that users set: settings of hair, tools, rules of the world.
//!
//! Each is stated once, with its unit, default, range and a hint; docs, `Default`, constructors' checks
//! and the [`ValueRange`] constants are generated from that. A value outside its range is an error in a
//! constructor. In an edited component or resource it is reported once and the nearest valid value is
//! used, the default for NaN; the component keeps what the user wrote.
//!
//! Settings have a default for all hair as a resource and an override as a component on a `Hair`. In
//! Bevy 0.19 one type cannot be both, so [`HairDefault<T>`] carries the default of `T`.

use crate::base::fault::{FaultKind, HairChecks, HairFault};
use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    reflect::{GetTypeRegistration, Typed},
};
use core::ops::RangeInclusive;

/// A value that a constructor or a setting refuses: which, what was found, what was expected and
/// how to fix it.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
#[error("{what} is {found}, expected {low} to {high}: {hint}")]
pub struct InvalidValue {
    /// The value's name and unit.
    pub what: &'static str,
    /// The value found.
    pub found: f32,
    /// The smallest valid value.
    pub low: f32,
    /// The largest valid value.
    pub high: f32,
    /// How to fix it.
    pub hint: &'static str,
}

impl From<InvalidValue> for HairFault {
    fn from(value: InvalidValue) -> Self {
        Self::caused(FaultKind::Setting, value, "the nearest valid value is used")
    }
}

/// The range of one value: what is valid, what works well, and how to fix a value outside.
///
/// Settings and tools have one as a constant for each value, for sliders and the like:
///
/// ```
/// # use bevy_keratin::prelude::*;
/// assert_eq!(AirDrag::RATE.safe, 0.0..=50.0);
/// assert_eq!(AirDrag::RATE.what, "AirDrag::rate (1/s)");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ValueRange {
    /// The value's name and unit.
    pub what: &'static str,
    /// Values outside are reported, and the nearest value inside is used.
    pub valid: RangeInclusive<f32>,
    /// What works well; equal to `valid` where nothing narrower is known.
    pub safe: RangeInclusive<f32>,
    /// How to fix a value outside.
    pub hint: &'static str,
}

/// Values found outside their range, in the order found.
pub type Violations = Vec<InvalidValue>;

impl ValueRange {
    pub(crate) const fn new(
        what: &'static str,
        valid: RangeInclusive<f32>,
        hint: &'static str,
    ) -> Self {
        let safe = RangeInclusive::new(*valid.start(), *valid.end());
        Self { what, valid, safe, hint }
    }

    pub(crate) const fn with_safe(self, safe: RangeInclusive<f32>) -> Self {
        Self { what: self.what, valid: self.valid, safe, hint: self.hint }
    }

    /// For constructors: the value, or the error.
    pub(crate) fn check<T: Value>(&self, value: T) -> Result<T, InvalidValue> {
        let Some(found) = value.outside(&self.valid) else { return Ok(value) };
        let (low, high) = (*self.valid.start(), *self.valid.end());
        Err(InvalidValue { what: self.what, found, low, high, hint: self.hint })
    }

    /// The same range under another name, for a value that is not a field.
    pub(crate) const fn named(self, what: &'static str) -> Self {
        Self { what, valid: self.valid, safe: self.safe, hint: self.hint }
    }

    /// For edited values: clamps to the nearest valid value, NaN to `default`.
    pub(crate) fn clamp<T: Value>(
        &self,
        value: &mut T,
        default: impl FnOnce() -> T,
        violations: &mut Violations,
    ) {
        if let Err(wrong) = self.check(*value) {
            violations.push(wrong);
            *value = value.nearest(&self.valid).unwrap_or_else(default);
        }
    }
}

/// Types that can have a [`ValueRange`].
pub(crate) trait Value: Copy {
    /// The first of its numbers that is outside.
    fn outside(self, range: &RangeInclusive<f32>) -> Option<f32>;
    /// The nearest value inside; `None` for NaN.
    fn nearest(self, range: &RangeInclusive<f32>) -> Option<Self>;
}

impl Value for f32 {
    fn outside(self, range: &RangeInclusive<f32>) -> Option<f32> {
        (!range.contains(&self)).then_some(self)
    }

    fn nearest(self, range: &RangeInclusive<f32>) -> Option<Self> {
        (!self.is_nan()).then(|| self.clamp(*range.start(), *range.end()))
    }
}

macro_rules! value_as_f32 {
    ($($number:ty)*) => {$(
        impl Value for $number {
            fn outside(self, range: &RangeInclusive<f32>) -> Option<f32> {
                (self as f32).outside(range)
            }

            fn nearest(self, range: &RangeInclusive<f32>) -> Option<Self> {
                (self as f32).nearest(range).map(|nearest| nearest as $number)
            }
        }
    )*};
}

value_as_f32!(u32 usize f64);

impl<T: Value> Value for Option<T> {
    fn outside(self, range: &RangeInclusive<f32>) -> Option<f32> {
        self.and_then(|value| value.outside(range))
    }

    fn nearest(self, range: &RangeInclusive<f32>) -> Option<Self> {
        self?.nearest(range).map(Some)
    }
}

impl Value for Vec3 {
    fn outside(self, range: &RangeInclusive<f32>) -> Option<f32> {
        self.to_array().into_iter().find_map(|x| x.outside(range))
    }

    fn nearest(self, range: &RangeInclusive<f32>) -> Option<Self> {
        (!self.is_nan()).then(|| self.clamp(Vec3::splat(*range.start()), Vec3::splat(*range.end())))
    }
}

/// Settings or a tool of which every value has its range, checked by the same rule in constructors and
/// after editing.
pub trait Ranged: Clone {
    /// Clamps every value to its range, NaN to the default. Adds what was outside to `violations`.
    fn clamp_values(&mut self, violations: &mut Violations) {
        let _ = violations;
    }

    /// A copy with every value clamped.
    fn clamped(&self) -> Self {
        let mut clamped = self.clone();
        clamped.clamp_values(&mut Violations::new());
        clamped
    }

    /// The values outside their range.
    fn violations(&self) -> Violations {
        let mut violations = Violations::new();
        self.clone().clamp_values(&mut violations);
        violations
    }

    /// For constructors: `self`, if every value is in its range.
    ///
    /// # Errors
    /// The first value outside its range.
    fn checked(self) -> Result<Self, InvalidValue> {
        self.violations().into_iter().next().map_or(Ok(self), Err)
    }
}

impl<T: Ranged> Ranged for Vec<T> {
    fn clamp_values(&mut self, violations: &mut Violations) {
        self.iter_mut().for_each(|one| one.clamp_values(violations));
    }
}

impl<T: Ranged> Ranged for Option<T> {
    fn clamp_values(&mut self, violations: &mut Violations) {
        self.iter_mut().for_each(|one| one.clamp_values(violations));
    }
}

/// States the values of a setting or tool once: field, default, unit, range and hint. Generates the
/// struct with these in its docs, `Default`, the [`ValueRange`] constants, and [`Ranged`].
///
/// ```ignore
/// setting! {
///     /// Drag of still air.
///     #[derive(Component, Reflect, Clone, Debug)]
///     pub struct AirDrag {
///         /// Rate at which velocities die away.
///         pub rate: f32 = 2.0, "1/s" in RATE: 0.0..=1e4, safe 0.0..=50.0, "2 is air, 20 is water";
///     }
/// }
/// ```
///
/// A field without `in` is not checked; with `=> function` it is checked by that function. After the
/// struct, `then function` checks conditions between several values.
macro_rules! setting {
    (
        $(#[$attribute:meta])*
        $vis:vis struct $Type:ident {
            $(
                $(#[$field_attribute:meta])*
                $field_vis:vis $field:ident: $type:ty = $default:expr
                $(, $($unit:literal)? in $RANGE:ident: $valid:expr,
                    $(safe $safe:expr,)? $hint:literal)?
                $(=> $clamp:expr)?;
            )*
        }
        $(then $whole:expr)?
    ) => {
        $(#[$attribute])*
        $vis struct $Type {
            $(
                $(#[$field_attribute])*
                #[doc = concat!(
                    "Default `", stringify!($default), "`"
                    $($(, ", safe `", stringify!($safe), "`")?, ", valid `", stringify!($valid), "`"
                        $(, " (", $unit, ")")?)?, "."
                )]
                $field_vis $field: $type,
            )*
        }

        impl Default for $Type {
            fn default() -> Self {
                Self { $($field: $default),* }
            }
        }

        impl $Type {$($(
            #[doc = concat!("Range of [`", stringify!($field), "`](Self::", stringify!($field), ").")]
            $field_vis const $RANGE: $crate::base::setting::ValueRange = $crate::base::setting::ValueRange::new(
                concat!(stringify!($Type), "::", stringify!($field) $(, " (", $unit, ")")?),
                $valid,
                $hint,
            )$(.with_safe($safe))?;
        )?)*}

        impl $crate::base::setting::Ranged for $Type {
            fn clamp_values(&mut self, violations: &mut $crate::base::setting::Violations) {
                $(
                    $(Self::$RANGE.clamp(&mut self.$field, || $default, violations);)?
                    $($clamp(&mut self.$field, violations);)?
                )*
                $($whole(self, violations);)?
                let _ = violations;
            }
        }
    };
}

pub(crate) use setting;

/// Settings of one kind, which a [`Hair`](crate::Hair) may override.
pub trait HairSetting:
    Component + Ranged + Default + Typed + FromReflect + GetTypeRegistration
{
}

impl<T: Component + Ranged + Default + Typed + FromReflect + GetTypeRegistration> HairSetting
    for T
{
}

/// The default of a setting: used for every hair without a `T` component of its own.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// # let mut app = App::new();
/// app.insert_resource(HairDefault(AirDrag { rate: 3.0, ..default() }));
/// ```
#[derive(Resource, Reflect, Clone, Debug, Default, Deref, DerefMut)]
#[reflect(Resource, Default)]
pub struct HairDefault<T: HairSetting>(pub T);

impl<T: HairSetting> Ranged for HairDefault<T> {
    fn clamp_values(&mut self, violations: &mut Violations) {
        self.0.clamp_values(violations);
    }
}

/// Reads the settings `T` of a hair, clamped to their ranges.
#[derive(SystemParam)]
pub struct Settings<'w, 's, T: HairSetting> {
    /// `None` while the plugin of these settings is disabled.
    default: Option<Res<'w, HairDefault<T>>>,
    overrides: Query<'w, 's, &'static T>,
}

impl<T: HairSetting> Settings<'_, '_, T> {
    /// The settings of `hair`.
    pub fn of(&self, hair: Entity) -> T {
        let default = || self.default.as_ref().map(|default| &default.0);
        let set = self.overrides.get(hair).ok().or_else(default);
        set.map_or_else(T::default, Ranged::clamped)
    }
}

/// Reports values outside their range.
pub(crate) fn report(
    entity: Option<Entity>,
    violations: Violations,
    faults: &mut MessageWriter<HairFault>,
) {
    for wrong in violations {
        let mut fault = HairFault::from(wrong);
        fault.entity = entity;
        faults.write(fault);
    }
}

fn report_changed<T: Component + Ranged>(
    changed: Query<(Entity, &T), Changed<T>>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, values) in &changed {
        report(Some(entity), values.violations(), &mut faults);
    }
}

fn report_resource<T: Resource + Ranged>(values: Res<T>, mut faults: MessageWriter<HairFault>) {
    report(None, values.violations(), &mut faults);
}

/// Registers settings: their default, and what [`component`] does.
pub(crate) fn plugin<T: HairSetting>(app: &mut App) {
    resource::<HairDefault<T>>(app);
    component::<T>(app);
}

/// Registers a tool: its type, and the report of invalid values.
pub(crate) fn component<T: Component + Ranged + GetTypeRegistration>(app: &mut App) {
    app.register_type::<T>().add_systems(HairChecks, report_changed::<T>);
}

/// Registers a resource of global values: the resource, its type, and the report of invalid values.
pub(crate) fn resource<T: Resource + Ranged + Default + GetTypeRegistration>(app: &mut App) {
    app.init_resource::<T>()
        .register_type::<T>()
        .add_systems(HairChecks, report_resource::<T>.run_if(resource_changed::<T>));
}

#[cfg(test)]
mod tests {
    use super::*;

    setting! {
        /// A tool with a value of each kind.
        #[derive(Component, Reflect, Clone, Debug, PartialEq)]
        #[reflect(Component, Default, Clone, PartialEq)]
        pub struct Tool {
            /// With a unit and a narrower safe range.
            pub rate: f32 = 2.0, "1/s" in RATE: 0.0..=1e4, safe 0.0..=50.0, "2 is air";
            /// Without.
            pub seconds: f32 = 0.5, in SECONDS: 0.0..=f32::INFINITY, "0.5 lasts";
            /// A count.
            pub count: u32 = 5, in COUNT: 1.0..=1000.0, "5 are usual";
            /// What need not be there.
            pub weight: Option<f32> = None, in WEIGHT: 1e-9..=1e3, "0.03 is light";
            /// A place.
            pub corner: Vec3 = Vec3::NEG_ONE, "m" in CORNER: -100.0..=100.0, "a place nearby";
            /// What may be anything.
            pub is_on: bool = true;
            /// Values of their own.
            pub parts: Vec<Part> = vec![Part { share: 0.5 }] => Ranged::clamp_values;
        }
        then Self::rest_a_second
    }

    impl Tool {
        fn rest_a_second(&mut self, violations: &mut Violations) {
            let least = ValueRange::new("Tool::seconds at rate 0 (s)", 1.0..=1e3, "give it time");
            if self.rate == 0.0 {
                least.clamp(&mut self.seconds, || 1.0, violations);
            }
        }
    }

    setting! {
        /// A part of it.
        #[derive(Reflect, Clone, Debug, PartialEq)]
        pub struct Part {
            /// A share.
            pub share: f32 = 1.0, in SHARE: 0.0..=1.0, "shares go from 0 to 1";
        }
    }

    #[test]
    fn defaults_are_valid_and_stay() {
        let tool = Tool::default();
        assert_eq!(tool.clone().checked().unwrap(), tool);
        assert_eq!((tool.rate, tool.count, tool.weight, tool.is_on), (2.0, 5, None, true));
        assert_eq!((Tool::RATE.safe, Tool::RATE.valid), (0.0..=50.0, 0.0..=1e4));
        assert_eq!(Tool::COUNT.safe, 1.0..=1000.0);
    }

    #[test]
    fn constructors_and_edited_values_follow_the_same_rule() {
        let edited = Tool {
            rate: f32::NAN,
            seconds: f32::NEG_INFINITY,
            count: 0,
            weight: Some(f32::NAN),
            corner: Vec3::new(1.0, f32::INFINITY, -200.0),
            is_on: false,
            parts: vec![Part { share: 0.25 }, Part { share: 2.0 }],
        };
        let clamped = edited.clamped();
        let expected = Tool {
            rate: 2.0,
            seconds: 0.0,
            count: 1,
            weight: None,
            corner: Vec3::new(1.0, 100.0, -100.0),
            is_on: false,
            parts: vec![Part { share: 0.25 }, Part { share: 1.0 }],
        };
        assert_eq!(clamped, expected);
        assert!(clamped.violations().is_empty());
        let violations = edited.violations();
        let names: Vec<_> = violations.iter().map(|v| v.what).collect();
        assert_eq!(
            names,
            [
                "Tool::rate (1/s)",
                "Tool::seconds",
                "Tool::count",
                "Tool::weight",
                "Tool::corner (m)",
                "Part::share"
            ]
        );
        assert_eq!(
            violations[5].to_string(),
            "Part::share is 2, expected 0 to 1: shares go from 0 to 1"
        );
        assert_eq!(edited.checked().unwrap_err().what, "Tool::rate (1/s)");
    }

    #[test]
    fn a_rule_on_the_whole_is_asked_last() {
        let tool = Tool { rate: -1.0, ..default() };
        assert_eq!((tool.clamped().rate, tool.clamped().seconds), (0.0, 1.0));
        assert_eq!(tool.violations().len(), 2);
    }
}
