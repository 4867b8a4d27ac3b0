//! A map of a window of a lens, and rays of all its places.

use glam::{DMat2, DVec2};
use quadpixel::field::SensorWindowMm;
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::{
    ExitPupilMap, FocusBy, Lens, LensMap, MapBound, MapFailure, MapTask, OpticalSystem,
    PlaceBuffers, Prescription, trace_backward,
};
use quadpixel::rays::{Ray, RayBatch};
use quadpixel::sampling::{concentric_disk, uniform};
use quadpixel::simd::SimdLevel;

/// A window of a lens.
pub struct Case {
    pub lens: Lens,
    pub focus_mm: f64,
    pub centre_mm: DVec2,
    pub half_mm: f64,
    pub pitch_um: f64,
    pub bound: MapBound,
}

impl Case {
    /// A quarter of a millimetre and 2.8 µm pixels for a phone's lens, in focus at 750 mm.
    pub fn phone(name: &str, centre_mm: [f64; 2]) -> Self {
        Self {
            lens: lens(name),
            focus_mm: 750.0,
            centre_mm: centre_mm.into(),
            half_mm: 0.25,
            pitch_um: 2.8,
            bound: MapBound::default(),
        }
    }

    /// 6 µm pixels for a large lens, in focus at 2 m.
    pub fn large(name: &str, centre_mm: [f64; 2], half_mm: f64) -> Self {
        Self {
            focus_mm: 2000.0,
            half_mm,
            pitch_um: 6.0,
            ..Self::phone(name, centre_mm)
        }
    }

    pub fn system(&self) -> OpticalSystem {
        let focused = self.lens.focused_at(self.focus_mm, FocusBy::Sensor, 550.0);
        focused.unwrap().at(550.0).unwrap()
    }

    fn window(&self) -> SensorWindowMm {
        SensorWindowMm {
            centre: self.centre_mm,
            half_width: self.half_mm,
            half_height: self.half_mm,
        }
    }

    pub fn map(&self) -> Result<(OpticalSystem, ExitPupilMap, LensMap), MapFailure> {
        let system = self.system();
        let pupils = ExitPupilMap::new(std::slice::from_ref(&system), self.window());
        let task = MapTask {
            system: &system,
            pupils: &pupils,
            window: self.window(),
            pitch_mm: self.pitch_um * 1e-3,
            focus_mm: self.focus_mm,
            bound: self.bound,
            rays: usize::MAX,
        };
        let map = LensMap::new(&task, None)?;
        Ok((system, pupils, map))
    }
}

pub fn lens(name: &str) -> Lens {
    Lens::new(&Prescription::builtin(name).unwrap()).unwrap()
}

/// Rays of a pixel at a place, as a render aims them.
pub fn rays(case: &Case, pupils: &ExitPupilMap, z_mm: f64, place: DVec2, count: u64) -> RayBatch {
    let pupil = pupils.at(place.x, place.y).unwrap();
    let mut batch = RayBatch::default();
    for i in 0..count {
        let u = |k: u64| uniform(place.x.to_bits() ^ place.y.to_bits() << 1, &[i, k]);
        let (p, q) = concentric_disk(u(0), u(1));
        let in_pixel = (DVec2::new(u(2), u(3)) - 0.5) * (case.pitch_um * 1e-3);
        let origin = camera_from_sensor_mm(place + in_pixel, z_mm);
        let target = pupil.centre_mm + (pupil.axis_a_mm * p + pupil.axis_b_mm * q).extend(0.0);
        batch.push(origin, (target - origin).normalize());
    }
    batch
}

/// What a map makes of the rays of a window.
#[derive(Debug, Default)]
pub struct Errors {
    /// Of the place on the sensor that a ray belongs to, px: root mean square and largest, at half the depth in focus,
    /// at it, and at infinity.
    pub rms_px: [f64; 3],
    pub worst_px: [f64; 3],
    /// Part of the rays that pass the map and not the lens, or the lens and not the map.
    pub misjudged: f64,
    /// Part of the rays that was traced exactly.
    pub exact: f64,
}

/// A map's errors by the plain tracer: 12 × 12 places, 48 rays each.
pub fn errors(case: &Case) -> Errors {
    let parts = case.map().unwrap();
    let errors = errors_from(case, &parts, |_| DVec2::ZERO, |px, _| px);
    println!("{:?}\n{errors:?}", parts.2.report());
    errors
}

/// How far its map serves rays, px, and its errors for those that start from two pixels to this part of that way from
/// their place, over the way.
pub fn far_errors(case: &Case, part: f64) -> (f64, Errors) {
    let parts = case.map().unwrap();
    let far_px = parts.2.far_mm() / (case.pitch_um * 1e-3);
    let off_px = |k: u64| {
        let u = |d: u64| uniform(0xFA2, &[k, d]);
        let angle = std::f64::consts::TAU * u(0);
        DVec2::from_angle(angle) * (2.0 + u(1) * (part * far_px - 3.0))
    };
    let errors = errors_from(case, &parts, off_px, |px, way_px| px / way_px);
    (far_px, errors)
}

/// The errors of rays that start at some ways (px, of a number) from their place, as `count` has them of an error and
/// the way's length, px.
fn errors_from(
    case: &Case,
    (system, pupils, map): &(OpticalSystem, ExitPupilMap, LensMap),
    off_px: impl Fn(u64) -> DVec2,
    count: impl Fn(f64, f64) -> f64,
) -> Errors {
    let focus_mm = case.focus_mm.min(1e6);
    let depths_mm = [0.5 * focus_mm, focus_mm, f64::INFINITY];
    let mut buffers = PlaceBuffers::default();
    let (mut errors, mut passed, mut all) = (Errors::default(), 0.0, 0.0);
    for k in 0..144_u64 {
        let part = DVec2::new((k % 12) as f64 + 0.37, (k / 12) as f64 + 0.71) / 6.0 - 1.0;
        let place = case.centre_mm + part * case.half_mm;
        let off_px = off_px(k);
        let beside = place + off_px * (case.pitch_um * 1e-3);
        let start = rays(case, pupils, system.sensor_z_mm, beside, 48);
        let mut mapped = start.clone();
        let exact = map.trace_backward(&mut mapped, place, &mut buffers, SimdLevel::detect());
        errors.exact += exact as f64;
        for i in 0..start.len() {
            all += 1.0;
            let truth = trace_backward(system, start.ray(i));
            errors.misjudged += f64::from(truth.is_err() != mapped.get(i).is_err());
            let (Ok(truth), Ok(ray)) = (truth, mapped.get(i)) else {
                continue;
            };
            let both = [truth, ray];
            let Some(px) = errors_px(system, start.ray(i), both, depths_mm, case.pitch_um) else {
                continue;
            };
            passed += 1.0;
            for (depth, px) in px.into_iter().enumerate() {
                let px = count(px, off_px.length());
                errors.rms_px[depth] += px * px;
                errors.worst_px[depth] = errors.worst_px[depth].max(px);
            }
        }
    }
    errors.rms_px = errors.rms_px.map(|sum: f64| (sum / passed).sqrt());
    errors.misjudged /= all;
    errors.exact /= all;
    errors
}

/// By how much the place where a ray would have to start differs from where it starts, at each depth. The scene's shift
/// per shift on the sensor is that of rays from beside the place to the same point of the pupil, or nearly.
fn errors_px(
    system: &OpticalSystem,
    start: Ray,
    [truth, mapped]: [Ray; 2],
    depths_mm: [f64; 3],
    pitch_um: f64,
) -> Option<[f64; 3]> {
    let step_mm = 1e-4;
    let target = start.origin_mm + start.direction * system.sensor_z_mm;
    let beside = |off: DVec2| {
        let origin_mm = start.origin_mm + off.extend(0.0) * step_mm;
        let direction = (target - origin_mm).normalize();
        trace_backward(
            system,
            Ray {
                origin_mm,
                direction,
            },
        )
        .ok()
    };
    let (along_x, along_y) = (beside(DVec2::X)?, beside(DVec2::Y)?);
    Some(depths_mm.map(|depth_mm| {
        let seen = |ray: Ray| {
            let slope = ray.direction.truncate() / ray.direction.z;
            match depth_mm.is_finite() {
                true => ray.origin_mm.truncate() - slope * (ray.origin_mm.z + depth_mm),
                false => slope,
            }
        };
        let column = |there: Ray| (seen(there) - seen(truth)) / step_mm;
        let jacobian = DMat2::from_cols(column(along_x), column(along_y));
        (jacobian.inverse() * (seen(mapped) - seen(truth))).length() * 1e3 / pitch_um
    }))
}
