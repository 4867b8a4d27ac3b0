//! The Yee stepper: cell updates a second on one core (a cell is six components; a complex one has them twice), with absorbing layers at both ends
//! and a source, in a pixel's media: lens with smoothed faces, oxide, silicon with trenches.
//!
//! ```text
//! cargo bench --bench fdtd [-- seconds]     about so long for each line, 0.3 unless told
//! ```
//!
//! Best of the repetitions, by the time that the thread ran, where the system tells it (so that other work counts less); with the memory
//! bandwidth (triad) of the same run beside it.
#![allow(clippy::unwrap_used)] // because a bench on built-in data fails by panicking

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use quadpixel::em::fdtd::{
    CpmlSettings, Lateral, MaterialMap, Medium, Member, Pole, Simulation, Source, YeeGrid,
    stable_step_um,
};
use quadpixel::simd::SimdLevel;

fn main() {
    let seconds = std::env::args()
        .find_map(|a| a.parse::<f64>().ok())
        .unwrap_or(0.3);
    println!("memory, triad of 3 x 128 MB: {:.1} GB/s", triad());
    println!("cells | members | silicon | instructions | M cells/s");
    let bloch = |phase_rad| Lateral::Bloch { phase_rad };
    let member = |phase, current| Member {
        x: bloch(phase),
        y: bloch(0.0),
        current,
    };
    let (s, p) = ([0.0, 1.0], [1.0, 0.0]);
    let batches = [
        ("1 real", vec![member(0.0, s)]),
        ("2 real", vec![member(0.0, s), member(0.0, p)]),
        ("1 complex", vec![member(1.0, s)]),
        ("2 complex", vec![member(1.0, s), member(1.0, p)]),
    ];
    for (nx, levels) in [(62, &SimdLevel::ALL[..]), (140, &SimdLevel::ALL[2..])] {
        for (name, members) in &batches {
            for level in levels.iter().filter(|l| **l <= SimdLevel::detect()) {
                report(nx, name, members, false, seconds, *level);
            }
        }
        report(
            nx,
            "2 complex",
            &batches[3].1,
            true,
            seconds,
            SimdLevel::detect(),
        );
    }
    let mut sim = simulation(62, &batches[0].1, false);
    let rate = best_rate(&mut sim, 0.1 * seconds, |sim| sim.advance_plain(1));
    println!("62 x 62 x 400 | 1 real | one index | plain stepper | {rate:.1}");
}

fn report(nx: usize, name: &str, members: &[Member], poles: bool, seconds: f64, level: SimdLevel) {
    let mut sim = simulation(nx, members, poles);
    let rate = 10.0 * best_rate(&mut sim, seconds, |sim| sim.advance_at(10, level));
    let silicon = if poles { "2 poles" } else { "one index" };
    println!("{nx} x {nx} x 400 | {name} | {silicon} | {level:?} | {rate:.0}");
}

/// Millions of cells (of all members) a second if `work` is one step.
fn best_rate(sim: &mut Simulation, seconds: f64, work: impl Fn(&mut Simulation)) -> f64 {
    let cells = (sim.grid().cells() * sim.members().len()) as f64;
    work(sim);
    let (began, mut best) = (Instant::now(), f64::INFINITY);
    let mut runs = 0;
    while runs < 5 || began.elapsed().as_secs_f64() < seconds {
        let start = thread_seconds(began);
        work(sim);
        best = best.min(thread_seconds(began) - start);
        runs += 1;
    }
    cells / best * 1e-6
}

/// Seconds that this thread ran; where the system does not tell, wall time.
fn thread_seconds(began: Instant) -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .ok()
        .and_then(|text| text.split(' ').next()?.parse::<f64>().ok())
        .map_or_else(|| began.elapsed().as_secs_f64(), |ns| ns * 1e-9)
}

/// GB/s of a = b + 2c, as usually counted: two reads and a write.
fn triad() -> f64 {
    const N: usize = 1 << 25;
    let (b, c) = (vec![1.0f32; N], vec![2.0f32; N]);
    let mut a = vec![0.0f32; N];
    let began = Instant::now();
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = thread_seconds(began);
        for ((a, b), c) in a.iter_mut().zip(&b).zip(&c) {
            *a = b + 2.0 * c;
        }
        black_box(&mut a);
        best = best.min(thread_seconds(began) - start);
    }
    12.0 * N as f64 / best * 1e-9
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
    Simulation::new(grid, Arc::new(map), members, source, cpml, dt).unwrap()
}
