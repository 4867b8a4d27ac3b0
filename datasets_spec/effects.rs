//! The ledger of effects: what of the light's way a sample's pictures contain, what they do not, why, and what that may
//! cost.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Something that light does on its way into a picture.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Effect {
    /// Diffraction and crosstalk in the pixel; without: boxes of the same focal length.
    PixelDiffraction,
    /// The microlens shift (chief-ray angle) from place to place; without: that of the window's middle.
    CraVariation,
    /// A wavelength of its own for each channel in the lens; without: the reference channel's rays serve all.
    Dispersion,
    /// Aberrations of the lens; without: first-order optics.
    Aberrations,
    /// Apertures beside the stop; left out together with the aberrations only.
    Vignetting,
    /// Several wavelengths in a channel; without: one.
    Wavelengths,
    /// Light from surface to surface in a world; without: direct light only.
    GlobalIllumination,
    /// Every ray finds its own surface.
    Occlusion,
    /// Noise of the sensor's electronics, in files of its own.
    Noise,
    /// Blur of what is out of focus.
    Defocus,
    /// Diffraction at the main lens's aperture; without: light goes through the lens as rays.
    LensDiffraction,
    /// Phases between the plane waves of the lens's cone, within a pixel.
    LensPixelCoherence,
    /// Ghosts and veiling glare: light that two surfaces of the lens, or one and the sensor, reflect.
    LensReflections,
    /// Tolerances of the lens's making.
    LensTolerances,
    /// The sensor beside the focus.
    FocusError,
    /// Misaligned microlenses.
    MicrolensOffset,
    /// Thickness of the pixel's layers.
    LayerThickness,
    /// Microlenses shifted for the chief ray.
    MicrolensShift,
    /// Distortion of the response by the microlens shift.
    ShiftDistortion,
    /// Wavelength dependence of the response.
    ResponseSpectrum,
    /// Spectra of the scene.
    SceneSpectra,
    /// The colour-filter mosaic, in files of its own.
    ColourMosaic,
    /// Crosstalk through filters of another colour.
    ColourCrosstalk,
    /// Light of other bands through a filter.
    FilterLeakage,
    /// Light of very long paths.
    LongPaths,
    /// The brightest indirect light.
    BrightPaths,
}

impl Effect {
    /// Those that a user can choose to simulate, in the order in which they are listed.
    pub const SELECTABLE: [Self; 12] = [
        Self::PixelDiffraction,
        Self::LensDiffraction,
        Self::LensReflections,
        Self::CraVariation,
        Self::Dispersion,
        Self::Aberrations,
        Self::Vignetting,
        Self::Wavelengths,
        Self::ResponseSpectrum,
        Self::GlobalIllumination,
        Self::Occlusion,
        Self::Noise,
    ];

    /// Its identifier in configurations, arguments and descriptions.
    pub fn name(self) -> &'static str {
        self.words().0
    }

    /// Identifier, and the effect in words.
    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::PixelDiffraction => (
                "pixel-diffraction",
                "diffraction and crosstalk in the pixel",
            ),
            Self::CraVariation => (
                "cra-variation",
                "variation of the chief ray over the window",
            ),
            Self::Dispersion => ("dispersion", "dispersion"),
            Self::Aberrations => ("aberrations", "lens aberrations"),
            Self::Vignetting => ("vignetting", "vignetting"),
            Self::Wavelengths => ("wavelengths", "width of the colour bands"),
            Self::GlobalIllumination => (
                "global-illumination",
                "light reflected and transmitted between surfaces",
            ),
            Self::Occlusion => ("occlusion", "occlusion"),
            Self::Noise => ("noise", "sensor noise"),
            Self::Defocus => ("defocus", "defocus"),
            Self::LensDiffraction => (
                "lens-diffraction",
                "diffraction at the main lens's aperture",
            ),
            Self::LensPixelCoherence => (
                "lens-pixel-coherence",
                "phases of the lens's cone within a pixel",
            ),
            Self::LensReflections => ("lens-reflections", "ghosts and veiling glare"),
            Self::LensTolerances => ("lens-tolerances", "tolerances of the lens"),
            Self::FocusError => ("focus-error", "focus error"),
            Self::MicrolensOffset => ("microlens-offset", "misaligned microlenses"),
            Self::LayerThickness => ("layer-thickness", "thickness of the pixel's layers"),
            Self::MicrolensShift => ("microlens-shift", "microlens shift"),
            Self::ShiftDistortion => (
                "shift-distortion",
                "distortion of the response by the microlens shift",
            ),
            Self::ResponseSpectrum => {
                ("response-spectrum", "wavelength dependence of the response")
            }
            Self::SceneSpectra => ("scene-spectra", "spectra of the scene"),
            Self::ColourMosaic => ("colour-mosaic", "colour filter mosaic"),
            Self::ColourCrosstalk => (
                "colour-crosstalk",
                "crosstalk through filters of another colour",
            ),
            Self::FilterLeakage => ("filter-leakage", "light of other bands through a filter"),
            Self::LongPaths => ("long-paths", "light of very long paths"),
            Self::BrightPaths => ("bright-paths", "brightest indirect light"),
        }
    }
}

/// The effect in words.
impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.words().1)
    }
}

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
    fn without_estimate(self) -> &'static str {
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

/// The size of an error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum EstimatedError {
    /// RMS difference of the sub-pixels' values over their mean, %.
    SignalPercent(f64),
    /// Largest shift of what a sub-pixel sees, px.
    ShiftPx(f64),
}

/// An effect that was not simulated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LeftOut {
    /// Which.
    pub effect: Effect,
    /// Why.
    pub reason: Reason,
    /// Both in words, for people: what a reader decides by is beside it.
    pub text: String,
    /// What that costs; empty where nobody estimated it.
    pub estimated_errors: Vec<EstimatedError>,
}

/// What the pictures contain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Effects {
    /// Effects that were simulated.
    pub simulated: Vec<Effect>,
    /// Effects that were not.
    pub left_out: Vec<LeftOut>,
}

impl Effects {
    /// Enters an effect that is simulated.
    pub fn simulate(&mut self, effect: Effect) {
        self.simulated.push(effect);
    }

    /// Enters an effect that is not simulated, and why.
    pub fn leave_out(&mut self, effect: Effect, reason: Reason) {
        self.leave_out_at(effect, reason, Vec::new());
    }

    /// Enters an effect that is not simulated, why, and what that costs.
    pub fn leave_out_at(
        &mut self,
        effect: Effect,
        reason: Reason,
        estimated_errors: Vec<EstimatedError>,
    ) {
        let mut text = format!("{effect}: {reason}");
        if estimated_errors.is_empty() {
            text += &format!(" (not estimated: {})", reason.without_estimate());
        }
        self.left_out.push(LeftOut {
            effect,
            reason,
            text,
            estimated_errors,
        });
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn effects_have_one_name_in_arguments_and_files_and_reasons_carry_their_numbers() {
        for effect in Effect::SELECTABLE {
            let json = serde_json::to_string(&effect).unwrap();
            assert_eq!(json, format!("\"{}\"", effect.name()));
        }
        let mut ledger = Effects::default();
        let limit = Reason::BelowTolerance {
            signal_percent: 0.5,
            shift_px: 0.02,
        };
        ledger.simulate(Effect::Defocus);
        let errors = vec![
            EstimatedError::SignalPercent(0.1),
            EstimatedError::ShiftPx(0.01),
        ];
        ledger.leave_out_at(Effect::Dispersion, limit, errors);
        ledger.leave_out(Effect::LensReflections, Reason::FullTransmission);
        let json = serde_json::to_value(&ledger).unwrap();
        assert_eq!(json["simulated"][0], "defocus");
        assert_eq!(
            json["left_out"][0]["reason"]["below-tolerance"]["shift_px"],
            0.02
        );
        assert_eq!(json["left_out"][0]["estimated_errors"][1]["shift-px"], 0.01);
        assert_eq!(json["left_out"][1]["reason"], "full-transmission");
        assert_eq!(serde_json::from_value::<Effects>(json).unwrap(), ledger);
        let text = &ledger.left_out[0].text;
        assert_eq!(
            text,
            "dispersion: below the tolerance of 0.5 % of the signal and 0.02 px"
        );
        let text = &ledger.left_out[1].text;
        assert!(
            text.ends_with("(not estimated: that is the camera asked for)"),
            "{text}"
        );
    }
}
