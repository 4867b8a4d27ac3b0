//! The picture before its defocus: the all-in-focus target, on the scale of the sum of the sub-pixels.

use super::convert::{LANES_OF_ONE, over_tiles};
use super::relief::Relief;
use super::tile::Scatter;
use crate::image::Image;
use crate::render::Camera;
use crate::render::kernels::KernelBank;

/// Displacements per node and channel.
const SAMPLES: usize = 4096;
/// Part of the light that is cut off on each side.
const CUT: f64 = 2e-3;

/// W × H × 3 mean radiance over each pixel, blurred by diffraction at the lens's aperture where the camera has it: no
/// camera sees more. `None` where the aperture's kernels reach beyond the relief's margin.
pub(super) fn target(camera: &Camera, relief: &Relief, tile: usize) -> Option<Image> {
    let bank = KernelBank::of_aperture(camera, (3, 3), SAMPLES, CUT)?;
    if bank.support()?.reach() > relief.margin {
        return None;
    }
    let sensor = camera.sensor();
    let scatter = Scatter::<LANES_OF_ONE>::new(&bank, relief, sensor, true);
    let mut image = Image::zeros(sensor.width(), sensor.height(), 3);
    over_tiles(sensor, tile, &scatter, |x, y, light, _| {
        image.pixel_mut(x, y).copy_from_slice(&light[..3]);
    });
    Some(image)
}
