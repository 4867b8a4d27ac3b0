//! The period of a pixel array under a mosaic of colour filters: the supercell of [`super::mosaic`].

use super::mosaic::FilterColour;
use super::{PixelStack, StackError};

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
        let (microlens, sub_pixel) = (index / count, index % count);
        let (column, row) = self.subpixels.column_row(sub_pixel);
        (
            (microlens % cells) * self.subpixels.m() + column,
            (microlens / cells) * self.subpixels.n() + row,
        )
    }

    /// The pixel without its mosaic, all microlenses under the filter of one colour. Needs no mosaic for green.
    ///
    /// # Errors
    /// Red or blue without a mosaic.
    pub fn with_single_filter(&self, colour: FilterColour) -> Result<Self, StackError> {
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
        let microlenses = absorbed.chunks(self.subpixels.count());
        microlenses
            .map(|p| p.iter().map(|p| p * cells).collect())
            .collect()
    }

    /// Of [`Self::by_microlens`] that of a colour, of green the mean of both; without a mosaic there is one microlens.
    pub(crate) fn share_of(&self, colour: FilterColour, absorbed: &[f64]) -> Vec<f64> {
        let by_microlens = self.by_microlens(absorbed);
        let coloured = by_microlens.iter().zip(FilterColour::OF_MICROLENSES);
        let matching = coloured.filter(|(_, c)| self.mosaic.is_none() || colour == *c);
        let shares: Vec<&Vec<f64>> = matching.map(|(p, _)| p).collect();
        let mean = |i: usize| shares.iter().map(|p| p[i]).sum::<f64>() / shares.len() as f64;
        (0..self.subpixels.count()).map(mean).collect()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::em::Material;
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
            let share = stack.share_of(colour, &absorbed);
            let wanted: Vec<f64> = (0..4).map(|i| 4.0 * (first + f64::from(i))).collect();
            assert_eq!(share, wanted);
        }
        let plain = stack.with_single_filter(FilterColour::Red).unwrap();
        assert_eq!(
            plain.share_of(FilterColour::Red, &[0.1, 0.2, 0.3, 0.4]),
            [0.1, 0.2, 0.3, 0.4]
        );
        assert_eq!(
            plain.layer("filter").unwrap().material,
            stack.mosaic.unwrap().red
        );
        assert!(plain.with_single_filter(FilterColour::Blue).is_err());
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
