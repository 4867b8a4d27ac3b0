//! What the colour channels' disparity is beside the reference channel's.
//!
//! Each channel has its own centroids: lens and response bend and weigh its light in their own way. Of a point at depth
//! D that the sum of the reference channel shows at p, channel c's sum stands at p + J_c⁻¹ (q̄ − q̄_c) (lateral
//! colour), and its view i at Δ_i,c from there (see [`DisparityField`]).

use glam::DVec2;
use rayon::prelude::*;

use super::disparity::{DisparityField, shift_to_sum, traced};
use super::sight_field::SightRow;
use crate::image::{Image, rows_of};
use crate::render::Camera;
use crate::spectrum::ChannelWavelengths;

/// The channels that are compared with the reference: red and blue.
const OTHERS: [usize; 2] = [0, 2];

/// At each pixel of a W × H × 1 map of depths, mm, of the reference channel: per sub-pixel an image W × H × 4 of the
/// disparity of red minus that of green (ΔX, ΔY) and of blue minus that of green, px; then one of where the sum of red,
/// and of blue, shows the point from where that of green does. `None` where the channels see the same.
pub fn channel_shifts(
    camera: &Camera,
    fields: &[DisparityField],
    depth_mm: &Image,
) -> Option<Vec<Image>> {
    let [_, reference, _] = fields else {
        return None;
    };
    debug_assert_eq!(ChannelWavelengths::REFERENCE, 1);
    let (width, height) = (depth_mm.width(), depth_mm.height());
    let subpixels = reference.subpixels();
    let layers = subpixels + 1;
    let mut images = vec![Image::zeros(width, height, 4); layers];
    (rows_of(&mut images).par_iter_mut().enumerate()).for_each(|(row, out)| {
        let first = camera.sensor().position_mm(0.0, row as f64);
        let along: Vec<SightRow> = fields.iter().map(|f| f.sight().row(first.y)).collect();
        let mut green = vec![DVec2::ZERO; subpixels];
        let mut other = green.clone();
        let mut sight = along[0].at(first.x);
        for column in 0..width {
            let place = camera.sensor().position_mm(column as f64, row as f64);
            let depth = f64::from(depth_mm.pixel(column, row)[0]);
            along[ChannelWavelengths::REFERENCE].read(place.x, &mut sight);
            traced(&sight, depth, &mut green);
            let line = sight.line();
            for (k, channel) in OTHERS.into_iter().enumerate() {
                along[channel].read(place.x, &mut sight);
                traced(&sight, depth, &mut other);
                let beside = other.iter().zip(&green).map(|(a, b)| *a - *b);
                let lateral = shift_to_sum(&sight, depth, line);
                for (out, shift) in out.iter_mut().zip(beside.chain([lateral])) {
                    let to = &mut out[4 * column + 2 * k..][..2];
                    to.copy_from_slice(&shift.as_vec2().to_array());
                }
            }
        }
    });
    Some(images)
}
