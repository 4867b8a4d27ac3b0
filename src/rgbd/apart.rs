//! The picture before its defocus: the all-in-focus target, on the scale of the sum of the sub-pixels.

use std::ops::Range;

use super::halo::Parts;
use super::relief::Relief;
use super::spread::over_tiles;
use super::tile::Scatter;
use crate::image::Image;
use crate::render::Camera;
use crate::render::kernels::KernelBank;
use crate::sensor::Sensor;

/// Displacements per node and channel.
const SAMPLES: usize = 4096;
/// Part of the light that is cut off on each side.
const CUT: f64 = 2e-3;
/// Lanes of R, G, B alone.
const LANES: usize = 4;

/// Kernels of diffraction at the lens's aperture, of a point where the camera has none. `None` where they reach beyond
/// a relief's margin, px.
pub(super) fn aperture(camera: &Camera, margin: usize) -> Option<KernelBank> {
    let bank = KernelBank::of_aperture(camera, (3, 3), SAMPLES, CUT)?;
    (bank.support()?.reach() <= margin).then_some(bank)
}

/// Mean radiance over each pixel of some rows of a sensor, three channels, blurred by diffraction at the lens's
/// aperture where the camera has it: no camera sees more.
pub(super) fn target(
    (bank, parts): (&KernelBank, &[Parts]),
    relief: &Relief,
    (sensor, rows): (&Sensor, Range<usize>),
    tile: usize,
) -> Image {
    let scatter = Scatter::<LANES>::new((bank, parts), relief, sensor, true);
    let width = sensor.width();
    let mut image = Image::zeros(width, rows.len(), 3);
    let make = |t| scatter.tile(t);
    over_tiles((width, rows), tile, make, |x, y, i, sums| {
        image.pixel_mut(x, y).copy_from_slice(&sums.light[i][..3]);
    });
    image
}
