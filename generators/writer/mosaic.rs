//! What a sensor of one colour per microlens reads: one channel of each place, picked from the mosaic of all.

use quadpixel::image::Image;
use quadpixel_datasets::{CodeLevels, Mosaic, Raw};

use crate::describe::Description;

/// The channel of each microlens's colour, of m·W × n·H values of R, G, B, or of rows of them from `first_row` of the
/// pixels on; `None` without a pattern.
pub fn picked(description: &Description, all: &Image, first_row: usize) -> Option<Image> {
    let pattern = description.mosaic?;
    let subpixels = description.sensor.subpixels;
    let (m, n) = (subpixels.m(), subpixels.n());
    let mut picked = Image::zeros(all.width(), all.height(), 1);
    for y in 0..all.height() {
        for x in 0..all.width() {
            picked.pixel_mut(x, y)[0] = all.pixel(x, y)[pattern.channel(x / m, first_row + y / n)];
        }
    }
    Some(picked)
}

/// What `meta.json` says of it; `None` without a pattern.
pub(super) fn described(description: &Description, raw: &Raw) -> Option<Mosaic> {
    let noisy = description.noise.readout().map(|readout| CodeLevels {
        black_level: readout.black_level,
        white_level: readout.largest_code(),
    });
    Some(Mosaic {
        pattern: description.mosaic?,
        clean: CodeLevels {
            black_level: raw.black_level?,
            white_level: raw.white_level?,
        },
        noisy,
    })
}
