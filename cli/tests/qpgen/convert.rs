//! `qpgen convert`: pictures with depth from files of every kind into a dataset that the check accepts.

use std::fs;
use std::path::Path;
use std::process::Output;

use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};
use quadpixel::image::raster::{Levels, write_jpeg, write_png8, write_png16};
use quadpixel::image::{Image, exr, raster};

use crate::common::small::{SMALL, attempt, with_values};
use crate::common::{done, files, json, layer, meta, qpgen, refused, said};
use crate::pictures::{
    HEIGHT, WIDTH, codes, config, depth_m, map, write_depth_exr, write_npy, write_pfm,
};

fn convert(folder: &Path, image: &str, depth: &str, more: &[&str]) -> Output {
    let [image, depth, out] = [image, depth, "out"].map(|name| folder.join(name));
    let paths = [&image, &depth, &out].map(|path| path.to_str().unwrap());
    let args = [
        "convert", "--image", paths[0], "--depth", paths[1], "-o", paths[2], "--json",
    ];
    qpgen(&[&args[..], more].concat())
}

fn depths(folder: &Path, sample: usize) -> Image {
    let path = folder.join(format!("out/samples/{sample:06}/depth.exr"));
    exr::read_layers(&path).unwrap().remove(0).image
}

#[test]
fn folders_of_pairs_become_a_dataset_and_what_is_bad_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let (rgb, depth) = (root.join("rgb"), root.join("depth"));
    fs::create_dir(&rgb).unwrap();
    fs::create_dir(&depth).unwrap();
    write_png8(&rgb.join("a.png"), &codes(), WIDTH, HEIGHT, 3).unwrap();
    write_depth_exr(&depth.join("a.exr"), &map(depth_m));
    write_jpeg(&rgb.join("b.jpg"), &codes(), WIDTH, HEIGHT, 95).unwrap();
    let hole = |x: usize, y: usize| if x < 5 { f32::NAN } else { depth_m(x, y) };
    write_npy(&depth.join("b.npy"), &map(hole));
    // Of another size, without a depth, cut short.
    write_png8(&rgb.join("c.png"), &codes()[..60], 5, 4, 3).unwrap();
    write_depth_exr(&depth.join("c.exr"), &map(depth_m));
    write_png8(&rgb.join("d.png"), &codes(), WIDTH, HEIGHT, 3).unwrap();
    write_png8(&rgb.join("e.png"), &codes(), WIDTH, HEIGHT, 3).unwrap();
    fs::write(depth.join("e.npy"), b"\x93NUMPY\x01\x00").unwrap();
    let config = config(root);
    let arguments = ["--config", &config, "--threads", "1"];
    let output = convert(root, "rgb", "depth", &arguments);
    let summary = json(&output);
    assert_eq!(
        (&summary["samples"], &summary["reused"]),
        (&2.into(), &0.into()),
        "{output:?}"
    );
    let skipped: Vec<&str> = (summary["skipped"].as_array().unwrap().iter())
        .map(|line| line.as_str().unwrap())
        .collect();
    assert_eq!(skipped.len(), 3, "{skipped:?}");
    for stem in ["c.png", "d.png", "e.npy"] {
        assert!(
            skipped.iter().any(|line| line.contains(stem)),
            "{stem}: {skipped:?}"
        );
        assert!(said(&output).contains(stem));
    }
    let out = root.join("out");
    done(&["check", out.to_str().unwrap()]);
    // Depth where it is known: neither in the hole nor where the background goes on behind the square.
    let z = depths(root, 0);
    assert!((z.pixel(40, 20)[0] / depth_m(40, 20) - 1.0).abs() < 1e-5);
    assert!(z.data().iter().any(|z| z.is_nan()));
    assert!(depths(root, 1).pixel(2, 20)[0].is_nan());
    // The square is nearer than the focus: left of it in the left view.
    let maps = exr::read_layers(&out.join("samples/000000/disparity.exr")).unwrap();
    let shift = |name: &str| layer(&maps, name).pixel(26, 20)[0];
    assert!(shift("B") > shift("A") + 0.5);
    // One more time it is all there; other threads give the same bytes.
    assert_eq!(
        json(&convert(root, "rgb", "depth", &arguments))["reused"],
        2
    );
    let before = files(&out);
    fs::remove_dir_all(&out).unwrap();
    json(&convert(
        root,
        "rgb",
        "depth",
        &["--config", &config, "--threads", "3"],
    ));
    assert!(before == files(&out));
    assert_eq!(meta(&out, 0).scene.charts, ["a"]);
}

#[test]
fn every_kind_of_depth_says_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    write_png8(&root.join("a.png"), &codes(), WIDTH, HEIGHT, 3).unwrap();
    let config = config(root);
    let (fx, baseline) = (60.0f32, 0.12f32);
    let middle = ((WIDTH as f32 - 1.0) / 2.0, (HEIGHT as f32 - 1.0) / 2.0);
    let stretch = |x: usize, y: usize| {
        let (a, b) = ((x as f32 - middle.0) / fx, (y as f32 - middle.1) / fx);
        (1.0 + a * a + b * b).sqrt()
    };
    write_pfm(
        &root.join("ray.pfm"),
        &map(|x, y| depth_m(x, y) * stretch(x, y)),
    );
    write_npy(&root.join("inverse.npy"), &map(|x, y| 1.0 / depth_m(x, y)));
    write_npy(
        &root.join("disparity.npy"),
        &map(|x, y| fx * baseline / depth_m(x, y) - 3.0),
    );
    let levels = Levels::full_range(65535.0);
    write_png16(
        &root.join("mm.png"),
        &map(|x, y| (1000.0 * depth_m(x, y)).round()),
        levels,
    )
    .unwrap();
    let cases: [(&str, &[&str]); 4] = [
        ("ray.pfm", &["--depth-kind", "ray", "--focal-px", "60"]),
        ("inverse.npy", &["--depth-kind", "inverse"]),
        (
            "disparity.npy",
            &[
                "--depth-kind",
                "disparity",
                "--focal-px",
                "60",
                "--baseline-m",
                "0.12",
                "--disparity-offset-px",
                "3",
            ],
        ),
        ("mm.png", &["--depth-unit", "mm"]),
    ];
    for (name, more) in cases {
        let arguments = [&["--config", config.as_str()], more].concat();
        let output = convert(root, "a.png", name, &arguments);
        assert!(output.status.success(), "{name}: {output:?}");
        let z = depths(root, 0);
        for (x, y) in [(45, 5), (26, 20), (8, 36)] {
            let z = z.pixel(x, y)[0];
            assert!(
                (z / depth_m(x, y) - 1.0).abs() < 2e-3,
                "{name} {x} {y}: {z}"
            );
        }
        fs::remove_dir_all(root.join("out")).unwrap();
    }
    // The same from a sidecar.
    let sidecar = r#"{ "kind": "ray", "intrinsics": { "fx_px": 60 } }"#;
    fs::write(root.join("ray.json"), sidecar).unwrap();
    json(&convert(root, "a.png", "ray.pfm", &["--config", &config]));
    assert!((depths(root, 0).pixel(45, 5)[0] / depth_m(45, 5) - 1.0).abs() < 2e-3);
}

#[test]
fn both_levels_show_one_scene_with_the_same_truths() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    write_png8(&root.join("a.png"), &codes(), WIDTH, HEIGHT, 3).unwrap();
    write_depth_exr(&root.join("a.exr"), &map(depth_m));
    let values = [
        ("lens.focus_mm", "300"),
        ("sensor.window", "{ at = \"centre\" }"),
        ("rays_per_pixel", "1024"),
    ];
    let config = root.join("c.toml");
    fs::write(&config, with_values(SMALL, &values)).unwrap();
    let config = config.to_str().unwrap();
    let data = root.join("out");
    let sample = data.join("samples/000000");
    let mut made = Vec::new();
    for level in ["psf", "rays"] {
        let arguments = ["--config", config, "--level", level];
        json(&convert(root, "a.png", "a.exr", &arguments));
        done(&["check", data.to_str().unwrap()]);
        let exr = |name: &str| {
            exr::read_layers(&sample.join(name))
                .unwrap()
                .remove(0)
                .image
        };
        made.push((exr("target.exr"), exr("disparity.exr"), exr("views.exr")));
        fs::remove_dir_all(&data).unwrap();
    }
    let [psf, rays] = made.try_into().ok().unwrap();
    let apart = |a: &Image, b: &Image| {
        let pairs = a
            .data()
            .iter()
            .zip(b.data())
            .filter(|(a, b)| a.is_finite() && b.is_finite());
        let sum: f64 = pairs.clone().map(|(a, b)| f64::from(a - b).powi(2)).sum();
        (sum / pairs.count() as f64).sqrt()
    };
    assert!(apart(&psf.0, &rays.0) < 1e-5);
    assert!(apart(&psf.1, &rays.1) < 1e-6);
    assert!(apart(&psf.2, &rays.2) < 0.01, "{}", apart(&psf.2, &rays.2));
}

#[test]
fn bad_input_is_refused_with_its_file_and_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    write_png8(&root.join("a.png"), &codes(), WIDTH, HEIGHT, 3).unwrap();
    let config = config(root);
    let try_depth = |name: &str, more: &[&str]| {
        convert(
            root,
            "a.png",
            name,
            &[&["--config", config.as_str()], more].concat(),
        )
    };
    let levels = Levels::full_range(65535.0);
    write_png16(&root.join("mm.png"), &map(|_, _| 500.0), levels).unwrap();
    refused(
        &try_depth("mm.png", &[]),
        "mm.png: whole numbers without a unit",
    );
    refused(
        &try_depth("mm.png", &["--depth-unit", "inch"]),
        "allowed: m, cm, mm",
    );
    write_png8(&root.join("false.png"), &codes(), WIDTH, HEIGHT, 3).unwrap();
    refused(
        &try_depth("false.png", &["--depth-unit", "mm"]),
        "a depth of 3 channels that differ",
    );
    write_npy(&root.join("none.npy"), &map(|_, _| f32::NAN));
    refused(
        &try_depth("none.npy", &[]),
        "none.npy: every depth is a hole",
    );
    write_npy(&root.join("near.npy"), &map(|_, _| 0.02));
    refused(
        &try_depth("near.npy", &[]),
        "allowed: less than half its shorter side",
    );
    write_npy(&root.join("z.npy"), &map(depth_m));
    refused(&try_depth("z.npy", &["--depth-kind", "ray"]), "--hfov-deg");
    refused(&try_depth("absent.npy", &[]), "absent.npy");
    let mut nan = Image::zeros(WIDTH, HEIGHT, 3);
    nan.pixel_mut(3, 2)[1] = f32::NAN;
    let layer = Layer {
        name: "",
        channels: &["R", "G", "B"],
        image: &nan,
        sample: Sample::Float,
    };
    write_layers(&root.join("nan.exr"), &[layer], Compression::Zip).unwrap();
    let output = convert(root, "nan.exr", "z.npy", &["--config", &config]);
    refused(&output, "the picture has NaN at (3, 2)");
    assert!(!root.join("out/samples/000000").exists());
}

#[test]
fn pictures_with_depth_are_a_scene_of_a_dataset_with_noise_and_splits() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    for name in ["rgb", "depth"] {
        fs::create_dir(root.join(name)).unwrap();
    }
    for stem in ["a", "b"] {
        write_png8(
            &root.join(format!("rgb/{stem}.png")),
            &codes(),
            WIDTH,
            HEIGHT,
            3,
        )
        .unwrap();
        write_npy(&root.join(format!("depth/{stem}.npy")), &map(depth_m));
    }
    let [rgb, depth] =
        ["rgb", "depth"].map(|name| format!("{:?}", root.join(name).to_str().unwrap()));
    let values = [
        ("count", "3"),
        ("sensor.window", "{ at = \"random\", max_height_mm = 0.4 }"),
        ("sensor.mosaic", "\"rggb\""),
        ("scene.rgbd.image", rgb.as_str()),
        ("scene.rgbd.depth", depth.as_str()),
        ("scene.rgbd.focus_share", "{ min = 0.2, max = 0.8 }"),
        ("readout.photons_um2", "1000"),
    ];
    let text = with_values(SMALL, &values);
    let output = attempt(root, "data", &text, &["--json"]);
    assert_eq!(json(&output)["samples"], 3, "{output:?}");
    let data = root.join("data");
    done(&["check", data.to_str().unwrap()]);
    // The third sample sees the first one's picture again: one scene, in one split.
    let scenes = [0, 1, 2].map(|i| meta(&data, i).scene.id);
    assert!(scenes[0] == scenes[2] && scenes[0] != scenes[1]);
    assert!(raster::read(&data.join("samples/000002/noisy_mosaic.png")).is_ok());
    // A preset says where the depths lie.
    let both = with_values(&text, &[("scene.rgbd.preset", "\"pairs\"")]);
    refused(
        &attempt(root, "both", &both, &[]),
        "scene.rgbd has depth and preset; allowed: one of them",
    );
    // A sample again, alone, from its description.
    let sample = data.join("samples/000001");
    let again = root.join("again");
    crate::common::render(&sample.join("meta.json"), &again);
    crate::common::assert_same_sample(&sample, &again);
}

#[test]
fn a_picture_whose_blur_is_larger_than_itself_is_left_out_of_a_batch_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let (rgb, depth) = (root.join("rgb"), root.join("depth"));
    fs::create_dir(&rgb).unwrap();
    fs::create_dir(&depth).unwrap();
    for (stem, nearest_m) in [("a", 0.5), ("near", 0.011), ("b", 0.5)] {
        write_png8(&rgb.join(format!("{stem}.png")), &codes(), WIDTH, HEIGHT, 3).unwrap();
        let near = |x: usize, y: usize| if x < 5 { nearest_m } else { depth_m(x, y) };
        write_depth_exr(&depth.join(format!("{stem}.exr")), &map(near));
    }
    let config = config(root);
    let output = convert(
        root,
        "rgb",
        "depth",
        &["--config", &config, "--focus-m", "0.6"],
    );
    let summary = json(&output);
    assert_eq!(summary["samples"], 2, "{output:?}");
    let skipped = summary["skipped"].as_array().unwrap();
    let line = skipped[0].as_str().unwrap();
    assert!(skipped.len() == 1 && line.contains("near.png"), "{line}");
    assert!(
        line.contains("0.011 m") && line.contains("smaller aperture"),
        "{line}"
    );
    // Nothing is done twice, and what was left out is left out again.
    let again = json(&convert(
        root,
        "rgb",
        "depth",
        &["--config", &config, "--focus-m", "0.6"],
    ));
    assert_eq!(
        (&again["reused"], &again["skipped"]),
        (&2.into(), &summary["skipped"])
    );
    // Alone it is refused.
    let other = tempfile::tempdir().unwrap();
    let [image, depth] = [rgb.join("near.png"), depth.join("near.exr")];
    let paths = [&image, &depth].map(|path| path.to_str().unwrap());
    let alone = ["--config", &config, "--focus-m", "0.6"];
    let output = convert(other.path(), paths[0], paths[1], &alone);
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("blur"),
        "{output:?}"
    );
}
