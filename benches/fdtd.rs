//! The Yee stepper: cell updates per second (a cell is six components; a complex one has them twice), with absorbing
//! layers at both ends and a source, in a pixel's media: lens with smoothed faces, oxide, silicon with trenches. A
//! thread works on one simulation; the thread sweep steps one per thread, which share the memory's bandwidth.
//!
//! ```text
//! cargo bench --bench fdtd
//! ```
#![allow(clippy::unwrap_used)] // because a bench on built-in data fails by panicking

#[path = "support/bench.rs"]
mod bench;

use std::sync::Arc;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use quadpixel::em::fdtd::{
    CpmlSettings, Domain, Lateral, MaterialMap, Medium, Member, Pole, Simulation, Source, YeeGrid,
    stable_step_um,
};
use quadpixel::simd::SimdLevel;
use rayon::prelude::*;

/// Steps of one call, which the sweep works through front by front.
const STEPS: usize = 10;

criterion_group!(name = benches; config = bench::short(); targets = levels, sizes, threads);
criterion_main!(benches);

fn member(phase_rad: f64, current: [f64; 2]) -> Member {
    let bloch = |phase_rad| Lateral::Bloch { phase_rad };
    Member {
        x: bloch(phase_rad),
        y: bloch(0.0),
        current,
    }
}

/// One or both polarizations, at normal incidence (real fields) or oblique (complex).
fn batches() -> [(&'static str, Vec<Member>); 4] {
    let (s, p) = ([0.0, 1.0], [1.0, 0.0]);
    [
        ("1 real", vec![member(0.0, s)]),
        ("2 real", vec![member(0.0, s), member(0.0, p)]),
        ("1 complex", vec![member(1.0, s)]),
        ("2 complex", vec![member(1.0, s), member(1.0, p)]),
    ]
}

/// Cell updates of one call.
fn updates(sim: &Simulation) -> Throughput {
    Throughput::Elements((sim.grid().cells() * sim.members().len() * STEPS) as u64)
}

fn levels(c: &mut Criterion) {
    let mut group = c.benchmark_group("fdtd/level");
    for (name, members) in &batches() {
        let mut sim = simulation(62, members, false);
        group.throughput(updates(&sim));
        for level in SimdLevel::ALL {
            if level <= SimdLevel::detect() {
                let id = BenchmarkId::new(*name, format!("{level:?}"));
                group.bench_function(id, |b| b.iter(|| sim.advance_at(STEPS, level)));
            }
        }
    }
    let (name, members) = &batches()[0];
    let mut sim = simulation(62, members, false);
    group.throughput(updates(&sim));
    group.bench_function(BenchmarkId::new(*name, "plain stepper"), |b| {
        b.iter(|| sim.advance_plain(STEPS));
    });
}

fn sizes(c: &mut Criterion) {
    let mut group = c.benchmark_group("fdtd/size");
    let (name, members) = &batches()[3];
    for nx in [62, 140] {
        for (silicon, poles) in [("one index", false), ("2 poles", true)] {
            let mut sim = simulation(nx, members, poles);
            group.throughput(updates(&sim));
            let id = BenchmarkId::new(format!("{name}, {silicon}"), format!("{nx}x{nx}x400"));
            group.bench_function(id, |b| {
                b.iter(|| sim.advance_at(STEPS, SimdLevel::detect()));
            });
        }
    }
}

fn threads(c: &mut Criterion) {
    let mut group = c.benchmark_group("fdtd/threads");
    let (_, members) = &batches()[3];
    for threads in bench::thread_counts() {
        let mut sims: Vec<Simulation> = (0..threads)
            .map(|_| simulation(62, members, false))
            .collect();
        let Throughput::Elements(one) = updates(&sims[0]) else {
            unreachable!("cells are elements")
        };
        group.throughput(Throughput::Elements(one * threads as u64));
        let pool = bench::pool(threads);
        group.bench_function(BenchmarkId::from_parameter(threads), |b| {
            b.iter(|| {
                pool.install(|| {
                    sims.par_iter_mut()
                        .for_each(|sim| sim.advance_at(STEPS, SimdLevel::detect()));
                });
            });
        });
    }
}

/// 400 layers: 240 of 10 nm in silicon with trenches, 160 of 20 nm above, a dome in 60 of them.
fn simulation(nx: usize, members: &[Member], poles: bool) -> Simulation {
    const NZ: usize = 400;
    const SILICON: usize = 240;
    let mut z = vec![0.0];
    for k in 0..NZ {
        z.push(z[k] + if k < SILICON { 0.01 } else { 0.02 });
    }
    let grid = YeeGrid::new(nx, nx, 0.025, 0.025, z).unwrap();
    let pole = |resonance, strength| Pole {
        strength,
        resonance,
        damping: 0.5,
    };
    let silicon = if poles {
        Medium::new(5.0, 0.0, vec![pole(17.0, 1200.0), pole(22.0, 1800.0)])
    } else {
        Medium::new(16.6, 2.6, vec![])
    };
    // Numbers 3 to 18: the lens's faces, sixteen parts of resin in air.
    let mut media = vec![
        Medium::VACUUM,
        Medium::new(2.13, 0.0, vec![]).unwrap(),
        silicon.unwrap(),
    ];
    media.extend((1..=16).map(|n| Medium::new(1.0 + 1.43 * n as f64 / 16.0, 0.0, vec![]).unwrap()));
    let width = nx + 1;
    let centre = 0.5 * nx as f64;
    let map: Vec<u16> = (0..width * width * (NZ + 1))
        .map(|n| {
            let (i, j, k) = (n % width, n / width % width, n / width / width);
            let trench = |i: usize| i % (nx / 2) < 2 || i % (nx / 2) + 2 > nx / 2;
            match k {
                0..SILICON if trench(i) || trench(j) => 1,
                0..SILICON => 2,
                k if k < 300 => 1,
                _ => {
                    let r2 = (i as f64 - centre).powi(2) + (j as f64 - centre).powi(2);
                    let top = 300.0 + 60.0 * (1.0 - r2 / (2.0 * centre * centre));
                    match ((top - k as f64) * 4.0).clamp(0.0, 16.0) as u16 {
                        0 => 0,
                        part => 2 + part,
                    }
                }
            }
        })
        .collect();
    let map = MaterialMap::new(&grid, media, map.clone(), map.clone(), map).unwrap();
    let source = Source {
        plane: 375,
        waveform: Arc::new(|t| (11.4 * t).sin()),
    };
    let dt = stable_step_um(&grid, &map).unwrap();
    let cpml = CpmlSettings::new(20, 16, [4.08, 1.0]);
    Simulation::new(
        Domain {
            grid,
            map: Arc::new(map),
            cpml,
        },
        members,
        source,
        dt,
    )
    .unwrap()
}
