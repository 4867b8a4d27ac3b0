//! Where the rays of a block start and go, with the best instructions there are: straight-line arithmetic over columns,
//! nothing contracted, so that every [`SimdLevel`] gives the same bits.

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

/// Moves the rays of a batch that are aimed at points of the pupil by displacements over wavelength, each towards its
/// point; the wavelength and each ray's way from the sensor to the pupil's plane: mm.
pub(super) fn displace(
    batch: &mut RayBatch,
    displacements: [&[f64]; 2],
    pupil_z_mm: &[f64],
    wavelength_mm: f64,
    level: SimdLevel,
) {
    let moves = Moves {
        displacements,
        pupil_z_mm,
        wavelength_mm,
    };
    match level.min(SimdLevel::detect()) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
        SimdLevel::Avx512 => unsafe { moved_avx512(batch, &moves) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `detect` found AVX2 (or more) on this CPU.
        SimdLevel::Avx2 => unsafe { moved_avx2(batch, &moves) },
        _ => moved(batch, &moves),
    }
}

/// See [`displace`].
struct Moves<'a> {
    displacements: [&'a [f64]; 2],
    pupil_z_mm: &'a [f64],
    wavelength_mm: f64,
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn moved_avx2(batch: &mut RayBatch, moves: &Moves<'_>) {
    moved(batch, moves);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn moved_avx512(batch: &mut RayBatch, moves: &Moves<'_>) {
    moved(batch, moves);
}

#[inline(always)]
fn moved(batch: &mut RayBatch, moves: &Moves<'_>) {
    let n = batch.ox.len();
    let [x, y] = moves.displacements.map(|d| &d[..n]);
    let (pupil_z, wavelength) = (&moves.pupil_z_mm[..n], moves.wavelength_mm);
    let RayBatch {
        ox, oy, dx, dy, dz, ..
    } = batch;
    let (ox, oy) = (&mut ox[..n], &mut oy[..n]);
    let (dx, dy, dz) = (&mut dx[..n], &mut dy[..n], &mut dz[..n]);
    for i in 0..n {
        let (x, y, z) = (wavelength * x[i], wavelength * y[i], pupil_z[i]);
        let length = z / dz[i];
        let (ex, ey) = (dx[i] * length - x, dy[i] * length - y);
        let inverse = 1.0 / (ex * ex + ey * ey + z * z).sqrt();
        (ox[i], oy[i]) = (ox[i] + x, oy[i] + y);
        (dx[i], dy[i], dz[i]) = (ex * inverse, ey * inverse, z * inverse);
    }
}
