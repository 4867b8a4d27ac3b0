//! Refractive indices of a pixel at one wavelength.

use rustfft::num_complex::Complex64;

use super::mosaic::MICROLENSES;
use super::{Material, PixelStack, StackError};

/// Indices of a stack at one wavelength.
#[derive(Clone, Debug)]
pub(crate) struct Indices {
    pub lens: Complex64,
    /// One a layer, from the lens down; the green one of a mosaic.
    pub layers: Vec<Complex64>,
    pub mosaic: Option<FilterIndices>,
    pub trench: Complex64,
    pub silicon: Complex64,
    /// Of the walls; silicon's where there are none.
    pub metal: Complex64,
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
    /// Indices of lens, layers, trenches and silicon. Fails where a material does not know the wavelength.
    pub(crate) fn indices(&self, wavelength_nm: f64) -> Result<Indices, StackError> {
        let layers = self.layers.iter();
        let metal = self.metal.as_ref().map_or(&self.silicon, |m| &m.material);
        Ok(Indices {
            lens: self.lens.material.index(wavelength_nm)?,
            layers: layers
                .map(|l| l.material.index(wavelength_nm))
                .collect::<Result<_, _>>()?,
            mosaic: self.filter_indices(wavelength_nm)?,
            trench: self.trench.index(wavelength_nm)?,
            silicon: self.silicon.index(wavelength_nm)?,
            metal: metal.index(wavelength_nm)?,
        })
    }

    fn filter_indices(&self, wavelength_nm: f64) -> Result<Option<FilterIndices>, StackError> {
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
