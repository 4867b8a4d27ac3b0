//! Three points between speed and accuracy.
//!
//! 2.9 times the rays halve the noise of a chart (`benches/runs/2026-11-21/accuracy.md`); the grid of directions is
//! that of [`quadpixel::response::TableSettings`]. Where channels have bands, 2, 4 or 8 wavelengths stand for each. The
//! reference traces its rays through the lens surface by surface, the others by maps.

use quadpixel::em::Preset;
use quadpixel::render::LensTracing;

use crate::assemble::all_ship;
use crate::config::{DatasetConfig, ResponseConfig};

/// What a dataset of a preset takes and gives, for people.
pub fn about(preset: Preset) -> &'static str {
    match preset {
        Preset::Draft => {
            "32 rays per microlens and channel; response tables that do not come with the program are coarse ones: half the time, twice the noise"
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
    let (subpixels, bands) = (config.sensor.subpixels, config.spectrum);
    match &mut config.response {
        ResponseConfig::Simulated(table) if table.level.is_quick() => {
            table.choice.preset = Preset::default();
            // Coarse tables would have to be made, in minutes.
            if preset != Preset::Draft || !all_ship(table, subpixels, bands).unwrap_or(false) {
                table.choice.preset = preset;
            }
        }
        _ => {}
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use crate::config::DEFAULT_TOML;

    #[test]
    fn a_draft_makes_no_coarse_table_where_a_better_one_comes_with_the_program() {
        let preset_of = |pixels: &[&str], preset| {
            let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "default.toml").unwrap();
            let ResponseConfig::Simulated(table) = &mut config.response else {
                panic!("the default has tables");
            };
            if !pixels.is_empty() {
                table.pixels = pixels.iter().map(ToString::to_string).collect();
            }
            apply(preset, &mut config);
            match config.response {
                ResponseConfig::Simulated(table) => table.choice.preset,
                _ => panic!("the default has tables"),
            }
        };
        assert_eq!(preset_of(&[], Preset::Draft), Preset::Standard);
        assert_eq!(preset_of(&["6um-dual"], Preset::Draft), Preset::Draft);
        assert_eq!(
            preset_of(&["2.8um", "6um-dual"], Preset::Draft),
            Preset::Draft
        );
        assert_eq!(preset_of(&[], Preset::Reference), Preset::Reference);
    }
}
