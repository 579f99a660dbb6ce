//! Looks in a hairdo's file, from format 2 on.
//!
//! Behind the strands: whether there is a look, and if so its pigments, dye, numbers and reflection
//! model; the number of layers of dye, then each; whether the preset is known, and if so its name, seed
//! and length.

use super::{
    Hairdo, HairdoError,
    bytes::{Reader, Writer},
};
use crate::hair::look::{
    DyeLayer, HairColor, HairDye, HairLook, HairShading, MAX_LAYERS, Melanin, Streaks, WornPreset,
};

/// The longest name of a preset (bytes).
const LONGEST_NAME: usize = 256;

fn color(color: HairColor) -> [f32; 3] {
    [color.red, color.green, color.blue]
}

impl Hairdo {
    /// Whether there is more than format 1 can hold.
    pub(super) fn has_looks(&self) -> bool {
        self.look.is_some() || !self.dye.is_none() || self.preset.is_some()
    }

    pub(super) fn write_looks(&self, out: &mut Writer) {
        out.put(&self.look.is_some());
        if let Some(look) = &self.look {
            out.put(&[look.melanin.eumelanin, look.melanin.pheomelanin]);
            out.put(&color(look.dye));
            out.put(&look.numbers());
            out.put(&matches!(look.shading, HairShading::KajiyaKay));
        }
        out.put(&(self.dye.layers.len() as u64));
        for layer in &self.dye.layers {
            let DyeLayer { bleach, strength, from, to, fade, .. } = *layer;
            out.put(&([bleach, strength, from, to, fade], color(layer.color)));
            out.put(&layer.streaks.map(|s| (s.share, s.width, s.seed)));
        }
        let preset = self.preset.as_ref();
        out.put(&preset.map(|of| (of.name.as_str(), of.seed, of.length)));
    }

    pub(super) fn read_looks(&mut self, from: &mut Reader<'_>) -> Result<(), HairdoError> {
        if from.take("whether there is a look")? {
            self.look = Some(look(from)?);
        }
        let layers: u64 = from.take("a number of layers of dye")?;
        if layers > MAX_LAYERS as u64 {
            return Err(from.wrong("at most four layers of dye"));
        }
        let layers = (0..layers).map(|_| layer(from)).collect::<Result<_, _>>()?;
        self.dye = HairDye { layers };
        let preset: Option<(&str, u64, f32)> = from.take("the preset")?;
        if preset.is_some_and(|(name, ..)| name.len() > LONGEST_NAME) {
            return Err(from.wrong("a name of 256 bytes at most"));
        }
        let preset = preset.map(|(name, seed, length)| (name.to_owned(), seed, length));
        self.preset = preset.map(|(name, seed, length)| WornPreset { name, seed, length });
        Ok(())
    }
}

fn look(from: &mut Reader<'_>) -> Result<HairLook, HairdoError> {
    let mut look = HairLook::default();
    let [eumelanin, pheomelanin]: [f32; 2] = from.take("pigments")?;
    look.melanin = Melanin { eumelanin, pheomelanin };
    let [red, green, blue]: [f32; 3] = from.take("the dye of a look")?;
    look.dye = HairColor { red, green, blue };
    let numbers: [f32; 11] = from.take("the numbers of a look")?;
    for (number, read) in look.numbers_mut().into_iter().zip(numbers) {
        *number = read;
    }
    if from.take("the reflection model")? {
        look.shading = HairShading::KajiyaKay;
    }
    Ok(look)
}

fn layer(reader: &mut Reader<'_>) -> Result<DyeLayer, HairdoError> {
    type Numbers = ([f32; 5], [f32; 3]);
    let ([bleach, strength, from, to, fade], [red, green, blue]): Numbers =
        reader.take("a layer of dye")?;
    let streaks: Option<(f32, f32, u32)> = reader.take("the streaks of a dye")?;
    Ok(DyeLayer {
        bleach,
        color: HairColor { red, green, blue },
        strength,
        from,
        to,
        fade,
        streaks: streaks.map(|(share, width, seed)| Streaks { share, width, seed }),
    })
}
