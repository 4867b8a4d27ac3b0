//! Scalar waves in a mosaic of colour filters.
//!
//! ```text
//!   one pixel    lens, layers above the filter     light that falls in as if all neighbours wore the same filter
//!   ═══════════  filter: sheets between which the light spreads, each times M(x, y) = exp(i k0 (n(x, y) − n) d)
//!   2×2 pixels   layers, silicon                   orders of half the spacing; absorption of each photodiode
//! ```
//! n is the index of the microlens asked for and n(x, y) that of the microlens above each place, so of filters that are
//! all alike the answer is [`super::WaveModel`]'s. Each colour is a pass of its own. What comes back up from below
//! meets filters alike, and the sheets are crossed by all light as straight down. P is within 0.014 of that of the
//! supercell by Fourier modes to 30°, 0.030 at 40° (`benches/runs/2026-11-26/wave_mosaic.md`).

use rustfft::num_complex::Complex64;

use super::budget::at_most;
use super::kept_modes::KeptModes;
use super::mask::Mask;
use super::planar::{FlatLayers, kz, plane_per_last};
use super::silicon::{Silicon, Surface};
use super::spectral::orders_within;
use super::{MATCHING_TOLERANCE, WaveModel, WaveSettings};
use crate::em::light::{
    Incidence, Light, PixelSolver, Powers, SolverError, SolverProgress, by_direction, largest,
};
use crate::em::mosaic::{FilterColour, MICROLENSES};
use crate::em::{PixelStack, StackError};

type C = Complex64;

/// Thickest sheet of a filter, µm.
const SHEET_UM: f64 = 0.15;

/// A pixel under a mosaic at one wavelength, ready to be lit from any direction.
pub struct WaveMosaic {
    stack: PixelStack,
    wavelength_nm: [f64; 1],
    settings: WaveSettings,
    k0: f64,
    surface: Surface,
    /// In the order of [`FilterColour::ALL`].
    colours: Vec<OneColour>,
    modes: KeptModes,
}

/// The pass of the light of one colour's microlenses.
struct OneColour {
    colour: FilterColour,
    /// Among neighbours alike.
    alike: WaveModel,
    /// Index of its filter.
    filter: C,
    sheets: usize,
    sheet_um: f64,
    /// What lies below the first and below the last sheet.
    below: [FlatLayers; 2],
    mask: Mask,
}

/// What one colour's pass finds under one lens shift, as parts of the light on the period.
struct Found {
    /// Of the photodiodes of the period, row by row.
    absorbed: Vec<f64>,
    reflected: f64,
    transmitted: f64,
    imbalance: f64,
    residual: f64,
}

impl WaveMosaic {
    /// The pixel at one wavelength.
    ///
    /// # Errors
    /// A pixel without a mosaic; else as of [`WaveModel::new`].
    pub fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        settings: &WaveSettings,
    ) -> Result<Self, StackError> {
        let n = stack.indices(wavelength_nm)?;
        let Some(filters) = n.mosaic else {
            let allowed = "red and blue filters in [mosaic]";
            return Err(StackError::value("mosaic", "absent", allowed));
        };
        let colours: Vec<OneColour> = (FilterColour::ALL.into_iter())
            .map(|colour| OneColour::new(stack, wavelength_nm, settings, colour, filters.n))
            .collect::<Result<_, _>>()?;
        let k0 = colours[0].alike.k0;
        let surface = colours[0].alike.surface;
        // Without trenches the modes are the orders, and only those above carry light.
        let cutoff = match stack.trench_um > 0.0 {
            true => settings.silicon_cutoff * n.silicon.re * k0,
            false => colours.iter().map(|c| c.alike.cutoff).fold(0.0, f64::max),
        };
        Ok(Self {
            stack: stack.clone(),
            wavelength_nm: [wavelength_nm],
            settings: *settings,
            k0,
            surface,
            modes: KeptModes::new(stack, [n.silicon, n.trench], k0, cutoff),
            colours,
        })
    }

    /// The pass of one colour: what is found of its own microlenses is what is asked for.
    fn pass(
        &self,
        one: &OneColour,
        [u, v]: [f64; 2],
        shifts_um: &[[f64; 2]],
    ) -> Result<Vec<Found>, StackError> {
        let falling = one.alike.falling(u, v)?;
        let bloch = [u * self.k0, v * self.k0];
        let period_um = self.stack.period_um();
        let (k0, silicon_index) = (self.k0, self.surface.silicon);
        let orders = orders_within(one.alike.cutoff, k0, period_um, bloch);
        let (m, n) = (self.stack.subpixels.m(), self.stack.subpixels.n());
        let modes = [self.modes.at(bloch[0], m), self.modes.at(bloch[1], n)];
        let silicon = Silicon::new(self.surface, k0, period_um, bloch, modes);
        let first: Vec<C> = (falling.orders.iter().zip(&falling.down))
            .map(|(o, d)| d * plane_per_last(&one.below[0], silicon_index, k0, o.k_perp_squared))
            .collect();
        let spread: Vec<C> = (orders.iter())
            .map(|o| (C::I * kz(one.filter, k0, o.k_perp_squared) * one.sheet_um).exp())
            .collect();
        let last: Vec<C> = (orders.iter())
            .map(|o| 1.0 / plane_per_last(&one.below[1], silicon_index, k0, o.k_perp_squared))
            .collect();
        let g = 2.0 * std::f64::consts::PI / self.stack.pitch_um;
        let budget = falling.budget;
        let under = |shift_um: &[f64; 2]| {
            // The orders of one pixel, about the middle of four: the first microlens's centre lies half a pitch before.
            let lit = falling.orders.iter().zip(&first).map(|(o, psi)| {
                let odd = (o.a + o.b).rem_euclid(2) == 1;
                let phase = C::cis(-g * (o.a as f64 * shift_um[0] + o.b as f64 * shift_um[1]));
                let psi = psi * phase;
                ([2 * o.a, 2 * o.b], if odd { -psi } else { psi })
            });
            let lit: Vec<([i64; 2], C)> = lit.collect();
            let mut field = one.mask.through(&lit, &orders);
            for _ in 1..one.sheets {
                let lit: Vec<([i64; 2], C)> = (orders.iter().zip(&field).zip(&spread))
                    .map(|((o, psi), spread)| ([o.a, o.b], psi * spread))
                    .collect();
                field = one.mask.through(&lit, &orders);
            }
            let down: Vec<C> = field.iter().zip(&last).map(|(f, l)| f * l).collect();
            let (modes, _) = silicon.enter(&orders, &down, MATCHING_TOLERANCE);
            let part = budget.scale / budget.incoming;
            let planes = self.settings.absorption_planes;
            let absorbed = silicon.absorbed(&modes, self.stack.silicon_um, planes);
            let below = silicon.flux_below(&modes, self.stack.silicon_um);
            let entering = budget.scale * budget.entering;
            let (_, found) = at_most(part * (absorbed.iter().sum::<f64>() + below), entering);
            let part = part / (1.0 + found);
            Found {
                absorbed: absorbed.into_iter().map(|a| a * part).collect(),
                reflected: 1.0 - entering,
                transmitted: part * below,
                imbalance: largest([budget.balance - 1.0, found]),
                residual: falling.residual,
            }
        };
        Ok(shifts_um.iter().map(under).collect())
    }

    /// Light of passes that were made under one lens shift; photodiodes of other colours stay dark.
    fn light_of(&self, passes: &[(FilterColour, &Found)]) -> Light {
        let mut powers = Powers {
            absorbed: vec![0.0; self.stack.photodiodes()],
            ..Powers::default()
        };
        let mut light = Light::default();
        let columns = self.stack.subpixels.m() * self.stack.microlenses_across();
        let count = self.stack.subpixels.count();
        let mut covered = 0.0;
        for (colour, found) in passes {
            for (microlens, of) in FilterColour::OF_MICROLENSES.iter().enumerate() {
                if of != colour {
                    continue;
                }
                covered += 1.0;
                for index in microlens * count..(microlens + 1) * count {
                    let (column, row) = self.stack.photodiode_column_row(index);
                    powers.absorbed[index] = found.absorbed[row * columns + column];
                }
                powers.reflected += found.reflected;
                powers.transmitted += found.transmitted;
            }
            light.residual = light.residual.max(found.residual);
            if found.imbalance.abs() > light.imbalance.abs() {
                light.imbalance = found.imbalance;
            }
        }
        powers.reflected /= covered;
        powers.transmitted /= covered;
        powers.elsewhere = 1.0 - powers.balance();
        Light {
            mean: powers,
            ..light
        }
    }
}

impl PixelSolver for WaveMosaic {
    fn stack(&self) -> &PixelStack {
        &self.stack
    }

    fn wavelengths_nm(&self) -> &[f64] {
        &self.wavelength_nm
    }

    fn light(
        &self,
        waves: &[Incidence],
        _: usize,
        _: &dyn Fn(SolverProgress),
    ) -> Result<Vec<Vec<Light>>, SolverError> {
        by_direction(waves, |direction, shifts_um| {
            let passes = self.colours.iter().map(|one| {
                let found = self.pass(one, direction, shifts_um)?;
                Ok((one.colour, found))
            });
            let passes: Vec<(FilterColour, Vec<Found>)> =
                passes.collect::<Result<_, StackError>>()?;
            let under = |k: usize| {
                let found = passes.iter().map(|(colour, found)| (*colour, &found[k]));
                self.light_of(&found.collect::<Vec<_>>())
            };
            Ok((0..shifts_um.len()).map(under).collect())
        })
    }

    fn light_on_microlens(&self, waves: &[Incidence]) -> Result<Vec<Light>, SolverError> {
        let colour = (self.stack.mosaic.as_ref()).map_or_else(FilterColour::default, |m| m.colour);
        let one = self.colours.iter().find(|one| one.colour == colour);
        let Some(one) = one else {
            return Err(SolverError::value(
                "mosaic.colour",
                colour.name(),
                "one of three",
            ));
        };
        let answers = by_direction(waves, |direction, shifts_um| {
            let found = self.pass(one, direction, shifts_um)?;
            let light = found.iter().map(|f| self.light_of(&[(colour, f)]));
            Ok(light.map(|l| l.on_microlens(&self.stack)).collect())
        })?;
        Ok(answers.into_iter().flatten().collect())
    }
}

impl OneColour {
    fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        settings: &WaveSettings,
        colour: FilterColour,
        filters: [C; MICROLENSES],
    ) -> Result<Self, StackError> {
        let own = stack.with_single_filter(colour)?;
        let alike = WaveModel::new(&own, wavelength_nm, settings)?;
        let n = own.indices(wavelength_nm)?;
        let Some((layer, sheet)) = own.filter_layer() else {
            return Err(StackError::value(
                "filter",
                "absent",
                "the layer that the mosaic colours",
            ));
        };
        let thickness_um = sheet.thickness_um;
        let sheets = (thickness_um / SHEET_UM).ceil().max(1.0) as usize;
        let sheet_um = thickness_um / sheets as f64;
        let filter = n.layers[layer];
        let below = |rest_um: f64| FlatLayers::below_plane(&own, &n, layer, rest_um);
        let passes = filters.map(|other| (C::I * alike.k0 * (other - filter) * sheet_um).exp());
        let period_um = stack.period_um();
        let g = 2.0 * std::f64::consts::PI / period_um;
        Ok(Self {
            colour,
            filter,
            sheets,
            sheet_um,
            below: [below(thickness_um - 0.5 * sheet_um), below(0.5 * sheet_um)],
            mask: Mask::new(
                passes,
                2 + 2 * (((alike.cutoff + alike.k0) / g).ceil() as usize + 1),
            ),
            alike,
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::em::Material;
    use crate::em::mosaic::Mosaic;

    fn dual(red: Material, blue: Material) -> PixelStack {
        let mut stack = PixelStack::builtin("1.4um-dual").unwrap();
        stack.isolation.border_um = 0.1;
        stack.mosaic = Some(Mosaic {
            red,
            blue,
            colour: FilterColour::Green,
        });
        stack
    }

    #[test]
    fn filters_that_are_all_alike_give_the_single_pixel() {
        let any = Material::Constant { n: 1.5, k: 0.0 };
        let mut stack = dual(any.clone(), any);
        let green = stack.layer("filter").unwrap().material.clone();
        let mosaic = stack.mosaic.as_mut().unwrap();
        (mosaic.red, mosaic.blue) = (green.clone(), green);
        let settings = WaveSettings::draft();
        let of_four = WaveMosaic::new(&stack, 550.0, &settings).unwrap();
        let alone = stack.with_single_filter(FilterColour::Green).unwrap();
        let alone = WaveModel::new(&alone, 550.0, &settings).unwrap();
        for shift_um in [[0.0, 0.0], [0.3, -0.1]] {
            let waves = [Incidence {
                direction: [0.21, -0.07],
                shift_um,
            }];
            let light = of_four.light(&waves, 1, &|_| ()).unwrap()[0][0].clone();
            let one = alone.light(&waves, 1, &|_| ()).unwrap()[0][0].clone();
            for microlens in stack.by_microlens(&light.mean.absorbed) {
                for (p, wanted) in microlens.iter().zip(&one.mean.absorbed) {
                    assert!((p - wanted).abs() < 1e-6, "{p} {wanted}");
                }
            }
            assert!((light.mean.transmitted - one.mean.transmitted).abs() < 1e-6);
            assert!((light.mean.balance() - 1.0).abs() < 1e-12);
        }
    }
}
