//! The directions in which a pixel parts the pupil, each with its pair of views: what both cost together.

use quadpixel::image::Image;
use rayon::prelude::*;

use super::cost::{Candidates, Pupil, Volume, volume};
use super::error::DenseError;
use super::filters::transposed;
use super::kernels::steepness;
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
    /// Of the pair that is told first: of left and right, or of top and bottom turned to rows.
    pub fn first(pair: [&Image; 2], ratio: f64) -> Result<Self, DenseError> {
        Ok(Self {
            pyramid: Pyramid::new(pair[0], pair[1])?,
            pupil: Pupil {
                ratio,
                steepness: steepness(ratio),
            },
            is_turned: false,
            scale: 1.0,
        })
    }

    /// Of the pair across the first one; `first_ratio`: that of the first direction.
    pub fn across(pair: [&Image; 2], ratio: f64, first_ratio: f64) -> Result<Self, DenseError> {
        let [top, bottom] = pair.map(transposed);
        Ok(Self {
            is_turned: true,
            scale: ratio / first_ratio,
            ..Self::first([&top, &bottom], ratio)?
        })
    }

    /// The views at every resolution.
    pub fn pyramid(&self) -> &Pyramid {
        &self.pyramid
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
