//! Matching against `matchTemplate`, and side by side with OpenCV's matchers on pairs whose shift is known.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use algorithms::disparity::{Limits, MatchSettings, Verdict, match_images};
use opencv::core::{Mat, Rect, no_array};
use opencv::imgproc::{TM_CCOEFF_NORMED, match_template};
use opencv::prelude::*;
use opencv_checks::accuracy::{WINDOW_PX, planar, stereo};
use opencv_checks::convert::{samples, to_mat};
use opencv_checks::pair;
use quadpixel::image::Image;

/// Largest shift searched, px.
const SEARCH_PX: i32 = 4;

fn settings(limits: Limits) -> MatchSettings {
    MatchSettings {
        window_px: WINDOW_PX,
        stride_px: 3,
        search_px: SEARCH_PX as usize,
        limits,
        ..MatchSettings::default()
    }
}

/// OpenCV's ZNCC of the window about (x, y) at all shifts, row by row from (−4, −4).
fn surface(a: &Mat, b: &Mat, [x, y]: [f64; 2]) -> Vec<f32> {
    let (side, half) = (WINDOW_PX as i32, WINDOW_PX as i32 / 2);
    let (left, top) = (x as i32 - half, y as i32 - half);
    let window = a.roi(Rect::new(left, top, side, side)).unwrap();
    let area = Rect::new(
        left - SEARCH_PX,
        top - SEARCH_PX,
        side + 2 * SEARCH_PX,
        side + 2 * SEARCH_PX,
    );
    let (area, window) = (
        b.roi(area).unwrap().try_clone().unwrap(),
        window.try_clone().unwrap(),
    );
    let mut to = Mat::default();
    match_template(&area, &window, &mut to, TM_CCOEFF_NORMED, &no_array()).unwrap();
    samples(&to).unwrap()
}

fn best(surface: &[f32]) -> ([i32; 2], f64) {
    let (i, height) = (surface.iter().enumerate())
        .max_by(|p, q| p.1.total_cmp(q.1))
        .unwrap();
    let side = 2 * SEARCH_PX + 1;
    let place = [i as i32 % side - SEARCH_PX, i as i32 / side - SEARCH_PX];
    (place, f64::from(*height))
}

fn mats(images: &[Image; 2]) -> [Mat; 2] {
    images.each_ref().map(|image| to_mat(image).unwrap())
}

/// Where no match is allowed to pass, ours reports the height of the whole-pixel peak. Of two unrelated pictures it may lie
/// anywhere in the search, so the heights hold the whole surface.
#[test]
fn peaks_of_the_correlation_are_those_of_match_template() {
    let [a, _] = pair(151, 21, [0.0, 0.0], 0.0);
    let [b, _] = pair(151, 22, [0.0, 0.0], 0.0);
    let images = [a, b];
    let none = settings(Limits {
        zncc: 2.0,
        ..Limits::default()
    });
    let map = match_images(&images[0], &images[1], &none).unwrap();
    let [a, b] = mats(&images);
    let mut places = std::collections::BTreeSet::new();
    let mut worst: f64 = 0.0;
    for (at, found) in map.nodes() {
        assert_eq!(found.verdict, Verdict::LowCorrelation);
        let (place, height) = best(&surface(&a, &b, at));
        places.insert(place);
        worst = worst.max((found.zncc - height).abs());
    }
    println!(
        "ZNCC peaks at {} nodes and {} of 81 shifts: apart by {worst:.1e}",
        map.grid.len(),
        places.len()
    );
    assert!(places.len() > 70, "{}", places.len());
    assert!(worst < 1e-4, "{worst}");
}

/// The refinement moves a match by less than half a pixel where the shift is near whole, so its rounded result is the whole-pixel one.
#[test]
fn whole_pixel_matches_are_those_of_match_template() {
    let (mut nodes, mut valid) = (0, 0);
    for (seed, shift) in [
        (31, [2.1, -1.2]),
        (32, [-3.0, 3.1]),
        (33, [0.2, 0.9]),
        (34, [-0.8, -2.2]),
    ] {
        let images = pair(151, seed, shift, 0.02);
        let map = match_images(&images[0], &images[1], &settings(Limits::default())).unwrap();
        let [a, b] = mats(&images);
        nodes += map.grid.len();
        for (at, found) in map.nodes().filter(|(_, m)| m.verdict == Verdict::Valid) {
            valid += 1;
            let ours = [found.dx_px.round() as i32, found.dy_px.round() as i32];
            assert_eq!(ours, best(&surface(&a, &b, at)).0, "at {at:?}");
        }
    }
    println!("same whole-pixel shift at {valid} of {valid} valid nodes (of {nodes})");
    assert!(valid as f64 > 0.95 * nodes as f64, "{valid} of {nodes}");
}

#[test]
fn errors_are_below_those_of_opencvs_flow_and_phase_correlation() {
    for noise in [0.0, 0.01] {
        let rms = planar(noise).unwrap();
        println!("noise {noise}: {rms:.4?}");
        assert!(rms.valid > 0.95, "{rms:?}");
        assert!(
            rms.farneback.iter().all(|theirs| rms.ours < *theirs) && rms.ours < rms.phase_correlate,
            "{rms:?}"
        );
    }
}

#[test]
fn errors_are_below_those_of_opencvs_stereo_matchers() {
    for noise in [0.0, 0.01] {
        let rms = stereo(noise).unwrap();
        println!("noise {noise}: {rms:.4?}");
        assert!(
            rms.valid > 0.95 && rms.bm_valid > 0.5 && rms.sgbm_valid > 0.5,
            "{rms:?}"
        );
        assert!(
            rms.ours_at_bm < rms.bm && rms.ours_at_sgbm < rms.sgbm,
            "{rms:?}"
        );
    }
}
