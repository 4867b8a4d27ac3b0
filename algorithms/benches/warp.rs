//! Mpx/s of the exact Lanczos warp, one thread, on a smooth map that no shift can stand for.
//!
//! The work is that of the OpenCV figures in the project's notes: f32, one and three channels, 8 × 8 taps.

use std::time::Instant;

use quadpixel::image::Image;
use quadpixel::simd::SimdLevel;
use quadpixel_algorithms::warp::{Border, Lobes, Map, warp};

const SIZE: usize = 1024;
const RUNS: usize = 9;

fn main() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let Ok(pool) = pool else {
        eprintln!("no thread to run on");
        return;
    };
    let map = Map::from_fn(SIZE, SIZE, |x, y| {
        let (x, y) = (x as f64, y as f64);
        (x + 1.7 * (y / 97.0).sin(), y + 1.3 * (x / 83.0).cos())
    });
    let Ok(map) = map else {
        eprintln!("no map");
        return;
    };
    println!("{SIZE} x {SIZE}, one thread, best of {RUNS} runs, Mpx/s");
    println!("channels  lobes  Scalar  Avx2  Avx512");
    for channels in [1, 3] {
        let mut image = Image::zeros(SIZE, SIZE, channels);
        for (i, value) in image.data_mut().iter_mut().enumerate() {
            *value = ((i as u32).wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        }
        for lobes in Lobes::ALL {
            let mut line = format!("{channels:8}  {:5}", lobes.count());
            for level in SimdLevel::ALL {
                let seconds = (0..RUNS)
                    .map(|_| {
                        let began = Instant::now();
                        let done =
                            pool.install(|| warp(&image, &map, lobes, Border::Reflect101, level));
                        let taken = began.elapsed().as_secs_f64();
                        std::hint::black_box(done);
                        taken
                    })
                    .fold(f64::INFINITY, f64::min);
                line += &format!("  {:6.1}", (SIZE * SIZE) as f64 / seconds / 1e6);
            }
            println!("{line}");
        }
    }
}
