//! Tracing the lens: exact, at each instruction set, and the trial of polynomials ([`super::lens_map`]), whose error is that of where a ray's
//! object point lies, carried to the sensor by the magnification.

use glam::DVec2;
use quadpixel::command::CommandError;
use quadpixel::field::SensorWindowMm;
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::{ExitPupilMap, OpticalSystem, PacketTracer, PupilEllipse};
use quadpixel::rays::RayBatch;
use quadpixel::sampling::{SobolSet, concentric_disk};
use quadpixel::simd::SimdLevel;
use quadpixel::spectrum::ChannelWavelengths;

use super::Size;
use super::clock::best_of;
use super::lens_map::{LARGEST_DEGREE, LensMap, Traced};
use super::row::{Curve, Row, Table};
use super::work::{FOCUS_MM, LENS, Work, failed, lens, mosaic};

/// Half side of the square of the sensor that the polynomials serve, mm.
const HALF_MM: f64 = 2.0;
/// Rays of the renders whose share of tracing is told.
const RENDERED: usize = 256;

/// Rings of the field with polynomials of their own, of equal area.
const RINGS: [usize; 2] = [1, 16];

/// What polynomials cost and leave.
struct Trial {
    /// Of a million rays.
    seconds: f64,
    rms_um: f64,
    largest_um: f64,
}

/// Rays aimed from all over a square of the sensor at its exit pupils.
struct Rays {
    sensor_mm: Vec<DVec2>,
    pupil_mm: Vec<DVec2>,
    start: RayBatch,
}

pub(super) fn table(size: Size) -> Result<Table, CommandError> {
    let (count, degrees) = match size {
        Size::Affordable => (1 << 14, 2..=6),
        Size::Full => (1 << 16, 2..=LARGEST_DEGREE),
    };
    let system = lens()?
        .at(ChannelWavelengths::default().reference_nm())
        .map_err(failed)?;
    let tracer = PacketTracer::new(&system);
    let (fitted, asked) = (rays(&system, count, 1), rays(&system, count, 2));
    let passing = traced(&tracer, &fitted);
    let exact = traced(&tracer, &asked);
    let um_per_mm = 1e3 * magnification(&system)?;

    let mut exact_rows = Vec::new();
    let mut slowest = f64::NAN;
    for level in SimdLevel::ALL
        .into_iter()
        .filter(|l| *l <= SimdLevel::detect())
    {
        let mut batch = asked.start.clone();
        let (seconds, ()) = best_of(5, || {
            batch.clone_from(&asked.start);
            tracer.trace_backward(&mut batch, level);
        });
        let seconds = seconds / count as f64 * 1e6;
        slowest = slowest.max(seconds);
        exact_rows.push(Row::new(format!("exact, {level:?}"), seconds, 0.0));
    }
    let mut curves = vec![Curve {
        name: "exact".into(),
        rows: exact_rows.clone(),
    }];
    let mut notes = Vec::new();
    for rings in RINGS {
        let (mut root, mut largest) = (Vec::new(), Vec::new());
        for degree in degrees.clone() {
            let Some(trial) = trial([&passing, &exact], rings, degree, um_per_mm) else {
                continue;
            };
            let setting = format!("degree {degree}, {rings} rings, Scalar");
            root.push(Row::new(setting.clone(), trial.seconds, trial.rms_um));
            largest.push(Row::new(setting.clone(), trial.seconds, trial.largest_um));
            notes.push(format!(
                "{setting}: {:.1} times as fast as exact tracing with the same instructions.",
                slowest / trial.seconds
            ));
        }
        for (name, rows) in [("RMS", root), ("largest", largest)] {
            let name = format!("{rings} rings, {name}");
            curves.push(Curve { name, rows });
        }
    }
    let lost = 1.0 - exact.len() as f64 / count as f64;
    notes.push(format!(
        "{:.1} % of the rays aimed are stopped by the lens; polynomials would let them pass or need one more for each aperture.",
        100.0 * lost
    ));
    notes.push(share(&exact_rows)?);
    Ok(Table {
        knob: "lens",
        work: format!(
            "{LENS} at 550 nm, a square of {} mm about the axis, rays aimed at the exit pupil as renders do; seconds of a million rays",
            2.0 * HALF_MM
        ),
        reference: format!(
            "exact tracing; the error is where the ray meets the plane in focus ({FOCUS_MM} mm), carried to the sensor"
        ),
        seconds_unit: "s a million rays",
        error_unit: "um on the sensor",
        curves,
        law: None,
        notes,
    })
}

/// What part of a chart's render is tracing, in words.
fn share(exact: &[Row]) -> Result<String, CommandError> {
    let work = Work::new(24)?;
    let camera = work.camera(ChannelWavelengths::default())?;
    let scene = work.scene(&camera, FOCUS_MM, 7)?;
    let (seconds, _) = best_of(3, || mosaic(&camera, &scene, RENDERED, 1));
    // The spread is measured by every 64th pixel again.
    let rays = 3.0 * RENDERED as f64 * work.pixels() * (1.0 + 1.0 / 64.0);
    let fastest = exact
        .iter()
        .map(|r| r.seconds)
        .fold(f64::INFINITY, f64::min);
    let part = fastest / (seconds / rays * 1e6);
    Ok(format!(
        "Tracing is {:.0} % of the time of a chart's render here: without it at all, a render would be {:.1} times as fast.",
        100.0 * part,
        1.0 / (1.0 - part).max(0.01)
    ))
}

fn rays(system: &OpticalSystem, count: usize, key: u64) -> Rays {
    let window = SensorWindowMm {
        centre: DVec2::ZERO,
        half_width: HALF_MM,
        half_height: HALF_MM,
    };
    let pupils = ExitPupilMap::new(std::slice::from_ref(system), window);
    let set = SobolSet::new(count);
    let [x, y, p, q]: [Vec<f64>; 4] = std::array::from_fn(|dim| {
        let mut s = vec![0.0; count];
        set.fill(dim, key, 0, &mut s);
        s
    });
    let samples = x.iter().zip(&y).zip(p.iter().zip(&q));
    let mut all = Rays {
        sensor_mm: Vec::new(),
        pupil_mm: Vec::new(),
        start: RayBatch::with_capacity(count),
    };
    for ((x, y), (p, q)) in samples {
        let xy = DVec2::new(*x, *y) * (2.0 * HALF_MM) - HALF_MM;
        let Some(PupilEllipse {
            centre_mm,
            axis_a_mm,
            axis_b_mm,
        }) = pupils.at(xy.x, xy.y)
        else {
            continue;
        };
        let (a, b) = concentric_disk(*p, *q);
        let target = centre_mm + (a * axis_a_mm + b * axis_b_mm).extend(0.0);
        let origin = camera_from_sensor_mm(xy, system.sensor_z_mm);
        all.sensor_mm.push(origin.truncate());
        all.pupil_mm.push(target.truncate());
        all.start.push(origin, (target - origin).normalize());
    }
    all
}

/// The rays that pass, on the plane in focus.
fn traced(tracer: &PacketTracer, rays: &Rays) -> Vec<Traced> {
    let mut batch = rays.start.clone();
    tracer.trace_backward(&mut batch, SimdLevel::detect());
    (0..batch.len())
        .filter_map(|i| {
            let out = batch.get(i).ok()?;
            Some(Traced::new(
                rays.sensor_mm[i],
                rays.pupil_mm[i],
                out,
                -FOCUS_MM,
            ))
        })
        .collect()
}

/// mm on the sensor of a mm in the plane in focus, on the axis.
fn magnification(system: &OpticalSystem) -> Result<f64, CommandError> {
    let small_mm = 1e-3;
    let chief = quadpixel::lens::chief_ray(system, small_mm, 0.0).map_err(failed)?;
    let out = quadpixel::lens::trace_backward(system, chief).map_err(failed)?;
    let at = Traced::new(chief.origin_mm.truncate(), DVec2::ZERO, out, -FOCUS_MM);
    Ok(small_mm / at.place_mm.length())
}

/// Polynomials fitted to the first rays, ring by ring, and held against the second; `None` where a ring has too few rays to tell the terms
/// apart.
fn trial(
    [fitted, exact]: [&[Traced]; 2],
    rings: usize,
    degree: usize,
    um_per_mm: f64,
) -> Option<Trial> {
    let (mut seconds, mut sum, mut largest) = (0.0, 0.0, 0f64);
    for ring in 0..rings {
        let within = |r: &&Traced| {
            (r.sensor_mm.length_squared() / (2.0 * HALF_MM * HALF_MM) * rings as f64) as usize
                == ring
        };
        let own = |rays: &[Traced]| rays.iter().filter(within).copied().collect::<Vec<Traced>>();
        let (fitted, exact) = (own(fitted), own(exact));
        let map = LensMap::fit(&fitted, degree)?;
        let (sensor, pupil): (Vec<DVec2>, Vec<DVec2>) =
            exact.iter().map(|r| (r.sensor_mm, r.pupil_mm)).unzip();
        let mut out = vec![[0.0; 4]; exact.len()];
        let (time, ()) = best_of(1, || map.map(&sensor, &pupil, &mut out));
        seconds += time;
        for (ray, out) in exact.iter().zip(&out) {
            let off = um_per_mm * (ray.place_mm - DVec2::new(out[0], out[1])).length();
            (sum, largest) = (sum + off * off, largest.max(off));
        }
    }
    let count = exact.len() as f64;
    Some(Trial {
        seconds: seconds / count * 1e6,
        rms_um: (sum / count).sqrt(),
        largest_um: largest,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn polynomials_come_nearer_to_the_traced_rays_with_their_degree() {
        let system = lens().unwrap().at(550.0).unwrap();
        let tracer = PacketTracer::new(&system);
        let [fitted, asked] = [1, 2].map(|key| traced(&tracer, &rays(&system, 2048, key)));
        let um = 1e3 * magnification(&system).unwrap();
        // Paraxially: focal length over distance, to the part by which the focus is nearer than infinity.
        let f = lens().unwrap().paraxial(550.0).unwrap().efl_mm;
        assert!((um / 1e3 / (f / (FOCUS_MM - f)) - 1.0).abs() < 0.02);
        let of = |rings, degree| trial([&fitted, &asked], rings, degree, um).unwrap().rms_um;
        let (coarse, fine, of_rings) = (of(1, 2), of(1, 4), of(4, 4));
        assert!(
            fine < 0.5 * coarse && of_rings < fine,
            "{coarse} {fine} {of_rings}"
        );
    }
}
