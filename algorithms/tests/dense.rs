//! Dense matching against pairs blurred by an independent code: half-pupil kernels sampled point by point.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use quadpixel::image::Image;
use quadpixel_algorithms::dense::{
    DenseError, DenseMap, DenseSettings, OppositePair, OppositeViews, dense_disparity,
    dense_disparity_of,
};
use quadpixel_algorithms::plane_error::PlaneError;

const SIDE: usize = 128;

/// White noise of the cells of a lattice, smoothed by a cubic: a texture that is known everywhere.
fn texture(x: f64, y: f64) -> f64 {
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
fn pair(disparity: impl Fn(f64) -> f64) -> [Image; 2] {
    parted(disparity, false, 0.0)
}

/// As [`pair`], parted along x or along y, and the views `beside` px farther apart than their blur says.
fn parted(disparity: impl Fn(f64) -> f64, along_y: bool, beside: f64) -> [Image; 2] {
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
            let d = disparity(x);
            let (x, y) = if along_y {
                (x, y - moved)
            } else {
                (x - moved, y)
            };
            // A disk of radius 2 d; for d > 0 the first view has more of its right or lower half.
            let terms = points.iter().map(|[u, v]| {
                let share = 0.5 * (1.0 + side * if along_y { v } else { u });
                share * texture(x - 2.0 * d * u, y - 2.0 * d * v)
            });
            (terms.sum::<f64>() / 60.0) as f32
        };
        Image::from_vec(SIDE, SIDE, 1, (0..SIDE * SIDE).map(value).collect()).unwrap()
    };
    [view(1.0), view(-1.0)]
}

fn matched([left, right]: &[Image; 2]) -> DenseMap {
    dense_disparity(left, right, &DenseSettings::default()).unwrap()
}

/// Sizes of the errors, sorted.
fn errors(map: &DenseMap, truth: impl Fn(f64) -> f64) -> Vec<f64> {
    let values = map.disparity_px.data().iter().enumerate();
    let mut errors: Vec<f64> = values
        .map(|(i, v)| (f64::from(*v) - truth((i % SIDE) as f64)).abs())
        .collect();
    errors.sort_by(f64::total_cmp);
    errors
}

#[test]
fn a_blurred_plane_has_its_centroids_disparity_and_no_more() {
    for truth in [-3.0, -1.5, -0.5, 0.0, 0.8, 2.0] {
        let map = matched(&pair(|_| truth));
        let found = errors(&map, |_| truth);
        // A matcher of shifted copies errs by 13 to 20 % of 1.6 to 3 px.
        let allowed = 0.02 + 0.05 * f64::abs(truth);
        assert!(
            found[found.len() / 2] < allowed,
            "{truth}: {}",
            found[found.len() / 2]
        );
        let sigma = map.sigma_px.data();
        assert!(sigma.iter().all(|s| s.is_finite() && *s > 0.0));
        let inside = (map.disparity_px.data().iter().zip(sigma))
            .filter(|(d, s)| (f64::from(**d) - truth).abs() < 2.0 * f64::from(**s));
        assert!(inside.count() * 10 > 9 * SIDE * SIDE, "{truth}");
    }
}

fn opposite(pair: &[Image; 2]) -> Option<OppositePair<'_>> {
    Some(OppositePair {
        views: pair.each_ref(),
        ratio: None,
    })
}

fn middle_error(views: OppositeViews<'_>, truth: f64) -> f64 {
    let found = errors(&dense_disparity_of(views).unwrap(), |_| truth);
    found[found.len() / 2]
}

#[test]
fn top_and_bottom_tell_what_left_and_right_do() {
    for truth in [-1.5, 0.8] {
        let bottom_top = parted(|_| truth, true, 0.0);
        let views = OppositeViews {
            top_bottom: opposite(&bottom_top),
            ..OppositeViews::default()
        };
        let error = middle_error(views, truth);
        assert!(error < 0.02 + 0.05 * f64::abs(truth), "{truth}: {error}");
    }
}

#[test]
fn both_pairs_agree_once_the_astigmatism_is_out_of_the_second() {
    let truth = 1.2;
    let (across, down) = (pair(|_| truth), parted(|_| truth, true, 0.5));
    let astigmatism = Image::from_vec(SIDE, SIDE, 1, vec![0.5; SIDE * SIDE]).unwrap();
    let error = |astigmatism_px| {
        let views = OppositeViews {
            left_right: opposite(&across),
            top_bottom: opposite(&down),
            astigmatism_px,
        };
        middle_error(views, truth)
    };
    let (with, without) = (error(Some(&astigmatism)), error(None));
    assert!(with < 0.08, "{with}");
    assert!(without > 2.0 * with && without > 0.1, "{without}, {with}");
    let small = Image::zeros(SIDE, SIDE - 1, 1);
    let views = OppositeViews {
        left_right: opposite(&across),
        top_bottom: opposite(&down),
        astigmatism_px: Some(&small),
    };
    assert!(matches!(
        dense_disparity_of(views),
        Err(DenseError::Size { .. })
    ));
    let none = dense_disparity_of(OppositeViews::default());
    assert_eq!(none.unwrap_err(), DenseError::NoPair);
}

#[test]
fn a_depth_step_is_matched_at_every_pixel() {
    let truth = |x: f64| if x < 64.0 { -1.0 } else { 1.0 };
    let found = errors(&matched(&pair(truth)), truth);
    let mean = found.iter().sum::<f64>() / found.len() as f64;
    assert!(mean < 0.2, "{mean}");
    assert!(
        found[found.len() * 8 / 10] < 0.1,
        "{}",
        found[found.len() * 8 / 10]
    );
}

#[test]
fn no_texture_is_no_knowledge() {
    let flat = Image::from_vec(SIDE, SIDE, 1, vec![0.4; SIDE * SIDE]).unwrap();
    let black = Image::zeros(SIDE, SIDE, 1);
    for views in [[flat.clone(), flat], [black.clone(), black]] {
        let map = matched(&views);
        let range = (map.range_px[1] - map.range_px[0]) as f32;
        assert!(map.disparity_px.data().iter().all(|d| d.is_finite()));
        assert!(map.sigma_px.data().iter().all(|s| *s > 0.99 * range));
    }
}

#[test]
fn the_bytes_are_the_same_whatever_the_threads() {
    let views = pair(|x| 0.02 * (x - 64.0));
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| matched(&views))
    };
    let bits = |image: &Image| {
        image
            .data()
            .iter()
            .map(|v| v.to_bits())
            .collect::<Vec<u32>>()
    };
    let (one, three) = (with(1), with(3));
    assert_eq!(bits(&one.disparity_px), bits(&three.disparity_px));
    assert_eq!(bits(&one.sigma_px), bits(&three.sigma_px));
}

#[test]
fn bad_pairs_are_named() {
    let image = Image::zeros(32, 32, 1);
    let refused = |left: &Image, right: &Image, ratio| {
        dense_disparity(left, right, &DenseSettings { ratio }).unwrap_err()
    };
    assert_eq!(
        refused(&image, &Image::zeros(32, 32, 3), None),
        DenseError::Plane(PlaneError::Channels(3))
    );
    let size = refused(&image, &Image::zeros(31, 32, 1), None).to_string();
    assert!(size.contains("one size"), "{size}");
    let small = Image::zeros(15, 40, 1);
    assert!(matches!(
        refused(&small, &small, None),
        DenseError::TooSmall { least: 16, .. }
    ));
    assert_eq!(refused(&image, &image, Some(0.5)), DenseError::Ratio(0.5));
    assert!(matches!(
        refused(&image, &image, Some(f64::NAN)),
        DenseError::Ratio(_)
    ));
    let mut bad = image.clone();
    bad.pixel_mut(3, 7)[0] = f32::NAN;
    assert!(matches!(
        refused(&bad, &image, None),
        DenseError::Plane(PlaneError::NotFinite { x: 3, y: 7, .. })
    ));
}
