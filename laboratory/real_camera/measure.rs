//! The shift between two views over parts of the field.

use glam::{DMat3, DVec3};
use quadpixel::image::{Image, channel};
use quadpixel::simd::SimdLevel;
use quadpixel_algorithms::disparity::{Axes, MatchSettings, Verdict, match_images};
use quadpixel_algorithms::warp::{Border, Lobes, Map, warp};
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
            whole_px: whole_window(&a, &b, part)?,
            median_px: found.get(found.len() / 2).copied().unwrap_or(f64::NAN),
        })
    };
    parts.iter().map(of).collect()
}

/// d of a(x) = g b(x + d) + o over one large window, by Gauss-Newton from 0 with the exact Lanczos kernel; d to the
/// right, px. NaN where it does not settle. (The matcher's own windows end at 31 px.)
fn whole_window(a: &Image, b: &Image, part: &Part) -> Result<f64, Box<dyn Error>> {
    // Room for the shift and the kernel.
    const ROOM: usize = 12;
    const STEPS: usize = 40;
    let clip = |from: usize, whole: usize| (from.max(ROOM), (from + part.side).min(whole - ROOM));
    let ((x0, x1), (y0, y1)) = (clip(part.x, a.width()), clip(part.y, a.height()));
    let mut d = 0.0;
    for _ in 0..STEPS {
        let map = Map::shift(b.width(), b.height(), d, 0.0)?;
        let moved = warp(b, &map, Lobes::Four, Border::Replicate, SimdLevel::detect()).image;
        // Unknowns: g, o, and g times the step; normal equations of the three.
        let (mut m, mut v) = (DMat3::ZERO, DVec3::ZERO);
        for y in y0..y1 {
            for x in x0..x1 {
                let at = |x: usize| f64::from(moved.pixel(x, y)[0]);
                let slope = (8.0 * (at(x + 1) - at(x - 1)) - (at(x + 2) - at(x - 2))) / 12.0;
                let row = DVec3::new(at(x), 1.0, slope);
                m += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
                v += row * f64::from(a.pixel(x, y)[0]);
            }
        }
        let solved = m.inverse() * v;
        let step = (solved.z / solved.x).clamp(-0.5, 0.5);
        d += step;
        if step.abs() < 1e-4 {
            return Ok(d);
        }
    }
    Ok(f64::NAN)
}
