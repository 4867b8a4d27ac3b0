//! Pixel models and presets by name: the one list of words, with what each is good for.
//!
//! A level is a model by its name, a preset a point between speed and accuracy. Everything that names a model (command
//! line, configuration, recipe, `meta.json`) uses these words.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use super::PixelStack;
use crate::range::OutOfRange;

/// A pixel model by its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// The ideal box of eq. 2.
    Geometric,
    /// Scalar waves.
    #[default]
    Wave,
    /// Maxwell's equations in time.
    Fdtd,
    /// The wave model, corrected by an exact one.
    Corrected,
    /// Maxwell's equations by Fourier modes.
    Rcwa,
}

/// How finely a model computes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Quick looks.
    Draft,
    /// The default.
    #[default]
    Standard,
    /// To compare others with.
    Reference,
}

/// Directions of a table, in steps from the normal to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectionSteps {
    /// Simulated steps.
    pub steps: usize,
    /// Table steps per simulated step.
    pub refine: usize,
}

impl Level {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::Geometric,
        Self::Wave,
        Self::Fdtd,
        Self::Corrected,
        Self::Rcwa,
    ];

    /// The level that rendering computes as rays need it, without a table.
    pub const IDEAL: Self = Self::Geometric;

    /// The word that names it everywhere.
    pub fn name(self) -> &'static str {
        self.words().0
    }

    /// One line for people.
    pub fn about(self) -> &'static str {
        self.words().1
    }

    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Geometric => ("geometric", "The ideal box of the paper's equation 2"),
            Self::Wave => ("wave", "Scalar wave propagation through the pixel stack"),
            Self::Fdtd => (
                "fdtd",
                "Maxwell's equations in time, both polarizations: seconds to minutes per direction",
            ),
            Self::Corrected => (
                "corrected",
                "The wave model, corrected by a smooth fit of its difference to a few runs of an exact model (--exact, --exact-runs)",
            ),
            Self::Rcwa => (
                "rcwa",
                "Maxwell's equations by Fourier modes, both polarizations: a second to a minute per direction",
            ),
        }
    }

    /// Whether it solves Maxwell's equations, so that it can correct others.
    pub fn is_exact(self) -> bool {
        matches!(self, Self::Fdtd | Self::Rcwa)
    }

    /// Whether an exact model corrects it.
    pub fn is_corrected(self) -> bool {
        self == Self::Corrected
    }

    /// Whether a dataset makes its tables unasked.
    pub fn is_quick(self) -> bool {
        matches!(self, Self::Geometric | Self::Wave)
    }

    /// Seconds of one core that a plane wave takes about, of a model whose tables take seconds to minutes, so that a
    /// dataset makes them unasked; `None` for the others.
    pub fn quick_run_s(self, stack: &PixelStack) -> Option<f64> {
        match self {
            Self::Geometric => Some(0.0),
            // Measured: `benches/runs/2026-11-21/cra.md`.
            // A mosaic: a pass per colour through four pixels (`benches/runs/2026-11-26/wave_mosaic.md`).
            Self::Wave => {
                let passes = match (&stack.mosaic, stack.trench_um > 0.0) {
                    (None, _) => 1.0,
                    (Some(_), false) => 5.0,
                    (Some(_), true) => 20.0,
                };
                Some(passes * 1.5e-3 * (stack.pitch_um / 1.6).powi(3))
            }
            Self::Fdtd | Self::Corrected | Self::Rcwa => None,
        }
    }

    /// What its tables are off by against independent curves (`benches/runs/2026-11-21/response.md`), for people.
    pub fn error_text(self, preset: Preset) -> &'static str {
        match (self, preset) {
            (Self::Geometric, _) => "the ideal box: no diffraction, no crosstalk",
            (Self::Wave, Preset::Draft) => "within 0.05 of the light that falls on the pixel",
            (Self::Wave, Preset::Standard) => {
                "strong half within 8 %, weak half within 0.04; between directions 0.5 % of the peak"
            }
            (Self::Wave, Preset::Reference) => {
                "strong half within 8 %, weak half within 0.04 (the wave level's own); converged to a few parts in a \
                 thousand"
            }
            _ => "that of the tables, told where they were made",
        }
    }

    /// Directions of its tables of a pixel. Resonances in the lossless layers of small pixels are narrow in angle (a
    /// real band of wavelengths evens them out), and their directions cost less: `by_pitch` has more of them.
    pub(super) fn directions(self, preset: Preset, stack: &PixelStack) -> DirectionSteps {
        let by_pitch = (16.0 * 3.5 / stack.pitch_um).round().clamp(12.0, 36.0) as usize;
        let (steps, refine) = match (self, preset) {
            (Self::Geometric, _) => (64, 1),
            (Self::Wave | Self::Fdtd | Self::Rcwa, Preset::Draft) => (12, 3),
            (Self::Wave | Self::Rcwa, Preset::Standard) => (by_pitch, 4),
            (Self::Fdtd, Preset::Standard) => (16, 4),
            (Self::Wave | Self::Rcwa, Preset::Reference) => (40, 3),
            (Self::Fdtd, Preset::Reference) | (Self::Corrected, _) => (by_pitch, 4),
        };
        DirectionSteps { steps, refine }
    }
}

impl Preset {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Standard, Self::Reference];

    /// The word that names it everywhere.
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Standard => "standard",
            Self::Reference => "reference",
        }
    }

    /// Whether it is the usual one.
    pub fn is_standard(&self) -> bool {
        *self == Self::Standard
    }
}

/// Written and read as the words of `name`.
macro_rules! by_name {
    ($($type:ident as $field:literal),*) => {$(
        impl fmt::Display for $type {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.name())
            }
        }

        impl FromStr for $type {
            type Err = OutOfRange;

            fn from_str(name: &str) -> Result<Self, OutOfRange> {
                let allowed = || Self::ALL.map(Self::name).join(", ");
                let named = Self::ALL.into_iter().find(|x| x.name() == name);
                named.ok_or_else(|| OutOfRange::new("response", $field, name, allowed()))
            }
        }
    )*};
}

by_name!(Level as "model", Preset as "preset");
