//! The ratio κ of disparity to circle of confusion: a constant of lens and response, without a scene.
//!
//! Light that reaches half H of a pixel at p comes from the exit pupil under the mean slope m̄_H(p), weighted by the
//! half's response. With the lever of [`Defocus`], x_H = −m̄_H,x · lever and y_H = m̄_H,y · lever as stored, and the
//! circle of confusion is the lever times the slope s = 2a/D_xp that the exit pupil's diameter 2a spans. The lever, all
//! that depth enters by, falls out of
//!
//! ```text
//! x_L − x_R = −κ_x coc,   κ_x(p) = (m̄_L,x − m̄_R,x)/s        y_T − y_B = −κ_y coc,   κ_y(p) = (m̄_B,y − m̄_T,y)/s
//! ```
//!
//! so κ is the same for any amount of defocus. m̄_H is the mean over the half's sub-pixels.

use glam::DVec2;
use quadpixel_datasets::{DisparityRatio, RatioField};
use rayon::prelude::*;

use super::Camera;
use super::truth::{Defocus, DisparityField, centroids};
use crate::field::FieldGrid;
use crate::image::views::Side;
use crate::sampling::SobolSet;
use crate::spectrum::ChannelWavelengths;

/// Nodes along each side of the window: κ changes as slowly as the pupil's outline does.
const NODES: usize = 9;
/// Rays of a bundle, where the polar rule does not hold.
const RAYS: usize = 4096;

/// Mean slope of the light that each sub-pixel gets, from one that all have in common; `None`: it gets none.
type Slopes = Vec<Option<DVec2>>;

/// κ over a camera's window, in the reference channel; `None` for bare pixels, which have no focus.
pub fn disparity_ratio(camera: &Camera) -> Option<DisparityRatio> {
    let samples = SobolSet::new(RAYS);
    over_window(camera, |place| {
        let (seen, _) = centroids(camera, ChannelWavelengths::REFERENCE, place, &samples)?;
        let slopes = seen.iter().map(|s| (s.weight > 0.0).then_some(s.slope));
        Some(slopes.collect())
    })
}

/// The same from what is known of the disparity in a channel, without a ray.
pub fn disparity_ratio_in(camera: &Camera, field: &DisparityField) -> Option<DisparityRatio> {
    over_window(camera, |place| Some(field.slopes(place)))
}

fn over_window(
    camera: &Camera,
    slopes: impl Fn(DVec2) -> Option<Slopes> + Sync,
) -> Option<DisparityRatio> {
    let pupil_slope = Defocus::new(camera)?.pupil_slope();
    let window = camera.sensor().window_mm();
    let seen: Vec<Option<Slopes>> = (0..NODES * NODES)
        .into_par_iter()
        .map(|k| {
            let node = (k % NODES, k / NODES);
            slopes(FieldGrid::node_mm(window, (NODES, NODES), node))
        })
        .collect();
    let ratios = |[a, b]: [Side; 2], along: DVec2| {
        let ratio = |seen: &Option<Slopes>| {
            let seen = seen.as_ref()?;
            let difference = mean_slope(camera, seen, a)? - mean_slope(camera, seen, b)?;
            Some(difference.dot(along) / pupil_slope)
        };
        let values: Vec<Option<f64>> = seen.iter().map(ratio).collect();
        RatioField::new(NODES as u32, NODES as u32, &values)
    };
    Some(DisparityRatio {
        left_right: ratios([Side::Left, Side::Right], DVec2::X),
        top_bottom: ratios([Side::Bottom, Side::Top], DVec2::Y),
    })
}

/// Mean slope of what a side's sub-pixels get; `None` without a sub-pixel on that side, or if one of them is dark.
fn mean_slope(camera: &Camera, slopes: &Slopes, side: Side) -> Option<DVec2> {
    let members = side.members(camera.sensor().subpixels());
    let slopes: Option<Vec<DVec2>> = members.iter().map(|&i| slopes[i]).collect();
    let slopes = slopes.filter(|slopes| !slopes.is_empty())?;
    Some(slopes.iter().sum::<DVec2>() / slopes.len() as f64)
}
