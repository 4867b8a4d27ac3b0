//! Kernels of both views from pictures of a grid of bright dots, out of focus.
//!
//! ```text
//! left + right ─ threshold between local dark and bright ─▶ dots ─ whole ones, alike, apart ─▶ windows about their
//! centroids ─ less the dark around, moved by parts of a px (cubic) ─▶ mean of a field's dots, each view of sum 1
//! ```
//! Both views of a dot are moved alike, so that their shift stays. A dot's own size blurs its kernel, as the fit's
//! `blur_px` does; moving by parts of a pixel adds a tenth of a pixel to that.

mod finding;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
mod window;

use quadpixel::image::Image;

use finding::{Found, found};
use window::Window;

/// Width of a dot over the median of all, at least and at most.
const ALIKE: [f64; 2] = [0.6, 1.6];
/// Side of a window over the median width of dots.
const WINDOW: f64 = 1.6;
/// Part of a kernel's light that may lie on its window's border.
const CUT: f64 = 0.02;
/// Narrowest dot that is a kernel, px.
const NARROWEST_PX: f64 = 3.0;

/// Kernels of the fields of a picture.
#[derive(Clone, Debug)]
pub struct DotKernels {
    /// Side of the kernels, px.
    pub side: usize,
    /// Row by row.
    pub fields: Vec<DotField>,
}

/// Of one field.
#[derive(Clone, Debug)]
pub struct DotField {
    /// Mean of its dots' places, px from the middle of the picture.
    pub place_px: [f64; 2],
    /// Dots.
    pub dots: usize,
    /// Left and right, side × side, row by row, each of sum 1.
    pub views: [Vec<f64>; 2],
}

/// Finds the dots of linear pictures of left and right, of one channel and one size, and the kernels of `grid` fields
/// (columns, rows) with sides of `field_px` about the middle.
///
/// # Errors
/// What is wrong with the pictures, and what is allowed.
pub fn kernels(
    [left, right]: [&Image; 2],
    grid: [usize; 2],
    field_px: f64,
) -> Result<DotKernels, String> {
    let (w, h) = (left.width(), left.height());
    let sum: Vec<f32> = left
        .data()
        .iter()
        .zip(right.data())
        .map(|(l, r)| l + r)
        .collect();
    let dots = found(&sum, w, h);
    let width = median(dots.iter().map(|dot| dot.width));
    let dots: Vec<Found> = (dots.into_iter())
        .filter(|dot| (ALIKE[0] * width..=ALIKE[1] * width).contains(&dot.width))
        .collect();
    if dots.len() < 4 || width < NARROWEST_PX {
        return Err(format!(
            "{} dots of about {:.0} px are found; allowed: bright dots on a dark ground, out of focus, 3 px wide or more",
            dots.len(),
            width.max(0.0)
        ));
    }
    let [columns, rows] = grid;
    if columns * rows > dots.len() {
        return Err(format!(
            "{columns} x {rows} fields for {} dots; allowed: at least one whole dot in each, so fewer and larger fields",
            dots.len()
        ));
    }
    let half = (0.5 * WINDOW * width).ceil();
    let apart = median(
        dots.iter()
            .enumerate()
            .map(|(i, dot)| nearest(&dots, i, dot)),
    );
    if apart < half + 0.5 * width {
        return Err(format!(
            "dots {width:.0} px wide stand {apart:.0} px apart and run into each other; allowed: {:.0} px apart or more \
             (dots farther apart, less defocus)",
            half + 0.5 * width
        ));
    }
    let window = Window {
        views: [left, right],
        half: half as usize,
    };
    let side = 2 * window.half + 1;
    let empty = || DotField {
        place_px: [0.0; 2],
        dots: 0,
        views: [vec![0.0; side * side], vec![0.0; side * side]],
    };
    let mut fields: Vec<DotField> = (0..columns * rows).map(|_| empty()).collect();
    for dot in &dots {
        let Some(at) = window.centroid(&sum, dot.middle) else {
            continue;
        };
        let place = [at[0] + 0.5 - 0.5 * w as f64, at[1] + 0.5 - 0.5 * h as f64];
        let along = |axis: usize| {
            let number = (place[axis] / field_px + 0.5 * grid[axis] as f64).floor();
            (number >= 0.0 && number < grid[axis] as f64).then_some(number as usize)
        };
        if let (Some(column), Some(row)) = (along(0), along(1)) {
            window.add(at, place, &mut fields[row * columns + column])?;
        }
    }
    for (i, field) in fields.iter_mut().enumerate() {
        field.finish(side).map_err(|what| {
            format!(
                "field in column {} and row {}: {what}",
                i % columns + 1,
                i / columns + 1
            )
        })?;
    }
    Ok(DotKernels { side, fields })
}

impl DotField {
    /// From sums to means.
    fn finish(&mut self, side: usize) -> Result<(), String> {
        if self.dots == 0 {
            return Err("no whole dot lies in it; allowed: a grid of dots that fills the picture, or fewer or larger \
                        fields"
                .into());
        }
        let count = self.dots as f64;
        self.place_px.iter_mut().for_each(|p| *p /= count);
        for view in &mut self.views {
            let sum: f64 = view.iter().sum();
            if !(sum > 0.0 && sum.is_finite()) {
                return Err("a view has no light there; allowed: light in both".into());
            }
            view.iter_mut().for_each(|v| *v /= sum);
            let is_border = |at: usize| {
                let (x, y) = (at % side, at / side);
                x == 0 || y == 0 || x == side - 1 || y == side - 1
            };
            let cut: f64 = (0..side * side)
                .filter(|at| is_border(*at))
                .map(|at| view[at])
                .sum();
            if cut.abs() > CUT {
                return Err(format!(
                    "{:.1} % of a kernel's light lies on its window's border; allowed: 2 % (a darker ground)",
                    100.0 * cut
                ));
            }
        }
        Ok(())
    }
}

/// Distance of the nearest other dot.
fn nearest(dots: &[Found], own: usize, dot: &Found) -> f64 {
    let others = dots.iter().enumerate().filter(|(i, _)| *i != own);
    others
        .map(|(_, other)| (dot.middle[0] - other.middle[0]).hypot(dot.middle[1] - other.middle[1]))
        .fold(f64::INFINITY, f64::min)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
