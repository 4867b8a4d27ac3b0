//! The numbers in `meta.json` against the pictures: SPEC.md's projection and its circle of confusion hold for what is
//! rendered.

// because tests fail by panicking
#![allow(clippy::unwrap_used)] // because tests fail by panicking

use quadpixel_generators::assemble::Responses;
use quadpixel_generators::recipe::{Recipe, SampleId};
use quadpixel_generators::sample::{Sample, render_sample};

/// A small white card (0.004 Z wide) at (X, Y, Z) mm (right, up, depth) in the dark.
fn sample(lens: &str, f_number: f64, window: &str, (x, y, z): (f64, f64, f64)) -> Sample {
    let side = 0.004 * z;
    let text = format!(
        r#"
        # By rays alone: the mean place of a dot is then known from few of them.
        effects = ["pixel-diffraction", "cra-variation", "dispersion", "aberrations", "vignetting", "occlusion"]
        planes = [{{ chart = {{ kind = "constant", color = [1, 1, 1] }}, texture_px = 4, distance_mm = {z},
                     extent = {{ of = "mm", x_mm = {x}, y_mm = {y}, width_mm = {side}, height_mm = {side} }} }}]
        [lens]
        name = "{lens}"
        focus_mm = 500
        f_number = {f_number}
        [sensor]
        pitch_um = 3.0
        subpixels = "2x2"
        width = 64
        height = 48
        window = {window}
        [response]
        model = "geometric"
        [render]
        rays_per_pixel = 1024
        seed = 1
        "#
    );
    let recipe: Recipe = toml::from_str(&text).unwrap();
    let id = SampleId {
        index: 0,
        configuration_blake3: String::new(),
    };
    render_sample(&recipe, id, &mut Responses::new(), &()).unwrap()
}

#[test]
fn the_pinhole_of_meta_json_projects_points_to_where_they_are_seen() {
    for lens in ["wide_US20120327520A1_emb3", "wide_US11940605B2_emb1"] {
        let (x, y, z) = (12.0, -7.0, 500.0);
        let window = "{ at = \"position\", x_mm = 0.08, y_mm = 0.05 }";
        let sample = sample(lens, 8.0, window, (x, y, z));
        let files = sample.files();
        let (mut sum, mut total) = ((0.0, 0.0), 0.0);
        for row in 0..files.raw.height() {
            for column in 0..files.raw.width() {
                let w = f64::from(files.raw.pixel(column, row)[1]);
                // Sub-pixels of pixel 0 are columns 0 and 1: its centre is at 0.
                sum = (
                    sum.0 + w * (column as f64 * 0.5 - 0.25),
                    sum.1 + w * (row as f64 * 0.5 - 0.25),
                );
                total += w;
            }
        }
        let i = &sample.made.description.intrinsics;
        let d = z * 1e-3 + i.pinhole_behind_vertex_m;
        let wanted = (
            i.cx_px + i.fx_px * x * 1e-3 / d,
            i.cy_px - i.fy_px * y * 1e-3 / d,
        );
        let seen = (sum.0 / total, sum.1 / total);
        // Stopped down: open, coma moves the centroid by up to 0.1 px here. Distortion is below a thousandth at this
        // field.
        assert!(
            (seen.0 - wanted.0).hypot(seen.1 - wanted.1) < 0.05,
            "{lens}: seen {seen:?}, wanted {wanted:?}"
        );
    }
}

#[test]
fn circle_of_confusion_follows_from_the_intrinsics() {
    for z in [180.0, 500.0, 4000.0] {
        let sample = sample(
            "wide_US20120327520A1_emb3",
            2.6,
            "{ at = \"centre\" }",
            (0.0, 0.0, z),
        );
        let i = &sample.made.description.intrinsics;
        let inverse = |z_mm: f64| 1.0 / (z_mm * 1e-3 + i.pinhole_behind_vertex_m);
        let wanted = i.fx_px * i.entrance_pupil_diameter_m * (inverse(500.0) - inverse(z));
        let files = sample.files();
        // The card's middle; elsewhere the dark sky has the circle of infinity.
        let told = f64::from(files.coc_px.pixel(32, 24)[0]);
        assert!(
            (told - wanted).abs() < 1e-4 * (1.0 + wanted.abs()),
            "{z}: {told} against {wanted}"
        );
        let sky = f64::from(files.coc_px.pixel(0, 0)[0]);
        let wanted = i.fx_px * i.entrance_pupil_diameter_m * inverse(500.0);
        assert!(
            (sky - wanted).abs() < 1e-4 * wanted,
            "sky: {sky} against {wanted}"
        );
    }
}
