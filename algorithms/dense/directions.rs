//! The directions in which a pixel parts the pupil, each with its pair of views: what both cost together.

use quadpixel::image::Image;
use rayon::prelude::*;

use super::cost::{Candidates, Pupil, Volume, volume};
use super::error::DenseError;
use super::kernels::steepness;
use super::opposite::OppositePair;
use super::prepare::Pyramid;

/// A pair of views, rows along the direction in which it parts the pupil.
pub(super) struct Direction {
    pyramid: Pyramid,
    pupil: Pupil,
    /// Rows of the first direction are columns here.
    is_turned: bool,
    /// Disparity here over that of the first direction.
    scale: f64,
}

impl Direction {
    /// Of the pair that is told first; `is_turned`: its rows are columns of the views.
    pub fn first(pair: &OppositePair<'_>, is_turned: bool) -> Result<Self, DenseError> {
        Self::new(pair, is_turned, None)
    }

    fn new(
        pair: &OppositePair<'_>,
        is_turned: bool,
        along_y_px: Option<&Image>,
    ) -> Result<Self, DenseError> {
        let ratio = pair.ratio()?;
        let [a, b] = pair.aligned(is_turned, along_y_px)?;
        Ok(Self {
            pyramid: Pyramid::new(&a, &b)?,
            pupil: Pupil {
                ratio,
                steepness: steepness(ratio),
            },
            is_turned: false,
            scale: 1.0,
        })
    }

    /// Of top and bottom beside left and right.
    pub fn across(
        pair: &OppositePair<'_>,
        first: &Self,
        astigmatism_px: Option<&Image>,
    ) -> Result<Self, DenseError> {
        let size = |image: &Image| (image.width(), image.height());
        let wanted = size(&first.pyramid.guides[0]);
        if size(pair.views[0]) != wanted {
            return Err(DenseError::Size {
                left: wanted,
                right: size(pair.views[0]),
            });
        }
        let own = Self::new(pair, true, astigmatism_px)?;
        Ok(Self {
            is_turned: true,
            scale: own.pupil.ratio / first.pupil.ratio,
            ..own
        })
    }

    /// The views at every resolution.
    pub fn pyramid(&self) -> &Pyramid {
        &self.pyramid
    }

    /// Whether its rows are columns of the first direction.
    pub fn is_turned(&self) -> bool {
        self.is_turned
    }

    /// Disparity here over that of the first direction.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    fn volume(&self, levels: &[usize], candidates: Candidates) -> Volume {
        let own = Candidates {
            first_px: self.scale * candidates.first_px,
            step_px: self.scale * candidates.step_px,
            ..candidates
        };
        let costs = volume(&self.pyramid, levels, own, self.pupil);
        Volume {
            candidates,
            ..if self.is_turned { turned(costs) } else { costs }
        }
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
