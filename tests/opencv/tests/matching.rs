//! Matching against `matchTemplate`, and side by side with OpenCV's matchers on pairs whose shift is known.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use opencv::core::{Mat, Rect, no_array};
use opencv::imgproc::{TM_CCOEFF_NORMED, match_template};
use opencv::prelude::*;
use opencv_checks::accuracy::{WINDOW_PX, planar, stereo};
use opencv_checks::convert::{samples, to_mat};
use opencv_checks::{CHANGES, Change, pair};
use quadpixel::image::Image;
use quadpixel_algorithms::disparity::{MatchSettings, Verdict, match_images, zncc_surfaces};

/// Largest shift searched, px.
const SEARCH_PX: i32 = 4;

fn settings() -> MatchSettings {
    MatchSettings {
        window_px: WINDOW_PX,
        stride_px: 3,
        search_px: SEARCH_PX as usize,
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

/// All 81 values at every node; of two unrelated pictures the peaks lie anywhere, of a pair they are high.
#[test]
fn surfaces_of_the_correlation_are_those_of_match_template() {
    let [unrelated, _] = pair(151, 22, [0.0, 0.0], Change::noise(0.0));
    for change in CHANGES {
        let [a, b] = pair(151, 21, [1.3, -2.6], change);
        for (name, b) in [("a pair", b), ("unrelated", unrelated.clone())] {
            let ours = zncc_surfaces(&a, &b, &settings()).unwrap();
            let [mat_a, mat_b] = [&a, &b].map(|image| to_mat(image).unwrap());
            let mut places = std::collections::BTreeSet::new();
            let (mut worst, mut values) = (0.0f32, 0);
            for node in 0..ours.grid.len() {
                let (x, y) = ours.grid.pixel(node);
                let theirs = surface(&mat_a, &mat_b, [x as f64, y as f64]);
                assert_eq!(ours.at_node(node).len(), theirs.len());
                places.insert(best(&theirs).0);
                for (p, q) in ours.at_node(node).iter().zip(&theirs) {
                    values += 1;
                    worst = worst.max((p - q).abs());
                    assert!(p.is_finite());
                }
            }
            println!(
                "ZNCC, {name}, {change:?}: {values} values at {} nodes, peaks at {} of 81 shifts: apart by {worst:.1e}",
                ours.grid.len(),
                places.len()
            );
            assert!(worst < 1e-4, "{worst}");
            assert!(name == "a pair" || places.len() > 70, "{}", places.len());
        }
    }
}

/// The refinement moves a match by less than half a pixel where the shift is near whole, so its rounded result is the
/// whole-pixel one.
#[test]
fn whole_pixel_matches_are_those_of_match_template() {
    let (mut nodes, mut valid) = (0, 0);
    for (seed, shift) in [
        (31, [2.1, -1.2]),
        (32, [-3.0, 3.1]),
        (33, [0.2, 0.9]),
        (34, [-0.8, -2.2]),
    ] {
        let images = pair(151, seed, shift, Change::noise(0.02));
        let map = match_images(&images[0], &images[1], &settings()).unwrap();
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
fn errors_are_below_those_of_opencvs_flows_and_phase_correlation() {
    for change in CHANGES {
        let rms = planar(change).unwrap();
        println!("{change:?}: {rms:.4?}");
        assert!(rms.valid > 0.95, "{rms:?}");
        for theirs in [
            rms.farneback[0],
            rms.farneback[1],
            rms.pyr_lk,
            rms.phase_correlate,
        ] {
            assert!(rms.ours < theirs, "{rms:?}");
        }
    }
}

#[test]
fn errors_are_below_those_of_opencvs_stereo_matchers() {
    for change in CHANGES {
        let rms = stereo(change).unwrap();
        println!("{change:?}: {rms:.4?}");
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
