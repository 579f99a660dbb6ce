//! Values shared by all strands of a hair, computed once a substep.

use bevy::{ecs::entity::EntityHashMap, prelude::*};

/// Values by hair, in the order in which hairs were first looked up.
///
/// Strands are mostly grouped by hair, so the last lookup usually answers the next: with ten thousand
/// strands a map lookup for each would take as long as their forces.
pub(crate) struct PerHair<T> {
    pub values: Vec<T>,
    index_of: EntityHashMap<Option<usize>>,
    last: Option<(Entity, Option<usize>)>,
}

impl<T> Default for PerHair<T> {
    fn default() -> Self {
        Self { values: Vec::new(), index_of: default(), last: None }
    }
}

impl<T> PerHair<T> {
    /// The index of the value of `hair`, which `make` makes on the first lookup; `None` where `make`
    /// gives none.
    #[inline]
    pub fn index(&mut self, hair: Entity, make: impl FnOnce() -> Option<T>) -> Option<usize> {
        if let Some((last, index)) = self.last
            && last == hair
        {
            return index;
        }
        let values = &mut self.values;
        let index = *self.index_of.entry(hair).or_insert_with(|| {
            values.push(make()?);
            Some(values.len() - 1)
        });
        self.last = Some((hair, index));
        index
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_hair_is_made_once() {
        let [a, b, none] = [1, 2, 3].map(|i| Entity::from_raw_u32(i).unwrap());
        let mut asked = Vec::new();
        let mut per_hair = PerHair::default();
        let mut index = |hair: Entity| {
            per_hair.index(hair, || {
                asked.push(hair);
                (hair != none).then_some(hair)
            })
        };
        let found = [a, a, none, b, none, a, b].map(&mut index);
        assert_eq!(found, [Some(0), Some(0), None, Some(1), None, Some(0), Some(1)]);
        assert_eq!(asked, [a, none, b]);
        assert_eq!(per_hair.values, [a, b]);
    }
}
