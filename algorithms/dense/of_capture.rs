//! The opposite views of a capture, matched at every pixel.

use quadpixel::image::{Image, channel};

use super::{DenseError, DenseMap, DenseSettings, OppositeViews, dense_disparity_of};
use crate::capture::Capture;
use crate::sai::Side;

/// A capture's halves in its reference channel, and what its description says of their blur.
#[derive(Clone, Debug)]
pub struct Halves {
    left_right: Option<[Image; 2]>,
    top_bottom: Option<[Image; 2]>,
    settings: DenseSettings,
}

impl Halves {
    /// Of a capture.
    pub fn new(capture: &Capture) -> Self {
        let c = capture.reference_channel();
        let half = |side| capture.views.sum(side).map(|sum| channel(&sum, c));
        let pair = |a, b| Some([half(a)?, half(b)?]);
        let ratio = (capture.camera.as_ref()).map(|camera| &camera.disparity_ratio);
        Self {
            left_right: pair(Side::Left, Side::Right),
            top_bottom: pair(Side::Top, Side::Bottom),
            settings: DenseSettings {
                ratio: ratio.and_then(|r| r.left_right.as_ref()).map(|r| r.mean),
                top_bottom_ratio: ratio.and_then(|r| r.top_bottom.as_ref()).map(|r| r.mean),
            },
        }
    }

    /// With a ratio of disparity to blur that is known otherwise.
    pub fn with_ratio(mut self, ratio: f64) -> Self {
        self.settings = DenseSettings {
            ratio: Some(ratio),
            top_bottom_ratio: Some(ratio),
        };
        self
    }

    /// Whether there are neither left nor right: the disparity is that of top and bottom.
    pub fn is_vertical(&self) -> bool {
        self.left_right.is_none()
    }

    /// Ratio of disparity to blur by the camera's description.
    pub fn ratio(&self) -> Option<f64> {
        match self.is_vertical() {
            false => self.settings.ratio,
            true => self.settings.top_bottom_ratio,
        }
    }

    /// Their disparity, by one pair or both.
    ///
    /// # Errors
    /// As of [`dense_disparity_of`].
    pub fn disparity(&self) -> Result<DenseMap, DenseError> {
        let views = OppositeViews {
            left_right: self.left_right.as_ref().map(<[Image; 2]>::each_ref),
            top_bottom: self.top_bottom.as_ref().map(<[Image; 2]>::each_ref),
        };
        dense_disparity_of(views, &self.settings)
    }
}
