//! Maps: properties that vary over the mesh.

use super::error::PlantError;
use bevy::prelude::*;

/// A place on a mesh, the input of maps.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct RootPlace {
    /// Where it is (m), in the mesh's space.
    pub position: Vec3,
    /// Unit normal, outward.
    pub normal: Vec3,
    /// Texture coordinates, if the mesh has them.
    pub uv: Option<Vec2>,
    /// Vertex colour, if the mesh has one, red to alpha.
    pub color: Option<Vec4>,
}

type Map<'a, T> = Option<&'a dyn Fn(&RootPlace) -> T>;

/// Properties that vary over the mesh: functions of a [`RootPlace`], each optional. Masks painted as
/// [`vertex_color`] or as an [`ImageMap`] are such functions.
///
/// ```
/// # use bevy_keratin::authoring::plant::*; use bevy::prelude::*;
/// let painted = vertex_color(MapChannel::Red);
/// let shorter_behind = |place: &RootPlace| if place.position.z < 0.0 { 0.5 } else { 1.0 };
/// let maps = PlantingMaps::new().density(&painted).length(&shorter_behind);
/// ```
#[derive(Clone, Copy, Default)]
pub struct PlantingMaps<'a> {
    density: Map<'a, f32>,
    length: Map<'a, f32>,
    direction: Map<'a, Vec3>,
}

impl<'a> PlantingMaps<'a> {
    /// No maps: the same everywhere.
    pub fn new() -> Self {
        Self::default()
    }

    /// Shares of [`Planting::density`](super::Planting::density), 0…1; values outside are clamped, NaN
    /// counts as 0.
    pub fn density(mut self, map: &'a dyn Fn(&RootPlace) -> f32) -> Self {
        self.density = Some(map);
        self
    }

    /// Shares of [`Planting::length`](super::Planting::length), 0…1 as well. Places with 0 stay bald.
    pub fn length(mut self, map: &'a dyn Fn(&RootPlace) -> f32) -> Self {
        self.length = Some(map);
        self
    }

    /// The direction in which strands are combed, in place of
    /// [`Planting::comb`](super::Planting::comb). Only the component along the surface counts;
    /// where that is zero, strands stand upright.
    pub fn direction(mut self, map: &'a dyn Fn(&RootPlace) -> Vec3) -> Self {
        self.direction = Some(map);
        self
    }

    pub(super) fn density_at(&self, place: &RootPlace) -> f32 {
        clamped_share(self.density, place)
    }

    pub(super) fn length_at(&self, place: &RootPlace) -> f32 {
        clamped_share(self.length, place)
    }

    pub(super) fn direction_at(&self, place: &RootPlace) -> Option<Vec3> {
        self.direction.map(|map| map(place))
    }
}

fn clamped_share(map: Map<'_, f32>, place: &RootPlace) -> f32 {
    let share = map.map_or(1.0, |map| map(place));
    if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
}

/// One of the four numbers of a colour.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub enum MapChannel {
    /// Red, also the value of a grey image.
    #[default]
    Red,
    /// Green.
    Green,
    /// Blue.
    Blue,
    /// Alpha.
    Alpha,
}

/// A mask painted as vertex colours: that channel; 0 where the mesh has no colours.
pub fn vertex_color(channel: MapChannel) -> impl Fn(&RootPlace) -> f32 {
    move |place| place.color.map_or(0.0, |color| color[channel as usize])
}

/// A mask painted on the mesh's texture: values 0…1 in rows from the top, sampled bilinearly at a
/// place's UV. UVs outside 0…1 repeat it.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct ImageMap {
    width: u32,
    values: Vec<f32>,
}

impl ImageMap {
    /// A map of `width` × `height` values, row after row from the top (v = 0).
    ///
    /// # Errors
    /// When there are not as many values, or none.
    pub fn new(width: u32, height: u32, values: Vec<f32>) -> Result<Self, PlantError> {
        let found = values.len();
        if found == 0 || found as u64 != u64::from(width) * u64::from(height) {
            return Err(PlantError::MapSize { found, width, height });
        }
        Ok(Self { width, values })
    }

    /// One channel of an image in sRGB brightness: a value of 128 of 255 gives 0.5.
    ///
    /// # Errors
    /// When the image's pixels cannot be read: it is compressed, or not in the main world.
    pub fn from_image(image: &Image, channel: MapChannel) -> Result<Self, PlantError> {
        let (width, height) = (image.width(), image.height());
        let mut values = Vec::new();
        for y in 0..height {
            for x in 0..width {
                let color = image
                    .get_color_at(x, y)
                    .map_err(|e| PlantError::Image { reason: e.to_string() })?;
                let painted = match color {
                    // Linear images are read as data, others as sRGB brightness.
                    Color::LinearRgba(linear) => linear.to_f32_array(),
                    other => other.to_srgba().to_f32_array(),
                };
                values.push(painted[channel as usize]);
            }
        }
        Self::new(width, height, values)
    }

    /// The value at these texture coordinates; 0 where they are not finite.
    pub fn at(&self, uv: Vec2) -> f32 {
        if !uv.is_finite() || self.values.is_empty() {
            return 0.0;
        }
        let (width, height) = (self.width as usize, self.values.len() / self.width as usize);
        let size = Vec2::new(width as f32, height as f32);
        let pixel = uv.rem_euclid(Vec2::ONE) * size - 0.5;
        let (low, part) = (pixel.floor(), pixel - pixel.floor());
        let value = |x: f32, y: f32| {
            let (x, y) = ((x + size.x) as usize % width, (y + size.y) as usize % height);
            self.values[y * width + x]
        };
        let row = |y: f32| value(low.x, y) * (1.0 - part.x) + value(low.x + 1.0, y) * part.x;
        row(low.y) * (1.0 - part.y) + row(low.y + 1.0) * part.y
    }

    /// The map as a function for [`PlantingMaps`]; 0 where the mesh has no UVs.
    pub fn mask(&self) -> impl Fn(&RootPlace) -> f32 + '_ {
        |place| place.uv.map_or(0.0, |uv| self.at(uv))
    }
}
