//! How far leaving an effect out moves what the sub-pixels see.
//!
//! Sub-pixel i of the pixel at x sees the direction q_i(D) at depth D in the mean over its rays; the same rays without
//! the effect see q_i'(D). In the picture that is a shift of `J⁻¹ (q_i' − q_i)`, J = ∂q̄/∂x (see
//! [`crate::render::truth::DisparityField`]); disparities between views change by no more than twice that. Tangents and
//! J are linear in 1/D, so the nearest and the farthest depth bound the rest.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use crate::render::Camera;
use crate::render::truth::{Centroid, centroids, jacobian_at};
use crate::sampling::SobolSet;
use crate::spectrum::ChannelWavelengths;

/// Rays per place and channel.
const RAYS: usize = 1024;
/// Parts of an equal share of the light below which what a sub-pixel sees does not count.
const LEAST_LIGHT: f64 = 0.01;

/// What the sub-pixels see at a few places of the window.
pub(super) struct SubpixelViews {
    /// `[place][channel]`: the sub-pixels, then all together.
    seen: Vec<Vec<Option<Vec<Centroid>>>>,
}

/// The views of the whole, and what turns a change of what is seen there into one of the place.
pub(super) struct ReferenceViews {
    views: SubpixelViews,
    /// J₀ and J₁ at each place; `None` where it is dark.
    jacobians: Vec<Option<[DMat2; 2]>>,
}

/// The middle and the corners of a camera's window.
fn places(camera: &Camera) -> [DVec2; 5] {
    let w = camera.sensor().window_mm();
    let corner = |x: f64, y: f64| w.centre + DVec2::new(x * w.half_width, y * w.half_height);
    [
        w.centre,
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(-1.0, 1.0),
        corner(1.0, 1.0),
    ]
}

impl SubpixelViews {
    /// Of a camera, in the middle and the corners of its window.
    pub fn new(camera: &Camera) -> Self {
        let samples = SobolSet::new(RAYS);
        let seen = places(camera).into_par_iter().map(|place| {
            let channel_views = |channel| {
                let (mut views, all) = centroids(camera, channel, place, &samples)?;
                views.push(all);
                Some(views)
            };
            (0..3).map(channel_views).collect()
        });
        Self {
            seen: seen.collect(),
        }
    }
}

impl ReferenceViews {
    /// Of a camera, as [`SubpixelViews::new`].
    pub fn new(camera: &Camera) -> Self {
        let jacobians = places(camera)
            .into_par_iter()
            .map(|place| jacobian_at(camera, ChannelWavelengths::REFERENCE, place));
        Self {
            views: SubpixelViews::new(camera),
            jacobians: jacobians.collect(),
        }
    }

    /// The largest shift, px, of another camera's views against these at the depths from `near_mm` to `far_mm` (+∞
    /// allowed).
    pub fn largest_shift_px(&self, other: &SubpixelViews, [near_mm, far_mm]: [f64; 2]) -> f64 {
        let mut largest: f64 = 0.0;
        let places = self.views.seen.iter().zip(&other.seen).zip(&self.jacobians);
        for ((ours, theirs), jacobians) in places {
            let Some([j0, j1]) = jacobians else {
                continue;
            };
            for (ours, theirs) in ours.iter().zip(theirs) {
                // Dark in one only: nothing that a shift could tell.
                let (Some(ours), Some(theirs)) = (ours, theirs) else {
                    let alike = ours.is_some() == theirs.is_some();
                    largest = largest.max(if alike { 0.0 } else { f64::INFINITY });
                    continue;
                };
                for inverse in [1.0 / near_mm, 1.0 / far_mm] {
                    let to_px = (*j0 + inverse * *j1).inverse();
                    largest = largest.max(shift_px(ours, theirs, to_px, inverse));
                }
            }
        }
        largest
    }
}

fn shift_px(ours: &[Centroid], theirs: &[Centroid], to_px: DMat2, inverse: f64) -> f64 {
    let light = |views: &[Centroid]| {
        let all = views.last().map_or(0.0, |all| all.weight);
        LEAST_LIGHT * all / (views.len() - 1).max(1) as f64
    };
    let least = (light(ours), light(theirs));
    let seen = |c: &Centroid| c.q0 + inverse * c.q1_mm;
    let lit = ours
        .iter()
        .zip(theirs)
        .filter(|(a, b)| a.weight > least.0 && b.weight > least.1);
    lit.map(|(a, b)| (to_px * (seen(b) - seen(a))).length())
        .fold(0.0, f64::max)
}
