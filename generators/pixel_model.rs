//! Which pixel model a command asks, and how finely it computes.

use clap::{Args, ValueEnum};
use quadpixel::em::PixelStack;
use quadpixel::em::fdtd::FdtdSettings;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::wave::WaveSettings;
use quadpixel::response::{CorrectedSettings, PixelModel, ShiftedSettings, TableSettings};

/// Arguments that choose a pixel model.
#[derive(Args)]
pub struct PixelModelArgs {
    /// Model of the pixel's response, such as rcwa.
    #[arg(long, value_enum, default_value_t = Model::Wave)]
    model: Model,
    /// How finely the model computes; finer takes longer.
    #[arg(long, value_enum, default_value_t = Preset::Standard)]
    preset: Preset,
    /// Exact model that corrects the wave model (--model corrected).
    #[arg(long, value_enum, default_value_t = Exact::Fdtd)]
    exact: Exact,
    /// How finely that exact model computes.
    #[arg(long, value_enum, default_value_t = Preset::Draft)]
    exact_preset: Preset,
    /// Number of runs of the exact model that the correction is fitted to.
    #[arg(long, default_value_t = 16)]
    exact_runs: usize,
    /// Focal length of the ideal microlens of the geometric model, µm.
    #[arg(long, default_value_t = 7.0)]
    focal_length_um: f64,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Model {
    /// The ideal box of the paper's equation 2.
    Geometric,
    /// Scalar wave propagation through the pixel stack.
    Wave,
    /// Maxwell's equations in time, both polarizations: seconds to minutes per direction.
    Fdtd,
    /// The wave model, corrected by a smooth fit of its difference to a few runs of an exact model (--exact, --exact-runs).
    Corrected,
    /// Maxwell's equations by Fourier modes, both polarizations: a second to a minute per direction.
    Rcwa,
}

/// An exact model that corrects the wave model.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Exact {
    /// Maxwell's equations in time.
    Fdtd,
    /// Maxwell's equations by Fourier modes.
    Rcwa,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Preset {
    Draft,
    Standard,
    Reference,
}

impl PixelModelArgs {
    /// The model for single directions.
    pub fn model(&self) -> PixelModel {
        let focal_length_um = self.focal_length_um;
        match (self.model, self.preset) {
            (Model::Geometric, _) => PixelModel::Geometric { focal_length_um },
            (Model::Wave, Preset::Draft) => PixelModel::Wave(WaveSettings::draft()),
            (Model::Wave, Preset::Standard) => PixelModel::Wave(WaveSettings::standard()),
            (Model::Wave, Preset::Reference) => PixelModel::Wave(WaveSettings::reference()),
            (Model::Fdtd, Preset::Draft) => PixelModel::Fdtd(FdtdSettings::draft()),
            (Model::Fdtd, Preset::Standard) => PixelModel::Fdtd(FdtdSettings::standard()),
            (Model::Fdtd, Preset::Reference) => PixelModel::Fdtd(FdtdSettings::reference()),
            (Model::Rcwa, Preset::Draft) => PixelModel::Rcwa(RcwaSettings::draft()),
            (Model::Rcwa, Preset::Standard) => PixelModel::Rcwa(RcwaSettings::standard()),
            (Model::Rcwa, Preset::Reference) => PixelModel::Rcwa(RcwaSettings::reference()),
            (Model::Corrected, _) => PixelModel::Corrected(self.corrected()),
        }
    }

    /// The corrected level, with the wave model of the preset.
    pub fn corrected(&self) -> CorrectedSettings {
        let exact = match (self.exact, self.exact_preset) {
            (Exact::Fdtd, Preset::Draft) => PixelModel::Fdtd(FdtdSettings::draft()),
            (Exact::Fdtd, Preset::Standard) => PixelModel::Fdtd(FdtdSettings::standard()),
            (Exact::Fdtd, Preset::Reference) => PixelModel::Fdtd(FdtdSettings::reference()),
            (Exact::Rcwa, Preset::Draft) => PixelModel::Rcwa(RcwaSettings::draft()),
            (Exact::Rcwa, Preset::Standard) => PixelModel::Rcwa(RcwaSettings::standard()),
            (Exact::Rcwa, Preset::Reference) => PixelModel::Rcwa(RcwaSettings::reference()),
        };
        CorrectedSettings {
            wave: match self.preset {
                Preset::Draft => WaveSettings::draft(),
                Preset::Standard => WaveSettings::standard(),
                Preset::Reference => WaveSettings::reference(),
            },
            ..CorrectedSettings::with(exact, self.exact_runs)
        }
    }

    /// The model's table of a pixel.
    pub fn table(&self, stack: &PixelStack) -> TableSettings {
        match (self.model, self.preset) {
            (Model::Geometric, _) => TableSettings::geometric(self.focal_length_um),
            (Model::Wave, Preset::Draft) => TableSettings::wave_draft(),
            (Model::Wave, Preset::Standard) => TableSettings::wave_standard_for(stack),
            (Model::Wave, Preset::Reference) => TableSettings::wave_reference(),
            (Model::Fdtd, Preset::Draft) => TableSettings::fdtd_draft(),
            (Model::Fdtd, Preset::Standard) => TableSettings::fdtd_standard(),
            (Model::Fdtd, Preset::Reference) => TableSettings::fdtd_reference(stack),
            (Model::Corrected, _) => TableSettings {
                model: PixelModel::Corrected(self.corrected()),
                ..TableSettings::wave_standard_for(stack)
            },
            (Model::Rcwa, Preset::Draft) => TableSettings::rcwa_draft(),
            (Model::Rcwa, Preset::Standard) => TableSettings::rcwa_standard_for(stack),
            (Model::Rcwa, Preset::Reference) => TableSettings::rcwa_reference(),
        }
    }

    /// The model's table of a pixel under all shifts of its lens.
    pub fn shifted(&self, stack: &PixelStack) -> ShiftedSettings {
        let mut settings = ShiftedSettings::wave_for(stack);
        match (self.model, self.preset) {
            (Model::Wave, Preset::Standard) => {}
            (Model::Wave, Preset::Draft) => settings.table.steps = 12,
            (Model::Rcwa, Preset::Standard) => settings = ShiftedSettings::rcwa_for(stack),
            _ => settings.table = self.table(stack),
        }
        settings
    }

    /// The model's name, as it is given.
    pub fn name(&self) -> &'static str {
        match self.model {
            Model::Geometric => "geometric",
            Model::Wave => "wave",
            Model::Fdtd => "fdtd",
            Model::Corrected => "corrected",
            Model::Rcwa => "rcwa",
        }
    }
}
