//! Values of which only some fields are given.

use bevy::reflect::{ApplyError, PartialReflect, ReflectMut, ReflectRef, enums::VariantType};

/// Writes the fields that `from` has into `to`, those of fields as well. A list takes the place of the one before.
pub(super) fn patch(
    to: &mut dyn PartialReflect,
    from: &dyn PartialReflect,
) -> Result<(), ApplyError> {
    match (to.reflect_mut(), from.reflect_ref()) {
        (ReflectMut::Struct(to), ReflectRef::Struct(from)) => {
            for (name, value) in from.iter_fields() {
                if let Some(own) = to.field_mut(name) {
                    patch(own, value)?;
                }
            }
            Ok(())
        }
        (ReflectMut::TupleStruct(to), ReflectRef::TupleStruct(from)) => {
            for (i, value) in from.iter_fields().enumerate() {
                if let Some(own) = to.field_mut(i) {
                    patch(own, value)?;
                }
            }
            Ok(())
        }
        (ReflectMut::Enum(to), ReflectRef::Enum(from))
            if to.variant_name() == from.variant_name() =>
        {
            for i in 0..from.field_len() {
                let name = from.name_at(i).filter(|_| from.variant_type() == VariantType::Struct);
                let own = match name {
                    Some(name) => to.field_mut(name),
                    None => to.field_at_mut(i),
                };
                if let (Some(own), Some(value)) = (own, from.field_at(i)) {
                    patch(own, value)?;
                }
            }
            Ok(())
        }
        (ReflectMut::List(to), ReflectRef::List(from)) => {
            to.drain();
            from.iter().for_each(|value| to.push(value.to_dynamic()));
            Ok(())
        }
        _ => to.try_apply(from),
    }
}
