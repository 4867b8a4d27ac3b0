//! Three points between speed and accuracy.
//!
//! 2.9 times the rays halve the noise of a chart (`benches/runs/2026-11-21/accuracy.md`); the grid of directions is that of
//! [`TableSettings`]. Where channels have bands, 2, 4 or 8 wavelengths stand for each.

use clap::ValueEnum;
use quadpixel::em::{self, Level, PixelStack};
use quadpixel::response::TableSettings;
use serde::{Deserialize, Serialize};

use crate::config::{DatasetConfig, ResponseConfig};

/// How finely the wave level's table is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WaveGrid {
    /// Quick looks.
    Draft,
    /// The default.
    #[default]
    Standard,
    /// Converged; minutes per pixel, once.
    Reference,
}

impl WaveGrid {
    /// Whether it is the usual one.
    pub fn is_standard(&self) -> bool {
        *self == Self::Standard
    }

    /// The table's settings for a pixel.
    pub fn settings(self, stack: &PixelStack) -> TableSettings {
        match self {
            Self::Draft => TableSettings::new(Level::Wave, em::Preset::Draft, stack),
            Self::Standard => TableSettings::new(Level::Wave, em::Preset::Standard, stack),
            Self::Reference => TableSettings::new(Level::Wave, em::Preset::Reference, stack),
        }
    }

    /// What the table is off by against independent Fourier modal curves (`benches/runs/2026-11-21/response.md`), for people.
    pub fn error(self) -> &'static str {
        match self {
            Self::Draft => "within 0.05 of the light that falls on the pixel",
            Self::Standard => {
                "strong half within 8 %, weak half within 0.04; between directions 0.5 % of the peak"
            }
            Self::Reference => {
                "strong half within 8 %, weak half within 0.04 (the wave level's own); converged to a few parts in a thousand"
            }
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
        let (rays, grid, wavelengths) = match self {
            Self::Draft => (32, WaveGrid::Draft, 2),
            Self::Standard => (128, WaveGrid::Standard, 4),
            Self::Reference => (512, WaveGrid::Reference, 8),
        };
        config.rays_per_pixel = rays;
        if let Some(bands) = &mut config.spectrum {
            bands.wavelengths = wavelengths;
        }
        if let ResponseConfig::Wave { grid: own, .. } = &mut config.response {
            *own = grid;
        }
    }
}
