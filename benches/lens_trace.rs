//! Rays per second on one core, traced backward through real lenses: the plain tracer, then the packets at each SIMD level.
//!
//! `cargo bench --bench lens_trace [-- --json]`. The rays start all over the sensor and all pass the lens (those that do not are sorted
//! out first, as they would flatter the figure). Best and median of the repetitions.
#![allow(clippy::unwrap_used)] // a bench on built-in data fails by panicking

use std::hint::black_box;
use std::time::Instant;

use glam::DVec2;
use quadpixel::lens::{
    Lens, OpticalSystem, PacketTracer, Prescription, Ray, RayBatch, SimdLevel, trace_backward,
};

const RAYS: usize = 1 << 14;
const REPETITIONS: usize = 21;
const LENSES: [&str; 4] = [
    "wide_US20120327520A1_emb3",
    "wide_US11940605B2_emb1",
    "tele_US10571665B2_220b",
    "lib_double_gauss_100mm_glass",
];

fn main() {
    let json = std::env::args().any(|a| a == "--json");
    let mut rows = Vec::new();
    for name in LENSES {
        let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
        let system = lens.at(550.0).unwrap();
        let image_mm = 0.5 * lens.paraxial(550.0).unwrap().efl_mm;
        let rays = passing_rays(&system, image_mm);
        let plain = rates(|| {
            for ray in &rays {
                black_box(trace_backward(&system, *ray).ok());
            }
        });
        rows.push((name, system.surfaces.len(), "plain".to_owned(), plain, 1.0));
        let tracer = PacketTracer::new(&system);
        let mut start = RayBatch::with_capacity(RAYS);
        rays.iter()
            .for_each(|r| start.push(r.origin_mm, r.direction));
        let mut batch = start.clone();
        for level in SimdLevel::ALL {
            if level > SimdLevel::detect() {
                continue;
            }
            let rate = rates(|| {
                batch.clone_from(&start);
                tracer.trace_backward(black_box(&mut batch), level);
            });
            let label = format!("packets, {level:?}");
            rows.push((name, system.surfaces.len(), label, rate, rate.0 / plain.0));
        }
    }
    if json {
        let rows: Vec<_> = rows
            .iter()
            .map(|(lens, surfaces, level, (best, median), ratio)| {
                serde_json::json!({
                    "lens": lens, "surfaces": surfaces, "level": level, "rays_per_s_best": best,
                    "rays_per_s_median": median, "ratio_to_plain": ratio,
                })
            })
            .collect();
        println!("{}", serde_json::json!({ "lens_trace": rows }));
        return;
    }
    println!(
        "{:32} {:>8}  {:16} {:>12} {:>12} {:>8}",
        "lens", "surfaces", "tracer", "best Mray/s", "median", "ratio"
    );
    for (lens, surfaces, level, (best, median), ratio) in rows {
        println!(
            "{lens:32} {surfaces:>8}  {level:16} {:>12.3} {:>12.3} {ratio:>8.2}",
            best / 1e6,
            median / 1e6
        );
    }
}

/// Rays from all over the image circle that pass the lens, sifted by the packets: for a lost ray the plain tracer's search is long.
fn passing_rays(system: &OpticalSystem, image_mm: f64) -> Vec<Ray> {
    let tracer = PacketTracer::new(system);
    let mut passing = Vec::with_capacity(RAYS);
    let mut first = 0;
    while passing.len() < RAYS {
        let mut traced = RayBatch::with_capacity(RAYS);
        let candidates: Vec<Ray> = (first..first + RAYS)
            .map(|i| candidate(system, image_mm, i))
            .collect();
        candidates
            .iter()
            .for_each(|r| traced.push(r.origin_mm, r.direction));
        tracer.trace_backward(&mut traced, SimdLevel::detect());
        passing.extend((0..RAYS).filter_map(|i| traced.get(i).is_ok().then_some(candidates[i])));
        first += RAYS;
    }
    passing.truncate(RAYS);
    passing
}

/// The `i`th ray from the image circle to the last surface.
fn candidate(system: &OpticalSystem, image_mm: f64, i: usize) -> Ray {
    let last = &system.surfaces[system.surfaces.len() - 1];
    let at = |k: i32| (0.5 + i as f64 * 1.167_303_978_261_418_7_f64.powi(-k)).fract();
    let on_sensor = DVec2::new(at(1), at(2)) * 2.0 - 1.0;
    let on_last = DVec2::new(at(3), at(4)) * 2.0 - 1.0;
    let origin_mm = (on_sensor * image_mm).extend(system.sensor_z_mm);
    let target = (on_last * last.aperture.semi_mm).extend(last.pose.vertex_mm.z);
    let direction = (target - origin_mm).normalize();
    Ray {
        origin_mm,
        direction,
    }
}

/// Best and median rays per second of `work`, which traces [`RAYS`] rays.
fn rates(mut work: impl FnMut()) -> (f64, f64) {
    let mut times: Vec<f64> = (0..REPETITIONS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let rate = |seconds: f64| RAYS as f64 / seconds;
    (rate(times[0]), rate(times[REPETITIONS / 2]))
}
