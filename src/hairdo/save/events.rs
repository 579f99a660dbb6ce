//! Hairdos for systems: requests and answers by events.

use super::{Hairdo, HairdoError, apply::report};
#[cfg(feature = "gpu")]
use crate::hair::strand::{AskForStrands, StrandsArrived, is_on_gpu};
use bevy::prelude::*;

/// Requests the hairdo of a [`Hair`](crate::Hair). Answered by [`HairdoCaptured`] on the
/// same entity, or by [`HairdoRejected`].
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// #[derive(Resource)]
/// struct Photo(Vec<u8>);
///
/// fn at_the_hairdresser(hair: Single<Entity, With<Hair>>, mut commands: Commands) {
///     commands.entity(*hair).observe(|taken: On<HairdoCaptured>, mut commands: Commands| {
///         commands.insert_resource(Photo(taken.hairdo.to_bytes()));
///     });
///     commands.trigger(CaptureHairdo { entity: *hair });
/// }
///
/// fn the_same_please(hair: Single<Entity, With<Hair>>, photo: Res<Photo>, mut commands: Commands) -> Result {
///     let hairdo = Hairdo::from_bytes(&photo.0)?;
///     commands.trigger(ApplyHairdo { entity: *hair, hairdo });
///     Ok(())
/// }
/// ```
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct CaptureHairdo {
    /// The hair.
    pub entity: Entity,
}

/// The answer to [`CaptureHairdo`].
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairdoCaptured {
    /// The hair.
    pub entity: Entity,
    /// Its hairdo at the moment of the request; of hair on the GPU a few frames later.
    pub hairdo: Hairdo,
}

/// Requests that a hairdo is put on a [`Hair`](crate::Hair), strand by strand where it has as many
/// strands and nodes ([`Hairdo::apply`]), else resampled ([`Hairdo::apply_resampled`]). Answered by
/// [`HairdoApplied`] on the same entity, or by [`HairdoRejected`].
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct ApplyHairdo {
    /// The hair.
    pub entity: Entity,
    /// The hairdo to put on.
    pub hairdo: Hairdo,
}

/// Triggered on a [`Hair`](crate::Hair) that wears the hairdo of a [`ApplyHairdo`].
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairdoApplied {
    /// The hair.
    pub entity: Entity,
}

/// Triggered on the entity of a [`CaptureHairdo`] or [`ApplyHairdo`] that failed; also reported as a
/// [`HairFault`](crate::HairFault). The hair is not changed.
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairdoRejected {
    /// What was named.
    pub entity: Entity,
    /// Why.
    pub error: HairdoError,
}

pub(super) fn take(request: On<CaptureHairdo>, mut commands: Commands) {
    let hair = request.entity;
    commands.queue(move |world: &mut World| {
        #[cfg(feature = "gpu")]
        if is_on_gpu(world, hair) {
            world.entity_mut(hair).insert(Awaited);
            world.trigger(AskForStrands { entity: hair });
            return;
        }
        answer(world, hair);
    });
}

fn answer(world: &mut World, hair: Entity) {
    match Hairdo::of_strands(world, hair) {
        Ok(hairdo) => world.trigger(HairdoCaptured { entity: hair, hairdo }),
        Err(error) => refuse(world, hair, error),
    }
}

/// Marks hair on the GPU whose hairdo is asked for.
#[cfg(feature = "gpu")]
#[derive(Component)]
pub(super) struct Awaited;

#[cfg(feature = "gpu")]
pub(super) fn answer_arrived(
    arrived: On<StrandsArrived>,
    awaited: Query<(), With<Awaited>>,
    mut commands: Commands,
) {
    let hair = arrived.entity;
    if awaited.contains(hair) {
        commands.entity(hair).remove::<Awaited>();
        commands.queue(move |world: &mut World| answer(world, hair));
    }
}

pub(super) fn apply(request: On<ApplyHairdo>, mut commands: Commands) {
    let ApplyHairdo { entity: hair, hairdo } = request.event().clone();
    commands.queue(move |world: &mut World| match hairdo.apply_fitting(world, hair) {
        Ok(()) => world.trigger(HairdoApplied { entity: hair }),
        Err(error) => refuse(world, hair, error),
    });
}

fn refuse(world: &mut World, hair: Entity, error: HairdoError) {
    report(world, hair, error.clone());
    world.trigger(HairdoRejected { entity: hair, error });
}
