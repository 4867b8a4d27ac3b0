//! The ratio κ of disparity to blur: of the whole picture, or pixel by pixel.
//!
//! Off the axis light comes in from one side, so that the halves see other parts of the pupil than in the middle. A
//! phone's κ changes little over the picture; that of a camera whose microlenses stand over the middle of their pixels
//! falls to a third towards its sides.

use quadpixel::image::Image;

use super::error::DenseError;
use super::filters::{by_rows, transposed};
use super::kernels::{LEAST_RATIO, SHARP_RATIO};

/// Least κ of a field, a part of its mean: the blur that belongs to less is wider than texture.
const LEAST_OF_MEAN: f64 = 0.3;
/// κ of a square pupil with a sharp split, the most of any: a stop of blades lies between it and a disk.
const SQUARE_RATIO: f64 = 0.5;

/// κ, 0.01 to 4/(3π): the distance of the views' centroids over the diameter of the blur.
#[derive(Clone, Debug, PartialEq)]
pub enum BlurRatio {
    /// The same everywhere.
    Whole(f64),
    /// At each pixel of the views, one channel.
    Field(Image),
}

impl BlurRatio {
    /// Of a field with this mean over `width` × `height` pixels, by `at(column, row)`; numbers that are none, and
    /// those below a third of the mean, below 0.01 or above 4/(3π), are brought there. A mean that no pupil has (above
    /// that of a square one) stands alone.
    pub fn of_field(
        [width, height]: [usize; 2],
        mean: f64,
        at: impl Fn(usize, usize) -> f64 + Sync,
    ) -> Self {
        if !(mean > 0.0 && mean <= SQUARE_RATIO) {
            return Self::Whole(mean);
        }
        let least = (LEAST_OF_MEAN * mean).max(LEAST_RATIO);
        Self::Field(by_rows(width, height, |y, to| {
            for (x, to) in to.iter_mut().enumerate() {
                let ratio = at(x, y);
                let ratio = if ratio.is_nan() { mean } else { ratio };
                // As f32 the ends lie beside what they stand for.
                *to = ratio.clamp(least + 1e-7, SHARP_RATIO - 1e-7) as f32;
            }
        }))
    }

    /// The mean over the picture.
    pub fn mean(&self) -> f64 {
        match self {
            Self::Whole(ratio) => *ratio,
            Self::Field(field) => {
                let sum: f64 = field.data().iter().map(|v| f64::from(*v)).sum();
                sum / field.data().len() as f64
            }
        }
    }

    /// At a pixel of the views, by its row-major number.
    pub(super) fn at(&self, pixel: usize) -> f64 {
        match self {
            Self::Whole(ratio) => *ratio,
            Self::Field(field) => f64::from(field.data()[pixel]),
        }
    }

    /// Rows as columns.
    pub(super) fn turned(&self) -> Self {
        match self {
            Self::Whole(ratio) => Self::Whole(*ratio),
            Self::Field(field) => Self::Field(transposed(field)),
        }
    }

    /// Numbers of pixels of the mean κ, as those of each pixel's own.
    pub(super) fn scaled(&self, mut of_mean: Image) -> Image {
        if let Self::Field(field) = self {
            let mean = self.mean();
            (of_mean.data_mut().iter_mut().zip(field.data()))
                .for_each(|(v, ratio)| *v = (f64::from(*v) * f64::from(*ratio) / mean) as f32);
        }
        of_mean
    }

    /// What [`Self::scaled`] undoes.
    pub(super) fn of_mean(&self, mut own: Image) -> Image {
        if let Self::Field(field) = self {
            let mean = self.mean();
            (own.data_mut().iter_mut().zip(field.data()))
                .for_each(|(v, ratio)| *v = (f64::from(*v) * mean / f64::from(*ratio)) as f32);
        }
        own
    }

    /// Whether it serves views of this size.
    pub(super) fn check(&self, size: (usize, usize)) -> Result<(), DenseError> {
        let field = match self {
            Self::Whole(ratio) => return check(*ratio),
            Self::Field(field) => field,
        };
        if (field.width(), field.height(), field.channels()) != (size.0, size.1, 1) {
            return Err(DenseError::RatioSize {
                views: size,
                field: (field.width(), field.height()),
            });
        }
        (field.data().iter()).try_for_each(|ratio| check(f64::from(*ratio)))
    }
}

fn check(ratio: f64) -> Result<(), DenseError> {
    match (LEAST_RATIO..=SHARP_RATIO).contains(&ratio) {
        true => Ok(()),
        false => Err(DenseError::Ratio(ratio)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ratio_below_every_pixel_of_a_description_is_brought_to_the_least_and_given_by_hand_refused()
     {
        for mean in [1e-30, 0.004, 0.05, SHARP_RATIO, 0.43] {
            let field = BlurRatio::of_field([3, 2], mean, |x, _| mean * 0.1 * x as f64);
            assert_eq!(field.check((3, 2)), Ok(()), "{mean}");
            assert!(field.mean() >= LEAST_RATIO);
        }
        for bad in [0.0, 1e-300, 0.004, 0.5, f64::NAN] {
            assert!(BlurRatio::Whole(bad).check((3, 2)).is_err(), "{bad}");
        }
        for none in [-1.0, 0.51] {
            let field = BlurRatio::of_field([3, 2], none, |_, _| 0.1);
            assert_eq!(field, BlurRatio::Whole(none));
        }
    }
}
