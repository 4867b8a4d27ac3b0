//! The response: lookups per second on one core (the renderer's inner loop), and directions per second of the wave
//! level.
//!
//! `cargo bench --bench response`
#![allow(clippy::unwrap_used)] // because a bench on built-in data fails by panicking

#[path = "support/bench.rs"]
mod bench;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use quadpixel::em::PixelStack;
use quadpixel::em::wave::{WaveModel, WaveSettings};
use quadpixel::em::{Level, Preset};
use quadpixel::response::{GeometricResponse, Response, TableSettings, build_table};
use quadpixel::sensor::Subpixels;

/// Rays of a batch, as the renderer has them.
const BATCH: usize = 64;
const DIRECTIONS: [[f64; 2]; 3] = [[0.05, 0.0], [0.2, 0.1], [0.4, 0.3]];

criterion_group!(name = benches; config = bench::short(); targets = lookups, directions, tables);
criterion_main!(benches);

fn draft_table(stack: &PixelStack) -> Response {
    let built = build_table(
        stack,
        &TableSettings::new(Level::Wave, Preset::Draft, stack),
        None,
        &|_, _| {},
    );
    Response::Table(built.unwrap().table)
}

fn lookups(c: &mut Criterion) {
    // Directions of an F/1.8 cone in scrambled order.
    const RAYS: usize = 1 << 16;
    let (u, v): (Vec<f32>, Vec<f32>) = (0..RAYS)
        .map(|i: usize| {
            let part = |k: usize| (i.wrapping_mul(k) % 65_536) as f32 / 65_536.0 - 0.5;
            (part(40_503) * 0.54, part(25_173) * 0.54)
        })
        .unzip();
    let mut weights = vec![0.0; BATCH * 4];
    let mut group = c.benchmark_group("response/lookup");
    group.throughput(Throughput::Elements(RAYS as u64));
    let stack = PixelStack::builtin("1.6um").unwrap();
    let geometric = GeometricResponse::matched_to_f_number(Subpixels::QUAD, 1.6, 1.8).unwrap();
    for (name, response) in [
        ("table", draft_table(&stack)),
        ("geometric", Response::Geometric(geometric)),
    ] {
        let lookup = response.at(550.0);
        let frame = lookup.frame();
        group.bench_function(BenchmarkId::new(name, "centred lens"), |b| {
            b.iter(|| {
                for (u, v) in u.chunks(BATCH).zip(v.chunks(BATCH)) {
                    lookup.weights_batch(u, v, &mut weights);
                    black_box(&weights);
                }
            });
        });
        group.bench_function(BenchmarkId::new(name, "shifted lens"), |b| {
            b.iter(|| {
                for (u, v) in u.chunks(BATCH).zip(v.chunks(BATCH)) {
                    let (mut u_moved, mut v_moved) = ([0.0; BATCH], [0.0; BATCH]);
                    u_moved.copy_from_slice(u);
                    v_moved.copy_from_slice(v);
                    frame.centred_batch([0.3, -0.1], &mut u_moved, &mut v_moved);
                    lookup.weights_batch(&u_moved, &v_moved, &mut weights);
                    black_box(&weights);
                }
            });
        });
    }
}

/// Presets, over pixels of all sizes.
fn directions(c: &mut Criterion) {
    let mut group = c.benchmark_group("response/wave");
    group.throughput(Throughput::Elements(DIRECTIONS.len() as u64));
    for (preset, settings) in [
        ("draft", WaveSettings::draft()),
        ("standard", WaveSettings::standard()),
    ] {
        for name in PixelStack::builtin_names() {
            let stack = PixelStack::builtin(name).unwrap();
            if stack.metal.is_some() {
                continue; // The wave model refuses it.
            }
            let model = WaveModel::new(&stack, 550.0, &settings).unwrap();
            group.bench_function(BenchmarkId::new(preset, name), |b| {
                b.iter(|| {
                    for [u, v] in DIRECTIONS {
                        black_box(model.solve(u, v).unwrap());
                    }
                });
            });
        }
    }
}

/// A whole draft table by threads.
fn tables(c: &mut Criterion) {
    let stack = PixelStack::builtin("1.6um").unwrap();
    let mut group = c.benchmark_group("response/table-threads");
    for threads in bench::thread_counts() {
        let pool = bench::pool(threads);
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| pool.install(|| draft_table(&stack)));
        });
    }
}
