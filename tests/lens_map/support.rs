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
pub struct Errors {
    /// Of the place on the sensor that a ray belongs to, px.
    pub rms_px: f64,
    pub worst_px: f64,
    /// Part of the rays that pass the map and not the lens, or the lens and not the map.
    pub misjudged: f64,
    /// Part of the rays that was traced exactly, of all and of those that a render would lose.
    pub exact: f64,
    pub lost: f64,
}

/// A map's errors at `depth_mm` before the first vertex (infinity too) by the plain tracer: 16 × 16 places, 64 rays
/// each. The scene's shift per shift on the sensor is that of rays from beside the place to the same point.
pub fn errors(case: &Case, depth_mm: f64) -> Result<Errors, MapFailure> {
    let (system, pupils, map) = case.map()?;
    println!("{:?}", map.report());
    let mut buffers = PlaceBuffers::default();
    let (mut squares, mut worst, mut passed) = (0.0, 0.0_f64, 0.0);
    let (mut misjudged, mut exact, mut lost, mut all) = (0.0, 0, 0.0, 0.0);
    for k in 0..256 {
        let part = DVec2::new((k % 16) as f64 + 0.37, (k / 16) as f64 + 0.71) / 8.0 - 1.0;
        let place = case.centre_mm + part * case.half_mm;
        let start = rays(case, &pupils, system.sensor_z_mm, place, 64);
        let mut mapped = start.clone();
        exact += map.trace_backward(&mut mapped, place, &mut buffers, SimdLevel::detect());
        for i in 0..start.len() {
            all += 1.0;
            let truth = trace_backward(&system, start.ray(i));
            lost += f64::from(truth.is_err());
            misjudged += f64::from(truth.is_err() != mapped.get(i).is_err());
            let (Ok(truth), Ok(ray)) = (truth, mapped.get(i)) else {
                continue;
            };
            let Some(px) = error_px(&system, start.ray(i), [truth, ray], depth_mm, case.pitch_um)
            else {
                continue;
            };
            passed += 1.0;
            squares += px * px;
            worst = worst.max(px);
        }
    }
    Ok(Errors {
        rms_px: (squares / passed).sqrt(),
        worst_px: worst,
        misjudged: misjudged / all,
        exact: exact as f64 / all,
        lost: lost / all,
    })
}

/// By how much the place where a ray would have to start differs from where it starts.
fn error_px(
    system: &OpticalSystem,
    start: Ray,
    rays: [Ray; 2],
    depth_mm: f64,
    pitch_um: f64,
) -> Option<f64> {
    let seen = |ray: Ray| {
        let slope = ray.direction.truncate() / ray.direction.z;
        match depth_mm.is_finite() {
            true => ray.origin_mm.truncate() - slope * (ray.origin_mm.z + depth_mm),
            false => slope,
        }
    };
    let [truth, mapped] = rays.map(seen);
    let step = 1e-4;
    let column = |off: DVec2| {
        let beside = Ray {
            origin_mm: start.origin_mm + off.extend(0.0) * step,
            ..start
        };
        // Towards the same point, about the pupil's distance away.
        let target = start.origin_mm + start.direction * (system.sensor_z_mm);
        let direction = (target - beside.origin_mm).normalize();
        let there = trace_backward(
            system,
            Ray {
                direction,
                ..beside
            },
        )
        .ok()?;
        Some((seen(there) - truth) / step)
    };
    let jacobian = DMat2::from_cols(column(DVec2::X)?, column(DVec2::Y)?);
    Some((jacobian.inverse() * (mapped - truth)).length() * 1e3 / pitch_um)
}
