//! Planes at known distances, from their pictures to what is found by them.

use quadpixel::image::raster::encode_gray16;

use super::camera_model::CameraModel;
use super::measurements::{Measurements, PlaneBlock, PlaneShifts};
use super::parameters::{Known, LAYERS, Name};
use super::tests::{KNOWN, measured, model, settings};

/// Shifts of planes before and behind the focus, at two stops, by the model at these values.
fn plane_shifts(model: &CameraModel, values: &[f64]) -> Vec<PlaneShifts> {
    let planes = [(250.0, 1.0), (600.0, 1.0), (250.0, 2.0)];
    let set = model.at(values).unwrap();
    let plane = |(distance_mm, stop): (f64, f64)| {
        let mut plane = PlaneShifts {
            distance_mm,
            stop,
            wavelength_nm: 550.0,
            held_out: false,
            width_mm: 4.0,
            window_px: 230.0,
            blocks: Vec::new(),
        };
        let places = (0..10).map(|i| [0.8 * f64::from(i % 5) - 1.6, f64::from(i / 5) - 0.5]);
        plane.blocks = places
            .map(|place_mm| PlaneBlock {
                place_mm,
                shift_px: set.plane_shift_px(&plane, place_mm),
                sigma_px: 0.01,
            })
            .collect();
        plane
    };
    planes.map(plane).to_vec()
}

#[test]
fn a_camera_is_found_by_planes_alone() {
    let known = Known {
        focus_mm: Some(350.0),
        has_kernels: false,
        pupil_mm: Some(5.5),
        ..KNOWN
    };
    let (model, mut parameters) = (model(), known.parameters());
    for name in LAYERS {
        parameters[name as usize].sigma = 0.0;
    }
    let mut truth: Vec<f64> = parameters.iter().map(|p| p.prior).collect();
    let changed = [
        (Name::FocusMm, 362.0),
        (Name::DiffusionUm, 0.2),
        (Name::ShiftUm, 0.05),
        (Name::Shift1, -0.06),
    ];
    for (name, value) in changed {
        truth[name as usize] = value;
    }
    let mut measured = Measurements::of_planes(2.8);
    measured.planes = plane_shifts(&model, &truth);
    // Near points lie farther right in the left view, far ones farther left; a stop down shifts less.
    let middle = |k: usize| measured.planes[k].blocks[2].shift_px;
    assert!(
        middle(0) > 0.3 && middle(1) < -0.2,
        "{} {}",
        middle(0),
        middle(1)
    );
    assert!(
        (0.05..0.6).contains(&(middle(2) / middle(0))),
        "{}",
        middle(2)
    );
    let found = super::fit(&model, &measured, &parameters, Some(settings(1).noise), &()).unwrap();
    let sigmas = found.sigmas();
    for (name, value) in changed {
        let off = (found.values[name as usize] - value) / sigmas[name as usize];
        assert!(
            off.abs() < 1.0,
            "{name:?}: {} for {value}",
            found.values[name as usize]
        );
    }
    let sharp = sigmas[Name::FocusMm as usize] / parameters[Name::FocusMm as usize].sigma;
    assert!(sharp < 0.5, "{sharp}");
    // What they say nothing of stays, and the table says so.
    let table = found.table();
    assert!(
        !table[Name::ComaPx as usize].held_by_data && !table[Name::RadiusUm as usize].held_by_data
    );
    let predicted = super::prediction::Prediction::new(&model, &found.values, &measured).unwrap();
    for [measured, predicted] in predicted.planes[0].thirds.iter().flatten() {
        assert!(
            (predicted / measured - 1.0).abs() < 0.02,
            "{predicted} {measured}"
        );
    }
    measured.planes.truncate(1);
    measured.planes[0].blocks.truncate(3);
    let few = measured.check().unwrap_err().to_string();
    assert!(few.contains("3 windows of planes"), "{few}");
}

#[test]
fn planes_of_pictures_are_measured_and_what_cannot_be_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, width: usize, shift: f64, depth: f64| {
        let code = |i: usize| {
            let (x, y) = ((i % width) as f64 - shift, (i / width) as f64);
            let wave = (0.31 * x + 0.2 * y).sin() + (0.17 * x - 0.4 * y).cos();
            (20000.0 + 8000.0 * depth * wave) as u16
        };
        let path = folder.path().join(name);
        let bytes = encode_gray16(
            &path,
            &(0..width * 200).map(code).collect::<Vec<_>>(),
            width,
            200,
        );
        std::fs::write(&path, bytes.unwrap()).unwrap();
    };
    write("left.png", 300, 0.4, 1.0);
    write("right.png", 300, -0.4, 1.0);
    write("small.png", 240, -0.4, 1.0);
    write("flat.png", 300, 0.0, 0.0);
    let camera = "[camera]\nname = \"a\"\nfocal_length_mm = 50\nf_number = 2\npitch_um = 6\nwavelength_nm = 550\n";
    let with = |focus: &str, left: &str, right: &str, rest: &str| {
        let text = format!(
            "{camera}{focus}\n[views]\npixel_um = 12\n[[plane]]\nleft = \"{left}.png\"\nright = \"{right}.png\"\n{rest}\n"
        );
        std::fs::write(folder.path().join("capture.toml"), text).unwrap();
        measured(folder.path())
    };
    let focus = "focus_mm = 1000";
    let found = with(focus, "left", "right", "distance_mm = 700\nf_number = 4").unwrap();
    let plane = &found.planes[0];
    assert_eq!(
        (plane.stop, plane.blocks.len(), found.fields.len()),
        (2.0, 18, 0)
    );
    let off = |b: &PlaneBlock| (b.shift_px - 0.8).abs() > 3.0 * b.sigma_px;
    assert!(!plane.blocks.iter().any(off), "{:?}", plane.blocks);
    assert!((plane.width_mm - 3.6).abs() < 1e-9);
    let refused = |found: Result<Measurements, String>, said: &str| {
        let error = found.unwrap_err();
        assert!(error.contains(said), "{error}");
    };
    let near = "distance_mm = 700";
    refused(
        with("", "left", "right", near),
        "camera.focus_mm is missing",
    );
    refused(with(focus, "right", "left", near), "views in their order");
    refused(
        with(focus, "left", "small", near),
        "240 × 200 px, and the left picture is 300 × 200 px",
    );
    refused(with(focus, "flat", "flat", near), "no shift is found");
    refused(
        with(focus, "left", "right", "distance_mm = 150"),
        "plane.distance_mm is 150",
    );
    refused(
        with(focus, "left", "right", "distance_mm = 700\nf_number = 1.4"),
        "plane.f_number is 1.4",
    );
    refused(with(focus, "left", "absent", near), "absent.png");
    let other = with(
        focus,
        "left",
        "right",
        "distance_mm = 700\nwavelength_nm = 465",
    );
    refused(other, "0 windows of planes");
}

#[test]
fn shifts_that_another_program_found_are_taken_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let camera = "[camera]\nname = \"a\"\nfocal_length_mm = 50\nf_number = 2\npitch_um = 6\nwavelength_nm = 550\n";
    let seen = |pixel_um: f64, plane: &str| {
        let text = format!(
            "{camera}focus_mm = 1000\n[views]\npixel_um = {pixel_um}\n[[plane]]\ndistance_mm = 700\n{plane}\n"
        );
        std::fs::write(folder.path().join("capture.toml"), text).unwrap();
        measured(folder.path())
    };
    let with = |plane: &str| seen(12.0, plane);
    let shifts =
        "[[-8, 0, 0.6, 0.02], [-3, 1.5, 0.8, 0.01], [3, -1.5, 0.8, 0.01], [7, 0, 0.5, 0.02]]";
    let found = with(&format!("shifts = {shifts}\nwindow_px = 80")).unwrap();
    let plane = &found.planes[0];
    assert_eq!((plane.window_px, plane.width_mm), (80.0, 16.0));
    let second = PlaneBlock {
        place_mm: [-3.0, 1.5],
        shift_px: 0.8,
        sigma_px: 0.01,
    };
    assert_eq!((plane.blocks.len(), plane.blocks[1]), (4, second));
    let below_the_pitch = seen(3.0, &format!("shifts = {shifts}")).unwrap_err();
    assert!(
        below_the_pitch.contains("views.pixel_um is 3"),
        "{below_the_pitch}"
    );
    let negative = shifts
        .replace("0.6", "-0.6")
        .replace("0.8", "-0.8")
        .replace("0.5", "-0.5");
    for (plane, said) in [
        (
            format!("shifts = {shifts}\nleft = \"a.png\""),
            "neither both views nor",
        ),
        (String::new(), "neither both views nor"),
        ("left = \"a.png\"".into(), "neither both views nor"),
        (
            format!("shifts = {}", shifts.replace("0.02", "0")),
            "plane.shifts is 0",
        ),
        (
            format!("shifts = {}", shifts.replace("0.6", "nan")),
            "plane.shifts is NaN",
        ),
        (
            format!("shifts = {shifts}\nwindow_px = 1"),
            "plane.window_px is 1",
        ),
        ("shifts = [[0, 0, 1]]".into(), "capture.toml"),
        (format!("shifts = {negative}"), "views in their order"),
    ] {
        let error = with(&plane).unwrap_err();
        assert!(error.contains(said), "{plane}: {error}");
    }
}

#[test]
fn planes_beside_kernels_and_a_sheet_tell_the_focus() {
    let known = Known {
        focus_mm: Some(350.0),
        ..KNOWN
    };
    let open = [Name::FocusMm, Name::ShiftUm, Name::DefocusPx, Name::BlurPx];
    let (model, mut parameters) = (model(), known.parameters());
    for (i, parameter) in parameters.iter_mut().enumerate() {
        if open.iter().all(|name| *name as usize != i) {
            parameter.sigma = 0.0;
        }
    }
    let mut truth: Vec<f64> = parameters.iter().map(|p| p.prior).collect();
    truth[Name::FocusMm as usize] = 341.0;
    truth[Name::ShiftUm as usize] = -0.06;
    let mut measured = super::truth::simulated(&model, &truth, &settings(1), 2.8, Some(1)).unwrap();
    measured.planes = plane_shifts(&model, &truth);
    // Red is not fitted; its shifts here are green's, which the pixel in red has not.
    let mut red = measured.planes[0].clone();
    (red.wavelength_nm, red.held_out) = (610.0, true);
    measured.planes.push(red);
    let found = super::fit(&model, &measured, &parameters, None, &()).unwrap();
    let sigmas = found.sigmas();
    for name in [Name::FocusMm, Name::ShiftUm] {
        let (value, wanted) = (found.values[name as usize], truth[name as usize]);
        let off = (value - wanted) / sigmas[name as usize];
        assert!(off.abs() < 3.0, "{name:?}: {value} for {wanted}");
    }
    assert!(sigmas[Name::FocusMm as usize] < 3.0, "{sigmas:?}");
    let predicted = super::prediction::Prediction::new(&model, &found.values, &measured).unwrap();
    let goals = predicted.goals();
    assert_eq!(goals.len(), 11, "ten of kernels and sheet, and red");
    assert!(
        goals[10].what.contains("610 nm") && goals[10].found > 0.005,
        "{:?}",
        goals[10]
    );
    measured.hold_out_nothing(550.0);
    let out: Vec<bool> = measured.planes.iter().map(|p| p.held_out).collect();
    assert_eq!(out, [false, false, false, true]);
    assert!(!measured.fields.iter().any(|f| f.held_out));
}
