//! Reading recipes.

use super::{
    HairRecipe, RecipeError,
    partial::{Partial, fitting},
    what::Changes,
};
use crate::authoring::plant::{HairPreset, Hairline, Planting};
use bevy::{
    asset::{AssetLoader, LoadContext, io::Reader},
    ecs::reflect::{AppTypeRegistry, ReflectComponent, ReflectResource},
    prelude::*,
    reflect::{
        TypeInfo, TypeRegistration, TypeRegistry, TypeRegistryArc, Typed, enums::VariantInfo,
    },
};
use core::{any::TypeId, fmt};
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};

/// Loads a [`HairRecipe`] from `.recipe.ron`.
#[derive(TypePath, Clone, Debug)]
pub struct RecipeLoader {
    registry: TypeRegistryArc,
}

impl FromWorld for RecipeLoader {
    fn from_world(world: &mut World) -> Self {
        Self { registry: world.get_resource_or_init::<AppTypeRegistry>().0.clone() }
    }
}

impl AssetLoader for RecipeLoader {
    type Asset = HairRecipe;
    type Settings = ();
    type Error = BevyError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        (): &(),
        _: &mut LoadContext<'_>,
    ) -> Result<HairRecipe, BevyError> {
        let mut file = Vec::new();
        reader.read_to_end(&mut file).await?;
        Ok(HairRecipe::from_ron(&file, &self.registry.read())?)
    }

    fn extensions(&self) -> &[&str] {
        &["recipe.ron"]
    }
}

impl HairRecipe {
    /// A recipe from the text of a file, with the types that `registry` knows.
    ///
    /// # Errors
    /// When it is no RON, or names a preset, component or field that there is not; with line and column.
    pub fn from_ron(file: &[u8], registry: &TypeRegistry) -> Result<Self, RecipeError> {
        // Some editors begin a file with a mark.
        let file = file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file);
        let mut file = ron::de::Deserializer::from_bytes(file)?;
        let recipe = RecipeOf(registry).deserialize(&mut file).map_err(|e| file.span_error(e))?;
        file.end().map_err(|e| file.span_error(e))?;
        Ok(recipe)
    }
}

const FIELDS: &[&str] = &["preset", "planting", "hairline", "components"];

struct RecipeOf<'a>(&'a TypeRegistry);

impl<'de> DeserializeSeed<'de> for RecipeOf<'_> {
    type Value = HairRecipe;

    fn deserialize<D: Deserializer<'de>>(self, file: D) -> Result<HairRecipe, D::Error> {
        file.deserialize_struct("HairRecipe", FIELDS, self)
    }
}

impl<'de> Visitor<'de> for RecipeOf<'_> {
    type Value = HairRecipe;

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "a recipe, (preset: …, planting: (…), hairline: (…), components: {{…}})")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<HairRecipe, A::Error> {
        let Self(registry) = self;
        let (mut preset, mut changes) = (HairPreset::default(), Changes::default());
        let mut known: Vec<String> = Vec::new();
        while let Some(name) = fields.next_key::<String>()? {
            if known.contains(&name) {
                return Err(A::Error::custom(format_args!("{name:?} is there twice")));
            }
            match name.as_str() {
                "preset" => {
                    let value = fields.next_value_seed(of::<HairPreset, A::Error>(registry)?)?;
                    preset = HairPreset::from_reflect(&*value).unwrap_or_default();
                }
                "planting" => {
                    let value = fields.next_value_seed(of::<Planting, A::Error>(registry)?)?;
                    changes.planting = Some(fitting(&mut Planting::default(), value)?);
                }
                "hairline" => {
                    let value = fields.next_value_seed(of::<Hairline, A::Error>(registry)?)?;
                    changes.hairline = Some(fitting(&mut Hairline::default(), value)?);
                }
                "components" => {
                    changes.components = fields.next_value_seed(ComponentsOf(registry))?;
                }
                other => {
                    return Err(A::Error::custom(format_args!(
                        "unknown field `{other}`, expected one of {FIELDS:?}"
                    )));
                }
            }
            known.push(name);
        }
        Ok(HairRecipe::new(preset, changes))
    }
}

/// Reads a value of a type, of which fields may be missing.
fn of<T: Typed, E: Error>(registry: &TypeRegistry) -> Result<Partial<'_>, E> {
    let missing = || {
        let name = T::type_path();
        E::custom(format_args!("{name} is not registered: add HairPlugins to the app"))
    };
    Ok(Partial::new(registry.get(TypeId::of::<T>()).ok_or_else(missing)?, registry))
}

struct ComponentsOf<'a>(&'a TypeRegistry);

impl<'de> DeserializeSeed<'de> for ComponentsOf<'_> {
    type Value = Vec<(TypeId, Box<dyn PartialReflect>)>;

    fn deserialize<D: Deserializer<'de>>(self, file: D) -> Result<Self::Value, D::Error> {
        file.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for ComponentsOf<'_> {
    type Value = Vec<(TypeId, Box<dyn PartialReflect>)>;

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "components by their names, {{\"HairLook\": (…), …}}")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut all: A) -> Result<Self::Value, A::Error> {
        let Self(registry) = self;
        let mut found: Self::Value = Vec::new();
        while let Some(name) = all.next_key::<String>()? {
            let registration = component_named(&name, registry).map_err(A::Error::custom)?;
            let id = registration.type_id();
            if found.iter().any(|(of, _)| *of == id) {
                return Err(A::Error::custom(format_args!("{name:?} is there twice")));
            }
            let value = all.next_value_seed(Partial::new(registration, registry))?;
            let value = match registration.data::<ReflectDefault>() {
                Some(default) => {
                    let mut default = default.default();
                    // What it was before is kept.
                    default.reflect_clone().map_err(A::Error::custom)?;
                    fitting(default.as_partial_reflect_mut(), value)?
                }
                None => whole(registration, value).map_err(A::Error::custom)?,
            };
            found.push((id, value));
        }
        Ok(found)
    }
}

/// The component of this name, or of this path.
fn component_named<'a>(
    name: &str,
    registry: &'a TypeRegistry,
) -> Result<&'a TypeRegistration, String> {
    let by_name = registry.get_with_short_type_path(name);
    let found = by_name.or_else(|| registry.get_with_type_path(name));
    if found.is_some_and(|found| names_entities(found.type_info(), registry, 0)) {
        return Err(format!("{name:?} names entities, which a file does not know"));
    }
    if found.is_some_and(|found| found.contains::<ReflectResource>()) {
        return Err(format!("{name:?} is a resource of the world, expected a component of hair"));
    }
    let is_component = |found: &&TypeRegistration| found.contains::<ReflectComponent>();
    if let Some(found) = found.filter(is_component) {
        return Ok(found);
    }
    if found.is_some() {
        return Err(format!("{name:?} is no component"));
    }
    if registry.is_ambiguous(name) {
        return Err(format!("more than one type is named {name:?}: write its whole path"));
    }
    let own = registry.iter().filter(|of| of.contains::<ReflectComponent>());
    let own = own.map(|of| of.type_info().type_path_table());
    let own = own.filter(|of| of.crate_name() == Some("bevy_keratin")).map(|of| of.short_path());
    let near = own.min_by_key(|other| distance(name, other)).unwrap_or_default();
    Err(format!("no component is named {name:?}; the nearest name is {near:?}"))
}

/// Whether there is an entity among the fields of a type, however deep.
fn names_entities(info: &TypeInfo, registry: &TypeRegistry, depth: usize) -> bool {
    let inside = |id: TypeId| {
        let is_entity = id == TypeId::of::<Entity>();
        let deeper = || registry.get(id).filter(|_| depth < 8);
        is_entity || deeper().is_some_and(|of| names_entities(of.type_info(), registry, depth + 1))
    };
    match info {
        TypeInfo::Struct(info) => info.iter().any(|field| inside(field.type_id())),
        TypeInfo::TupleStruct(info) => info.iter().any(|field| inside(field.type_id())),
        TypeInfo::Tuple(info) => info.iter().any(|field| inside(field.type_id())),
        TypeInfo::List(info) => inside(info.item_ty().id()),
        TypeInfo::Array(info) => inside(info.item_ty().id()),
        TypeInfo::Enum(info) => info.iter().any(|variant| match variant {
            VariantInfo::Struct(variant) => variant.iter().any(|field| inside(field.type_id())),
            VariantInfo::Tuple(variant) => variant.iter().any(|field| inside(field.type_id())),
            VariantInfo::Unit(_) => false,
        }),
        _ => false,
    }
}

/// How many letters have to be put in, left out or changed.
fn distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.chars().count()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut before = core::mem::replace(&mut row[0], i + 1);
        for (j, y) in b.chars().enumerate() {
            let changed = before + usize::from(x != y);
            before = row[j + 1];
            row[j + 1] = changed.min(before + 1).min(row[j] + 1);
        }
    }
    row[row.len() - 1]
}

/// A value of a type without a default, which has to have all of its fields.
fn whole(
    registration: &TypeRegistration,
    value: Box<dyn PartialReflect>,
) -> Result<Box<dyn PartialReflect>, String> {
    let made = registration.data::<ReflectFromReflect>().map(|from| from.from_reflect(&*value));
    match made {
        Some(Some(made)) => Ok(made.into_partial_reflect()),
        Some(None) => Err("a field is missing, and the type has no default".to_owned()),
        None => {
            Err("the type can be made of no file: it has neither FromReflect nor a default"
                .to_owned())
        }
    }
}
