//! The phases with which light from one point arrives at a place on the sensor, by direction.
//!
//! Of the rays from the point, let that which arrives in direction w pass the sensor d(w) beside the place, and L(w) be
//! its optical path from the point to the foot of the place on it (Hamilton's mixed characteristic; M. Born, E. Wolf,
//! *Principles of Optics*, section 4.1):
//!
//! ```text
//! W(q) = 2π/λ (L − L_chief),      w = middle + M q,      d = λ/2π M⁻ᵀ ∇W
//! ```
//!
//! Rays are traced from the sensor, each from where it meets the point (by one step of Newton's method), and a
//! polynomial is fitted to W. The foot of the *point* on the rays from the place would be simpler, but its error, the
//! square of a miss at the scale of the scene, is a tenth of a wave and more where a place is out of focus.

use glam::{DMat2, DVec2, DVec3};

use crate::lens::polynomial::{DiskFit, DiskPolynomial, terms};
use crate::lens::{Clipping, OpticalSystem, PacketTracer, Travel, trace_visiting};
use crate::rays::{Ray, RayBatch};
use crate::sampling::concentric_disk;
use crate::simd::SimdLevel;

/// Total degree of the polynomial.
const DEGREE: usize = 12;
/// Rays that it is fitted to.
const RAYS: usize = 4 * terms(DEGREE);
/// How far starts are moved for their derivatives.
const STEP_MM: f64 = 1e-4;
/// Steps of the golden ratio.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A point of the scene, and the directions to it.
pub(super) struct Sight<'a> {
    pub system: &'a OpticalSystem,
    /// The same without any aperture.
    pub open: &'a PacketTracer,
    /// Camera frame.
    pub place_mm: DVec3,
    /// Depth of the point, which lies on the ray of the middle direction; may be infinite.
    pub depth_mm: f64,
    /// q = `to_disk` (w − `middle`).
    pub middle: DVec2,
    pub to_disk: DMat2,
}

/// A lens without apertures.
pub(super) fn opened(system: &OpticalSystem) -> PacketTracer {
    let mut system = system.clone();
    let surfaces = system.surfaces.iter_mut();
    surfaces.for_each(|surface| surface.aperture.semi_mm = f64::INFINITY);
    PacketTracer::new(&system)
}

/// W over a disk of directions, rad.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wavefront {
    /// Of q/`radius`.
    polynomial: DiskPolynomial,
    radius: f64,
}

impl Wavefront {
    /// What W is fitted by, over the unit disk.
    pub fn fit() -> Option<DiskFit> {
        let point = |k: usize| {
            let (s, t) = ((k as f64 + 0.5) / RAYS as f64, (k as f64 * GOLDEN).fract());
            DVec2::from(concentric_disk(s, t))
        };
        DiskFit::new(DEGREE, (0..RAYS).map(point).collect())
    }

    /// For directions with |q| up to `radius`; `None` where rays do not pass the lens's surfaces, clear apertures left
    /// aside.
    pub fn traced(sight: &Sight<'_>, radius: f64, fit: &DiskFit) -> Option<Self> {
        let from_disk = sight.to_disk.inverse();
        let follow = |q: DVec2, beside: DVec2| {
            let w = sight.middle + from_disk * q;
            let direction = w.extend(-(1.0 - w.length_squared()).sqrt());
            let origin_mm = sight.place_mm + beside.extend(0.0);
            let (exit, path) = followed(
                sight.system,
                Ray {
                    origin_mm,
                    direction,
                },
            )?;
            Some((exit, path + w.dot(beside)))
        };
        let (chief, chief_path) = follow(DVec2::ZERO, DVec2::ZERO)?;
        let along = (-sight.depth_mm - chief.origin_mm.z) / chief.direction.z;
        let point = chief.origin_mm + along * chief.direction;
        // By how much a ray misses the point: in its plane, or in direction.
        let miss = |ray: &Ray| match along.is_finite() {
            true => {
                let t = (point.z - ray.origin_mm.z) / ray.direction.z;
                (ray.origin_mm + t * ray.direction - point).truncate()
            }
            false => (ray.direction - chief.direction).truncate(),
        };
        let moved = |step: DVec2| {
            let both =
                [step, -step].map(|beside| follow(DVec2::ZERO, beside).map(|(ray, _)| miss(&ray)));
            Some((both[0]? - both[1]?) / (2.0 * STEP_MM))
        };
        let per_start = DMat2::from_cols(moved(STEP_MM * DVec2::X)?, moved(STEP_MM * DVec2::Y)?);
        let to_start = per_start.inverse();
        let to_phase = std::f64::consts::TAU / (sight.system.wavelength_nm * 1e-6);
        let mut starts = RayBatch::with_capacity(fit.points().len());
        for point in fit.points() {
            let w = sight.middle + from_disk * (radius * *point);
            let direction = w.extend(-(1.0 - w.length_squared()).sqrt());
            starts.push(sight.place_mm, direction);
        }
        sight.open.trace_backward(&mut starts, SimdLevel::detect());
        let phase = |(number, q): (usize, &DVec2)| {
            // What a step leaves is the square of the miss, by the part that the lens is not linear, and W errs by the
            // square of what is left. A second step changes W of the built-in lenses by 6e-5 waves at most.
            let beside = -(to_start * miss(&starts.get(number).ok()?));
            let (exit, path) = follow(radius * *q, beside)?;
            let rest = match along.is_finite() {
                true => exit.direction.dot(point - exit.origin_mm) - along,
                // To the plane across the middle ray.
                false => {
                    let across = chief.direction.dot(chief.origin_mm - exit.origin_mm);
                    across / chief.direction.dot(exit.direction)
                }
            };
            let phase = to_phase * (path + rest - chief_path);
            phase.is_finite().then_some(phase)
        };
        let phases: Option<Vec<f64>> = fit.points().iter().enumerate().map(phase).collect();
        Some(Self::fitted(radius, fit, &phases?))
    }

    /// From W at `radius` times the points of the fit.
    pub fn fitted(radius: f64, fit: &DiskFit, phases: &[f64]) -> Self {
        let polynomial = fit.of(phases);
        Self { polynomial, radius }
    }

    /// W, rad.
    pub fn phase(&self, q: DVec2) -> f64 {
        self.polynomial.value(q / self.radius)
    }

    /// ∇W.
    pub fn gradient(&self, q: DVec2) -> DVec2 {
        self.polynomial.gradient(q / self.radius) / self.radius
    }

    /// RMS of W over the disk about its mean and tilt, waves.
    pub fn rms_waves(&self) -> f64 {
        self.polynomial.rms_beyond_tilt() / std::f64::consts::TAU
    }

    /// The same of the difference to another.
    pub fn differs_waves(&self, other: &Self) -> f64 {
        self.polynomial.minus(&other.polynomial).rms_beyond_tilt() / std::f64::consts::TAU
    }
}

/// A ray behind the lens (in the scene) and its optical path so far, mm.
fn followed(system: &OpticalSystem, ray: Ray) -> Option<(Ray, f64)> {
    let (mut last, mut path) = (ray.origin_mm, 0.0);
    let exit = trace_visiting(system, ray, Travel::Backward, Clipping::Off, |i, local| {
        let surface = &system.surfaces[i];
        let point = surface.pose.camera_point_mm(local);
        // Towards the scene; a stop behind the glass's vertex is met the other way.
        path += surface.index_after * (point - last).length() * (last.z - point.z).signum();
        last = point;
    });
    let exit = exit.ok()?;
    (path.is_finite() && exit.direction.is_finite()).then_some((exit, path))
}
