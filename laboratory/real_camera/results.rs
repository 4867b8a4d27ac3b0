//! What was found.

use quadpixel::image::Image;
use quadpixel::image::colour::viridis;

use crate::aperture::Point;
use crate::compare::Likeness;
use crate::depths::{CLAIM_M, Found, Score};
use crate::measure::Shift;
use crate::noise;

/// Depth pictures are this much smaller than the views: plots, not photographs.
const SMALLER: usize = 3;

/// The lens at one mark.
pub struct LensResult {
    pub mark: f64,
    pub stop_semi_mm: f64,
    pub efl_mm: f64,
    pub f_number: f64,
    pub sensor_from_vertex_mm: f64,
    pub focus_from_vertex_mm: f64,
}

/// One capture simulated.
pub struct CaptureResult {
    pub distance_mm: f64,
    pub mark: f64,
    pub coc_px: f64,
    pub measured: Vec<Shift>,
    pub models: Vec<ModelResult>,
}

/// By one model.
pub struct ModelResult {
    pub name: String,
    pub likeness: Likeness,
    pub shifts: Vec<Shift>,
}

/// Shift over circle of confusion.
#[derive(Default)]
pub struct ApertureResult {
    /// Name and points of each model.
    pub curves: Vec<(String, Vec<Point>)>,
    /// Name, circle of confusion (px), shift (px) and point of each capture.
    pub measured: Vec<(String, f64, f64, Point)>,
}

/// Depth of one capture.
pub struct DepthResult {
    pub name: String,
    pub mark: f64,
    /// plane, box, casual.
    pub kind: String,
    /// Whether the pixel was fitted on it.
    pub fitted: bool,
    pub claimed: Score,
    pub all: Score,
    pub found: Found,
    pub known_m: Image,
}

/// Everything.
#[derive(Default)]
pub struct Results {
    pub lens: Vec<LensResult>,
    pub captures: Vec<CaptureResult>,
    pub aperture: ApertureResult,
    /// By the simulated curve.
    pub depths: Vec<DepthResult>,
    /// By the curve brought to the planes.
    pub calibrated: Vec<DepthResult>,
    /// Name, and variance of the noise of the left over that of the right view by parts of the width.
    pub noise: Vec<(String, [f64; noise::PARTS])>,
    /// What was found and not used, and why.
    pub left_out: Vec<String>,
}

impl Results {
    /// The depths that are shown as pictures: those by planes, where there are any.
    pub fn shown(&self) -> &[DepthResult] {
        match self.calibrated.is_empty() {
            true => &self.depths,
            false => &self.calibrated,
        }
    }
}

impl DepthResult {
    /// File of [`Self::picture`].
    pub fn picture_name(&self) -> String {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '-' };
        format!(
            "depth-{}-f{}.png",
            self.name.chars().map(plain).collect::<String>(),
            self.mark
        )
    }

    /// Depth at all pixels, where it is claimed, and as it is known, side by side: codes, width, height.
    pub fn picture(&self) -> (Vec<u8>, usize, usize) {
        let (width, height) = (
            self.known_m.width() / SMALLER,
            self.known_m.height() / SMALLER,
        );
        let inverse = |z: f32| if z > 0.0 { 1.0 / z } else { f32::NAN };
        let mut known: Vec<f32> = (self.known_m.data().iter())
            .map(|z| inverse(*z))
            .filter(|v| v.is_finite())
            .collect();
        known.sort_by(f32::total_cmp);
        let at = |percent: usize| {
            known
                .get(known.len().saturating_sub(1) * percent / 100)
                .copied()
                .unwrap_or(1.0)
        };
        // A plane has no range of its own: 0.2 per m on either side.
        let (low, high) = (at(2).min(at(50) - 0.2), at(98).max(at(50) + 0.2));
        let mut codes = Vec::with_capacity(9 * width * height);
        let found = &self.found.z_m;
        for y in 0..height {
            for (image, only_claimed) in [(found, false), (found, true), (&self.known_m, false)] {
                for x in 0..width {
                    let (x, y) = (x * SMALLER, y * SMALLER);
                    let claimed = f64::from(self.found.sigma_m.pixel(x, y)[0]) <= CLAIM_M;
                    let shown = claimed || !only_claimed;
                    let v = inverse(image.pixel(x, y)[0]);
                    codes.extend(if shown && v.is_finite() {
                        viridis((v - low) / (high - low))
                    } else {
                        [0; 3]
                    });
                }
            }
        }
        (codes, 3 * width, height)
    }
}
