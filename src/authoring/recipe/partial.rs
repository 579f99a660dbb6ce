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
        tuple_struct::{DynamicTupleStruct, TupleStructInfo},
    },
};
use core::{any::TypeId, fmt};
use serde::de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor};

/// A value of a type.
#[derive(Clone, Copy)]
pub(super) struct Partial<'a> {
    pub(super) of: &'a TypeRegistration,
    pub(super) registry: &'a TypeRegistry,
    /// Whether it takes the place of the one before whole: in lists and variants.
    is_whole: bool,
}

impl<'a> Partial<'a> {
    pub(super) fn new(of: &'a TypeRegistration, registry: &'a TypeRegistry) -> Self {
        Self { of, registry, is_whole: false }
    }

    /// A value in it.
    fn inner<E: Error>(self, id: TypeId) -> Result<Self, E> {
        let of = self.registry.get(id);
        let of = of.ok_or_else(|| E::custom("a field's type is not registered"))?;
        Ok(Self { of, ..self })
    }
}

impl<'de> DeserializeSeed<'de> for Partial<'_> {
    type Value = Box<dyn PartialReflect>;

    fn deserialize<D: Deserializer<'de>>(self, file: D) -> Result<Self::Value, D::Error> {
        let Self { of, registry, is_whole } = self;
        let mut given = Given { is_whole };
        TypedReflectDeserializer::with_processor(of, registry, &mut given).deserialize(file)
    }
}

/// Reads structs, and what may be missing, with the fields that are given.
struct Given {
    is_whole: bool,
}

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
        let value = Partial { of, registry, is_whole: self.is_whole };
        match of.type_info() {
            TypeInfo::Struct(info) => {
                let read =
                    file.deserialize_struct(name, info.field_names(), Fields { info, value })?;
                match of.data::<ReflectFromReflect>().filter(|_| self.is_whole) {
                    Some(from) => Ok(Ok(whole(from, info, &read)?)),
                    None => Ok(Ok(Box::new(read))),
                }
            }
            _ if self.is_whole => Ok(Err(file)),
            TypeInfo::TupleStruct(info) => {
                let items = Items { info, value };
                let read = match info.field_len() {
                    1 => file.deserialize_newtype_struct(name, items)?,
                    more => file.deserialize_tuple_struct(name, more, items)?,
                };
                Ok(Ok(Box::new(read)))
            }
            TypeInfo::Enum(info) if of.type_info().type_path().starts_with("core::option::") => {
                Ok(Ok(Box::new(file.deserialize_option(Maybe { info, value })?)))
            }
            // Bevy makes them of what is in them, and would leave out what is not whole.
            _ => Ok(Ok(Partial { is_whole: true, ..value }.deserialize(file)?)),
        }
    }
}

/// A struct of which all is given that has no default.
fn whole<E: Error>(
    from: &ReflectFromReflect,
    info: &StructInfo,
    read: &DynamicStruct,
) -> Result<Box<dyn PartialReflect>, E> {
    from.from_reflect(read).map(|value| value.into_partial_reflect()).ok_or_else(|| {
        let missing = info.field_names().iter().filter(|name| read.field(name).is_none());
        let missing = missing.copied().collect::<Vec<_>>().join(", ");
        E::custom(format_args!(
            "fields are missing, {missing}: in a list or a variant, a type without a default is given whole"
        ))
    })
}

struct Fields<'a> {
    info: &'static StructInfo,
    value: Partial<'a>,
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
            let value = fields.next_value_seed(self.value.inner(field.type_id())?)?;
            read.insert_boxed(name, value);
        }
        read.set_represented_type(Some(self.value.of.type_info()));
        Ok(read)
    }
}

struct Items<'a> {
    info: &'static TupleStructInfo,
    value: Partial<'a>,
}

impl Items<'_> {
    fn item<E: Error>(&self, i: usize) -> Result<Partial<'_>, E> {
        let item = self.info.field_at(i).ok_or_else(|| E::invalid_length(i, self))?;
        self.value.inner(item.type_id())
    }
}

impl<'de> Visitor<'de> for Items<'_> {
    type Value = DynamicTupleStruct;

    fn expecting(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(to, "{} values in brackets", self.info.field_len())
    }

    fn visit_newtype_struct<D: Deserializer<'de>>(
        self,
        file: D,
    ) -> Result<DynamicTupleStruct, D::Error> {
        let mut read = DynamicTupleStruct::default();
        read.insert_boxed(self.item(0)?.deserialize(file)?);
        read.set_represented_type(Some(self.value.of.type_info()));
        Ok(read)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<DynamicTupleStruct, A::Error> {
        let mut read = DynamicTupleStruct::default();
        for i in 0..self.info.field_len() {
            let value = items.next_element_seed(self.item(i)?)?;
            read.insert_boxed(value.ok_or_else(|| A::Error::invalid_length(i, &self))?);
        }
        read.set_represented_type(Some(self.value.of.type_info()));
        Ok(read)
    }
}

struct Maybe<'a> {
    info: &'static EnumInfo,
    value: Partial<'a>,
}

impl Maybe<'_> {
    fn read(self, mut value: DynamicEnum) -> DynamicEnum {
        value.set_represented_type(Some(self.value.of.type_info()));
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
        let value = self.value.inner::<D::Error>(inner.type_id())?.deserialize(file)?;
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
