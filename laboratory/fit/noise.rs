//! How large the noise of the measurements is, by what the fit leaves.

use serde::Serialize;

/// Standard deviations of the measurements.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Noise {
    /// Of a kernel's pixel, in RMS values of the kernel.
    pub kernel: f64,
    /// Of the sheet's left over right, relative.
    pub sheet: f64,
    /// Of the shifts of planes, over what is stated of each.
    pub plane: f64,
}

/// Lags that residuals are held against themselves at, px.
const LAGS: i64 = 6;
/// Fields, along each axis of the grid, within which the same may be missed.
const NEAR_FIELDS: usize = 2;
/// A sheet is at best this well known: illumination, dust, gain. It has no kernel that a wrong lens could spoil, so
/// what it is missed by is not called its noise beyond the ceiling.
const SHEET_FLOOR: f64 = 0.003;
const SHEET_CEILING: f64 = 0.006;

impl Noise {
    /// Before the first fit: a tenth of a kernel, which hangs together over some 30 pixels.
    pub const GUESS: Self = Self {
        kernel: 0.6,
        sheet: SHEET_CEILING,
        plane: 1.0,
    };

    /// Of residuals in units of this noise: kernels in all blocks but the last two, the sheet and the planes; `fields`
    /// are the columns and rows of the kernels in the grid. What hangs together over Σ ρ(lag) pixels counts as one, and
    /// so does what a model misses alike in fields beside each other: the noise is larger by the square root of both.
    #[must_use]
    pub fn from_residuals(
        self,
        residuals: &[Vec<f64>],
        side: usize,
        fields: &[[usize; 2]],
    ) -> Self {
        let Some((planes, residuals)) = residuals.split_last() else {
            return self;
        };
        let Some((sheet, kernels)) = residuals.split_last() else {
            return self;
        };
        let mean_square = |r: &[f64]| r.iter().map(|r| r * r).sum::<f64>() / r.len() as f64;
        let plane = match planes.is_empty() {
            true => self.plane,
            false => (self.plane * mean_square(planes).sqrt()).max(1.0),
        };
        if kernels.is_empty() || sheet.is_empty() {
            return Self { plane, ..self };
        }
        let views: Vec<&[f64]> = kernels
            .iter()
            .flat_map(|k| k.chunks_exact(side * side))
            .collect();
        let count = (views.len() * side * side) as f64;
        let sum: f64 = views.iter().flat_map(|v| v.iter()).map(|r| r * r).sum();
        let together: f64 = views.iter().map(|v| correlated(v, side)).sum();
        let area = (together / sum).max(1.0);
        let alike = (alike_in_fields(kernels, fields) / sum).max(1.0);
        let sheet = self.sheet * mean_square(sheet).sqrt();
        Self {
            kernel: self.kernel * (sum / count * area * alike).sqrt(),
            sheet: sheet.clamp(SHEET_FLOOR, SHEET_CEILING),
            plane,
        }
    }
}

/// Σ over pairs of fields near each other, and each with itself, of the product of their residuals.
fn alike_in_fields(kernels: &[Vec<f64>], fields: &[[usize; 2]]) -> f64 {
    let mut sum = 0.0;
    for (a, one) in kernels.iter().zip(fields) {
        for (b, other) in kernels.iter().zip(fields) {
            if (0..2).all(|axis| one[axis].abs_diff(other[axis]) <= NEAR_FIELDS) {
                sum += a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }
    sum
}

/// Σ over lags of Σ r(x) r(x + lag), of a picture `side` wide.
fn correlated(values: &[f64], side: usize) -> f64 {
    if side == 0 {
        return 0.0;
    }
    let (width, height) = (side as i64, (values.len() / side) as i64);
    let mut sum = 0.0;
    for dy in -LAGS..=LAGS {
        for dx in -LAGS..=LAGS {
            for y in (-dy).max(0)..height.min(height - dy) {
                let row = &values[(y * width) as usize..][..side];
                let other = &values[((y + dy) * width) as usize..][..side];
                for x in (-dx).max(0)..width.min(width - dx) {
                    sum += row[x as usize] * other[(x + dx) as usize];
                }
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn residuals_that_come_in_blocks_count_once_per_block() {
        // Alternating blocks of 2 × 2 alike pixels on a board of 12: 4 pixels hang together, and far ones cancel.
        let side = 60;
        let mut state = 1u64;
        let mut normal = || {
            let mut sum = -6.0;
            for _ in 0..12 {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                sum += (state >> 33) as f64 / 2f64.powi(31);
            }
            sum
        };
        let blocks: Vec<f64> = (0..900).map(|_| normal()).collect();
        let view: Vec<f64> = (0..side * side)
            .map(|i| blocks[i / side / 2 * 30 + i % side / 2])
            .collect();
        let sheet: Vec<f64> = (0..64)
            .map(|i| if i % 2 == 0 { 0.8 } else { -0.8 })
            .collect();
        let blocks = [view.clone(), sheet.clone(), vec![2.0; 5]];
        let noise = Noise::GUESS.from_residuals(&blocks, side, &[[0, 0]]);
        // Three fields that miss the same count as one, if they are near each other.
        let thrice = [&view, &view, &view, &sheet, &vec![2.0; 5]].map(Clone::clone);
        for (apart, wanted) in [(1, 3f64), (5, 1.0)] {
            let places = [0, 1, 2].map(|k| [k * apart, 0]);
            let of_three = Noise::GUESS.from_residuals(&thrice, side, &places);
            let ratio = of_three.kernel / noise.kernel;
            assert!((ratio - wanted.sqrt()).abs() < 1e-9, "{ratio}");
        }
        assert!(
            (noise.kernel / Noise::GUESS.kernel - 2.0).abs() < 0.5,
            "{noise:?}"
        );
        assert!(
            (noise.sheet / Noise::GUESS.sheet - 0.8).abs() < 1e-9,
            "{noise:?}"
        );
        assert!((noise.plane - 2.0).abs() < 1e-12, "{noise:?}");
    }
}
