//! Whether a game has written to strands on the GPU.

use crate::{
    hair::strand::{OnGpu, Strand, StrandOf},
    keratin::bond::Bonds,
    water::Moisture,
};
use bevy::{
    ecs::{
        change_detection::Tick,
        entity::EntityHashSet,
        system::{SystemChangeTick, SystemParam},
    },
    prelude::*,
};

/// Strands that are looked at in a tick: all of them, were it many, would cost more than all else of hair
/// on the GPU.
const AT_ONCE: usize = 16_384;

/// Strands that are looked at together before any is looked at by itself.
const CHUNK: usize = 256;

/// Finds writes to strands on the GPU, of which the tick itself makes none that count as changes: those of
/// [`AT_ONCE`] strands in each call, in turn.
#[derive(SystemParam)]
pub(super) struct WrittenStrands<'w, 's> {
    strands: Query<
        'w,
        's,
        (
            &'static StrandOf,
            Ref<'static, Strand>,
            Option<Ref<'static, Bonds>>,
            Option<Ref<'static, Moisture>>,
        ),
        With<OnGpu>,
    >,
    now: SystemChangeTick,
    turn: Local<'s, Turn>,
}

/// Where the next call begins, and when this round over all strands and the one before it began.
#[derive(Default)]
struct Turn {
    next: usize,
    began: Option<Tick>,
    before: Option<Tick>,
}

impl WrittenStrands<'_, '_> {
    /// The hair of strands that were written to after `since`, which is `None` of hair that is not on the
    /// GPU. Also when all strands have been found unwritten, if that is known.
    pub(super) fn find(
        &mut self,
        oldest: Tick,
        since: impl Fn(Entity) -> Option<Tick>,
    ) -> (EntityHashSet, Option<Tick>) {
        let mut written = EntityHashSet::default();
        let now = self.now.this_run();
        let Turn { next, began, before } = &mut *self.turn;
        began.get_or_insert(now);
        let (from, mut first) = (*next, 0);
        // Ticks count up and wrap around.
        let age = |tick: &Tick| now.get().wrapping_sub(tick.get());
        let most = age(&oldest);
        let Ok(tables) = self.strands.contiguous_iter() else { return (written, None) };
        for (of, strands, bonds, water) in tables {
            let (start, end) = (first, first + of.len());
            first = end;
            let columns = [
                Some(strands.changed_ticks_slice()),
                bonds.as_ref().map(|bonds| bonds.changed_ticks_slice()),
                water.as_ref().map(|water| water.changed_ticks_slice()),
            ];
            let rows = from.clamp(start, end) - start..(from + AT_ONCE).clamp(start, end) - start;
            for ticks in columns.into_iter().flatten() {
                let chunks = ticks[rows.clone()].chunks(CHUNK).zip(of[rows.clone()].chunks(CHUNK));
                for (ticks, of) in chunks {
                    // Without a branch, so that it is done by lanes.
                    let newest = ticks.iter().map(age).fold(u32::MAX, u32::min);
                    if newest < most {
                        let own = ticks.iter().zip(of).filter(|(tick, of)| {
                            since(of.0).is_some_and(|since| tick.is_newer_than(since, now))
                        });
                        written.extend(own.map(|(_, of)| of.0));
                    }
                }
            }
        }
        *next = from + AT_ONCE;
        if *next < first {
            return (written, None);
        }
        // A strand that changes places with one that has been looked at is looked at in the next round.
        let known = before.replace(began.take().unwrap_or(now));
        *next = 0;
        (written, known)
    }
}
