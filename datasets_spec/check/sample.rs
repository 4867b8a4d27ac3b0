//! Checks one sample: its description, the list of its files, and that each can be read as described.

use std::collections::{BTreeMap, BTreeSet};

use super::report::{Contents, Depth, Report};
use super::{camera_pictures, mosaic, pixels};

use crate::camera_description::{CameraDescription, RawFormat};
use crate::layout::{Optional, sample_files};
use crate::load::{Planes, decode};
use crate::manifest::{FileEntry, SampleEntry};
use crate::sample::{FileKind, SampleFile, SampleMeta, Storage};
use crate::{parse, paths};

/// Lengths, F-numbers and levels of cameras, whatever their unit.
const PLAUSIBLE: std::ops::RangeInclusive<f64> = 1e-9..=1e12;

/// Adds to `report` what is wrong with a sample, and gives the hash of its configuration. `listed` is what
/// `dataset.json` says of its files, `contents` what was read of them.
pub(super) fn check(
    entry: &SampleEntry,
    folder: &str,
    listed: &[(&str, &FileEntry)],
    contents: &Contents,
    depth: Depth,
    report: &mut Report,
) -> Option<String> {
    let six_digits = entry.id.len() == 6 && entry.id.bytes().all(|b| b.is_ascii_digit());
    if !six_digits {
        report.add(
            paths::DATASET,
            format!("sample {:?} is not named by six digits", entry.id),
        );
    }
    let meta_path = format!("{folder}/{}", paths::META);
    let meta: SampleMeta = match contents.get(paths::META) {
        None => {
            report.add(&meta_path, "is not listed in dataset.json");
            return None;
        }
        Some(None) => return None,
        Some(Some(bytes)) => match parse(bytes) {
            Ok(meta) => meta,
            Err(why) => {
                report.add(&meta_path, why.to_string());
                return None;
            }
        },
    };
    check_meta(&meta, entry, &meta_path, report);
    check_contents(&meta, listed, &meta_path, report);
    check_camera(&meta, folder, contents, report);
    let configuration = Some(meta.configuration_blake3.clone());
    let names: BTreeSet<&str> = meta.files.iter().map(|file| file.name.as_str()).collect();
    for name in contents.keys() {
        if ![paths::META, paths::CAMERA].contains(&name.as_str()) && !names.contains(name.as_str())
        {
            report.add(&format!("{folder}/{name}"), "is not listed in meta.json");
        }
    }
    if !check_list(&meta, &meta_path, report) {
        return configuration; // without the right list there is nothing to hold the pictures to
    }
    if depth == Depth::Hashes {
        return configuration;
    }
    let mut pictures = BTreeMap::new();
    for file in &meta.files {
        let path = format!("{folder}/{}", file.name);
        match contents.get(&file.name) {
            None => report.add(&path, "is listed in meta.json but not in dataset.json"),
            Some(None) => {}
            Some(Some(bytes)) => match decode(&file.name, bytes) {
                Err(cause) => report.add(&path, format!("cannot be decoded: {cause}")),
                Ok(planes) => {
                    if let Some(what) = mismatch(file, &planes) {
                        report.add(&path, what);
                    } else {
                        pictures.insert(file.kind, planes);
                    }
                }
            },
        }
    }
    let findings = pixels::check(&meta, &pictures).into_iter();
    let findings = findings.chain(mosaic::check(&meta, &pictures));
    for (kind, what) in findings.chain(camera_pictures::check(&meta, &pictures)) {
        let name = kind.file_name(meta.raw.format);
        report.add(&format!("{folder}/{name}"), what);
    }
    configuration
}

/// Lengths and hashes are those of `dataset.json`: one for every listed file, in their order.
fn check_contents(
    meta: &SampleMeta,
    listed: &[(&str, &FileEntry)],
    path: &str,
    report: &mut Report,
) {
    let described = meta.contents.iter().map(|entry| entry.path.as_str());
    let pictures = meta.files.iter().map(|file| file.name.as_str());
    let mut names: Vec<&str> = pictures.chain([paths::CAMERA]).collect();
    names.sort_unstable();
    if !described.eq(names) {
        report.add(
            path,
            "contents: not one entry per file and camera.json, in the order of their names",
        );
    }
    for own in &meta.contents {
        let known = listed.iter().find(|(name, _)| *name == own.path);
        if known.is_some_and(|(_, e)| (e.bytes, &e.blake3) != (own.bytes, &own.blake3)) {
            let what = format!("contents: {} differs from dataset.json", own.path);
            report.add(path, what);
        }
    }
}

/// `camera.json` follows the schema and says of the camera what `meta.json` says.
fn check_camera(meta: &SampleMeta, folder: &str, contents: &Contents, report: &mut Report) {
    let path = format!("{folder}/{}", paths::CAMERA);
    let camera: CameraDescription = match contents.get(paths::CAMERA) {
        None => return report.add(&path, "is not listed in dataset.json"),
        Some(None) => return, // reported with the hashes
        Some(Some(bytes)) => match parse(bytes) {
            Ok(camera) => camera,
            Err(why) => return report.add(&path, why.to_string()),
        },
    };
    if camera != meta.camera(camera.curves()) {
        report.add(&path, "differs from meta.json in a field that both have");
    }
    let subpixels = meta.sensor.subpixels;
    let ratio = &camera.disparity_ratio;
    let curves = &camera.disparity;
    let unsound = (curves.left_right.iter().chain(&curves.top_bottom)).any(|c| !c.is_sound());
    if unsound {
        report.add(
            &path,
            "disparity: a curve has not finite coefficients at each of its nodes",
        );
    }
    if camera.blur.as_ref().is_some_and(|rays| !rays.is_sound()) {
        report.add(
            &path,
            "blur: lists of unequal length, or numbers that are none",
        );
    }
    let fields = [
        ("left_right", &ratio.left_right, subpixels.m()),
        ("top_bottom", &ratio.top_bottom, subpixels.n()),
    ];
    for (name, field, parts) in fields {
        let sound = match field {
            Some(field) => parts > 1 && field.is_sound(),
            None => true,
        };
        if !sound {
            let what = "has not one value per node, or belongs to a pixel of one part";
            report.add(&path, format!("disparity_ratio.{name} {what}"));
        }
    }
}

fn check_meta(meta: &SampleMeta, entry: &SampleEntry, path: &str, report: &mut Report) {
    if meta.id != entry.id {
        report.add(
            path,
            format!("is of sample {:?}, not {:?}", meta.id, entry.id),
        );
    }
    if meta.scene.id != entry.scene {
        let what = format!(
            "shows scene {:?}, dataset.json says {:?}",
            meta.scene.id, entry.scene
        );
        report.add(path, what);
    }
    let positive = [
        ("lens.efl_mm", meta.lens.efl_mm),
        ("lens.f_number", meta.lens.f_number),
        ("sensor.pitch_um", meta.sensor.pitch_um),
        ("intrinsics.fx_px", meta.intrinsics.fx_px),
        ("intrinsics.fy_px", meta.intrinsics.fy_px),
        (
            "intrinsics.entrance_pupil_diameter_m",
            meta.intrinsics.entrance_pupil_diameter_m,
        ),
        ("focus.distance_m", meta.focus.distance_m.unwrap_or(1.0)),
        (
            "raw.linear_at_white",
            meta.raw.linear_at_white.unwrap_or(1.0),
        ),
    ];
    for (field, value) in positive {
        if value <= 0.0 {
            report.add(path, format!("{field} is {value}, it must be above 0"));
        } else if !PLAUSIBLE.contains(&value) {
            let (least, most) = (PLAUSIBLE.start(), PLAUSIBLE.end());
            report.add(
                path,
                format!("{field} is {value:e}, allowed are {least:e} to {most:e}"),
            );
        }
    }
    let levels = (
        meta.raw.black_level,
        meta.raw.white_level,
        meta.raw.linear_at_white,
    );
    let fits = match (meta.raw.format, levels) {
        (RawFormat::Png, (Some(black), Some(white), Some(_))) => black < white,
        (RawFormat::Exr, (None, None, None)) => true,
        _ => false,
    };
    check_readout(meta, path, report);
    if let Some(what) = mosaic::check_levels(meta) {
        report.add(path, what);
    }
    if let Some(what) = camera_pictures::check_description(meta) {
        report.add(path, what);
    }
    if !fits {
        report.add(
            path,
            "raw: a PNG has black level < white level and linear_at_white, an EXR none of them",
        );
    }
}

fn check_readout(meta: &SampleMeta, path: &str, report: &mut Report) {
    let Some(readout) = meta.noise.readout() else {
        return;
    };
    let positive = [
        ("photons_um2", readout.photons_um2),
        ("quantum_efficiency", readout.quantum_efficiency),
        ("electrons_at_white", readout.electrons_at_white),
        ("full_well_e", readout.full_well_e),
        ("gain_dn_per_e", readout.gain_dn_per_e),
    ];
    for (field, value) in positive {
        if value <= 0.0 {
            let what = format!("noise.readout.{field} is {value}, it must be above 0");
            report.add(path, what);
        }
    }
    let (bits, black) = (readout.bits, u32::from(readout.black_level));
    if !(2..=16).contains(&bits) || black >= (1 << bits) - 1 {
        let what = "noise.readout: bits are 2 to 16, and the black level is below the largest code";
        report.add(path, what);
    }
    let count = meta.sensor.subpixels.count();
    if readout.subpixel_gains.len() != count {
        let given = readout.subpixel_gains.len();
        let what = format!("noise.readout has {given} sub-pixel gains for {count} sub-pixels");
        report.add(path, what);
    }
}

/// The list is that of the layout; then it can be trusted below.
fn check_list(meta: &SampleMeta, path: &str, report: &mut Report) -> bool {
    let sensor = &meta.sensor;
    let limits = [
        ("sensor.width_px", sensor.width_px, 1 << 16),
        ("sensor.height_px", sensor.height_px, 1 << 16),
        (
            "sensor.subpixels (columns)",
            sensor.subpixels.m() as u32,
            16,
        ),
        ("sensor.subpixels (rows)", sensor.subpixels.n() as u32, 16),
    ];
    let mut sound = true;
    for (field, value, most) in limits {
        if !(1..=most).contains(&value) {
            report.add(path, format!("{field} is {value}, allowed are 1 to {most}"));
            sound = false;
        }
    }
    let colours: Vec<&str> = meta.channels.iter().map(|c| c.name.as_str()).collect();
    if colours != ["R", "G", "B"] && colours != ["Y"] {
        report.add(
            path,
            format!("channels are {colours:?}, allowed are R, G, B or Y"),
        );
        sound = false;
    }
    if !sound {
        return false;
    }
    let has = |kind| {
        meta.files
            .iter()
            .find(|file: &&SampleFile| file.kind == kind)
    };
    let sheet = has(FileKind::Preview).map_or([0, 0], |file| [file.width, file.height]);
    let optional = Optional {
        channels_differ: meta.truth.channels_differ,
        world: has(FileKind::Objects).is_some() || has(FileKind::Normal).is_some(),
        noisy: meta.noise.readout().is_some(),
        mosaic: meta.mosaic.is_some(),
        camera: (meta.camera_pictures.as_ref())
            .map(|pictures| FileKind::camera_pictures(pictures.jpeg_quality.is_some())),
        bright: has(FileKind::Views).is_some_and(|file| file.storage == Storage::Float),
    };
    let raw = meta.raw.format;
    if meta.files == sample_files(sensor, &meta.channels, raw, optional, sheet) {
        return true;
    }
    report.add(
        path,
        "files: not the files, sizes, channels and number formats of SPEC.md for this sensor",
    );
    false
}

fn mismatch(file: &SampleFile, planes: &Planes) -> Option<String> {
    if (planes.width, planes.height) != (file.width as usize, file.height as usize) {
        return Some(format!(
            "is {} × {}, meta.json says {} × {}",
            planes.width, planes.height, file.width, file.height
        ));
    }
    let names: Vec<&String> = planes.channels.keys().collect();
    if !names.iter().copied().eq(file.channels.iter()) {
        return Some(format!(
            "has channels {names:?}, meta.json says {:?}",
            file.channels
        ));
    }
    (planes.storage != file.storage).then(|| {
        format!(
            "stores {:?}, meta.json says {:?}",
            planes.storage, file.storage
        )
    })
}
