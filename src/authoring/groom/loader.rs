//! Grooms as assets.

#[cfg(feature = "usd")]
use super::usd;
use super::{
    BonesFile, Groom, GroomCacheLoader, GroomError, GroomFileError, GroomFormat, GroomGroup,
    GroomLoss, GroomLosses, GroomPlace, GroomSettings, OddSize, RootBones, RootEnd, StrandBones,
    UpAxis, alembic, cache, gltf, grown_hair, intake::Intake, ply, salon, tressfx, yuksel,
};
use bevy::{
    asset::{
        AssetLoader, AssetPath, LoadContext, ReadAssetBytesError,
        io::{AssetReaderError, Reader},
    },
    platform::collections::HashMap,
    prelude::*,
};
use percent_encoding::percent_decode_str;

/// Why loading a groom failed.
#[derive(thiserror::Error, Debug)]
pub enum GroomLoadError {
    /// The file could not be read from its source.
    #[error("the file cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// A buffer of a glTF file that is a file of its own.
    #[error("the buffer {uri} cannot be read: {source}; put it next to the .gltf")]
    Buffer {
        /// Its URI in the glTF.
        uri: String,
        /// Why not.
        source: Box<ReadAssetBytesError>,
    },
    /// The file of its bones that the settings name.
    #[error("the bones {path} cannot be read: {source}; correct GroomSettings::bones")]
    Bones {
        /// Its path.
        path: String,
        /// Why not.
        source: Box<ReadAssetBytesError>,
    },
    /// Its contents are in none of the formats, or broken.
    #[error(transparent)]
    File(#[from] GroomFileError),
}

/// Loads a [`Groom`] from `.hair`, `.tfx`, `.abc`, `.usd`, `.usda`, `.usdc`, `.usdz` (feature `usd`), `.ply`,
/// `.data`, `.gltf` and `.glb`, detected by their contents.
///
/// It does not register the last four extensions, so as not to replace Bevy's own glTF loader and loaders of
/// meshes: name the type, as in `assets.load::<Groom>("hair.glb")`. The unit and the axis used, and what is
/// left out of a file, are logged once.
#[derive(TypePath, Clone, Copy, Debug, Default)]
pub struct GroomLoader;

impl AssetLoader for GroomLoader {
    type Asset = Groom;
    type Settings = GroomSettings;
    type Error = GroomLoadError;

    async fn load(
        &self,
        reader: &mut dyn Reader,
        settings: &GroomSettings,
        context: &mut LoadContext<'_>,
    ) -> Result<Groom, GroomLoadError> {
        let mut file = Vec::new();
        reader.read_to_end(&mut file).await?;
        let mut external = HashMap::default();
        let format = GroomFormat::of(&file)?;
        if format == GroomFormat::Gltf {
            for uri in gltf::GltfFile::parse(&file)?.external() {
                let failed =
                    |source| GroomLoadError::Buffer { uri: uri.clone(), source: Box::new(source) };
                // Escapes that are not UTF-8 are taken literally.
                let name = percent_decode_str(&uri).decode_utf8().unwrap_or(uri.as_str().into());
                let path = context.path().resolve_embed_str(&name);
                let path = path.map_err(|_| {
                    let offset = 0;
                    let message = format!("{uri:?} is no path");
                    GroomFileError::Json { offset, message }
                })?;
                let bytes = context.read_asset_bytes(path).await.map_err(failed)?;
                external.insert(uri, bytes);
            }
        }
        let mut intake = intake(&file, format, &external)?;
        if let Some(bones) = read_bones(format, settings, context).await? {
            bind(&mut intake, &bones)?;
        }
        let (scale, up) = settings.scale_and_up_of(&intake, format);
        let (groom, losses) = settings.take(intake, format).map_err(GroomFileError::from)?;
        let (path, count) = (context.path(), groom.len());
        tracing::info!("groom {path}: {count} strands, {scale} m a unit, {up:?} up");
        if losses.is_broken() {
            tracing::warn!("groom {path}: {losses}: GroomSettings::strict refuses such files");
        } else if !losses.is_empty() {
            tracing::info!("groom {path}: {losses}");
        }
        // No warning of what the user has set.
        if let (None, Some(odd)) = (settings.scale, groom.odd_size(scale)) {
            tracing::warn!("groom {path}: {odd}: set GroomSettings::scale to {}", odd.scale);
        }
        if let (None, Some(odd)) = (settings.up, groom.odd_up(up)) {
            tracing::warn!(
                "groom {path}: with {up:?} up it lies on its side or stands on its head: set \
                 GroomSettings::up to {odd:?}, or to {up:?} if it is right"
            );
        }
        Ok(groom)
    }

    fn extensions(&self) -> &[&str] {
        const ALL: [&str; 7] = ["hair", "tfx", "abc", "usd", "usda", "usdc", "usdz"];
        if cfg!(feature = "usd") { &ALL } else { &ALL[..3] }
    }
}

impl Groom {
    /// A groom from the bytes of a `.hair`, `.tfx`, `.abc`, `.ply`, `.data`, GLB, self-contained glTF or, with the
    /// feature `usd`, USD file, in metres and Y up according to the settings, and what was left out.
    ///
    /// ```
    /// # use bevy_keratin::authoring::groom::*; use bevy::prelude::*;
    /// let lock = Groom::from_polylines([[Vec3::ZERO, Vec3::Z * 0.1]]).unwrap();
    /// let file = yuksel::write(&lock).unwrap();
    ///
    /// let settings = GroomSettings { scale: Some(2.0), nodes: Some(9), ..default() };
    /// let (groom, losses) = Groom::from_file(&file, &settings).unwrap();
    /// assert_eq!(groom.points()[8], Vec3::Y * 0.2); // .hair files have Z up
    /// assert!(losses.is_empty());
    /// ```
    ///
    /// # Errors
    /// When the bytes are none of these or broken, or the settings out of range; where single strands are
    /// broken, only if the settings are [`strict`](GroomSettings::strict).
    pub fn from_file(
        file: &[u8],
        settings: &GroomSettings,
    ) -> Result<(Self, GroomLosses), GroomFileError> {
        let format = GroomFormat::of(file)?;
        Ok(settings.take(intake(file, format, &HashMap::default())?, format)?)
    }

    /// The same with the bytes of a `.tfxbone`, whose bones its roots follow: [`Groom::bones`].
    ///
    /// # Errors
    /// As [`Groom::from_file`], and when the bones are broken or of more strands than the file has.
    pub fn from_file_with_bones(
        file: &[u8],
        bones: &[u8],
        settings: &GroomSettings,
    ) -> Result<(Self, GroomLosses), GroomFileError> {
        let format = GroomFormat::of(file)?;
        let mut intake = intake(file, format, &HashMap::default())?;
        bind(&mut intake, bones)?;
        Ok(settings.take(intake, format)?)
    }
}

impl GroomSettings {
    /// Metres per unit and the axis that is up, with which these settings read a file: their own, else what the file
    /// says, as USD does, else what is usual for its format.
    ///
    /// ```
    /// # use bevy_keratin::authoring::groom::*; use bevy::prelude::*;
    /// let file = yuksel::write(&Groom::from_polylines([[Vec3::ZERO, Vec3::Y]]).unwrap()).unwrap();
    /// assert_eq!(GroomSettings::default().scale_and_up_in(&file), Ok((0.00254, UpAxis::Z)));
    /// ```
    ///
    /// # Errors
    /// When the file is in none of the formats, or broken where it says them.
    pub fn scale_and_up_in(&self, file: &[u8]) -> Result<(f32, UpAxis), GroomFileError> {
        let format = GroomFormat::of(file)?;
        let mut intake = Intake::default();
        (intake.scale, intake.up) = match format {
            #[cfg(feature = "usd")]
            GroomFormat::Usd => usd::unit_and_up(file)?,
            #[cfg(not(feature = "usd"))]
            GroomFormat::Usd => return Err(GroomFileError::UsdIsOff),
            _ => (None, None),
        };
        Ok(self.scale_and_up_of(&intake, format))
    }
}

fn intake(
    file: &[u8],
    format: GroomFormat,
    external: &HashMap<String, Vec<u8>>,
) -> Result<Intake, GroomFileError> {
    match format {
        GroomFormat::Yuksel => yuksel::intake(file),
        GroomFormat::TressFx3 | GroomFormat::TressFx4 => tressfx::intake(file),
        GroomFormat::Alembic => alembic::intake(file),
        GroomFormat::Ply => ply::intake(file),
        GroomFormat::Salon => salon::intake(file),
        GroomFormat::Gltf => gltf::GltfFile::parse(file)?.intake(external),
        #[cfg(feature = "usd")]
        GroomFormat::Usd => usd::intake(file),
        #[cfg(not(feature = "usd"))]
        GroomFormat::Usd => Err(GroomFileError::UsdIsOff),
    }
}

/// Binds the roots to the bones of a `.tfxbone`.
fn bind(intake: &mut Intake, file: &[u8]) -> Result<(), GroomFileError> {
    let read = tressfx::bones_of(file, intake.all() as u64);
    let (bones, losses) = read.map_err(|why| GroomFileError::Bones(Box::new(why)))?;
    intake.bind(bones, losses);
    Ok(())
}

/// The file of the bones that the settings want; `None` if there is none beside the groom.
async fn read_bones(
    format: GroomFormat,
    settings: &GroomSettings,
    context: &mut LoadContext<'_>,
) -> Result<Option<Vec<u8>>, GroomLoadError> {
    let groom = context.path();
    let is_tressfx = matches!(format, GroomFormat::TressFx3 | GroomFormat::TressFx4);
    let path = match &settings.bones {
        BonesFile::Beside if is_tressfx => {
            let beside = groom.path().with_extension("tfxbone");
            AssetPath::from_path_buf(beside).with_source(groom.source().clone_owned())
        }
        BonesFile::Beside | BonesFile::Unused => return Ok(None),
        BonesFile::Named(name) => groom.resolve_embed(&AssetPath::from_path(name.as_ref())),
    };
    match context.read_asset_bytes(path.clone()).await {
        Ok(bytes) => Ok(Some(bytes)),
        Err(ReadAssetBytesError::AssetReaderError(AssetReaderError::NotFound(_)))
            if settings.bones == BonesFile::Beside =>
        {
            Ok(None)
        }
        Err(source) => {
            Err(GroomLoadError::Bones { path: path.to_string(), source: Box::new(source) })
        }
    }
}

/// Grooms: as assets where there is an [`AssetServer`], and worn by hair. Part of
/// [`HairPlugins`](crate::HairPlugins), which may be added before or after `DefaultPlugins`.
#[derive(Clone, Copy, Debug, Default)]
pub struct GroomPlugin;

impl Plugin for GroomPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Groom>()
            .register_type::<GroomSettings>()
            .register_type::<GroomFormat>()
            .register_type::<GroomLosses>()
            .register_type::<GroomLoss>()
            .register_type::<GroomPlace>()
            .register_type::<RootEnd>()
            .register_type::<RootBones>()
            .register_type::<StrandBones>()
            .register_type::<BonesFile>()
            .register_type::<GroomError>()
            .register_type::<GroomGroup>()
            .register_type::<OddSize>();
        grown_hair::build(app);
        cache::build(app);
        add_loader(app);
    }

    /// Again, for an asset server that was added later.
    fn finish(&self, app: &mut App) {
        add_loader(app);
    }
}

fn add_loader(app: &mut App) {
    let world = app.world();
    if world.contains_resource::<AssetServer>() && !world.contains_resource::<Assets<Groom>>() {
        app.init_asset::<Groom>().register_asset_loader(GroomLoader);
        cache::with_assets(app);
        app.register_asset_loader(GroomCacheLoader);
        grown_hair::with_assets(app);
    }
}
