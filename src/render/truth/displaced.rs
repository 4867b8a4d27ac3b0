//! What diffraction at the lens's aperture makes of a texture's frequencies, ray by ray of a pixel.

use std::f64::consts::TAU;

use glam::DVec2;
use rayon::prelude::*;

use super::bundle::{Bundle, PUPIL_KEY};
use crate::render::Camera;
use crate::sampling::uniform;

/// Frequencies from 0 to ½ per px along x, and from −½ to ½ along y.
pub(super) const FREQUENCIES: usize = 24;
pub(super) const ROWS: usize = 2 * FREQUENCIES;
/// Draws of each ray.
const DRAWS: usize = 16;

/// f_x of a column: cell centres from 0 to ½.
pub(super) fn frequency(column: usize) -> f64 {
    (column as f64 + 0.5) / (2 * FREQUENCIES) as f64
}

/// f_y of a row: cell centres from −½ to ½.
pub(super) fn row_frequency(row: usize) -> f64 {
    frequency(row) - 0.5
}

/// Gives `add` exp(2πi f·o) of an offset, px, as (real, imaginary), with the number of each frequency: rows within
/// columns.
pub(super) fn each_frequency(o: DVec2, mut add: impl FnMut(usize, [f64; 2])) {
    let along: [(f64, f64); ROWS] =
        std::array::from_fn(|r| (TAU * row_frequency(r) * o.y).sin_cos());
    for column in 0..FREQUENCIES {
        let (sx, cx) = (TAU * frequency(column) * o.x).sin_cos();
        for (row, (sy, cy)) in along.iter().enumerate() {
            add(column * ROWS + row, [cx * cy - sx * sy, sx * cy + cx * sy]);
        }
    }
}

/// The displacements of a pixel's rays, and the mean of exp(2πi f·d) over those of each.
#[derive(Clone, Debug)]
pub(super) struct Displaced {
    /// [`DRAWS`] of each ray, px, x right, y down as stored.
    draws_px: Vec<DVec2>,
    /// `[ray][frequency]`, real and imaginary.
    transfer: Vec<[f64; 2]>,
}

impl Displaced {
    /// Of the rays from the sensor position `xy_mm`; `None` for a camera without diffraction.
    pub fn new(camera: &Camera, xy_mm: DVec2, bundle: &Bundle) -> Option<Self> {
        draws_px(camera, xy_mm, bundle, DRAWS).map(Self::of)
    }

    fn of(draws_px: Vec<DVec2>) -> Self {
        let mut transfer = vec![[0.0; 2]; draws_px.len() / DRAWS * FREQUENCIES * ROWS];
        let rays = draws_px.par_chunks_exact(DRAWS);
        let transfers = transfer.par_chunks_exact_mut(FREQUENCIES * ROWS);
        transfers.zip(rays).for_each(|(to, draws)| {
            for draw in draws {
                each_frequency(*draw, |i, [re, im]| {
                    to[i][0] += re / DRAWS as f64;
                    to[i][1] += im / DRAWS as f64;
                });
            }
        });
        Self { draws_px, transfer }
    }

    /// Of ray k.
    pub fn of_ray(&self, k: usize) -> &[[f64; 2]] {
        &self.transfer[k * FREQUENCIES * ROWS..][..FREQUENCIES * ROWS]
    }

    /// The same in other axes.
    pub fn turned(&self, turn: impl Fn(DVec2) -> DVec2) -> Self {
        let draws_px: Vec<DVec2> = self.draws_px.iter().map(|&d| turn(d)).collect();
        match draws_px == self.draws_px {
            true => self.clone(),
            false => Self::of(draws_px),
        }
    }
}

/// Displacements of the rays from the sensor position `xy_mm`, px, x right, y down as stored: so many of each ray, one
/// after the other, that all are as likely. `None` for a camera without diffraction.
pub(in crate::render) fn draws_px(
    camera: &Camera,
    xy_mm: DVec2,
    bundle: &Bundle,
    draws: usize,
) -> Option<Vec<DVec2>> {
    let here = camera.lens_diffraction()?.at(xy_mm, PUPIL_KEY);
    let pitch_mm = camera.sensor().pitch_mm();
    let rays = bundle.directions.iter().zip(&bundle.wavelengths_mm);
    let of_rays = rays
        .enumerate()
        .flat_map(|(k, (direction, wavelength_mm))| {
            // Columns grow with x of the sensor frame, against that of the camera frame.
            let to_px = wavelength_mm / pitch_mm * DVec2::new(-1.0, 1.0);
            let begin = uniform(PUPIL_KEY, &[k as u64]);
            let here = &here;
            (0..draws).map(move |m| {
                let sample = (m as f64 + begin) / draws as f64;
                to_px * here.displacement(k * draws + m, *direction, sample)
            })
        });
    Some(of_rays.collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn draws_to_both_sides_pass_the_cosine_of_the_frequency() {
        // Ray 0 stays; ray 1 goes by ±0.7 px along x.
        let away = |m: usize| DVec2::new(if m.is_multiple_of(2) { 0.7 } else { -0.7 }, 0.0);
        let draws = (0..DRAWS).map(|_| DVec2::ZERO).chain((0..DRAWS).map(away));
        let displaced = Displaced::of(draws.collect());
        let turned = displaced.turned(|d| DVec2::new(d.y, d.x));
        for column in 0..FREQUENCIES {
            for row in 0..ROWS {
                let at = |d: &Displaced, ray: usize| d.of_ray(ray)[column * ROWS + row];
                let near = |[re, im]: [f64; 2], expected: f64| {
                    assert!(
                        (re - expected).abs() < 1e-12 && im.abs() < 1e-12,
                        "{re} {im}"
                    );
                };
                near(at(&displaced, 0), 1.0);
                near(at(&displaced, 1), (TAU * 0.7 * frequency(column)).cos());
                near(at(&turned, 1), (TAU * 0.7 * row_frequency(row)).cos());
            }
        }
    }
}
