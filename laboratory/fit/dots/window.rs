//! The light of one dot: its centroid, and both views moved to it.

use quadpixel::image::Image;

use super::super::pixel_table::cubic;
use super::DotField;

/// Linear light from which a pixel counts as saturated.
const FULL: f32 = 0.999;

/// Windows of 2 `half` + 1 px in both views.
pub(super) struct Window<'a> {
    pub views: [&'a Image; 2],
    pub half: usize,
}

impl Window<'_> {
    /// Centroid of the light around a place; `None` where the window, moved by parts of a pixel, leaves the picture.
    pub fn centroid(&self, sum: &[f32], middle: [f64; 2]) -> Option<[f64; 2]> {
        let (w, h) = (self.views[0].width(), self.views[0].height());
        let half = self.half as f64;
        let mut at = middle.map(f64::round);
        // The window follows the centroid.
        for _ in 0..3 {
            let inside =
                |c: f64, length: usize| c - half - 2.0 >= 0.0 && c + half + 3.0 <= length as f64;
            if !(inside(at[0], w) && inside(at[1], h)) {
                return None;
            }
            let first = [at[0].round() - half, at[1].round() - half].map(|c| c as usize);
            let value = |x: usize, y: usize| f64::from(sum[(first[1] + y) * w + first[0] + x]);
            let side = 2 * self.half + 1;
            let dark = ring(side, &value);
            let (mut light, mut moment) = (0.0, [0.0; 2]);
            for y in 0..side {
                for x in 0..side {
                    let v = value(x, y) - dark;
                    light += v;
                    moment = [moment[0] + v * x as f64, moment[1] + v * y as f64];
                }
            }
            at = [0, 1].map(|axis| first[axis] as f64 + moment[axis] / light);
            if !(at[0].is_finite() && at[1].is_finite()) {
                return None;
            }
        }
        let inside =
            |c: f64, length: usize| c - half - 2.0 >= 0.0 && c + half + 3.0 <= length as f64;
        (inside(at[0], w) && inside(at[1], h)).then_some(at)
    }

    /// Adds the window about a centroid to a field.
    pub fn add(
        &self,
        at: [f64; 2],
        place_px: [f64; 2],
        field: &mut DotField,
    ) -> Result<(), String> {
        let side = 2 * self.half + 1;
        let low = at.map(|c| c - self.half as f64);
        let (first, part) = (low.map(|c| c.floor() as usize), low.map(|c| c - c.floor()));
        let (across, down) = (cubic(part[0]), cubic(part[1]));
        for (image, to) in self.views.iter().zip(&mut field.views) {
            let pixel = |x: usize, y: usize| image.pixel(first[0] + x - 1, first[1] + y - 1)[0];
            let mut moved = vec![0.0; side * side];
            for y in 0..side {
                for x in 0..side {
                    let mut sum = 0.0;
                    for (j, down) in down.iter().enumerate() {
                        for (i, across) in across.iter().enumerate() {
                            let value = pixel(x + i, y + j);
                            if value >= FULL {
                                return Err(format!(
                                    "the dot at column {:.0}, row {:.0} is saturated; allowed: codes below the white level",
                                    at[0], at[1]
                                ));
                            }
                            sum += across * down * f64::from(value);
                        }
                    }
                    moved[y * side + x] = sum;
                }
            }
            let dark = ring(side, &|x, y| moved[y * side + x]);
            to.iter_mut()
                .zip(&moved)
                .for_each(|(to, v)| *to += v - dark);
        }
        field.dots += 1;
        field.place_px = [
            field.place_px[0] + place_px[0],
            field.place_px[1] + place_px[1],
        ];
        Ok(())
    }
}

/// Mean along the border of a window.
fn ring(side: usize, value: &dyn Fn(usize, usize) -> f64) -> f64 {
    let last = side - 1;
    let sides = (0..last)
        .map(|k| value(k, 0) + value(last, k) + value(last - k, last) + value(0, last - k));
    sides.sum::<f64>() / (4 * last) as f64
}
