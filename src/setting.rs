//! Settings: a default for all hair as a resource, an override as a component on a `Hair`.
//!
//! In Bevy 0.19 one type cannot be both, so [`HairDefault<T>`] carries the default of `T`.
//! Values set by editing a component are taken over at the next tick. A value outside its range is
//! reported once and used as the nearest valid one; the component keeps what the user wrote.

use crate::fault::{FaultKind, HairFault};
use bevy::{
    ecs::system::SystemParam,
    prelude::*,
    reflect::{GetTypeRegistration, Typed},
};

/// A value that a constructor or a setting refuses: which, what was found, what was expected and
/// how to mend it.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
#[error("{what} is {found}, expected {low} to {high}: {hint}")]
pub struct InvalidValue {
    /// The value's name and unit.
    pub what: &'static str,
    /// What was given.
    pub found: f32,
    /// The least that is valid.
    pub low: f32,
    /// The most that is valid.
    pub high: f32,
    /// How to mend it.
    pub hint: &'static str,
}

/// The valid range of one value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bound {
    what: &'static str,
    low: f32,
    high: f32,
    hint: &'static str,
}

/// What was mended while reading a setting.
#[derive(Debug, Default)]
pub struct Notes(core::cell::RefCell<Vec<InvalidValue>>);

impl Notes {
    /// The refused values, in the order met.
    pub fn into_inner(self) -> Vec<InvalidValue> {
        self.0.into_inner()
    }
}

impl Bound {
    pub(crate) const fn new(what: &'static str, low: f32, high: f32, hint: &'static str) -> Self {
        Self { what, low, high, hint }
    }

    /// For constructors: the value, or why not.
    pub(crate) fn check(&self, value: f32) -> Result<f32, InvalidValue> {
        if value >= self.low && value <= self.high {
            return Ok(value);
        }
        Err(InvalidValue {
            what: self.what,
            found: value,
            low: self.low,
            high: self.high,
            hint: self.hint,
        })
    }

    /// For edited components: the nearest valid value, `default` for what is not a number.
    pub(crate) fn mend(&self, value: f32, default: f32, notes: &Notes) -> f32 {
        self.check(value).unwrap_or_else(|wrong| {
            notes.0.borrow_mut().push(wrong);
            if value.is_nan() { default } else { value.clamp(self.low, self.high) }
        })
    }
}

/// A group of settings that a [`Hair`](crate::Hair) may override.
pub trait HairSetting:
    Component + Clone + Default + Typed + FromReflect + GetTypeRegistration
{
    /// These settings with every value in its valid range; what had to change goes into `notes`.
    fn mended(&self, notes: &Notes) -> Self;
}

/// What holds for every hair that carries no `T` of its own.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// # let mut app = App::new();
/// app.insert_resource(HairDefault(AirDrag { rate: 3.0, ..default() }));
/// ```
#[derive(Resource, Reflect, Clone, Debug, Default, Deref, DerefMut)]
#[reflect(Resource, Default)]
pub struct HairDefault<T: HairSetting>(pub T);

/// Reads the settings `T` that hold for a hair, always valid.
#[derive(SystemParam)]
pub struct Settings<'w, 's, T: HairSetting> {
    default: Res<'w, HairDefault<T>>,
    overrides: Query<'w, 's, &'static T>,
}

impl<T: HairSetting> Settings<'_, '_, T> {
    /// The settings of `hair`.
    pub fn of(&self, hair: Entity) -> T {
        self.overrides.get(hair).unwrap_or(&self.default.0).mended(&Notes::default())
    }
}

/// Reports what was wrong with an entity's values.
pub(crate) fn tell(entity: Option<Entity>, notes: Notes, faults: &mut MessageWriter<HairFault>) {
    for wrong in notes.into_inner() {
        let mut fault = HairFault::from(wrong);
        fault.entity = entity;
        faults.write(fault);
    }
}

impl From<InvalidValue> for HairFault {
    fn from(value: InvalidValue) -> Self {
        Self::caused(FaultKind::Setting, value, "the nearest valid value is used")
    }
}

/// Reports invalid values in components.
pub(crate) fn report_changed<T: HairSetting>(
    changed: Query<(Entity, &T), Changed<T>>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, setting) in &changed {
        let notes = Notes::default();
        setting.mended(&notes);
        tell(Some(entity), notes, &mut faults);
    }
}

/// Reports invalid values in the default.
fn report_default<T: HairSetting>(
    default: Res<HairDefault<T>>,
    mut faults: MessageWriter<HairFault>,
) {
    let notes = Notes::default();
    default.0.mended(&notes);
    tell(None, notes, &mut faults);
}

/// Registers one setting: its default, its type, and the report of invalid values.
pub(crate) fn plugin<T: HairSetting>(app: &mut App) {
    app.init_resource::<HairDefault<T>>()
        .register_type::<T>()
        .register_type::<HairDefault<T>>()
        .add_systems(
            PreUpdate,
            (report_default::<T>.run_if(resource_changed::<HairDefault<T>>), report_changed::<T>),
        );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mending_takes_the_nearest_valid_value_and_says_so() {
        let bound = Bound::new("x", 0.0, 1.0, "h");
        let notes = Notes::default();
        assert_eq!(bound.mend(0.5, 0.1, &notes), 0.5);
        assert_eq!(bound.mend(2.0, 0.1, &notes), 1.0);
        assert_eq!(bound.mend(f32::NEG_INFINITY, 0.1, &notes), 0.0);
        assert_eq!(bound.mend(f32::NAN, 0.1, &notes), 0.1);
        assert_eq!(notes.into_inner().len(), 3);
        let text = bound.check(2.0).unwrap_err().to_string();
        assert_eq!(text, "x is 2, expected 0 to 1: h");
    }
}
