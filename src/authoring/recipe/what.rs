//! The asset.

use super::patch::patch;
use crate::authoring::plant::{HairPreset, Hairline, Planting, PresetSettings, Scalp};
use bevy::{
    ecs::reflect::ReflectComponent,
    prelude::*,
    reflect::{ReflectMut, TypeRegistry},
};
use core::any::TypeId;
use std::sync::Arc;

/// A preset and settings of hair, from a file: see [the module](super). An asset, by
/// `assets.load::<HairRecipe>("curls.recipe.ron")`; cheap to clone.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn wear(character: Entity, mut commands: Commands, assets: Res<AssetServer>) {
///     let recipe = assets.load("curls.recipe.ron");
///     commands.entity(character).insert(WearHair::of_recipe(recipe));
/// }
/// ```
#[derive(Asset, TypePath, Clone, Debug, Default)]
pub struct HairRecipe {
    preset: HairPreset,
    /// `None` of a preset as it is.
    changes: Option<Arc<Changes>>,
}

/// What of a preset is different.
#[derive(Debug, Default)]
pub(super) struct Changes {
    pub(super) planting: Option<Box<dyn PartialReflect>>,
    pub(super) hairline: Option<Box<dyn PartialReflect>>,
    /// Components, in the order of the file.
    pub(super) components: Vec<(TypeId, Box<dyn PartialReflect>)>,
}

impl From<HairPreset> for HairRecipe {
    /// A preset as it is.
    fn from(preset: HairPreset) -> Self {
        Self { preset, changes: None }
    }
}

/// Whether they are the same file as loaded at one time, or the same preset as it is.
impl PartialEq for HairRecipe {
    fn eq(&self, other: &Self) -> bool {
        let changes = |of: &Self| of.changes.as_ref().map(Arc::as_ptr);
        self.preset == other.preset && changes(self) == changes(other)
    }
}

impl HairRecipe {
    pub(super) fn new(preset: HairPreset, changes: Changes) -> Self {
        Self { preset, changes: Some(Arc::new(changes)) }
    }

    /// The preset that it changes; [`HairPreset::default`] where the file names none.
    pub fn preset(&self) -> HairPreset {
        self.preset
    }

    /// How it is planted: as the preset is, but for what the file says.
    pub fn planting(&self, scalp: &Scalp) -> Planting {
        let changes = self.changes.as_ref().and_then(|changes| changes.planting.as_deref());
        changed(self.preset.planting(scalp), changes)
    }

    /// How hair begins at the hairline of its drawn strands.
    pub fn hairline(&self) -> Hairline {
        let changes = self.changes.as_ref().and_then(|changes| changes.hairline.as_deref());
        changed(self.preset.hairline(), changes)
    }

    /// The settings of its hair, those that a preset has; others are [components](Self::components) of its own.
    pub fn settings(&self) -> PresetSettings {
        let mut settings = self.preset.settings();
        if let ReflectMut::Struct(fields) = settings.reflect_mut() {
            for i in 0..fields.field_len() {
                let Some(field) = fields.field_at_mut(i) else { continue };
                let of = field.try_as_reflect().map(|field| field.as_any().type_id());
                for (_, value) in self.patches().filter(|(id, _)| of == Some(*id)) {
                    let _ = patch(field, value);
                }
            }
        }
        settings
    }

    /// The components that the file names, in its order.
    pub fn components(&self) -> impl Iterator<Item = TypeId> + '_ {
        self.patches().map(|(id, _)| id)
    }

    pub(super) fn patches(&self) -> impl Iterator<Item = (TypeId, &dyn PartialReflect)> {
        let changes = self.changes.iter().flat_map(|changes| &changes.components);
        changes.map(|(id, value)| (*id, value.as_ref()))
    }

    /// Whether hair of both grows alike: they differ at most in what hair that has grown can take.
    pub(crate) fn grows_like(&self, other: &Self) -> bool {
        let scalp = Scalp::default();
        #[cfg(feature = "render")]
        let drawn = |of: &Self| of.settings().followers.count;
        #[cfg(not(feature = "render"))]
        let drawn = |_: &Self| 0;
        self.preset == other.preset
            && self.planting(&scalp) == other.planting(&scalp)
            && self.hairline() == other.hairline()
            && drawn(self) == drawn(other)
    }

    /// The value of a component with what this file says of it, on top of what it `was`, or of its default.
    pub(super) fn component(
        &self,
        id: TypeId,
        was: Option<&dyn Reflect>,
        registry: &TypeRegistry,
    ) -> Option<Box<dyn Reflect>> {
        let was = was.and_then(|was| was.reflect_clone().ok());
        let default = || Some(registry.get_type_data::<ReflectDefault>(id)?.default());
        let own = |id| self.patches().filter(move |(of, _)| *of == id).map(|(_, value)| value);
        let Some(mut value) = was.or_else(default) else {
            // A type without a default is whole in the file.
            let whole = registry.get_type_data::<ReflectFromReflect>(id)?;
            return whole.from_reflect(own(id).next()?);
        };
        for changes in own(id) {
            patch(value.as_partial_reflect_mut(), changes).ok()?;
        }
        Some(value)
    }

    /// The writer of a component; `None` where a type is none.
    pub(super) fn writer(id: TypeId, registry: &TypeRegistry) -> Option<&ReflectComponent> {
        registry.get_type_data::<ReflectComponent>(id)
    }
}

fn changed<T: Reflect>(mut value: T, by: Option<&dyn PartialReflect>) -> T {
    if let Some(by) = by {
        let _ = patch(value.as_partial_reflect_mut(), by);
    }
    value
}
