//! Which layers make a pixel.

use std::ops::RangeInclusive;

use super::{Isolation, PixelStack, StackError};
use crate::sensor::check_simulated;

/// Most layers that a pixel may list.
const MOST_LAYERS: usize = 32;

impl PixelStack {
    /// Whether the layers make a pixel: ranges, known materials, a lens that covers the cell, trenches and walls
    /// narrower than sub-pixels.
    ///
    /// # Errors
    /// The first field that is not so.
    pub fn check(&self) -> Result<(), StackError> {
        within("pitch_um", self.pitch_um, 0.4..=12.0, "0.4 to 12")?;
        check_simulated("pixel", self.subpixels)?;
        within("silicon_um", self.silicon_um, 0.1..=20.0, "0.1 to 20")?;
        self.check_lens()?;
        self.check_layers()?;
        self.silicon.check("silicon")?;
        self.trench.check("trench")?;
        let widest = 0.8 * self.pitch_um / self.subpixels.m().max(self.subpixels.n()) as f64;
        let allowed = "0 to 0.8 of a sub-pixel";
        within("trench_um", self.trench_um, 0.0..=widest, allowed)?;
        let Isolation {
            split_um,
            border_um,
        } = self.isolation;
        within("isolation.split_um", split_um, 0.0..=widest, allowed)?;
        within("isolation.border_um", border_um, 0.0..=widest, allowed)?;
        if let Some(metal) = &self.metal {
            metal.material.check("metal.material")?;
            within("metal.width_um", metal.width_um, 0.0..=widest, allowed)?;
        }
        self.check_mosaic()
    }

    fn check_lens(&self) -> Result<(), StackError> {
        let half_diagonal = self.pitch_um * std::f64::consts::FRAC_1_SQRT_2;
        // The paper rounds its smallest radius: 2.48 or 2.475 for 2.47487 µm, 1.98 for 1.97990.
        within(
            "lens.radius_um",
            self.lens.radius_um,
            half_diagonal - 1e-3..=1e3,
            "at least half the diagonal of the pixel",
        )?;
        within(
            "lens.height_um",
            self.lens.height_um,
            self.sag_um() - 1e-3..=10.0,
            "at least the sag of the lens at the pixel's corner, at most 10",
        )?;
        for s in self.lens.shift_um {
            within("lens.shift_um", s, -1e2..=1e2, "-100 to 100")?;
        }
        self.lens.material.check("lens.material")
    }

    fn check_layers(&self) -> Result<(), StackError> {
        if self.layers.len() > MOST_LAYERS {
            return Err(StackError::value(
                "layers (count)",
                self.layers.len(),
                "at most 32",
            ));
        }
        for (i, layer) in self.layers.iter().enumerate() {
            let named = |what: &str| format!("layers.{}.{what}", layer.name);
            if layer.name.is_empty() || self.layers[..i].iter().any(|l| l.name == layer.name) {
                return Err(StackError::value(
                    format!("layers[{i}].name"),
                    format!("`{}`", layer.name),
                    "a name that no other layer has",
                ));
            }
            within(
                &named("thickness_um"),
                layer.thickness_um,
                0.0..=10.0,
                "0 to 10",
            )?;
            layer.material.check(&named("material"))?;
        }
        let filter = self.filter.iter().map(|name| ("filter", name));
        let metal = self.metal.iter().map(|m| ("metal.layer", &m.layer));
        match filter.chain(metal).find(|(_, n)| self.layer(n).is_none()) {
            Some((field, name)) => Err(StackError::value(
                field,
                format!("`{name}`"),
                "the name of one of the layers",
            )),
            None => Ok(()),
        }
    }

    fn check_mosaic(&self) -> Result<(), StackError> {
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
}

/// `Ok` if `value` lies in `range` (a NaN does not).
fn within(
    field: &str,
    value: f64,
    range: RangeInclusive<f64>,
    allowed: &'static str,
) -> Result<(), StackError> {
    match range.contains(&value) {
        true => Ok(()),
        false => Err(StackError::value(field, value, allowed)),
    }
}
