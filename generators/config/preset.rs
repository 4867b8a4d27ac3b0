//! Three points between speed and accuracy.
//!
//! 3 times the rays halve the noise of a chart (`benches/runs/2026-11-29/footprints.md`); the grid of directions is
//! that of [`quadpixel::response::TableSettings`]. Where channels have bands, 2, 4 or 8 wavelengths stand for each. The
//! reference traces its rays through the lens surface by surface and looks charts up at points; the others have maps
//! and areas.

use quadpixel::em::Preset;
use quadpixel::render::LensTracing;

use crate::assemble::all_ship;
use crate::config::{DatasetConfig, ResponseConfig};

/// What a dataset of a preset takes and gives, for people.
pub fn about(preset: Preset) -> &'static str {
    match preset {
        Preset::Draft => {
            "24 rays per microlens and channel, 32 in worlds; response tables that do not come with the program are coarse ones: 1.5 times the noise"
        }
        Preset::Standard => "48 rays per microlens and channel, 96 in worlds: the default",
        Preset::Reference => {
            "512 rays per microlens and channel, each for a point, through the lens surface by surface; converged response tables: many times the time, 0.4 of the noise"
        }
    }
}

/// Rays a microlens and colour channel of a preset: of cards, whose pictures rays look up over areas, half as many as
/// where each ray stands for a point.
pub fn rays(preset: Preset, config: &DatasetConfig) -> usize {
    let is_of_cards = config.scene.world.is_none() && config.scene.rgbd.is_none();
    match (preset, is_of_cards) {
        (Preset::Draft, true) => 24,
        (Preset::Draft, false) => 32,
        (Preset::Standard, true) => 48,
        (Preset::Standard, false) => 96,
        (Preset::Reference, _) => 512,
    }
}

/// Puts a preset's numbers in the place of the configuration's.
pub fn apply(preset: Preset, config: &mut DatasetConfig) {
    let wavelengths = match preset {
        Preset::Draft => 2,
        Preset::Standard => 4,
        Preset::Reference => 8,
    };
    config.rays_per_pixel = Some(rays(preset, config));
    if preset == Preset::Reference {
        config.footprints = false;
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
