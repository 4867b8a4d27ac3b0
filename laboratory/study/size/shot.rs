//! One camera in front of the chart, and what its views show of the defocus.

use std::sync::Arc;

use crate::error::LaboratoryError;
use glam::{DMat3, DVec2};
use quadpixel::em::PixelStack;
use quadpixel::image::{Image, channel};
use quadpixel::lens::{FocusBy, Lens, Prescription};
use quadpixel::render::truth::{Defocus, ReceptiveField, TextureSpectrum, WhiteField};
use quadpixel::render::{Camera, RenderSettings, render};
use quadpixel::response::Response;
use quadpixel::scene::texture::Texture;
use quadpixel::scene::{Scene, TexturedPlane};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;

use quadpixel_generators::charts::{Alphabet, ChartSpec};
use quadpixel_generators::scenes::field_of_view::covering;

/// Stands in for the paper's ML-1, whose table is not public to us.
pub(super) const LENS: &str = "wide_US20120327520A1_emb3";
pub(super) const FOCUS_MM: f64 = 750.0;
pub(super) const CHART_MM: f64 = 500.0;
/// Side of the sensor window in the middle, µm: 128 pixels of 3.5 µm, 280 of 1.6 µm.
const WINDOW_UM: f64 = 448.0;
const RAYS_PER_PIXEL: usize = 256;
/// Rays of the truth's bundle.
const TRUTH_RAYS: usize = 4096;
const CHART_PX: usize = 2048;

/// How a pixel parts the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// The ideal box of eq. 2.
    Classic,
    /// The pixel model's table.
    Diffractive,
    /// The same, with diffraction at the lens's aperture.
    Waves,
}

impl Mode {
    pub fn name(self) -> &'static str {
        match self {
            Self::Classic => "classic",
            Self::Diffractive => "diffractive",
            Self::Waves => "diffractive, lens too",
        }
    }
}

/// What all cameras share.
pub(super) struct Bench {
    lens: Lens,
    chart: Arc<Texture>,
    f_number: f64,
}

/// What a camera saw.
pub(super) struct Shot {
    pub pixel: String,
    pub pitch_um: f64,
    pub mode: Mode,
    /// The views of sub-pixels A (right, low) and D (left, high), green; a white wall is 1 in the middle of the sum
    /// over their number.
    pub views: [Image; 2],
    /// Diameter of the circle of confusion, px, below 0 for a chart before the focus.
    pub defocus_px: f64,
    /// x_B − x_A of a point in focus, px: what aberrations leave.
    pub at_focus_px: f64,
    /// x_B − x_A on the chart, px: by the rays' centroids; as a matcher finds it on a texture; and as found on the
    /// rendered views.
    pub centroid_px: f64,
    pub matched_px: f64,
    pub seen_px: f64,
    /// RMS of the difference of views B and A, in parts of their mean.
    pub difference: f64,
    /// Part of the light on the pixel that its photodiodes take.
    pub taken: f64,
}

impl Shot {
    /// Disparity amplitude a pixel of defocus: what x_B − x_A grows by from the focus to the chart over the circle of
    /// confusion's diameter, by centroids. (Two half disks: 4/3π = 0.42.)
    pub fn amplitude(&self) -> f64 {
        ((self.centroid_px - self.at_focus_px) / self.defocus_px).abs()
    }
}

impl Bench {
    pub fn new() -> Result<Self, LaboratoryError> {
        let nm = ChannelWavelengths::default().reference_nm();
        let lens = Prescription::builtin(LENS)
            .and_then(|p| Lens::new(&p))
            .and_then(|l| l.focused_at(FOCUS_MM, FocusBy::Sensor, nm))?;
        let f_number = lens.paraxial(nm)?.f_number;
        let letters = Alphabet {
            tiles: 4,
            lines: 3,
            tint: 0.0,
            ..Alphabet::default()
        };
        let chart = ChartSpec::Alphabet(letters).generate(1, CHART_PX);
        Ok(Self {
            lens,
            chart: Arc::new(chart?),
            f_number,
        })
    }

    /// Of the main lens.
    pub fn f_number(&self) -> f64 {
        self.f_number
    }

    /// Renders the chart.
    pub fn shot(
        &self,
        stack: &PixelStack,
        mode: Mode,
        response: &Response,
    ) -> Result<Shot, LaboratoryError> {
        let s = stack.subpixels;
        let across = (WINDOW_UM / stack.pitch_um).round().max(24.0) as usize;
        let sensor = Sensor::new(stack.pitch_um, s, (across, across), DVec2::ZERO)?;
        let wavelengths = ChannelWavelengths::default();
        let camera = Camera::new(
            &self.lens,
            sensor,
            ShiftRule::ChiefRay,
            response,
            wavelengths,
        )?;
        let camera = match mode {
            Mode::Classic | Mode::Diffractive => camera,
            Mode::Waves => camera.with_lens_diffraction(),
        };
        let (centre, side) = covering(&camera, CHART_MM, DMat3::IDENTITY)?;
        let flat = (0.0, 0.0, 0.0);
        let plane = TexturedPlane::new(centre, (side, side), flat, self.chart.clone(), None)?;
        let scene = Scene::new(vec![plane], [0.0; 3]);
        let settings = RenderSettings {
            rays_per_pixel: RAYS_PER_PIXEL,
            seed: 1,
        };
        let rendered = render(&camera, &scene, &settings);

        let white = WhiteField::new(&camera);
        let gain = s.count() as f64 / white.reference_sr();
        let mut image = rendered.image;
        image.scale(gain as f32);
        let green = |index: usize| channel(&image.view(index), ChannelWavelengths::REFERENCE);
        let dark = || LaboratoryError::Dark;
        let truth = ReceptiveField::new(
            &camera,
            ChannelWavelengths::REFERENCE,
            DVec2::ZERO,
            TRUTH_RAYS,
        )
        .ok_or_else(dark)?;
        let defocus = Defocus::new(&camera).ok_or_else(dark)?;
        let pitch_mm = camera.sensor().pitch_mm();
        // One row: right A, left B; and D, across the pixel from A.
        let (a, b, d) = (s.index(s.m() - 1, 0), s.index(0, 0), s.index(0, s.n() - 1));
        let pair = [b, a];
        let [left, right] = pair.map(green);
        let centroid_px = truth.centroid_shift_px(CHART_MM, pair);
        Ok(Shot {
            pixel: stack.name.clone(),
            pitch_um: stack.pitch_um,
            mode,
            defocus_px: defocus.circle_of_confusion_mm(CHART_MM) / pitch_mm,
            at_focus_px: truth.centroid_shift_px(FOCUS_MM, pair),
            centroid_px,
            matched_px: truth.matched_shift_px(CHART_MM, pair, &TextureSpectrum::default()),
            seen_px: seen_shift_px(&left, &right, centroid_px),
            difference: difference(&left, &right),
            taken: white.quantum_efficiency(),
            views: [green(a), green(d)],
        })
    }
}

/// RMS of a − b over the mean of both.
fn difference(a: &Image, b: &Image) -> f64 {
    let pairs = || a.data().iter().zip(b.data());
    let squares: f64 = pairs().map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let mean: f64 = pairs().map(|(a, b)| 0.5 * f64::from(a + b)).sum();
    let count = a.data().len() as f64;
    (squares / count).sqrt() / (mean / count)
}

/// x_a − x_b of two views of a flat chart, px: the shift d, near `expected`, at which a(x + d/2) and b(x − d/2) differ
/// least.
fn seen_shift_px(a: &Image, b: &Image, expected: f64) -> f64 {
    const STEP_PX: f64 = 0.05;
    let tries = 30i32;
    let shift = |i: i32| expected + f64::from(i) * STEP_PX;
    let margin = (0.5 * shift(tries).abs().max(shift(-tries).abs())) as usize + 3;
    if a.width() <= 2 * margin {
        return f64::NAN;
    }
    let squares = |d: f64| -> f64 {
        let of_row = |row: usize| -> f64 {
            let at = |image: &Image, x: f64| {
                let i = x.floor() as usize;
                let p = |k: usize| f64::from(image.pixel(k, row)[0]);
                let (p0, p1, p2, p3) = (p(i - 1), p(i), p(i + 1), p(i + 2));
                let t = x - x.floor();
                let bend = 2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3 + t * (3.0 * (p1 - p2) + p3 - p0);
                p1 + 0.5 * t * (p2 - p0 + t * bend)
            };
            let columns = margin..a.width() - margin;
            columns
                .map(|c| (at(a, c as f64 + 0.5 * d) - at(b, c as f64 - 0.5 * d)).powi(2))
                .sum()
        };
        (0..a.height()).map(of_row).sum()
    };
    let found: Vec<f64> = (-tries..=tries).map(|i| squares(shift(i))).collect();
    let least = (0..found.len()).min_by(|&i, &j| found[i].total_cmp(&found[j]));
    let Some(k) = least.filter(|&k| k > 0 && k + 1 < found.len()) else {
        return f64::NAN;
    };
    let (before, own, after) = (found[k - 1], found[k], found[k + 1]);
    let summit = 0.5 * (before - after) / (before - 2.0 * own + after);
    shift(k as i32 - tries) + STEP_PX * summit
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn waves(moved: f64) -> Image {
        let value = |k: usize| {
            let (x, y) = ((k % 64) as f64 - moved, (k / 64) as f64);
            (2.0 + (0.31 * x + 0.2 * y).sin() + (0.17 * x - 0.4 * y).cos()) as f32
        };
        Image::from_vec(64, 48, 1, (0..64 * 48).map(value).collect()).unwrap()
    }

    #[test]
    fn a_moved_pattern_is_found_where_it_was_moved() {
        // Cubics of waves 20 px long are off by 1e-4 of them.
        let found = seen_shift_px(&waves(1.3), &waves(-0.6), 1.5);
        assert!((found - 1.9).abs() < 2e-3, "{found}");
    }
}
