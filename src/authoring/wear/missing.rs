//! Finds the asset that is to blame where a wearer has no mesh: a path with a typing error.

use super::error::WearError;
use bevy::{
    asset::{LoadState, ReflectHandle},
    ecs::reflect::{AppTypeRegistry, ReflectComponent},
    prelude::*,
    reflect::{PartialReflect, ReflectRef, TypeRegistry},
};

/// The first asset that was not loaded of those that components of the wearer, or of what is below it, hold; of any
/// type that is reflected, so that it need not be known what a scene is.
pub(super) fn missing_asset(world: &World, wearer: Entity) -> Option<WearError> {
    let registry = world.get_resource::<AppTypeRegistry>()?.read();
    let server = world.get_resource::<AssetServer>()?;
    let mut todo = vec![wearer];
    while let Some(entity) = todo.pop() {
        todo.extend(world.get::<Children>(entity).into_iter().flatten());
        let Ok(entity) = world.get_entity(entity) else { continue };
        for component in entity.archetype().components() {
            let id = world.components().get_info(*component).and_then(|info| info.type_id());
            let Some(of_type) = id.and_then(|id| registry.get_type_data::<ReflectComponent>(id))
            else {
                continue;
            };
            let Some(component) = of_type.reflect(entity) else { continue };
            for handle in handles(component, &registry) {
                if let LoadState::Failed(error) = server.load_state(handle.id()) {
                    let path = handle.path().map_or_else(|| "it".to_owned(), ToString::to_string);
                    // The asset server has logged the full error.
                    let reason = error.to_string().lines().next().unwrap_or_default().to_owned();
                    return Some(WearError::NoScene { path, reason });
                }
            }
        }
    }
    None
}

/// The handles among the fields of a value.
fn handles(value: &dyn Reflect, registry: &TypeRegistry) -> Vec<UntypedHandle> {
    let fields: Vec<&dyn PartialReflect> = match value.reflect_ref() {
        ReflectRef::Struct(value) => value.iter_fields().map(|(_, field)| field).collect(),
        ReflectRef::TupleStruct(value) => value.iter_fields().collect(),
        _ => Vec::new(),
    };
    let fields = fields.into_iter().filter_map(PartialReflect::try_as_reflect);
    let handles = fields.filter_map(|field| {
        let field = field.as_any();
        registry.get_type_data::<ReflectHandle>(field.type_id())?.downcast_handle_untyped(field)
    });
    handles.collect()
}
