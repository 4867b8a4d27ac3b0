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
mod panels;
mod thumbnail;

use quadpixel::image::colour::{Rgb, blue_white_red, viridis};
use quadpixel::image::srgb;
use quadpixel::image::views::Side;
use quadpixel::sensor::Subpixels;

use crate::describe::Description;
use canvas::ADVANCE;
pub use canvas::Sheet;
pub use panels::{Panels, Rows};
pub use thumbnail::Thumbnail;

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

/// Width of every sheet, px.
pub const SHEET_WIDTH: usize = 4 * TILE + 5 * MARGIN;
/// Height of every sheet, px.
pub const SHEET_HEIGHT: usize = HEADER + 2 * (CAPTION + TILE + FOOTER);

/// Draws the sheet of a sample.
pub fn contact_sheet(panels: &Panels, description: &Description) -> Sheet {
    let mut sheet = Sheet::new(SHEET_WIDTH, SHEET_HEIGHT, BACKGROUND);
    let subpixels = description.sensor.subpixels;
    title(&mut sheet, description);
    sheet.light(0, 0, "sum", &panels.sum, 1.0);
    views(&mut sheet, &panels.views, subpixels);
    sheet.light(2, 0, "target", &panels.target, 1.0);
    match &panels.left_and_right {
        Some(both) => {
            let members = Side::Left.members(subpixels).len();
            let gain = subpixels.count() as f32 / members.max(1) as f32;
            sheet.light(3, 0, "L red, R cyan", both, gain);
        }
        None => sheet.empty(3, 0, "L and R"),
    }
    depth(&mut sheet, &panels.depth_m);
    match &panels.left_right_px {
        Some(map) => signed(&mut sheet, 1, "x_L - x_R, px", map),
        None => sheet.empty(1, 1, "x_L - x_R"),
    }
    signed(&mut sheet, 2, "coc, px (+ behind)", &panels.coc_px);
    occlusion(&mut sheet, &panels.occlusion);
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

    fn light(&mut self, column: usize, row: usize, caption: &str, image: &Thumbnail, gain: f32) {
        let (x, y) = self.caption(column, row, caption);
        self.thumbnail((x, y, TILE), image, |p| light(p, gain));
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

fn views(sheet: &mut Sheet, views: &[Thumbnail], subpixels: Subpixels) {
    let names = subpixels.names();
    let caption = if names.len() <= 4 {
        format!("views {}", names.join(" "))
    } else {
        format!("{subpixels} views")
    };
    let (x, y) = sheet.caption(1, 0, &caption);
    let side = TILE / subpixels.m().max(subpixels.n());
    for (index, view) in views.iter().enumerate() {
        let (column, row) = subpixels.column_row(index);
        let place = (x + column * side, y + row * side, side - 1);
        sheet.thumbnail(place, view, |p| light(p, names.len() as f32));
    }
}

fn depth(sheet: &mut Sheet, map: &Thumbnail) {
    let (x, y) = sheet.caption(0, 1, "depth, m");
    let range = map.range();
    let (near, far) = range.unwrap_or((1.0, 1.0));
    let span = (1.0 / near - 1.0 / far).max(f32::MIN_POSITIVE);
    sheet.thumbnail((x, y, TILE), map, |p| match p[0] {
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

fn signed(sheet: &mut Sheet, column: usize, caption: &str, map: &Thumbnail) {
    let (x, y) = sheet.caption(column, 1, caption);
    let (low, high) = map.range().unwrap_or((0.0, 0.0));
    let scale = low.abs().max(high.abs()).max(LEAST_SCALE_PX);
    sheet.thumbnail((x, y, TILE), map, |p| {
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

fn occlusion(sheet: &mut Sheet, map: &Thumbnail) {
    let (x, y) = sheet.caption(3, 1, "occluded pupil");
    sheet.thumbnail((x, y, TILE), map, |p| {
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
