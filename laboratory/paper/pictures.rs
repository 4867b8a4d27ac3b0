//! Panels of linear pictures, side by side in sRGB.

use std::error::Error;
use std::path::Path;

use quadpixel::image::srgb::code_from_linear;
use quadpixel::image::{Image, raster};

/// Gap between panels, px.
const GAP: usize = 4;

/// A picture from a file of three channels, its middle cut out to at most `side` px, and the linear value that is shown
/// white.
pub fn panel(path: &Path, side: usize) -> Result<Image, Box<dyn Error>> {
    let whole = raster::read(path)?;
    let (w, h) = (whole.width().min(side), whole.height().min(side));
    let (x0, y0) = ((whole.width() - w) / 2, (whole.height() - h) / 2);
    let mut cut = Image::zeros(w, h, 3);
    for y in 0..h {
        for x in 0..w {
            let from = whole.pixel(x0 + x, y0 + y);
            let last = from.len() - 1;
            for (c, to) in cut.pixel_mut(x, y).iter_mut().enumerate() {
                *to = from[c.min(last)];
            }
        }
    }
    Ok(cut)
}

/// Writes rows of panels, each enlarged `zoom` times and white at its own 99.5th part.
pub fn write(path: &Path, rows: &[Vec<Image>], zoom: usize) -> Result<(), Box<dyn Error>> {
    let width_of = |row: &Vec<Image>| row.iter().map(|p| p.width() * zoom + GAP).sum::<usize>();
    let height_of =
        |row: &Vec<Image>| row.iter().map(Image::height).max().unwrap_or(0) * zoom + GAP;
    let width = rows.iter().map(width_of).max().unwrap_or(0).max(GAP) - GAP;
    let height = rows.iter().map(height_of).sum::<usize>().max(GAP) - GAP;
    let mut codes = vec![255u8; 3 * width * height];
    let mut top = 0;
    for row in rows {
        let mut left = 0;
        for picture in row {
            let white = white(picture);
            for y in 0..picture.height() * zoom {
                for x in 0..picture.width() * zoom {
                    let at = 3 * ((top + y) * width + left + x);
                    for (code, v) in codes[at..at + 3]
                        .iter_mut()
                        .zip(picture.pixel(x / zoom, y / zoom))
                    {
                        *code = code_from_linear(v / white);
                    }
                }
            }
            left += picture.width() * zoom + GAP;
        }
        top += height_of(row);
    }
    raster::write_jpeg(path, &codes, width, height, 88).map_err(Into::into)
}

fn white(picture: &Image) -> f32 {
    let mut values: Vec<f32> = picture
        .data()
        .iter()
        .copied()
        .filter(|v| v.is_finite())
        .collect();
    values.sort_by(f32::total_cmp);
    let at = values.len().saturating_sub(1) * 995 / 1000;
    values.get(at).copied().unwrap_or(1.0).max(1e-6)
}
