//! A small sRGB canvas: pictures fitted into boxes, colour bars and text.

use quadpixel::image::Image;
use quadpixel::image::colour::Rgb;

use super::font::glyph;
use super::thumbnail::Thumbnail;

/// A finished picture, row-major sRGB.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// width × height × 3 codes.
    pub rgb: Vec<u8>,
}

/// Width of a character with its gap, px per unit of scale.
pub(super) const ADVANCE: usize = 6;

impl Sheet {
    /// A sheet of one colour.
    pub fn new(width: usize, height: usize, background: Rgb) -> Self {
        Self {
            width,
            height,
            rgb: background.repeat(width * height),
        }
    }

    /// Paints one pixel; outside the sheet nothing happens.
    pub fn set(&mut self, x: usize, y: usize, colour: Rgb) {
        if x < self.width && y < self.height {
            let at = (y * self.width + x) * 3;
            self.rgb[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Text with its top left corner at (x, y); what runs over the edge is cut.
    pub fn text(&mut self, x: usize, y: usize, scale: usize, text: &str, colour: Rgb) {
        for (place, c) in text.chars().enumerate() {
            for (column, bits) in glyph(c).into_iter().enumerate() {
                for row in (0..7).filter(|row| bits >> row & 1 == 1) {
                    for (dx, dy) in (0..scale * scale).map(|i| (i % scale, i / scale)) {
                        let left = x + (place * ADVANCE + column) * scale;
                        self.set(left + dx, y + row * scale + dy, colour);
                    }
                }
            }
        }
    }

    /// An image fitted into the square of `side` px at (x, y), centred ([`Thumbnail`]). `colour` turns a pixel's
    /// averaged channels into sRGB.
    pub fn picture(
        &mut self,
        (x, y, side): (usize, usize, usize),
        image: &Image,
        colour: impl Fn(&[f32]) -> Rgb,
    ) {
        self.thumbnail((x, y, side), &Thumbnail::of(image, side), colour);
    }

    /// As [`Self::picture`], of what is fitted into such a square already.
    pub fn thumbnail(
        &mut self,
        (x, y, side): (usize, usize, usize),
        thumbnail: &Thumbnail,
        colour: impl Fn(&[f32]) -> Rgb,
    ) {
        let [w, h] = thumbnail.shown();
        let (left, top) = (x + (side - w) / 2, y + (side - h) / 2);
        let mut mean = Vec::new();
        for j in 0..h {
            for i in 0..w {
                thumbnail.mean(i, j, &mut mean);
                self.set(left + i, top + j, colour(&mean));
            }
        }
    }

    /// A horizontal colour bar: `colour` of 0 to 1 from left to right.
    pub fn bar(
        &mut self,
        (x, y): (usize, usize),
        (width, height): (usize, usize),
        colour: impl Fn(f32) -> Rgb,
    ) {
        for i in 0..width {
            let colour_here = colour(i as f32 / (width - 1).max(1) as f32);
            (0..height).for_each(|j| self.set(x + i, y + j, colour_here));
        }
    }
}
