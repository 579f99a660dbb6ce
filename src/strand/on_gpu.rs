//! Hair that is simulated on the graphics device, as the rooms see it that simulate on the processor: a
//! mark, and a way to have it back.

use bevy::prelude::*;

/// Marks a [`Hair`](crate::Hair) and its strands while they are simulated on the graphics device (feature
/// `gpu`). Systems of the tick leave them alone.
///
/// A marked strand's [`Strand`](crate::Strand) and [`Bonds`](crate::Bonds) are as they were when it was
/// handed over, or when somebody last asked for them. Whoever writes to them brings the hair back.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct OnGpu;

/// Brings a hair back at once. Set by the feature `gpu`.
#[derive(Resource, Clone, Copy, Debug)]
#[cfg_attr(not(feature = "gpu"), allow(dead_code, reason = "nobody goes"))]
pub(crate) struct BringHome(pub(crate) fn(&mut World, Entity));

/// Has a hair on the processor, with its present state in its strands, before something reads or writes
/// them. Nothing happens to hair that is there.
pub(crate) fn bring_home(world: &mut World, hair: Entity) {
    if world.get::<OnGpu>(hair).is_some()
        && let Some(BringHome(now)) = world.get_resource::<BringHome>().copied()
    {
        now(world, hair);
    }
}

/// A request: the present state of hair on the graphics device into its strands. Answered by
/// [`StrandsArrived`]; for hair on the processor at once.
#[cfg(feature = "gpu")]
#[derive(EntityEvent, Clone, Copy, Debug)]
pub(crate) struct AskForStrands {
    pub(crate) entity: Entity,
}

/// The answer to [`AskForStrands`].
#[cfg(feature = "gpu")]
#[derive(EntityEvent, Clone, Copy, Debug)]
pub(crate) struct StrandsArrived {
    pub(crate) entity: Entity,
}
