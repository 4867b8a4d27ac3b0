//! The shift between two views over parts of the field.

use quadpixel::image::{Image, channel};
use quadpixel_algorithms::disparity::{Axes, MatchSettings, Verdict, match_images};
use quadpixel_laboratory::plane_shift::{Window, window_shift_px};
use std::error::Error;

/// Green.
pub const GREEN: usize = 1;

/// A rectangle of a picture, px.
#[derive(Clone, Copy)]
pub struct Part {
    pub x: usize,
    pub y: usize,
    pub side: usize,
}

impl Part {
    fn window(&self) -> Window {
        Window {
            corner: [self.x, self.y],
            size: [self.side; 2],
        }
    }
}

/// The three windows of 256 × 256 px in the middle row of a 768 × 512 picture.
pub fn thirds(width: usize, height: usize) -> [Part; 3] {
    let side = height / 2;
    let y = (height - side) / 2;
    let part = |x| Part { x, y, side };
    [part(0), part((width - side) / 2), part(width - side)]
}

/// Settings of the local matches: whose median the page shows beside the whole window's.
pub fn settings() -> MatchSettings {
    MatchSettings {
        window_px: 31,
        stride_px: 8,
        search_px: 4,
        axes: Axes::Horizontal,
        ..MatchSettings::default()
    }
}

/// x_L − x_R in each part, px, two ways.
pub struct Shift {
    /// One window of the whole part.
    pub whole_px: f64,
    /// Median of the windows of 31 px in it that the matcher trusts; NaN where there is none.
    pub median_px: f64,
}

/// Shifts of the green channel.
pub fn shifts(left: &Image, right: &Image, parts: &[Part]) -> Result<Vec<Shift>, Box<dyn Error>> {
    let (a, b) = (channel(right, GREEN), channel(left, GREEN));
    let map = match_images(&a, &b, &settings())?;
    let of = |part: &Part| {
        let inside = |[x, y]: [f64; 2]| {
            let within = |p: f64, from: usize| p >= from as f64 && p < (from + part.side) as f64;
            within(x, part.x) && within(y, part.y)
        };
        let mut found: Vec<f64> = (map.nodes())
            .filter(|(at, m)| m.verdict == Verdict::Valid && inside(*at))
            .map(|(_, m)| m.dx_px)
            .collect();
        found.sort_by(f64::total_cmp);
        Ok(Shift {
            whole_px: window_shift_px(&a, &b, part.window()).unwrap_or(f64::NAN),
            median_px: found.get(found.len() / 2).copied().unwrap_or(f64::NAN),
        })
    };
    parts.iter().map(of).collect()
}
