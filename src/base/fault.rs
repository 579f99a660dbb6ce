//! Faults: errors that were contained, reported once, as messages and in the log.

use bevy::{
    ecs::schedule::{ScheduleLabel, SingleThreadedExecutor},
    prelude::*,
};
use core::{error::Error, fmt};
use std::sync::Arc;

/// An error that was contained. Written once per occurrence, so that game code can react; also logged
/// as a warning.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn react(mut faults: MessageReader<HairFault>) {
///     for fault in faults.read().filter(|fault| fault.kind == FaultKind::Setting) {
///         let value = fault.cause::<InvalidValue>().map(|value| value.what);
///         println!("{fault}: {value:?}");
///     }
/// }
/// ```
#[derive(Message, Reflect, Clone, Debug)]
#[reflect(Clone)]
pub struct HairFault {
    /// The hair, strand, collider, blower or rod concerned; `None` for resources.
    pub entity: Option<Entity>,
    /// What kind of fault it is, for code to match on.
    pub kind: FaultKind,
    /// What was wrong, what was expected, how to fix it and what happens meanwhile.
    pub message: String,
    #[reflect(ignore)]
    source: Source,
}

/// The error behind a fault.
#[derive(Clone, Debug, Default)]
struct Source(Option<Arc<dyn Error + Send + Sync>>);

/// The kinds of [`HairFault`].
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[reflect(Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum FaultKind {
    /// A setting or a tool's value outside its range: the nearest valid value is used.
    Setting,
    /// A strand became non-finite, on the CPU in a softer second attempt as well, and was put back to the state of
    /// the previous substep. What moves it is out
    /// of proportion: look for forces and settings outside their safe range, and for roots or colliders that
    /// jump without [`Hair::teleport`](crate::Hair::teleport).
    PutBack,
    /// A strand's stored state was not finite, had torn, or no step from it succeeded: its pose was
    /// rebuilt from root, lengths and bonds. Causes are those of [`PutBack`](Self::PutBack).
    Rebuilt,
    /// A strand points to a hair that does not exist or carries no `Hair`: it is left out.
    NoHair,
    /// A strand that cannot be simulated at all, or not as it is.
    Strand,
    /// A transform that cannot be inverted, or is not finite: the last valid one is used.
    Transform,
    /// A physics collider of a shape that is not supported: hair passes through it.
    Collider,
    /// Roots that cannot be tied to their mesh: the strands stay as they are. Roots of drawn strands that are far
    /// from the guides that they follow.
    Roots,
    /// A groom that could not be loaded, or that no strands can be grown from.
    Groom,
    /// A hairdo that the hair cannot wear: it keeps the one that it has.
    Hairdo,
    /// Hair that cannot be worn: the wearer stays as it is.
    Wear,
    /// A component that another needs was removed: its default is put back.
    Component,
    /// A request that names something that is not there.
    NoTarget,
}

impl HairFault {
    /// A fault that concerns no entity.
    pub fn new(kind: FaultKind, message: impl Into<String>) -> Self {
        Self { entity: None, kind, message: message.into(), source: Source(None) }
    }

    /// A fault with the error behind it and what is done about it, in a few words.
    pub fn caused(
        kind: FaultKind,
        source: impl Error + Send + Sync + 'static,
        outcome: &str,
    ) -> Self {
        let message = format!("{source}; {outcome}");
        Self { source: Source(Some(Arc::new(source))), ..Self::new(kind, message) }
    }

    /// The same fault with this entity.
    pub fn of(mut self, entity: Entity) -> Self {
        self.entity = Some(entity);
        self
    }

    /// The source error, if there is one and it is an `E`.
    pub fn cause<E: Error + 'static>(&self) -> Option<&E> {
        self.source.0.as_deref()?.downcast_ref()
    }
}

impl PartialEq for HairFault {
    fn eq(&self, other: &Self) -> bool {
        (self.entity, self.kind, &self.message) == (other.entity, other.kind, &other.message)
    }
}

impl fmt::Display for HairFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.entity {
            Some(entity) => write!(f, "hair, entity {entity}: {}", self.message),
            None => write!(f, "hair: {}", self.message),
        }
    }
}

impl Error for HairFault {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.source.0.as_deref().map(|source| source as _)
    }
}

/// Checks of what user code has written, once a frame in [`PreUpdate`]. On one thread: each of
/// these dozens of checks takes less time than waking another thread.
#[derive(ScheduleLabel, Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct HairChecks;

pub(crate) fn plugin(app: &mut App) {
    app.add_message::<HairFault>()
        .register_type::<HairFault>()
        .register_type::<FaultKind>()
        .edit_schedule(HairChecks, |schedule| {
            schedule.set_executor(SingleThreadedExecutor::new());
        })
        .add_systems(PreUpdate, |world: &mut World| world.run_schedule(HairChecks))
        .add_systems(Last, log_faults.run_if(on_message::<HairFault>));
}

fn log_faults(mut faults: MessageReader<HairFault>) {
    for fault in faults.read() {
        tracing::warn!("{fault}");
    }
}
