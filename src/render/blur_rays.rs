//! The rays of the pixel in the middle of the window, where they look beside it: the two blurs of opposite halves at
//! every depth, of lens, aberrations, diffraction at the lens's aperture and response, without a scene.
//!
//! Ray k sees the texture at δ_k = J⁻¹ (q_k − q̄) from the pixel ([`super::truth::ReceptiveField`]), with q and J
//! linear in 1/Z. With t = 1/(Z + e), e the entrance pupil's distance behind the first vertex, δ_k is a straight line
//! but for the aberrations of the pupils, so δ_k = a_k + b_k (t − t_f), t_f in focus, by least squares over depths on
//! both sides of it.

use glam::DVec2;
use quadpixel_datasets::BlurRays;

use super::Camera;
use super::truth::{Bundle, Defocus, draws_px, jacobian_at};
use crate::image::views::Side;
use crate::sampling::SobolSet;
use crate::spectrum::ChannelWavelengths;
use crate::units::M_PER_MM;

/// Rays of the pixel, and displacements of each.
const RAYS: usize = 1024;
const DRAWS: usize = 2;
/// Circles of confusion of the fit, px, those that are in front of infinity.
const COC_PX: [f64; 7] = [-24.0, -16.0, -8.0, 0.0, 8.0, 16.0, 24.0];

/// The rays, reference channel; `None` for bare pixels, which have no focus, and where no light passes.
pub fn blur_rays(camera: &Camera) -> Option<BlurRays> {
    let defocus = Defocus::new(camera)?;
    let pupil_mm = camera.paraxial()?.entrance_pupil_z_mm;
    let sensor = camera.sensor();
    let (channel, middle) = (ChannelWavelengths::REFERENCE, sensor.centre_mm());
    let bundle = Bundle::new(camera, channel, middle, &SobolSet::new(RAYS))?;
    let [j0, j1] = jacobian_at(camera, channel, middle)?;
    let depths_mm = COC_PX.map(|coc_px| defocus.depth_of_coc_mm(coc_px * sensor.pitch_mm()));
    let depths_mm: Vec<f64> = depths_mm.into_iter().flatten().collect();
    let per_m = |depth_mm: f64| 1.0 / ((depth_mm + pupil_mm) * M_PER_MM);
    let focus = per_m(camera.focus_distance_mm());
    let n = bundle.subpixels;
    let weights = |k: usize| &bundle.weights[k * n..(k + 1) * n];
    let all: f64 = bundle.weights.iter().sum();
    if depths_mm.len() < 2 || all <= 0.0 {
        return None;
    }
    // Means over the depths of 1, t, t², δ_k and t δ_k.
    let (mut sums, mut lines) = ([0.0; 2], vec![[DVec2::ZERO; 2]; bundle.q0.len()]);
    let share = 1.0 / depths_mm.len() as f64;
    for &depth_mm in &depths_mm {
        let (inverse, t) = (1.0 / depth_mm, per_m(depth_mm) - focus);
        let solve = (j0 + inverse * j1).inverse();
        let offset = |k: usize| solve * (bundle.q0[k] + inverse * bundle.q1_mm[k]);
        let weighted = |k: usize| weights(k).iter().sum::<f64>() * offset(k);
        let middle = (0..lines.len()).map(weighted).sum::<DVec2>() / all;
        sums = [sums[0] + share * t, sums[1] + share * t * t];
        for (k, line) in lines.iter_mut().enumerate() {
            let moment = share * (offset(k) - middle);
            *line = [line[0] + moment, line[1] + t * moment];
        }
    }
    let variance = sums[1] - sums[0] * sums[0];
    let fitted = |[mean, moment]: [DVec2; 2]| {
        let slope = (moment - sums[0] * mean) / variance;
        [mean - sums[0] * slope, slope]
    };
    let lines: Vec<[DVec2; 2]> = lines.into_iter().map(fitted).collect();
    let half = |side: Side| {
        let members = side.members(sensor.subpixels());
        let of_ray = |k: usize| members.iter().map(|&s| weights(k)[s] / all).sum::<f64>();
        match members.is_empty() {
            true => Vec::new(),
            false => (0..lines.len()).map(of_ray).collect(),
        }
    };
    let displaced = draws_px(camera, middle, &bundle, DRAWS).unwrap_or_default();
    let displaced =
        (displaced.chunks_exact(DRAWS)).map(|draws| draws.iter().map(|d| d.to_array()).collect());
    Some(BlurRays {
        displaced_px: displaced.collect(),
        x_px: lines.iter().map(|[a, b]| [a.x, b.x]).collect(),
        y_px: lines.iter().map(|[a, b]| [a.y, b.y]).collect(),
        left: half(Side::Left),
        right: half(Side::Right),
        top: half(Side::Top),
        bottom: half(Side::Bottom),
    })
}
