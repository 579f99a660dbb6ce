//! Import settings: unit, axes and thinning.

use super::{
    BonesFile, Groom, GroomError, GroomFormat, GroomLosses, RootEnd, UpAxis,
    intake::{Intake, evenly},
};
use crate::base::setting::{Ranged, setting};
use bevy::prelude::*;

setting! {
    /// How a groom is taken from a file: unit, axes, and how much of it. Settings of the
    /// [`GroomLoader`](super::GroomLoader), also in `.meta` files; or apply them in game code.
    ///
    /// ```no_run
    /// # use bevy_keratin::authoring::groom::*; use bevy::prelude::*;
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
    /// Files other than glTF and USD do not specify their unit; the defaults are those of the formats' own
    /// samples. The unit used is logged, with a warning and a better scale if the size is implausible for
    /// hair: see [`Groom::odd_size`]; and likewise the axis: see [`Groom::odd_up`].
    ///
    /// What is broken in a file is left out, counted in [`GroomLosses`] and logged once with the numbers of
    /// strands and nodes; or refused, if [`strict`](Self::strict).
    ///
    /// | file | metres per unit | up |
    /// |---|---|---|
    /// | `.hair` | 0.00254 (tenths of an inch) | Z |
    /// | `.tfx`, version 3 | 0.01 (centimetres) | Y |
    /// | `.tfx`, version 4 | 1 | Y |
    /// | glTF | 1 | Y |
    /// | Alembic | 1, as Blender writes it; Maya's and Unreal Engine's are in centimetres: 0.01 | Y |
    /// | USD | as the file says, else 0.01 | as the file says, else Y |
    /// | `.ply`, `.data` | 1 | Y |
    #[derive(Reflect, Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
    #[serde(default)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct GroomSettings {
        /// Metres per unit of the file; `None` is what the table says.
        pub scale: Option<f32> = None, in SCALE: 1e-9..=1e9, "0.01 takes centimetres to metres";
        /// The file's axis that points up; `None` is what the table says.
        pub up: Option<UpAxis> = None;
        /// Which end of a strand is its root.
        pub roots: RootEnd = RootEnd::Found;
        /// Where the bones of the roots are, which the roots of [`GroomedHair`](super::GroomedHair) follow.
        pub bones: BonesFile = BonesFile::Beside;
        /// Refuses a file if anything of it had to be left out because it is broken: see
        /// [`GroomLosses::is_broken`]. The error tells what `false` would leave out.
        pub strict: bool = false;
        /// Keeps strands that lie apart from all others, which are else left out: see
        /// [`GroomLosses::far_strands`] and [`GroomLosses::stray_strands`].
        pub keep_strays: bool = false;
        /// The place that becomes the groom's origin, such as the head's centre: in metres, Y up.
        /// Zero is the file's own.
        pub origin: Vec3 = Vec3::ZERO;
        /// Segments shorter than this are merged and strands shorter than this left out. Strands of
        /// the simulation need more than 1e-6.
        pub shortest_segment: f32 = 1e-5, "m" in SHORTEST_SEGMENT: 0.0..=1e6, safe 2e-6..=1e-3,
            "1e-5 removes what has no length";
        /// Resamples every strand to this many nodes, evenly spaced; `None` is as in the file.
        pub nodes: Option<usize> = None, in NODES: 2.0..=4096.0, "16 suit hair of a head";
        /// Keeps every n-th strand; 1 keeps all.
        pub keep_every: usize = 1, in KEEP_EVERY: 1.0..=1e9, "1 keeps all";
        /// Keeps at most this many strands, an evenly spaced subset; `None` keeps all.
        pub limit: Option<usize> = None, in LIMIT: 1.0..=1e9, "None keeps all";
    }
}

impl GroomSettings {
    /// Applies these settings to a groom as read from a file of this format, and counts what is left
    /// out: strays first, then roots are found, then fewer strands, then scale and axes, then merging, then
    /// resampling.
    ///
    /// # Errors
    /// When a setting is out of range, scaled nodes become non-finite, or no strand is left.
    pub fn apply(
        &self,
        groom: Groom,
        format: GroomFormat,
    ) -> Result<(Groom, GroomLosses), GroomError> {
        self.take(Intake::of(groom)?, format)
    }

    /// The same with what was left out before.
    pub(super) fn take(
        &self,
        mut intake: Intake,
        format: GroomFormat,
    ) -> Result<(Groom, GroomLosses), GroomError> {
        self.choose(&mut intake)?;
        let space = self.scale_and_up_of(&intake, format);
        let mut groom = self.place(core::mem::take(&mut intake.groom), space)?;
        if !groom.is_merged(self.shortest_segment) {
            let (merged, losses) = groom.merged(self.shortest_segment)?;
            intake.add(losses);
            groom = merged;
        }
        if groom.is_empty() {
            return Err(GroomError::AllLeftOut { losses: intake.losses.to_string() });
        }
        Ok((self.resample(groom)?, intake.losses))
    }

    /// Leaves out strays and strands that are not asked for, and finds roots.
    pub(super) fn choose(&self, intake: &mut Intake) -> Result<(), GroomError> {
        self.clone().checked()?;
        if !self.keep_strays {
            intake.leave_out_strays();
        }
        if self.strict {
            intake.losses.refuse_broken()?;
        }
        intake.turn(self.roots);
        let all = intake.groom.len();
        let limit = self.limit.unwrap_or(usize::MAX);
        intake.keep(evenly((0..all).step_by(self.keep_every).collect(), limit));
        intake.losses.thinned_strands.count += all - intake.groom.len();
        Ok(())
    }

    /// Brings a groom to metres, Y up, and its origin.
    pub(super) fn place(
        &self,
        groom: Groom,
        (scale, up): (f32, UpAxis),
    ) -> Result<Groom, GroomError> {
        let groom = groom.with_up(up).scaled(scale)?;
        if self.origin == Vec3::ZERO { Ok(groom) } else { groom.moved(-self.origin) }
    }

    pub(super) fn resample(&self, groom: Groom) -> Result<Groom, GroomError> {
        match self.nodes {
            Some(nodes) => groom.resampled(nodes),
            None => Ok(groom),
        }
    }

    /// Metres per unit and the axis that is up: of the settings, else of the file, else of its format.
    pub(super) fn scale_and_up_of(&self, intake: &Intake, format: GroomFormat) -> (f32, UpAxis) {
        let scale = self.scale.or(intake.scale).unwrap_or(format.scale());
        (scale, self.up.or(intake.up).unwrap_or(format.up()))
    }

    /// Metres per unit of a file of this format; one of USD may say another.
    pub fn scale_of(&self, format: GroomFormat) -> f32 {
        self.scale.unwrap_or(format.scale())
    }

    /// The axis that is up in a file of this format; one of USD may say another.
    pub fn up_of(&self, format: GroomFormat) -> UpAxis {
        self.up.unwrap_or(format.up())
    }
}
