//! Rays per second, traced backward through real lenses: the plain tracer, then the packets at each SIMD level; sizes
//! of a batch; threads.
//!
//! `cargo bench --bench lens_trace`. The rays start all over the sensor and all pass the lens (those that do not are
//! sorted out first, as they would flatter the figure).
#![allow(clippy::unwrap_used)] // because a bench on built-in data fails by panicking

#[path = "support/bench.rs"]
mod bench;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec2;
use quadpixel::lens::{Lens, OpticalSystem, PacketTracer, Prescription, trace_backward};
use quadpixel::rays::{Ray, RayBatch};
use quadpixel::simd::SimdLevel;
use rayon::prelude::*;

const RAYS: usize = 1 << 14;
const LENSES: [&str; 4] = [
    "wide_US20120327520A1_emb3",
    "wide_US11940605B2_emb1",
    "tele_US10571665B2_220b",
    "lib_double_gauss_100mm_glass",
];

criterion_group!(name = benches; config = bench::short(); targets = levels, sizes, threads);
criterion_main!(benches);

/// A lens's surfaces, and rays that pass it.
fn fixture(name: &str) -> (OpticalSystem, Vec<Ray>) {
    let lens = Lens::new(&Prescription::builtin(name).unwrap()).unwrap();
    let system = lens.at(550.0).unwrap();
    let image_mm = 0.5 * lens.paraxial(550.0).unwrap().efl_mm;
    let rays = passing_rays(&system, image_mm);
    (system, rays)
}

fn batch(rays: &[Ray]) -> RayBatch {
    let mut batch = RayBatch::with_capacity(rays.len());
    rays.iter()
        .for_each(|ray| batch.push(ray.origin_mm, ray.direction));
    batch
}

fn levels(c: &mut Criterion) {
    for name in LENSES {
        let mut group = c.benchmark_group(format!("lens_trace/{name}"));
        group.throughput(Throughput::Elements(RAYS as u64));
        let (system, rays) = fixture(name);
        group.bench_function("plain", |b| {
            b.iter(|| {
                for ray in &rays {
                    black_box(trace_backward(&system, *ray).ok());
                }
            });
        });
        let tracer = PacketTracer::new(&system);
        let start = batch(&rays);
        let mut traced = start.clone();
        for level in SimdLevel::ALL {
            if level <= SimdLevel::detect() {
                group.bench_function(BenchmarkId::new("packets", format!("{level:?}")), |b| {
                    b.iter(|| {
                        traced.clone_from(&start);
                        tracer.trace_backward(black_box(&mut traced), level);
                    });
                });
            }
        }
    }
}

fn sizes(c: &mut Criterion) {
    let mut group = c.benchmark_group("lens_trace/batch");
    let (system, rays) = fixture(LENSES[0]);
    let tracer = PacketTracer::new(&system);
    for count in [64, 1024, RAYS] {
        group.throughput(Throughput::Elements(count as u64));
        let start = batch(&rays[..count]);
        let mut traced = start.clone();
        group.bench_function(BenchmarkId::from_parameter(count), |b| {
            b.iter(|| {
                traced.clone_from(&start);
                tracer.trace_backward(black_box(&mut traced), SimdLevel::detect());
            });
        });
    }
}

fn threads(c: &mut Criterion) {
    let mut group = c.benchmark_group("lens_trace/threads");
    group.throughput(Throughput::Elements(RAYS as u64));
    let (system, rays) = fixture(LENSES[0]);
    let tracer = PacketTracer::new(&system);
    let start: Vec<RayBatch> = rays.chunks(256).map(batch).collect();
    let mut traced = start.clone();
    for threads in bench::thread_counts() {
        let pool = bench::pool(threads);
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| {
                pool.install(|| {
                    traced.par_iter_mut().zip(&start).for_each(|(rays, start)| {
                        rays.clone_from(start);
                        tracer.trace_backward(rays, SimdLevel::detect());
                    });
                });
            });
        });
    }
}

/// Rays from all over the image circle that pass the lens, sifted by the packets: for a lost ray the plain tracer's
/// search is long.
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
