//! Where the rays of a block start and go, with the best instructions there are: straight-line arithmetic over columns,
//! nothing contracted, so that every [`SimdLevel`] gives the same bits.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::camera::Camera;
use super::pixel_aim::PixelAim;
use crate::frames::camera_from_sensor_mm;
use crate::lens::PupilEllipse;
use crate::rays::RayBatch;
use crate::sampling::{SobolSet, concentric_disk};
use crate::simd::SimdLevel;

/// The pixel that rays start in and the ellipse that they are aimed at.
#[derive(Clone, Copy)]
pub(super) struct Target {
    corner_mm: DVec2,
    pitch_mm: f64,
    pub sensor_z_mm: f64,
    pub pupil: PupilEllipse,
}

impl Target {
    pub fn new(camera: &Camera, aim: &PixelAim) -> Self {
        let pitch_mm = camera.sensor().pitch_mm();
        Self {
            corner_mm: aim.position_mm - DVec2::splat(0.5 * pitch_mm),
            pitch_mm,
            sensor_z_mm: camera.sensor_z_mm(),
            pupil: aim.pupil,
        }
    }

    /// Origins and directions (in columns), and measures, of samples: places in the pixel and points of the unit disk.
    pub fn aim(
        self,
        samples: [&[f64]; 4],
        aimed: [&mut [f64]; 6],
        measure: &mut [f64],
        level: SimdLevel,
    ) {
        match level.min(SimdLevel::detect()) {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
            SimdLevel::Avx512 => unsafe { aim_avx512(self, samples, aimed, measure) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 => unsafe { aim_avx2(self, samples, aimed, measure) },
            _ => aim(self, samples, aimed, measure),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn aim_avx2(to: Target, from: [&[f64]; 4], aimed: [&mut [f64]; 6], measure: &mut [f64]) {
    aim(to, from, aimed, measure);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn aim_avx512(to: Target, from: [&[f64]; 4], aimed: [&mut [f64]; 6], measure: &mut [f64]) {
    aim(to, from, aimed, measure);
}

#[inline(always)]
fn aim(to: Target, samples: [&[f64]; 4], aimed: [&mut [f64]; 6], measure: &mut [f64]) {
    let n = measure.len();
    let (corner, pitch, z) = (to.corner_mm, to.pitch_mm, to.sensor_z_mm);
    let PupilEllipse {
        centre_mm: c,
        axis_a_mm: a,
        axis_b_mm: b,
    } = to.pupil;
    let delta_z = c.z - z;
    let [sx, sy, sp, sq] = samples;
    let [ox, oy, oz, dx, dy, dz] = aimed;
    let (sx, sy, sp, sq) = (&sx[..n], &sy[..n], &sp[..n], &sq[..n]);
    let (ox, oy, oz) = (&mut ox[..n], &mut oy[..n], &mut oz[..n]);
    let (dx, dy, dz) = (&mut dx[..n], &mut dy[..n], &mut dz[..n]);
    for i in 0..n {
        let on_sensor = corner + DVec2::new(pitch * sx[i], pitch * sy[i]);
        let DVec3 { x, y, .. } = camera_from_sensor_mm(on_sensor, z);
        let (p, q) = (sp[i], sq[i]);
        let ex = c.x + p * a.x + q * b.x - x;
        let ey = c.y + p * a.y + q * b.y - y;
        let squared = ex * ex + ey * ey + delta_z * delta_z;
        let inverse = 1.0 / squared.sqrt();
        (ox[i], oy[i], oz[i]) = (x, y, z);
        (dx[i], dy[i], dz[i]) = (ex * inverse, ey * inverse, delta_z * inverse);
        measure[i] = delta_z * delta_z / (squared * squared);
    }
}

/// Samples of a pixel from number `first` on: place in the pixel, 0 to 1, and point of the unit disk.
pub(super) fn sample(
    sobol: &SobolSet,
    key: u64,
    first: usize,
    out: [&mut [f64]; 4],
    level: SimdLevel,
) {
    match level.min(SimdLevel::detect()) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
        SimdLevel::Avx512 => unsafe { samples_avx512(sobol, key, first, out) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `detect` found AVX2 (or more) on this CPU.
        SimdLevel::Avx2 => unsafe { samples_avx2(sobol, key, first, out) },
        _ => samples(sobol, key, first, out),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn samples_avx2(sobol: &SobolSet, key: u64, first: usize, out: [&mut [f64]; 4]) {
    samples(sobol, key, first, out);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn samples_avx512(sobol: &SobolSet, key: u64, first: usize, out: [&mut [f64]; 4]) {
    samples(sobol, key, first, out);
}

#[inline(always)]
fn samples(sobol: &SobolSet, key: u64, first: usize, mut out: [&mut [f64]; 4]) {
    for (dim, s) in out.iter_mut().enumerate() {
        sobol.fill(dim, key, first, s);
    }
    let [_, _, p, q] = out;
    let n = p.len();
    let q = &mut q[..n];
    for i in 0..n {
        (p[i], q[i]) = concentric_disk(p[i], q[i]);
    }
}

/// Moves some rays of a batch that are aimed at points of the pupil by displacements over wavelength, each towards its
/// point; the wavelength and the way from the sensor to the pupil's plane: mm.
pub(super) fn displace(
    batch: &mut RayBatch,
    rays: Range<usize>,
    displacements: [&[f64]; 2],
    lengths_mm: [f64; 2],
    level: SimdLevel,
) {
    let RayBatch {
        ox, oy, dx, dy, dz, ..
    } = batch;
    let batch = [ox, oy, dx, dy, dz].map(|column| &mut column[rays.clone()]);
    match level.min(SimdLevel::detect()) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
        SimdLevel::Avx512 => unsafe { moved_avx512(batch, displacements, lengths_mm) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `detect` found AVX2 (or more) on this CPU.
        SimdLevel::Avx2 => unsafe { moved_avx2(batch, displacements, lengths_mm) },
        _ => moved(batch, displacements, lengths_mm),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn moved_avx2(batch: [&mut [f64]; 5], displacements: [&[f64]; 2], lengths_mm: [f64; 2]) {
    moved(batch, displacements, lengths_mm);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn moved_avx512(batch: [&mut [f64]; 5], displacements: [&[f64]; 2], lengths_mm: [f64; 2]) {
    moved(batch, displacements, lengths_mm);
}

#[inline(always)]
fn moved(b: [&mut [f64]; 5], [x, y]: [&[f64]; 2], [wavelength, pupil_z]: [f64; 2]) {
    let n = x.len();
    let y = &y[..n];
    let [ox, oy, dx, dy, dz] = b.map(|column| &mut column[..n]);
    for i in 0..n {
        let (x, y) = (wavelength * x[i], wavelength * y[i]);
        let length = pupil_z / dz[i];
        let (ex, ey) = (dx[i] * length - x, dy[i] * length - y);
        let inverse = 1.0 / (ex * ex + ey * ey + pupil_z * pupil_z).sqrt();
        (ox[i], oy[i]) = (ox[i] + x, oy[i] + y);
        (dx[i], dy[i], dz[i]) = (ex * inverse, ey * inverse, pupil_z * inverse);
    }
}
