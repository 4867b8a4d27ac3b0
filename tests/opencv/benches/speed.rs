//! Ours against OpenCV in one run, one thread each: the Lanczos warp, dense matching, and the accuracy of the matchers.
//!
//! `cargo bench -p opencv_checks --features opencv`

use std::error::Error;
use std::time::Instant;

use opencv::core::{Mat, get_version_string, set_num_threads};
use opencv_checks::accuracy::{FARNEBACK_ITERATIONS, WINDOW_PX, farneback, planar, scaled, stereo};
use opencv_checks::convert::{remap, to_map_mats, to_mat};
use opencv_checks::{CHANGES, Change, pair, uniform};
use quadpixel::image::Image;
use quadpixel::simd::SimdLevel;
use quadpixel_algorithms::disparity::{MatchSettings, match_images};
use quadpixel_algorithms::warp::{Border, Lobes, Map, warp};

const RUNS: usize = 9;

fn main() -> Outcome {
    set_num_threads(1)?;
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    println!(
        "OpenCV {}, {:?}, one thread each, CPU time, best of {RUNS} runs by turns and median of their ratios",
        get_version_string()?,
        SimdLevel::detect()
    );
    one.install(warps)?;
    one.install(matching)?;
    accuracy()?;
    Ok(())
}

/// Best times of both in seconds on the CPU, and the median of the ratio theirs to ours; run by turns so that both see
/// the same machine.
fn by_turns(mut ours: impl FnMut(), mut theirs: impl FnMut()) -> ([f64; 2], f64) {
    let time = |work: &mut dyn FnMut()| {
        let (began, cpu) = (Instant::now(), cpu_seconds());
        work();
        match (cpu, cpu_seconds()) {
            (Some(before), Some(after)) => after - before,
            _ => began.elapsed().as_secs_f64(),
        }
    };
    let times: Vec<[f64; 2]> = (0..RUNS)
        .map(|_| [time(&mut ours), time(&mut theirs)])
        .collect();
    let best = [0, 1].map(|i| times.iter().fold(f64::INFINITY, |best, t| best.min(t[i])));
    let mut ratios: Vec<f64> = times.iter().map(|[a, b]| b / a).collect();
    ratios.sort_by(f64::total_cmp);
    (best, ratios[RUNS / 2])
}

/// Time that this thread, which does all the work, was on a CPU, where Linux tells it: others that want the CPU do not
/// count.
fn cpu_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(1e-9 * nanoseconds)
}

type Outcome = Result<(), Box<dyn Error + Send + Sync>>;

fn warps() -> Outcome {
    let side = 1024;
    let map = Map::from_fn(side, side, |x, y| {
        let (x, y) = (x as f64, y as f64);
        (x + 1.7 * (y / 97.0).sin(), y + 1.3 * (x / 83.0).cos())
    })?;
    println!("\n| Lanczos warp, a = 4, f32, 1024 × 1024 | ours Mpx/s | OpenCV Mpx/s | ratio |");
    println!("|---|---|---|---|");
    for channels in [1, 3] {
        let data = uniform(1, side * side * channels);
        let data = data.iter().map(|v| *v as f32).collect();
        let image = Image::from_vec(side, side, channels, data).ok_or("sizes differ")?;
        let (mat, maps) = (to_mat(&image)?, to_map_mats(&map)?);
        let mut to = Mat::default();
        let mut failed = None;
        let ([ours, theirs], ratio) = by_turns(
            || {
                let level = SimdLevel::detect();
                let done = warp(&image, &map, Lobes::Four, Border::Reflect101, level);
                std::hint::black_box(done);
            },
            || failed = remap(&mat, &maps, Border::Reflect101, &mut to).err(),
        );
        if let Some(error) = failed {
            return Err(error.into());
        }
        let speed = |seconds: f64| (side * side) as f64 / seconds / 1e6;
        println!(
            "| {channels} channels | {:.1} | {:.1} | {:.2} |",
            speed(ours),
            speed(theirs),
            ratio
        );
    }
    Ok(())
}

fn matching() -> Outcome {
    let side = 1001;
    let [a, b] = pair(side, 7, [1.37, 0.61], Change::noise(0.01));
    let settings = MatchSettings {
        window_px: WINDOW_PX,
        ..MatchSettings::default()
    };
    let [mat_a, mat_b] = [scaled(&a)?, scaled(&b)?];
    let megapixels = (side * side) as f64 / 1e6;
    println!(
        "\n| matching, 1001 × 1001, window 21, 1 % noise | ours s/Mpx | Farneback s/Mpx | ratio |"
    );
    println!("|---|---|---|---|");
    for iterations in FARNEBACK_ITERATIONS {
        let mut failed = None;
        let mut refused = None;
        let ([ours, theirs], ratio) = by_turns(
            || match match_images(&a, &b, &settings) {
                Ok(map) => drop(std::hint::black_box(map)),
                Err(error) => refused = Some(error),
            },
            || failed = farneback(&mat_a, &mat_b, iterations).err(),
        );
        if let Some(error) = failed {
            return Err(error.into());
        }
        if let Some(error) = refused {
            return Err(error.into());
        }
        println!(
            "| ours ±4 px, stride 4; Farneback 3 levels, {iterations} iterations | {:.3} | {:.3} | {:.2} |",
            ours / megapixels,
            theirs / megapixels,
            ratio
        );
    }
    Ok(())
}

fn accuracy() -> opencv::Result<()> {
    println!("\n| RMS px an axis | noise 0 | noise 1 % | noise 1 %, gain 0.8, offset 0.05 |");
    println!("|---|---|---|---|");
    let [p, q, r] = CHANGES;
    let planar = [planar(p)?, planar(q)?, planar(r)?];
    let stereo = [stereo(p)?, stereo(q)?, stereo(r)?];
    for (name, rms) in [
        ("ours, both axes", planar.map(|p| p.ours)),
        (
            "Farneback, window 21, 3 iterations",
            planar.map(|p| p.farneback[0]),
        ),
        (
            "Farneback, window 21, 10 iterations",
            planar.map(|p| p.farneback[1]),
        ),
        ("PyrLK, window 21, 8 bits", planar.map(|p| p.pyr_lk)),
        (
            "phaseCorrelate, 32 × 32, Hann",
            planar.map(|p| p.phase_correlate),
        ),
        (
            "ours along the rows, where StereoBM is valid",
            stereo.map(|s| s.ours_at_bm),
        ),
        ("StereoBM, block 21, 8 bits", stereo.map(|s| s.bm)),
        (
            "ours along the rows, where StereoSGBM is valid",
            stereo.map(|s| s.ours_at_sgbm),
        ),
        ("StereoSGBM, block 11, 8 bits", stereo.map(|s| s.sgbm)),
    ] {
        println!("| {name} | {:.4} | {:.4} | {:.4} |", rms[0], rms[1], rms[2]);
    }
    for (name, share) in [
        ("ours, both axes", planar.map(|p| p.valid)),
        ("ours along the rows", stereo.map(|s| s.valid)),
        ("StereoBM, of these", stereo.map(|s| s.bm_valid)),
        ("StereoSGBM, of these", stereo.map(|s| s.sgbm_valid)),
    ] {
        println!(
            "| valid: {name} | {:.1} % | {:.1} % | {:.1} % |",
            100.0 * share[0],
            100.0 * share[1],
            100.0 * share[2]
        );
    }
    Ok(())
}
