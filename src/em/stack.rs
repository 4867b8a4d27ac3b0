//! The pixel's layers (section 2.1.1 of Chataignier et al., Opt. Express 27, 30486 (2019)), from the top:
//!
//! ```text
//!            air
//!        ___-----___            gapless spherical lens: z = z0 + h − R + √(R² − x² − y²), apex at z0 + h;
//!      _-           -_            R above the half diagonal leaves a pedestal
//!   z0 ═══════════════          ┐
//!      ───────────────          │ flat layers: planarization resin, colour filter, oxide in the paper's pixels;
//!      ▌             ▐          ┘   one of them may hold metal walls, a frame along the pixel's border
//!      █│█████│█████│█           silicon, parted by trenches between sub-pixels and along the pixel's border;
//!      █│█████│█████│█           it goes on below the `silicon_um` whose absorption is counted
//! ```
//! The cell is a square of side `pitch_um`, repeated in x and y. A trench or wall along the border is centred on it, so
//! that each pixel has half of its width. No anti-reflection layer unless it is listed. Under a mosaic of colour
//! filters ([`super::mosaic`]) the period is 2×2 such cells.

use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::Material;
use super::mosaic::{FilterColour, FilterIndices, Mosaic};
use crate::range::OutOfRange;
use crate::sensor::{MovingFrame, Subpixels, check_simulated};

/// Most layers that a pixel may list.
const MOST_LAYERS: usize = 32;

/// A pixel that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StackError {
    /// A value out of its range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// A pixel file that is not understood.
    #[error("{file}: {why}")]
    File {
        /// The file.
        file: String,
        /// What is wrong in it.
        why: String,
    },
}

impl StackError {
    pub(super) fn value(
        field: impl Into<String>,
        value: impl std::fmt::Display,
        allowed: &'static str,
    ) -> Self {
        Self::Range(OutOfRange::new("pixel", field.into(), value, allowed))
    }
}

/// The gapless spherical microlens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Microlens {
    /// Radius of curvature R in µm, at least the pixel's half diagonal.
    pub radius_um: f64,
    /// Height h of the apex above the first flat layer in µm, at least the sag at the corner.
    pub height_um: f64,
    /// Shift (s_x, s_y) of the lens array against the photodiodes in µm.
    #[serde(default)]
    pub shift_um: [f64; 2],
    /// What it is made of, pedestal included.
    pub material: Material,
}

/// A flat layer between lens and silicon.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Its name, of its own in the pixel.
    pub name: String,
    /// Thickness in µm; 0 is allowed and means that it is not there.
    pub thickness_um: f64,
    /// What it is made of.
    pub material: Material,
}

/// Metal walls: a frame along the pixel's border, as high as the layer that holds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MetalWalls {
    /// Name of the layer that holds them.
    pub layer: String,
    /// Width in µm, centred on the border.
    pub width_um: f64,
    /// The metal.
    pub material: Material,
}

/// One period of the pixel array; under a mosaic a quarter of one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PixelStack {
    /// A name for people.
    pub name: String,
    /// Pitch of the microlenses in µm.
    pub pitch_um: f64,
    /// Photodiodes of the pixel (m, n).
    pub subpixels: Subpixels,
    /// Name of the layer that is the colour filter; absent: none is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<String>,
    /// Depth of silicon that counts as photodiode in µm.
    pub silicon_um: f64,
    /// Silicon.
    pub silicon: Material,
    /// Width of the trenches in µm; 0 for none.
    pub trench_um: f64,
    /// What fills the trenches.
    pub trench: Material,
    /// The microlens.
    pub lens: Microlens,
    /// Flat layers, from the lens down to the silicon.
    #[serde(default)]
    pub layers: Vec<Layer>,
    /// Metal walls; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metal: Option<MetalWalls>,
    /// Filters of unlike neighbours; absent: all microlenses wear the filter layer's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mosaic: Option<Mosaic>,
}

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

impl PixelStack {
    /// The layer of a name.
    pub fn layer(&self, name: &str) -> Option<&Layer> {
        self.layers.iter().find(|l| l.name == name)
    }

    /// The layer of a name, to be changed.
    pub fn layer_mut(&mut self, name: &str) -> Option<&mut Layer> {
        self.layers.iter_mut().find(|l| l.name == name)
    }

    /// The layer that is the colour filter.
    pub fn filter_layer_mut(&mut self) -> Option<&mut Layer> {
        let name = self.filter.clone()?;
        self.layer_mut(&name)
    }

    /// The walls in layer `index`, if it has any.
    pub(super) fn walls_in(&self, index: usize) -> Option<&MetalWalls> {
        let name = &self.layers.get(index)?.name;
        self.metal
            .as_ref()
            .filter(|m| m.layer == *name && m.width_um > 0.0)
    }

    /// Whether the layers make a pixel: ranges, known materials, a lens that covers the cell, trenches and walls
    /// narrower than sub-pixels.
    pub fn check(&self) -> Result<(), StackError> {
        within("pitch_um", self.pitch_um, 0.4, 12.0, "0.4 to 12")?;
        check_simulated("pixel", self.subpixels)?;
        within("silicon_um", self.silicon_um, 0.1, 20.0, "0.1 to 20")?;
        self.check_lens()?;
        self.check_layers()?;
        self.silicon.check("silicon")?;
        self.trench.check("trench")?;
        let widest = 0.8 * self.pitch_um / self.subpixels.m().max(self.subpixels.n()) as f64;
        let allowed = "0 to 0.8 of a sub-pixel";
        within("trench_um", self.trench_um, 0.0, widest, allowed)?;
        if let Some(metal) = &self.metal {
            metal.material.check("metal.material")?;
            within("metal.width_um", metal.width_um, 0.0, widest, allowed)?;
        }
        self.check_mosaic()
    }

    fn check_lens(&self) -> Result<(), StackError> {
        let half_diagonal = self.pitch_um * std::f64::consts::FRAC_1_SQRT_2;
        // The paper rounds its smallest radius: 2.48 or 2.475 for 2.47487 µm, 1.98 for 1.97990.
        within(
            "lens.radius_um",
            self.lens.radius_um,
            half_diagonal - 1e-3,
            1e3,
            "at least half the diagonal of the pixel",
        )?;
        within(
            "lens.height_um",
            self.lens.height_um,
            self.sag_um() - 1e-3,
            10.0,
            "at least the sag of the lens at the pixel's corner, at most 10",
        )?;
        for s in self.lens.shift_um {
            within("lens.shift_um", s, -1e2, 1e2, "-100 to 100")?;
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
                0.0,
                10.0,
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

    /// Depth of the lens surface at the cell's corner below its apex, in µm.
    pub fn sag_um(&self) -> f64 {
        let half_diagonal_squared = 0.5 * self.pitch_um * self.pitch_um;
        let r = self.lens.radius_um;
        r - (r * r - half_diagonal_squared).max(0.0).sqrt()
    }

    /// Height of the lens surface above the first flat layer, averaged over the cell, in µm.
    pub fn mean_lens_height_um(&self) -> f64 {
        const SAMPLES: usize = 32;
        let r = self.lens.radius_um;
        let place = |i: usize| ((i as f64 + 0.5) / SAMPLES as f64 - 0.5) * self.pitch_um;
        let mut sum = 0.0;
        for i in 0..SAMPLES {
            for j in 0..SAMPLES {
                let (x, y) = (place(i), place(j));
                sum += (r * r - x * x - y * y).max(0.0).sqrt();
            }
        }
        self.lens.height_um - r + sum / (SAMPLES * SAMPLES) as f64
    }

    /// How a lens shift moves the response, to first order: n of the lens, and the depth of the silicon below the mean
    /// lens surface in lengths of it, `H = Σ d_i n / n_i`.
    ///
    /// # Errors
    /// A material that does not know the wavelength.
    pub fn moving_frame(&self, wavelength_nm: f64) -> Result<MovingFrame, StackError> {
        let index = |m: &Material| m.index(wavelength_nm).map(|n| n.re);
        let n = index(&self.lens.material)?;
        let mut height = self.mean_lens_height_um();
        for layer in &self.layers {
            height += layer.thickness_um * n / index(&layer.material)?;
        }
        Ok(MovingFrame::new(n, height)?)
    }

    /// The pixel with its lens elsewhere.
    #[must_use]
    pub fn with_lens_shift(&self, shift_um: [f64; 2]) -> Self {
        let mut stack = self.clone();
        stack.lens.shift_um = shift_um;
        stack
    }

    /// The pixel with another colour of its mosaic; without a mosaic the same.
    #[must_use]
    pub fn with_colour(&self, colour: FilterColour) -> Self {
        let mut stack = self.clone();
        if let Some(mosaic) = &mut stack.mosaic {
            mosaic.colour = colour;
        }
        stack
    }

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
}

/// Written so that NaN fails.
fn within(
    field: &str,
    value: f64,
    low: f64,
    high: f64,
    allowed: &'static str,
) -> Result<(), StackError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(StackError::value(field, value, allowed))
    }
}
