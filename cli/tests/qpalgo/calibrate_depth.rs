//! A camera that is focused elsewhere than its curve says: two planes at known distances find that out, and a third is
//! measured right.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use quadpixel::image::maps;
use quadpixel_algorithms::depth::FieldCurve;

use crate::common::{json, qpalgo, refused};

fn qpgen(here: &Path, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_qpgen"));
    let arguments = arguments.split_whitespace();
    command.args(arguments).current_dir(here).output().unwrap()
}

/// The phone lens before ideal pixels, a flat chart of noise that fills the window.
fn scene(focus_mm: f64, distance_mm: f64) -> String {
    format!(
        "exposure_ev = 0\n[lens]\nname = \"wide_US20120327520A1_emb3\"\nfocus_mm = {focus_mm}\n\
         [sensor]\npitch_um = 2.8\nsubpixels = \"2x2\"\nwidth = 120\nheight = 96\nwindow = {{ at = \"centre\" }}\n\
         microlens_shift = {{ rule = \"chief-ray\" }}\n[response]\nmodel = \"geometric\"\n[render]\nrays_per_pixel = 256\n\
         seed = 3\n[[planes]]\nchart = {{ kind = \"noise\", exponent = 2.0, contrast = 0.2 }}\n\
         chart_seed = 5\ntexture_px = 192\ndistance_mm = {distance_mm}\n"
    )
}

#[test]
fn a_focus_error_is_found_by_two_planes_and_a_third_comes_out_right() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let render = |name: &str, focus_mm: f64, distance_mm: f64| {
        let file = format!("{name}.toml");
        fs::write(here.join(&file), scene(focus_mm, distance_mm)).unwrap();
        let done = qpgen(here, &format!("render {file} --out {name}"));
        assert!(done.status.success(), "{done:?}");
    };
    // The curve's camera is focused at 750 mm, the real one at 700 mm.
    fs::write(here.join("said.toml"), scene(750.0, 750.0)).unwrap();
    for (name, distance_mm) in [("near", 600.0), ("far", 900.0), ("third", 720.0)] {
        render(name, 700.0, distance_mm);
    }
    // By halves of the third plane's picture, before and after.
    let sums = qpalgo(&["sai", "third", "-o", "views"], here);
    assert!(sums.status.success(), "{sums:?}");
    // Shifts of centroids for dense matching, and as windows match them.
    for (name, window, sparse) in [
        ("dense", "", &[][..]),
        ("windows", "--window 21", &["--sparse"]),
    ] {
        let (said, mine) = (format!("{name}.json"), format!("my-{name}.json"));
        let curve = format!(
            "curve said.toml --nearest-m 0.5 --distances 16 --fields 3x3 {window} -o {said}"
        );
        let made = qpgen(here, &format!("{curve} --json"));
        assert!(made.status.success(), "{made:?}");
        let made: serde_json::Value = serde_json::from_slice(&made.stdout).unwrap();
        assert!(made["distances"].as_u64().unwrap() >= 10, "{made}");
        refused(&qpgen(here, &curve), &format!("{said}: is there already"));
        let calibrate = [
            "calibrate-depth",
            "0.6=near",
            "0.9=far",
            "--curve",
            &said,
            "-o",
            &mine,
        ];
        let found = json(&calibrate, here);
        let number = |name: &str| found[name].as_f64().unwrap();
        // 1/0.7 − 1/0.75 = 0.0952 per m.
        assert!(
            (number("focus_shift_per_m") - 0.0952).abs() < 0.01,
            "{name}: {found}"
        );
        assert!((number("gain") - 1.0).abs() < 0.05, "{name}: {found}");
        assert!(number("rms_px") < 0.03, "{name}: {found}");
        let median = |curve: &str| {
            let out = format!("depth-{curve}");
            let pair = [
                "depth",
                "--left",
                "views/sum_L.exr",
                "--right",
                "views/sum_R.exr",
            ];
            let more = ["--curve", curve, "-o", &out, "--format", "exr"];
            let run = qpalgo(&[&pair[..], &more, sparse].concat(), here);
            assert!(run.status.success(), "{run:?}");
            let depth = maps::read(&here.join(&out).join("depth.exr")).unwrap();
            let mut depths: Vec<f32> = depth[0].image.data().to_vec();
            depths.retain(|z| z.is_finite());
            depths.sort_by(f32::total_cmp);
            f64::from(depths[depths.len() / 2])
        };
        let (before, after) = (median(&said), median(&mine));
        assert!(
            (before / 0.72 - 1.0).abs() > 0.04,
            "{name}: {before} m by the curve as it was"
        );
        assert!((after / 0.72 - 1.0).abs() < 0.01, "{name}: {after} m");
        let text = fs::read_to_string(here.join(&mine)).unwrap();
        assert!(FieldCurve::from_json(&text, &mine).is_ok());
    }
}

#[test]
fn planes_and_curves_that_are_none_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let refuse = |planes: &[&str], why: &str| {
        let arguments = [
            &["calibrate-depth"],
            planes,
            &["--curve", "c.json", "-o", "m.json"],
        ];
        refused(&qpalgo(&arguments.concat(), here), why);
        assert!(!here.join("m.json").exists());
    };
    refuse(&["near"], "near: no =");
    refuse(&["far=l.png,r.png"], "far=l.png,r.png: not a number");
    refuse(&["NaN=l.png,r.png"], "NaN is not a number");
    refuse(&["0.6=a,b,c"], "not one or two files");
    refuse(&["0.6=l.png,r.png"], "c.json");
    fs::write(here.join("c.json"), "{}").unwrap();
    refuse(&["0.6=l.png,r.png"], "missing field");
    for (arguments, why) in [
        ("curve none.toml", "none.toml"),
        ("curve s.toml --distances 2", "--distances is 2"),
        (
            "curve s.toml --nearest-m 3 --farthest-m 2",
            "--nearest-m is 3",
        ),
        (
            "curve s.toml --nearest-m 0.001 --counted-from sensor",
            "0.001 m lies within the lens",
        ),
        ("curve s.toml --window 8", "--window is 8"),
        ("curve s.toml --fields 0x3", "--fields is 0x3"),
    ] {
        fs::write(here.join("s.toml"), scene(750.0, 750.0)).unwrap();
        refused(&qpgen(here, arguments), why);
        assert!(!here.join("curve.json").exists());
    }
}
