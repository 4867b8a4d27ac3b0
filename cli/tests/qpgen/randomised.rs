//! Randomised optics and focus stacks: every drawn value is in `meta.json`, and the sample is made again from it.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(missing_docs)]

use crate::common;

use std::collections::BTreeSet;
use std::fs;

use common::small::{SMALL, dataset, refused_config};
use common::{assert_same_sample, assert_samples_kept, meta, render};
use quadpixel::image::exr::read_layers;
use quadpixel_datasets::{DatasetManifest, SampleMeta, check_dataset};
use quadpixel_generators::config::DatasetConfig;
use quadpixel_generators::draw;
use quadpixel_generators::recipe::Recipe;

const OPTICS: &str = r#"
[lens.tolerances]
decentre_um = { min = -4, max = 4 }
despace_um = { min = -2, max = 2 }
tilt_deg = { min = -0.05, max = 0.05 }
radius_percent = { min = -0.1, max = 0.1 }
index = { min = -5e-4, max = 5e-4 }
"#;

/// [`SMALL`] with lines added to its tables.
fn with(lens: &str, sensor: &str, tables: &str) -> String {
    let text = SMALL.replace("[sensor]\n", &format!("{lens}\n[sensor]\n{sensor}\n"));
    format!("{text}{tables}")
}

fn recipe(meta: &SampleMeta) -> Recipe {
    serde_json::from_value(meta.scene.parameters.clone()).unwrap()
}

#[test]
fn deviations_lie_in_range_differ_by_sample_and_make_the_bytes_again() {
    let folder = tempfile::tempdir().unwrap();
    let text = with(
        "focus_error_um = { min = -4, max = 4 }",
        "microlens_offset_um = { min = -0.1, max = 0.1 }",
        OPTICS,
    );
    dataset(folder.path(), "d", &text, &[]);
    let root = folder.path().join("d");
    assert_eq!(check_dataset(&root, &mut |_| {}).findings, []);
    let [a, b] = [0, 1].map(|i| recipe(&meta(&root, i)));
    for r in [&a, &b] {
        // Five plastic elements of two curved surfaces each, and a plane cover glass.
        assert_eq!(r.lens.misalignments.len(), 6);
        let curved = r
            .lens
            .deviations
            .iter()
            .filter(|d| d.radius_percent != 0.0)
            .count();
        let glasses = r.lens.deviations.iter().filter(|d| d.index != 0.0).count();
        assert_eq!((curved, glasses), (10, 6), "{:?}", r.lens.deviations);
        let all = r.lens.misalignments.iter().all(|m| {
            let far = |v: f64, most: f64| v != 0.0 && v.abs() <= most;
            far(m.dx_um, 4.0)
                && far(m.dy_um, 4.0)
                && far(m.dz_um, 2.0)
                && far(m.tip_deg, 0.05)
                && far(m.tilt_deg, 0.05)
        });
        assert!(all, "{:?}", r.lens.misalignments);
        let offset = r.sensor.microlens_offset_um;
        assert!(offset.iter().all(|s| *s != 0.0 && s.abs() <= 0.1) && offset[0] != offset[1]);
        assert!(r.lens.focus_error_um != 0.0 && r.lens.focus_error_um.abs() <= 4.0);
    }
    assert!(a.lens.misalignments != b.lens.misalignments && a.lens.deviations != b.lens.deviations);
    for sample in [0, 1] {
        let meta = meta(&root, sample);
        let (pinhole, own) = (&meta.intrinsics, recipe(&meta));
        // The plane in focus is where the moved sensor has it, and the maps are of that camera: SPEC.md's formula
        // holds.
        let [near, far] = [
            meta.focus.distance_m.unwrap(),
            own.lens.focus_mm.unwrap() * 1e-3,
        ];
        assert_eq!(near < far, own.lens.focus_error_um > 0.0);
        let folder = root.join(format!("samples/{sample:06}"));
        let [coc, depth] =
            ["coc.exr", "depth.exr"].map(|n| read_layers(&folder.join(n)).unwrap().remove(0).image);
        let p = pinhole.pinhole_behind_vertex_m;
        for (&c, &z) in coc
            .data()
            .iter()
            .zip(depth.data())
            .filter(|(c, _)| !c.is_nan())
        {
            let inverse = 1.0 / (near + p) - 1.0 / (f64::from(z) + p);
            let expected = pinhole.fx_px * pinhole.entrance_pupil_diameter_m * inverse;
            assert!(
                (f64::from(c) - expected).abs() < 1e-4 * expected.abs() + 1e-4,
                "{c} {expected}"
            );
        }
    }
    let [source, out] = ["d/samples/000001/meta.json", "again"].map(|n| folder.path().join(n));
    render(&source, &out);
    assert_same_sample(&root.join("samples/000001"), &out);
}

#[test]
fn tolerances_of_zero_change_no_byte_and_bad_ranges_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    dataset(folder.path(), "plain", SMALL, &["--count", "1"]);
    let zero = with(
        "focus_error_um = 0",
        "microlens_offset_um = 0",
        "[lens.tolerances]\n",
    );
    dataset(folder.path(), "zero", &zero, &["--count", "1"]);
    assert_samples_kept(&folder.path().join("plain"), &folder.path().join("zero"));
    for (text, field) in [
        (
            with("", "", "[lens.tolerances]\ntilt_deg = 40\n"),
            "lens.tolerances.tilt_deg",
        ),
        (
            with(
                "",
                "",
                "[lens.tolerances]\nindex = { min = 0, max = 0.2 }\n",
            ),
            "lens.tolerances.index",
        ),
        (with("focus_error_um = nan", "", ""), "lens.focus_error_um"),
        (
            with("", "microlens_offset_um = 50", ""),
            "sensor.microlens_offset_um",
        ),
        (
            with(
                "",
                "",
                "[sweep]\nsteps = 1\nfocus_over_drawn = { min = 0.5, max = 2 }\n",
            ),
            "sweep.steps",
        ),
        (
            with(
                "",
                "",
                "[sweep]\nsteps = 3\nfocus_over_drawn = { min = 2, max = 1 }\n",
            ),
            "sweep.focus_over_drawn",
        ),
    ] {
        refused_config(folder.path(), &text, field);
    }
}

#[test]
fn stack_thickness_is_drawn_from_a_few_values_that_all_samples_share() {
    let text = SMALL.replace(
        "model = \"geometric\"",
        "model = \"wave\"\npixels = [\"1.6um\", \"2.8um\"]\nstack = { scale = { min = 0.9, max = 1.1 }, variants = 3 }",
    );
    let config = DatasetConfig::from_toml(&text, "test").unwrap();
    let scales: Vec<f64> = (0..100)
        .map(|i| {
            let recipe = draw::recipe(&config, i, &|_| Ok(2.0)).unwrap();
            recipe.response.table().unwrap().stack_scale
        })
        .collect();
    assert!(scales.iter().all(|s| (0.9..=1.1).contains(s)));
    let distinct: BTreeSet<u64> = scales.iter().map(|s| s.to_bits()).collect();
    assert_eq!(distinct.len(), 3);
}

#[test]
fn a_shifted_microlens_sends_the_cone_to_its_own_side_by_the_circles_segment() {
    // The cone of the lens is a disk of radius ρ = H tan θ' above the photodiodes; shifted by s, the part beyond the
    // middle is 1/2 + (asin x + x √(1 − x²))/π with x = s/ρ. The paraxial exit pupil stands for the real one, to 2 % of
    // ρ: 0.005 of the part.
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("scene.toml");
    let recipe = r#"
[lens]
name = "wide_US20120327520A1_emb3"
focus_mm = 400
f_number = 4
[sensor]
pitch_um = 2.0
subpixels = "2x2"
width = 8
height = 8
microlens_offset_um = [0.1, 0.0]
[response]
model = "geometric"
focal_length_um = 3.5
[[planes]]
chart = { kind = "alphabet" }
texture_px = 16
distance_mm = 400
[render]
rays_per_pixel = 1
seed = 1
[readout]
photons_um2 = 500
exposure_s = 0
dark_current_e_s = 0
full_well_e = 9800
prnu = 0
read_noise_e = 2
black_level = 64
bits = 12
subpixel_gains = [1, 1, 1, 1]
sensor_seed = 1
shot_seed = 1
"#;
    fs::write(&scene, recipe).unwrap();
    let out = folder.path().join("out");
    render(&scene, &out);
    let meta: SampleMeta =
        serde_json::from_slice(&fs::read(out.join("meta.json")).unwrap()).unwrap();
    let pupil = &meta.intrinsics.exit_pupil;
    let x: f64 = 0.1 / (3.5 * 0.5 * pupil.diameter_mm / pupil.distance_mm);
    let expected = 0.5 + (x.asin() + x * (1.0 - x * x).sqrt()) / std::f64::consts::PI;
    let shading = read_layers(&out.join("shading.exr")).unwrap();
    let light = |names: &[&str]| -> f64 {
        let own = shading.iter().filter(|l| names.contains(&l.name.as_str()));
        own.map(|l| f64::from(l.image.pixel(4, 4)[1])).sum()
    };
    let part = light(&["A", "C"]) / light(&["A", "B", "C", "D"]);
    assert!(
        x > 0.2 && (part - expected).abs() < 0.005,
        "{part} for {expected}"
    );
}

#[test]
fn a_focus_stack_is_one_scene_in_one_split_at_even_steps_of_focus() {
    let folder = tempfile::tempdir().unwrap();
    let sweep =
        "[sweep]\nsteps = 3\nfocus_over_drawn = { min = 0.6, max = 3, scale = \"inverse\" }\n";
    dataset(
        folder.path(),
        "d",
        &format!("{SMALL}{sweep}"),
        &["--count", "6"],
    );
    let root = folder.path().join("d");
    assert_eq!(check_dataset(&root, &mut |_| {}).findings, []);
    let manifest: DatasetManifest =
        serde_json::from_slice(&fs::read(root.join("dataset.json")).unwrap()).unwrap();
    let scenes: Vec<&str> = manifest.samples.iter().map(|s| s.scene.as_str()).collect();
    assert!(
        scenes[0] == scenes[1]
            && scenes[1] == scenes[2]
            && scenes[2] != scenes[3]
            && scenes[3] == scenes[5]
    );
    assert!(manifest.samples[0].split == manifest.samples[2].split);
    for first in [0, 3] {
        let stack: Vec<SampleMeta> = (first..first + 3).map(|i| meta(&root, i)).collect();
        let inverse: Vec<f64> = stack
            .iter()
            .map(|m| 1.0 / m.focus.distance_m.unwrap())
            .collect();
        let drawn = recipe(&stack[0]).framing_focus_mm.unwrap() * 1e-3;
        for (step, inverse) in inverse.iter().enumerate() {
            let expected = (1.0 / 0.6 + (step as f64 / 2.0) * (1.0 / 3.0 - 1.0 / 0.6)) / drawn;
            assert!((inverse / expected - 1.0).abs() < 1e-9);
        }
        // One scene: the same cards at the same places; shot and rays are each sample's own.
        let recipes: Vec<Recipe> = stack.iter().map(recipe).collect();
        assert!(
            recipes
                .iter()
                .all(|r| r.planes == recipes[0].planes && r.sensor == recipes[0].sensor)
        );
        assert_ne!(recipes[0].render.seed, recipes[1].render.seed);
        let ranges: Vec<_> = stack.iter().map(|m| m.ranges.depth_m.unwrap()).collect();
        // The picture breathes with the focus, by the change of image distance (1.5 % here), so its rim sees a little
        // more of a tilted wall.
        let spread = ranges[0].max - ranges[0].min;
        for r in &ranges {
            assert!(
                (r.min - ranges[0].min).abs() < 0.1 * spread
                    && (r.max - ranges[0].max).abs() < 0.1 * spread
            );
        }
    }
}
