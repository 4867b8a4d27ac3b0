//! A camera's disparity against distance over the field, of centroids or as windows match it: what `qpalgo depth
//! --curve` needs of a camera that has no `camera.json`.

use quadpixel::image::views::Side;
use quadpixel::render::truth::{ReceptiveField, TextureSpectrum};
use quadpixel::render::{Camera, disparity_ratio};
use quadpixel::spectrum::ChannelWavelengths;
use quadpixel_algorithms::dense::SHARP_RATIO;
use quadpixel_algorithms::depth::{FieldCurve, FieldCurveError};
use rayon::prelude::*;

/// Rays of a node.
const RAYS: usize = 512;
/// What the curve may be wrong by, as long as no plane at a known distance says more: the pixel is known from its
/// drawing, and a match of blurred texture is off by its texture.
const RELATIVE_ERROR: f64 = 0.05;
const OFFSET_ERROR_PX: f64 = 0.02;

/// Where distances count from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CountedFrom {
    /// The first lens vertex, as depths of samples do.
    Vertex,
    /// The sensor, as the mark on a camera's body does.
    Sensor,
}

/// Which curve.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePlan {
    /// What it is made from, in words.
    pub source: String,
    /// Of the distances.
    pub counted_from: CountedFrom,
    /// 1/Z, 1/m, increasing.
    pub inverse_distances_per_m: Vec<f64>,
    /// Nodes over the picture, columns and rows.
    pub nodes: (usize, usize),
    /// Side of windows: shifts are as these match them; absent: those of centroids.
    pub window_px: Option<usize>,
}

/// A camera without a curve.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurvePlanError {
    /// Neither columns nor rows of sub-pixels.
    #[error("the pixel has {0} sub-pixels; allowed: two columns or more")]
    NotParted(String),
    /// A node in the dark.
    #[error("no light reaches the sensor at column {0:.0}, row {1:.0}")]
    Dark(f64, f64),
    /// Where no scene can be.
    #[error(
        "the distance {distance_m} m lies within the lens, whose first vertex is at {first_m:.4} m; allowed: farther"
    )]
    WithinLens {
        /// The nearest distance.
        distance_m: f64,
        /// The lens's first vertex, counted alike.
        first_m: f64,
    },
    /// The shift does not grow with 1/Z over two distances.
    #[error(
        "the shift grows with 1/Z over less than three of the distances; allowed: distances nearer to the focus, where the blur is smaller than the matcher's window"
    )]
    NotGrowing,
    /// What the file's own check says.
    #[error(transparent)]
    Curve(#[from] FieldCurveError),
}

/// x_L − x_R at each node and distance. Far from the focus, where the blur is wider than
/// texture and the shift no longer grows with 1/Z, distances are left out.
///
/// # Errors
/// See [`CurvePlanError`].
pub fn field_curve(camera: &Camera, plan: CurvePlan) -> Result<FieldCurve, CurvePlanError> {
    let sensor = camera.sensor();
    let subpixels = sensor.subpixels();
    let groups = [Side::Left, Side::Right].map(|side| side.members(subpixels));
    if groups.iter().any(Vec::is_empty) {
        return Err(CurvePlanError::NotParted(subpixels.to_string()));
    }
    let groups = groups.each_ref().map(Vec::as_slice);
    let texture = (plan.window_px).map(|window_px| TextureSpectrum {
        window_px: window_px as f64,
        ..TextureSpectrum::default()
    });
    let zero_mm = match plan.counted_from {
        CountedFrom::Vertex => 0.0,
        CountedFrom::Sensor => camera.sensor_z_mm(),
    };
    let nearest_m = (plan.inverse_distances_per_m.last()).map_or(f64::INFINITY, |i| 1.0 / i);
    if 1e3 * nearest_m <= zero_mm {
        return Err(CurvePlanError::WithinLens {
            distance_m: nearest_m,
            first_m: 1e-3 * zero_mm,
        });
    }
    let columns_px = places(plan.nodes.0, sensor.width());
    let rows_px = places(plan.nodes.1, sensor.height());
    let node = |x: f64, y: f64| -> Result<Vec<f64>, CurvePlanError> {
        let place = sensor.position_mm(x, y);
        let field = ReceptiveField::new(camera, ChannelWavelengths::REFERENCE, place, RAYS);
        let field = field.ok_or(CurvePlanError::Dark(x, y))?;
        let pair = field.of_groups(groups, false);
        let at = |inverse: &f64| {
            let depth_mm = 1e3 / inverse - zero_mm;
            match &texture {
                Some(texture) => pair.matched_shift_px(depth_mm, [0, 1], texture),
                None => pair.centroid_shift_px(depth_mm, [0, 1]),
            }
        };
        Ok(plan.inverse_distances_per_m.iter().map(at).collect())
    };
    let mut disparity_px = (rows_px.par_iter())
        .map(|&y| columns_px.iter().map(|&x| node(x, y)).collect())
        .collect::<Result<Vec<Vec<Vec<f64>>>, _>>()?;
    let mut inverse_distances_per_m = plan.inverse_distances_per_m;
    let kept = growing(&disparity_px, inverse_distances_per_m.len());
    if kept.len() < 3 {
        return Err(CurvePlanError::NotGrowing);
    }
    inverse_distances_per_m = inverse_distances_per_m[kept.clone()].to_vec();
    for node in disparity_px.iter_mut().flatten() {
        *node = node[kept.clone()].to_vec();
    }
    let curve = FieldCurve {
        source: plan.source,
        counted_from: match plan.counted_from {
            CountedFrom::Vertex => "the first lens vertex".to_owned(),
            CountedFrom::Sensor => "the sensor".to_owned(),
        },
        width_px: sensor.width(),
        height_px: sensor.height(),
        inverse_distances_per_m,
        columns_px,
        rows_px,
        disparity_px,
        relative_error: RELATIVE_ERROR,
        offset_error_px: OFFSET_ERROR_PX,
        blur_ratio: middle_ratio(camera),
        matched_window_px: plan.window_px,
        matching_error_px: None,
    };
    // Checked as it will be when it is read.
    let text = serde_json::to_string(&curve).unwrap_or_default();
    Ok(FieldCurve::from_json(&text, "simulated curve")?)
}

/// κ in the middle of the picture: beside it a pixel whose microlens does not follow the chief ray has less.
fn middle_ratio(camera: &Camera) -> Option<f64> {
    let sensor = camera.sensor();
    let size = [sensor.width(), sensor.height()];
    let ratio = disparity_ratio(camera)?.left_right?;
    let middle = size.map(|n| 0.5 * (n as f64 - 1.0));
    let ratio = ratio.at(middle, size.map(|n| n as u32));
    (ratio > 0.0 && ratio <= SHARP_RATIO).then_some(ratio)
}

/// Evenly over the picture, its first and last pixel included; one: its middle.
fn places(count: usize, px: usize) -> Vec<f64> {
    let last = (px - 1) as f64;
    match count {
        0 | 1 => vec![0.5 * last],
        n => (0..n).map(|i| i as f64 / (n - 1) as f64 * last).collect(),
    }
}

/// The longest run of distances over which the shift grows at every node.
fn growing(disparity_px: &[Vec<Vec<f64>>], distances: usize) -> std::ops::Range<usize> {
    let grows = |k: usize| {
        (disparity_px.iter().flatten())
            .all(|d| d[k].is_finite() && d[k - 1].is_finite() && d[k] > d[k - 1])
    };
    let (mut best, mut first) = (0..0, 0);
    for k in 1..=distances {
        if k == distances || !grows(k) {
            if k - first > best.len() {
                best = first..k;
            }
            first = k;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_growing_run_of_all_nodes_is_kept() {
        let node = |d: &[f64]| d.to_vec();
        let field = vec![vec![
            node(&[3.0, 1.0, 2.0, 3.0, 4.0, 3.5]),
            node(&[0.0, 1.0, 2.0, 2.5, 3.0, 9.0]),
        ]];
        assert_eq!(growing(&field, 6), 1..5);
        assert_eq!(growing(&[vec![node(&[1.0, f64::NAN])]], 2).len(), 1);
    }
}
