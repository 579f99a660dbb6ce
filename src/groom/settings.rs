//! How a file's groom becomes one in metres with Y up.

use super::{Groom, GroomError, GroomFormat, GroomLosses, UpAxis};
use crate::setting::{Ranged, setting};
use bevy::prelude::*;

setting! {
    /// How a groom is taken from a file: unit, axes, and how much of it. Settings of the
    /// [`GroomLoader`](super::GroomLoader), also in `.meta` files; or apply them in game code.
    ///
    /// ```no_run
    /// # use bevy_keratin::groom::*; use bevy::prelude::*;
    /// fn load(assets: Res<AssetServer>) -> Handle<Groom> {
    ///     assets
    ///         .load_builder()
    ///         .with_settings(|s: &mut GroomSettings| {
    ///             s.scale = Some(0.01); // the file is in centimetres
    ///             s.up = Some(UpAxis::Z);
    ///         })
    ///         .load("hair/bob.hair")
    /// }
    /// ```
    ///
    /// Files do not know their unit; the defaults are what most of them are in:
    ///
    /// | file | scale | up |
    /// |---|---|---|
    /// | `.hair` | 0.00254 (tenths of an inch) | Z |
    /// | `.tfx` | 1 | Y |
    /// | glTF | 1 | Y |
    #[derive(Reflect, Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    #[serde(default)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct GroomSettings {
        /// Metres per unit of the file; `None` is what the table says.
        pub scale: Option<f32> = None, in SCALE: 1e-9..=1e9, "0.01 takes centimetres to metres";
        /// The file's axis that points up; `None` is what the table says.
        pub up: Option<UpAxis> = None;
        /// The place that becomes the groom's origin, such as the head's centre: in metres, Y up.
        /// Zero is the file's own.
        pub origin: Vec3 = Vec3::ZERO;
        /// Segments shorter than this are merged and strands shorter than this left out. Strands of
        /// the simulation need more than 1e-6.
        pub merge: f32 = 1e-5, "m" in MERGE: 0.0..=1e6, safe 2e-6..=1e-3,
            "1e-5 takes away what has no length";
        /// Resamples every strand to so many nodes, evenly along it; `None` is as in the file.
        pub nodes: Option<usize> = None, in NODES: 2.0..=4096.0, "16 suit hair of a head";
        /// Keeps every so-manieth strand; 1 keeps all.
        pub keep_every: usize = 1, in KEEP_EVERY: 1.0..=1e9, "1 keeps all";
        /// Keeps at most so many strands, taken evenly from their order; `None` keeps all.
        pub limit: Option<usize> = None;
    }
}

impl GroomSettings {
    /// Applies these settings to a groom as read from a file of this format, and counts what is left
    /// out: fewer strands first, then scale and axes, then merging, then resampling.
    ///
    /// # Errors
    /// When a setting is out of range, or scaled nodes leave the finite numbers.
    pub fn apply(
        &self,
        groom: Groom,
        format: GroomFormat,
    ) -> Result<(Groom, GroomLosses), GroomError> {
        self.clone().checked()?;
        let mut groom = groom;
        let before = groom.len();
        if self.keep_every != 1 {
            groom = groom.thinned(self.keep_every)?;
        }
        if let Some(limit) = self.limit
            && limit < groom.len()
        {
            groom = groom.limited(limit);
        }
        let thinned_strands = before - groom.len();
        let groom = groom
            .with_up(self.up.unwrap_or(format.up()))
            .scaled(self.scale.unwrap_or(format.scale()))?
            .moved(-self.origin)?;
        let (mut groom, mut losses) = groom.merged(self.merge)?;
        losses.thinned_strands = thinned_strands;
        if let Some(nodes) = self.nodes {
            groom = groom.resampled(nodes)?;
        }
        Ok((groom, losses))
    }
}
