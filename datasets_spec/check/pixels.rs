//! The rules on pixel values: ranges, NaN exactly where `valid.png` is 0, views that add up to the sum, and the raw
//! mosaic that holds the views.
//!
//! Rounding allowed: half precision ½ ulp of each number (2⁻¹¹ relative, 2⁻²⁵ absolute), the mosaic's 16-bit code ½
//! step.

use std::collections::BTreeMap;

use crate::camera_description::RawFormat;
use crate::layout::SUM_LAYER;
use crate::load::Planes;
use crate::readout::Readout;
use crate::sample::{FileKind, SampleMeta};

const HALF_RELATIVE: f64 = 1.0 / 2048.0;
const HALF_ABSOLUTE: f64 = 1.0 / 33_554_432.0;
/// The f32 arithmetic of the writer.
const FLOAT_RELATIVE: f64 = 1e-6;

/// What is wrong with the pictures, by file. Pictures that could not be read are left out, and so are the rules on
/// them.
pub(super) fn check(
    meta: &SampleMeta,
    pictures: &BTreeMap<FileKind, Planes>,
) -> Vec<(FileKind, String)> {
    let mut findings = Vec::new();
    for kind in [
        FileKind::Raw,
        FileKind::Views,
        FileKind::Target,
        FileKind::Shading,
    ] {
        each_channel(
            pictures,
            kind,
            &mut findings,
            "negative or not finite",
            |_, v| v >= 0.0 && v.is_finite(),
        );
    }
    if let Some(valid) = pictures.get(&FileKind::Valid) {
        each_channel(
            pictures,
            FileKind::Valid,
            &mut findings,
            "neither 0 nor 255",
            |_, v| v == 0.0 || v == 255.0,
        );
        let mask: Vec<bool> = valid.channels["Y"].iter().map(|v| *v != 0.0).collect();
        truth(pictures, &mask, &mut findings);
        let invalid = mask.iter().filter(|valid| !**valid).count() as u64;
        if invalid != meta.statistics.invalid_pixels {
            let said = meta.statistics.invalid_pixels;
            let what = format!("has {invalid} pixels at 0, meta.json says {said}");
            findings.push((FileKind::Valid, what));
        }
    }
    let (depth, distance) = (
        pictures.get(&FileKind::Depth),
        pictures.get(&FileKind::Distance),
    );
    if let (Some(depth), Some(_)) = (depth, distance) {
        let depth = &depth.channels["Z"];
        let what = "less than the depth";
        each_channel(pictures, FileKind::Distance, &mut findings, what, |i, v| {
            let least = f64::from(depth[i]) * (1.0 - FLOAT_RELATIVE);
            least.is_nan() || v.is_nan() || f64::from(v) >= least
        });
    }
    seen(pictures, &mut findings);
    if let Some(views) = pictures.get(&FileKind::Views) {
        sums(meta, FileKind::Views, views, &mut findings);
        if let Some(raw) = pictures.get(&FileKind::Raw) {
            mosaic(meta, views, raw, &mut findings);
        }
    }
    if let Some(readout) = meta.noise.readout() {
        noisy(meta, readout, pictures, &mut findings);
    }
    findings
}

fn truth(
    pictures: &BTreeMap<FileKind, Planes>,
    mask: &[bool],
    findings: &mut Vec<(FileKind, String)>,
) {
    use FileKind as K;
    for kind in [
        K::Depth,
        K::Distance,
        K::Disparity,
        K::Coc,
        K::Shifts,
        K::Normal,
    ] {
        each_channel(
            pictures,
            kind,
            findings,
            "a number where valid.png is 0 (must be NaN)",
            |i, v| mask[i] || v.is_nan(),
        );
        each_channel(
            pictures,
            kind,
            findings,
            "NaN where valid.png is 255",
            |i, v| !(mask[i] && v.is_nan()),
        );
    }
    for kind in [K::Depth, K::Distance] {
        let what = "not above 0 (+inf is the sky)";
        each_channel(pictures, kind, findings, what, |_, v| v.is_nan() || v > 0.0);
    }
    for kind in [K::Disparity, K::Coc, K::Shifts] {
        each_channel(pictures, kind, findings, "infinite", |_, v| {
            !v.is_infinite()
        });
    }
}

/// Objects and normals agree with the depth: 65535 and (0, 0, 0) exactly where nothing is met, else a unit vector.
fn seen(pictures: &BTreeMap<FileKind, Planes>, findings: &mut Vec<(FileKind, String)>) {
    let Some(depth) = pictures.get(&FileKind::Depth) else {
        return;
    };
    let met = |i: usize| depth.channels["Z"][i].is_finite();
    let what = "not 65535 exactly where nothing is met";
    each_channel(pictures, FileKind::Objects, findings, what, |i, v| {
        (v != 65535.0) == met(i)
    });
    let Some(normal) = pictures.get(&FileKind::Normal) else {
        return;
    };
    let [x, y, z] = ["X", "Y", "Z"].map(|name| &normal.channels[name]);
    let bad = (0..x.len()).filter(|&i| {
        let square = [x, y, z]
            .map(|c| f64::from(c[i]).powi(2))
            .iter()
            .sum::<f64>();
        let expected = f64::from(u8::from(met(i)));
        // NaN, where nothing is valid, has its own rule.
        (square - expected).abs() > 1e-4
    });
    if let Some(text) = places(bad, normal.width, "X, Y, Z") {
        let what = format!("{text} no unit vector (or not 0 where nothing is met)");
        findings.push((FileKind::Normal, what));
    }
}

/// Adds one finding for a channel in which `good(index, value)` fails: how often, and where first.
fn each_channel(
    pictures: &BTreeMap<FileKind, Planes>,
    kind: FileKind,
    findings: &mut Vec<(FileKind, String)>,
    what: &str,
    good: impl Fn(usize, f32) -> bool,
) {
    let Some(planes) = pictures.get(&kind) else {
        return;
    };
    for (name, values) in &planes.channels {
        let bad = (0..values.len()).filter(|&i| !good(i, values[i]));
        if let Some(text) = places(bad, planes.width, name) {
            findings.push((kind, format!("{text} {what}")));
        }
    }
}

/// How many of a channel's pixels are bad, and where the first lies; `None` if none is.
pub(super) fn places(
    bad: impl Iterator<Item = usize>,
    width: usize,
    channel: &str,
) -> Option<String> {
    let mut bad = bad.peekable();
    let first = *bad.peek()?;
    let (x, y) = (first % width, first / width);
    let count = bad.count();
    Some(format!(
        "channel {channel}: {count} pixels, the first at column {x}, row {y}, are"
    ))
}

fn colours(meta: &SampleMeta) -> impl Iterator<Item = &str> {
    meta.channels.iter().map(|channel| channel.name.as_str())
}

fn sums(meta: &SampleMeta, kind: FileKind, views: &Planes, findings: &mut Vec<(FileKind, String)>) {
    let names = meta.sensor.subpixels.names();
    for colour in colours(meta) {
        let parts: Vec<&Vec<f32>> = names
            .iter()
            .filter_map(|name| views.channels.get(&format!("{name}.{colour}")))
            .collect();
        let channel = format!("{SUM_LAYER}.{colour}");
        let Some(sum) = views.channels.get(&channel) else {
            continue;
        };
        let bad = (0..sum.len()).filter(|&i| {
            let total: f64 = parts.iter().map(|part| f64::from(part[i])).sum();
            let size: f64 = parts.iter().map(|part| f64::from(part[i].abs())).sum();
            let allowed = (HALF_RELATIVE + FLOAT_RELATIVE) * (size + f64::from(sum[i].abs()))
                + HALF_ABSOLUTE * (parts.len() + 1) as f64;
            (total - f64::from(sum[i])).abs() > allowed
        });
        if let Some(text) = places(bad, views.width, &channel) {
            findings.push((kind, format!("{text} not the sum of the views")));
        }
    }
}

fn mosaic(meta: &SampleMeta, views: &Planes, raw: &Planes, findings: &mut Vec<(FileKind, String)>) {
    let (columns, rows) = (meta.sensor.subpixels.m(), meta.sensor.subpixels.n());
    let names = meta.sensor.subpixels.names();
    let png = meta.raw.format == RawFormat::Png;
    let black = f64::from(meta.raw.black_level.unwrap_or(0));
    let white = f64::from(meta.raw.white_level.unwrap_or(1));
    let step = meta.raw.linear_at_white.unwrap_or(1.0) / (white - black);
    // Values at the largest code, and those of them whose view is above it for certain.
    let (mut largest, mut above) = (0u64, 0u64);
    for colour in colours(meta) {
        let Some(codes) = raw.channels.get(colour) else {
            continue;
        };
        largest += codes.iter().filter(|code| png && **code == 65535.0).count() as u64;
        let bad = (0..codes.len()).filter(|&i| {
            let (x, y) = (i % raw.width, i / raw.width);
            let name = &names[(y % rows) * columns + x % columns];
            let Some(view) = views.channels.get(&format!("{name}.{colour}")) else {
                return false;
            };
            let view = f64::from(view[(y / rows) * views.width + x / columns]);
            let code = f64::from(codes[i]);
            let half = HALF_RELATIVE * view + HALF_ABSOLUTE;
            if !png {
                return (code - view).abs() > 2.0 * half;
            }
            let allowed = 0.5 * step + half + FLOAT_RELATIVE * view;
            let linear = (code - black) * step;
            let clipped_above = code == 65535.0 && view >= linear - allowed;
            above += u64::from(clipped_above && view > linear + allowed);
            let clipped_below = code == 0.0 && view <= linear + allowed;
            !(clipped_above || clipped_below) && (linear - view).abs() > allowed
        });
        if let Some(text) = places(bad, raw.width, colour) {
            findings.push((FileKind::Raw, format!("{text} not the views' values")));
        }
    }
    let said = meta.raw.clipped;
    if above > said || largest < said {
        let what = format!(
            "has {largest} values at the largest code, {above} of them below their views; meta.json says that {said} were clipped"
        );
        findings.push((FileKind::Raw, what));
    }
}

/// Codes that the converter has, views that are their linear values, and a sum.
fn noisy(
    meta: &SampleMeta,
    readout: &Readout,
    pictures: &BTreeMap<FileKind, Planes>,
    findings: &mut Vec<(FileKind, String)>,
) {
    let kind = FileKind::Noisy;
    let top = f32::from(readout.largest_code());
    let what = "above the converter's largest code";
    each_channel(pictures, kind, findings, what, |_, code| code <= top);
    let kind = FileKind::NoisyViews;
    each_channel(pictures, kind, findings, "not finite", |_, v| v.is_finite());
    let Some(views) = pictures.get(&kind) else {
        return;
    };
    sums(meta, kind, views, findings);
    let Some(codes) = pictures.get(&FileKind::Noisy) else {
        return;
    };
    let (columns, rows) = (meta.sensor.subpixels.m(), meta.sensor.subpixels.n());
    let names = meta.sensor.subpixels.names();
    for colour in colours(meta) {
        let Some(own) = codes.channels.get(colour) else {
            continue;
        };
        let bad = (0..own.len()).filter(|&i| {
            let (x, y) = (i % codes.width, i / codes.width);
            let name = &names[(y % rows) * columns + x % columns];
            let Some(view) = views.channels.get(&format!("{name}.{colour}")) else {
                return false;
            };
            let view = f64::from(view[(y / rows) * views.width + x / columns]);
            let linear = readout.linear(f64::from(own[i]));
            let allowed = (HALF_RELATIVE + FLOAT_RELATIVE) * linear.abs() + HALF_ABSOLUTE;
            (linear - view).abs() > allowed
        });
        if let Some(text) = places(bad, codes.width, colour) {
            findings.push((kind, format!("{text} not the linear values of noisy.png")));
        }
    }
}
