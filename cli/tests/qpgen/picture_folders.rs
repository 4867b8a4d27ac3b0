//! Published folder layouts through `qpgen convert`; pictures with depth in shards and exports; bad ones in a batch.

use std::fs;
use std::path::Path;
use std::process::Output;

use quadpixel::image::raster::{Levels, write_png8, write_png16};
use quadpixel::image::{Image, exr};

use crate::common::small::{SMALL, attempt, with_values};
use crate::common::{done, files, json, qpgen, refused, said};
use crate::pictures::{
    HEIGHT, WIDTH, codes, config, depth_m, map, write_depth_exr, write_npy, write_pfm,
};

/// f over the width in px of the pinhole that a layout's data set was rendered with.
fn camera_of(focal_px: f64, width_px: f64) -> f32 {
    (focal_px / width_px * WIDTH as f64) as f32
}

fn png(path: &Path) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    write_png8(path, &codes(), WIDTH, HEIGHT, 3).unwrap();
}

fn millimetres(path: &Path) {
    let levels = Levels::full_range(65535.0);
    let whole = map(|x, y| (1000.0 * depth_m(x, y)).round());
    write_png16(path, &whole, levels).unwrap();
}

fn by_preset(root: &Path, preset: &str, more: &[&str]) -> Output {
    let config = config(root);
    let [data, out] = ["data", "out"].map(|name| root.join(name).display().to_string());
    let arguments = ["convert", "--image", &data, "--preset", preset, "-o", &out];
    let rest = ["--config", config.as_str(), "--json"];
    qpgen(&[&arguments[..], &rest, more].concat())
}

/// Each layout, made by `make` below a folder, gives `count` samples with the depth that the files mean.
fn is_understood(preset: &str, count: usize, make: impl Fn(&Path)) {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    make(&root.join("data"));
    let object = json(&by_preset(root, preset, &[]));
    assert_eq!(object["samples"], count, "{preset}");
    for sample in 0..count {
        let path = root.join(format!("out/samples/{sample:06}/depth.exr"));
        let z = exr::read_layers(&path).unwrap().remove(0).image;
        for (x, y) in [(45, 5), (26, 20), (8, 36)] {
            let z = z.pixel(x, y)[0];
            let off = z / depth_m(x, y) - 1.0;
            assert!(off.abs() < 3e-3, "{preset} {x} {y}: {z}");
        }
    }
}

#[test]
fn published_layouts_are_understood() {
    is_understood("pairs", 1, |data| {
        png(&data.join("rgb/a/1.png"));
        fs::create_dir_all(data.join("depth/a")).unwrap();
        write_depth_exr(&data.join("depth/a/1.exr"), &map(depth_m));
    });
    is_understood("nyuv2", 2, |data| {
        png(&data.join("00000_colors.png"));
        millimetres(&data.join("00000_depth.png"));
        png(&data.join("kitchen_0003/rgb_00045.png"));
        millimetres(&data.join("kitchen_0003/sync_depth_00045.png"));
    });
    let ray = |focal: f32| {
        map(move |x, y| {
            let at = |i: usize, n: usize| (i as f32 - (n as f32 - 1.0) / 2.0) / focal;
            let (a, b) = (at(x, WIDTH), at(y, HEIGHT));
            depth_m(x, y) * (1.0 + a * a + b * b).sqrt()
        })
    };
    is_understood("hypersim", 1, |data| {
        let images = data.join("ai_001_002/images");
        png(&images.join("scene_cam_01_final_preview/frame.0007.tonemap.png"));
        png(&images.join("scene_cam_01_final_hdf5/frame.0007.color.png"));
        fs::create_dir_all(images.join("scene_cam_01_geometry_hdf5")).unwrap();
        write_npy(
            &images.join("scene_cam_01_geometry_hdf5/frame.0007.depth_meters.npy"),
            &ray(camera_of(886.81, 1024.0)),
        );
    });
    is_understood("flyingthings3d", 1, |data| {
        for pass in ["frames_cleanpass", "frames_finalpass"] {
            png(&data.join(pass).join("TRAIN/A/0000/left/0006.png"));
            png(&data.join(pass).join("TRAIN/A/0000/right/0006.png"));
        }
        fs::create_dir_all(data.join("disparity/TRAIN/A/0000/left")).unwrap();
        let focal = camera_of(1050.0, 960.0);
        write_pfm(
            &data.join("disparity/TRAIN/A/0000/left/0006.pfm"),
            &map(|x, y| focal / depth_m(x, y)),
        );
    });
    is_understood("middlebury", 2, |data| {
        for (scene, doffs) in [("Adirondack", 0.0), ("Piano", 7.5)] {
            let scene = data.join(scene);
            png(&scene.join("im0.png"));
            png(&scene.join("im1.png"));
            let disparity = |x, y| 70.0 * 0.193 / depth_m(x, y) - doffs;
            write_pfm(&scene.join("disp0.pfm"), &map(disparity));
            let calibration = format!(
                "cam0=[70 0 28; 0 70 22; 0 0 1]\ncam1=[70 0 28; 0 70 22; 0 0 1]\ndoffs={doffs}\nbaseline=193\n"
            );
            fs::write(scene.join("calib.txt"), calibration).unwrap();
        }
    });
}

#[test]
fn a_folder_of_another_layout_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    png(&root.join("data/rgb/a.png"));
    let output = by_preset(root, "hypersim", &[]);
    refused(
        &output,
        "no pair in the layout of preset hypersim; allowed: scene_cam_00_final_hdf5",
    );
    refused(&by_preset(root, "pairs", &[]), "no depth at depth/a");
    png(&root.join("data/S/im0.png"));
    write_pfm(&root.join("data/S/disp0.pfm"), &map(|_, _| 5.0));
    fs::write(
        root.join("data/S/calib.txt"),
        "cam0=[70 0 28; 0 70 22; 0 0 1]\nbaseline=193\n",
    )
    .unwrap();
    refused(
        &by_preset(root, "middlebury", &[]),
        "calib.txt: no line doffs=",
    );
}

/// Two pictures as the scene of a dataset.
fn pictures(root: &Path) -> String {
    for stem in ["a", "b"] {
        png(&root.join(format!("data/rgb/{stem}.png")));
        fs::create_dir_all(root.join("data/depth")).unwrap();
        write_npy(&root.join(format!("data/depth/{stem}.npy")), &map(depth_m));
    }
    let data = format!("{:?}", root.join("data").to_str().unwrap());
    let values = [
        ("count", "4"),
        ("scene.rgbd.image", data.as_str()),
        ("scene.rgbd.preset", "\"pairs\""),
        ("scene.rgbd.focus_share", "{ min = 0.2, max = 0.8 }"),
    ];
    with_values(SMALL, &values)
}

#[test]
fn shards_of_pictures_are_the_whole_and_exports_take_them() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let text = pictures(root);
    assert_eq!(
        json(&attempt(root, "whole", &text, &["--json"]))["samples"],
        4
    );
    for part in ["1/2", "2/2"] {
        let output = attempt(root, "parts", &text, &["--shard", part]);
        assert!(output.status.success(), "{output:?}");
    }
    let [whole, parts] = ["whole", "parts"].map(|name| root.join(name));
    done(&["merge", parts.to_str().unwrap()]);
    done(&["check", parts.to_str().unwrap()]);
    assert!(files(&whole) == files(&parts), "shards");
    for layout in ["dpdd", "qpdnet", "webdataset"] {
        let out = root.join(layout);
        let [from, to] = [&whole, &out].map(|path| path.to_str().unwrap());
        done(&["export", from, "--layout", layout, "-o", to]);
        assert!(files(&out).len() > 1, "{layout}");
    }
}

#[test]
fn files_that_lie_about_their_size_are_left_out_of_a_batch() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    for stem in ["good", "npy", "pfm", "png", "nan", "zero"] {
        png(&root.join(format!("data/rgb/{stem}.png")));
    }
    let depth = root.join("data/depth");
    fs::create_dir_all(&depth).unwrap();
    write_npy(&depth.join("good.npy"), &map(depth_m));
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (4400000, 5600000), }\n";
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend((header.len() as u16).to_le_bytes());
    npy.extend(header.as_bytes());
    fs::write(depth.join("npy.npy"), npy).unwrap();
    fs::write(depth.join("pfm.pfm"), "Pf\n4000000 4000000\n-1.0\nabcd").unwrap();
    let mut bytes = fs::read(root.join("data/rgb/png.png")).unwrap();
    bytes[16..20].copy_from_slice(&0x7fff_ffffu32.to_be_bytes());
    fs::write(depth.join("png.png"), bytes).unwrap();
    write_npy(&depth.join("nan.npy"), &map(|_, _| f32::NAN));
    write_npy(&depth.join("zero.npy"), &Image::zeros(WIDTH, HEIGHT, 1));
    let output = by_preset(root, "pairs", &["--depth-unit", "m"]);
    let object = json(&output);
    assert_eq!(object["samples"], 1, "{output:?}");
    let skipped = object["skipped"].as_array().unwrap();
    assert_eq!(skipped.len(), 5, "{skipped:?}");
    for stem in ["npy", "pfm", "png", "nan", "zero"] {
        let is_named =
            |line: &&serde_json::Value| line.as_str().unwrap().contains(&format!("depth/{stem}."));
        assert!(
            skipped.iter().any(|line| is_named(&line)),
            "{stem}: {skipped:?}"
        );
    }
    assert!(said(&output).contains("skipped"));
}

#[test]
#[cfg(unix)]
fn a_name_that_a_recipe_cannot_hold_is_told() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let depth = root.join("data/depth");
    fs::create_dir_all(&depth).unwrap();
    let pair = |name: &[u8]| {
        let name = OsStr::from_bytes(name);
        png(&root.join("data/rgb").join(name).with_extension("png"));
        let path = depth.join(name).with_extension("npy");
        write_npy(&path, &map(depth_m));
    };
    pair(b"a\xff");
    let [rgb, depth] = ["data/rgb", "data/depth"].map(|name| root.join(name).display().to_string());
    let out = root.join("alone").display().to_string();
    let folders = [
        "convert",
        "--image",
        &rgb,
        "--depth",
        &depth,
        "--depth-unit",
        "m",
    ];
    refused(
        &qpgen(&[&folders[..], &["-o", &out]].concat()),
        "its path is no UTF-8",
    );
    pair(b"b");
    let object = json(&by_preset(root, "pairs", &["--depth-unit", "m"]));
    assert_eq!(object["samples"], 1);
    let skipped = object["skipped"].as_array().unwrap();
    assert_eq!(skipped.len(), 1, "{skipped:?}");
    assert!(
        skipped[0]
            .as_str()
            .unwrap()
            .contains("its path is no UTF-8")
    );
}
