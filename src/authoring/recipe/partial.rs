//! Reading values of which only some fields are given. Bevy's own deserializer fills in the others with defaults.

use super::patch::patch;
use bevy::{
    prelude::*,
    reflect::{
        TypeInfo, TypeRegistration, TypeRegistry,
        enums::{DynamicEnum, EnumInfo},
        serde::{ReflectDeserializerProcessor, TypedReflectDeserializer},
        structs::{DynamicStruct, StructInfo},
        tuple::DynamicTuple,
    },
};
use core::{any::TypeId, fmt};
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, Visitor};

/// A value of a type.
pub(super) struct Partial<'a> {
    pub(super) of: &'a TypeRegistration,
    pub(super) registry: &'a TypeRegistry,
}

impl<'de> DeserializeSeed<'de> for Partial<'_> {
    type Value = Box<dyn PartialReflect>;

    fn deserialize<D: Deserializer<'de>>(self, file: D) -> Result<Self::Value, D::Error> {
        let Self { of, registry } = self;
        let mut given = Given;
        TypedReflectDeserializer::with_processor(of, registry, &mut given).deserialize(file)
    }
}

/// Reads structs, and what may be missing, with the fields that are given.
struct Given;

impl ReflectDeserializerProcessor for Given {
    fn try_deserialize<'de, D: Deserializer<'de>>(
        &mut self,
        of: &TypeRegistration,
        registry: &TypeRegistry,
        file: D,
    ) -> Result<Result<Box<dyn PartialReflect>, D>, D::Error> {
        if of.contains::<ReflectDeserialize>() {
            return Ok(Err(file));
        }
        let name = of.type_info().type_path_table().ident().unwrap_or_default();
        match of.type_info() {
            TypeInfo::Struct(info) => {
                let fields = Fields { info, of, registry };
                let read = file.deserialize_struct(name, info.field_names(), fields)?;
                Ok(Ok(Box::new(read)))
            }
            TypeInfo::Enum(info) if of.type_info().type_path().starts_with("core::option::") => {
                let read = file.deserialize_option(Maybe { info, of, registry })?;
                Ok(Ok(Box::new(read)))
            }
            _ => Ok(Err(file)),
        }
    }
}

fn registered<E: Error>(id: TypeId, registry: &TypeRegistry) -> Result<&TypeRegistration, E> {
    registry.get(id).ok_or_else(|| E::custom("a field's type is not registered"))
}

struct Fields<'a> {
    info: &'static StructInfo,
    of: &'a TypeRegistration,
    registry: &'a TypeRegistry,
}

impl<'de> Visitor<'de> for Fields<'_> {
    type Value = DynamicStruct;

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "({}: …)", self.info.field_names().join(": …, "))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<DynamicStruct, A::Error> {
        let mut read = DynamicStruct::default();
        while let Some(name) = fields.next_key::<String>()? {
            let Some(field) = self.info.field(&name) else {
                return Err(A::Error::custom(format_args!(
                    "unknown field `{name}`, expected one of {:?}",
                    self.info.field_names()
                )));
            };
            let of = registered(field.type_id(), self.registry)?;
            let value = fields.next_value_seed(Partial { of, registry: self.registry })?;
            read.insert_boxed(name, value);
        }
        read.set_represented_type(Some(self.of.type_info()));
        Ok(read)
    }
}

struct Maybe<'a> {
    info: &'static EnumInfo,
    of: &'a TypeRegistration,
    registry: &'a TypeRegistry,
}

impl Maybe<'_> {
    fn read(self, mut value: DynamicEnum) -> DynamicEnum {
        value.set_represented_type(Some(self.of.type_info()));
        value
    }
}

impl<'de> Visitor<'de> for Maybe<'_> {
    type Value = DynamicEnum;

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "Some(…) or None")
    }

    fn visit_none<E: Error>(self) -> Result<DynamicEnum, E> {
        Ok(self.read(DynamicEnum::new("None", ())))
    }

    fn visit_some<D: Deserializer<'de>>(self, file: D) -> Result<DynamicEnum, D::Error> {
        let inner = self.info.variant("Some").and_then(|some| some.as_tuple_variant().ok());
        let Some(inner) = inner.and_then(|some| some.field_at(0)) else {
            return Err(D::Error::custom("a value that may be missing has no type"));
        };
        let of = registered(inner.type_id(), self.registry)?;
        let value = Partial { of, registry: self.registry }.deserialize(file)?;
        let mut some = DynamicTuple::default();
        some.insert_boxed(value);
        Ok(self.read(DynamicEnum::new("Some", some)))
    }
}

/// The value, where it can be written into another of its type.
pub(super) fn fitting<E: Error>(
    into: &mut dyn PartialReflect,
    value: Box<dyn PartialReflect>,
) -> Result<Box<dyn PartialReflect>, E> {
    patch(into, &*value).map_err(E::custom)?;
    Ok(value)
}
