//! Bands and the colour-filter mosaic in datasets: what the files hold, what `meta.json` says, and that faults are
//! found.

#![allow(clippy::unwrap_used)] // because tests fail by panicking
#![allow(missing_docs)]

use crate::common;

use std::fs;
use std::path::Path;

use common::small::{SMALL, dataset, refused_config};
use common::{assert_samples_kept, done, files, findings_with, layer, meta, render};
use quadpixel::image::exr::read_layers;
use quadpixel::image::{Image, raster};
use quadpixel_datasets::{Effect, check_dataset};

const READOUT: &str = "[readout]\nphotons_um2 = 4000\n";
/// The default bands.
const BANDS: &str = "[spectrum]\n";

fn with_mosaic(text: &str) -> String {
    text.replacen("pitch_um = 2.0", "pitch_um = 2.0\nmosaic = \"rggb\"", 1)
}

/// 16-bit codes of a PNG.
fn codes(path: &Path) -> Image {
    let mut image = raster::read(path).unwrap();
    (image.data_mut().iter_mut()).for_each(|v| *v = (*v * 65535.0).round());
    image
}

#[test]
fn the_mosaic_picks_channels_bit_for_bit_and_changes_no_other_file() {
    let folder = tempfile::tempdir().unwrap();
    let plain = format!("{SMALL}{READOUT}");
    dataset(folder.path(), "plain", &plain, &[]);
    dataset(folder.path(), "set", &with_mosaic(&plain), &[]);
    let root = folder.path().join("set");
    assert_eq!(check_dataset(&root, &mut |_| {}).findings, []);
    let sample = root.join("samples/000001");
    for (mosaic, source) in [("mosaic.png", "raw.png"), ("noisy_mosaic.png", "noisy.png")] {
        let (own, all) = (codes(&sample.join(mosaic)), codes(&sample.join(source)));
        assert_eq!((own.width(), own.height(), own.channels()), (80, 64, 1));
        for y in 0..64 {
            for x in 0..80 {
                // Two sub-pixels per microlens along each side: R G over G B of 2 × 2 microlenses is a square of 4 × 4.
                let channel = match (x % 4 / 2, y % 4 / 2) {
                    (0, 0) => 0,
                    (1, 1) => 2,
                    _ => 1,
                };
                assert_eq!(
                    own.pixel(x, y)[0],
                    all.pixel(x, y)[channel],
                    "{mosaic} {x} {y}"
                );
            }
        }
    }
    assert_samples_kept(&folder.path().join("plain"), &root);
    let meta = meta(&root, 1);
    let mosaic = meta.mosaic.as_ref().unwrap();
    let noisy = mosaic.noisy.unwrap();
    assert_eq!(
        (mosaic.clean.black_level, mosaic.clean.white_level),
        (0, 65535)
    );
    assert_eq!((noisy.black_level, noisy.white_level), (64, 4095));
    let simulated = &meta.effects.simulated;
    assert!(simulated.contains(&Effect::ColourMosaic), "{simulated:?}");

    // A sample is made again from its description, and the exports carry the new files or do without.
    let (source, out) = (sample.join("meta.json"), folder.path().join("again"));
    render(&source, &out);
    for name in ["mosaic.png", "noisy_mosaic.png"] {
        assert!(fs::read(out.join(name)).unwrap() == fs::read(sample.join(name)).unwrap());
    }
    for layout in ["dpdd", "qpdnet", "webdataset"] {
        let to = folder.path().join(layout);
        done(&[
            "export",
            root.to_str().unwrap(),
            "--layout",
            layout,
            "-o",
            to.to_str().unwrap(),
        ]);
        let shards = files(&to);
        let holds = |name: &[u8]| {
            shards
                .values()
                .any(|b| b.windows(name.len()).any(|w| w == name))
        };
        assert_eq!(holds(b"000001.noisy_mosaic.png"), layout == "webdataset");
    }
}

#[test]
fn a_mosaic_of_other_codes_or_levels_is_found() {
    let folder = tempfile::tempdir().unwrap();
    dataset(folder.path(), "set", &with_mosaic(SMALL), &["--count", "1"]);
    let root = folder.path().join("set");
    let found = |name: &str, bytes: &[u8]| findings_with(&root, name, bytes).concat();
    let path = root.join("samples/000000/mosaic.png");
    let mut other = codes(&path);
    other.pixel_mut(5, 3)[0] += 1.0;
    let levels = raster::Levels::full_range(65535.0);
    let (bytes, _) = raster::encode_png16(&path, &other, levels).unwrap();
    let text = found("mosaic.png", &bytes);
    assert!(
        text.contains("1 pixels, the first at column 5, row 3"),
        "{text}"
    );
    let mut levels = meta(&root, 0);
    levels.mosaic.as_mut().unwrap().clean.black_level = 7;
    let text = found("meta.json", &serde_json::to_vec(&levels).unwrap());
    assert!(
        text.contains("mosaic.clean: not the levels of raw"),
        "{text}"
    );
    let mut none = meta(&root, 0);
    none.mosaic = None;
    let text = found("meta.json", &serde_json::to_vec(&none).unwrap());
    assert!(text.contains("files: not the files"), "{text}");
    assert_eq!(check_dataset(&root, &mut |_| {}).findings, []);
}

#[test]
fn bands_are_recorded_and_one_wavelength_each_gives_the_bytes_of_lines() {
    let folder = tempfile::tempdir().unwrap();
    let lines = format!("{SMALL}[spectrum]\nwavelengths = 1\nwidth_nm = [0, 0, 0]\n");
    let banded = format!("{SMALL}{BANDS}");
    for (name, text) in [("plain", SMALL), ("lines", &lines), ("bands", &banded)] {
        dataset(folder.path(), name, text, &[]);
        assert_eq!(
            check_dataset(&folder.path().join(name), &mut |_| {}).findings,
            []
        );
    }
    assert_samples_kept(&folder.path().join("plain"), &folder.path().join("lines"));
    let [plain, banded] = ["plain", "bands"].map(|n| files(&folder.path().join(n)));
    assert!(plain["samples/000000/raw.png"] != banded["samples/000000/raw.png"]);
    // Truth is that of the reference wavelength; cards that fill the view are laid out for all wavelengths' bundles,
    // and so a little larger.
    let valid = "samples/000000/valid.png";
    assert!(plain[valid] == banded[valid]);
    let meta = meta(&folder.path().join("bands"), 0);
    let green = meta.channels[1].band.as_ref().unwrap();
    assert_eq!(
        (meta.channels[1].wavelength_nm, green.width_nm),
        (550.0, 90.0)
    );
    assert_eq!(green.wavelengths_nm, [508.0, 538.4, 561.6, 592.0]);
    assert!(green.response_wavelengths_nm.is_empty(), "geometric");
    // Exposure 0: green white is 1 in the middle of the window.
    assert!((green.white - 1.0).abs() < 1e-9, "{}", green.white);
    let effects = serde_json::to_string(&meta.effects).unwrap();
    let (did, did_not) = effects.split_once("left_out").unwrap();
    assert!(did.contains("\"wavelengths\"") && did_not.contains("scene-spectra"));
    for (line, field) in [
        ("wavelengths = 0", "wavelengths"),
        ("width_nm = [80, 500, 80]", "width_nm"),
        ("colour = 1", "colour"),
    ] {
        refused_config(
            folder.path(),
            &format!("{SMALL}[spectrum]\n{line}\n"),
            field,
        );
    }
}

#[test]
fn an_imported_table_of_two_wavelengths_weighs_each_channel_by_its_own() {
    // P is 0.2 a sub-pixel at 400 nm and 0.1 at 700 nm, in all directions: linear between, so a band has its middle's
    // value.
    let folder = tempfile::tempdir().unwrap();
    let mut csv = String::from("theta_deg,phi_deg,subpixel,P,wavelength_nm\n");
    for (nm, p) in [(400, 0.2), (700, 0.1)] {
        for theta in (0..=45).step_by(5) {
            for phi in (0..360).step_by(10) {
                for subpixel in ["A", "B", "C", "D"] {
                    csv += &format!("{theta},{phi},{subpixel},{p},{nm}\n");
                }
            }
        }
    }
    let (power, table) = (folder.path().join("power.csv"), folder.path().join("t.npz"));
    fs::write(&power, csv).unwrap();
    done(&[
        "response",
        "--pixel",
        "2.8um",
        "--import",
        power.to_str().unwrap(),
        "-o",
        table.to_str().unwrap(),
    ]);
    let response = format!("model = \"table\"\nfiles = [{:?}]", table.to_str().unwrap());
    let text = SMALL.replacen("model = \"geometric\"", &response, 1);
    dataset(
        folder.path(),
        "set",
        &format!("{text}{BANDS}{READOUT}"),
        &["--count", "1"],
    );
    let root = folder.path().join("set");
    assert_eq!(check_dataset(&root, &mut |_| {}).findings, []);
    let meta = meta(&root, 0);
    let p = |nm: f64| 0.2 - 0.1 * (nm - 400.0) / 300.0;
    // Vignetting hardly depends on the wavelength: the cone of light in the glass of the last element does by its
    // dispersion, below 2 %.
    for channel in &meta.channels {
        let band = channel.band.as_ref().unwrap();
        let exact = p(channel.wavelength_nm) / p(550.0);
        assert!((band.white / exact - 1.0).abs() < 0.02, "{channel:?}");
        assert_eq!(band.response_wavelengths_nm, band.wavelengths_nm);
    }
    let shading = read_layers(&root.join("samples/000000/shading.exr")).unwrap();
    let middle = |channel: usize| -> f32 {
        let of_view = |s: &str| layer(&shading, s).pixel(20, 16)[channel];
        ["A", "B", "C", "D"].into_iter().map(of_view).sum()
    };
    for (c, channel) in meta.channels.iter().enumerate() {
        let white = channel.band.as_ref().unwrap().white;
        assert!(
            (f64::from(middle(c)) / white - 1.0).abs() < 3e-3,
            "{c}: {white}"
        );
    }
    let simulated = &meta.effects.simulated;
    assert!(
        simulated.contains(&Effect::ResponseSpectrum),
        "{simulated:?}"
    );
}
