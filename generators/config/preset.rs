//! Three points between speed and accuracy.
//!
//! 2.9 times the rays halve the noise of a chart (`benches/runs/2026-11-21/accuracy.md`); the grid of directions is
//! that of [`quadpixel::response::TableSettings`]. Where channels have bands, 2, 4 or 8 wavelengths stand for each.

use clap::ValueEnum;
use quadpixel::em;

use crate::config::{DatasetConfig, ResponseConfig};

/// What a wave level's table is off by against independent Fourier modal curves
/// (`benches/runs/2026-11-21/response.md`), for people.
pub fn wave_error(preset: em::Preset) -> &'static str {
    match preset {
        em::Preset::Draft => "within 0.05 of the light that falls on the pixel",
        em::Preset::Standard => {
            "strong half within 8 %, weak half within 0.04; between directions 0.5 % of the peak"
        }
        em::Preset::Reference => {
            "strong half within 8 %, weak half within 0.04 (the wave level's own); converged to a few parts in a thousand"
        }
    }
}

/// See the module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// 32 rays per microlens and channel, coarse response tables: a quarter of the time, twice the noise.
    Draft,
    /// 128 rays per microlens and channel: the default.
    Standard,
    /// 512 rays per microlens and channel, converged response tables: four times the time, half the noise.
    Reference,
}

impl Preset {
    /// Puts its numbers in the place of the configuration's.
    pub fn apply(self, config: &mut DatasetConfig) {
        let (rays, table, wavelengths) = match self {
            Self::Draft => (32, em::Preset::Draft, 2),
            Self::Standard => (128, em::Preset::Standard, 4),
            Self::Reference => (512, em::Preset::Reference, 8),
        };
        config.rays_per_pixel = rays;
        if let Some(bands) = &mut config.spectrum {
            bands.wavelengths = wavelengths;
        }
        if let ResponseConfig::Wave { preset, .. } = &mut config.response {
            *preset = table;
        }
    }
}
