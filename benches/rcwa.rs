//! The Fourier modal level: directions per second, both polarizations. What the presets are worth: `rcwa_accuracy`.
//!
//! ```text
//! cargo bench --bench rcwa
//! ```
#![allow(clippy::unwrap_used)] // because a bench on built-in data fails by panicking

#[path = "support/bench.rs"]
mod bench;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use quadpixel::em::PixelStack;
use quadpixel::em::rcwa::{RcwaModel, RcwaSettings};
use rayon::prelude::*;

/// Oblique, off the mirror planes: no symmetry helps.
const DIRECTION: [f64; 2] = [0.25, 0.1];

criterion_group!(name = benches; config = bench::short(); targets = presets, sizes, threads);
criterion_main!(benches);

fn model(pixel: &str, settings: &RcwaSettings) -> RcwaModel {
    RcwaModel::new(&PixelStack::builtin(pixel).unwrap(), 550.0, settings).unwrap()
}

fn presets(c: &mut Criterion) {
    let mut group = c.benchmark_group("rcwa/preset");
    group.throughput(Throughput::Elements(1));
    for (name, settings) in [
        ("draft", RcwaSettings::draft()),
        ("standard", RcwaSettings::standard()),
    ] {
        let model = model("1.6um", &settings);
        for (kind, [u, v]) in [("oblique", DIRECTION), ("in a mirror plane", [0.25, 0.0])] {
            group.bench_function(BenchmarkId::new(name, kind), |b| {
                b.iter(|| model.solve(u, v).unwrap());
            });
        }
    }
}

fn sizes(c: &mut Criterion) {
    let mut group = c.benchmark_group("rcwa/pixel");
    group.throughput(Throughput::Elements(1));
    let [u, v] = DIRECTION;
    for pixel in ["1.6um", "2.8um"] {
        let model = model(pixel, &RcwaSettings::draft());
        group.bench_function(pixel, |b| b.iter(|| model.solve(u, v).unwrap()));
    }
}

fn threads(c: &mut Criterion) {
    let mut group = c.benchmark_group("rcwa/threads");
    let model = model("1.6um", &RcwaSettings::draft());
    // As a table is made: each direction on a thread.
    let directions: Vec<f64> = (0..8).map(|i| 0.05 * f64::from(i) + 0.01).collect();
    group.throughput(Throughput::Elements(directions.len() as u64));
    for threads in bench::thread_counts() {
        let pool = bench::pool(threads);
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| {
                let solve = |u: &f64| model.solve(*u, 0.1).unwrap().functions.unwrap();
                pool.install(|| directions.par_iter().map(solve).sum::<usize>())
            });
        });
    }
}
