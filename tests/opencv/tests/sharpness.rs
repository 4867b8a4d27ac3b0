//! De, Wee and the gradient against OpenCV's DFT, SVD and Sobel, in f64.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use opencv::core::{self, BORDER_DEFAULT, CV_64F, DFT_COMPLEX_OUTPUT, Mat, Point2d, SVD};
use opencv::imgproc;
use opencv::prelude::*;
use opencv_checks::convert::to_mat_f64;
use opencv_checks::{Change, pair, uniform};
use quadpixel_algorithms::metrics::sharpness::{Plane, SharpnessSettings, sharpness};

/// Width, height and values on 0..1: blurred texture, white noise, and a slope with a step.
fn pictures() -> [(usize, usize, Vec<f64>); 3] {
    let [texture, _] = pair(101, 4, [0.0, 0.0], Change::noise(0.0));
    let texture = texture.data().iter().map(|v| f64::from(*v)).collect();
    let step = (0..80 * 45)
        .map(|i| 0.2 + 0.004 * (i % 80) as f64 + if i / 80 > 20 { 0.3 } else { 0.0 })
        .collect();
    [
        (101, 101, texture),
        (64, 97, uniform(6, 64 * 97)),
        (80, 45, step),
    ]
}

#[test]
fn de_counts_what_opencvs_dft_counts() {
    for (width, height, values) in pictures() {
        let mut spectrum = Mat::default();
        let from = to_mat_f64(height, &values).unwrap();
        core::dft(&from, &mut spectrum, DFT_COMPLEX_OUTPUT, 0).unwrap();
        let strengths: Vec<f64> = (spectrum.data_typed::<Point2d>().unwrap().iter())
            .map(|c| c.x.hypot(c.y))
            .collect();
        let largest = strengths.iter().fold(0.0f64, |a, b| a.max(*b));
        let theirs = strengths.iter().filter(|s| **s > largest / 1000.0).count();
        let plane = Plane::new(width, height, values).unwrap();
        let ours = sharpness(&plane, &SharpnessSettings::wee_abstract()).unwrap();
        println!(
            "De's count, {width} × {height}: OpenCV {theirs}, ours {}",
            ours.de_count
        );
        assert!(
            ours.de_count.abs_diff(theirs) <= 2,
            "{} {theirs}",
            ours.de_count
        );
    }
}

#[test]
fn wee_is_the_sum_that_opencvs_singular_values_give() {
    for (width, height, values) in pictures() {
        for (name, settings, power) in [
            ("abstract", SharpnessSettings::wee_abstract(), 0.5),
            ("table 2", SharpnessSettings::table_2(), 1.0),
        ] {
            let f: Vec<f64> = values.iter().map(|v| 255.0 * v).collect();
            let energy = f.iter().map(|v| v * v).sum::<f64>().powf(power);
            let mean = f.iter().sum::<f64>() / f.len() as f64 / energy;
            let g: Vec<f64> = f.iter().map(|v| v / energy - mean).collect();
            let mut singular = Mat::default();
            SVD::compute(&to_mat_f64(height, &g).unwrap(), &mut singular, 0).unwrap();
            let theirs: f64 = (singular.data_typed::<f64>().unwrap().iter())
                .take(6)
                .map(|s| s * s / (width as f64 - 1.0))
                .sum();
            let plane = Plane::new(width, height, values.clone()).unwrap();
            let ours = sharpness(&plane, &settings).unwrap().wee;
            let apart = (ours / theirs - 1.0).abs();
            println!("Wee ({name}), {width} × {height}: OpenCV {theirs:.4e}, apart {apart:.1e}");
            assert!(apart < 1e-8, "{ours} {theirs}");
        }
    }
}

#[test]
fn the_gradient_is_that_of_opencvs_sobel() {
    for (width, height, values) in pictures() {
        let from = to_mat_f64(height, &values).unwrap();
        let [x, y] = [(1, 0), (0, 1)].map(|(dx, dy)| {
            let mut to = Mat::default();
            imgproc::sobel(&from, &mut to, CV_64F, dx, dy, 3, 1.0, 0.0, BORDER_DEFAULT).unwrap();
            to.data_typed::<f64>().unwrap().to_vec()
        });
        // OpenCV mirrors at the border; ours takes the pixels that have all neighbours.
        let inside: Vec<f64> = (0..values.len())
            .filter(|i| {
                (1..width - 1).contains(&(i % width)) && (1..height - 1).contains(&(i / width))
            })
            .map(|i| x[i].hypot(y[i]))
            .collect();
        let theirs = inside.iter().sum::<f64>() / inside.len() as f64;
        let plane = Plane::new(width, height, values).unwrap();
        let ours = sharpness(&plane, &SharpnessSettings::wee_abstract())
            .unwrap()
            .gradient;
        let apart = (ours / theirs - 1.0).abs();
        println!("gradient, {width} × {height}: OpenCV {theirs:.6}, apart {apart:.1e}");
        assert!(apart < 1e-6, "{ours} {theirs}");
    }
}
