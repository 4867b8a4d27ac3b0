//! What a calibration must have in common with the captures that it is for.

use quadpixel::sensor::Subpixels;
use serde::{Deserialize, Serialize};

use crate::capture::{Capture, reference_channel};

/// A camera as a calibration file names it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CalibratedCamera {
    /// Distance of the microlenses, µm; 0: not known.
    pub pitch_um: f64,
    /// Sub-pixels of a pixel.
    pub subpixels: Subpixels,
    /// Columns of a view.
    pub width_px: usize,
    /// Rows of a view.
    pub height_px: usize,
    /// Names of the colour channels, in order.
    pub channels: Vec<String>,
    /// Middle of the window on the sensor, mm; absent: not known, and not compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub centre_mm: Option<[f64; 2]>,
}

/// A pitch that is no pitch, or that nothing tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no description of the camera lies beside it: its pitch must be given, above 0 µm")]
pub struct PitchError;

impl CalibratedCamera {
    /// The camera of a capture; `pitch_um` is needed where no description says it.
    ///
    /// # Errors
    /// Nothing tells the pitch, or it is not above 0.
    pub fn from_capture(capture: &Capture, pitch_um: Option<f64>) -> Result<Self, PitchError> {
        let described = capture.camera.as_ref();
        let pitch_um = pitch_um.or(described.map(|camera| camera.pitch_um));
        let pitch_um = pitch_um.filter(|p| p.is_finite() && *p > 0.0);
        let [width_px, height_px] = capture.size_px();
        Ok(Self {
            pitch_um: pitch_um.ok_or(PitchError)?,
            subpixels: capture.views.subpixels(),
            width_px,
            height_px,
            channels: capture.channels.clone(),
            centre_mm: described.map(|camera| camera.centre_mm),
        })
    }

    /// The channel that others are matched to: green, or the first where there is none.
    pub fn reference_channel(&self) -> usize {
        reference_channel(&self.channels)
    }

    /// Says in what `other` differs, first difference only; `None` where they are one camera.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let differs = |what: &str, a: String, b: String| Some(format!("{what} {a} instead of {b}"));
        if (self.pitch_um - other.pitch_um).abs() > 1e-9 * self.pitch_um.abs() {
            return differs(
                "pitch_um",
                self.pitch_um.to_string(),
                other.pitch_um.to_string(),
            );
        }
        if self.subpixels != other.subpixels {
            return differs(
                "subpixels",
                self.subpixels.to_string(),
                other.subpixels.to_string(),
            );
        }
        if (self.width_px, self.height_px) != (other.width_px, other.height_px) {
            let size = |c: &Self| format!("{}x{}", c.width_px, c.height_px);
            return differs("size", size(self), size(other));
        }
        if self.channels != other.channels {
            return differs(
                "channels",
                self.channels.join(" "),
                other.channels.join(" "),
            );
        }
        match (self.centre_mm, other.centre_mm) {
            (Some(a), Some(b)) if (a[0] - b[0]).hypot(a[1] - b[1]) > 1e-6 => {
                differs("centre_mm", format!("{a:?}"), format!("{b:?}"))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn cameras_differ_in_pitch_sub_pixels_size_channels_and_place_on_the_sensor() {
        let camera = CalibratedCamera {
            pitch_um: 2.8,
            subpixels: Subpixels::QUAD,
            width_px: 40,
            height_px: 30,
            channels: vec!["R".to_owned(), "G".to_owned(), "B".to_owned()],
            centre_mm: Some([0.5, -1.0]),
        };
        let changed = |change: fn(&mut CalibratedCamera)| {
            let mut other = camera.clone();
            change(&mut other);
            camera.difference(&other)
        };
        assert_eq!(changed(|_| ()), None);
        for (change, wanted) in [
            (
                (|c| c.pitch_um = 1.6) as fn(&mut CalibratedCamera),
                "pitch_um 2.8 instead of 1.6",
            ),
            (
                |c| c.subpixels = Subpixels::DUAL_X,
                "subpixels 2x2 instead of 2x1",
            ),
            (|c| c.height_px = 40, "size 40x30 instead of 40x40"),
            (
                |c| c.channels = vec!["Y".to_owned()],
                "channels R G B instead of Y",
            ),
            (
                |c| c.centre_mm = Some([0.5, 1.0]),
                "centre_mm [0.5, -1.0] instead of [0.5, 1.0]",
            ),
        ] {
            assert_eq!(changed(change).unwrap(), wanted);
        }
        // A place that is not known is not compared.
        assert_eq!(changed(|c| c.centre_mm = None), None);
        assert_eq!(camera.reference_channel(), 1);
    }
}
