//! Hairdos for systems: requests and answers by events.

use super::{Hairdo, HairdoError, apply::report};
#[cfg(feature = "gpu")]
use crate::hair::strand::{AskForStrands, StrandsArrived, is_on_gpu};
use crate::hair::worn::hairs_of;
use bevy::prelude::*;

/// Requests the hairdo of a [`Hair`](crate::Hair), or those of all that the entity wears, such as hair and beard.
/// Answered by [`HairdoCaptured`] on the same entity, once for each hair, or by [`HairdoRejected`].
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// #[derive(Resource)]
/// struct Photo(Vec<u8>);
///
/// fn at_the_hairdresser(In(character): In<Entity>, mut commands: Commands) {
///     commands.entity(character).observe(|taken: On<HairdoCaptured>, mut commands: Commands| {
///         commands.insert_resource(Photo(taken.hairdo.to_bytes()));
///     });
///     commands.trigger(CaptureHairdo { entity: character });
/// }
///
/// fn the_same_please(In(other): In<Entity>, photo: Res<Photo>, mut commands: Commands) -> Result {
///     let hairdo = Hairdo::from_bytes(&photo.0)?;
///     commands.trigger(ApplyHairdo { entity: other, hairdo });
///     Ok(())
/// }
/// ```
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct CaptureHairdo {
    /// The hair, or its wearer.
    pub entity: Entity,
}

/// The answer to [`CaptureHairdo`].
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairdoCaptured {
    /// The hair, or its wearer.
    pub entity: Entity,
    /// The hair.
    pub hair: Entity,
    /// Its hairdo at the moment of the request; of hair on the GPU a few frames later.
    pub hairdo: Hairdo,
}

/// Requests that a hairdo is put on a [`Hair`](crate::Hair), or on the one that the entity wears, of several on that of
/// the hairdo's preset, strand by strand where it has as many strands and nodes ([`Hairdo::apply`]), else resampled ([`Hairdo::apply_resampled`]). Answered by
/// [`HairdoApplied`] on the same entity, or by [`HairdoRejected`].
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct ApplyHairdo {
    /// The hair, or its wearer.
    pub entity: Entity,
    /// The hairdo to put on.
    pub hairdo: Hairdo,
}

/// Triggered on the entity of an [`ApplyHairdo`] whose hair wears the hairdo.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairdoApplied {
    /// The hair, or its wearer.
    pub entity: Entity,
}

/// Triggered on the entity of a [`CaptureHairdo`] or [`ApplyHairdo`] that failed; also reported as a
/// [`HairFault`](crate::HairFault). The hair is not changed.
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairdoRejected {
    /// The entity that the request named.
    pub entity: Entity,
    /// Why.
    pub error: HairdoError,
}

pub(super) fn take(request: On<CaptureHairdo>, mut commands: Commands) {
    let asked = request.entity;
    commands.queue(move |world: &mut World| {
        let hairs = hairs_of(world, asked);
        if hairs.is_empty() {
            refuse(world, asked, HairdoError::NoHair { entity: asked });
        }
        for hair in hairs {
            #[cfg(feature = "gpu")]
            if is_on_gpu(world, hair) {
                let mut awaited = world.entity_mut(hair);
                awaited.entry::<Awaited>().or_default().get_mut().0.push(asked);
                world.trigger(AskForStrands { entity: hair });
                continue;
            }
            answer(world, hair, asked);
        }
    });
}

/// Tells the one that was asked the hairdo of a hair.
fn answer(world: &mut World, hair: Entity, asked: Entity) {
    match Hairdo::of_strands(world, hair) {
        Ok(hairdo) => world.trigger(HairdoCaptured { entity: asked, hair, hairdo }),
        Err(error) => refuse(world, asked, error),
    }
}

/// On hair on the GPU: the entities on which its hairdo was asked for.
#[cfg(feature = "gpu")]
#[derive(Component, Default)]
pub(super) struct Awaited(Vec<Entity>);

#[cfg(feature = "gpu")]
pub(super) fn answer_arrived(
    arrived: On<StrandsArrived>,
    awaited: Query<(), With<Awaited>>,
    mut commands: Commands,
) {
    let hair = arrived.entity;
    if awaited.contains(hair) {
        commands.queue(move |world: &mut World| {
            let awaited = world.entity_mut(hair).take::<Awaited>();
            for asked in awaited.into_iter().flat_map(|awaited| awaited.0) {
                answer(world, hair, asked);
            }
        });
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
