//! What a matcher finds on a texture against the centroids' disparity: of lens and response, without a scene.
//!
//! Two opposite halves of a pixel see a point under two different blurs, mirror images of each other more than copies,
//! so a matcher that looks for a copy finds more than the distance of their centroids: the more, the wider the blur is
//! for the texture (see [`ReceptiveField`]). In the middle of the window, for the texture of natural pictures.

use quadpixel_datasets::{MatchingCurve, MatchingCurves};
use rayon::prelude::*;

use super::Camera;
use super::truth::{Defocus, ReceptiveField, TextureSpectrum};
use crate::image::views::Side;
use crate::spectrum::ChannelWavelengths;

/// Rays of the pixel.
const RAYS: usize = 256;
/// Circles of confusion on both sides of the focus, px; at 0 the two are the same but for aberrations.
const COC_PX: [f64; 8] = [1.0, 2.0, 3.0, 4.5, 6.5, 9.0, 12.0, 16.0];

/// The curves of both directions, reference channel; `None` for bare pixels, which have no focus.
pub fn matching_curves(camera: &Camera) -> Option<MatchingCurves> {
    let defocus = Defocus::new(camera)?;
    let middle = camera.sensor().centre_mm();
    let pixel = ReceptiveField::new(camera, ChannelWavelengths::REFERENCE, middle, RAYS)?;
    let pitch_mm = camera.sensor().pitch_mm();
    let depths: Vec<f64> = (COC_PX.iter().rev().map(|c| -c))
        .chain([0.0])
        .chain(COC_PX)
        .filter_map(|coc_px| defocus.depth_of_coc_mm(coc_px * pitch_mm))
        .collect();
    let texture = TextureSpectrum::default();
    let curve = |sides: [Side; 2], vertical: bool| {
        let subpixels = camera.sensor().subpixels();
        let groups = sides.map(|side| side.members(subpixels));
        if groups.iter().any(Vec::is_empty) {
            return None;
        }
        let pair = pixel.of_groups(groups.each_ref().map(Vec::as_slice), vertical);
        let shifts: Vec<[f64; 2]> = (depths.par_iter())
            .map(|&depth| {
                let centroid = pair.centroid_shift_px(depth, [0, 1]);
                [centroid, pair.matched_shift_px(depth, [0, 1], &texture)]
            })
            .collect();
        MatchingCurve::new(texture.exponent, texture.window_px, &shifts)
    };
    Some(MatchingCurves {
        left_right: curve([Side::Left, Side::Right], false),
        top_bottom: curve([Side::Top, Side::Bottom], true),
    })
}
