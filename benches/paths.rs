//! Path tracing on a room of 250,000 triangles: paths per second, and the noise that so many paths leave.
//!
//! ```text
//! cargo bench --bench paths
//! ```
//!
//! The scene is drawn up in `support/room.rs`; `tests/peers/mitsuba_speed.py` times Mitsuba 3 on it (one thread, 4
//! paths per pixel). Paths end after 5 segments (Mitsuba's `max_depth = 5`), without Russian roulette.
#![allow(clippy::unwrap_used)] // because a bench on built-in data fails by panicking

#[path = "support/bench.rs"]
mod bench;
#[path = "support/room.rs"]
mod room;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use quadpixel::sampling::uniform;
use quadpixel::scene::world::{CameraRay, PathKey, PathSettings, World};
use rayon::prelude::*;

/// Pixels on a side of Mitsuba's picture.
const SIDE_PX: usize = 256;
/// Tangent of half the horizontal angle of view.
const HALF_WIDTH: f64 = 0.5;
/// Five segments from the camera: the last scattering is the fourth.
const SETTINGS: PathSettings = PathSettings {
    max_bounces: 4,
    roulette_after: u32::MAX,
    clamp: None,
};

criterion_group!(name = benches; config = bench::short(); targets = samples, sizes, threads);
criterion_main!(benches);

/// A pinhole picture of `side` × `side` pixels.
#[derive(Clone, Copy)]
struct Shot {
    side: usize,
    /// Paths per pixel.
    samples: u32,
    seed: u64,
}

impl Shot {
    fn new(side: usize, samples: u32) -> Self {
        Self {
            side,
            samples,
            seed: 0,
        }
    }

    fn paths(&self) -> Throughput {
        Throughput::Elements((self.side * self.side) as u64 * u64::from(self.samples))
    }

    /// RGB, at the origin towards −z, on the threads of the pool that it is called in.
    fn take(&self, world: &World) -> Vec<f32> {
        let mut image = vec![0.0; self.side * self.side * 3];
        let rows = image.par_chunks_exact_mut(self.side * 3).enumerate();
        rows.for_each(|(row, out)| {
            let rays: Vec<CameraRay> = (0..self.side)
                .flat_map(|column| (0..self.samples).map(move |sample| (column, sample)))
                .map(|(column, sample)| self.ray(column, row, sample))
                .collect();
            world.radiances(&rays, &SETTINGS, |number, radiance| {
                let pixel = &mut out[number / self.samples as usize * 3..][..3];
                pixel
                    .iter_mut()
                    .zip(radiance)
                    .for_each(|(sum, l)| *sum += l / self.samples as f32);
            });
        });
        image
    }

    fn ray(&self, column: usize, row: usize, sample: u32) -> CameraRay {
        let key = self.seed << 32 | (row * self.side + column) as u64;
        let place = |pixel: usize, dimension| {
            let jitter = uniform(key, &[u64::from(sample), dimension]);
            ((pixel as f64 + jitter) / self.side as f64 * 2.0 - 1.0) * HALF_WIDTH
        };
        CameraRay {
            origin_mm: DVec3::ZERO,
            direction: DVec3::new(place(column, 0), -place(row, 1), -1.0).normalize(),
            key: PathKey {
                key,
                number: sample,
                spread: 1e-3,
            },
        }
    }
}

/// RMS error over the mean: of two independent pictures, half their squared difference.
fn noise(world: &World, shot: Shot) -> f64 {
    let (a, b) = (shot.take(world), Shot { seed: 1, ..shot }.take(world));
    let squares = a.iter().zip(&b).map(|(a, b)| f64::from((a - b).powi(2)));
    let rms = (squares.sum::<f64>() / a.len() as f64 / 2.0).sqrt();
    rms / (a.iter().map(|x| f64::from(*x)).sum::<f64>() / a.len() as f64)
}

/// One thread, as Mitsuba's speed is taken.
fn samples(c: &mut Criterion) {
    let world = World::new(room::room()).unwrap();
    let pool = bench::pool(1);
    let mut group = c.benchmark_group("paths/samples");
    for samples in [1, 4, 16] {
        let shot = Shot::new(SIDE_PX / 2, samples);
        let noise = noise(&world, shot);
        eprintln!("{samples} paths per pixel: RMS error {noise:.4} of the mean");
        group.throughput(shot.paths());
        group.bench_function(BenchmarkId::from_parameter(samples), |b| {
            b.iter(|| pool.install(|| shot.take(&world)));
        });
    }
}

fn sizes(c: &mut Criterion) {
    let world = World::new(room::room()).unwrap();
    let pool = bench::pool(1);
    let mut group = c.benchmark_group("paths/size");
    for side in [64, 128, SIDE_PX] {
        let shot = Shot::new(side, 4);
        group.throughput(shot.paths());
        group.bench_function(format!("{side}x{side}"), |b| {
            b.iter(|| pool.install(|| shot.take(&world)));
        });
    }
}

fn threads(c: &mut Criterion) {
    let world = World::new(room::room()).unwrap();
    let shot = Shot::new(SIDE_PX / 2, 4);
    let mut group = c.benchmark_group("paths/threads");
    group.throughput(shot.paths());
    for threads in bench::thread_counts() {
        let pool = bench::pool(threads);
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| pool.install(|| shot.take(&world)));
        });
    }
}
