//! Caches of files.

#[cfg(feature = "usd")]
use super::usd;
use super::{Groom, GroomCache, GroomCacheError, GroomFormat, GroomLosses, GroomSettings, alembic};
use bevy::{
    asset::{AssetLoader, LoadContext, io::Reader},
    prelude::*,
};

/// A cache may take so many times as much memory as its file, and this more (bytes).
const TIMES: u64 = 16;
const ANYWAY: u64 = 1 << 20;

/// Loads a [`GroomCache`] from `.abc` and (feature `usd`) USD files, and files of one frame from all others that
/// [`GroomLoader`](crate::authoring::groom::GroomLoader) knows, but glTF with buffers of its own.
///
/// It registers no extension: name the type, as in `assets.load::<GroomCache>("run.abc")`.
#[derive(TypePath, Clone, Copy, Debug, Default)]
pub struct GroomCacheLoader;

impl AssetLoader for GroomCacheLoader {
    type Asset = GroomCache;
    type Settings = GroomSettings;
    type Error = BevyError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &GroomSettings,
        context: &mut LoadContext<'_>,
    ) -> Result<GroomCache, BevyError> {
        let mut file = Vec::new();
        reader.read_to_end(&mut file).await?;
        let (cache, losses) = GroomCache::from_file(&file, settings)?;
        let (path, frames, strands) = (context.path(), cache.len(), cache.groom().len());
        tracing::info!(
            "groom cache {path}: {frames} frames of {strands} strands, {} s",
            cache.duration()
        );
        if !losses.is_empty() {
            tracing::info!("groom cache {path}: {losses}");
        }
        Ok(cache)
    }
}

impl GroomCache {
    /// A cache of the bytes of an animated `.abc` or (feature `usd`) USD file, and what was left out. Which strands stay
    /// and which end of each is its root is decided in the first frame; nodes are not merged, so strands keep theirs in
    /// all. Any other file that
    /// [`Groom::from_file`] reads is a cache of a single frame.
    ///
    /// # Errors
    /// As [`Groom::from_file`], and when frames differ in their nodes, times do not ascend, a node is not finite, or the
    /// cache would take more memory than sixteen times the file's size and 1 MB.
    pub fn from_file(
        file: &[u8],
        settings: &GroomSettings,
    ) -> Result<(Self, GroomLosses), GroomCacheError> {
        let format = GroomFormat::of(file)?;
        let mut intake = match format {
            GroomFormat::Alembic => alembic::intake(file)?,
            #[cfg(feature = "usd")]
            GroomFormat::Usd => usd::intake(file)?,
            _ => {
                let (groom, losses) = Groom::from_file(file, settings)?;
                let points = groom.points().to_vec();
                return Ok((Self::new(groom, [(0.0, points)])?, losses));
            }
        };
        intake.losses.unread_samples = default();
        settings.choose(&mut intake)?;
        // Without merging, which would go by the frame.
        let space = settings.scale_and_up_of(&intake, format);
        let place = |groom| settings.resample(settings.place(groom, space)?);
        let groom = place(intake.groom.clone())?;
        let nodes = groom.points().len();
        let most = (file.len() as u64).saturating_mul(TIMES).saturating_add(ANYWAY);
        let mut frames = Vec::new();
        let take = |count: u64, time, raw: Groom| {
            let frame = frames.len();
            if count.saturating_mul(12 * nodes as u64) > most {
                let (frames, most) = (count as usize, (most >> 20) as usize);
                return Err(GroomCacheError::TooLarge { frames, nodes, most });
            }
            if raw.len() != intake.all() {
                let (what, found, expected) = ("strands", raw.len(), intake.all());
                return Err(GroomCacheError::Differs { frame, what, found, expected });
            }
            let raw = intake.same_of(raw);
            if let Some(node) = raw.points().iter().position(|p| !p.is_finite()) {
                return Err(GroomCacheError::NonFinite { frame, node });
            }
            frames.push((time, place(raw)?.points().to_vec()));
            Ok(())
        };
        match format {
            #[cfg(feature = "usd")]
            GroomFormat::Usd => usd::each_frame(file, take)?,
            _ => alembic::each_frame(file, take)?,
        }
        Ok((Self::new(groom, frames)?, intake.losses))
    }
}
