//! The reasons why one is left out.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Why an effect was not simulated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reason {
    /// What leaving it out changes is below the tolerance.
    BelowTolerance {
        /// RMS difference of the sub-pixels' values over their mean that is allowed, %.
        signal_percent: f64,
        /// Shift of what a sub-pixel sees that is allowed, px.
        shift_px: f64,
    },
    /// It is not among the effects that were chosen.
    NotChosen,
    /// There is no lens whose aperture could diffract.
    NoAperture,
    /// The model adds the plane waves of the lens's cone without their phases.
    SumWithoutPhases,
    /// Transmission of the lens is 1.
    FullTransmission,
    /// Of kept rays and of pictures with depth the direct light alone is known.
    DirectLight,
    /// No readout was configured: a clean signal.
    NoReadout,
    /// The lens file has no Abbe numbers.
    NoAbbeNumbers,
    /// Paths end after so many surfaces.
    PathLimit {
        /// `scene.parameters.world.paths.max_bounces`.
        max_bounces: u32,
    },
    /// Cut, as configured.
    Clamp {
        /// `scene.parameters.world.paths.clamp`.
        radiance: f32,
    },
    /// The geometric response was configured.
    GeometricResponse,
    /// Centred microlenses were configured.
    CentredMicrolenses,
    /// The centred table is looked up in the moving frame.
    MovingFrame,
    /// The response's table is of one wavelength.
    OneTabulatedWavelength,
    /// All channels use the table at one wavelength, as in the paper.
    OneResponseWavelength,
    /// Its tables would take long, and nobody asked for them.
    TableTime {
        /// About how long, s of one core.
        seconds: f64,
        /// What a dataset spends on them unasked, s of one core.
        most_seconds: f64,
    },
    /// Each channel is traced at one wavelength.
    OneTracedWavelength,
    /// The scene's radiance in a channel is even over the channel's band.
    EvenRadiance,
    /// A channel knows the light of its own band.
    OwnBand,
    /// The pixel is simulated among pixels of its own colour, the paper's worst case.
    EqualNeighbours,
    /// Every sub-pixel has all three channels, as in the paper.
    AllChannels,
}

impl Reason {
    /// Why what an effect left out for this reason costs was not estimated.
    pub(super) fn without_estimate(self) -> &'static str {
        match self {
            Self::BelowTolerance { .. } | Self::NotChosen => "its cheaper path was not compared",
            Self::NoAperture
            | Self::FullTransmission
            | Self::CentredMicrolenses
            | Self::AllChannels
            | Self::NoReadout => "that is the camera asked for",
            Self::SumWithoutPhases => {
                "the study of it knows pixels of 1.6 to 3.5 µm behind F/1.7 to F/8"
            }
            Self::DirectLight => "light from beside the picture would have to be known",
            Self::NoAbbeNumbers => "the glasses' dispersion is not known",
            Self::PathLimit { .. } => "longer paths would have to be followed",
            Self::Clamp { .. } => "the light that was cut is not counted",
            Self::GeometricResponse => "there is no table of the pixel to compare with",
            Self::MovingFrame => "it takes a table of microlens shifts (`[response] shifts`)",
            Self::OneTabulatedWavelength | Self::OneResponseWavelength | Self::TableTime { .. } => {
                "it takes tables at other wavelengths (`[spectrum]`)"
            }
            Self::OneTracedWavelength => "it takes bands of wavelengths (`[spectrum]`)",
            Self::EvenRadiance => "the scene's spectra are not known",
            Self::OwnBand => "the filters' leakage is not known",
            Self::EqualNeighbours => "it takes a table of the mosaic (`[response] colour`)",
        }
    }
}

/// The reason in words.
impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::BelowTolerance {
                signal_percent,
                shift_px,
            } => {
                return write!(
                    f,
                    "below the tolerance of {signal_percent} % of the signal and {shift_px} px"
                );
            }
            Self::PathLimit { max_bounces } => {
                return write!(
                    f,
                    "paths end after {max_bounces} surfaces (`scene.parameters.world.paths.max_bounces`)"
                );
            }
            Self::Clamp { radiance } => {
                return write!(
                    f,
                    "cut at the radiance {radiance} by `scene.parameters.world.paths.clamp`, as asked for"
                );
            }
            Self::TableTime {
                seconds,
                most_seconds,
            } => {
                return write!(
                    f,
                    "its tables would take {seconds} s of one core or more, beyond the {most_seconds} s spent unasked (`[spectrum]` asks for them)"
                );
            }
            Self::NotChosen => "not among the effects asked for",
            Self::NoAperture => "no lens, no aperture",
            Self::SumWithoutPhases => {
                "not simulated: the model adds the plane waves of the lens's cone without their phases"
            }
            Self::FullTransmission => "transmission of the lens is 1",
            Self::DirectLight => "kept rays and pictures with depth are of the direct light",
            Self::NoReadout => "clean signal asked for",
            Self::NoAbbeNumbers => "the lens file has no Abbe numbers",
            Self::GeometricResponse => "geometric response asked for",
            Self::CentredMicrolenses => "centred microlenses asked for",
            Self::MovingFrame => "the centred table is looked up in the moving frame",
            Self::OneTabulatedWavelength => "the response's table is of one wavelength",
            Self::OneResponseWavelength => {
                "all channels use the table at one wavelength, as in the paper"
            }
            Self::OneTracedWavelength => "each channel is traced at one wavelength",
            Self::EvenRadiance => "its radiance in a channel is even over the channel's band",
            Self::OwnBand => "a channel knows the light of its own band",
            Self::EqualNeighbours => {
                "the pixel is simulated among pixels of its own colour, the paper's worst case"
            }
            Self::AllChannels => "every sub-pixel has all three channels, as in the paper",
        })
    }
}
