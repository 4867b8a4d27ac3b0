//! Which pixel model a command asks, and how finely it computes.

use crate::exit::CommandError;
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
    /// With --model corrected: exact model that corrects the wave model; absent: fdtd.
    #[arg(long, value_parser = levels(Level::ALL.into_iter().filter(|l| l.is_exact())))]
    exact: Option<Level>,
    /// With --model corrected: how finely that exact model computes; absent: draft.
    #[arg(long, value_parser = presets(|_| None))]
    exact_preset: Option<Preset>,
    /// With --model corrected: number of runs of the exact model that the correction is fitted to; absent: 16.
    #[arg(long)]
    exact_runs: Option<usize>,
    /// With --model geometric: focal length of the ideal microlens, µm; absent: 7.
    #[arg(value_parser = number, long)]
    focal_length_um: Option<f64>,
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
    /// An option of another model is refused, not passed over. `is_corrected`: that is asked whatever the model.
    ///
    /// # Errors
    /// The option, and the model that it is of.
    pub fn check(&self, is_corrected: bool) -> Result<(), CommandError> {
        let is_exact = is_corrected || self.model == Level::Corrected;
        let options = [
            ("exact", self.exact.is_some(), is_exact, Level::Corrected),
            (
                "exact-preset",
                self.exact_preset.is_some(),
                is_exact,
                Level::Corrected,
            ),
            (
                "exact-runs",
                self.exact_runs.is_some(),
                is_exact,
                Level::Corrected,
            ),
            (
                "focal-length-um",
                self.focal_length_um.is_some(),
                self.model == Level::Geometric,
                Level::Geometric,
            ),
        ];
        match options
            .iter()
            .find(|(_, given, applies, _)| *given && !applies)
        {
            Some((option, _, _, level)) => Err(CommandError::input(format!(
                "--{option} with --model {}; allowed: with --model {level}",
                self.model
            ))),
            None => Ok(()),
        }
    }

    /// The model by name.
    pub fn choice(&self) -> ModelChoice {
        ModelChoice {
            level: self.model,
            preset: self.preset,
            exact: (
                self.exact.unwrap_or(ModelChoice::EXACT.0),
                self.exact_preset.unwrap_or(ModelChoice::EXACT.1),
                self.exact_runs.unwrap_or(ModelChoice::EXACT.2),
            ),
            focal_length_um: self.focal_length_um.unwrap_or(7.0),
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
