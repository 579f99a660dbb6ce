//! The component columns of a table, iterated side by side and split into chunks of rows.

use bevy::ecs::change_detection::{ContiguousMut, ContiguousRef, Tick};
use core::{
    iter::{Zip, from_fn},
    slice::{Iter, IterMut},
};

/// The columns of a table that a query reads. Mutable components bypass change detection, so that
/// `Changed` means a write from outside the tick.
pub(crate) trait Columns: Sized {
    /// Some rows, one after the other.
    type Part: Iterator + Send;
    /// How many rows there are.
    fn rows(&self) -> usize;
    /// All rows in parts of `rows`; the last part has the remainder.
    fn parts(self, rows: usize) -> impl Iterator<Item = Self::Part>;
}

impl<'a, T: Sync> Columns for &'a [T] {
    type Part = Iter<'a, T>;

    fn rows(&self) -> usize {
        self.len()
    }

    fn parts(self, rows: usize) -> impl Iterator<Item = Self::Part> {
        self.chunks(rows).map(<[T]>::iter)
    }
}

impl<'a, T: Send> Columns for ContiguousMut<'a, T> {
    type Part = IterMut<'a, T>;

    fn rows(&self) -> usize {
        self.as_ref().len()
    }

    fn parts(self, rows: usize) -> impl Iterator<Item = Self::Part> {
        let (values, _) = ContiguousMut::bypass_change_detection_split(self);
        values.chunks_mut(rows).map(<[T]>::iter_mut)
    }
}

impl<'a, T: Sync> Columns for ContiguousRef<'a, T> {
    type Part = Watched<'a, T>;

    fn rows(&self) -> usize {
        self.len()
    }

    fn parts(self, rows: usize) -> impl Iterator<Item = Self::Part> {
        let (last_run, this_run) = (self.last_run_tick(), self.this_run_tick());
        let changed = self.changed_ticks_slice().chunks(rows);
        let values = self.into_inner().chunks(rows);
        values.zip(changed).map(move |(values, changed)| Watched {
            rows: values.iter().zip(changed),
            last_run,
            this_run,
        })
    }
}

/// Components with whether they have changed since the system last ran.
pub(crate) struct Watched<'a, T> {
    rows: Zip<Iter<'a, T>, Iter<'a, Tick>>,
    last_run: Tick,
    this_run: Tick,
}

impl<'a, T> Iterator for Watched<'a, T> {
    type Item = (&'a T, bool);

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        let (value, changed) = self.rows.next()?;
        Some((value, changed.is_newer_than(self.last_run, self.this_run)))
    }
}

impl<C: Columns> Columns for Option<C> {
    type Part = Optional<C::Part>;

    fn rows(&self) -> usize {
        self.as_ref().map_or(0, C::rows)
    }

    fn parts(self, rows: usize) -> impl Iterator<Item = Self::Part> {
        let mut parts = self.map(|columns| columns.parts(rows));
        from_fn(move || match &mut parts {
            Some(parts) => parts.next().map(|part| Optional(Some(part))),
            None => Some(Optional(None)),
        })
    }
}

/// A component that all rows have, or none: then it yields `None` for every row.
pub(crate) struct Optional<I>(Option<I>);

impl<I: Iterator> Iterator for Optional<I> {
    type Item = Option<I::Item>;

    #[inline]
    fn next(&mut self) -> Option<Self::Item> {
        match &mut self.0 {
            Some(rows) => rows.next().map(Some),
            None => Some(None),
        }
    }
}

/// Components side by side.
pub(crate) struct SideBySide<T>(T);

macro_rules! side_by_side {
    ($($column:ident),+) => {
        #[allow(non_snake_case)]
        impl<$($column: Columns),+> Columns for ($($column,)+) {
            type Part = SideBySide<($($column::Part,)+)>;

            fn rows(&self) -> usize {
                self.0.rows()
            }

            fn parts(self, rows: usize) -> impl Iterator<Item = Self::Part> {
                let ($($column,)+) = self;
                $(let mut $column = $column.parts(rows);)+
                from_fn(move || Some(SideBySide(($($column.next()?,)+))))
            }
        }

        #[allow(non_snake_case)]
        impl<$($column: Iterator),+> Iterator for SideBySide<($($column,)+)> {
            type Item = ($($column::Item,)+);

            #[inline]
            fn next(&mut self) -> Option<Self::Item> {
                let ($($column,)+) = &mut self.0;
                Some(($($column.next()?,)+))
            }
        }
    };
}

side_by_side!(A, B);
side_by_side!(A, B, C);
side_by_side!(A, B, C, D);
side_by_side!(A, B, C, D, E);
side_by_side!(A, B, C, D, E, F);
side_by_side!(A, B, C, D, E, F, G);
side_by_side!(A, B, C, D, E, F, G, H);

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::prelude::*;

    #[derive(Component)]
    struct Number(u32);

    #[derive(Component)]
    struct Twice(u32);

    #[derive(Component)]
    struct Odd;

    #[test]
    fn parts_have_every_row_once_with_its_own_components() {
        let mut world = World::new();
        for i in 0..100 {
            let mut entity = world.spawn((Number(i), Twice(0)));
            if i % 2 == 1 {
                entity.insert(Odd);
            }
        }
        let mut numbers = world.query::<(Entity, Ref<Number>, &mut Twice, Option<&Odd>)>();
        let mut query = numbers.query_mut(&mut world);
        let mut parts = Vec::new();
        for table in query.contiguous_iter_mut().unwrap() {
            assert_eq!(table.rows(), 50);
            parts.extend(table.parts(16).map(Iterator::collect::<Vec<_>>));
        }
        assert_eq!(parts.iter().map(Vec::len).collect::<Vec<_>>(), [16, 16, 16, 2, 16, 16, 16, 2]);
        for (_, (number, is_changed), twice, odd) in parts.iter_mut().flatten() {
            assert!(*is_changed, "they are new");
            assert_eq!(odd.is_some(), number.0 % 2 == 1);
            twice.0 = 2 * number.0;
        }
        drop(parts);
        let sum: u32 = world.query::<&Twice>().iter(&world).map(|twice| twice.0).sum();
        assert_eq!(sum, 9900);
    }
}
