//! What is matched: opposite views, and what is known of their camera.

use quadpixel::image::{Image, channel};
use quadpixel::simd::SimdLevel;
use quadpixel_datasets::BlurRays;

use super::error::DenseError;
use super::filters::transposed;
use super::kernels::LINEAR_RATIO;
use super::ratio::BlurRatio;
use crate::plane_error::PlaneError;
use crate::warp::{Border, Lobes, Map, warp};

/// Two views that see opposite parts of the pupil (linear, black at 0, one channel each).
#[derive(Clone, Copy)]
pub struct OppositePair<'a> {
    /// Left and right, or top and bottom.
    pub views: [&'a Image; 2],
    /// Ratio κ of disparity to the blur's diameter; absent: ¼, what shares that fall linearly over the pupil give.
    pub ratio: Option<&'a BlurRatio>,
}

/// Opposite views by the direction in which they part the pupil.
#[derive(Clone, Copy, Default)]
pub struct OppositeViews<'a> {
    /// Left, right.
    pub left_right: Option<OppositePair<'a>>,
    /// Top, bottom.
    pub top_bottom: Option<OppositePair<'a>>,
    /// y_T − y_B of what has the same place in left and right, px, at each pixel of the sum: the lens's astigmatism;
    /// absent: none.
    pub astigmatism_px: Option<&'a Image>,
    /// Rays of the camera's own pixel, whose blurs take the place of the family's; absent: the family.
    pub blur: Option<&'a BlurRays>,
    /// Standard deviation of the disparity at a pixel of a textured plane, px, 0 or more, as planes at known distances
    /// told it of this camera: the least σ with the family's blurs. Absent: what those err by on cameras that nobody
    /// measured, which is more. The camera's own rays ([`Self::blur`]) have a σ of their own.
    pub matching_error_px: Option<f64>,
    /// The picture whose edges count, in colour (linear, black at 0, any number of channels); absent: the mean of the
    /// first pair, one brought to the brightness of the other.
    pub picture: Option<&'a Image>,
}

impl OppositeViews<'_> {
    /// The picture has the size of the views, and numbers that are finite.
    pub(super) fn check_picture(&self) -> Result<(), DenseError> {
        let size = |image: &Image| (image.width(), image.height());
        let pair = self.left_right.as_ref().or(self.top_bottom.as_ref());
        let Some((picture, pair)) = self.picture.zip(pair) else {
            return Ok(());
        };
        if size(picture) != size(pair.views[0]) {
            return Err(DenseError::PictureSize {
                views: size(pair.views[0]),
                picture: size(picture),
            });
        }
        (0..picture.channels()).try_for_each(|c| Ok(PlaneError::check(&channel(picture, c))?))
    }
}

impl OppositePair<'_> {
    /// κ, which serves the views.
    pub(super) fn ratio(&self) -> Result<BlurRatio, DenseError> {
        let ratio = (self.ratio.cloned()).unwrap_or(BlurRatio::Whole(LINEAR_RATIO));
        ratio.check((self.views[0].width(), self.views[0].height()))?;
        Ok(ratio)
    }

    /// The views without a disparity along y; rows as columns where asked.
    pub(super) fn aligned(
        &self,
        is_turned: bool,
        along_y_px: Option<&Image>,
    ) -> Result<[Image; 2], DenseError> {
        for view in self.views {
            PlaneError::check(view)?;
        }
        let Some(offset) = along_y_px else {
            return Ok(self.views.map(|view| match is_turned {
                true => transposed(view),
                false => view.clone(),
            }));
        };
        PlaneError::check(offset)?;
        let size = |image: &Image| (image.width(), image.height());
        for view in self.views {
            if size(view) != size(offset) {
                return Err(DenseError::Size {
                    left: size(view),
                    right: size(offset),
                });
            }
        }
        let moved = |view: &Image, part: f64| {
            let at = |x: usize, y: usize| {
                let shift = part * f64::from(offset.pixel(x, y)[0]);
                (x as f64, y as f64 + shift)
            };
            // A picture that was checked has a pixel.
            let Ok(map) = Map::from_fn(view.width(), view.height(), at) else {
                return view.clone();
            };
            let level = SimdLevel::detect();
            let moved = warp(view, &map, Lobes::Three, Border::Reflect101, level).image;
            if is_turned { transposed(&moved) } else { moved }
        };
        Ok([moved(self.views[0], 0.5), moved(self.views[1], -0.5)])
    }
}
