//! Disparity of each view by traced, response-weighted centroids, and its paraxial value.
//!
//! Pixel p sees, through sub-pixel i, the direction q_i(p, D) at depth D on average, and q̄(p, D) through all together.
//! A point that the sum shows at p is shown by view i where q_i equals it; to first order in the shift
//!
//! ```text
//! Δ_i(p, D) = −J⁻¹ (q_i − q̄),    J = ∂q̄/∂p        (px, ΔX right, ΔY down in the stored image)
//! ```
//!
//! q and J are linear in 1/D (see `bundle`), so a grid over the sensor serves every depth. The paraxial value is that
//! of an ideal lens of the same focal length, focus and pupil filling: with m̄ the response-weighted mean slopes of the
//! light at the sensor and z′ the paraxial image of depth D (see [`Defocus`]), Δx = (m̄_i − m̄) · D_xp (z_s − z′)/s′.
//! The difference of the two is the disparity of the lens's aberrations.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::Defocus;
use super::bundle::{Centroid, centroids};
use crate::field::FieldGrid;
use crate::image::Image;
use crate::rays::Ray;
use crate::render::Camera;
use crate::sampling::SobolSet;
use crate::spectrum::ChannelWavelengths;

/// Rays of a bundle for the centroids, and for the Jacobian.
const RAYS: usize = 1024;
const JACOBIAN_RAYS: usize = 256;
/// Step of the central difference, px.
const STEP_PX: f64 = 2.0;

/// Components of a node: J₀ (4), J₁ (4), the sum's q₀ (2) and q₁ (2), then per sub-pixel q₀, q₁, slope (each relative
/// to the sum's) and weight: 7.
const JACOBIAN: usize = 8;
const SHARED: usize = JACOBIAN + 4;
const PER_SUBPIXEL: usize = 7;

/// The line in front of the lens on which lies, at each depth, the mean of the places that a pixel sees: at depth D
/// (x, y) = D q₀ + q₁, camera frame, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SightLine {
    /// Slope: (x, y) per depth.
    pub q0: DVec2,
    /// Where it meets z = 0, mm.
    pub q1_mm: DVec2,
}

impl SightLine {
    /// The line of a ray in front of the lens.
    pub fn from_ray(ray: &Ray) -> Self {
        let (o, d) = (ray.origin_mm, ray.direction);
        let m = d.truncate() / d.z;
        Self {
            q0: -m,
            q1_mm: o.truncate() - o.z * m,
        }
    }
}

/// Disparity at every place of the window and every depth, at one channel's wavelength.
#[derive(Clone, Debug)]
pub struct DisparityField {
    grid: FieldGrid,
    subpixels: usize,
    pitch_mm: f64,
    defocus: Defocus,
}

/// Disparity maps of all sub-pixels: each image is W × H × 2 (ΔX, ΔY), px, NaN where not valid.
#[derive(Clone, Debug)]
pub struct DisparityMaps {
    /// By traced centroids.
    pub traced: Vec<Image>,
    /// Of the ideal lens.
    pub paraxial: Vec<Image>,
}

impl DisparityField {
    /// The fields of R, G and B, or one for all where they see the same; `None` for bare pixels.
    pub fn of_channels(camera: &Camera) -> Option<Vec<Self>> {
        match camera.colours().alike() {
            true => Some(vec![Self::new(camera, ChannelWavelengths::REFERENCE)?]),
            false => (0..3).map(|channel| Self::new(camera, channel)).collect(),
        }
    }

    /// Tabulates the field of `channel` relative to the sum of the same channel; `None` for bare pixels, which have no
    /// focus.
    pub fn new(camera: &Camera, channel: usize) -> Option<Self> {
        let defocus = Defocus::new(camera)?;
        let sensor = camera.sensor();
        let size = (
            FieldGrid::nodes_for(sensor.width()),
            FieldGrid::nodes_for(sensor.height()),
        );
        let window = sensor.window_mm();
        let subpixels = sensor.subpixels().count();
        let components = SHARED + PER_SUBPIXEL * subpixels;
        let (fine, coarse) = (SobolSet::new(RAYS), SobolSet::new(JACOBIAN_RAYS));
        let data: Vec<f64> = (0..size.0 * size.1)
            .into_par_iter()
            .flat_map_iter(|k| {
                let p = FieldGrid::node_mm(window, size, (k % size.0, k / size.0));
                node(camera, channel, p, &fine, &coarse)
                    .unwrap_or_else(|| vec![f64::NAN; components])
            })
            .collect();
        let grid = FieldGrid::new(window, size, components, data)
            .unwrap_or_else(|| unreachable!("components a node"));
        Some(Self {
            grid,
            subpixels,
            pitch_mm: sensor.pitch_mm(),
            defocus,
        })
    }

    /// Sub-pixels of a pixel.
    pub fn subpixels(&self) -> usize {
        self.subpixels
    }

    /// Traced (ΔX, ΔY) px of each sub-pixel for a point at `depth_mm` (+∞ allowed) shown at `xy_mm`; NaN where dark.
    pub fn traced_px(&self, xy_mm: DVec2, depth_mm: f64, out: &mut [DVec2]) {
        let mut c = vec![0.0; self.grid.components()];
        self.grid.sample(xy_mm, &mut c);
        self.traced_from(&c, depth_mm, out);
    }

    /// Paraxial (ΔX, ΔY) px of each sub-pixel, as [`Self::traced_px`].
    pub fn paraxial_px(&self, xy_mm: DVec2, depth_mm: f64, out: &mut [DVec2]) {
        let mut c = vec![0.0; self.grid.components()];
        self.grid.sample(xy_mm, &mut c);
        self.paraxial_from(&c, depth_mm, out);
    }

    /// The line of the places that the sum of all sub-pixels sees from a sensor position; not finite where it is dark.
    pub fn sight_line(&self, xy_mm: DVec2) -> SightLine {
        let mut c = vec![0.0; self.grid.components()];
        self.grid.sample(xy_mm, &mut c);
        sight_line_of(&c)
    }

    /// Where the sum shows the point at `depth_mm` (+∞ allowed) of another line of sight from `xy_mm`, from there, px
    /// (x right, y down as stored).
    pub fn shift_to_sum_px(&self, xy_mm: DVec2, depth_mm: f64, line: SightLine) -> DVec2 {
        let mut c = vec![0.0; self.grid.components()];
        self.grid.sample(xy_mm, &mut c);
        let (sum, inverse) = (sight_line_of(&c), 1.0 / depth_mm);
        let beside = line.q0 - sum.q0 + inverse * (line.q1_mm - sum.q1_mm);
        jacobian_of(&c, inverse).inverse() * beside
    }

    /// What a group of sub-pixels shows together of a point at `depth_mm` (+∞ allowed) that the sum shows at `xy_mm`:
    /// its light per solid angle there (sr) and its (ΔX, ΔY) from the sum, px; weighted as their pictures add. NaN where
    /// one of them is dark.
    pub fn group_px(&self, xy_mm: DVec2, depth_mm: f64, members: &[usize]) -> (f64, DVec2) {
        let mut c = vec![0.0; self.grid.components()];
        self.grid.sample(xy_mm, &mut c);
        let mut shifts = vec![DVec2::ZERO; self.subpixels];
        self.traced_from(&c, depth_mm, &mut shifts);
        let weight = |s: usize| c[SHARED + (s + 1) * PER_SUBPIXEL - 1];
        let light: f64 = members.iter().map(|&s| weight(s)).sum();
        let sum: DVec2 = members.iter().map(|&s| weight(s) * shifts[s]).sum();
        (light, sum / light)
    }

    /// Both for every pixel of the camera's window, at the depths of a W × H × 1 map in mm (NaN: not valid).
    pub fn maps(&self, camera: &Camera, depth_mm: &Image) -> DisparityMaps {
        let sensor = camera.sensor();
        let (width, height) = (sensor.width(), sensor.height());
        let empty = || vec![Image::zeros(width, height, 2); self.subpixels];
        let mut maps = DisparityMaps {
            traced: empty(),
            paraxial: empty(),
        };
        let mut c = vec![0.0; self.grid.components()];
        let mut shift = vec![DVec2::ZERO; self.subpixels];
        for row in 0..height {
            for column in 0..width {
                let depth = f64::from(depth_mm.pixel(column, row)[0]);
                self.grid
                    .sample(sensor.position_mm(column as f64, row as f64), &mut c);
                self.traced_from(&c, depth, &mut shift);
                store(&mut maps.traced, &shift, column, row);
                self.paraxial_from(&c, depth, &mut shift);
                store(&mut maps.paraxial, &shift, column, row);
            }
        }
        maps
    }

    fn traced_from(&self, c: &[f64], depth_mm: f64, out: &mut [DVec2]) {
        let inverse = 1.0 / depth_mm;
        let solve = -jacobian_of(c, inverse).inverse();
        for (o, s) in out.iter_mut().zip(c[SHARED..].chunks_exact(PER_SUBPIXEL)) {
            *o = solve * (DVec2::new(s[0], s[1]) + inverse * DVec2::new(s[2], s[3]));
        }
    }

    fn paraxial_from(&self, c: &[f64], depth_mm: f64, out: &mut [DVec2]) {
        let lever_px = self.defocus.lever_mm(depth_mm) / self.pitch_mm;
        for (o, s) in out.iter_mut().zip(c[SHARED..].chunks_exact(PER_SUBPIXEL)) {
            // Camera x runs against the stored columns.
            *o = DVec2::new(-s[4], s[5]) * lever_px;
        }
    }
}

fn jacobian_of(c: &[f64], inverse_depth: f64) -> DMat2 {
    DMat2::from_cols_array(&std::array::from_fn(|k| c[k] + inverse_depth * c[4 + k]))
}

fn sight_line_of(c: &[f64]) -> SightLine {
    SightLine {
        q0: DVec2::new(c[JACOBIAN], c[JACOBIAN + 1]),
        q1_mm: DVec2::new(c[JACOBIAN + 2], c[JACOBIAN + 3]),
    }
}

fn store(maps: &mut [Image], shift: &[DVec2], column: usize, row: usize) {
    for (map, s) in maps.iter_mut().zip(shift) {
        map.pixel_mut(column, row)
            .copy_from_slice(&[s.x as f32, s.y as f32]);
    }
}

/// All components of one node.
fn node(
    camera: &Camera,
    channel: usize,
    p: DVec2,
    fine: &SobolSet,
    coarse: &SobolSet,
) -> Option<Vec<f64>> {
    let (of_subpixel, all) = centroids(camera, channel, p, fine)?;
    let [j0, j1] = jacobian(camera, channel, p, coarse)?;
    let mut c = [j0.to_cols_array(), j1.to_cols_array()].concat();
    c.extend([all.q0.x, all.q0.y, all.q1_mm.x, all.q1_mm.y]);
    for s in of_subpixel {
        // A sub-pixel that gets no light at all has no centroid, and so no disparity.
        let dark = if s.weight > 0.0 { 0.0 } else { f64::NAN };
        let (d0, d1, slope) = (s.q0 - all.q0, s.q1_mm - all.q1_mm, s.slope - all.slope);
        c.extend([d0.x, d0.y, d1.x, d1.y, slope.x, slope.y].map(|v| v + dark));
        c.push(s.weight);
    }
    Some(c)
}

/// J₀ and J₁ of J(D) = J₀ + J₁/D at a sensor position; J₁ in mm/px.
fn jacobian(camera: &Camera, channel: usize, p: DVec2, samples: &SobolSet) -> Option<[DMat2; 2]> {
    let step = STEP_PX * camera.sensor().pitch_mm();
    let at = |d: DVec2| centroids(camera, channel, p + d, samples).map(|c| c.1);
    let difference = |a: Centroid, b: Centroid| {
        (
            (a.q0 - b.q0) / (2.0 * STEP_PX),
            (a.q1_mm - b.q1_mm) / (2.0 * STEP_PX),
        )
    };
    let (x0, x1) = difference(at(DVec2::X * step)?, at(-DVec2::X * step)?);
    let (y0, y1) = difference(at(DVec2::Y * step)?, at(-DVec2::Y * step)?);
    Some([DMat2::from_cols(x0, y0), DMat2::from_cols(x1, y1)])
}

/// [`jacobian`] for others, with the rays that the disparity's has.
pub(crate) fn jacobian_at(camera: &Camera, channel: usize, p: DVec2) -> Option<[DMat2; 2]> {
    jacobian(camera, channel, p, &SobolSet::new(JACOBIAN_RAYS))
}
