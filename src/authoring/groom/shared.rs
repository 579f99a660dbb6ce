//! Arrays that copies of a groom share until one of them is written to.

use std::{
    ops::{Deref, DerefMut},
    sync::Arc,
};

/// A list that its first writer copies, not whoever clones it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Shared<T>(Arc<Vec<T>>);

impl<T> From<Vec<T>> for Shared<T> {
    fn from(list: Vec<T>) -> Self {
        Self(Arc::new(list))
    }
}

impl<T> FromIterator<T> for Shared<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        Vec::from_iter(items).into()
    }
}

impl<T> Deref for Shared<T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T: Clone> DerefMut for Shared<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        Arc::make_mut(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::super::Groom;
    use bevy::prelude::*;

    #[test]
    fn a_groom_is_copied_by_who_writes() {
        let groom = Groom::from_polylines([[Vec3::ZERO, Vec3::Y]]).unwrap();
        let worn = groom.clone();
        assert_eq!(worn.points().as_ptr(), groom.points().as_ptr());
        let moved = worn.moved(Vec3::X).unwrap();
        assert_eq!((moved.points()[0], groom.points()[0]), (Vec3::X, Vec3::ZERO));
    }
}
