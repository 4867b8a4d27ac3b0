//! Wavelengths of the colour channels.
//!
//! Each channel is traced at one wavelength: the lens's dispersion then shows as lateral and longitudinal colour. The
//! bands' widths are left out (several wavelengths a channel is a setting of a later effect), and said so in the metadata.

/// The wavelength at which each colour channel is traced, nm, in the order R, G, B.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ChannelWavelengths {
    /// R, G, B, nm.
    pub rgb_nm: [f64; 3],
}

impl Default for ChannelWavelengths {
    /// 610, 550, 465 nm: 550 nm is the paper's, the others the middles of usual red and blue filters.
    fn default() -> Self {
        Self {
            rgb_nm: [610.0, 550.0, 465.0],
        }
    }
}

impl ChannelWavelengths {
    /// The reference channel of geometry and truth: green.
    pub const REFERENCE: usize = 1;

    /// Wavelength of the reference channel, nm.
    pub fn reference_nm(&self) -> f64 {
        self.rgb_nm[Self::REFERENCE]
    }
}
