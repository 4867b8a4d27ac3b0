//! Three points between speed and accuracy.
//!
//! 2.9 times the rays halve the noise of a chart (`benches/runs/2026-11-21/accuracy.md`); the grid of directions is
//! that of [`quadpixel::response::TableSettings`]. Where channels have bands, 2, 4 or 8 wavelengths stand for each. The
//! reference traces its rays through the lens surface by surface, the others by maps.

use quadpixel::em::Preset;
use quadpixel::render::LensTracing;

use crate::config::{DatasetConfig, ResponseConfig};

/// What a dataset of a preset takes and gives, for people.
pub fn about(preset: Preset) -> &'static str {
    match preset {
        Preset::Draft => {
            "32 rays per microlens and channel, coarse response tables: half the time, twice the noise"
        }
        Preset::Standard => "96 rays per microlens and channel: the default",
        Preset::Reference => {
            "512 rays per microlens and channel, converged response tables: many times the time, 0.4 of the noise"
        }
    }
}

/// Puts a preset's numbers in the place of the configuration's.
pub fn apply(preset: Preset, config: &mut DatasetConfig) {
    let (rays, wavelengths) = match preset {
        Preset::Draft => (32, 2),
        Preset::Standard => (96, 4),
        Preset::Reference => (512, 8),
    };
    config.rays_per_pixel = rays;
    if preset == Preset::Reference {
        config.lens_tracing = LensTracing::EXACT;
    }
    if let Some(bands) = &mut config.spectrum {
        bands.wavelengths = wavelengths;
    }
    match &mut config.response {
        ResponseConfig::Simulated(table) if table.level.is_quick() => table.choice.preset = preset,
        _ => {}
    }
}
