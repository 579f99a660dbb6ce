//! How many fibres light meets on its way to a place in a hair, counted in a grid: a compute shader adds up
//! the strands in each cell, and another goes from each cell to the brightest lights and all around.
//!
//! A shadow map knows how far it is to the first fibre and nothing of those behind it; a light without one
//! knows nothing at all. Cells are too coarse for the fibres that the eye sees, some of which would lie in their
//! own shadow: the first cells on a way are left out, and the map or a plane layer stands for them.

mod compute;
mod lights;

pub(super) use compute::plugin;
pub(super) use lights::{BrightLights, LIGHTS};

use bevy::{
    asset::RenderAssetUsages,
    image::ImageSampler,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
};

/// Cells along a side, of hair that is near and of hair that is far.
const SIDES: [u32; 2] = [32, 16];
/// The first level of which a pixel holds about a cell of the finer grid.
const FAR_LEVEL: u32 = 3;
/// Free cells around the hair, both sides together: those at its edge are read together with them.
const FREE: f32 = 4.0;
/// By how much larger a new grid is than it has to be, and than that how much larger an old one may be, so that
/// cells stay the same while hair moves.
const GRID_MARGIN: f32 = 1.15;
const SPARE: f32 = 1.6;
/// Least size of a cell (m).
const LEAST: f32 = 20e-6;

/// The grid of a hair, in the hair's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct HairVolume {
    /// Its lowest corner (m).
    pub(super) begin: Vec3,
    /// Size of a cell (m).
    pub(super) cell: Vec3,
    /// Cells along a side; 0 for no grid.
    pub(super) side: u32,
}

impl HairVolume {
    /// How many cells hair at a level of detail has along a side.
    pub(super) fn side(level: u32) -> u32 {
        SIDES[usize::from(level >= FAR_LEVEL)]
    }

    /// One around a box, of the cells that it had before as long as they fit.
    pub(super) fn around(center: Vec3, half: Vec3, side: u32, before: Self) -> Self {
        if side == 0 || !(center.is_finite() && half.is_finite()) {
            return Self::default();
        }
        let least = (2.0 * half / (side as f32 - FREE)).max(Vec3::splat(LEAST));
        let known = before.side == side;
        let fits = |i: usize| (least[i]..=SPARE * least[i]).contains(&before.cell[i]);
        let cell: [f32; 3] = core::array::from_fn(|i| match known && fits(i) {
            true => before.cell[i],
            false => GRID_MARGIN * least[i],
        });
        let cell = Vec3::from(cell);
        // In whole cells: strands do not change cells with the box.
        let begin = (center / cell - 0.5 * side as f32).round() * cell;
        Self { begin, cell, side }
    }
}

/// What light meets, by places: towards lights, and above that, of cells [`AROUND`] times as large, beside each
/// other its whole way through the hair, how open it is around, and how thick the hair. `rgba16float`.
pub(super) fn image(side: u32) -> Image {
    let format = TextureFormat::Rgba16Float;
    let mut image = Image::new_uninit(
        image_size(side),
        TextureDimension::D3,
        format,
        RenderAssetUsages::default(),
    );
    image.texture_descriptor.label = Some("hair volume");
    image.texture_descriptor.usage =
        TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING;
    image.sampler = ImageSampler::linear();
    image
}

/// How much larger cells are of what differs little from one to the next.
const AROUND: u32 = 2;

fn image_size(side: u32) -> Extent3d {
    Extent3d { width: side, height: side, depth_or_array_layers: side + side / AROUND }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_holds_its_box_with_free_cells_around() {
        let (center, half) = (Vec3::new(0.3, -1.0, 2.0), Vec3::new(0.1, 0.25, 0.0));
        let grid = HairVolume::around(center, half, 32, HairVolume::default());
        for i in 0..3 {
            let (low, high) = (grid.begin[i], grid.begin[i] + 32.0 * grid.cell[i]);
            assert!(low + grid.cell[i] <= center[i] - half[i], "axis {i}");
            assert!(high - grid.cell[i] >= center[i] + half[i], "axis {i}");
        }
        assert!(grid.cell.y < 1.3 * 0.5 / 28.0, "{grid:?}");
        assert!(grid.cell.z > 0.0);
    }

    #[test]
    fn cells_stay_where_they_are_while_hair_moves() {
        let half = Vec3::splat(0.1);
        let before = HairVolume::around(Vec3::ZERO, half, 32, HairVolume::default());
        let grid = HairVolume::around(Vec3::splat(0.05), 1.1 * half, 32, before);
        assert_eq!(grid.cell, before.cell);
        let cells = (grid.begin - before.begin) / grid.cell;
        assert!(cells.distance(cells.round()) < 1e-3, "{cells}");
        assert!(cells.x > 3.0);
        // Until they do not fit.
        let wide = HairVolume::around(Vec3::ZERO, Vec3::new(0.2, 0.1, 0.1), 32, grid);
        assert!(wide.cell.x > 1.5 * grid.cell.x && wide.cell.y == grid.cell.y);
    }

    #[test]
    fn no_grid_is_laid_around_nothing() {
        let of = |center, half| HairVolume::around(center, half, 32, HairVolume::default());
        assert_eq!(of(Vec3::NAN, Vec3::ONE).side, 0);
        assert_eq!(of(Vec3::ZERO, Vec3::INFINITY).side, 0);
        assert_eq!(HairVolume::around(Vec3::ZERO, Vec3::ONE, 0, default()).side, 0);
    }
}
