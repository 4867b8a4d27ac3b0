//! Letters of the bundled font as exact-area coverage, at any place, size and turn.

use super::paint::Band;
use ab_glyph::{Font, FontRef, InvalidFont, OutlineCurve, Point};
use ab_glyph_rasterizer::{Rasterizer, point};

/// Roboto Regular, printable ASCII; licence in `generators/charts/fonts`.
const FONT: &[u8] = include_bytes!("fonts/Roboto-Regular-ascii.ttf");

/// One letter's coverage (0..1, row-major) with its upper left corner in texels of the canvas.
pub(super) struct Letter {
    x: i32,
    y: i32,
    width: usize,
    height: usize,
    coverage: Vec<f32>,
}

/// The bundled font.
pub(super) struct Lettering {
    font: FontRef<'static>,
    units_per_em: f32,
}

/// Where a text stands: the start of its base line in texels, its em height in texels, and its turn (radians, from x to
/// y).
#[derive(Clone, Copy)]
pub(super) struct Placement {
    pub(super) origin: [f32; 2],
    pub(super) em: f32,
    pub(super) angle: f32,
}

impl Lettering {
    /// Parses the bundled font.
    pub(super) fn new() -> Result<Self, InvalidFont> {
        let font = FontRef::try_from_slice(FONT)?;
        let units_per_em = font.units_per_em().unwrap_or(2048.0);
        Ok(Self { font, units_per_em })
    }

    /// Length of `text` in ems.
    pub(super) fn length_em(&self, text: &str) -> f32 {
        text.chars().map(|c| self.advance_em(c)).sum()
    }

    fn advance_em(&self, c: char) -> f32 {
        self.font.h_advance_unscaled(self.font.glyph_id(c)) / self.units_per_em
    }

    /// The letters of `text` that touch the box [x0, y0, x1, y1] (texels).
    pub(super) fn text(&self, text: &str, at: Placement, clip: [f32; 4]) -> Vec<Letter> {
        let (sin, cos) = at.angle.sin_cos();
        let mut pen = 0.0;
        let mut letters = Vec::new();
        for c in text.chars() {
            let start = [at.origin[0] + pen * cos, at.origin[1] + pen * sin];
            // Roboto's outlines stay within 1.2 em of their origin.
            let reach = 1.2 * at.em;
            if start[0] > clip[0] - reach
                && start[0] < clip[2] + reach
                && start[1] > clip[1] - reach
                && start[1] < clip[3] + reach
            {
                letters.extend(self.letter(
                    c,
                    Placement {
                        origin: start,
                        ..at
                    },
                ));
            }
            pen += self.advance_em(c) * at.em;
        }
        letters
    }

    /// One letter, or none for a blank.
    fn letter(&self, c: char, at: Placement) -> Option<Letter> {
        let outline = self.font.outline(self.font.glyph_id(c))?;
        let scale = at.em / self.units_per_em;
        let (sin, cos) = at.angle.sin_cos();
        // The font's y points up, the canvas's down.
        let place = |p: Point| {
            let (x, y) = (p.x * scale, -p.y * scale);
            [
                at.origin[0] + x * cos - y * sin,
                at.origin[1] + x * sin + y * cos,
            ]
        };
        let bounds = outline.bounds;
        let corners = [
            place(bounds.min),
            place(bounds.max),
            place(ab_glyph::point(bounds.min.x, bounds.max.y)),
            place(ab_glyph::point(bounds.max.x, bounds.min.y)),
        ];
        let low = |k: usize| {
            corners
                .iter()
                .map(|p| p[k])
                .fold(f32::INFINITY, f32::min)
                .floor()
        };
        let high = |k: usize| {
            corners
                .iter()
                .map(|p| p[k])
                .fold(f32::NEG_INFINITY, f32::max)
                .ceil()
        };
        let (left, top) = (low(0) - 1.0, low(1) - 1.0);
        let (width, height) = ((high(0) - left) as usize + 1, (high(1) - top) as usize + 1);
        let mut raster = Rasterizer::new(width, height);
        let local = |p: Point| {
            let [x, y] = place(p);
            point(x - left, y - top)
        };
        for curve in outline.curves {
            match curve {
                OutlineCurve::Line(a, b) => raster.draw_line(local(a), local(b)),
                OutlineCurve::Quad(a, b, c) => raster.draw_quad(local(a), local(b), local(c)),
                OutlineCurve::Cubic(a, b, c, d) => {
                    raster.draw_cubic(local(a), local(b), local(c), local(d))
                }
            }
        }
        let mut coverage = vec![0.0; width * height];
        raster.for_each_pixel(|i, share| coverage[i] = share.clamp(0.0, 1.0));
        Some(Letter {
            x: left as i32,
            y: top as i32,
            width,
            height,
            coverage,
        })
    }
}

impl Letter {
    /// Paints the letter in `colour`, as far as it lies in the box `clip` ([x0, y0, x1, y1], whole texels).
    pub(super) fn paint<const C: usize>(
        &self,
        band: &mut Band<C>,
        clip: [f32; 4],
        colour: [f32; C],
    ) {
        let (x, y) = (self.x as f32, self.y as f32);
        let bounds = [
            x.max(clip[0]),
            y.max(clip[1]),
            (x + self.width as f32).min(clip[2]),
            (y + self.height as f32).min(clip[3]),
        ];
        band.fill(bounds, colour, |px, py| {
            let (i, j) = ((px - x) as usize, (py - y) as usize);
            self.coverage[j * self.width + i]
        });
    }
}
