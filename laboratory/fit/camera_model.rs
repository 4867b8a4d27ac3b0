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
//! light, both chief ray and shift are left out.

use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec2;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::wave::WaveSettings;
use quadpixel::em::{Isolation, Material, PixelStack};
use quadpixel::render::truth::{TextureSpectrum, matched_shift_px};
use quadpixel::sensor::{CollectedAt, Subpixels, Wandering};
use rayon::prelude::*;

use super::conjugates::Conjugates;
use super::error::FitError;
use super::keeping::Keeping;
use super::lens_law::LensLaw;
use super::measurements::{Measurements, PlaneShifts, centroid_px, sum_of};
use super::parameters::{LAYERS, Name};
use super::pixel_table::{PixelTable, TableFineness};

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
/// Farthest that a microlens that parts the light equally stands beside where it brings the chief ray to the middle, of
/// the pitch; halvings of that.
const LARGEST_LEAN: f64 = 0.2;
const BISECTIONS: usize = 20;
/// Layers of which the first that a pixel has is its spacer.
const SPACERS: [&str; 2] = ["oxide", "wiring"];
/// Sign of the defocus of near points in the lens's law: their light comes together behind the sensor, so that what
/// goes to the right falls on the left of it.
const NEAR: f64 = -1.0;
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

/// The model at one set of values.
pub struct Set<'a> {
    model: &'a CameraModel<'a>,
    values: &'a [f64],
    table: Arc<PixelTable>,
    wandering: Wandering,
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

impl Set<'_> {
    fn value(&self, name: Name) -> f64 {
        self.values[name as usize]
    }

    /// How far a microlens stands beside where it would bring the chief ray to the middle of its pixel, µm along the
    /// split.
    pub fn shift_um(&self, x_mm: f64) -> f64 {
        let x = x_mm - self.value(Name::CentreXMm);
        let law = self.value(Name::Shift1)
            + x * x * (self.value(Name::Shift3) + x * x * self.value(Name::Shift5));
        self.value(Name::ShiftUm) + x * law
    }

    /// Direction cosines of the chief ray, from a pupil `pupil_mm` before the sensor.
    pub fn chief(&self, place_mm: [f64; 2]) -> [f64; 2] {
        let x = place_mm[0] - self.value(Name::CentreXMm);
        let y = place_mm[1] - self.value(Name::CentreYMm);
        let far = x.hypot(y).hypot(self.value(Name::PupilMm));
        [x / far, y / far]
    }

    /// P of left and right of every place in the pupil.
    fn weights(&self, place_mm: [f64; 2]) -> Vec<[f64; 2]> {
        self.weights_under(place_mm, self.shift_um(place_mm[0]), 1.0)
    }

    /// The same of a microlens so far beside where it would bring the chief ray to the middle, in a pupil of another
    /// F-number, over the camera's. From aside a pupil looks smaller, `∂(u, v)/∂(X, Y) = cos θ (1 − d dᵀ)` with d the
    /// chief ray: by cos³ θ along the field and cos θ across.
    fn weights_under(&self, place_mm: [f64; 2], shift_um: f64, stop: f64) -> Vec<[f64; 2]> {
        let rim = 0.5 / (self.value(Name::FNumber) * stop);
        let [u, v] = self.chief(place_mm);
        let smaller = rim * (1.0 - u * u - v * v).sqrt();
        let [along, both, across] = [1.0 - u * u, -u * v, 1.0 - v * v].map(|part| smaller * part);
        let shift = self.table.shift_for_um(u) + shift_um;
        let [diffusion, crosstalk] = [Name::DiffusionUm, Name::Crosstalk].map(|n| self.value(n));
        let halves = self
            .table
            .shifted(shift, diffusion, crosstalk, &self.wandering);
        let pupil = self.model.pupil.iter();
        pupil
            .map(|[x, y]| halves.at(u + along * x + both * y, both * x + across * y))
            .collect()
    }

    /// A white sheet in the left view over that in the right one, as recorded.
    pub fn sheet_ratio(&self, x_mm: f64) -> f64 {
        let weights = self.weights([x_mm, 0.0]);
        let sum = |half: usize| weights.iter().map(|w| w[half]).sum::<f64>();
        self.value(Name::LeftOverRight) * sum(0) / sum(1)
    }

    /// How far a microlens stands beside where both halves would get the same of a white sheet, µm along the split.
    pub fn beside_balance_um(&self, x_mm: f64) -> f64 {
        // The light goes along with the lens.
        let lean = |shift_um: f64| {
            let weights = self.weights_under([x_mm, 0.0], shift_um, 1.0);
            weights
                .iter()
                .map(|[left, right]| right - left)
                .sum::<f64>()
        };
        let most = LARGEST_LEAN * self.model.stack.pitch_um;
        let (mut low, mut high) = (-most, most);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            match lean(middle) < 0.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        self.shift_um(x_mm) - 0.5 * (low + high)
    }

    /// Part of the sheet's signal that the left view has.
    pub fn left_part(&self, x_mm: f64) -> f64 {
        let ratio = self.sheet_ratio(x_mm);
        ratio / (1.0 + ratio)
    }

    /// Kernels of left and right at a field, each of sum 1, the chief ray `place_px` from their middle.
    pub fn kernels(&self, field_mm: [f64; 2], place_px: [f64; 2]) -> [Vec<f64>; 2] {
        let side = self.model.optics.side;
        let law = LensLaw::new(self.values, field_mm, self.model.optics.unit_mm);
        let weights = self.weights(field_mm);
        let sigma = self.value(Name::BlurPx);
        let middle = (side as f64 - 1.0) * 0.5;
        let reach = 4.5 * sigma;
        let mut views = [vec![0.0; side * side], vec![0.0; side * side]];
        let mut across = Vec::with_capacity(side);
        for (&rho, weight) in self.model.pupil.iter().zip(&weights) {
            let at = law.at(rho);
            let [x, y] = [0, 1].map(|axis| at[axis] + place_px[axis] + middle);
            let span = |c: f64| {
                let low = (c - reach).ceil().max(0.0) as usize;
                let high = (c + reach).floor().min(side as f64 - 1.0);
                let end = if high < 0.0 { 0 } else { high as usize + 1 };
                low.min(end)..end
            };
            let gauss = |i: usize, c: f64| (-0.5 * ((i as f64 - c) / sigma).powi(2)).exp();
            let columns = span(x);
            across.clear();
            across.extend(columns.clone().map(|i| gauss(i, x)));
            for j in span(y) {
                let down = gauss(j, y);
                for (view, p) in views.iter_mut().zip(weight) {
                    let row = &mut view[j * side..][..side];
                    let factor = down * p;
                    for (to, g) in row[columns.clone()].iter_mut().zip(&across) {
                        *to += factor * g;
                    }
                }
            }
        }
        for view in &mut views {
            let sum: f64 = view.iter().sum();
            view.iter_mut()
                .for_each(|v| *v /= sum.max(f64::MIN_POSITIVE));
        }
        views
    }

    /// x_L − x_R that a matcher finds in a window of a textured plane, px of the views.
    pub fn plane_shift_px(&self, plane: &PlaneShifts, place_mm: [f64; 2]) -> f64 {
        let optics = &self.model.optics;
        let sine = 0.5 / self.value(Name::FNumber);
        let tangent = sine / (1.0 - sine * sine).sqrt();
        let focus_mm = self.value(Name::FocusMm);
        let radius_mm = (optics.conjugates).disk_radius_mm(focus_mm, plane.distance_mm, tangent);
        let radius_px = NEAR * 1e3 * radius_mm / optics.view_pixel_um;
        let law = LensLaw::new(self.values, place_mm, optics.unit_mm);
        let law = law.defocused(self.values, radius_px);
        let weights = self.weights_under(place_mm, self.shift_um(place_mm[0]), plane.stop);
        // A pixel sees a texture where its kernel puts a point, the other way.
        let offsets = self.model.pupil.iter().map(|rho| {
            let [x, y] = law.at(rho.map(|r| r / plane.stop));
            -DVec2::new(x, y)
        });
        let texture = TextureSpectrum {
            window_px: plane.window_px,
            ..TextureSpectrum::default()
        };
        matched_shift_px(&offsets.collect::<Vec<_>>(), &weights, &texture)
    }

    /// The places at which the measured kernels of each field lie, as far as centroids tell.
    pub fn places_px(&self, measured: &Measurements) -> Vec<[f64; 2]> {
        let side = measured.side;
        let place = |field: &super::measurements::FieldKernels| {
            let sum = sum_of(&field.views, field.left_part);
            let model = self.kernels(field.place_mm, [0.0; 2]);
            let model = sum_of(&model, self.left_part(field.place_mm[0]));
            let [a, b] = [centroid_px(&sum, side), centroid_px(&model, side)];
            [a[0] - b[0], a[1] - b[1]]
        };
        measured.fields.par_iter().map(place).collect()
    }
}
