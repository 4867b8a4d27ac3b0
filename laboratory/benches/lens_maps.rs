//! Error and speed of the maps of all lenses of the library against tracing surface by surface, at three image heights.
//!
//! `cargo bench -p quadpixel-laboratory --bench lens_maps [-- NAME]`: Markdown on stdout. One thread; rays of 200
//! pixels in a row, 128 each, each pixel's best time of 20. Errors are those that the maps report, of held-out rays.
#![allow(clippy::unwrap_used)] // because a bench fails by panicking

use std::time::Instant;

use glam::DVec2;
use quadpixel::field::SensorWindowMm;
use quadpixel::frames::camera_from_sensor_mm;
use quadpixel::lens::{
    ExitPupilMap, FocusBy, Lens, LensMap, MapBound, MapTask, OpticalSystem, PacketTracer,
    PlaceBuffers, Prescription, builtin_names,
};
use quadpixel::rays::RayBatch;
use quadpixel::sampling::{concentric_disk, uniform};
use quadpixel::simd::SimdLevel;

const PLACES: usize = 200;
const RAYS: u64 = 128;
const ROUNDS: usize = 20;
/// Image heights over the focal length: tan of the field angle of a lens without distortion.
const HEIGHTS: [f64; 3] = [0.0, 0.25, 0.45];

fn main() {
    let wanted = std::env::args().skip(1).find(|a| !a.starts_with('-'));
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    println!(
        "| lens | height, mm | degree | nodes | RMS, px | largest, px | exact rays | made in, ms | exact, M rays/s | map | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    for name in builtin_names() {
        if wanted.as_deref().is_none_or(|w| name.contains(w)) {
            one.install(|| HEIGHTS.iter().for_each(|h| row(name, *h)));
        }
    }
}

/// A lens at one height: 2.8 µm pixels of a 0.72 mm window for a phone's lens in focus at 750 mm, else 6 µm pixels of a
/// 2 mm window at 40 focal lengths.
fn row(name: &str, height: f64) {
    let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
    let efl_mm = lens.paraxial(550.0).unwrap().efl_mm;
    let (pitch_mm, half_mm, focus_mm) = match name.starts_with("lib") {
        true => (6e-3, 1.0, 40.0 * efl_mm),
        false => (2.8e-3, 0.36, 750.0),
    };
    let lens = lens.focused_at(focus_mm, FocusBy::Sensor, 550.0).unwrap();
    let system = lens.at(550.0).unwrap();
    let height_mm = height * efl_mm;
    let window = SensorWindowMm {
        centre: DVec2::new(0.8, 0.6) * height_mm,
        half_width: half_mm,
        half_height: half_mm,
    };
    let pupils = ExitPupilMap::new(std::slice::from_ref(&system), window);
    let task = MapTask {
        system: &system,
        pupils: &pupils,
        window,
        pitch_mm,
        focus_mm,
        bound: MapBound::default(),
        rays: usize::MAX,
    };
    let began = Instant::now();
    let map = LensMap::new(&task, None);
    let made_ms = began.elapsed().as_secs_f64() * 1e3;
    let map = match map {
        Ok(map) => map,
        Err(failure) => {
            println!(
                "| {name} | {height_mm:.1} | – | – | – | – | all | {made_ms:.0} | – | {failure} | – |"
            );
            return;
        }
    };
    let report = map.report();
    let (exact, mapped, share) = speeds(&task, &map);
    println!(
        "| {name} | {height_mm:.1} | {}, {}, {} | {} × {} | {:.4} | {:.3} | {:.2} % | {made_ms:.0} | {exact:.1} | {mapped:.1} | {:.1} |",
        report.degree,
        report.place_degree,
        report.change_degree,
        report.nodes.0,
        report.nodes.1,
        report.rms_px,
        report.worst_px,
        100.0 * share,
        mapped / exact
    );
}

/// Million rays per second, traced surface by surface and mapped, and the part of the latter that is traced exactly.
fn speeds(task: &MapTask<'_>, map: &LensMap) -> (f64, f64, f64) {
    let tracer = PacketTracer::new(task.system);
    let mut buffers = PlaceBuffers::default();
    let (mut seconds, mut exact_rays, mut rays) = ([0.0; 2], 0, 0);
    for k in 0..PLACES {
        let along = 2.0 * k as f64 / PLACES as f64 - 1.0;
        let place = task.window.centre + DVec2::new(along * task.window.half_width, 0.0);
        let Some(batch) = pixel(task.system, task.pupils, place, task.pitch_mm) else {
            continue;
        };
        rays += batch.len();
        let mut best = [f64::INFINITY; 2];
        for round in 0..ROUNDS {
            let mut work = batch.clone();
            let began = Instant::now();
            tracer.trace_backward(&mut work, SimdLevel::detect());
            best[0] = best[0].min(began.elapsed().as_secs_f64());
            let mut work = batch.clone();
            let began = Instant::now();
            let exact = map.trace_backward(&mut work, place, &mut buffers, SimdLevel::detect());
            best[1] = best[1].min(began.elapsed().as_secs_f64());
            exact_rays += if round == 0 { exact } else { 0 };
        }
        seconds.iter_mut().zip(best).for_each(|(s, b)| *s += b);
    }
    let speed = |k: usize| rays as f64 / seconds[k] * 1e-6;
    (speed(0), speed(1), exact_rays as f64 / rays as f64)
}

/// The rays of a pixel, as a render aims them.
fn pixel(
    system: &OpticalSystem,
    pupils: &ExitPupilMap,
    place: DVec2,
    pitch_mm: f64,
) -> Option<RayBatch> {
    let pupil = pupils.at(place.x, place.y)?;
    let mut batch = RayBatch::default();
    for i in 0..RAYS {
        let u = |k: u64| uniform(place.x.to_bits(), &[i, k]);
        let (p, q) = concentric_disk(u(0), u(1));
        let in_pixel = (DVec2::new(u(2), u(3)) - 0.5) * pitch_mm;
        let origin = camera_from_sensor_mm(place + in_pixel, system.sensor_z_mm);
        let target = pupil.centre_mm + (pupil.axis_a_mm * p + pupil.axis_b_mm * q).extend(0.0);
        batch.push(origin, (target - origin).normalize());
    }
    Some(batch)
}
