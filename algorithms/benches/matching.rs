//! Dense matching: pixels per second at stride 4 and window 21. Its accuracy against the Cramér-Rao bound:
//! `matching_accuracy`.
//!
//! `cargo bench -p quadpixel-algorithms --bench matching`
#![allow(clippy::unwrap_used)] // because a bench on made-up data fails by panicking

#[path = "../../benches/support/bench.rs"]
mod bench;
#[path = "../tests/matching/score.rs"]
#[allow(dead_code)] // because the accuracy is judged elsewhere
mod score;
#[path = "../tests/matching/texture.rs"]
#[allow(dead_code)]
mod texture;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use quadpixel_algorithms::disparity::{MatchSettings, match_images};
use score::{Case, pair};

criterion_group!(name = benches; config = bench::short(); targets = searches, sizes, threads);
criterion_main!(benches);

/// A textured pair, B weaker than A and with noise; `size` is odd, as textures must be.
fn case(size: usize, search_px: usize, shift: [f64; 2]) -> Case {
    Case {
        size,
        seed: 7,
        shift,
        noise: 0.01,
        gain: 0.8,
        offset: 0.05,
        settings: MatchSettings {
            search_px,
            ..MatchSettings::default()
        },
    }
}

fn near(size: usize) -> Case {
    case(size, 4, [1.37, 0.61])
}

fn pixels(case: &Case) -> Throughput {
    Throughput::Elements((case.size * case.size) as u64)
}

fn searches(c: &mut Criterion) {
    let pool = bench::pool(1);
    let mut group = c.benchmark_group("matching/search");
    for (name, case) in [
        ("±4 px", near(1001)),
        ("±32 px, coarse to fine", case(1001, 32, [-21.3, 14.6])),
    ] {
        let [a, b] = pair(&case);
        group.throughput(pixels(&case));
        group.bench_function(name, |bencher| {
            bencher.iter(|| pool.install(|| match_images(&a, &b, &case.settings).unwrap()));
        });
    }
}

fn sizes(c: &mut Criterion) {
    let pool = bench::pool(1);
    let mut group = c.benchmark_group("matching/size");
    for size in [251, 501, 1001] {
        let case = near(size);
        let [a, b] = pair(&case);
        group.throughput(pixels(&case));
        group.bench_function(format!("{size}x{size}"), |bencher| {
            bencher.iter(|| pool.install(|| match_images(&a, &b, &case.settings).unwrap()));
        });
    }
}

fn threads(c: &mut Criterion) {
    let case = near(1001);
    let [a, b] = pair(&case);
    let mut group = c.benchmark_group("matching/threads");
    group.throughput(pixels(&case));
    for threads in bench::thread_counts() {
        let pool = bench::pool(threads);
        group.bench_function(BenchmarkId::from_parameter(threads), |bencher| {
            bencher.iter(|| pool.install(|| match_images(&a, &b, &case.settings).unwrap()));
        });
    }
}
