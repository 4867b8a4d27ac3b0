//! Inputs of the commands, small and sound.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::commands::program;
use crate::common::generator::Generator;
use crate::common::small::with_values;

const RAW: &str = "data/samples/000000/raw.png";

/// Runs a command in `base`; what it printed.
fn run(base: &Path, line: &str) -> Vec<u8> {
    let (name, words) = line.split_once(' ').unwrap();
    let done = Command::new(program(name))
        .args(words.split(' '))
        .current_dir(base)
        .output()
        .unwrap();
    assert!(done.status.success(), "{line}: {done:?}");
    done.stdout
}

/// Makes the sound inputs once, in `base`.
pub fn make_inputs(base: &Path) {
    make_datasets(base);
    make_scenes(base);
    make_pixels(base);
    make_pictures_with_depth(base);
    let lens = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../src/lens/library/lib_triplet_US2453260.json");
    fs::copy(&lens, base.join("l.json")).unwrap();
    fs::create_dir(base.join("lenses")).unwrap();
    fs::copy(&lens, base.join("lenses/l.json")).unwrap();
    run(
        base,
        "qpalgo correct-aberrations --calibration noise -o k.json",
    );
    let row =
        "[[row]]\nsetup = \"a\"\nposition = \"c\"\ncalibration = \"noise\"\ncapture = \"noise\"\n";
    fs::write(base.join("t.toml"), row).unwrap();
    run(
        base,
        "qpgen render scene.toml --out kept --keep-rays kept.npz",
    );
    let example = String::from_utf8(run(base, "qpgen fit --print-capture")).unwrap();
    make_capture(&base.join("capture"), &example);
}

/// A dataset, its shards, and one that sweeps the focus.
fn make_datasets(base: &Path) {
    let size = [
        ("count", "1"),
        ("sensor.width", "64"),
        ("sensor.height", "48"),
    ];
    drop(Generator::with_values(base, &size));
    fs::rename(base.join("config.toml"), base.join("c.toml")).unwrap();
    run(base, "qpgen dataset --config c.toml --out data");
    for shard in ["1/2", "2/2"] {
        let line = format!("qpgen dataset --config c.toml --count 2 --shard {shard} --out shards");
        run(base, &line);
    }
    fs::copy(base.join(RAW), base.join("a.png")).unwrap();
    let configuration = fs::read_to_string(base.join("c.toml")).unwrap();
    let sweep = "{ steps = 3, focus_over_drawn = { min = 0.8, max = 1.5, scale = \"inverse\" } }";
    let stack = with_values(&configuration, &[("count", "3"), ("sweep", sweep)]);
    fs::write(base.join("stack.toml"), stack).unwrap();
    run(base, "qpgen dataset --config stack.toml --out stack");
}

/// Scenes without a table to compute and without letters to draw.
fn make_scenes(base: &Path) {
    let scene = String::from_utf8(run(base, "qpgen render --print-scene")).unwrap();
    let mut scene: toml::Table = scene.parse().unwrap();
    scene["response"] = toml::Value::Table("model = \"geometric\"".parse().unwrap());
    scene["planes"][0]["chart"] = "constant".into();
    scene["sensor"]["width"] = 16.into();
    scene["sensor"]["height"] = 12.into();
    scene["render"]["rays_per_pixel"] = 4.into();
    fs::write(base.join("scene.toml"), toml::to_string(&scene).unwrap()).unwrap();
    let chart = "kind = \"noise\"\nexponent = 1.0\ncontrast = 0.2\ncutoff_texels = 40";
    scene["planes"][0]["chart"] = toml::Value::Table(chart.parse().unwrap());
    scene["planes"][0]["distance_mm"] = scene["lens"]["focus_mm"].clone();
    scene["sensor"]["width"] = 112.into();
    scene["sensor"]["height"] = 112.into();
    scene["render"]["rays_per_pixel"] = 64.into();
    fs::write(base.join("noise.toml"), toml::to_string(&scene).unwrap()).unwrap();
    run(base, "qpgen render noise.toml --out noise");
    let focus_mm = scene["lens"]["focus_mm"].as_integer().unwrap() as f64;
    scene["planes"][0]["distance_mm"] = (1.15 * focus_mm).into();
    fs::write(base.join("far.toml"), toml::to_string(&scene).unwrap()).unwrap();
    run(base, "qpgen render far.toml --out far");
    run(
        base,
        "qpgen curve noise.toml --distances 9 --fields 2x2 -o curve.json",
    );
    fs::write(base.join("s.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
}

/// A pixel, one so small that exact fields in it take seconds, and a measured response.
fn make_pixels(base: &Path) {
    let pixel = String::from_utf8(run(base, "qpgen response --pixel 1.6um --print-pixel")).unwrap();
    let small = [
        ("pitch_um", "0.4"),
        ("silicon_um", "0.5"),
        ("trench_um", "0.0"),
        ("lens.radius_um", "0.3"),
        ("lens.height_um", "0.2"),
    ];
    fs::write(base.join("small.toml"), with_values(&pixel, &small)).unwrap();
    fs::write(base.join("p.toml"), pixel).unwrap();
    let mut rows = String::from("theta_deg,phi_deg,subpixel,P\n");
    for theta in [0, 15, 30, 45, 60] {
        for phi in (0..360).step_by(if theta == 0 { 360 } else { 30 }) {
            for name in ["A", "B", "C", "D"] {
                rows.push_str(&format!("{theta},{phi},{name},0.2\n"));
            }
        }
    }
    fs::write(base.join("r.csv"), rows).unwrap();
}

/// A step of depth in a grey picture, for the lens of a phone: a picture that is blurred over half its side is refused,
/// and the other datasets' old triplet of 100 mm alone blurs over 70 pixels.
fn make_pictures_with_depth(base: &Path) {
    let plane = |kind: &str, value: &dyn Fn(usize) -> f32, channels: usize| {
        let mut bytes = format!("{kind}\n64 48\n-1.0\n").into_bytes();
        let values = (0..64 * 48).flat_map(|k| vec![value(k); channels]);
        bytes.extend(values.flat_map(f32::to_le_bytes));
        bytes
    };
    let grey = |k: usize| 0.2 + 0.01 * (k % 7) as f32;
    let metres = |k: usize| if k % 64 < 32 { 0.70 } else { 0.75 };
    fs::write(base.join("rgb.pfm"), plane("PF", &grey, 3)).unwrap();
    fs::write(base.join("z.pfm"), plane("Pf", &metres, 1)).unwrap();
    let configuration = fs::read_to_string(base.join("c.toml")).unwrap();
    let values = [
        ("lens.names", r#"["wide_US20120327520A1_emb3"]"#),
        ("scene.rgbd.image", "\"rgb.pfm\""),
        ("scene.rgbd.depth", "\"z.pfm\""),
        ("scene.rgbd.focus_share", "{ min = 0.1, max = 0.9 }"),
    ];
    let text = with_values(&configuration, &values);
    fs::write(base.join("rgbd.toml"), text).unwrap();
}

/// Kernels of two views over four fields, and white sheets.
fn make_capture(folder: &Path, example: &str) {
    fs::create_dir(folder).unwrap();
    let mut capture: toml::Table = example.parse().unwrap();
    for (part, ending) in [("kernels", "npy"), ("sheet", "png")] {
        for side in ["left", "right"] {
            capture[part][side] = format!("{side}.{ending}").into();
        }
    }
    capture["kernels"]["grid"] = vec![2, 2].into();
    capture["kernels"]["field_px"] = 8.into();
    fs::write(
        folder.join("capture.toml"),
        toml::to_string(&capture).unwrap(),
    )
    .unwrap();
    for (side, sign) in [("left", 1.0), ("right", -1.0)] {
        let kernel = ndarray::Array3::from_shape_fn((4, 9, 9), |(_, y, x)| {
            let (x, y) = (x as f64 - 4.0, y as f64 - 4.0);
            (1.0 + sign * 0.08 * x) / (1.0 + (3.0 * (x.hypot(y) - 2.5)).exp())
        });
        ndarray_npy::write_npy(folder.join(format!("{side}.npy")), &kernel).unwrap();
        let code = |x: u32, _: u32| image::Luma([(7025.0 + sign * 5.0 * (x as f64 - 32.0)) as u16]);
        image::ImageBuffer::from_fn(64, 16, code)
            .save(folder.join(format!("{side}.png")))
            .unwrap();
    }
}
