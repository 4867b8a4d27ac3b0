//! The exact Lanczos warp: pixels per second on a smooth map that no shift can stand for.
//!
//! The work of one thread is that of the OpenCV figures in `tests/opencv`: 1024 × 1024, f32, one and three channels, 8
//! × 8 taps.
//!
//! `cargo bench -p quadpixel-algorithms --bench warp`
#![allow(clippy::unwrap_used)] // because a bench on made-up data fails by panicking

#[path = "../../benches/support/bench.rs"]
mod bench;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use quadpixel::image::Image;
use quadpixel::simd::SimdLevel;
use quadpixel_algorithms::warp::{Border, Lobes, Map, Warped, warp};

const SIZE: usize = 1024;

criterion_group!(name = benches; config = bench::short(); targets = levels, sizes, threads);
criterion_main!(benches);

struct Work {
    image: Image,
    map: Map,
}

impl Work {
    fn new(size: usize, channels: usize) -> Self {
        let map = Map::from_fn(size, size, |x, y| {
            let (x, y) = (x as f64, y as f64);
            (x + 1.7 * (y / 97.0).sin(), y + 1.3 * (x / 83.0).cos())
        });
        let mut image = Image::zeros(size, size, channels);
        for (i, value) in image.data_mut().iter_mut().enumerate() {
            *value = ((i as u32).wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        }
        let map = map.unwrap();
        Self { image, map }
    }

    fn warp(&self, lobes: Lobes, level: SimdLevel) -> Warped {
        warp(&self.image, &self.map, lobes, Border::Reflect101, level)
    }
}

fn pixels(size: usize) -> Throughput {
    Throughput::Elements((size * size) as u64)
}

fn levels(c: &mut Criterion) {
    let pool = bench::pool(1);
    let mut group = c.benchmark_group("warp/level");
    group.throughput(pixels(SIZE));
    for channels in [1, 3] {
        let work = Work::new(SIZE, channels);
        for lobes in Lobes::ALL {
            for level in SimdLevel::ALL {
                let name = format!("{channels} channels, {} lobes", lobes.count());
                group.bench_function(BenchmarkId::new(name, format!("{level:?}")), |b| {
                    b.iter(|| pool.install(|| work.warp(lobes, level)));
                });
            }
        }
    }
}

fn sizes(c: &mut Criterion) {
    let pool = bench::pool(1);
    let mut group = c.benchmark_group("warp/size");
    for size in [256, 512, SIZE, 2 * SIZE] {
        let work = Work::new(size, 1);
        group.throughput(pixels(size));
        group.bench_function(format!("{size}x{size}"), |b| {
            b.iter(|| pool.install(|| work.warp(Lobes::Four, SimdLevel::detect())));
        });
    }
}

fn threads(c: &mut Criterion) {
    let work = Work::new(SIZE, 1);
    let mut group = c.benchmark_group("warp/threads");
    group.throughput(pixels(SIZE));
    for threads in bench::thread_counts() {
        let pool = bench::pool(threads);
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| pool.install(|| work.warp(Lobes::Four, SimdLevel::detect())));
        });
    }
}
