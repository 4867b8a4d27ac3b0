//! What one pixel sees of a flat texture at a depth, and the shift that a matcher finds between two of its views.
//!
//! Ray k of pixel p, of weight w_ik to sub-pixel i, sees the texture (its picture in the sum of all views, T) at p +
//! δ_k = p + J⁻¹ (q_k − q̄). Of these offsets [`super::matched_shift_px`] makes the shift. Where the camera has
//! diffraction at its lens's aperture, it displaces ray k by draws. A ray from the rim has the wider ones, so that fine
//! texture is seen by the middle of the pupil and shifts less.

use glam::{DMat2, DVec2, Vec2Swizzles};

use super::bundle::Bundle;
use super::disparity::jacobian_at;
use super::displaced::Displaced;
use super::matched::{TextureSpectrum, centroid_shift_px, cross_spectrum, summit};
use crate::render::Camera;
use crate::sampling::SobolSet;

/// One pixel's rays; see the module.
#[derive(Clone, Debug)]
pub struct ReceptiveField {
    bundle: Bundle,
    /// By diffraction at the lens's aperture, where the camera has any.
    displaced: Option<Displaced>,
    jacobian: [DMat2; 2],
}

impl ReceptiveField {
    /// Of the pixel at `xy_mm` on the sensor, at a channel's wavelength, with `rays` rays; `None` where no light
    /// passes.
    pub fn new(camera: &Camera, channel: usize, xy_mm: DVec2, rays: usize) -> Option<Self> {
        let bundle = Bundle::new(camera, channel, xy_mm, &SobolSet::new(rays))?;
        let lit = bundle.weights.iter().sum::<f64>() > 0.0;
        let jacobian = jacobian_at(camera, channel, xy_mm)?;
        let displaced = Displaced::new(camera, xy_mm, &bundle);
        lit.then_some(Self {
            bundle,
            displaced,
            jacobian,
        })
    }

    /// Two groups of sub-pixels as the two views of a pixel; `vertical`: with rows in the place of columns, so that
    /// shifts along y are found as those along x are.
    pub fn of_groups(&self, groups: [&[usize]; 2], vertical: bool) -> Self {
        let turned = |v: DVec2| if vertical { v.yx() } else { v };
        let weights = (0..self.bundle.q0.len()).flat_map(|k| {
            groups.map(|group| group.iter().map(|&s| self.weights(k)[s]).sum::<f64>())
        });
        let all = |list: &[DVec2]| list.iter().map(|&v| turned(v)).collect();
        let b = &self.bundle;
        Self {
            bundle: Bundle {
                weights: weights.collect(),
                q0: all(&b.q0),
                q1_mm: all(&b.q1_mm),
                slopes: all(&b.slopes),
                directions: b.directions.clone(),
                wavelengths_mm: b.wavelengths_mm.clone(),
                measure: b.measure.clone(),
                scale: b.scale,
                subpixels: 2,
            },
            displaced: (self.displaced.as_ref()).map(|d| d.turned(turned)),
            jacobian: (self.jacobian).map(|j| match vertical {
                true => DMat2::from_cols(j.y_axis.yx(), j.x_axis.yx()),
                false => j,
            }),
        }
    }

    /// δ of each ray at `depth_mm` (+∞ allowed), px: where it looks, from where all together look, x right, y down as
    /// stored.
    pub fn offsets_px(&self, depth_mm: f64) -> Vec<DVec2> {
        let inverse = 1.0 / depth_mm;
        let [j0, j1] = self.jacobian;
        let solve = (j0 + inverse * j1).inverse();
        let b = &self.bundle;
        let mut offsets: Vec<DVec2> = (b.q0.iter().zip(&b.q1_mm))
            .map(|(&q0, &q1)| solve * (q0 + inverse * q1))
            .collect();
        let weight = |k: usize| self.weights(k).iter().sum::<f64>();
        let all: f64 = (0..offsets.len()).map(weight).sum();
        let sum: DVec2 = (0..offsets.len()).map(|k| weight(k) * offsets[k]).sum();
        offsets.iter_mut().for_each(|o| *o -= sum / all);
        offsets
    }

    /// Weights of ray k, one per sub-pixel.
    pub fn weights(&self, k: usize) -> &[f64] {
        let n = self.bundle.subpixels;
        &self.bundle.weights[k * n..(k + 1) * n]
    }

    /// x_i − x_j by the centroids of what sub-pixels i and j see, px.
    pub fn centroid_shift_px(&self, depth_mm: f64, [i, j]: [usize; 2]) -> f64 {
        let offsets = self.offsets_px(depth_mm);
        let pair = |k: usize| [self.weights(k)[i], self.weights(k)[j]];
        centroid_shift_px(offsets.iter().enumerate().map(|(k, o)| (*o, pair(k))))
    }

    /// x_i − x_j as a matcher finds it on a texture, px.
    pub fn matched_shift_px(
        &self,
        depth_mm: f64,
        [i, j]: [usize; 2],
        texture: &TextureSpectrum,
    ) -> f64 {
        let offsets = self.offsets_px(depth_mm);
        let pair = |k: usize| [self.weights(k)[i], self.weights(k)[j]];
        let rays = || offsets.iter().enumerate().map(|(k, o)| (*o, pair(k)));
        let displaced = |k: usize| self.displaced.as_ref().map(|d| d.of_ray(k));
        let with = rays().enumerate().map(|(k, ray)| (ray, displaced(k)));
        summit(centroid_shift_px(rays()), &cross_spectrum(with, texture))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    /// A pupil of `n`² points on a square of half width 1, seen with weights 1 ± s x, its rays `blur` px apart at the
    /// rim.
    fn field(slope: f64, n: usize) -> ReceptiveField {
        let place = |i: usize| (2.0 * i as f64 + 1.0) / n as f64 - 1.0;
        let points = (0..n * n).map(|k| DVec2::new(place(k % n), place(k / n)));
        let q1_mm: Vec<DVec2> = points.collect();
        let weights = |p: &DVec2| [1.0 - slope * p.x, 1.0 + slope * p.x];
        ReceptiveField {
            bundle: Bundle {
                q0: vec![DVec2::ZERO; n * n],
                slopes: q1_mm.clone(),
                directions: q1_mm.clone(),
                wavelengths_mm: vec![5.5e-4; n * n],
                weights: q1_mm.iter().flat_map(weights).collect(),
                measure: vec![1.0; n * n],
                q1_mm,
                scale: 1.0,
                subpixels: 2,
            },
            displaced: None,
            jacobian: [DMat2::IDENTITY, DMat2::ZERO],
        }
    }

    #[test]
    fn a_sliver_of_blur_shifts_as_its_centroids_do() {
        // ⟨x²⟩ of a square of half width a is a²/3 (1 − 1/n²): centroids at ± s a/3. Depth 1/a makes the half width a
        // px.
        let f = field(0.5, 16);
        for a in [0.05, 0.3] {
            let expected = 2.0 * 0.5 * a / 3.0 * (1.0 - 1.0 / 256.0);
            let centroid = f.centroid_shift_px(1.0 / a, [0, 1]);
            assert!((centroid - expected).abs() < 1e-12, "{centroid} {expected}");
            let matched = f.matched_shift_px(1.0 / a, [0, 1], &TextureSpectrum::default());
            // The next term of the odd over the even part of the spectrum is (2π f a)²/30 at most.
            assert!((matched / expected - 1.0).abs() < 0.03, "{a}: {matched}");
        }
    }

    #[test]
    fn mirrored_blurs_of_fine_texture_match_farther_apart_than_centroids() {
        let f = field(0.5, 16);
        let (blur, both) = (4.0, [0, 1]);
        let centroid = f.centroid_shift_px(1.0 / blur, both);
        let matched = f.matched_shift_px(1.0 / blur, both, &TextureSpectrum::default());
        assert!(matched > 1.02 * centroid, "{matched} {centroid}");
        // Exchanged views shift the other way.
        let back = f.matched_shift_px(1.0 / blur, [1, 0], &TextureSpectrum::default());
        assert!((matched + back).abs() < 1e-9);
    }
}
