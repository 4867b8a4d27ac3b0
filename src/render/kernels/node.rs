//! The rays of one place of the field, in all channels, as offsets in the picture.

use glam::{DMat2, DVec2};

use crate::render::Camera;
use crate::render::truth::{Bundle, DisparityField, SightRays};
use crate::sampling::SobolSet;
use crate::sensor::Subpixels;

/// Rays that bound a kernel before diffraction, which reaches farther than what they miss of the pupil's edge.
const BOUNDING_RAYS: usize = 1024;

/// Rays of one channel: what they see from the line of sight, and what each is worth.
pub(super) struct NodeRays {
    /// q₀ and q₁ (mm) from the line of sight.
    beside: Vec<[DVec2; 2]>,
    /// `[ray][sub-pixel]`, parts of the sub-pixel's whole.
    shares: Vec<f64>,
    /// ∫ P cos θ dω per sub-pixel, sr.
    pub weights_sr: Vec<f64>,
}

/// One place of the field.
pub(super) struct Node {
    /// One per channel.
    pub channels: Vec<NodeRays>,
    /// As they are without diffraction, where there is any: they bound the kernels.
    undiffracted: Vec<NodeRays>,
    /// J₀ and J₁, mm.
    jacobian: [DMat2; 2],
}

impl Node {
    /// Traces the bundles of a sensor position; `None` where it is dark.
    pub fn new(
        camera: &Camera,
        sight: &SightRays,
        fields: &[DisparityField],
        xy_mm: DVec2,
        samples: &SobolSet,
    ) -> Option<Self> {
        let line = sight.line(camera, xy_mm)?;
        let reference = fields.get(1).or(fields.first())?;
        let rays = |bundle: Bundle| NodeRays::new(&bundle, [line.q0, line.q1_mm]);
        let all = 0..fields.len();
        let channel = |c: usize| Bundle::diffracted(camera, c, xy_mm, samples).map(rays);
        let undiffracted = match camera.lens_diffraction() {
            Some(_) => {
                let few = SobolSet::new(BOUNDING_RAYS.min(samples.len()));
                let plain = |c: usize| Bundle::new(camera, c, xy_mm, &few).map(rays);
                all.clone().map(plain).collect::<Option<_>>()?
            }
            None => Vec::new(),
        };
        Some(Self {
            channels: all.map(channel).collect::<Option<_>>()?,
            undiffracted,
            jacobian: reference.jacobian(xy_mm),
        })
    }

    /// From directions to px of the picture at an inverse depth.
    pub fn to_px(&self, inverse_depth_per_mm: f64) -> DMat2 {
        (self.jacobian[0] + inverse_depth_per_mm * self.jacobian[1]).inverse()
    }

    /// Bounds of where the rays without diffraction land, px, at an inverse depth.
    pub fn bounds_px(&self, inverse_depth_per_mm: f64) -> (DVec2, DVec2) {
        let to_px = self.to_px(inverse_depth_per_mm);
        let rays = match self.undiffracted.is_empty() {
            true => &self.channels,
            false => &self.undiffracted,
        };
        let places = rays.iter().flat_map(|r| &r.beside);
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        places.fold(start, |(low, high), beside| {
            let at = landing_px(beside, to_px, inverse_depth_per_mm);
            (low.min(at), high.max(at))
        })
    }
}

impl NodeRays {
    /// Bytes per ray.
    pub fn bytes(subpixels: Subpixels) -> u64 {
        (size_of::<[DVec2; 2]>() + size_of::<f64>() * subpixels.count()) as u64
    }

    fn new(bundle: &Bundle, [q0, q1_mm]: [DVec2; 2]) -> Self {
        let subpixels = bundle.subpixels;
        let mut sums = vec![0.0; subpixels];
        for weights in bundle.weights.chunks_exact(subpixels) {
            sums.iter_mut().zip(weights).for_each(|(s, w)| *s += w);
        }
        let part = |(i, w): (usize, &f64)| match sums[i % subpixels] {
            sum if sum > 0.0 => w / sum,
            _ => 0.0,
        };
        let seen = bundle.q0.iter().zip(&bundle.q1_mm);
        Self {
            beside: seen.map(|(a, b)| [*a - q0, *b - q1_mm]).collect(),
            shares: bundle.weights.iter().enumerate().map(part).collect(),
            weights_sr: sums.iter().map(|s| s * bundle.scale).collect(),
        }
    }

    /// Where each ray lands from its point, px, and its share of each sub-pixel's light.
    pub fn landings(
        &self,
        to_px: DMat2,
        inverse_depth_per_mm: f64,
    ) -> impl Iterator<Item = (DVec2, &[f64])> {
        let subpixels = self.weights_sr.len();
        let landing = move |beside| landing_px(beside, to_px, inverse_depth_per_mm);
        let places = self.beside.iter().map(landing);
        places.zip(self.shares.chunks_exact(subpixels))
    }
}

fn landing_px([q0, q1_mm]: &[DVec2; 2], to_px: DMat2, inverse_depth_per_mm: f64) -> DVec2 {
    -(to_px * (*q0 + inverse_depth_per_mm * *q1_mm))
}
