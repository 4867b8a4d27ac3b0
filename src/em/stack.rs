//! The pixel's layers (section 2.1.1 of Chataignier et al., Opt. Express 27, 30486 (2019)), from the top:
//!
//! ```text
//!            air
//!        ___-----___            gapless spherical lens: z = z0 + h − R + √(R² − x² − y²), apex at z0 + h;
//!      _-           -_            R above the half diagonal leaves a pedestal
//!   z0 ═══════════════           planarization resin (as the lens)
//!      ───────────────           colour filter
//!      ───────────────           oxide
//!      █│█████│█████│█           silicon, parted by oxide trenches between sub-pixels and along the pixel's border;
//!      █│█████│█████│█           it goes on below the `silicon_um` whose absorption is counted
//! ```
//! The cell is a square of side `pitch_um`, repeated in x and y. No anti-reflection layer, no tungsten.

use rustfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::Material;
use crate::sensor::Subpixels;

/// A pixel that cannot be.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StackError {
    /// A value out of its range.
    #[error("pixel: {field} is {value}; allowed: {allowed}")]
    Value {
        /// The field.
        field: &'static str,
        /// What was given.
        value: String,
        /// What is allowed.
        allowed: &'static str,
    },
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
        field: &'static str,
        value: impl std::fmt::Display,
        allowed: &'static str,
    ) -> Self {
        Self::Value {
            field,
            value: value.to_string(),
            allowed,
        }
    }
}

/// The gapless spherical microlens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Microlens {
    /// Radius of curvature R in µm, at least the pixel's half diagonal.
    pub radius_um: f64,
    /// Height h of the apex above the planarization in µm, at least the sag at the corner.
    pub height_um: f64,
    /// Shift (s_x, s_y) of the lens array against the photodiodes in µm.
    #[serde(default)]
    pub shift_um: [f64; 2],
}

/// One period of the pixel array.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PixelStack {
    /// A name for people.
    pub name: String,
    /// Period in µm.
    pub pitch_um: f64,
    /// Photodiodes of the pixel (m, n).
    pub subpixels: Subpixels,
    /// The microlens.
    pub lens: Microlens,
    /// Thickness of the planarization in µm.
    pub planarization_um: f64,
    /// Thickness of the colour filter in µm.
    pub filter_um: f64,
    /// Thickness of the oxide in µm.
    pub oxide_um: f64,
    /// Depth of silicon that counts as photodiode in µm.
    pub silicon_um: f64,
    /// Width of the trenches in µm; 0 for none.
    pub trench_um: f64,
    /// Lens and planarization.
    pub resin: Material,
    /// Colour filter, in the band of its own colour.
    pub filter: Material,
    /// Oxide layer and trenches.
    pub oxide: Material,
    /// Silicon.
    pub silicon: Material,
}

/// Indices of a stack at one wavelength.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Indices {
    pub resin: Complex64,
    pub filter: Complex64,
    pub oxide: Complex64,
    pub silicon: Complex64,
}

impl PixelStack {
    /// The paper's layers under a lens of the given pitch, radius and height, with a colour filter of `filter_um`.
    pub fn paper(pitch_um: f64, radius_um: f64, height_um: f64, filter_um: f64) -> Self {
        Self {
            name: format!(
                "{pitch_um} um, RoC {radius_um:.4}, h {height_um:.4}, filter {filter_um}"
            ),
            pitch_um,
            subpixels: Subpixels::QUAD,
            lens: Microlens {
                radius_um,
                height_um,
                shift_um: [0.0, 0.0],
            },
            planarization_um: 0.5,
            filter_um,
            oxide_um: 0.65,
            silicon_um: 4.0,
            trench_um: 0.1,
            resin: Material::Constant { n: 1.56, k: 0.0 },
            filter: Material::Constant { n: 1.60, k: 0.005 },
            oxide: Material::Table("SiO2_Malitson1965".into()),
            silicon: Material::Table("Si_Green2008".into()),
        }
    }

    /// Names that [`Self::builtin`] knows.
    pub fn builtin_names() -> [&'static str; 5] {
        [
            "3.5um",
            "3.5um-roc3.5",
            "3.5um-thin-filter",
            "2.8um",
            "1.6um",
        ]
    }

    /// A built-in pixel. Unless its name says otherwise R = h = half the diagonal, the best of the paper's nine lenses.
    pub fn builtin(name: &str) -> Result<Self, StackError> {
        let best = |pitch: f64, filter| {
            let r = pitch * std::f64::consts::FRAC_1_SQRT_2;
            Self::paper(pitch, r, r, filter)
        };
        let stack = match name {
            "3.5um" => best(3.5, 1.0),
            "3.5um-roc3.5" => Self::paper(3.5, 3.5, 2.475, 1.0),
            "3.5um-thin-filter" => best(3.5, 0.75),
            "2.8um" => best(2.8, 0.75),
            "1.6um" => best(1.6, 0.75),
            _ => {
                return Err(StackError::value(
                    "name",
                    name,
                    "3.5um, 3.5um-roc3.5, 3.5um-thin-filter, 2.8um, 1.6um",
                ));
            }
        };
        Ok(Self {
            name: name.to_owned(),
            ..stack
        })
    }

    /// A pixel from TOML; `file` names the text in errors.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, StackError> {
        let in_file = |why: String| StackError::File {
            file: file.to_owned(),
            why,
        };
        let stack: Self = toml::from_str(text).map_err(|e| in_file(e.to_string()))?;
        stack.check().map_err(|e| in_file(e.to_string()))?;
        Ok(stack)
    }

    /// Whether the layers make a pixel: ranges, a lens that covers the cell, trenches narrower than sub-pixels.
    pub fn check(&self) -> Result<(), StackError> {
        let within = |field, value: f64, low: f64, high: f64, allowed| {
            if (low..=high).contains(&value) {
                Ok(())
            } else {
                Err(StackError::value(field, value, allowed))
            }
        };
        within("pitch_um", self.pitch_um, 0.4, 12.0, "0.4 to 12")?;
        within(
            "planarization_um",
            self.planarization_um,
            0.0,
            10.0,
            "0 to 10",
        )?;
        within("filter_um", self.filter_um, 0.0, 10.0, "0 to 10")?;
        within("oxide_um", self.oxide_um, 0.0, 10.0, "0 to 10")?;
        within("silicon_um", self.silicon_um, 0.1, 20.0, "0.1 to 20")?;
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
        let smallest = self.pitch_um / self.subpixels.m().max(self.subpixels.n()) as f64;
        within(
            "trench_um",
            self.trench_um,
            0.0,
            0.8 * smallest,
            "0 to 0.8 of a sub-pixel",
        )
    }

    /// Depth of the lens surface at the cell's corner below its apex, in µm.
    pub fn sag_um(&self) -> f64 {
        let half_diagonal_squared = 0.5 * self.pitch_um * self.pitch_um;
        let r = self.lens.radius_um;
        r - (r * r - half_diagonal_squared).max(0.0).sqrt()
    }

    /// Height of the lens surface above the planarization, averaged over the cell, in µm.
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

    pub(crate) fn indices(&self, wavelength_nm: f64) -> Result<Indices, StackError> {
        Ok(Indices {
            resin: self.resin.index(wavelength_nm)?,
            filter: self.filter.index(wavelength_nm)?,
            oxide: self.oxide.index(wavelength_nm)?,
            silicon: self.silicon.index(wavelength_nm)?,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn built_in_pixels_are_whole_and_survive_toml() {
        for name in PixelStack::builtin_names() {
            let p = PixelStack::builtin(name).unwrap();
            p.check().unwrap();
            let text = toml::to_string(&p).unwrap();
            assert_eq!(PixelStack::from_toml(&text, "p.toml").unwrap(), p);
        }
    }

    #[test]
    fn a_lens_smaller_than_the_cell_is_refused_by_field_and_value() {
        let mut p = PixelStack::builtin("3.5um").unwrap();
        p.lens.radius_um = 2.0;
        let text = toml::to_string(&p).unwrap();
        let e = PixelStack::from_toml(&text, "p.toml")
            .unwrap_err()
            .to_string();
        assert!(
            e.contains("p.toml") && e.contains("lens.radius_um is 2"),
            "{e}"
        );
        p.lens.radius_um = f64::NAN;
        assert!(p.check().is_err());
    }
}
