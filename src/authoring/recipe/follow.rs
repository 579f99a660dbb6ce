//! Components that follow a recipe.

use super::what::HairRecipe;
use crate::{
    base::fault::{FaultKind, HairFault},
    hair::worn::Wearer,
};
use bevy::{
    asset::LoadState, ecs::reflect::AppTypeRegistry, platform::collections::HashSet, prelude::*,
};
use core::any::TypeId;
use std::sync::Arc;

/// Puts the components of a [`HairRecipe`] on its entity, once it is loaded and whenever it changes: settings and looks of
/// hair from a groom. Component of any entity; hair that is worn by a recipe has it. On a wearer it acts on each hair that it
/// wears, in place of the hair's own.
///
/// A field that the file does not name stays as it was, one that a later version names no more becomes again what it was
/// before; what a game has written to them meanwhile is overwritten when the file changes. Without this component all stays as
/// it is.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn spawn(mut commands: Commands, assets: Res<AssetServer>) {
///     let look = FollowRecipe(assets.load("copper.recipe.ron"));
///     commands.spawn((GroomedHair::new(assets.load("bob.hair")), look));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct FollowRecipe(pub Handle<HairRecipe>);

/// What an entity has from a recipe.
#[derive(Component, Clone, Debug)]
pub(crate) struct Followed {
    /// As it was when it was applied, and when it was first.
    recipe: HairRecipe,
    first: HairRecipe,
    /// The components before; `None` of those that were not there.
    before: Before,
}

impl Followed {
    /// Whether hair that grew by the first grows as well by another.
    pub(crate) fn grows_like(&self, other: &HairRecipe) -> bool {
        self.first == *other || self.first.grows_like(other)
    }
}

type Before = Arc<Vec<(TypeId, Option<Box<dyn Reflect>>)>>;

pub(super) fn follow(
    mut commands: Commands,
    // A wearer's acts on its hair.
    entities: Query<(Entity, &FollowRecipe, Option<&Followed>), Without<Wearer>>,
    (recipes, assets): (Res<Assets<HairRecipe>>, Res<AssetServer>),
    mut reported: Local<HashSet<AssetId<HairRecipe>>>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, FollowRecipe(handle), followed) in &entities {
        if let Some(recipe) = recipes.get(handle) {
            reported.remove(&handle.id());
            if followed.is_none_or(|followed| followed.recipe != *recipe) {
                commands.entity(entity).queue_silenced(apply(recipe.clone()));
            }
        } else if let LoadState::Failed(error) = assets.load_state(handle)
            && reported.insert(handle.id())
        {
            // The asset server has logged the full error.
            let error = error.to_string();
            let error = error.lines().next().unwrap_or_default();
            let message = format!("the hair's recipe was not loaded: {error}");
            faults.write(HairFault::new(FaultKind::Setting, message).of(entity));
        }
    }
}

/// What it has stays; another recipe begins anew.
pub(super) fn forget(gone: On<Remove, FollowRecipe>, mut commands: Commands) {
    commands.entity(gone.entity).try_remove::<Followed>();
}

/// Puts a recipe's components on an entity, in place of those of one before.
pub(crate) fn apply(recipe: HairRecipe) -> impl EntityCommand {
    move |mut entity: EntityWorldMut<'_>| {
        let registry = entity.resource::<AppTypeRegistry>().clone();
        let registry = registry.read();
        let (first, earlier) = match entity.take::<Followed>() {
            Some(followed) => (followed.first, Some(followed.before)),
            None => (recipe.clone(), None),
        };
        for (id, was) in earlier.iter().flat_map(|earlier| earlier.iter()) {
            let Some(writer) = HairRecipe::writer(*id, &registry) else { continue };
            if recipe.components().any(|of| of == *id) {
                continue;
            }
            match was {
                Some(was) => writer.insert(&mut entity, was.as_partial_reflect(), &registry),
                None => writer.remove(&mut entity),
            }
        }
        let mut before = Vec::new();
        for id in recipe.components() {
            let Some(writer) = HairRecipe::writer(id, &registry) else { continue };
            let known = earlier.iter().flat_map(|earlier| earlier.iter()).find(|(of, _)| *of == id);
            let present = writer.reflect(&entity);
            let was = match known {
                Some((_, was)) => was.as_deref(),
                None => present,
            };
            let value = recipe.component(id, was, &registry);
            let was = was.and_then(|was| was.reflect_clone().ok());
            let is_same = |value: &dyn Reflect| {
                present.is_some_and(|own| {
                    own.reflect_partial_eq(value.as_partial_reflect()) == Some(true)
                })
            };
            let value = value.filter(|value| !is_same(&**value));
            before.push((id, was));
            if let Some(value) = value {
                writer.insert(&mut entity, value.as_partial_reflect(), &registry);
            }
        }
        entity.insert(Followed { recipe, first, before: Arc::new(before) });
    }
}
