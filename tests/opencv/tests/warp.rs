//! Our warp (a = 4) against `remap` with INTER_LANCZOS4, which rounds positions to 1/32 px.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::f64::consts::TAU;

use opencv::core::Mat;
use opencv_checks::convert::{remap, samples, to_map_mats, to_mat};
use opencv_checks::{Change, pair, uniform};
use quadpixel::image::Image;
use quadpixel::simd::SimdLevel;
use quadpixel_algorithms::warp::{Border, Lobes, Map, plain, warp};

const BORDERS: [Border; 5] = [
    Border::Replicate,
    Border::Reflect,
    Border::Reflect101,
    Border::Wrap,
    Border::Constant(0.3),
];

/// Positions that f32 holds, from `margin` px outside of a picture to as far outside on the other side; each 16th on
/// the tie of two 32nds.
fn positions(seed: u64, [width, height]: [usize; 2], margin: f64) -> Map {
    let (columns, rows) = (128, 96);
    let draws = uniform(seed, 2 * columns * rows);
    let place = |u: f64, length: usize, i: usize| {
        let at = -margin + u * (length as f64 - 1.0 + 2.0 * margin);
        let at = if i.is_multiple_of(16) {
            ((at * 32.0).floor() + 0.5) / 32.0
        } else {
            at
        };
        f64::from(at as f32)
    };
    Map::from_fn(columns, rows, |x, y| {
        let i = y * columns + x;
        (
            place(draws[2 * i], width, i),
            place(draws[2 * i + 1], height, i + y),
        )
    })
    .unwrap()
}

/// The map as OpenCV uses it: to 1/32 px, ties to even.
fn rounded(map: &Map) -> Map {
    changed(map, |v| (32.0 * v).round_ties_even() / 32.0)
}

fn changed(map: &Map, change: impl Fn(f64) -> f64) -> Map {
    Map::from_fn(map.width(), map.height(), |x, y| {
        let (row_x, row_y) = map.row(y);
        (change(row_x[x]), change(row_y[x]))
    })
    .unwrap()
}

fn theirs(image: &Image, map: &Map, border: Border) -> Vec<f32> {
    let mut to = Mat::default();
    let maps = to_map_mats(map).unwrap();
    remap(&to_mat(image).unwrap(), &maps, border, &mut to).unwrap();
    samples(&to).unwrap()
}

fn ours(image: &Image, map: &Map, border: Border) -> Vec<f32> {
    let done = warp(image, map, Lobes::Four, border, SimdLevel::detect());
    done.image.data().to_vec()
}

#[test]
fn at_thirty_seconds_of_a_pixel_both_give_the_same_at_all_borders() {
    let size = [61, 47];
    for channels in [1, 3] {
        let noise: Vec<f32> = uniform(5, size[0] * size[1] * channels)
            .iter()
            .map(|v| *v as f32)
            .collect();
        let image = Image::from_vec(size[0], size[1], channels, noise).unwrap();
        for border in BORDERS {
            let map = positions(7, size, 9.0);
            let theirs = theirs(&image, &map, border);
            let ours = ours(&image, &rounded(&map), border);
            let worst = (ours.iter().zip(&theirs)).fold(0.0f32, |w, (a, b)| w.max((a - b).abs()));
            println!("{channels} channels, {border:?}: {worst:.1e} of the range");
            assert!(worst <= 1e-6, "{channels} channels, {border:?}: {worst}");
        }
    }
}

#[test]
fn at_free_positions_they_differ_by_no_more_than_opencvs_rounding() {
    let side = 61;
    let [image, _] = pair(side, 3, [0.0, 0.0], Change::noise(0.0));
    let map = positions(8, [side, side], -6.0);
    let theirs = theirs(&image, &map, Border::Reflect101);
    let ours = ours(&image, &map, Border::Reflect101);
    let used = rounded(&map);
    let at = |x, y| plain::sample(&image, 0, x, y, Lobes::Four, Border::Reflect101).unwrap();
    let step = 1.0 / 256.0;
    let mut largest: f64 = 0.0;
    for row in 0..map.height() {
        let ((x, y), (used_x, used_y)) = (map.row(row), used.row(row));
        for column in 0..map.width() {
            let i = row * map.width() + column;
            // The slope half-way between the two positions, where the mean value theorem's third-order rest is below
            // the allowance.
            let middle = [
                0.5 * (x[column] + used_x[column]),
                0.5 * (y[column] + used_y[column]),
            ];
            let slope_x = at(middle[0] + step, middle[1]) - at(middle[0] - step, middle[1]);
            let slope_y = at(middle[0], middle[1] + step) - at(middle[0], middle[1] - step);
            let bound = (slope_x.abs() + slope_y.abs()) / (2.0 * step) / 64.0;
            let difference = f64::from((ours[i] - theirs[i]).abs());
            assert!(difference <= bound + 5e-6, "{difference} {bound}");
            largest = largest.max(difference);
        }
    }
    println!("free positions: largest difference {largest:.1e} of the range, within the bound");
}

#[test]
fn on_analytic_sines_ours_is_nearer_the_truth() {
    let side = 96;
    for period in [8.0, 12.0, 20.0, 32.0] {
        let value = |x: f64, y: f64| {
            0.5 + 0.25 * (TAU * x / period).sin() + 0.25 * (TAU * (y + 0.3 * x) / period).cos()
        };
        let data = (0..side * side)
            .map(|i| value((i % side) as f64, (i / side) as f64) as f32)
            .collect();
        let image = Image::from_vec(side, side, 1, data).unwrap();
        let map = positions(9, [side, side], -6.0);
        let rms = |found: &[f32]| {
            let sum: f64 = (0..map.height())
                .flat_map(|row| {
                    let (x, y) = map.row(row);
                    x.iter().zip(y)
                })
                .zip(found)
                .map(|((x, y), found)| (f64::from(*found) - value(*x, *y)).powi(2))
                .sum();
            (sum / found.len() as f64).sqrt()
        };
        let [theirs, ours] = [theirs, ours].map(|f: fn(&Image, &Map, Border) -> Vec<f32>| {
            rms(&f(&image, &map, Border::Reflect101))
        });
        println!(
            "sine of {period} px: OpenCV {theirs:.2e}, ours {ours:.2e}, ratio {:.2}",
            theirs / ours
        );
        assert!(theirs >= 1.3 * ours, "period {period}: {theirs} {ours}");
    }
}
