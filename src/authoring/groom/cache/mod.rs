//! Grooms that move: hair recorded while it is simulated, or animated in a file, and played back.
//!
//! `record` records hair tick by tick, `play` moves hair by a cache in place of the tick.

mod error;
mod motion;
mod play;
mod record;

pub use error::GroomCacheError;
pub use motion::GroomCache;
pub use play::PlayGroomCache;
pub use record::RecordGroomCache;

use bevy::prelude::*;

pub(super) fn build(app: &mut App) {
    app.register_type::<GroomCache>();
    record::build(app);
    play::build(app);
}

/// Needs assets.
pub(super) fn with_assets(app: &mut App) {
    app.init_asset::<GroomCache>();
    play::with_assets(app);
}
