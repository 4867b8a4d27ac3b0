//! The directions in which a pixel parts the pupil, each with its pair of views: what both cost together.

use quadpixel::image::Image;
use rayon::prelude::*;

use super::cost::{Candidates, Volume, volume};
use super::error::DenseError;
use super::filters::mean;
use super::guide::Guide;
use super::opposite::{OppositePair, OppositeViews};
use super::prepare::Pyramid;
use super::pupils::Pupils;
use super::ratio::BlurRatio;
use super::ray_pupil::RayPupil;

/// What noise does not exceed, in its standard deviations.
const NOISE_DEVIATIONS: f64 = 6.0;
/// What is less comes of short numbers, parts of white: less than a step of 16 bits.
const ROUNDING: f64 = 1e-5;

/// A pair of views, rows along the direction in which it parts the pupil.
pub(super) struct Direction {
    pyramid: Pyramid,
    ratio: BlurRatio,
    pupils: Pupils,
    is_ratio_known: bool,
    matching_error_px: Option<f64>,
    /// Rows of the first direction are columns here.
    is_turned: bool,
    /// Disparity here over that of the first direction, the means over the picture.
    scale: f64,
}

impl Direction {
    /// Of the pair that is told first, as one of `views`; `is_turned`: its rows are columns of the views.
    pub fn first(
        pair: &OppositePair<'_>,
        is_turned: bool,
        views: &OppositeViews<'_>,
    ) -> Result<Self, DenseError> {
        let ratio = pair.ratio()?;
        let ratio = if is_turned { ratio.turned() } else { ratio };
        let [a, b] = pair.aligned(is_turned, None)?;
        let rays = (views.blur).and_then(|blur| RayPupil::new(blur, is_turned));
        let guide = views.picture.map(|picture| Guide::new(picture, is_turned));
        Ok(Self {
            pyramid: Pyramid::new(&a, &b, guide)?,
            pupils: Pupils::new(&ratio, ratio.mean(), (a.width(), a.height()), rays),
            ratio,
            is_ratio_known: pair.ratio.is_some(),
            matching_error_px: views.matching_error_px,
            is_turned: false,
            scale: 1.0,
        })
    }

    /// Of top and bottom beside left and right.
    pub fn across(
        pair: &OppositePair<'_>,
        first: &Self,
        views: &OppositeViews<'_>,
    ) -> Result<Self, DenseError> {
        let astigmatism_px = views.astigmatism_px;
        let size = |image: &Image| (image.width(), image.height());
        let wanted = (
            first.pyramid.guides[0].width(),
            first.pyramid.guides[0].height(),
        );
        if size(pair.views[0]) != wanted {
            return Err(DenseError::Size {
                left: wanted,
                right: size(pair.views[0]),
            });
        }
        let ratio = pair.ratio()?.turned();
        let (mean, [a, b]) = (first.ratio.mean(), pair.aligned(true, astigmatism_px)?);
        let rays = (first.pupils.rays().zip(views.blur)).and_then(|(first, blur)| {
            RayPupil::new(blur, true)?.beside(first, astigmatism_px.is_some())
        });
        Ok(Self {
            pyramid: Pyramid::new(&a, &b, None)?,
            pupils: Pupils::new(&ratio, mean, (a.width(), a.height()), rays),
            is_ratio_known: pair.ratio.is_some(),
            matching_error_px: views.matching_error_px,
            is_turned: true,
            scale: ratio.mean() / mean,
            ratio,
        })
    }

    /// The views at every resolution.
    pub fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// κ, pixel by pixel as the first direction sees them.
    pub fn ratio(&self) -> BlurRatio {
        match self.is_turned {
            true => self.ratio.turned(),
            false => self.ratio.clone(),
        }
    }

    /// Whether the blurs are those of the camera's own rays.
    pub fn has_rays(&self) -> bool {
        self.pupils.rays().is_some()
    }

    /// Whether κ was told.
    pub fn is_ratio_known(&self) -> bool {
        self.is_ratio_known
    }

    /// As of [`OppositeViews`].
    pub fn matching_error_px(&self) -> Option<f64> {
        self.matching_error_px
    }

    /// Whether its rows are columns of the first direction.
    pub fn is_turned(&self) -> bool {
        self.is_turned
    }

    /// Disparity here over that of the first direction, the means over the picture.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether no pixel of the sum differs from its surroundings by more than noise, at any resolution, and what there
    /// is is not alike in both views, as a texture as fine as noise would be.
    pub fn is_flat(&self) -> bool {
        let is_flat = |k: usize| {
            let most = NOISE_DEVIATIONS * self.pyramid.most_noise(k).sqrt();
            let most = most.max(ROUNDING) as f32;
            let level = self.pyramid.level(k);
            let square = |image: &Image| mean(image, |v| f64::from(v).powi(2));
            let alike = 2.0 * square(&level.difference) + ROUNDING * ROUNDING;
            level.sum.data().iter().all(|v| v.abs() <= most) && square(&level.sum) <= alike
        };
        // The coarsest first, which takes no time and has texture in most pictures.
        (0..self.pyramid.depth()).rev().all(is_flat)
    }

    /// Numbers of pixels of the mean κ, as those of each pixel's own.
    pub fn scaled(&self, of_mean: Image) -> Image {
        self.ratio.scaled(of_mean)
    }

    /// Numbers of each pixel's own κ, as those of pixels of the mean.
    pub fn of_mean(&self, own: Image) -> Image {
        self.ratio.of_mean(own)
    }

    fn volume(&self, levels: &[usize], candidates: Candidates) -> Volume {
        let costs = volume(&self.pyramid, levels, candidates, &self.pupils);
        if self.is_turned { turned(costs) } else { costs }
    }
}

/// The costs of all directions, on the grid of the first one's `levels[0]`. Costs of a direction are in units of what
/// its noise and the model leave, so that they add.
pub(super) fn volume_of(
    directions: &[Direction],
    levels: &[usize],
    candidates: Candidates,
) -> Volume {
    let mut all = directions[0].volume(levels, candidates);
    for direction in &directions[1..] {
        let more = direction.volume(levels, candidates);
        let pairs = all.costs.par_iter_mut().zip(&more.costs);
        pairs.for_each(|(sum, more)| *sum += more);
    }
    all
}

/// Rows as columns.
fn turned(volume: Volume) -> Volume {
    let (width, height, n) = (volume.height, volume.width, volume.candidates.count);
    let mut costs = vec![0.0f32; volume.costs.len()];
    (costs.par_chunks_mut(width * n).enumerate()).for_each(|(y, row)| {
        for (x, to) in row.chunks_exact_mut(n).enumerate() {
            to.copy_from_slice(&volume.costs[(x * height + y) * n..][..n]);
        }
    });
    Volume {
        width,
        height,
        candidates: volume.candidates,
        costs,
    }
}
