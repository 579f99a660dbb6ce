//! A groom of hair as it is now.

use super::{Groom, GroomError};
use crate::{
    hair::{strand::return_to_cpu, worn::hairs_of},
    render::DrawnCurves,
};
use bevy::{ecs::system::SystemState, prelude::*};

impl Groom {
    /// All drawn strands of a hair in their present shape, or of all hair that an entity wears: to be written to a file
    /// by [`alembic::write`](super::alembic::write) or [`yuksel::write`](super::yuksel::write). Simulated strands come
    /// first, node by node and marked as guides, then those drawn between them, with as many segments as
    /// [`HairFollowers::segments`](crate::render::HairFollowers::segments), out of the solids near them. Widths are those of the
    /// [`HairLook`](crate::HairLook); colours, which are melanin, have no place in a groom.
    ///
    /// Lengths are in metres of the hair's frame (of the first hair's, where an entity wears several). In an app that does
    /// not draw, strands between guides are laid out as guides grow now. Hair on the GPU returns from there.
    ///
    /// ```
    /// # use bevy_keratin::{prelude::*, authoring::groom::yuksel}; use bevy::prelude::*;
    /// fn save(world: &mut World, character: Entity) -> Result {
    ///     let groom = Groom::of_hair(world, character)?;
    ///     Ok(std::fs::write("present.hair", yuksel::write(&groom)?)?)
    /// }
    /// ```
    ///
    /// # Errors
    /// When the entity is no hair and wears none, the hair has no strands, or one is not finite.
    pub fn of_hair(world: &mut World, entity: Entity) -> Result<Self, GroomError> {
        let hairs = hairs_of(world, entity);
        let Some(first) = hairs.first().copied() else {
            return Err(GroomError::NoHair);
        };
        hairs.iter().for_each(|hair| return_to_cpu(world, *hair));
        let place = |world: &World, hair| world.get::<GlobalTransform>(hair).map(|at| at.affine());
        let from_world = place(world, first).map(|affine| affine.inverse());
        let (mut groom, mut guides) = (Self::default(), Vec::new());
        let mut state = SystemState::<DrawnCurves>::new(world);
        for hair in hairs {
            let space = from_world.zip(place(world, hair)).filter(|_| hair != first);
            let curves = state.get(world).map_err(|_| GroomError::NoHair)?;
            for curve in curves.of(hair) {
                groom.points.extend(curve.points.into_iter().map(|p| match space {
                    Some((from_world, to_world)) => {
                        from_world.transform_point3(to_world.transform_point3(p))
                    }
                    None => p,
                }));
                groom.widths.extend(curve.widths);
                guides.push(curve.is_guide);
                let found = groom.points.len();
                groom.ends.push(u32::try_from(found).map_err(|_| GroomError::TooMany { found })?);
            }
        }
        if groom.is_empty() {
            return Err(GroomError::Empty);
        }
        groom.with_guides(guides)
    }
}
