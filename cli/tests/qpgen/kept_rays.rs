//! Rays that are kept, and developed by the recipe they were traced for and by other pixels.

#![allow(clippy::unwrap_used)] // because tests fail by panicking

use std::fs;

use crate::common::{assert_same_sample, done, qpgen, refused};

/// The built-in recipe, small, with some of its lines changed.
fn recipe(changes: &[(&str, &str)]) -> String {
    let printed = done(&["render", "--print-scene"]);
    let mut text = String::from_utf8(printed.stdout).unwrap();
    let small = [
        ("width = 200", "width = 24"),
        ("height = 200", "height = 20"),
        ("rays_per_pixel = 48", "rays_per_pixel = 8"),
    ];
    for (from, to) in small.iter().chain(changes) {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

const GEOMETRIC: [(&str, &str); 2] = [
    ("model = \"wave\" ", "model = \"geometric\" "),
    ("pixel = \"2.8um\"", ""),
];

#[test]
fn kept_rays_serve_their_own_recipe_and_others_that_differ_in_the_pixel() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let write = |name: &str, text: &str| {
        fs::write(at(name), text).unwrap();
        at(name)
    };
    // The built-in pixel calls for bands of wavelengths by itself; the ideal one does not.
    let waves = write("waves.toml", &recipe(&[]));
    let ideal = write("ideal.toml", &recipe(&GEOMETRIC));
    let other = [
        ("\"2x2\"", "\"2x1\""),
        ("exposure_ev = 0", "exposure_ev = -1"),
    ];
    let halves = write("halves.toml", &recipe(&[GEOMETRIC, other].concat()));
    let keep = |scene: &str, rays: &str, out: &str| {
        done(&["render", scene, "--keep-rays", &at(rays), "--out", &at(out)]);
    };
    let develop = |scene: &str, rays: &str, out: &str| {
        let output = done(&["render", scene, "--from-rays", &at(rays), "--out", &at(out)]);
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.contains("not measured"), "{said}");
    };
    keep(&waves, "waves.npz", "traced");
    develop(&waves, "waves.npz", "developed");
    assert_same_sample(at("traced").as_ref(), at("developed").as_ref());
    // The ideal pixel's rays have one wavelength per channel, and keep it, whatever another pixel calls for.
    keep(&ideal, "ideal.npz", "ideal");
    keep(&halves, "halves.npz", "halves");
    develop(&halves, "ideal.npz", "halves from ideal");
    assert_same_sample(at("halves").as_ref(), at("halves from ideal").as_ref());
    develop(&waves, "ideal.npz", "waves from ideal");
    let meta = fs::read_to_string(at("waves from ideal") + "/meta.json").unwrap();
    let meta: serde_json::Value = serde_json::from_str(&meta).unwrap();
    assert!(meta["scene"]["parameters"]["spectrum"].is_null(), "{meta}");
    let bands = [("# [spectrum] ", "[spectrum] ")];
    let asked = write("asked.toml", &recipe(&bands));
    let output = qpgen(&[
        "render",
        &asked,
        "--from-rays",
        &at("ideal.npz"),
        "--out",
        &at("no"),
    ]);
    refused(&output, "rays of another recipe");
}
