//! Which pixel model a command asks, and how finely it computes.

use crate::number::number;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use quadpixel::em::{Level, ModelChoice, PixelModel, PixelStack, Preset};
use quadpixel::response::TableSettings;

/// Arguments that choose a pixel model.
#[derive(Args)]
pub struct PixelModelArgs {
    /// Model of the pixel's response, such as rcwa.
    #[arg(long, value_parser = levels(Level::ALL), default_value_t = Level::default())]
    model: Level,
    /// How finely the model computes; finer takes longer.
    #[arg(long, value_parser = presets(|_| None), default_value_t = Preset::default())]
    preset: Preset,
    /// Exact model that corrects the wave model (--model corrected).
    #[arg(
        long,
        value_parser = levels(Level::ALL.into_iter().filter(|l| l.is_exact())),
        default_value_t = ModelChoice::EXACT.0
    )]
    exact: Level,
    /// How finely that exact model computes.
    #[arg(long, value_parser = presets(|_| None), default_value_t = ModelChoice::EXACT.1)]
    exact_preset: Preset,
    /// Number of runs of the exact model that the correction is fitted to.
    #[arg(long, default_value_t = ModelChoice::EXACT.2)]
    exact_runs: usize,
    /// Focal length of the ideal microlens of the geometric model, µm.
    #[arg(value_parser = number, long, default_value_t = 7.0)]
    focal_length_um: f64,
}

/// Models by name, each with a line of help.
fn levels(levels: impl IntoIterator<Item = Level>) -> impl TypedValueParser<Value = Level> {
    let value = |level: Level| PossibleValue::new(level.name()).help(level.about());
    let names: Vec<PossibleValue> = levels.into_iter().map(value).collect();
    PossibleValuesParser::new(names).try_map(|name| name.parse::<Level>())
}

/// Presets by name, each with a line of help.
pub fn presets(about: fn(Preset) -> Option<&'static str>) -> impl TypedValueParser<Value = Preset> {
    let value = |preset: Preset| PossibleValue::new(preset.name()).help(about(preset));
    PossibleValuesParser::new(Preset::ALL.map(value)).try_map(|name| name.parse::<Preset>())
}

impl PixelModelArgs {
    /// The model by name.
    pub fn choice(&self) -> ModelChoice {
        ModelChoice {
            level: self.model,
            preset: self.preset,
            exact: (self.exact, self.exact_preset, self.exact_runs),
            focal_length_um: self.focal_length_um,
        }
    }

    /// The model for single directions.
    pub fn model(&self) -> PixelModel {
        self.choice().model()
    }

    /// The model's table of a pixel.
    pub fn table(&self, stack: &PixelStack) -> TableSettings {
        TableSettings::for_choice(&self.choice(), stack)
    }

    /// The model's table of a pixel under all shifts of its lens.
    pub fn shifted(&self, stack: &PixelStack, per_pitch: usize) -> TableSettings {
        TableSettings::for_all_shifts(&self.choice(), stack, per_pitch)
    }

    /// The model's name, as it is given.
    pub fn name(&self) -> &'static str {
        self.model.name()
    }
}
