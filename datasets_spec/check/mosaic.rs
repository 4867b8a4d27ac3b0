//! The rules on the colour-filter mosaic: its levels are those of the files that it is picked from, and so is every
//! code.

use std::collections::BTreeMap;

use super::pixels::places;
use crate::camera_description::RawFormat;
use crate::load::Planes;
use crate::mosaic::CodeLevels;
use crate::sample::{FileKind, SampleMeta};

/// What is wrong with the description.
pub(super) fn check_levels(meta: &SampleMeta) -> Option<&'static str> {
    let mosaic = meta.mosaic.as_ref()?;
    let colours = meta.channels.iter().map(|c| c.name.as_str());
    if meta.raw.format != RawFormat::Png || !colours.eq(["R", "G", "B"]) {
        return Some("mosaic: is of a raw.png of R, G, B");
    }
    let levels = |black: Option<u16>, white: Option<u16>| {
        Some(CodeLevels {
            black_level: black?,
            white_level: white?,
        })
    };
    if levels(meta.raw.black_level, meta.raw.white_level) != Some(mosaic.clean) {
        return Some("mosaic.clean: not the levels of raw");
    }
    let noisy = meta.noise.readout().map(|readout| CodeLevels {
        black_level: readout.black_level,
        white_level: readout.largest_code(),
    });
    (noisy != mosaic.noisy).then_some(
        "mosaic.noisy: not the black level and the largest code of noise.readout (absent without one)",
    )
}

/// What is wrong with the pictures.
pub(super) fn check(
    meta: &SampleMeta,
    pictures: &BTreeMap<FileKind, Planes>,
) -> Vec<(FileKind, String)> {
    let Some(mosaic) = &meta.mosaic else {
        return Vec::new();
    };
    let subpixels = meta.sensor.subpixels;
    let (columns, rows) = (subpixels.m(), subpixels.n());
    let differs = |(kind, source): (FileKind, FileKind)| {
        let (own, source) = (pictures.get(&kind)?, pictures.get(&source)?);
        let codes = &own.channels["Y"];
        let colours = ["R", "G", "B"].map(|c| source.channels.get(c));
        let bad = (0..codes.len()).filter(|&i| {
            let (x, y) = (i % own.width / columns, i / own.width / rows);
            let picked = colours[mosaic.pattern.channel(x, y)];
            picked.is_some_and(|picked| picked.get(i) != Some(&codes[i]))
        });
        let text = places(bad, own.width, "Y")?;
        Some((
            kind,
            format!("{text} not the code of their microlens's colour"),
        ))
    };
    let pairs = [
        (FileKind::Mosaic, FileKind::Raw),
        (FileKind::NoisyMosaic, FileKind::Noisy),
    ];
    pairs.into_iter().filter_map(differs).collect()
}
