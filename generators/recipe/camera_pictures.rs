//! Camera-like pictures, as a recipe asks for them.

use quadpixel_datasets::{CameraPictures, Development};
use serde::{Deserialize, Serialize};

use crate::field_error::FieldError;

/// `[camera_pictures]`: 8-bit sRGB of the sum and of the views; see [`Development`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CameraPicturesRecipe {
    /// Factor of all channels.
    pub gain: f64,
    /// Factor of each channel; absent: a white wall is neutral.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub white_balance: Option<[f64; 3]>,
    /// Linear sRGB of the balanced channels, row by row.
    pub matrix: [[f64; 3]; 3],
    /// Points (x, y) of the tone curve, from (0, 0) to (1, 1).
    pub tone_curve: Vec<[f64; 2]>,
    /// Quality of JPEGs, 1 to 100; absent: PNGs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jpeg_quality: Option<u8>,
    /// Of the noisy views; needs a readout.
    pub noisy: bool,
}

impl Default for CameraPicturesRecipe {
    fn default() -> Self {
        let plain = Development::default();
        Self {
            gain: plain.gain,
            white_balance: None,
            matrix: plain.matrix,
            tone_curve: plain.tone_curve,
            jpeg_quality: None,
            noisy: false,
        }
    }
}

impl CameraPicturesRecipe {
    /// Whether they can be made, and undone. `has_readout`: of a sensor with noise.
    ///
    /// # Errors
    /// The field, its value and what is allowed.
    pub fn check(&self, has_readout: bool) -> Result<(), FieldError> {
        let neutral = [1.0; 3];
        (self.development(neutral).check()).map_err(|e| {
            FieldError::new(format!("camera_pictures.{}", e.field), e.value, e.allowed)
        })?;
        if let Some(quality) = self.jpeg_quality.filter(|q| !(1..=100).contains(q)) {
            let field = "camera_pictures.jpeg_quality";
            return Err(FieldError::new(
                field,
                quality,
                "1 to 100, or absent for PNG",
            ));
        }
        if self.noisy && !has_readout {
            let allowed = "false without a [readout]";
            return Err(FieldError::new("camera_pictures.noisy", true, allowed));
        }
        Ok(())
    }

    /// What `meta.json` says of them. `white`: linear values of a white wall's channels; `subpixels`: per pixel.
    pub(crate) fn described(&self, white: [f64; 3], subpixels: usize) -> CameraPictures {
        CameraPictures {
            noisy: self.noisy,
            development: self.development(white),
            view_gain: subpixels as f64,
            jpeg_quality: self.jpeg_quality,
        }
    }

    fn development(&self, white: [f64; 3]) -> Development {
        Development {
            gain: self.gain,
            white_balance: (self.white_balance).unwrap_or_else(|| white.map(|w| white[1] / w)),
            matrix: self.matrix,
            tone_curve: self.tone_curve.clone(),
        }
    }
}
