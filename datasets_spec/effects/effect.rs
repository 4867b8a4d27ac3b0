//! The effects by name.

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
