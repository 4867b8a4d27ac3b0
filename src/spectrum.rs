//! Wavelengths of the colour channels: lines, or bands that several wavelengths stand for.
//!
//! A channel of a **line** is traced at one wavelength; the lens's dispersion then shows as lateral and longitudinal
//! colour. All channels take the pixel's response at the reference wavelength, as the paper does.
//!
//! A channel of a **band** is the mean over it, of what the lens and the pixel do at each wavelength:
//!
//! ```text
//! E = ∫ f(λ) E(λ) dλ ≈ 1/M Σ_m E(λ_m)          f(λ) = (1 + cos π x)/(2 w),   x = (λ − λ₀)/w,   |x| ≤ 1
//! ```
//!
//! λ₀: the band's middle, w: its full width at half maximum. f is a raised cosine, with ∫ f = 1: the shape of an
//! absorbing filter without its tails. λ_m is the mean wavelength of the m-th of M equal shares of the band, so the sum
//! is exact for E linear in λ; of curvature it leaves out the variance within the shares, 10 % of the band's at M = 4,
//! falling as M^(−5/3) (the band's ends fall off as cubes). The scene's radiance in a channel is taken even over its
//! band.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::range::{OutOfRange, require};
use crate::sampling::hash;

/// Wavelengths are rounded to whole parts of a nm, this many, so that tables of responses can be asked for by them.
const PER_NM: f64 = 10.0;

/// The bands of R, G, B.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bands {
    /// Middles, nm.
    pub middle_nm: [f64; 3],
    /// Full widths at half maximum, nm; 0: a line.
    pub width_nm: [f64; 3],
    /// Wavelengths that stand for each band.
    pub wavelengths: usize,
}

impl Default for Bands {
    /// Four wavelengths per band; middles as of the lines, widths of 80, 90, 80 nm: assumed, as absorbing filters
    /// behind an infrared cut have them.
    fn default() -> Self {
        Self {
            middle_nm: ChannelWavelengths::LINES_NM,
            width_nm: [80.0, 90.0, 80.0],
            wavelengths: 4,
        }
    }
}

impl Bands {
    /// Standard deviation of a band in full widths at half maximum, √(1/3 − 2/π²).
    pub const DEVIATION: f64 = 0.361_512_055_19;
    /// Most wavelengths per band.
    pub const MOST: usize = 32;

    /// Ranges of the fields.
    ///
    /// # Errors
    /// The first field out of its range.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let each = |field: &'static str, values: [f64; 3], (least, most): (f64, f64)| {
            let bad = values.into_iter().find(|v| !(least..=most).contains(v));
            bad.map_or(Ok(()), |v| {
                let allowed = format!("{least} to {most} nm");
                Err(OutOfRange::new("spectrum", field, v, allowed))
            })
        };
        each("middle_nm", self.middle_nm, (300.0, 1100.0))?;
        each("width_nm", self.width_nm, (0.0, 200.0))?;
        let count = self.wavelengths;
        require((1..=Self::MOST).contains(&count), || {
            OutOfRange::new("spectrum", "wavelengths", count, "1 to 32 per channel")
        })
    }

    /// The wavelengths of a channel, nm, increasing.
    fn wavelengths_nm(&self, channel: usize) -> Vec<f64> {
        let (middle, width) = (self.middle_nm[channel], self.width_nm[channel]);
        let count = self.wavelengths;
        let edge = |m: usize| quantile(m as f64 / count as f64);
        let mean = |m: usize| count as f64 * (moment(edge(m + 1)) - moment(edge(m)));
        let nm = (0..count).map(|m| middle + width * mean(m));
        nm.map(|nm| (nm * PER_NM).round() / PER_NM).collect()
    }
}

/// x below which the share q of the band ∫ (1 + cos π x)/2 dx lies.
fn quantile(q: f64) -> f64 {
    let (mut low, mut high) = (-1.0, 1.0);
    for _ in 0..60 {
        let x: f64 = 0.5 * (low + high);
        if 0.5 + 0.5 * x + (PI * x).sin() / (2.0 * PI) < q {
            low = x;
        } else {
            high = x;
        }
    }
    0.5 * (low + high)
}

/// ∫ x (1 + cos π x)/2 dx.
fn moment(x: f64) -> f64 {
    let (sin, cos) = (PI * x).sin_cos();
    0.25 * x * x + x * sin / (2.0 * PI) + cos / (2.0 * PI * PI)
}

/// The wavelengths at which each colour channel is traced, and weighed by the pixel's response.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelWavelengths {
    /// R, G, B, nm: the lines; of bands, where the geometry of their light is taken (green: the reference).
    pub rgb_nm: [f64; 3],
    bands: Option<Bands>,
}

impl Default for ChannelWavelengths {
    /// Lines at 610, 550, 465 nm: 550 nm is the paper's, the others the middles of usual red and blue filters.
    fn default() -> Self {
        Self {
            rgb_nm: Self::LINES_NM,
            bands: None,
        }
    }
}

impl ChannelWavelengths {
    /// The reference channel of geometry and truth: green.
    pub const REFERENCE: usize = 1;
    const LINES_NM: [f64; 3] = [610.0, 550.0, 465.0];

    /// Bands. The reference wavelength of geometry and truth stays that of the lines.
    ///
    /// # Errors
    /// A field out of its range.
    pub fn from_bands(bands: Bands) -> Result<Self, OutOfRange> {
        bands.check()?;
        let [red, _, blue] = bands.middle_nm;
        Ok(Self {
            rgb_nm: [red, Self::LINES_NM[Self::REFERENCE], blue],
            bands: Some(bands),
        })
    }

    /// Wavelength of the geometry and the truth, nm.
    pub fn reference_nm(&self) -> f64 {
        self.rgb_nm[Self::REFERENCE]
    }

    /// The bands; `None` for lines.
    pub fn bands(&self) -> Option<&Bands> {
        self.bands.as_ref()
    }

    /// Wavelengths that each channel is traced at.
    pub fn per_channel(&self) -> usize {
        self.bands.map_or(1, |b| b.wavelengths)
    }

    /// Wavelengths at which a channel is traced, nm, each for an equal share of its rays.
    pub fn traced_nm(&self, channel: usize) -> Vec<f64> {
        match &self.bands {
            Some(bands) => bands.wavelengths_nm(channel),
            None => vec![self.rgb_nm[channel]],
        }
    }

    /// Wavelengths of the response that weighs them, nm.
    pub fn response_nm(&self, channel: usize) -> Vec<f64> {
        match &self.bands {
            Some(bands) => bands.wavelengths_nm(channel),
            None => vec![self.reference_nm()],
        }
    }

    /// Every wavelength of the response, nm, increasing.
    pub fn all_response_nm(&self) -> Vec<f64> {
        let mut all: Vec<f64> = (0..3).flat_map(|c| self.response_nm(c)).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// A number that tells the traced wavelengths apart, exact in f64.
    pub(crate) fn fingerprint(&self) -> f64 {
        let traced = (0..3).flat_map(|c| self.traced_nm(c));
        let bits: Vec<u64> = traced.map(f64::to_bits).collect();
        (hash(0, &bits) >> 11) as f64
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn of(wavelengths: usize) -> Vec<f64> {
        let bands = Bands {
            wavelengths,
            ..Bands::default()
        };
        ChannelWavelengths::from_bands(bands).unwrap().traced_nm(1)
    }

    #[test]
    fn mean_of_the_wavelengths_is_the_middle_of_the_band() {
        // Rounding to 0.1 nm leaves at most 0.05 nm of each.
        for count in [1, 2, 3, 4, 7, 16, 32] {
            let nm = of(count);
            let mean = nm.iter().sum::<f64>() / count as f64;
            assert!((mean - 550.0).abs() <= 0.05, "{count}: {mean}");
            assert!(nm.is_sorted() && nm.len() == count);
        }
    }

    #[test]
    fn their_variance_converges_to_that_of_the_raised_cosine() {
        // ∫ x² (1 + cos π x)/2 dx = 1/3 − 2/π².
        let exact = 90.0 * 90.0 * (1.0 / 3.0 - 2.0 / (PI * PI));
        assert!((Bands::DEVIATION * 90.0 / exact.sqrt() - 1.0).abs() < 1e-9);
        let missing = |count: usize| {
            let square = of(count).iter().map(|nm| (nm - 550.0).powi(2)).sum::<f64>();
            1.0 - square / count as f64 / exact
        };
        // The share at each end has 1/M of the light, so a width of M^(−1/3) and M^(−5/3) of the variance: it leads.
        let order = 2f64.powf(5.0 / 3.0);
        for count in [4, 8] {
            let ratio = missing(count) / missing(2 * count);
            assert!((ratio / order - 1.0).abs() < 0.1, "{count}: {ratio}");
        }
    }

    #[test]
    fn lines_are_traced_at_their_own_wavelength_and_weighed_at_the_reference() {
        let lines = ChannelWavelengths::default();
        assert_eq!(
            (lines.traced_nm(0), lines.response_nm(0)),
            (vec![610.0], vec![550.0])
        );
        assert_eq!(lines.all_response_nm(), [550.0]);
        let own = Bands {
            width_nm: [0.0; 3],
            wavelengths: 1,
            ..Bands::default()
        };
        let own = ChannelWavelengths::from_bands(own).unwrap();
        assert_eq!(
            (own.traced_nm(0), own.response_nm(0)),
            (vec![610.0], vec![610.0])
        );
        assert_eq!(own.all_response_nm(), [465.0, 550.0, 610.0]);
        assert_eq!(own.fingerprint(), lines.fingerprint());
    }

    #[test]
    fn bands_out_of_range_are_refused() {
        let good = Bands::default();
        for bad in [
            Bands {
                wavelengths: 0,
                ..good
            },
            Bands {
                wavelengths: 33,
                ..good
            },
            Bands {
                width_nm: [80.0, -1.0, 80.0],
                ..good
            },
            Bands {
                width_nm: [80.0, f64::NAN, 80.0],
                ..good
            },
            Bands {
                middle_nm: [0.0, 550.0, 465.0],
                ..good
            },
        ] {
            assert!(ChannelWavelengths::from_bands(bad).is_err(), "{bad:?}");
        }
    }
}
