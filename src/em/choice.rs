//! A pixel model by name and preset, turned into settings.

use super::PixelStack;
use super::fdtd::FdtdSettings;
use super::level::{DirectionSteps, Level, Preset};
use super::model::{CorrectedSettings, PixelModel};
use super::rcwa::RcwaSettings;
use super::wave::WaveSettings;

/// A model by name, and how finely it computes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModelChoice {
    /// The model.
    pub level: Level,
    /// How finely it computes; of the corrected level, how finely its wave model does.
    pub preset: Preset,
    /// Of the corrected level: the exact model, how finely it computes, and its runs.
    pub exact: (Level, Preset, usize),
    /// Of the geometric level: focal length of the ideal microlens, µm.
    pub focal_length_um: f64,
}

impl ModelChoice {
    /// The usual exact model of the corrected level: which, how finely it computes, and its runs.
    pub const EXACT: (Level, Preset, usize) = (Level::Fdtd, Preset::Draft, 16);

    /// A level at a preset, the rest as usual: corrected by 16 draft runs of FDTD, a microlens of 7 µm.
    pub fn new(level: Level, preset: Preset) -> Self {
        Self {
            level,
            preset,
            exact: Self::EXACT,
            focal_length_um: 7.0,
        }
    }

    /// The model with its settings.
    pub fn model(&self) -> PixelModel {
        match self.level {
            Level::Geometric => PixelModel::Geometric {
                focal_length_um: self.focal_length_um,
            },
            Level::Wave => PixelModel::Wave(self.wave()),
            Level::Fdtd => PixelModel::Fdtd(match self.preset {
                Preset::Draft => FdtdSettings::draft(),
                Preset::Standard => FdtdSettings::standard(),
                Preset::Reference => FdtdSettings::reference(),
            }),
            Level::Rcwa => PixelModel::Rcwa(match self.preset {
                Preset::Draft => RcwaSettings::draft(),
                Preset::Standard => RcwaSettings::standard(),
                Preset::Reference => RcwaSettings::reference(),
            }),
            Level::Corrected => PixelModel::Corrected(self.corrected()),
        }
    }

    /// Settings of the corrected level, whatever the level is.
    pub fn corrected(&self) -> CorrectedSettings {
        let (level, preset, runs) = self.exact;
        let exact = match level {
            // Refused by the model's check, as one that is not exact; a corrected one would be corrected for ever.
            Level::Corrected => Level::Wave,
            exact => exact,
        };
        let exact = Self {
            level: exact,
            preset,
            ..*self
        };
        CorrectedSettings {
            wave: self.wave(),
            ..CorrectedSettings::with(exact.model(), runs)
        }
    }

    fn wave(&self) -> WaveSettings {
        match self.preset {
            Preset::Draft => WaveSettings::draft(),
            Preset::Standard => WaveSettings::standard(),
            Preset::Reference => WaveSettings::reference(),
        }
    }

    /// Directions of its table of a pixel.
    pub fn directions(&self, stack: &PixelStack) -> DirectionSteps {
        self.level.directions(self.preset, stack)
    }

    /// Model and directions of its table of all lens shifts. The wave model leaves out the light that comes back from
    /// the trenches, so that all shifts share one solution of the lens; its solver's residual is then as small as the
    /// interpolation's error.
    pub fn for_all_shifts(&self, stack: &PixelStack) -> (PixelModel, DirectionSteps) {
        let (mut model, mut directions) = (self.model(), self.directions(stack));
        let standard = self.preset == Preset::Standard;
        match (&mut model, self.preset) {
            (PixelModel::Wave(settings), Preset::Draft | Preset::Standard) => {
                *settings = WaveSettings {
                    bounces: 0,
                    tolerance: 5e-3,
                    ..WaveSettings::standard()
                };
            }
            (PixelModel::Rcwa(_), Preset::Standard) => {}
            _ => return (model, directions),
        }
        if standard {
            directions.steps = directions.steps.min(24);
        }
        directions.refine = 3;
        (model, directions)
    }
}
