//! Views of planes whose blur is a sum over points of the pupil, and how far a map is from the truth.

use quadpixel::image::Image;
use quadpixel::sampling::uniform;
use quadpixel_algorithms::dense::{DenseMap, OppositePair};

pub const SIDE: usize = 128;

/// White noise of the cells of a lattice, smoothed by a cubic: a texture that is known everywhere.
pub fn texture(x: f64, y: f64) -> f64 {
    let noise = |i: i64, j: i64| {
        let mut h = (i as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ (j as u64).wrapping_mul(0xC2B2_AE3D_27D4_EB4F);
        h = (h ^ (h >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        h = (h ^ (h >> 29)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (h >> 40) as f64 / (1u64 << 24) as f64
    };
    let value = |cell: f64| {
        let (u, v) = (x / cell, y / cell);
        let (i, j) = (u.floor(), v.floor());
        let smooth = |t: f64| t * t * (3.0 - 2.0 * t);
        let (a, b) = (smooth(u - i), smooth(v - j));
        let at = |di, dj| noise(i as i64 + di, j as i64 + dj);
        (1.0 - b) * ((1.0 - a) * at(0, 0) + a * at(1, 0))
            + b * ((1.0 - a) * at(0, 1) + a * at(1, 1))
    };
    0.2 + 0.3 * value(2.5) + 0.3 * value(6.0) + 0.2 * value(17.0)
}

/// Both views of a plane of `disparity(x)` px whose pupil has linear shares: a sum over 120 points of the disk.
pub fn pair(disparity: impl Fn(f64) -> f64) -> [Image; 2] {
    parted(disparity, false, 0.0)
}

/// As [`pair`], parted along x or along y, and the views `beside` px farther apart than their blur says.
pub fn parted(disparity: impl Fn(f64) -> f64, along_y: bool, beside: f64) -> [Image; 2] {
    views(|x| [2.0 * disparity(x), 1.0], along_y, beside)
}

/// Both views of a plane that is blurred to disks of `blur_px`, of which the shares leave the disparity `ratio(x)` (at
/// most ¼) times as much.
pub fn of_ratio(blur_px: f64, ratio: impl Fn(f64) -> f64) -> [Image; 2] {
    views(|x| [0.5 * blur_px, 4.0 * ratio(x)], false, 0.0)
}

/// `blur(x)`: radius of the disk, px, and steepness of the shares at column x.
fn views(blur: impl Fn(f64) -> [f64; 2], along_y: bool, beside: f64) -> [Image; 2] {
    let points: Vec<[f64; 2]> = (0..120)
        .map(|i| {
            let (r, a) = (((i as f64 + 0.5) / 120.0).sqrt(), 2.399_963 * i as f64);
            [r * a.cos(), r * a.sin()]
        })
        .collect();
    let view = |side: f64| {
        let value = |i: usize| {
            let moved = 0.5 * side * beside;
            let (x, y) = ((i % SIDE) as f64, (i / SIDE) as f64);
            let [radius, steepness] = blur(x);
            let (x, y) = if along_y {
                (x, y - moved)
            } else {
                (x - moved, y)
            };
            // In front of the focus (radius > 0) the first view has more of the disk's right or lower half.
            let terms = points.iter().map(|[u, v]| {
                let share = 0.5 * (1.0 + side * steepness * if along_y { v } else { u });
                share * texture(x - radius * u, y - radius * v)
            });
            (terms.sum::<f64>() / 60.0) as f32
        };
        Image::from_vec(SIDE, SIDE, 1, (0..SIDE * SIDE).map(value).collect()).unwrap()
    };
    [view(1.0), view(-1.0)]
}

/// Sizes of the errors, sorted.
pub fn errors(map: &DenseMap, truth: impl Fn(f64) -> f64) -> Vec<f64> {
    let values = map.disparity_px.data().iter().enumerate();
    let mut errors: Vec<f64> = values
        .map(|(i, v)| (f64::from(*v) - truth((i % SIDE) as f64)).abs())
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

pub fn opposite(pair: &[Image; 2]) -> Option<OppositePair<'_>> {
    Some(OppositePair {
        views: pair.each_ref(),
        ratio: None,
    })
}

/// Pairs that show nothing: grey, black, and noise, another in each view.
pub fn without_texture() -> [[Image; 2]; 3] {
    let view = |value: &dyn Fn(usize) -> f64| {
        let values = (0..SIDE * SIDE).map(|i| value(i) as f32);
        Image::from_vec(SIDE, SIDE, 1, values.collect()).unwrap()
    };
    let noise = |seed: u64| view(&|i| 0.4 + 0.02 * (uniform(seed, &[i as u64]) - 0.5));
    let (grey, black) = (view(&|_| 0.4), view(&|_| 0.0));
    [
        [grey.clone(), grey],
        [black.clone(), black],
        [noise(1), noise(2)],
    ]
}

/// Whether σ is a sixteenth of the width everywhere, all that is looked for, and every disparity in its middle.
pub fn knows_nothing(map: &DenseMap) -> bool {
    let widest = SIDE as f32 / 16.0;
    map.disparity_px.data().iter().all(|d| d.abs() < 1e-6)
        && map
            .sigma_px
            .data()
            .iter()
            .all(|s| (s - widest).abs() < 1e-3)
}
