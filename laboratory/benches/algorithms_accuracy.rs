//! What accuracy costs in time, for matching (window, last step) and the warp (lobes, f32 against f64): the knobs of
//! `qpgen accuracy` that belong to images. One thread, processor seconds, best of three.
//!
//! `cargo bench -p quadpixel-laboratory --bench algorithms_accuracy [-- DIR]`: Markdown on stdout; into DIR also CSV
//! and SVG
#![allow(clippy::unwrap_used)] // because a bench fails by panicking

#[path = "../../algorithms/tests/matching/score.rs"]
#[allow(dead_code)] // because the tests use more of it
mod score;
#[path = "../../algorithms/tests/matching/texture.rs"]
mod texture;

use std::path::Path;

use quadpixel::simd::SimdLevel;
use quadpixel_algorithms::disparity::{DisparityMap, MatchSettings, Verdict, match_images};
use quadpixel_algorithms::warp::{Border, Lobes, Map, plain, warp};
use quadpixel_laboratory::accuracy::clock::best_of;
use quadpixel_laboratory::accuracy::row::{Curve, Row, Table, rms};
use quadpixel_laboratory::accuracy::{picture, report};
use score::{Case, judge, pair};
use texture::{Texture, picture as noisy};

/// Odd, as textures must be.
const SIZE: usize = 401;
const NOISE: [(&str, f64); 2] = [("no noise", 0.0), ("1 % noise", 0.01)];

fn main() {
    let out = std::env::args().skip(1).find(|a| !a.starts_with('-'));
    let one = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .unwrap();
    let tables = one.install(|| [windows(), steps(), lobes(), precision()]);
    print!("{}", report::markdown(&tables));
    if let Some(out) = out {
        let out = Path::new(&out);
        std::fs::create_dir_all(out).unwrap();
        for table in &tables {
            let name = table.knob.replace(' ', "-");
            std::fs::write(out.join(format!("{name}.csv")), report::csv(table)).unwrap();
        }
        let svg = picture::svg("error against processor time, one thread", &tables);
        std::fs::write(out.join("algorithms.svg"), svg).unwrap();
    }
}

fn case(noise: f64, settings: MatchSettings) -> Case {
    Case {
        size: SIZE,
        seed: 100,
        shift: [1.37, 0.61],
        noise,
        gain: 1.0,
        offset: 0.0,
        settings,
    }
}

/// Seconds a megapixel, and the map.
fn matched(case: &Case) -> (f64, DisparityMap) {
    let [a, b] = pair(case);
    let (seconds, map) = best_of(3, || match_images(&a, &b, &case.settings).unwrap());
    (seconds / (SIZE * SIZE) as f64 * 1e6, map)
}

fn windows() -> Table {
    let curve = |(name, noise): (&str, f64)| Curve {
        name: name.into(),
        rows: [7, 11, 15, 21, 31]
            .map(|window_px| {
                let settings = MatchSettings {
                    window_px,
                    ..MatchSettings::default()
                };
                let case = case(noise, settings);
                let (seconds, map) = matched(&case);
                let score = judge(&case, &map);
                let setting = format!(
                    "{window_px} px ({:.1} % valid, bound {} px)",
                    100.0 * score.valid,
                    report::short(score.bound_px)
                );
                Row::new(setting, seconds, score.rms_px)
            })
            .to_vec(),
    };
    Table {
        knob: "matching window",
        work: format!(
            "{SIZE} x {SIZE} of white noise blurred by 0.85 px, moved by (1.37, 0.61) px in the Fourier domain; stride 4, search 4 px; noise in % of the texture's range in both"
        ),
        reference: "the true shift; the bound is Cramer and Rao's".into(),
        seconds_unit: "s a megapixel",
        error_unit: "RMS, px an axis",
        curves: NOISE.map(curve).to_vec(),
        law: None,
        notes: Vec::new(),
    }
}

fn steps() -> Table {
    const LAST_PX: [f64; 7] = [0.5, 0.1, 0.03, 0.01, 1e-3, 1e-4, 1e-5];
    let with = |noise: f64, last_step_px: f64| {
        let settings = MatchSettings {
            last_step_px,
            ..MatchSettings::default()
        };
        matched(&case(noise, settings))
    };
    let curve = |(name, noise): (&str, f64)| {
        let (_, converged) = with(noise, 1e-6);
        let row = |last: f64| {
            let (seconds, map) = with(noise, last);
            let both = map.matches.iter().zip(&converged.matches);
            let both =
                both.filter(|(a, b)| a.verdict == Verdict::Valid && b.verdict == Verdict::Valid);
            let (a, b): (Vec<[f64; 2]>, Vec<[f64; 2]>) = both
                .map(|(a, b)| ([a.dx_px, a.dy_px], [b.dx_px, b.dy_px]))
                .unzip();
            Row::new(
                format!("{last} px"),
                seconds,
                rms(a.as_flattened(), b.as_flattened()),
            )
        };
        Curve {
            name: name.into(),
            rows: LAST_PX.map(row).to_vec(),
        }
    };
    Table {
        knob: "matching steps",
        work: format!(
            "as of the window, {} px: the refinement ends before a step shorter than this",
            MatchSettings::default().window_px
        ),
        reference: "the same with 1e-6 px".into(),
        seconds_unit: "s a megapixel",
        error_unit: "RMS, px an axis",
        curves: NOISE.map(curve).to_vec(),
        law: None,
        notes: Vec::new(),
    }
}

/// A texture, where to read it, and what stands there exactly.
fn moved(blur_px: f64) -> (quadpixel::image::Image, Map, Vec<f64>) {
    const SHIFT: [f64; 2] = [0.37, 0.61];
    let texture = Texture::white(SIZE, SIZE, 5);
    let still = noisy(
        SIZE,
        &texture.render(blur_px, [0.0, 0.0], None),
        1.0,
        0.0,
        0.0,
        0,
    );
    let exact = texture.render(blur_px, SHIFT, None);
    let map = Map::from_fn(SIZE, SIZE, |x, y| {
        (x as f64 - SHIFT[0], y as f64 - SHIFT[1])
    })
    .unwrap();
    (still, map, exact)
}

/// Without the rim, where the border speaks.
fn inner<T: Copy>(data: &[T]) -> Vec<T> {
    let inside =
        |i: &usize| (8..SIZE - 8).contains(&(i % SIZE)) && (8..SIZE - 8).contains(&(i / SIZE));
    (0..data.len()).filter(inside).map(|i| data[i]).collect()
}

fn deviation(data: &[f64]) -> f64 {
    let mean = data.iter().sum::<f64>() / data.len() as f64;
    rms(data, &vec![mean; data.len()])
}

fn lobes() -> Table {
    let curve = |blur_px: f64| {
        let (image, map, exact) = moved(blur_px);
        let exact = inner(&exact);
        let row = |lobes: Lobes| {
            let (seconds, done) = best_of(3, || {
                warp(&image, &map, lobes, Border::Reflect101, SimdLevel::detect())
            });
            let error = rms(&inner(done.image.data()), &exact) / deviation(&exact);
            Row::new(
                format!("a = {}", lobes.count()),
                seconds / (SIZE * SIZE) as f64 * 1e6,
                100.0 * error,
            )
        };
        Curve {
            name: format!("blur {blur_px} px"),
            rows: Lobes::ALL.map(row).to_vec(),
        }
    };
    Table {
        knob: "warp lobes",
        work: format!(
            "{SIZE} x {SIZE}, one channel, white noise blurred by a Gaussian, moved by (0.37, 0.61) px"
        ),
        reference: "the same texture moved in the Fourier domain".into(),
        seconds_unit: "s a megapixel",
        error_unit: "RMS, % of the texture's deviation",
        curves: [0.5, 0.85, 1.3].map(curve).to_vec(),
        law: None,
        notes: Vec::new(),
    }
}

fn precision() -> Table {
    let (image, map, exact) = moved(0.85);
    let rows_of = |a: Lobes| {
        let (slow, plain) = best_of(1, || -> Vec<f64> {
            let at = |i: usize| {
                let (x, y) = map.row(i / SIZE);
                plain::sample(&image, 0, x[i % SIZE], y[i % SIZE], a, Border::Reflect101).unwrap()
            };
            (0..SIZE * SIZE).map(at).collect()
        });
        let level = deviation(&exact);
        let rows = SimdLevel::ALL
            .into_iter()
            .filter(|l| *l <= SimdLevel::detect())
            .map(|level_of| {
                let (seconds, done) =
                    best_of(3, || warp(&image, &map, a, Border::Reflect101, level_of));
                let error = 100.0 * rms(done.image.data(), &plain) / level;
                Row::new(
                    format!("f32, {level_of:?}"),
                    seconds / plain.len() as f64 * 1e6,
                    error,
                )
            });
        let mut rows: Vec<Row> = rows.collect();
        rows.push(Row::new("f64, plain", slow / plain.len() as f64 * 1e6, 0.0));
        Curve {
            name: format!("a = {}", a.count()),
            rows,
        }
    };
    Table {
        knob: "warp precision",
        work: "as of the lobes, blur 0.85 px".into(),
        reference: "the definition in f64 (the oracle of the warp)".into(),
        seconds_unit: "s a megapixel",
        error_unit: "RMS, % of the texture's deviation",
        curves: Lobes::ALL.map(rows_of).to_vec(),
        law: None,
        notes: vec!["Tracing and matching have no second precision: lenses are f64, the FDTD stepper and its oracle f32.".into()],
    }
}
