//! The image that the sensor sees: a mosaic of sub-pixels, and its views.

use crate::image::Image;
use crate::sensor::Subpixels;

/// A mosaic of m·W × n·H sub-pixels, RGB, linear. Unit: sr times the unit of radiance (irradiance averaged over the
/// pixel).
#[derive(Clone, Debug, PartialEq)]
pub struct SubPixelImage {
    /// Sub-pixels below each microlens.
    pub subpixels: Subpixels,
    /// The mosaic.
    pub mosaic: Image,
}

impl SubPixelImage {
    /// Microlenses in a row, rows of microlenses.
    pub fn size(&self) -> (usize, usize) {
        (
            self.mosaic.width() / self.subpixels.m(),
            self.mosaic.height() / self.subpixels.n(),
        )
    }

    /// The view (sub-aperture image) of sub-pixel `index`: W × H × 3.
    pub fn view(&self, index: usize) -> Image {
        let (m, n) = (self.subpixels.m(), self.subpixels.n());
        let (width, height) = self.size();
        let channels = self.mosaic.channels();
        let mut view = Image::zeros(width, height, channels);
        let (i, j) = (index % m, (index / m).min(n - 1));
        for row in 0..height {
            for column in 0..width {
                let source = self.mosaic.pixel(column * m + i, row * n + j);
                view.pixel_mut(column, row).copy_from_slice(source);
            }
        }
        view
    }

    /// The sum of all views: the picture of an ordinary pixel.
    pub fn sum(&self) -> Image {
        let (m, n) = (self.subpixels.m(), self.subpixels.n());
        let (width, height) = self.size();
        let mut sum = Image::zeros(width, height, self.mosaic.channels());
        for y in 0..height * n {
            for x in 0..width * m {
                for (s, &v) in sum
                    .pixel_mut(x / m, y / n)
                    .iter_mut()
                    .zip(self.mosaic.pixel(x, y))
                {
                    *s += v;
                }
            }
        }
        sum
    }

    /// Multiplies every value by `factor` (exposure).
    pub fn scale(&mut self, factor: f32) {
        self.mosaic.data_mut().iter_mut().for_each(|x| *x *= factor);
    }
}
