//! Disparity of a camera against distance, over its window: lens, aberrations and response, without a scene.
//!
//! The disparity of two opposite groups of sub-pixels (left and right, top and bottom) is the difference of the means
//! of their traced shifts. For a point at depth Z that the sum shows at a place p it is a ratio of polynomials in 1/Z
//! (see [`super::truth::DisparityField`]). With t = 1/(Z + e), e the entrance pupil's distance behind the first vertex,
//! it is nearly a straight line, bent a little by the aberrations of the pupils, so
//!
//! ```text
//! D(p, Z) = c₀(p) + c₁(p) t + c₂(p) t²
//! ```
//!
//! holds for every distance; what the fit leaves is written beside it. c₁ is close to −κ fx A of the paraxial camera,
//! and c₀ + c₁ t_f + c₂ t_f² is the aberration's disparity at the focus.

use glam::{DVec2, DVec3};
use quadpixel_datasets::{DisparityCurve, DisparityCurves};
use rayon::prelude::*;

use super::Camera;
use super::truth::{Defocus, DisparityField, Seen};
use crate::field::FieldGrid;
use crate::image::views::Side;
use crate::spectrum::ChannelWavelengths;
use crate::units::M_PER_MM;

/// Distances of a fit.
const DISTANCES: usize = 9;
/// Circle of confusion, px, up to which the fit is made on both sides of the focus.
const LARGEST_COC_PX: f64 = 64.0;
/// Nearest distance of a fit, mm.
const NEAREST_MM: f64 = 20.0;
/// Weights of R, G and B in a grey picture: luminance of ITU-R BT.709.
pub const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// Name of the curve of the luminance.
const GREY: &str = "grey";

/// The curves of a camera's channels and of their luminance; `fields` are those of [`DisparityField::of_channels`].
/// `None` for bare pixels, which have no focus.
pub fn disparity_curves(camera: &Camera, fields: &[DisparityField]) -> Option<DisparityCurves> {
    let distances = Distances::new(camera)?;
    let nodes = distances.nodes(camera, fields);
    let curves = |sides: [Side; 2], along: DVec2| {
        let subpixels = camera.sensor().subpixels();
        let groups = sides.map(|side| side.members(subpixels));
        if groups.iter().any(Vec::is_empty) {
            return Vec::new();
        }
        let single = (0..fields.len()).filter(|_| fields.len() > 1);
        (single.map(Some).chain([None]))
            .filter_map(|channel| {
                let shift = |seen: &[Seen]| {
                    let [a, b] = (groups.each_ref()).map(|group| match channel {
                        Some(channel) => seen[channel].group(group).1,
                        None => grey_px(seen, group),
                    });
                    (a - b).dot(along)
                };
                let name = channel.map_or(GREY, |channel| ["R", "G", "B"][channel]);
                distances.fitted(name, &nodes, &shift)
            })
            .collect()
    };
    Some(DisparityCurves {
        left_right: curves([Side::Left, Side::Right], DVec2::X),
        top_bottom: curves([Side::Top, Side::Bottom], DVec2::Y),
    })
}

/// Where the luminance of a group shows a point, from where the reference channel's sum shows it, px.
fn grey_px(channels: &[Seen], members: &[usize]) -> DVec2 {
    let (mut light, mut sum) = (0.0, DVec2::ZERO);
    for (seen, luminance) in channels.iter().zip(LUMINANCE) {
        let (weight, shift) = seen.group(members);
        light += luminance * weight;
        sum += luminance * weight * (shift + seen.to_sum_px);
    }
    sum / light
}

/// How the channels see points at the distances of a fit, at the nodes of the window.
struct Nodes {
    columns: usize,
    rows: usize,
    /// `[node][distance][channel]`.
    seen: Vec<Vec<Vec<Seen>>>,
}

/// The distances of a fit, by t = 1/(Z + e), per mm.
struct Distances {
    pupil_mm: f64,
    focus: f64,
    per_mm: Vec<f64>,
}

impl Distances {
    /// Evenly spread between the circles of confusion of [`LARGEST_COC_PX`], infinity and [`NEAREST_MM`].
    fn new(camera: &Camera) -> Option<Self> {
        let pupil_mm = camera.paraxial()?.entrance_pupil_z_mm;
        let defocus = Defocus::new(camera)?;
        let per_mm = |depth_mm: f64| 1.0 / (depth_mm + pupil_mm);
        let focus = per_mm(camera.focus_distance_mm());
        let pitch_mm = camera.sensor().pitch_mm();
        let coc_px = |t: f64| defocus.circle_of_confusion_mm(1.0 / t - pupil_mm) / pitch_mm;
        let nearest = per_mm(NEAREST_MM).max(1.5 * focus);
        // Nearly a straight line in t: its slope, taken a step nearer than the focus, sets the span.
        let step = 0.01 * nearest;
        let span = LARGEST_COC_PX * step / coc_px(focus + step).abs();
        let (low, high) = ((focus - span).max(0.0), (focus + span).min(nearest));
        let at = |k: usize| low + (high - low) * k as f64 / (DISTANCES - 1) as f64;
        Some(Self {
            pupil_mm,
            focus,
            per_mm: (0..DISTANCES).map(at).collect(),
        })
    }

    fn nodes(&self, camera: &Camera, fields: &[DisparityField]) -> Nodes {
        let sensor = camera.sensor();
        let window = sensor.window_mm();
        // Those of the truth, so that between them both are bilinear.
        let [columns, rows] = [sensor.width(), sensor.height()].map(FieldGrid::nodes_for);
        let reference = &fields[ChannelWavelengths::REFERENCE.min(fields.len() - 1)];
        let node = |k: usize| {
            let place = FieldGrid::node_mm(window, (columns, rows), (k % columns, k / columns));
            let line = reference.sight_line(place);
            let at = |t: &f64| {
                let depth_mm = 1.0 / t - self.pupil_mm;
                let seen = |field: &DisparityField| field.seen(place, depth_mm, line);
                fields.iter().map(seen).collect()
            };
            self.per_mm.iter().map(at).collect()
        };
        Nodes {
            columns,
            rows,
            seen: (0..columns * rows).into_par_iter().map(node).collect(),
        }
    }

    /// The curve of a shift; `None` where no node has one.
    fn fitted(
        &self,
        channel: &str,
        nodes: &Nodes,
        shift: &(dyn Fn(&[Seen]) -> f64 + Sync),
    ) -> Option<DisparityCurve> {
        let node = |distances: &Vec<Vec<Seen>>| {
            let samples: Vec<f64> = distances.iter().map(|seen| shift(seen)).collect();
            let (c, residual) = quadratic(&self.per_mm, self.focus, &samples)?;
            // From per mm to per m.
            let per_m = [c[0], c[1] * M_PER_MM, c[2] * M_PER_MM * M_PER_MM];
            Some((per_m.map(rounded), residual))
        };
        let fits: Vec<_> = nodes.seen.par_iter().map(node).collect();
        let worst = fits.iter().flatten().map(|fit| fit.1).fold(0.0, f64::max);
        let size = [nodes.columns as u32, nodes.rows as u32];
        let nodes: Vec<Option<[f64; 3]>> = fits.iter().map(|fit| fit.map(|f| f.0)).collect();
        DisparityCurve::new(channel, size, &nodes, worst)
    }
}

/// To eight digits, which are more than are known.
fn rounded(value: f64) -> f64 {
    format!("{value:.7e}").parse().unwrap_or(value)
}

/// The parabola of least squares through (t, y), as coefficients of 1, t, t², and its largest residual; `None` where a
/// value is not finite. Solved about `middle` for the sake of its digits.
fn quadratic(t: &[f64], middle: f64, y: &[f64]) -> Option<([f64; 3], f64)> {
    let scale = t.iter().fold(0.0f64, |m, t| m.max((t - middle).abs()));
    let basis = |t: f64| {
        let x = (t - middle) / scale;
        DVec3::new(1.0, x, x * x)
    };
    let (mut normal, mut right) = (glam::DMat3::ZERO, DVec3::ZERO);
    for (&t, &y) in t.iter().zip(y) {
        let b = basis(t);
        normal += glam::DMat3::from_cols(b * b.x, b * b.y, b * b.z);
        right += y * b;
    }
    let c = normal.inverse() * right;
    let residual = |(&t, &y): (&f64, &f64)| (c.dot(basis(t)) - y).abs();
    let worst = t.iter().zip(y).map(residual).fold(0.0, f64::max);
    let (a1, a2) = (c.y / scale, c.z / (scale * scale));
    let about_zero = [
        c.x - a1 * middle + a2 * middle * middle,
        a1 - 2.0 * a2 * middle,
        a2,
    ];
    (about_zero.iter().all(|c| c.is_finite())).then_some((about_zero, worst))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_found_to_the_last_digits() {
        let t: Vec<f64> = (0..9).map(|k| 1e-3 + 2e-4 * f64::from(k)).collect();
        let of = |t: f64| 0.3 - 2000.0 * t + 4000.0 * t * t;
        let y: Vec<f64> = t.iter().map(|&t| of(t)).collect();
        let (c, residual) = quadratic(&t, 1.4e-3, &y).unwrap();
        assert!((c[0] - 0.3).abs() < 1e-9 && residual < 1e-12, "{c:?}");
        assert!((c[1] / -2000.0 - 1.0).abs() < 1e-9 && (c[2] / 4000.0 - 1.0).abs() < 1e-6);
    }
}
