//! Rollback: the whole state of a hair at one tick, taken and put back by a system, so that ticks that are run again
//! give the same bits.
//!
//! A [`HairSnapshot`] holds one hair, a [`HairWorldSnapshot`] what the hairs of a world share: droplets and the balance
//! of water, how far the wind has travelled, where colliders and tools were. [`HairSnapshots`] takes both and puts them
//! back. Other hair may go on beside hair that is rolled back. What is saved with a game is a
//! [`Hairdo`](crate::hairdo::save::Hairdo): that survives another version and another groom.
//!
//! A snapshot does not hold what a game itself sets: transforms, settings, colliders, and which strands are wound or
//! tied. Put these back first.
//!
//! Ticks have to run where they are counted, with [`HairPlugins::new`](crate::HairPlugins::new) in a fixed schedule or
//! that of the rollback. By default the ticks of a frame run at its end: a snapshot between them is refused. Heads have to
//! be moved by these ticks, not from frame to frame.
//!
//! | file | what |
//! |---|---|
//! | `hair` | a hair, its strands, and their fields |
//! | `shared` | what all hair shares |
//! | `framed` | snapshots as bytes |
//! | `error` | why hair cannot be taken or put back |

mod error;
mod framed;
mod hair;
mod shared;

pub use error::SnapshotError;
pub use hair::HairSnapshot;
pub use shared::HairWorldSnapshot;

use crate::{
    base::{motion::WorldMotion, schedule::NotedTicks},
    hair::{strand::Hair, worn::HairsOf},
    simulation::sleep::RestSettings,
};
use bevy::{ecs::system::SystemParam, prelude::*};
use hair::{HairState, StrandState};
use shared::SharedState;

/// Registers snapshots, which work without it.
#[derive(Clone, Copy, Debug, Default)]
pub struct RollbackPlugin;

impl Plugin for RollbackPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<HairSnapshot>()
            .register_type::<HairWorldSnapshot>()
            .register_type::<SnapshotError>();
    }
}

/// Takes snapshots of hair and puts them back, within a tick: a parameter of a system.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// /// The states of the last ticks, and the tick that is to be run again.
/// #[derive(Resource)]
/// struct Past {
///     ticks: Vec<(HairSnapshot, HairWorldSnapshot)>,
///     back_to: Option<usize>,
/// }
///
/// fn roll_back(
///     characters: Query<Entity, With<WornHair>>,
///     mut past: ResMut<Past>,
///     mut hair: HairSnapshots,
/// ) -> Result {
///     for character in &characters {
///         if let Some(tick) = past.back_to.take() {
///             let (own, world) = &past.ticks[tick];
///             hair.restore(character, own)?;
///             hair.restore_world(world)?;
///             past.ticks.truncate(tick);
///         }
///         // into a value that is reused, nothing is allocated
///         let (mut own, mut world) = default();
///         hair.take(character, &mut own)?;
///         hair.take_world(&mut world)?;
///         past.ticks.push((own, world));
///     }
///     Ok(())
/// }
/// # let mut app = App::new();
/// # app.add_systems(FixedUpdate, roll_back);
/// ```
#[derive(SystemParam)]
pub struct HairSnapshots<'w, 's> {
    hairs: Query<'w, 's, HairState, With<Hair>>,
    strands: Query<'w, 's, StrandState>,
    of: HairsOf<'w, 's>,
    settings: RestSettings<'w, 's>,
    motion: ResMut<'w, WorldMotion>,
    noted: Res<'w, NotedTicks>,
    shared: SharedState<'w, 's>,
}

impl HairSnapshots<'_, '_> {
    /// Takes the state of a [`Hair`], or of the one that an entity wears, into a `snapshot` whose memory is reused.
    ///
    /// # Errors
    /// When it is no hair and wears none or several, when it is simulated on the GPU, still settles, or has strands that
    /// follow guides, or ticks wait for the end of the frame. The snapshot is then empty.
    pub fn take(&mut self, hair: Entity, snapshot: &mut HairSnapshot) -> Result<(), SnapshotError> {
        snapshot.clear();
        let hair = self.the_hair(hair)?;
        let conditions = self.settings.of(hair);
        let tick = self.motion.moment();
        let state = self.hairs.get_mut(hair).map_err(|_| SnapshotError::NoHair { entity: hair })?;
        snapshot.take(state, &mut self.strands, conditions, tick)
    }

    /// Puts a snapshot back on a [`Hair`] of as many strands of as many nodes, or on the one that an entity wears.
    /// Settings and transforms count as they are then: put them back before. Where the water of the world is not put back
    /// with it, the next tick balances it.
    ///
    /// # Errors
    /// As [`take`](Self::take), and when the snapshot is of other strands. The hair then stays as it is.
    pub fn restore(&mut self, hair: Entity, snapshot: &HairSnapshot) -> Result<(), SnapshotError> {
        let hair = self.the_hair(hair)?;
        let conditions = self.settings.of(hair);
        let tick = self.motion.moment();
        let state = self.hairs.get_mut(hair).map_err(|_| SnapshotError::NoHair { entity: hair })?;
        snapshot.restore(state, &mut self.strands, conditions, tick)?;
        self.shared.hair_was_restored();
        Ok(())
    }

    /// Takes what all hair shares into a `snapshot` whose memory is reused.
    ///
    /// # Errors
    /// When ticks wait for the end of the frame. The snapshot is then empty.
    pub fn take_world(&mut self, snapshot: &mut HairWorldSnapshot) -> Result<(), SnapshotError> {
        snapshot.clear();
        self.check_ticks()?;
        snapshot.take(&mut self.shared, &mut self.motion);
        Ok(())
    }

    /// Puts back what all hair shares. Droplets that are missing are spawned, those too many despawned, by commands.
    ///
    /// # Errors
    /// When ticks wait for the end of the frame.
    pub fn restore_world(&mut self, snapshot: &HairWorldSnapshot) -> Result<(), SnapshotError> {
        self.check_ticks()?;
        snapshot.restore(&mut self.shared, &mut self.motion);
        Ok(())
    }

    fn check_ticks(&self) -> Result<(), SnapshotError> {
        match self.noted.waiting() {
            0 => Ok(()),
            ticks => Err(SnapshotError::TicksWait { ticks }),
        }
    }

    fn the_hair(&self, entity: Entity) -> Result<Entity, SnapshotError> {
        self.check_ticks()?;
        match self.of.of(&entity) {
            [hair] if self.hairs.contains(*hair) => Ok(*hair),
            [_] => Err(SnapshotError::NoHair { entity }),
            several => Err(SnapshotError::SeveralHairs { entity, hairs: several.to_vec() }),
        }
    }
}
