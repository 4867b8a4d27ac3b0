//! A picture with depth, checked.

use std::sync::Arc;

use super::error::RgbdError;
use crate::image::Image;

/// Linear light and depth of the same pixels, which clones share.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthPicture {
    light: Arc<Image>,
    depth_mm: Arc<Image>,
}

impl DepthPicture {
    /// From W × H × 3 radiance and W × H × 1 depth, z from the first lens vertex in mm: +∞ is the sky, NaN not known.
    ///
    /// # Errors
    /// Sizes that differ, light that is none, depths that are none, not one depth that is known.
    pub fn new(light: Image, depth_mm: Image) -> Result<Self, RgbdError> {
        let of = |image: &Image| {
            let (w, h) = (image.width(), image.height());
            format!("{w} × {h} px × {} channels", image.channels())
        };
        let same = light.width() == depth_mm.width() && light.height() == depth_mm.height();
        let lit = light.width() > 0 && light.height() > 0;
        if !(same && lit && light.channels() == 3 && depth_mm.channels() == 1) {
            return Err(RgbdError::Sizes {
                picture: of(&light),
                depth: of(&depth_mm),
            });
        }
        let width = light.width();
        let dark = |v: &f32| !(v.is_finite() && *v >= 0.0);
        if let Some(i) = light.data().iter().position(dark) {
            return Err(RgbdError::Light {
                value: light.data()[i],
                x: i / 3 % width,
                y: i / 3 / width,
            });
        }
        if let Some(i) = depth_mm.data().iter().position(|d| *d <= 0.0) {
            return Err(RgbdError::Depth {
                value: depth_mm.data()[i],
                x: i % width,
                y: i / width,
            });
        }
        match depth_mm.data().iter().all(|d| d.is_nan()) {
            true => Err(RgbdError::NoDepth),
            false => Ok(Self {
                light: Arc::new(light),
                depth_mm: Arc::new(depth_mm),
            }),
        }
    }

    /// Linear radiance, 3 channels.
    pub fn light(&self) -> &Image {
        &self.light
    }

    /// Depth, mm.
    pub fn depth_mm(&self) -> &Image {
        &self.depth_mm
    }

    /// Largest and smallest inverse depth that is known, per mm.
    pub fn inverse_range_per_mm(&self) -> [f64; 2] {
        let known = self.depth_mm.data().iter().filter(|d| !d.is_nan());
        let (near, far) = known.fold((0.0f64, f64::INFINITY), |(n, f), d| {
            let t = 1.0 / f64::from(*d);
            (n.max(t), f.min(t))
        });
        [near, far]
    }

    /// The depth that `share` (0 to 1) of the pixels with a known depth are nearer than or as near as, mm.
    pub fn depth_quantile_mm(&self, share: f64) -> f64 {
        let known = self.depth_mm.data().iter().filter(|d| !d.is_nan());
        let mut known: Vec<f32> = known.copied().collect();
        let last = known.len() - 1;
        let place = (share.clamp(0.0, 1.0) * last as f64).round() as usize;
        let (_, depth, _) = known.select_nth_unstable_by(place, f32::total_cmp);
        f64::from(*depth)
    }
}
