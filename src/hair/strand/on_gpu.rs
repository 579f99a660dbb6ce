//! Hair that is simulated on the GPU, as the rooms see it that simulate on the CPU: a
//! mark, and a way to have it back.

use bevy::prelude::*;

/// Marks a [`Hair`](crate::Hair) and its strands while they are simulated on the GPU (feature
/// `gpu`). Systems of the tick leave them alone.
///
/// A marked strand's [`Strand`](crate::Strand) and [`Bonds`](crate::Bonds) are as they were when it was
/// handed over, or when they were last requested. A write to them returns the hair to the CPU.
///
/// Only the crate itself can make it, and neither clones, scenes nor inspectors copy it: nothing would
/// simulate a strand that is marked and not there.
#[derive(Component, Debug)]
#[component(clone_behavior = Ignore)]
pub struct OnGpu(());

#[cfg(feature = "gpu")]
impl OnGpu {
    /// The mark of hair that has been handed over.
    pub(crate) const HANDED_OVER: Self = Self(());
}

/// Requests of a kind that the CPU's systems have read while their target was on the GPU: written within a
/// tick, they come before anybody decides to have it back.
#[derive(Resource, Debug)]
pub(crate) struct MissedOnGpu<T: Send + Sync + 'static>(pub(crate) Vec<T>);

impl<T: Send + Sync + 'static> Default for MissedOnGpu<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

/// Brings a hair back at once. Set by the feature `gpu`.
#[derive(Resource, Clone, Copy, Debug)]
#[cfg_attr(not(feature = "gpu"), allow(dead_code, reason = "only the GPU returns hair"))]
pub(crate) struct ReturnToCpu(pub(crate) fn(&mut World, Entity));

/// Has a hair on the CPU, with its present state in its strands, before something reads or writes
/// them. Nothing happens to hair that is there.
pub(crate) fn return_to_cpu(world: &mut World, hair: Entity) {
    if world.get::<OnGpu>(hair).is_some()
        && let Some(ReturnToCpu(now)) = world.get_resource::<ReturnToCpu>().copied()
    {
        now(world, hair);
    }
}

/// A request: the present state of hair on the GPU into its strands. Answered by
/// [`StrandsArrived`]; for hair on the CPU at once.
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
