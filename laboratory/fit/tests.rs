//! What is refused.

use quadpixel::image::raster::encode_gray16;
use quadpixel::sensor::CollectedAt;
use quadpixel_generators::camera_file::CameraFile;

use super::Fitted;
use super::camera_file::camera_file;
use super::camera_model::{CameraModel, Fineness, Optics};
use super::capture::{CaptureDescription, EXAMPLE_TOML};
use super::conjugates::Conjugates;
use super::measurements::Measurements;
use super::noise::Noise;
use super::parameters::{Known, LAYERS, Name, Parameter};
use super::truth::{TruthSettings, drawn, simulated};

const SIDE: usize = 35;
fn example() -> CaptureDescription {
    toml::from_str(EXAMPLE_TOML).unwrap()
}

pub(super) fn model() -> CameraModel<'static> {
    let mut fineness = Fineness::draft();
    fineness.pupil_points = 200;
    fineness.table.steps = 3;
    CameraModel::new(&example().pixel(), 550.0, optics(), fineness).unwrap()
}

pub(super) const KNOWN: Known = Known {
    pitch_um: 1.4,
    f_number: 1.8,
    disk_px: 14.0,
    focal_length_mm: 4.4,
    pupil_mm: None,
    focus_mm: None,
    has_kernels: true,
};

fn optics() -> Optics {
    Optics {
        f_number: KNOWN.f_number,
        unit_mm: KNOWN.unit_mm(),
        side: SIDE,
        view_pixel_um: 2.8,
        collected_at: CollectedAt::Anywhere,
        conjugates: Conjugates {
            focal_length_mm: KNOWN.focal_length_mm,
            hiatus_mm: 0.0,
        },
    }
}

fn parameters() -> Vec<Parameter> {
    KNOWN.parameters()
}

pub(super) fn settings(seed: u64) -> TruthSettings {
    TruthSettings {
        seed,
        grid: [4, 3],
        field_mm: 0.9,
        sheet_half_mm: 2.0,
        sheet_columns: 16,
        noise: Noise {
            kernel: 0.05,
            sheet: 0.005,
            plane: 1.0,
        },
    }
}

#[test]
fn too_few_fields_and_kernels_that_are_none_are_refused() {
    let (model, parameters) = (model(), parameters());
    let measured = simulated(&model, &drawn(&parameters, 1), &settings(1), 2.8, None).unwrap();
    let message = |change: &dyn Fn(&mut Measurements)| {
        let mut changed = measured.clone();
        change(&mut changed);
        changed.check().unwrap_err().to_string()
    };
    let few = message(&|m| m.fields.truncate(3));
    assert!(
        few.contains("too little data") && few.contains("2 fields"),
        "{few}"
    );
    let short = message(&|m| m.fields[1].views[0].truncate(9));
    assert!(
        short.contains("left kernel 1") && short.contains("side × side"),
        "{short}"
    );
    let dark = message(&|m| m.fields[2].views[1].fill(f64::NAN));
    assert!(dark.contains("right kernel 2"), "{dark}");
    let unlit = message(&|m| m.fields[0].left_part = f64::NAN);
    assert!(
        unlit.contains("field 0") && unlit.contains("NaN") && unlit.contains("white sheet"),
        "{unlit}"
    );
    let sheet = message(&|m| m.sheet[0].ratio = -1.0);
    assert!(sheet.contains("left over right is -1"), "{sheet}");
}

/// A folder of captures that are good: 2 × 2 fields of Gaussian kernels, sheets of 64 × 48.
fn good_folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let kernel = |i: usize| {
        let (x, y) = ((i % 21) as f32 - 10.0, (i / 21) as f32 - 10.0);
        (-(x * x + y * y) / 18.0).exp()
    };
    let kernels =
        ndarray::Array3::<f32>::from_shape_fn((4, 21, 21), |(_, y, x)| kernel(21 * y + x));
    for name in ["left", "right"] {
        ndarray_npy::write_npy(folder.path().join(format!("k_{name}.npy")), &kernels).unwrap();
        write_sheet(folder.path(), name, 64, |i| 9000 + (i % 640) as u16);
    }
    let text = EXAMPLE_TOML
        .replace("blur_kernels", "k")
        .replace("white_sheet", "s")
        .replace("[8, 6]", "[2, 2]")
        .replace("168", "20");
    std::fs::write(folder.path().join("capture.toml"), text).unwrap();
    folder
}

fn write_sheet(folder: &std::path::Path, name: &str, width: usize, code: impl Fn(usize) -> u16) {
    let codes: Vec<u16> = (0..width * 48).map(code).collect();
    let path = folder.join(format!("s_{name}.png"));
    let bytes = encode_gray16(&path, &codes, width, 48).unwrap();
    std::fs::write(&path, bytes).unwrap();
}

pub(super) fn measured(folder: &std::path::Path) -> Result<Measurements, String> {
    let description =
        CaptureDescription::read(&folder.join("capture.toml")).map_err(|e| e.to_string())?;
    description.measurements(folder).map_err(|e| e.to_string())
}

#[test]
fn captures_that_cannot_be_used_are_named_with_what_would_do() {
    let good = good_folder();
    assert_eq!(measured(good.path()).unwrap().fields.len(), 4);
    let refused = |change: &dyn Fn(&std::path::Path), said: &str| {
        let folder = good_folder();
        change(folder.path());
        let error = measured(folder.path()).unwrap_err();
        assert!(error.contains(said), "{error}");
    };
    refused(
        &|f| write_sheet(f, "right", 60, |_| 9001),
        "60 × 48 px, but the left picture is 64 × 48 px",
    );
    refused(
        &|f| write_sheet(f, "right", 64, |_| 16383),
        "s_right.png: 100.0 % of the pixels are saturated",
    );
    refused(
        &|f| write_sheet(f, "left", 64, |i| 257 * (40 + i % 7) as u16),
        "s_left.png: 8-bit codes",
    );
    refused(
        &|f| write_sheet(f, "left", 64, |_| 1000),
        "no code is above the black level 1024",
    );
    refused(
        &|f| std::fs::write(f.join("k_left.npy"), b"no array").unwrap(),
        "k_left.npy",
    );
    let kernels = |f: &std::path::Path, shape: (usize, usize, usize), value: f32| {
        let array = ndarray::Array3::<f32>::from_elem(shape, value);
        ndarray_npy::write_npy(f.join("k_right.npy"), &array).unwrap();
    };
    refused(
        &|f| kernels(f, (3, 21, 21), 1.0),
        "3 kernels; allowed: 2 × 2",
    );
    refused(&|f| kernels(f, (4, 21, 20), 1.0), "kernels of 21 × 20 px");
    refused(&|f| kernels(f, (4, 21, 21), 0.0), "kernel 0 has the sum 0");
    refused(&|f| kernels(f, (4, 21, 21), 1.0), "it is cut off");
    let edit = |from: &'static str, to: &'static str| {
        move |f: &std::path::Path| {
            let path = f.join("capture.toml");
            let text = std::fs::read_to_string(&path).unwrap().replace(from, to);
            std::fs::write(path, text).unwrap();
        }
    };
    refused(
        &edit("f_number = 1.73", "f_number = 0"),
        "camera.f_number is 0",
    );
    refused(
        &edit("field_px = 20", "field_px = 40"),
        "field 0 lies beside the sheet",
    );
    refused(&edit("[sheet]", "[shet]"), "capture.toml");
    refused(&edit("f_number = 1.73", "f_number = \"wide\""), "line");
    refused(
        &|f| {
            let flat = ndarray::Array2::<f32>::ones((21, 21));
            ndarray_npy::write_npy(f.join("k_right.npy"), &flat).unwrap();
        },
        "no array of three axes",
    );
    refused(
        &|f| {
            let mut ringing = ndarray::Array3::<f32>::zeros((4, 21, 21));
            for k in 0..4 {
                (ringing[[k, 10, 10]], ringing[[k, 10, 12]]) = (5.0, -4.0);
            }
            ndarray_npy::write_npy(f.join("k_right.npy"), &ringing).unwrap();
        },
        "add up to 9.000",
    );
}

/// Cameras drawn, captured with noise and fitted blind. In full: `QUADPIXEL_FIT_TRIALS=100`, which prints them.
#[test]
fn drawn_cameras_are_found_again_within_what_is_said() {
    let (model, mut parameters) = (model(), parameters());
    // The layers of a pixel are not known one by one: of them the microlens's curvature alone is left open.
    for layer in LAYERS.iter().filter(|layer| **layer != Name::RadiusUm) {
        parameters[*layer as usize].sigma = 0.0;
    }
    let open = parameters.iter().filter(|p| p.sigma > 0.0).count();
    let asked = std::env::var("QUADPIXEL_FIT_TRIALS");
    let trials = asked.map_or(4, |n| n.parse().unwrap());
    let (mut beyond, mut worst) = (0, [0.0_f64; 3]);
    for seed in 1..=trials {
        let mut settings = settings(seed);
        // A quarter of the fields and columns of `qpgen fit --trials`, so half the noise: captures tell as much.
        let noise = &mut settings.noise;
        (noise.kernel, noise.sheet) = (0.5 * noise.kernel, 0.5 * noise.sheet);
        let found = super::truth::trial(&model, &parameters, &settings, 2.8, &()).unwrap();
        for (name, drawn, fitted, sigma) in &found.parameters {
            let sigmas = (fitted - drawn) / sigma;
            if sigmas.abs() > 3.0 {
                beyond += 1;
                println!("{seed}: {name} {fitted:.4} for {drawn:.4}, {sigmas:.2} deviations");
            }
        }
        let errors = [found.shift_error, found.kernel_error, found.sheet_error];
        worst = [0, 1, 2].map(|k| worst[k].max(errors[k]));
    }
    let of = trials as usize * open;
    println!("{beyond} of {of} beyond three deviations; largest errors {worst:?}");
    assert!(beyond as f64 <= 0.01 * of as f64, "{beyond} of {of}");
    assert!(worst.iter().all(|error| *error < 0.02), "{worst:?}");
}

#[test]
fn pictures_of_dots_stand_in_the_place_of_kernels() {
    let folder = tempfile::tempdir().unwrap();
    let (width, height) = (240, 180);
    let write = |name: &str, height: usize, code: &dyn Fn(usize, usize) -> f64| {
        let codes: Vec<u16> = (0..width * height)
            .map(|i| code(i % width, i / width) as u16)
            .collect();
        let path = folder.path().join(name);
        let bytes = encode_gray16(&path, &codes, width, height).unwrap();
        std::fs::write(path, bytes).unwrap();
    };
    for (side, lean) in [("left", -0.05), ("right", 0.05)] {
        write(&format!("s_{side}.png"), height, &|x, _| {
            8001.0 + 3.0 * x as f64
        });
        // Disks of 15 px, 40 px apart, brighter to one side.
        let dot = |x: usize, y: usize| {
            let beside = |c: usize| c as f64 - 20.0 - ((c as f64 - 20.0) / 40.0).round() * 40.0;
            let (x, y) = (beside(x), beside(y));
            let edge = 1.0 / (1.0 + ((x.hypot(y) - 7.5) / 0.8).exp());
            1300.0 + 6001.0 * edge * (1.0 + lean * x)
        };
        write(&format!("d_{side}.png"), height, &dot);
        write(&format!("low_{side}.png"), height - 20, &dot);
    }
    let toml = EXAMPLE_TOML.replace("white_sheet", "s");
    let kernels = toml.find("[kernels]").unwrap();
    let sheet = toml.find("[sheet]").unwrap();
    let dots = |name: &str| {
        let part = format!(
            "[dots]\nleft = \"{name}_left.png\"\nright = \"{name}_right.png\"\ngrid = [2, 2]\nfield_px = 90\n"
        );
        let text = format!("{}{part}{}", &toml[..kernels], &toml[sheet..]);
        std::fs::write(folder.path().join("capture.toml"), text).unwrap();
        measured(folder.path())
    };
    let found = dots("d").unwrap();
    // Windows of 1.6 times 15 px.
    assert_eq!((found.fields.len(), found.side), (4, 2 * 12 + 1));
    for field in &found.fields {
        let [left, right] =
            [0, 1].map(|k| super::measurements::centroid_px(&field.views[k], found.side));
        // a ⟨r²⟩/2 either way; of the soft disk ⟨r²⟩/2 = 16.68 (by quadrature; 7.5²/4 = 14.06 of a sharp one).
        let apart = right[0] - left[0];
        assert!(
            (apart - 2.0 * 0.05 * 16.68).abs() < 0.02,
            "{left:?} {right:?}"
        );
        assert!((right[1] - left[1]).abs() < 0.02);
    }
    assert!(
        dots("low")
            .unwrap_err()
            .contains("160 px, but the sheets are 240 × 180")
    );
    // Both, a sheet alone, or nothing.
    for (text, said) in [
        (
            format!("{toml}\n[dots]\nleft = \"a\"\nright = \"b\"\ngrid = [2, 2]\nfield_px = 90\n"),
            "[kernels] and [dots]",
        ),
        (
            format!("{}{}", &toml[..kernels], &toml[sheet..]),
            "one of kernels (or dots) and sheets",
        ),
        (toml[..kernels].to_owned(), "has nothing to fit"),
    ] {
        std::fs::write(folder.path().join("capture.toml"), text).unwrap();
        let why = measured(folder.path()).unwrap_err();
        assert!(why.contains(said), "{why}");
    }
}

/// At normal incidence halves are alike under a centred lens, and mirrored places mirror the law.
#[test]
fn the_law_of_a_camera_file_counts_from_where_the_halves_are_alike() {
    let (model, parameters) = (model(), parameters());
    let mut values: Vec<f64> = parameters.iter().map(|p| p.prior).collect();
    values[Name::ShiftUm as usize] = 0.06;
    values[Name::Shift1 as usize] = -0.05;
    let set = model.at(&values).unwrap();
    // The points of the pupil, of which there are few here, are not mirrored.
    let middle = set.beside_balance_um(0.0);
    assert!((middle - 0.06).abs() < 5e-3, "{middle}");
    let odd = |x: f64| set.beside_balance_um(x) - 0.06;
    assert!(
        (odd(1.5) + odd(-1.5)).abs() < 1e-2,
        "{} {}",
        odd(1.5),
        odd(-1.5)
    );
    let fitted = Fitted {
        parameters: parameters.clone(),
        values: values.clone(),
        covariance: vec![0.0; values.len() * values.len()],
        noise: settings(1).noise,
        steps: 0,
    };
    let file = camera_file(&example(), &model, &fitted, 2.0).unwrap();
    // Its polynomial is what it is fitted to.
    for x in [-2.0, -1.0, 0.0, 0.7, 1.9] {
        let law = file.microlenses.at_um(glam::DVec2::new(x, 0.0)).x;
        assert!((law - set.beside_balance_um(x)).abs() < 5e-3, "{x}: {law}");
    }
    // As it is written, it is read.
    let text = toml::to_string(&file).unwrap();
    assert_eq!(toml::from_str::<CameraFile>(&text).unwrap(), file);
}
