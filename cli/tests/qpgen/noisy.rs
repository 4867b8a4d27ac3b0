//! Noisy captures: beside the clean ones, by the law that `meta.json` states, made again from it, and checked.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(missing_docs)]

use crate::common;

use common::small::{SMALL, dataset, refused_config};
use common::{assert_same_sample, assert_samples_kept, files, findings_with, layer, meta, render};
use quadpixel::image::exr::{Compression, Layer, Sample, encode_layers, read_layers};
use quadpixel::image::raster;
use quadpixel_datasets::check_dataset;

/// Much light, so that the normal law is near.
const READOUT: &str = "[readout]\nphotons_um2 = 4000\nprnu = 0.01\ngain_mismatch = 0.02\n";
const NEW: [&str; 3] = ["noisy.png", "noisy_views.exr", "shading.exr"];

#[test]
fn clean_files_stay_the_same_bytes_and_a_sample_is_made_again_from_its_meta() {
    let folder = tempfile::tempdir().unwrap();
    dataset(folder.path(), "clean", SMALL, &[]);
    let noisy = format!("{SMALL}{READOUT}");
    dataset(folder.path(), "noisy", &noisy, &["--threads", "1"]);
    dataset(folder.path(), "again", &noisy, &["--threads", "3"]);
    let [clean, noisy, again] = ["clean", "noisy", "again"].map(|n| files(&folder.path().join(n)));
    assert!(noisy == again);
    assert_samples_kept(&folder.path().join("clean"), &folder.path().join("noisy"));
    let new: Vec<&String> = noisy.keys().filter(|n| !clean.contains_key(*n)).collect();
    assert_eq!(new.len(), 2 * NEW.len(), "{new:?}");
    let root = folder.path().join("noisy");
    assert_eq!(check_dataset(&root, &mut |_| {}).findings, []);

    let [source, out] =
        ["noisy/samples/000001/meta.json", "rendered"].map(|n| folder.path().join(n));
    render(&source, &out);
    assert_same_sample(&root.join("samples/000001"), &out);
}

#[test]
fn noisy_minus_clean_has_mean_zero_and_the_stated_variance_in_each_sub_pixel() {
    let folder = tempfile::tempdir().unwrap();
    dataset(
        folder.path(),
        "d",
        &format!("{SMALL}{READOUT}"),
        &["--count", "1"],
    );
    let root = folder.path().join("d");
    let meta = meta(&root, 0);
    let readout = meta.noise.readout().unwrap();
    // The geometric response loses nothing inside the cone of the pupil that fits its box.
    assert!(
        (0.2..=1.0).contains(&readout.quantum_efficiency),
        "{readout:?}"
    );
    let white = readout.photons_um2 * 4.0 * readout.quantum_efficiency;
    assert!((readout.electrons_at_white / white - 1.0).abs() < 1e-12);
    let own = |name: &str| root.join("samples/000000").join(name);
    let clean = read_layers(&own("views.exr")).unwrap();
    let noisy = read_layers(&own("noisy_views.exr")).unwrap();
    let (n, k, sigma) = (
        readout.electrons_at_white,
        readout.gain_dn_per_e,
        readout.read_noise_e,
    );
    for (index, name) in ["B", "A", "D", "C"].into_iter().enumerate() {
        let gain = readout.subpixel_gains[index];
        let well = 0.8
            * readout
                .full_well_e
                .min(((1u32 << readout.bits) - 1) as f64 / k);
        let (mut sum, mut square, mut count) = (0.0, 0.0, 0.0);
        for (&a, &b) in layer(&clean, name)
            .data()
            .iter()
            .zip(layer(&noisy, name).data())
        {
            let electrons = n * f64::from(a) + readout.dark_e;
            if electrons > 20.0 && electrons < well {
                let prnu = readout.prnu * n * f64::from(a);
                let variance =
                    gain * gain * (electrons + sigma * sigma + prnu * prnu) + 1.0 / (12.0 * k * k);
                let mean = gain * electrons - readout.dark_e;
                let z = (n * f64::from(b) - mean) / variance.sqrt();
                (sum, square, count) = (sum + z, square + z * z, count + 1.0);
            }
        }
        assert!(count > 1000.0, "{name}: {count} unsaturated values");
        // Four standard errors: 1/√n of the mean, √(2/n) of the variance; half precision adds less than 1 % to either.
        assert!(
            (sum / count).abs() < 4.0 / f64::sqrt(count) + 0.01,
            "{name}: mean {}",
            sum / count
        );
        let variance = square / count;
        assert!(
            (variance - 1.0).abs() < 4.0 * f64::sqrt(2.0 / count) + 0.01,
            "{name}: variance {variance}"
        );
    }
    // A white wall in the middle of the window gives 2^ev = 1 in the sum: exposure and shading are on one scale.
    let shading = read_layers(&own("shading.exr")).unwrap();
    let total: f32 = ["A", "B", "C", "D"]
        .iter()
        .map(|s| layer(&shading, s).pixel(20, 16)[1])
        .sum();
    assert!((total - 1.0).abs() < 3e-3, "{total}");
}

#[test]
fn check_finds_codes_above_the_converter_and_negative_shading() {
    let folder = tempfile::tempdir().unwrap();
    dataset(
        folder.path(),
        "d",
        &format!("{SMALL}{READOUT}"),
        &["--count", "1"],
    );
    let root = folder.path().join("d");
    let path = root.join("samples/000000/noisy.png");
    let mut codes = raster::read(&path).unwrap();
    codes.data_mut().iter_mut().for_each(|v| *v *= 65535.0);
    codes.pixel_mut(3, 2)[0] = 5000.0;
    let levels = raster::Levels::full_range(65535.0);
    let (bytes, _) = raster::encode_png16(&path, &codes, levels).unwrap();
    let found = findings_with(&root, "noisy.png", &bytes);
    let has = |what: &str| {
        found
            .iter()
            .any(|f| f.contains("column 3, row 2") && f.contains(what))
    };
    assert!(
        has("above the converter") && has("not the linear values"),
        "{found:?}"
    );
    for (name, what) in [
        ("noisy_views.exr", "not the sum of the views"),
        ("shading.exr", "negative"),
    ] {
        let path = root.join("samples/000000").join(name);
        let mut layers = read_layers(&path).unwrap();
        layers.last_mut().unwrap().image.pixel_mut(7, 9)[0] = -3.0;
        let written: Vec<Layer<'_>> = (layers.iter())
            .map(|l| Layer {
                name: &l.name,
                channels: &["R", "G", "B"],
                image: &l.image,
                sample: Sample::Half,
            })
            .collect();
        let bytes = encode_layers(&path, &written, Compression::Piz).unwrap();
        let found = findings_with(&root, name, &bytes);
        let told =
            |f: &String| f.contains(name) && f.contains("column 7, row 9") && f.contains(what);
        assert!(found.iter().any(told), "{name}: {found:?}");
    }
    assert_eq!(check_dataset(&root, &mut |_| {}).findings, []);
}

#[test]
fn one_sensor_keeps_its_pattern_and_gains_and_bad_electronics_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    dataset(
        folder.path(),
        "one",
        &format!("{SMALL}{READOUT}same_sensor = true\n"),
        &[],
    );
    dataset(folder.path(), "many", &format!("{SMALL}[readout]\n"), &[]);
    let of = |name: &str, sample: usize| {
        let meta = meta(&folder.path().join(name), sample);
        let readout = meta.noise.readout().unwrap().clone();
        (
            readout.sensor_seed,
            readout.subpixel_gains,
            readout.shot_seed,
        )
    };
    let (a, b) = (of("one", 0), of("one", 1));
    assert_eq!((a.0, &a.1), (b.0, &b.1));
    assert_ne!(a.2, b.2);
    let (a, b) = (of("many", 0), of("many", 1));
    assert!(a.0 != b.0 && a.1 != b.1);
    for (line, field) in [
        ("bits = 20", "readout.bits"),
        ("prnu = { min = 0.2, max = 0.9 }", "readout.prnu"),
        ("photons_um2 = 0", "readout.photons_um2"),
        ("iso = 100", "iso"),
    ] {
        refused_config(folder.path(), &format!("{SMALL}[readout]\n{line}\n"), field);
    }
}
