//! Whether a sample can be written: sizes, light, colours.

use super::error::WriteError;
use super::files::{RawEncoding, SampleFiles};

/// A sample that cannot be written.
pub(super) fn input(sample: &str, what: impl Into<String>) -> WriteError {
    WriteError::Input {
        sample: sample.to_string(),
        what: what.into(),
    }
}

/// Sizes are the sensor's, of `height` rows of it, and light is finite and not negative.
pub(super) fn check(sample: &SampleFiles<'_>, name: &str, height: usize) -> Result<(), WriteError> {
    let sensor = &sample.description.sensor;
    let width = sensor.width_px as usize;
    let (m, n) = (sensor.subpixels.m(), sensor.subpixels.n());
    let colours = sample.description.channels.len();
    if sample.description.mosaic.is_some() {
        let names = sample.description.channels.iter().map(|c| c.name.as_str());
        let png = matches!(sample.raw_encoding, RawEncoding::Png(_));
        if !png || !names.eq(["R", "G", "B"]) {
            return Err(input(name, "a mosaic is picked from a raw.png of R, G, B"));
        }
    }
    let mut images = vec![
        ("raw", sample.raw, m * width, n * height, colours),
        ("target", sample.target, width, height, colours),
        ("depth", sample.depth_m, width, height, 1),
        ("distance", sample.distance_m, width, height, 1),
        ("coc", sample.coc_px, width, height, 1),
        ("occlusion", sample.occlusion, width, height, 1),
    ];
    if let Some(noisy) = &sample.noisy {
        let mosaics = [("noisy", noisy.codes), ("noisy, linear", noisy.linear)];
        images.extend(mosaics.map(|(what, map)| (what, map, m * width, n * height, colours)));
        images.extend((noisy.shading.iter()).map(|map| ("shading", map, width, height, colours)));
    }
    if let Some(seen) = sample.seen {
        images.push(("normal", seen.normals, width, height, 3));
        if seen.objects.len() != width * height {
            let what = format!(
                "{} objects for {width} × {height} pixels",
                seen.objects.len()
            );
            return Err(input(name, what));
        }
    }
    for maps in [sample.traced_px, sample.paraxial_px] {
        if maps.len() != m * n {
            let what = format!("{} disparity maps for {} sub-pixels", maps.len(), m * n);
            return Err(input(name, what));
        }
        images.extend(maps.iter().map(|map| ("disparity", map, width, height, 2)));
    }
    for (what, image, width, height, channels) in images {
        let size = (image.width(), image.height(), image.channels());
        if size != (width, height, channels) || image.data().is_empty() {
            let what = format!(
                "{what} is {size:?} and must be {:?}",
                (width, height, channels)
            );
            return Err(input(name, what));
        }
    }
    if sample.valid.len() != width * height {
        let what = format!(
            "{} validity flags for {width} × {height} pixels",
            sample.valid.len()
        );
        return Err(input(name, what));
    }
    for (what, image) in [("raw", sample.raw), ("target", sample.target)] {
        let dark = |v: f32| !(0.0..f32::INFINITY).contains(&v);
        if image.any(dark)
            && let Some(at) = image.data().iter().position(|v| dark(*v))
        {
            let (value, at) = (image.data()[at], at / image.channels());
            let (x, y) = (at % image.width(), at / image.width());
            let what = format!(
                "{what} is {value} at column {x}, row {y}; light is finite and not negative"
            );
            return Err(input(name, what));
        }
    }
    Ok(())
}
