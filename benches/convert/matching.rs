//! The disparity between the left and the right half that matching finds, window by window, against the truth.

use glam::DVec2;
use quadpixel::image::Image;
use quadpixel::render::truth::DisparityField;
use quadpixel::render::{Camera, SubPixelImage};
use quadpixel::rgbd::DepthPicture;

use crate::half;
use crate::regions::Regions;

/// Side of a window, and the distance of windows, px.
const WINDOW: usize = 24;
const STEP: usize = 8;

/// Prints the error of each way, and its difference from the rays' (the one but last).
pub fn report(
    field: &DisparityField,
    camera: &Camera,
    picture: &DepthPicture,
    regions: &Regions,
    ways: &[(&str, &SubPixelImage)],
) {
    let windows: Vec<(usize, usize)> = (0..regions.height.saturating_sub(WINDOW))
        .step_by(STEP)
        .flat_map(|y| {
            (0..regions.width - WINDOW)
                .step_by(STEP)
                .map(move |x| (x, y))
        })
        .filter(|&(x, y)| {
            let mut inside =
                (y..y + WINDOW).flat_map(|y| (x..x + WINDOW).map(move |x| y * regions.width + x));
            inside.all(|i| regions.away[i])
        })
        .collect();
    println!("\n{} windows of {WINDOW} px away from edges", windows.len());
    println!("| way | found − truth, rms, px | mean | found − that of rays, rms, px |");
    println!("|---|---|---|---|");
    let truth: Vec<f64> = (windows.iter())
        .map(|w| truth(field, camera, picture, *w))
        .collect();
    let found = |image: &SubPixelImage| -> Vec<f64> {
        let (left, right) = (half(image, false), half(image, true));
        windows.iter().map(|w| shift(&left, &right, *w)).collect()
    };
    let all: Vec<Vec<f64>> = ways.iter().map(|way| found(way.1)).collect();
    let rms = |a: &[f64], b: &[f64]| {
        let sum: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
        (sum / a.len() as f64).sqrt()
    };
    for ((name, _), found) in ways.iter().zip(&all) {
        let off = found.iter().zip(&truth).map(|(f, t)| f - t);
        println!(
            "| {name} | {:.4} | {:+.4} | {:.4} |",
            rms(found, &truth),
            off.sum::<f64>() / truth.len() as f64,
            rms(found, &all[all.len() - 2])
        );
    }
}

/// Mean over a window of how far the right half's picture lies to the right of the left half's.
fn truth(
    field: &DisparityField,
    camera: &Camera,
    picture: &DepthPicture,
    (left, top): (usize, usize),
) -> f64 {
    let mut sum = 0.0;
    for y in top..top + WINDOW {
        for x in left..left + WINDOW {
            let place = camera.sensor().position_mm(x as f64, y as f64);
            let depth = f64::from(picture.depth_mm().pixel(x, y)[0]);
            let of = |members: &[usize]| field.group_px(place, depth, members).1;
            let apart: DVec2 = of(&[1, 3]) - of(&[0, 2]);
            sum += apart.x;
        }
    }
    sum / (WINDOW * WINDOW) as f64
}

/// The shift d along x with the least Σ (left(x − d/2) − right(x + d/2))², by Gauss-Newton steps.
fn shift(left: &Image, right: &Image, (x0, y0): (usize, usize)) -> f64 {
    let mut d = 0.0;
    for _ in 0..20 {
        let (mut up, mut down) = (0.0, 1e-30);
        for y in y0..y0 + WINDOW {
            for x in x0..x0 + WINDOW {
                let (a, da) = cubic(left, x as f64 - 0.5 * d, y);
                let (b, db) = cubic(right, x as f64 + 0.5 * d, y);
                // Of a − b by d.
                let slope = -0.5 * (da + db);
                up += slope * (a - b);
                down += slope * slope;
            }
        }
        d -= up / down;
    }
    d
}

/// Value and slope along x of a Catmull-Rom curve through a row.
fn cubic(image: &Image, x: f64, y: usize) -> (f64, f64) {
    let i = x.floor();
    let f = x - i;
    let at = |k: i64| {
        let column = (i as i64 + k).clamp(0, image.width() as i64 - 1) as usize;
        f64::from(image.pixel(column, y)[0])
    };
    let [a, b, c, d] = [-1, 0, 1, 2].map(at);
    let (k1, k2, k3) = (
        0.5 * (c - a),
        a - 2.5 * b + 2.0 * c - 0.5 * d,
        0.5 * (d - a) + 1.5 * (b - c),
    );
    (
        b + f * (k1 + f * (k2 + f * k3)),
        k1 + f * (2.0 * k2 + 3.0 * f * k3),
    )
}
