//! Only the effects that a scene calls for: what each does to this image, and which may be left out.
//!
//! ```text
//! camera, scene ─ without one effect ─▶ both beside each other ─▶ Estimate: largest shift (px), difference (RMS of the signal)
//!                                                                     └─ plan ─▶ what is rendered, and a Decision per effect
//! ```
//!
//! An effect is left out if what that changes is below both tolerances, and only where the renderer then has less to do: each effect's own
//! cheaper path is a function of [`Camera`](crate::render::Camera) or of the scene. The estimates follow the rays of the image to come, with and
//! without the effect, on a few of its pixels; they are functions of camera, scene and seed alone, so that a plan is the same everywhere.

mod choice;
mod plan;
mod shift;
mod shot;
mod signal;
mod vignetting;

pub use choice::{Choice, ChoiceError, Tolerance};
pub use plan::{Decision, Planned, Verdict, plan};
pub use shot::Shot;

/// An effect that an image may or may not need.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize)]
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
    /// Every ray finds its own surface; always simulated.
    Occlusion,
    /// Noise of the sensor's electronics, in files of its own.
    Noise,
}

impl Effect {
    /// All of them, in the order in which they are told.
    pub const ALL: [Self; 9] = [
        Self::PixelDiffraction,
        Self::CraVariation,
        Self::Dispersion,
        Self::Aberrations,
        Self::Vignetting,
        Self::Wavelengths,
        Self::GlobalIllumination,
        Self::Occlusion,
        Self::Noise,
    ];

    /// Its name in configurations and arguments.
    pub fn name(self) -> &'static str {
        match self {
            Self::PixelDiffraction => "pixel-diffraction",
            Self::CraVariation => "cra-variation",
            Self::Dispersion => "dispersion",
            Self::Aberrations => "aberrations",
            Self::Vignetting => "vignetting",
            Self::Wavelengths => "wavelengths",
            Self::GlobalIllumination => "global-illumination",
            Self::Occlusion => "occlusion",
            Self::Noise => "noise",
        }
    }
}

/// What leaving an effect out would do to the image.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Estimate {
    /// RMS difference of the sub-pixels' values over their mean, %, an upper bound (two standard errors of the probes above the mean); `None` where the
    /// shift alone decided.
    pub signal_percent: Option<f64>,
    /// Largest shift of what a sub-pixel sees, over window, channels and depths, px; `None` for effects that move nothing.
    pub shift_px: Option<f64>,
}

impl std::fmt::Display for Estimate {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.signal_percent, self.shift_px) {
            (Some(signal), Some(shift)) => write!(f, "{signal:.2} % of the signal, {shift:.4} px"),
            (Some(signal), None) => write!(f, "{signal:.2} % of the signal"),
            (None, Some(shift)) => write!(f, "{shift:.4} px"),
            (None, None) => write!(f, "not estimated"),
        }
    }
}
