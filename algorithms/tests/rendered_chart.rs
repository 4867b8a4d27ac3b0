//! The goal of the calibration on a rendered chart: 0.03 px of the aberration's true disparity, at a reduced size.
//!
//! Full size: benches/runs/2026-11-21/table2.md. The wide lens at a chief-ray angle of 10° has coma: its spots are
//! skewed, and noise down to a period of 2.2 px is aligned by their heads.
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::path::Path;

use quadpixel_algorithms::aberration_score::AberrationScore;
use quadpixel_algorithms::calibrated_camera::CalibratedCamera;
use quadpixel_algorithms::calibration::{Align, Calibration, CalibrationSettings};
use quadpixel_algorithms::capture::{Capture, CaptureOptions};
use quadpixel_generators::assemble::Responses;
use quadpixel_generators::recipe::{Recipe, SampleId};
use quadpixel_generators::sample::render_sample;
use quadpixel_generators::writer::write_alone;

// Rays alone: the goal is for the lens's aberrations.
const RECIPE: &str = r#"
effects = ["pixel-diffraction", "cra-variation", "dispersion", "aberrations", "vignetting", "occlusion"]
[lens]
name = "wide_US20120327520A1_emb3"
focus_mm = 750
[sensor]
pitch_um = 1.6
subpixels = "2x2"
width = 96
height = 96
window = { at = "chief-ray-angle", theta_deg = 10, phi_deg = 45 }
[response]
model = "geometric"
[[planes]]
chart = { kind = "noise", exponent = 1.0, contrast = 0.2, cutoff_texels = 24 }
chart_seed = 7
distance_mm = 750
[render]
rays_per_pixel = 256
seed = 3
"#;

fn render(folder: &Path) {
    let recipe: Recipe = toml::from_str(RECIPE).unwrap();
    let id = SampleId {
        index: 0,
        configuration_blake3: "0".repeat(64),
    };
    let sample = render_sample(&recipe, id, &mut Responses::new(), &()).unwrap();
    write_alone(folder, &sample.files()).unwrap();
}

#[test]
fn centroids_of_an_aberrated_chart_are_found_to_0_03_px_where_matching_fails() {
    let folder = tempfile::tempdir().unwrap();
    let chart = folder.path().join("chart");
    render(&chart);
    let capture = Capture::read(&chart, &CaptureOptions::default()).unwrap();
    let camera = CalibratedCamera::from_capture(&capture, None).unwrap();
    let score = |align| {
        let settings = CalibrationSettings {
            align,
            ..CalibrationSettings::default()
        };
        let calibration = Calibration::from_chart(&capture.views, &camera, &settings).unwrap();
        AberrationScore::read(&calibration, &chart).unwrap()
    };
    let (centroid, texture) = (score(Align::Centroid), score(Align::Texture));
    assert!(centroid.truth.rms_px > 0.25, "{centroid:?}");
    assert!(centroid.residual.rms_px <= 0.03, "{centroid:?}");
    assert!(texture.residual.rms_px > 0.03, "{texture:?}");
}
