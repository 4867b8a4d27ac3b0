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
use super::truth::{Centroid, Defocus, centroids};
use crate::field::FieldGrid;
use crate::image::views::Side;
use crate::sampling::SobolSet;
use crate::spectrum::ChannelWavelengths;

/// Nodes along each side of the window: κ changes as slowly as the pupil's outline does.
const NODES: usize = 9;
/// Rays of a bundle.
const RAYS: usize = 4096;

/// κ over a camera's window, in the reference channel; `None` for bare pixels, which have no focus.
pub fn disparity_ratio(camera: &Camera) -> Option<DisparityRatio> {
    let pupil_slope = Defocus::new(camera)?.pupil_slope();
    let window = camera.sensor().window_mm();
    let samples = SobolSet::new(RAYS);
    let seen: Vec<Option<Vec<Centroid>>> = (0..NODES * NODES)
        .into_par_iter()
        .map(|k| {
            let place = FieldGrid::node_mm(window, (NODES, NODES), (k % NODES, k / NODES));
            centroids(camera, ChannelWavelengths::REFERENCE, place, &samples).map(|c| c.0)
        })
        .collect();
    let field = |[a, b]: [Side; 2], along: DVec2| {
        let ratio = |seen: &Option<Vec<Centroid>>| {
            let seen = seen.as_ref()?;
            let difference = mean_slope(camera, seen, a)? - mean_slope(camera, seen, b)?;
            Some(difference.dot(along) / pupil_slope)
        };
        let values: Vec<Option<f64>> = seen.iter().map(ratio).collect();
        RatioField::new(NODES as u32, NODES as u32, &values)
    };
    Some(DisparityRatio {
        left_right: field([Side::Left, Side::Right], DVec2::X),
        top_bottom: field([Side::Bottom, Side::Top], DVec2::Y),
    })
}

/// Mean slope of what a side's sub-pixels see; `None` without a sub-pixel on that side, or if one of them is dark.
fn mean_slope(camera: &Camera, seen: &[Centroid], side: Side) -> Option<DVec2> {
    let subpixels = camera.sensor().subpixels();
    let members = side.members(subpixels);
    let lit = members.iter().all(|&i| seen[i].weight > 0.0);
    let sum: DVec2 = members.iter().map(|&i| seen[i].slope).sum();
    (lit && !members.is_empty()).then(|| sum / members.len() as f64)
}
