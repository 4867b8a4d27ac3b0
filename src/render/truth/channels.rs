//! What the colour channels' disparity is beside the reference channel's.
//!
//! Each channel has its own centroids: lens and response bend and weigh its light in their own way. Of a point at depth
//! D that the sum of the reference channel shows at p, channel c's sum stands at p + J_c⁻¹ (q̄ − q̄_c) (lateral
//! colour), and its view i at Δ_i,c from there (see [`DisparityField`]).

use glam::DVec2;
use rayon::prelude::*;

use super::disparity::{DisparityField, shift_to_sum, traced};
use crate::image::Image;
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
    let mut rows = vec![0f32; height * width * layers * 4];
    (rows.par_chunks_mut((width * layers * 4).max(1)).enumerate()).for_each(|(row, out)| {
        let mut green = vec![DVec2::ZERO; subpixels];
        let mut other = green.clone();
        let mut sight = reference.sight().at(camera.sensor().centre_mm());
        for (column, out) in out.chunks_exact_mut(layers * 4).enumerate() {
            let place = camera.sensor().position_mm(column as f64, row as f64);
            let depth = f64::from(depth_mm.pixel(column, row)[0]);
            reference.sight().read(place, &mut sight);
            traced(&sight, depth, &mut green);
            let line = sight.line();
            for (k, channel) in OTHERS.into_iter().enumerate() {
                let field = &fields[channel];
                field.sight().read(place, &mut sight);
                traced(&sight, depth, &mut other);
                let beside = other.iter().zip(&green).map(|(a, b)| *a - *b);
                let lateral = shift_to_sum(&sight, depth, line);
                for (out, shift) in out.chunks_exact_mut(4).zip(beside.chain([lateral])) {
                    out[2 * k..][..2].copy_from_slice(&shift.as_vec2().to_array());
                }
            }
        }
    });
    let layer = |l: usize| {
        let pixels = rows.chunks_exact(4).skip(l).step_by(layers);
        let mut data = Vec::with_capacity(width * height * 4);
        pixels.for_each(|pixel| data.extend_from_slice(pixel));
        Image::from_vec(width, height, 4, data)
            .unwrap_or_else(|| unreachable!("four values a pixel"))
    };
    Some((0..layers).into_par_iter().map(layer).collect())
}
