//! The bundle of rays from the middle of one pixel through the whole pupil, and its response-weighted centroids.
//!
//! A ray that leaves the lens at o with slopes m = (d_x, d_y)/d_z meets depth D (z = −D) in the direction
//! `q(D) = (x, y)/D = −m + (o_xy − o_z m)/D`: exactly linear in 1/D. So two centroids, of q₀ = −m and of q₁ = o_xy −
//! o_z m, hold for every depth, infinity included.

use glam::{DVec2, DVec3};

use super::polar_rule;
use crate::frames::{camera_from_sensor_mm, uv_from_camera_direction};
use crate::rays::RayBatch;
use crate::render::Camera;
use crate::render::diffraction::PlaceDiffraction;
use crate::sampling::{SobolSet, concentric_disk};
use crate::simd::SimdLevel;
use crate::units::MM_PER_NM;

/// Key of the pupil samples: the same at every node, so that fields over the sensor come out smooth.
pub(super) const PUPIL_KEY: u64 = 0x9091;

/// What one group of rays (a sub-pixel's, or all) sees, per unit weight.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Centroid {
    /// ∫ P cos θ dω, sr.
    pub weight: f64,
    /// ∫ cos θ dω over the rays that pass, sr: what arrives, absorbed or not. Counted for all rays together only.
    pub incident: f64,
    /// Mean of q₀.
    pub q0: DVec2,
    /// Mean of q₁, mm.
    pub q1_mm: DVec2,
    /// Mean slope (dx/dz, dy/dz) of the light at the sensor, camera frame.
    pub slope: DVec2,
}

impl Centroid {
    /// Adds a ray by its q₀, q₁ (mm) and slope.
    pub(super) fn add(&mut self, weight: f64, [q0, q1_mm, slope]: [DVec2; 3]) {
        self.weight += weight;
        self.q0 += weight * q0;
        self.q1_mm += weight * q1_mm;
        self.slope += weight * slope;
    }

    pub(super) fn normalised(self, scale: f64) -> Self {
        let inverse = if self.weight > 0.0 {
            1.0 / self.weight
        } else {
            0.0
        };
        Self {
            weight: self.weight * scale,
            incident: self.incident * scale,
            q0: self.q0 * inverse,
            q1_mm: self.q1_mm * inverse,
            slope: self.slope * inverse,
        }
    }
}

/// Rays of one pixel that pass the lens: what they see, and what each is worth to each sub-pixel.
#[derive(Clone, Debug)]
pub(in crate::render) struct Bundle {
    pub q0: Vec<DVec2>,
    pub q1_mm: Vec<DVec2>,
    pub slopes: Vec<DVec2>,
    /// Direction cosines from the pixel, camera frame.
    pub directions: Vec<DVec2>,
    pub wavelengths_mm: Vec<f64>,
    /// `[ray][sub-pixel]`: P cos θ dω, in units of [`Self::scale`].
    pub weights: Vec<f64>,
    /// cos θ dω of each ray, in the same units.
    pub measure: Vec<f64>,
    /// sr a unit of weight.
    pub scale: f64,
    pub subpixels: usize,
}

impl Bundle {
    /// From the sensor position `xy_mm`, at a channel's wavelengths. `None` where no light passes.
    pub fn new(camera: &Camera, channel: usize, xy_mm: DVec2, samples: &SobolSet) -> Option<Self> {
        Self::from_starts(camera, channel, xy_mm, samples, None)
    }

    /// The same with each ray starting where diffraction at the lens's aperture displaces it from, as in a render; as
    /// it was where the camera has none.
    pub fn diffracted(
        camera: &Camera,
        channel: usize,
        xy_mm: DVec2,
        samples: &SobolSet,
    ) -> Option<Self> {
        let diffraction = camera.lens_diffraction();
        let here = diffraction.map(|d| d.at(xy_mm, PUPIL_KEY));
        Self::from_starts(camera, channel, xy_mm, samples, here.as_ref())
    }

    fn from_starts(
        camera: &Camera,
        channel: usize,
        xy_mm: DVec2,
        samples: &SobolSet,
        diffraction: Option<&PlaceDiffraction<'_>>,
    ) -> Option<Self> {
        let pupil = camera.pupil_at(xy_mm)?;
        let n = samples.len();
        let mut aside = Vec::new();
        if diffraction.is_some() {
            aside.resize(n, 0.0);
            samples.fill(4, PUPIL_KEY, 0, &mut aside);
        }
        let origin = camera_from_sensor_mm(xy_mm, camera.sensor_z_mm());
        let shift = camera.shift_at_um(xy_mm);
        let n_sub = camera.sensor().subpixels().count();
        let mut bundle = Self {
            q0: Vec::with_capacity(n),
            q1_mm: Vec::with_capacity(n),
            slopes: Vec::with_capacity(n),
            directions: Vec::with_capacity(n),
            wavelengths_mm: Vec::with_capacity(n),
            weights: Vec::with_capacity(n * n_sub),
            measure: Vec::with_capacity(n),
            scale: pupil.area_mm2() / n as f64,
            subpixels: n_sub,
        };
        let colours = camera.colours();
        let shares = colours.count();
        // What one ray of a wavelength stands for, in slope.
        let distance = (pupil.centre_mm.z - origin.z).abs();
        let spread = (pupil.area_mm2() * shares as f64 / n as f64).sqrt() / distance;
        for wavelength in 0..shares {
            let share = wavelength * n / shares..(wavelength + 1) * n / shares;
            // Shares of other lengths count the same.
            let even = n as f64 / (shares * share.len().max(1)) as f64;
            let mut batch = RayBatch::with_capacity(share.len());
            let (mut u, mut v, mut measure) = (Vec::new(), Vec::new(), Vec::new());
            let mut directions: Vec<DVec3> = Vec::new();
            let wavelength_mm = colours.traced_nm(channel, wavelength) * MM_PER_NM;
            let (first, of_share) = (share.start, share.len());
            for i in share {
                let (a, b) = golden_disk(i - first, of_share);
                let target =
                    pupil.centre_mm + (a * pupil.axis_a_mm + b * pupil.axis_b_mm).extend(0.0);
                let e = target - origin;
                let d = e.normalize();
                let start = diffraction.map_or(origin, |here| {
                    let moved = here.displacement(i, d.truncate(), aside[i]);
                    origin + (wavelength_mm * moved).extend(0.0)
                });
                batch.push(start, (target - start).normalize());
                measure.push(even * (e.z * e.z / e.length_squared().powi(2)));
                directions.push(d);
                let uv = uv_from_camera_direction(-d);
                u.push(uv.x as f32);
                v.push(uv.y as f32);
            }
            let mut response = vec![0f32; batch.len() * n_sub];
            let lookup = colours.response(colours.response_number(channel, wavelength));
            let shift = shift.to_array();
            lookup.weights_of_cells(shift, spread, [&mut u, &mut v], &mut response);
            let tracer = colours.tracer(channel, wavelength);
            tracer.trace_backward(&mut batch, SimdLevel::detect());
            for i in (0..batch.len()).filter(|&i| batch.status[i] == 0) {
                let o = DVec3::new(batch.ox[i], batch.oy[i], batch.oz[i]);
                let m = DVec2::new(batch.dx[i], batch.dy[i]) / batch.dz[i];
                bundle.q0.push(-m);
                bundle.q1_mm.push(o.truncate() - o.z * m);
                let d = directions[i];
                bundle.slopes.push(d.truncate() / d.z);
                bundle.directions.push(d.truncate());
                bundle.wavelengths_mm.push(wavelength_mm);
                bundle.measure.push(measure[i]);
                let of_ray = &response[i * n_sub..][..n_sub];
                let weights = of_ray.iter().map(|&w| f64::from(w) * measure[i]);
                bundle.weights.extend(weights);
            }
        }
        Some(bundle)
    }
}

/// Point `k` of `n` in the unit disk: steps of the golden ratio, which no line or circle cuts unevenly.
fn golden_disk(k: usize, n: usize) -> (f64, f64) {
    const INVERSE_GOLDEN: f64 = 0.618_033_988_749_894_9;
    concentric_disk(
        (k as f64 + 0.5) / n as f64,
        (k as f64 * INVERSE_GOLDEN).fract(),
    )
}

/// Centroids of each sub-pixel's rays, and of all together, from the sensor position `xy_mm`, at a channel's
/// wavelengths: by the polar rule, or where that does not hold by as many points as there are `samples`. `None` where
/// no light passes.
pub(crate) fn centroids(
    camera: &Camera,
    channel: usize,
    xy_mm: DVec2,
    samples: &SobolSet,
) -> Option<(Vec<Centroid>, Centroid)> {
    if let Some(by_rule) = polar_rule::centroids(camera, channel, xy_mm) {
        return Some(by_rule);
    }
    of_points(camera, channel, xy_mm, samples)
}

/// The same by points all over the pupil, which holds for every bundle.
pub(super) fn of_points(
    camera: &Camera,
    channel: usize,
    xy_mm: DVec2,
    samples: &SobolSet,
) -> Option<(Vec<Centroid>, Centroid)> {
    let bundle = Bundle::new(camera, channel, xy_mm, samples)?;
    let mut of_subpixel = vec![Centroid::default(); bundle.subpixels];
    let mut of_all = Centroid::default();
    for (i, weights) in bundle.weights.chunks_exact(bundle.subpixels).enumerate() {
        let seen = [bundle.q0[i], bundle.q1_mm[i], bundle.slopes[i]];
        of_all.incident += bundle.measure[i];
        for (s, &w) in of_subpixel.iter_mut().zip(weights) {
            s.add(w, seen);
            of_all.add(w, seen);
        }
    }
    let scale = bundle.scale;
    (of_all.weight > 0.0).then(|| {
        (
            of_subpixel
                .into_iter()
                .map(|s| s.normalised(scale))
                .collect(),
            of_all.normalised(scale),
        )
    })
}
