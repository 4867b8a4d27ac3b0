//! The forward model: parameters to the kernels of both views at a field, and to the white sheet's division.
//!
//! ```text
//! pupil ρ ─ direction (u, v) = ρ/(2F) ─▶ P_L, P_R under the microlens's shift      pixel_table.rs
//!    └──── place ε(ρ; field) ─────────▶ kernel += P δ(x − ε), then a Gaussian blur   lens_law.rs
//! ```
//! A textured plane at another distance has another defocus, and its shift is that which a matcher finds between both
//! views' kernels.
//!
//! Along the split light comes about the chief ray, and the microlens stands where it brings that ray to the middle of
//! its pixel (to first order: the moving frame) but for the fitted law. Across the split, where nothing divides the
//! light, both chief ray and shift are left out, but for how small the pupil looks from there.

mod set;

use std::sync::{Arc, Mutex, PoisonError};

use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::wave::WaveSettings;
use quadpixel::em::{Isolation, Material, PixelStack};
use quadpixel::sensor::{CollectedAt, Subpixels, Wandering};

use super::conjugates::Conjugates;
use super::error::FitError;
use super::keeping::Keeping;
use super::parameters::LAYERS;
use super::pixel_table::{PixelTable, TableFineness};

pub use self::set::Set;

/// How finely the model computes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fineness {
    /// Of the table of the pixel.
    pub table: TableFineness,
    /// Places in the pupil.
    pub pupil_points: usize,
}

impl Fineness {
    /// The default: kernels within half a per cent of those of twice as many of everything.
    pub fn standard() -> Self {
        Self {
            table: TableFineness {
                steps: 9,
                shifts: 12,
                wave: WaveSettings {
                    bounces: 0,
                    tolerance: TOLERANCE,
                    ..WaveSettings::standard()
                },
                modes: None,
            },
            pupil_points: 900,
        }
    }

    /// For tests and quick looks.
    pub fn draft() -> Self {
        Self {
            table: TableFineness {
                steps: 4,
                shifts: 8,
                wave: WaveSettings {
                    bounces: 0,
                    tolerance: TOLERANCE,
                    ..WaveSettings::draft()
                },
                modes: None,
            },
            pupil_points: 300,
        }
    }
}

/// Thickest slice of the wave model, µm; a microlens that is curved most is half a diagonal high.
const THICKEST_UM: f64 = 0.14;
/// Refractive index of silica, nearly that of any spacer.
const OXIDE_INDEX: f64 = 1.46;
/// Residual of the waves: small, as derivatives are differences of tables.
const TOLERANCE: f64 = 1e-4;
/// Largest direction cosine of a chief ray that the tables hold; beyond, their edge is read.
const LARGEST_CHIEF: f64 = 0.5;
/// Layers of which the first that a pixel has is its spacer.
const SPACERS: [&str; 2] = ["oxide", "wiring"];
/// Tables kept, so that a derivative by a parameter of lens or shift law needs no waves, nor do the starts of another
/// drawn camera.
const KEPT_TABLES: usize = 128;

/// What a camera is besides its pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Optics {
    /// F-number of kernels and sheets, the widest.
    pub f_number: f64,
    /// Field at which h of the lens's law is 1, mm on the sensor.
    pub unit_mm: f64,
    /// Side of the kernels, px of the views.
    pub side: usize,
    /// Pixel of the views, µm.
    pub view_pixel_um: f64,
    /// The lens, for planes.
    pub conjugates: Conjugates,
    /// Where the pixel collects charge.
    pub collected_at: CollectedAt,
}

/// A camera to be fitted.
pub struct CameraModel<'k> {
    stack: PixelStack,
    /// Name of its spacer.
    spacer: &'static str,
    optics: Optics,
    wavelength_nm: f64,
    fineness: Fineness,
    /// Slices of every microlens, thin or thick: their number must not change along a search.
    slices: f64,
    /// Largest direction cosines of the tables, along u and v.
    reach: [f64; 2],
    pupil: Vec<[f64; 2]>,
    tables: Mutex<Vec<(Vec<u64>, Arc<PixelTable>)>>,
    keeping: Option<Keeping<'k>>,
}

impl<'k> CameraModel<'k> {
    /// Of a pixel of two columns whose layers are `stack`'s but for those that are fitted.
    ///
    /// # Errors
    /// A pixel without two columns, or without a spacer, a layer named `oxide` or `wiring`, whose thickness is fitted.
    pub fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        optics: Optics,
        fineness: Fineness,
    ) -> Result<Self, FitError> {
        let refused = |field: &'static str, value: String, allowed: &'static str| {
            quadpixel::range::OutOfRange::new("pixel", field, value, allowed)
        };
        if stack.subpixels != Subpixels::DUAL_X {
            return Err(refused("subpixels", stack.subpixels.to_string(), "2x1").into());
        }
        let spacer = SPACERS.into_iter().find(|name| stack.layer(name).is_some());
        let Some(spacer) = spacer else {
            let allowed = "one named `oxide` or `wiring`, whose thickness is fitted";
            return Err(refused("layers", "without it".into(), allowed).into());
        };
        let points = fineness.pupil_points;
        // A sunflower's seeds: even over the disk (H. Vogel, Math. Biosci. 44, 179 (1979)).
        let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
        let pupil = (0..points)
            .map(|i| {
                let radius = ((i as f64 + 0.5) / points as f64).sqrt();
                let (sin, cos) = (golden * i as f64).sin_cos();
                [radius * cos, radius * sin]
            })
            .collect();
        let slice_um = fineness.table.wave.slice_nm * 1e-3;
        let slices = [
            stack.sag_um() / slice_um,
            std::f64::consts::FRAC_1_SQRT_2 * stack.pitch_um / THICKEST_UM,
        ];
        let rim = 0.5 / (0.9 * optics.f_number);
        Ok(Self {
            stack: stack.clone(),
            spacer,
            optics,
            wavelength_nm,
            fineness,
            slices: slices.into_iter().fold(1.0, f64::max).ceil(),
            reach: [rim + LARGEST_CHIEF, rim],
            pupil,
            tables: Mutex::new(Vec::new()),
            keeping: None,
        })
    }

    /// The same with its tables kept from run to run: of layers that are held, as each change of them makes another.
    pub fn keeping(self, keeping: Keeping<'k>) -> Self {
        Self {
            keeping: Some(keeping),
            ..self
        }
    }

    /// Side of the kernels, px.
    pub fn side(&self) -> usize {
        self.optics.side
    }

    /// Directions and lens shifts of a pixel's table: the answers that a new set of layers, or of light, calls for.
    pub fn table_size(&self) -> [usize; 2] {
        PixelTable::size(self.reach, &self.fineness.table)
    }

    /// Of the light, nm.
    pub fn wavelength_nm(&self) -> f64 {
        self.wavelength_nm
    }

    /// The same camera in light of another wavelength.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn at_wavelength(&self, wavelength_nm: f64) -> Result<Self, FitError> {
        let other = Self::new(&self.stack, wavelength_nm, self.optics, self.fineness)?;
        Ok(Self {
            keeping: self.keeping,
            ..other
        })
    }

    /// The same camera with a pixel by Fourier modes, to confirm what waves found.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn by_modes(&self, settings: RcwaSettings) -> Result<Self, FitError> {
        let mut fineness = self.fineness;
        fineness.table.modes = Some(settings);
        let other = Self::new(&self.stack, self.wavelength_nm, self.optics, fineness)?;
        Ok(Self {
            keeping: self.keeping,
            ..other
        })
    }

    /// Thicknesses this far apart have light that goes to and fro in them in phase, µm.
    pub fn fringe_um(&self) -> f64 {
        0.5e-3 * self.wavelength_nm / OXIDE_INDEX
    }

    /// The fitted layers as the pixel has them that the fit begins with, in the order of [`LAYERS`].
    ///
    /// # Errors
    /// A microlens of a material whose index is not known at the wavelength.
    pub fn layers(&self) -> Result<[f64; 6], FitError> {
        let stack = &self.stack;
        let spacer = stack.layer(self.spacer).map_or(0.0, |l| l.thickness_um);
        let index = stack.lens.material.index(self.wavelength_nm)?;
        let Isolation {
            split_um,
            border_um,
        } = stack.isolation;
        Ok([
            stack.lens.radius_um,
            spacer,
            stack.silicon_um,
            index.re,
            split_um,
            border_um,
        ])
    }

    /// The pixel of a set of values.
    pub fn pixel(&self, values: &[f64]) -> PixelStack {
        let mut stack = self.stack.clone();
        let [radius, spacer, silicon, index, split_um, border_um] =
            LAYERS.map(|name| values[name as usize]);
        stack.lens.radius_um = radius;
        stack.isolation = Isolation {
            split_um,
            border_um,
        };
        stack.silicon_um = silicon;
        let resin = std::mem::replace(
            &mut stack.lens.material,
            Material::Constant { n: index, k: 0.0 },
        );
        for layer in stack.layers.iter_mut().filter(|l| l.material == resin) {
            layer.material.clone_from(&stack.lens.material);
        }
        if let Some(layer) = stack.layer_mut(self.spacer) {
            layer.thickness_um = spacer;
        }
        // The lens's lowest points lie on the layers; a pedestal is a part of the spacer.
        stack.lens.height_um = stack.sag_um() + 1e-3;
        stack
    }

    /// The model at a set of values, ready to be asked.
    ///
    /// # Errors
    /// A pixel that cannot be; a stop that was asked for.
    pub fn at<'a>(&'a self, values: &'a [f64]) -> Result<Set<'a>, FitError> {
        let key: Vec<u64> = LAYERS
            .iter()
            .map(|&n| values[n as usize].to_bits())
            .collect();
        let kept = || self.tables.lock().unwrap_or_else(PoisonError::into_inner);
        let found = kept()
            .iter()
            .find(|(k, _)| *k == key)
            .map(|(_, t)| t.clone());
        let table = match found {
            Some(table) => table,
            None => {
                let stack = self.pixel(values);
                let mut fineness = self.fineness.table;
                // A hair more than the thickness, so that rounding adds none.
                let slice_um = (1.0 + 1e-9) * stack.sag_um() / self.slices;
                fineness.wave.slice_nm = (1e3 * slice_um).max(5.0);
                let table = PixelTable::new(
                    &stack,
                    self.wavelength_nm,
                    self.reach,
                    &fineness,
                    self.keeping.as_ref(),
                )?;
                let table = Arc::new(table);
                let mut kept = kept();
                if kept.len() == KEPT_TABLES {
                    kept.remove(0);
                }
                kept.push((key, table.clone()));
                table
            }
        };
        let silicon = self.pixel(values).silicon_at(self.wavelength_nm)?;
        Ok(Set {
            model: self,
            values,
            table,
            wandering: Wandering::new(self.optics.collected_at, &silicon),
        })
    }
}
