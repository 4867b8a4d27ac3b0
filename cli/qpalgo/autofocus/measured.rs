//! One sample of a focus stack, with what its own maps say for comparison.

use std::path::Path;

use crate::exit::CommandError;
use quadpixel::image::exr::read_layers;
use quadpixel::image::views::Side;

use crate::qpalgo::inputs::{CaptureArgs, in_file};
use quadpixel_algorithms::autofocus::{Region, Step, measure_step, median};
use quadpixel_algorithms::capture::Capture;
use quadpixel_algorithms::disparity::MatchSettings;
use quadpixel_algorithms::metrics::sharpness::SharpnessSettings;

/// What the sample's own maps say of the region, for comparison: medians, px.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub(super) struct Truth {
    /// Signed circle of confusion: the defocus.
    pub coc_px: Option<f64>,
    /// x_L − x_R by the traced rays.
    pub shift_px: Option<f64>,
}

/// One sample of a curve.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(super) struct Measured {
    pub sample: String,
    #[serde(flatten)]
    pub step: Step,
    pub truth: Truth,
}

/// Measures a sample; its truth is looked at last.
pub(super) fn measure(
    sample: &str,
    folder: &Path,
    region: Option<Region>,
    settings: &MatchSettings,
    kind: &SharpnessSettings,
) -> Result<Measured, CommandError> {
    let capture = CaptureArgs::default().read(folder)?;
    let [width, height] = capture.size_px();
    let region = region.unwrap_or(Region::middle(width, height));
    if !region.fits(width, height) {
        return Err(in_file(folder)(format!(
            "--region does not lie in a view; allowed: inside {width} × {height} px"
        )));
    }
    let step = measure_step(&capture, region, settings, kind).map_err(in_file(folder))?;
    // Nothing above depends on it.
    Ok(Measured {
        sample: sample.to_owned(),
        step,
        truth: truth(folder, &capture, region)?,
    })
}

fn truth(folder: &Path, capture: &Capture, region: Region) -> Result<Truth, CommandError> {
    let [width, _] = capture.size_px();
    let read = |name: &str| read_layers(&folder.join(name)).map_err(CommandError::input);
    let middle = |value: &dyn Fn(usize) -> f64| {
        median(
            region
                .pixels(width)
                .map(value)
                .filter(|v| v.is_finite())
                .collect(),
        )
    };
    let mut truth = Truth::default();
    if folder.join("coc.exr").is_file() {
        let layers = read("coc.exr")?;
        let map = layers.first().map(|l| &l.image);
        let at = |i| {
            map.and_then(|m| m.data().get(i))
                .map_or(f64::NAN, |&v| f64::from(v))
        };
        truth.coc_px = middle(&at);
    }
    if folder.join("disparity.exr").is_file() {
        let layers = read("disparity.exr")?;
        let subpixels = capture.views.subpixels();
        let mean = |side: Side, i: usize| {
            let members = side.members(subpixels);
            let dx = |v: &usize| {
                let layer = layers.iter().find(|l| l.name == subpixels.name(*v));
                let at = layer.and_then(|l| {
                    let channel = l.channels.iter().position(|c| c == "dx")?;
                    l.image.data().get(i * l.channels.len() + channel)
                });
                at.map_or(f64::NAN, |&v| f64::from(v))
            };
            members.iter().map(dx).sum::<f64>() / members.len() as f64
        };
        truth.shift_px = middle(&|i| mean(Side::Left, i) - mean(Side::Right, i));
    }
    Ok(truth)
}
