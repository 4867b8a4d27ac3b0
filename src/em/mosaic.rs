//! A mosaic of colour filters: the supercell of 2×2 microlenses that then repeats, each of one colour over all of its
//! sub-pixels (quad-Bayer for a quad pixel).
//!
//! ```text
//!      y ▲
//!        │  G   B        row 1            microlens = row · 2 + column: 0 red, 1 and 2 green, 3 blue
//!        │  R   G        row 0, y = 0     stored from row 0 (see crate::sensor): RGGB
//!        └──────────▶ x
//!      column 0   1                       the red microlens's centre is the origin, the others a pitch beyond
//! ```
//! Without a mosaic the period is one microlens: its neighbours wear its own filter, and light that crosses over to
//! them has passed no other (section 4 of Chataignier et al., Opt. Express 27, 30486 (2019), calls this the worst
//! case). A mosaic keeps the pixel's mirrors through the centres of microlenses, for the columns and rows on both sides
//! of one are alike; it breaks those through their borders, and for the two greens that of the diagonal.

use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::stack::{PixelStack, StackError};
use super::{Layer, Material};

/// Microlenses of the supercell.
pub const MICROLENSES: usize = 4;

/// Colour of a filter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum FilterColour {
    /// Red.
    Red,
    /// Green: two microlenses of the four.
    #[default]
    Green,
    /// Blue.
    Blue,
}

impl FilterColour {
    /// All colours.
    pub const ALL: [Self; 3] = [Self::Red, Self::Green, Self::Blue];
    /// By microlens of the supercell.
    pub const OF_MICROLENSES: [Self; MICROLENSES] =
        [Self::Red, Self::Green, Self::Green, Self::Blue];

    /// `red`, `green`, `blue`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Red => "red",
            Self::Green => "green",
            Self::Blue => "blue",
        }
    }
}

/// The filters of the colours that are not green; the green one is the filter layer's own material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mosaic {
    /// Red filter.
    pub red: Material,
    /// Blue filter.
    pub blue: Material,
    /// The microlens of the supercell that an angular response is of; green: the mean of both.
    #[serde(default)]
    pub colour: FilterColour,
}

/// Indices of a mosaic at one wavelength.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FilterIndices {
    /// The layer that holds it.
    pub layer: usize,
    /// By microlens.
    pub n: [Complex64; MICROLENSES],
}

impl FilterIndices {
    /// Distinct indices.
    pub fn distinct(&self) -> Vec<Complex64> {
        let mut out = vec![self.n[0]];
        for n in self.n {
            if !out.contains(&n) {
                out.push(n);
            }
        }
        out
    }
}

impl PixelStack {
    /// Microlenses along each axis of the period: 2 under a mosaic, else 1.
    pub fn microlenses_across(&self) -> usize {
        if self.mosaic.is_some() { 2 } else { 1 }
    }

    /// Side of the period in µm: the pitch, or twice it under a mosaic.
    pub fn period_um(&self) -> f64 {
        self.pitch_um * self.microlenses_across() as f64
    }

    /// Photodiodes of a period. Solvers list them microlens by microlens.
    pub fn photodiodes(&self) -> usize {
        self.subpixels.count() * self.microlenses_across().pow(2)
    }

    /// Column and row of a photodiode, from those of microlens 0 on.
    pub(crate) fn photodiode_column_row(&self, index: usize) -> (usize, usize) {
        let (cells, count) = (self.microlenses_across(), self.subpixels.count());
        let (microlens, own) = (index / count, index % count);
        let (column, row) = self.subpixels.column_row(own);
        (
            (microlens % cells) * self.subpixels.m() + column,
            (microlens / cells) * self.subpixels.n() + row,
        )
    }

    /// The pixel without its mosaic, all microlenses under the filter of one colour. Needs no mosaic for green.
    pub fn of_one_colour(&self, colour: FilterColour) -> Result<Self, StackError> {
        let material = match (&self.mosaic, colour) {
            (_, FilterColour::Green) => None,
            (Some(mosaic), FilterColour::Red) => Some(mosaic.red.clone()),
            (Some(mosaic), FilterColour::Blue) => Some(mosaic.blue.clone()),
            (None, _) => {
                return Err(StackError::value(
                    "mosaic",
                    "absent",
                    "red and blue filters in [mosaic]",
                ));
            }
        };
        let mut one = self.clone();
        one.mosaic = None;
        one.name = format!("{}, {}", self.name, colour.name());
        if let (Some(layer), Some(material)) = (one.filter_layer_mut(), material) {
            layer.material = material;
        }
        Ok(one)
    }

    /// P of each sub-pixel of each microlens, as parts of the light that falls on **one** microlens, of powers that are
    /// parts of the light on the period, photodiode by photodiode.
    pub fn by_microlens(&self, absorbed: &[f64]) -> Vec<Vec<f64>> {
        let cells = self.microlenses_across().pow(2) as f64;
        let own = absorbed.chunks(self.subpixels.count());
        own.map(|p| p.iter().map(|p| p * cells).collect()).collect()
    }

    /// Of [`Self::by_microlens`] that of a colour, of green the mean of both; without a mosaic there is one microlens.
    pub(crate) fn share_of(&self, colour: FilterColour, absorbed: &[f64]) -> Vec<f64> {
        let by_microlens = self.by_microlens(absorbed);
        let own = by_microlens.iter().zip(FilterColour::OF_MICROLENSES);
        let own = own.filter(|(_, of)| self.mosaic.is_none() || colour == *of);
        let own: Vec<&Vec<f64>> = own.map(|(p, _)| p).collect();
        let mean = |i: usize| own.iter().map(|p| p[i]).sum::<f64>() / own.len() as f64;
        (0..self.subpixels.count()).map(mean).collect()
    }

    /// Number of the layer that is the colour filter, and the layer.
    pub(crate) fn filter_layer(&self) -> Option<(usize, &Layer)> {
        let name = self.filter.as_ref()?;
        let mut layers = self.layers.iter().enumerate();
        layers.find(|(_, l)| l.name == *name)
    }

    pub(super) fn check_mosaic(&self) -> Result<(), StackError> {
        let Some(mosaic) = &self.mosaic else {
            return Ok(());
        };
        let Some((_, layer)) = self.filter_layer() else {
            return Err(StackError::value(
                "filter",
                "absent",
                "the layer that the mosaic colours",
            ));
        };
        if layer.thickness_um <= 0.0 {
            return Err(StackError::value(
                format!("layers.{}.thickness_um", layer.name),
                layer.thickness_um,
                "above 0 under a mosaic",
            ));
        }
        if self.metal.as_ref().is_some_and(|m| m.layer == layer.name) {
            return Err(StackError::value(
                "metal.layer",
                format!("`{}`", layer.name),
                "another than the filter under a mosaic",
            ));
        }
        mosaic.red.check("mosaic.red")?;
        mosaic.blue.check("mosaic.blue")
    }

    pub(super) fn filter_indices(
        &self,
        wavelength_nm: f64,
    ) -> Result<Option<FilterIndices>, StackError> {
        let (Some(mosaic), Some((layer, green))) = (&self.mosaic, self.filter_layer()) else {
            return Ok(None);
        };
        let [r, g, b] = [&mosaic.red, &green.material, &mosaic.blue];
        let n = |m: &Material| m.index(wavelength_nm);
        Ok(Some(FilterIndices {
            layer,
            n: [n(r)?, n(g)?, n(g)?, n(b)?],
        }))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::sensor::Subpixels;

    fn bayer() -> PixelStack {
        PixelStack::builtin("1.6um-bayer").unwrap()
    }

    #[test]
    fn photodiodes_stand_microlens_by_microlens() {
        let stack = bayer();
        assert_eq!((stack.period_um(), stack.photodiodes()), (3.2, 16));
        // Sub-pixel A (index 1) of the second green (column 0, row 1).
        assert_eq!(stack.photodiode_column_row(2 * 4 + 1), (1, 2));
        assert_eq!(stack.photodiode_column_row(3 * 4 + 3), (3, 3));
        let dual = PixelStack {
            subpixels: Subpixels::DUAL_X,
            ..bayer()
        };
        assert_eq!(dual.photodiode_column_row(7), (3, 1));
    }

    #[test]
    fn a_response_is_of_the_microlens_asked_for_per_light_on_it() {
        let stack = bayer();
        let absorbed: Vec<f64> = (0..16).map(f64::from).collect();
        for (colour, first) in [
            (FilterColour::Red, 0.0),
            (FilterColour::Green, 6.0),
            (FilterColour::Blue, 12.0),
        ] {
            let own = stack.share_of(colour, &absorbed);
            let wanted: Vec<f64> = (0..4).map(|i| 4.0 * (first + f64::from(i))).collect();
            assert_eq!(own, wanted);
        }
        let plain = stack.of_one_colour(FilterColour::Red).unwrap();
        assert_eq!(
            plain.share_of(FilterColour::Red, &[0.1, 0.2, 0.3, 0.4]),
            [0.1, 0.2, 0.3, 0.4]
        );
        assert_eq!(
            plain.layer("filter").unwrap().material,
            stack.mosaic.unwrap().red
        );
        assert!(plain.of_one_colour(FilterColour::Blue).is_err());
    }

    #[test]
    fn mosaics_that_cannot_be_are_refused() {
        type Change = fn(&mut PixelStack);
        let changes: [(Change, &str); 4] = [
            (|p| p.filter = None, "filter is absent"),
            (
                |p| p.layers[1].thickness_um = 0.0,
                "layers.filter.thickness_um is 0",
            ),
            (
                |p| p.mosaic.as_mut().unwrap().blue = Material::Table("cyan".into()),
                "mosaic.blue is cyan",
            ),
            (
                |p| {
                    p.metal = Some(crate::em::MetalWalls {
                        layer: "filter".into(),
                        width_um: 0.1,
                        material: Material::Table("W_Rakic1998_LD".into()),
                    });
                },
                "metal.layer is `filter`",
            ),
        ];
        for (change, said) in changes {
            let mut p = bayer();
            change(&mut p);
            let e = p.check().unwrap_err().to_string();
            assert!(e.contains(said), "{e}");
        }
    }
}
