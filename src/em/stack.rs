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
//!      █│█████│█████│█           it goes on below the `silicon_um` whose absorption is counted; the charge of
//!                                strips in the trenches' places, the isolation, is lost
//! ```
//! The cell is a square of side `pitch_um`, repeated in x and y. A trench or wall along the border is centred on it, so
//! that each pixel has half of its width. No anti-reflection layer unless it is listed. Under a mosaic of colour
//! filters ([`super::mosaic`]) the period is 2×2 such cells.

use serde::{Deserialize, Serialize};

use super::mosaic::{FilterColour, Mosaic};
use super::{Material, StackError};
use crate::sensor::{MovingFrame, Silicon, Subpixels};
use crate::spectrum::ChannelWavelengths;

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

/// Strips between photodiodes, centred where trenches are: silicon to light, but its charge is lost (implanted wells,
/// the sides of trenches) and counts as absorbed elsewhere. Where trenches are wider, they are all that is lost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Isolation {
    /// Width between the photodiodes of a pixel in µm.
    pub split_um: f64,
    /// Width along the pixel's border in µm: each of both pixels has half of it.
    pub border_um: f64,
}

impl Isolation {
    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
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
    /// Silicon between photodiodes whose charge is lost; absent: none.
    #[serde(default, skip_serializing_if = "Isolation::is_none")]
    pub isolation: Isolation,
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

impl PixelStack {
    /// Widths between photodiodes, at the split and at the border, that collect no charge, in µm.
    pub(crate) fn uncollected_um(&self) -> [f64; 2] {
        let Isolation {
            split_um,
            border_um,
        } = self.isolation;
        [split_um, border_um].map(|width_um| width_um.max(self.trench_um))
    }

    /// Whether charge is lost beside the trenches.
    pub(crate) fn is_isolated(&self) -> bool {
        self.uncollected_um() != [self.trench_um; 2]
    }

    /// The silicon as charge is made in it at a wavelength; the reference is that of [`ChannelWavelengths`].
    ///
    /// # Errors
    /// An unknown material, or a wavelength outside its table.
    pub fn silicon_at(&self, wavelength_nm: f64) -> Result<Silicon, StackError> {
        let absorption_um = |nm: f64| {
            let index = self.silicon.index(nm)?;
            Ok::<_, StackError>(1e-3 * nm / (4.0 * std::f64::consts::PI * index.im.abs()))
        };
        Ok(Silicon {
            depth_um: self.silicon_um,
            absorption_um: absorption_um(wavelength_nm)?,
            reference_absorption_um: absorption_um(ChannelWavelengths::default().reference_nm())?,
        })
    }

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

    /// Number of the layer that is the colour filter, and the layer.
    pub(crate) fn filter_layer(&self) -> Option<(usize, &Layer)> {
        let name = self.filter.as_ref()?;
        let mut layers = self.layers.iter().enumerate();
        layers.find(|(_, l)| l.name == *name)
    }

    /// The walls in layer `index`, if it has any.
    pub(super) fn walls_in(&self, index: usize) -> Option<&MetalWalls> {
        let name = &self.layers.get(index)?.name;
        self.metal
            .as_ref()
            .filter(|m| m.layer == *name && m.width_um > 0.0)
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
}
