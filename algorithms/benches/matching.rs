//! Speed of dense matching on one thread, and its accuracy against the Cramér-Rao bound.
//!
//! `cargo bench -p algorithms --bench matching`, with `-- speed` or `-- accuracy` for one of them

#[path = "../tests/matching/score.rs"]
mod score;
#[path = "../tests/matching/texture.rs"]
mod texture;

use std::time::Instant;

use quadpixel_algorithms::disparity::{MatchSettings, match_images};
use quadpixel_generators::accuracy::clock::thread_seconds;
use score::{Case, judge, pair, score};

const SHIFTS: [[f64; 2]; 5] = [
    [0.25, -0.4],
    [1.37, 0.61],
    [-2.4, 2.4],
    [0.5, 0.5],
    [-0.83, -1.91],
];

fn main() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    match one {
        Ok(pool) => pool.install(run),
        Err(error) => println!("no pool of one thread: {error}"),
    }
}

fn run() {
    let wanted = |name: &str| {
        let mut names = std::env::args().skip(1).filter(|a| !a.starts_with('-'));
        names.next().is_none_or(|first| first == name)
    };
    if wanted("speed") {
        speed();
    }
    if wanted("accuracy") {
        accuracy();
    }
}

fn speed() {
    println!("dense matching, 1001 × 1001, stride 4, window 21, one thread; best of 5");
    for (name, search_px, shift) in [
        ("±4 px", 4, [1.37, 0.61]),
        ("±32 px, coarse to fine", 32, [-21.3, 14.6]),
    ] {
        let case = Case {
            size: 1001,
            seed: 7,
            shift,
            noise: 0.01,
            gain: 0.8,
            offset: 0.05,
            settings: MatchSettings {
                search_px,
                ..MatchSettings::default()
            },
        };
        let megapixels = (case.size * case.size) as f64 / 1e6;
        let [a, b] = pair(&case);
        let (mut best, mut best_cpu) = (f64::INFINITY, f64::INFINITY);
        let mut valid = 0.0;
        for _ in 0..5 {
            let (began, cpu) = (Instant::now(), thread_seconds());
            match match_images(&a, &b, &case.settings) {
                Ok(map) => {
                    best = best.min(began.elapsed().as_secs_f64());
                    best_cpu = best_cpu.min(thread_seconds() - cpu);
                    valid = judge(&case, &map).valid;
                }
                Err(error) => println!("  {name}: {error}"),
            }
        }
        println!(
            "  {name}: {:.3} s/Mpx, of which on the CPU {:.3}; {:.1} % valid",
            best / megapixels,
            best_cpu / megapixels,
            100.0 * valid
        );
    }
}

fn accuracy() {
    println!(
        "\n| window | noise | gain, offset | bound px | RMS px | claimed px | efficiency | valid |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for window_px in [15, 21, 31] {
        for (gain, offset) in [(1.0, 0.0), (0.8, 0.05)] {
            for noise in [0.0, 0.005, 0.01, 0.02] {
                let [mut rms, mut bound, mut claimed, mut valid] = [0.0; 4];
                for (i, shift) in SHIFTS.into_iter().enumerate() {
                    let result = score(&Case {
                        size: 301,
                        seed: 100 + i as u64,
                        shift,
                        noise,
                        gain,
                        offset,
                        settings: MatchSettings {
                            window_px,
                            ..MatchSettings::default()
                        },
                    });
                    rms += result.rms_px * result.rms_px / SHIFTS.len() as f64;
                    bound += result.bound_px * result.bound_px / SHIFTS.len() as f64;
                    claimed += result.claimed_px * result.claimed_px / SHIFTS.len() as f64;
                    valid += result.valid / SHIFTS.len() as f64;
                }
                println!(
                    "| {window_px} | {:.1} % | {gain}, {offset} | {:.5} | {:.5} | {:.5} | {:.3} | {:.1} % |",
                    100.0 * noise,
                    bound.sqrt(),
                    rms.sqrt(),
                    claimed.sqrt(),
                    (bound / rms).sqrt(),
                    100.0 * valid
                );
            }
        }
    }
}
