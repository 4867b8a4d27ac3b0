//! The algorithms of `qpalgo` on arrays.

use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use quadpixel::file;
use quadpixel::image::{Image, channel};
use quadpixel_algorithms::calibrated_camera::CalibratedCamera;
use quadpixel_algorithms::calibration::{Align, Calibration, CalibrationSettings};
use quadpixel_algorithms::capture::Capture;
use quadpixel_algorithms::correct::correct as corrected;
use quadpixel_algorithms::dense::{
    BlurRatio, DenseSettings, Network, OppositePair, OppositeViews, dense_disparity_of,
    learned_disparity_of,
};
use quadpixel_algorithms::depth::{
    CameraCurve, CurveError, DepthMaps, DescribedCurve, ParaxialCurve, Shifts,
};
use quadpixel_algorithms::disparity::{Axes, DisparityMap, MatchSettings, match_images};
use quadpixel_algorithms::metrics::sharpness::{Plane, SharpnessSettings, sharpness as measured};
use quadpixel_algorithms::refocus::refocus as refocused;
use quadpixel_algorithms::sai::Views;
use quadpixel_algorithms::warp::Lobes;
use quadpixel_cli::exit::CommandError;
use quadpixel_datasets::CameraDescription;

use crate::arrays::{Array, Given, image, of_image, of_images, of_plane, shaped, views as set_of};
use crate::call::{on_threads, run};
use crate::json::{read, refused, text};

/// What is wrong with the input.
fn input(error: impl ToString) -> CommandError {
    CommandError::input(error)
}

/// The views of a mosaic, (m·n, H, W, C).
#[pyfunction]
pub fn views<'py>(py: Python<'py>, raw: Given<'_>, subpixels: &str) -> PyResult<Array<'py, f32>> {
    let mosaic = image(&raw, "raw")?;
    let subpixels = subpixels.parse().map_err(refused)?;
    let views = on_threads(py, || Views::from_mosaic(&mosaic, subpixels))?.map_err(refused)?;
    of_images(py, views.images(), 0..mosaic.channels())
}

/// Window, search and stride of matching, px.
type Lengths = (usize, usize, usize);

/// Matching as asked for.
fn settings((window, search, stride): Lengths, axis: &str) -> PyResult<MatchSettings> {
    Ok(MatchSettings {
        window_px: window,
        stride_px: stride,
        search_px: search,
        axes: match axis {
            "both" => Axes::Both,
            "horizontal" => Axes::Horizontal,
            "vertical" => Axes::Vertical,
            other => {
                let text = format!("axis is {other}; allowed: both, horizontal, vertical");
                return Err(refused(text));
            }
        },
        ..MatchSettings::default()
    })
}

/// Shifts (rows, columns, channels, 4) of dx, dy, sigma, verdict at nodes, and the first node's pixel.
#[pyfunction]
pub fn disparity<'py>(
    py: Python<'py>,
    view: Given<'_>,
    reference: Given<'_>,
    lengths_px: Lengths,
    axis: &str,
) -> PyResult<(Array<'py, f32>, usize)> {
    let (view, reference) = (image(&view, "view")?, image(&reference, "reference")?);
    if view.channels() != reference.channels() {
        return Err(refused(
            "view and reference have another number of channels each",
        ));
    }
    let settings = settings(lengths_px, axis)?;
    let maps = run(py, None, move |_| {
        let one = |c| match_images(&channel(&reference, c), &channel(&view, c), &settings);
        let maps: Result<Vec<DisparityMap>, _> = (0..view.channels()).map(one).collect();
        maps.map_err(input)
    })?;
    let Some(grid) = maps.first().map(|map| map.grid) else {
        return Err(refused("view: it has no channel"));
    };
    let mut numbers = Vec::with_capacity(grid.len() * maps.len() * 4);
    for node in 0..grid.len() {
        for map in &maps {
            let m = &map.matches[node];
            let node = [
                m.dx_px,
                m.dy_px,
                m.deviation_px(),
                f64::from(m.verdict as u8),
            ];
            numbers.extend(node.map(|v| v as f32));
        }
    }
    let shape = [grid.rows, grid.columns, maps.len(), 4];
    Ok((shaped(py, numbers, &shape)?, grid.first_px))
}

/// The network at `path`; of an empty path: the one that comes with the module.
fn network_of(path: &Path) -> Result<Network, CommandError> {
    if path.as_os_str().is_empty() {
        return Network::shipped().map_err(input);
    }
    let bytes = file::read(path).map_err(CommandError::input)?;
    Network::from_archive(&bytes).map_err(|error| input(format!("{}: {error}", path.display())))
}

/// x_L − x_R at every pixel and its deviation, (H, W) each, px, of one channel of two opposite halves; `ratios`: in the
/// place of `ratio`, one at each pixel; `picture`: whose edges count, (H, W, C).
#[pyfunction]
pub fn dense<'py>(
    py: Python<'py>,
    left: Given<'_>,
    right: Given<'_>,
    ratio: Option<f64>,
    ratios: Option<Given<'_>>,
    picture: Option<Given<'_>>,
    network: Option<PathBuf>,
) -> PyResult<(Array<'py, f32>, Array<'py, f32>)> {
    let (left, right) = (image(&left, "left")?, image(&right, "right")?);
    let ratio = match &ratios {
        Some(ratios) => Some(BlurRatio::Field(image(ratios, "ratio")?)),
        None => ratio.map(BlurRatio::Whole),
    };
    let picture = (picture.as_ref().map(|picture| image(picture, "picture"))).transpose()?;
    let map = run(py, None, move |_| {
        let network = network.as_deref().map(network_of).transpose()?;
        let views = OppositeViews {
            left_right: Some(OppositePair {
                views: [&left, &right],
                ratio: ratio.as_ref(),
            }),
            picture: picture.as_ref(),
            ..OppositeViews::default()
        };
        let map = match &network {
            Some(network) => learned_disparity_of(views, network),
            None => dense_disparity_of(views),
        };
        map.map_err(input)
    })?;
    Ok((
        of_plane(py, &map.disparity_px)?,
        of_plane(py, &map.sigma_px)?,
    ))
}

/// Views as a capture; `camera`: its `camera.json`.
fn capture(views: &Given<'_>, subpixels: &str, camera: Option<&str>) -> PyResult<Capture> {
    let views = set_of(views, subpixels)?;
    let names: &[&str] = match views.images()[0].channels() {
        3 => &["R", "G", "B"],
        1 => &["Y"],
        other => return Err(refused(format!("views: {other} channels; allowed: 3 or 1"))),
    };
    let channels = names.iter().map(ToString::to_string).collect();
    let camera: Option<CameraDescription> = camera.map(|text| read(text, "camera")).transpose()?;
    let capture = Capture {
        views,
        channels,
        white: 1.0,
        camera,
    };
    if let Some(camera) = &capture.camera {
        let expected = [camera.width_px, camera.height_px].map(|n| n as usize);
        let [width, height] = capture.size_px();
        if expected != [width, height] {
            return Err(refused(format!(
                "views: {width} × {height} pixels where the camera has {} × {}",
                expected[0], expected[1]
            )));
        }
    }
    Ok(capture)
}

/// Depth (H, W), m, and confidence, deviation (m) and disparity (px), (H, W, 3), of views by their camera: at every
/// pixel, or where windows match surely.
#[pyfunction]
pub fn depth<'py>(
    py: Python<'py>,
    views: Given<'_>,
    camera: &str,
    kappa: Option<f64>,
    windows_px: Option<Lengths>,
    network: Option<PathBuf>,
) -> PyResult<(Array<'py, f32>, Array<'py, f32>)> {
    let description: CameraDescription = read(camera, "camera")?;
    let capture = capture(&views, &description.subpixels.to_string(), Some(camera))?;
    let windows = (windows_px.map(|px| settings(px, "both"))).transpose()?;
    let channel = &capture.channels[capture.reference_channel()];
    let curve = match kappa {
        Some(_) => ParaxialCurve::new(&description, kappa).map(CameraCurve::Paraxial),
        None => DescribedCurve::new(&description, channel).map(|curve| {
            CameraCurve::Described(match &windows {
                Some(_) => curve,
                None => curve.of_centroids(),
            })
        }),
    };
    let curve = curve.map_err(|error| match error {
        CurveError::NoRatio => refused("camera: it says no disparity against distance; give kappa"),
        error => refused(error),
    })?;
    let maps = run(py, None, move |_| {
        let network = network.as_deref().map(network_of).transpose()?;
        let known = DenseSettings::default();
        let shifts = match (&windows, &network) {
            (Some(settings), _) => Shifts::measure(&capture, settings, &|_| ()),
            (None, Some(network)) => Shifts::learned(&capture, &known, network),
            (None, None) => Shifts::dense(&capture, &known),
        };
        let limit = windows.unwrap_or_default().limits.deviation_px;
        Ok(DepthMaps::new(&shifts.map_err(input)?, &curve, limit))
    })?;
    Ok((
        of_plane(py, &maps.depth_m)?,
        of_image(py, &maps.confidence)?,
    ))
}

/// The calibration of a chart's views, as the JSON of `qpalgo correct-aberrations --calibration`.
#[pyfunction]
pub fn calibrate(
    py: Python<'_>,
    views: Given<'_>,
    camera: &str,
    fit: (usize, usize, usize),
    align: &str,
    smoothing: Option<f64>,
) -> PyResult<String> {
    let description: CameraDescription = read(camera, "camera")?;
    let capture = capture(&views, &description.subpixels.to_string(), Some(camera))?;
    let (window, search, degree) = fit;
    let align: Align = read(&format!("{align:?}"), "align")?;
    if let Some(px) = smoothing.filter(|px| !(px.is_finite() && *px > 0.0)) {
        return Err(refused(format!(
            "smoothing {px}: allowed is a positive number of px"
        )));
    }
    let settings = CalibrationSettings {
        matching: MatchSettings {
            window_px: window,
            search_px: search,
            ..CalibrationSettings::default().matching
        },
        degree,
        align,
        smoothing_px: smoothing,
    };
    run(py, None, move |_| {
        let camera = CalibratedCamera::from_capture(&capture, None).map_err(input)?;
        let calibration = Calibration::from_chart(&capture.views, &camera, &settings);
        text(&calibration.map_err(input)?)
    })
}

/// Views without the aberration of a calibration, (m·n, H, W, C), their sum, and where all of them have it, (H, W).
#[pyfunction]
#[allow(clippy::type_complexity)] // because it is three arrays
pub fn correct<'py>(
    py: Python<'py>,
    views: Given<'_>,
    camera: &str,
    calibration: &str,
) -> PyResult<(Array<'py, f32>, Array<'py, f32>, Array<'py, bool>)> {
    let description: CameraDescription = read(camera, "camera")?;
    let capture = capture(&views, &description.subpixels.to_string(), Some(camera))?;
    let calibration = Calibration::from_json(calibration.as_bytes()).map_err(refused)?;
    let done = run(py, None, move |_| {
        let camera = CalibratedCamera::from_capture(&capture, None).map_err(input)?;
        corrected(&capture.views, &camera, &calibration).map_err(input)
    })?;
    let size = [done.sum.height(), done.sum.width()];
    let views = of_images(py, done.views.images(), 0..done.sum.channels())?;
    Ok((
        views,
        of_image(py, &done.sum)?,
        shaped(py, done.valid, &size)?,
    ))
}

/// De's share and count, Wee's sum and the mean gradient of each channel of a picture.
#[pyfunction]
pub fn sharpness(
    py: Python<'_>,
    picture: Given<'_>,
    preset: &str,
) -> PyResult<Vec<(f64, usize, f64, f64)>> {
    let settings: SharpnessSettings = preset
        .parse()
        .map_err(|e| refused(format!("preset: {e}")))?;
    let picture: Image = image(&picture, "picture")?;
    run(py, None, move |_| {
        let one = |c| {
            let plane = Plane::from_image(&picture, c)?;
            measured(&plane, &settings).map(|s| (s.de, s.de_count, s.wee, s.gradient))
        };
        let all: Result<Vec<_>, _> = (0..picture.channels()).map(one).collect();
        all.map_err(input)
    })
}

/// The sum of views, shifted to be sharp at a disparity, (H, W, C), and where all views have it, (H, W).
#[pyfunction]
pub fn refocus<'py>(
    py: Python<'py>,
    views: Given<'_>,
    subpixels: &str,
    disparity_px: f64,
    weights: Option<Vec<f64>>,
    lobes: u8,
) -> PyResult<(Array<'py, f32>, Array<'py, bool>)> {
    let views = set_of(&views, subpixels)?;
    let lobes = match lobes {
        3 => Lobes::Three,
        4 => Lobes::Four,
        other => return Err(refused(format!("lobes: {other} is not 3 or 4"))),
    };
    let done = run(py, None, move |_| {
        refocused(&views, disparity_px, weights.as_deref(), lobes).map_err(input)
    })?;
    let size = [done.image.height(), done.image.width()];
    Ok((of_image(py, &done.image)?, shaped(py, done.valid, &size)?))
}
