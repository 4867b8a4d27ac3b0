//! The contact sheet of a sample: what a person needs to see at once whether it is right.
//!
//! ```text
//! title: sample, lens, focus, charts
//! sum            views (as stored)   target             L red, R cyan
//! depth          x_L − x_R           circle of conf.    occlusion
//! ```
//!
//! Light is shown as stored (1 = white) through the sRGB curve, a view multiplied by the number of sub-pixels. Depth
//! colours are linear in 1/z, near is yellow; signed maps are blue (negative), white (0), red (positive) on a symmetric
//! scale.

pub mod canvas;
mod font;

use quadpixel::image::colour::{Rgb, blue_white_red, viridis};
use quadpixel::image::{Image, srgb};

use quadpixel::image::views::{Side, sum_of};

use crate::describe::Description;
use canvas::ADVANCE;
pub use canvas::Sheet;

const TILE: usize = 256;
const MARGIN: usize = 12;
const HEADER: usize = 52;
const CAPTION: usize = 20;
const FOOTER: usize = 36;
const BACKGROUND: Rgb = [32, 32, 34];
const TEXT: Rgb = [225, 225, 225];
const DIM: Rgb = [150, 150, 150];
const NO_TRUTH: Rgb = [70, 20, 60];
const SKY: Rgb = [150, 175, 205];
/// Signed maps reach at least this, px, so that rounding noise does not look like a signal.
const LEAST_SCALE_PX: f32 = 0.1;

/// What the sheet shows.
#[derive(Clone, Debug)]
pub struct Pictures<'a> {
    /// For the title.
    pub description: &'a Description,
    /// One view per sub-pixel in stored order.
    pub views: &'a [Image],
    /// Their sum.
    pub sum: &'a Image,
    /// The all-in-focus image.
    pub target: &'a Image,
    /// Depth, m.
    pub depth_m: &'a Image,
    /// x_L − x_R, px; `None` for a pixel of one column.
    pub left_right_px: Option<&'a Image>,
    /// Circle of confusion, px.
    pub coc_px: &'a Image,
    /// Occluded fraction of the pupil.
    pub occlusion: &'a Image,
}

/// Width of every sheet, px.
pub const SHEET_WIDTH: usize = 4 * TILE + 5 * MARGIN;
/// Height of every sheet, px.
pub const SHEET_HEIGHT: usize = HEADER + 2 * (CAPTION + TILE + FOOTER);

/// Draws the sheet.
pub fn contact_sheet(pictures: &Pictures<'_>) -> Sheet {
    let mut sheet = Sheet::new(SHEET_WIDTH, SHEET_HEIGHT, BACKGROUND);
    title(&mut sheet, pictures.description);
    sheet.light(0, 0, "sum", pictures.sum, 1.0);
    views(&mut sheet, pictures);
    sheet.light(2, 0, "target", pictures.target, 1.0);
    anaglyph(&mut sheet, pictures);
    depth(&mut sheet, pictures.depth_m);
    match pictures.left_right_px {
        Some(map) => signed(&mut sheet, 1, "x_L - x_R, px", map),
        None => sheet.empty(1, 1, "x_L - x_R"),
    }
    signed(&mut sheet, 2, "coc, px (+ behind)", pictures.coc_px);
    occlusion(&mut sheet, pictures);
    sheet
}

/// Top left corner of the picture in tile (column, row).
fn corner(column: usize, row: usize) -> (usize, usize) {
    let x = MARGIN + column * (TILE + MARGIN);
    (x, HEADER + CAPTION + row * (CAPTION + TILE + FOOTER))
}

impl Sheet {
    fn caption(&mut self, column: usize, row: usize, text: &str) -> (usize, usize) {
        let (x, y) = corner(column, row);
        self.text(x, y - CAPTION + 2, 2, text, TEXT);
        (x, y)
    }

    fn light(&mut self, column: usize, row: usize, caption: &str, image: &Image, gain: f32) {
        let (x, y) = self.caption(column, row, caption);
        self.picture((x, y, TILE), image, |p| light(p, gain));
    }

    fn empty(&mut self, column: usize, row: usize, caption: &str) {
        let (x, y) = self.caption(column, row, caption);
        self.text(x, y + TILE / 2, 2, "one column: no l, r", DIM);
    }
}

fn light(pixel: &[f32], gain: f32) -> Rgb {
    let code = |c: usize| srgb::code_from_linear(pixel.get(c).unwrap_or(&pixel[0]) * gain);
    [code(0), code(1), code(2)]
}

fn title(sheet: &mut Sheet, given: &Description) {
    let focus = match given.focus.distance_m {
        Some(distance) => format!("focus {} m", number(distance)),
        None => "focus at infinity".to_string(),
    };
    let subpixels = given.sensor.subpixels;
    let first = format!(
        "{:06}  {}  f={} mm  F/{}  {focus}",
        given.index,
        given.lens.name,
        number(given.lens.efl_mm),
        number(given.lens.f_number),
    );
    let second = format!(
        "{}x{} px of {} um, {subpixels} sub-pixels, {} response: {}",
        given.sensor.width_px,
        given.sensor.height_px,
        number(given.sensor.pitch_um),
        given.response.label(),
        given.scene.charts.join(", "),
    );
    sheet.text(MARGIN, 8, 2, &first, TEXT);
    sheet.text(MARGIN, 28, 2, &second, DIM);
}

fn views(sheet: &mut Sheet, pictures: &Pictures<'_>) {
    let subpixels = pictures.description.sensor.subpixels;
    let names = subpixels.names();
    let caption = if names.len() <= 4 {
        format!("views {}", names.join(" "))
    } else {
        format!("{subpixels} views")
    };
    let (x, y) = sheet.caption(1, 0, &caption);
    let side = TILE / subpixels.m().max(subpixels.n());
    for (index, view) in pictures.views.iter().enumerate() {
        let (column, row) = subpixels.column_row(index);
        let place = (x + column * side, y + row * side, side - 1);
        sheet.picture(place, view, |p| light(p, names.len() as f32));
    }
}

fn anaglyph(sheet: &mut Sheet, pictures: &Pictures<'_>) {
    let subpixels = pictures.description.sensor.subpixels;
    let [left, right] = [Side::Left, Side::Right].map(|side| side.members(subpixels));
    let gain = subpixels.count() as f32 / left.len().max(1) as f32;
    let side = |indices: &[usize]| sum_of(indices.iter().filter_map(|&i| pictures.views.get(i)));
    let (Some(left), Some(right)) = (side(&left), side(&right)) else {
        return sheet.empty(3, 0, "L and R");
    };
    let mut both = Image::zeros(left.width(), left.height(), 3);
    let luma = |p: &[f32]| p.iter().sum::<f32>() / p.len() as f32;
    for y in 0..left.height() {
        for x in 0..left.width() {
            let (l, r) = (luma(left.pixel(x, y)), luma(right.pixel(x, y)));
            both.pixel_mut(x, y).copy_from_slice(&[l, r, r]);
        }
    }
    sheet.light(3, 0, "L red, R cyan", &both, gain);
}

fn finite_range(map: &Image) -> Option<(f32, f32)> {
    let finite = map.data().iter().copied().filter(|v| v.is_finite());
    finite.fold(None, |range, v| {
        let (low, high) = range.unwrap_or((v, v));
        Some((v.min(low), v.max(high)))
    })
}

fn depth(sheet: &mut Sheet, map: &Image) {
    let (x, y) = sheet.caption(0, 1, "depth, m");
    let range = finite_range(map);
    let (near, far) = range.unwrap_or((1.0, 1.0));
    let span = (1.0 / near - 1.0 / far).max(f32::MIN_POSITIVE);
    sheet.picture((x, y, TILE), map, |p| match p[0] {
        z if z.is_nan() => NO_TRUTH,
        z if z.is_infinite() => SKY,
        z => viridis((1.0 / z - 1.0 / far) / span),
    });
    if range.is_some() {
        sheet.bar((x, y + TILE + 4), (TILE, 7), |t| viridis(1.0 - t));
        labels(
            sheet,
            (x, y),
            [&number(f64::from(near)), "", &number(f64::from(far))],
        );
    }
}

fn signed(sheet: &mut Sheet, column: usize, caption: &str, map: &Image) {
    let (x, y) = sheet.caption(column, 1, caption);
    let (low, high) = finite_range(map).unwrap_or((0.0, 0.0));
    let scale = low.abs().max(high.abs()).max(LEAST_SCALE_PX);
    sheet.picture((x, y, TILE), map, |p| {
        if p[0].is_nan() {
            NO_TRUTH
        } else {
            blue_white_red(0.5 + 0.5 * p[0] / scale)
        }
    });
    sheet.bar((x, y + TILE + 4), (TILE, 7), blue_white_red);
    let end = number(f64::from(scale));
    let range = format!("{}..{}", number(f64::from(low)), number(f64::from(high)));
    labels(
        sheet,
        (x, y),
        [&format!("-{end}"), &range, &format!("+{end}")],
    );
}

fn occlusion(sheet: &mut Sheet, pictures: &Pictures<'_>) {
    let (x, y) = sheet.caption(3, 1, "occluded pupil");
    sheet.picture((x, y, TILE), pictures.occlusion, |p| {
        [(p[0].clamp(0.0, 1.0) * 255.0).round() as u8; 3]
    });
    sheet.bar((x, y + TILE + 4), (TILE, 7), |t| [(t * 255.0) as u8; 3]);
    labels(sheet, (x, y), ["0", "", "1"]);
}

/// Numbers under a bar: left, middle (small), right.
fn labels(sheet: &mut Sheet, (x, y): (usize, usize), texts: [&str; 3]) {
    for (place, text) in texts.into_iter().enumerate() {
        let scale = if place == 1 { 1 } else { 2 };
        let width = (text.chars().count() * ADVANCE).saturating_sub(1) * scale;
        let left = x + TILE.saturating_sub(width) * place / 2;
        sheet.text(left, y + TILE + 14, scale, text, TEXT);
    }
}

/// Three significant digits without an exponent.
pub fn number(value: f64) -> String {
    let size = if value == 0.0 {
        0.0
    } else {
        value.abs().log10().floor()
    };
    format!("{value:.*}", (2.0 - size).clamp(0.0, 6.0) as usize)
}
