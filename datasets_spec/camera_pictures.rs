//! Camera-like pictures: 8-bit sRGB of the sum and of the views, and the way back to linear values.
//!
//! Of the linear values v of a pixel's channels, per channel c:
//!
//! ```text
//! b_c = gain · white_balance_c · v_c        l = matrix · b, cut to 0..1        code_c = round(255 · tone(srgb(l_c)))
//! ```
//!
//! srgb is the transfer function of IEC 61966-2-1, tone runs straight from point to point. Each step has an inverse but
//! the cut and the rounding.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A colour matrix is refused whose determinant, over the product of its rows' lengths, is nearer to 0.
const LEAST_DETERMINANT: f64 = 1e-3;

/// How linear values become codes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Development {
    /// Factor of all channels.
    pub gain: f64,
    /// Factor of each channel.
    pub white_balance: [f64; 3],
    /// Linear sRGB of the balanced channels, row by row.
    pub matrix: [[f64; 3]; 3],
    /// Points (x, y) of the tone curve, both of 0 to 1 and rising, from (0, 0) to (1, 1).
    pub tone_curve: Vec<[f64; 2]>,
}

/// How `camera.jpg` and `camera_views.jpg` (or `.png`) came about (SPEC.md, "Camera-like pictures").
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraPictures {
    /// Whether they are of the noisy views, else of the clean ones.
    pub noisy: bool,
    /// From linear values to codes.
    pub development: Development,
    /// Factor of a view beside that of the sum: the number of sub-pixels.
    pub view_gain: f64,
    /// Quality of the JPEGs, 1 to 100; `null`: they are PNGs.
    pub jpeg_quality: Option<u8>,
}

/// A development that cannot be undone.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} is {value}; allowed: {allowed}")]
pub struct DevelopmentError {
    /// The field.
    pub field: &'static str,
    /// Its value.
    pub value: String,
    /// What is allowed.
    pub allowed: &'static str,
}

impl Default for Development {
    /// sRGB and nothing else.
    fn default() -> Self {
        Self {
            gain: 1.0,
            white_balance: [1.0; 3],
            matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            tone_curve: vec![[0.0, 0.0], [1.0, 1.0]],
        }
    }
}

impl Development {
    /// Whether every step has an inverse.
    ///
    /// # Errors
    /// The step that has none.
    pub fn check(&self) -> Result<(), DevelopmentError> {
        let error = |field, value, allowed| DevelopmentError {
            field,
            value,
            allowed,
        };
        let factor = |v: &f64| (1e-6..=1e6).contains(v);
        if !factor(&self.gain) {
            return Err(error("gain", self.gain.to_string(), "1e-6 to 1e6"));
        }
        if !self.white_balance.iter().all(factor) {
            let value = format!("{:?}", self.white_balance);
            return Err(error(
                "white_balance",
                value,
                "three factors of 1e-6 to 1e6",
            ));
        }
        if self.inverse_matrix().is_none() {
            let allowed = "three finite rows that an inverse undoes";
            return Err(error("matrix", format!("{:?}", self.matrix), allowed));
        }
        let points = &self.tone_curve;
        let ends = (points.first(), points.last()) == (Some(&[0.0; 2]), Some(&[1.0; 2]));
        let rises = |pair: &[[f64; 2]]| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1];
        if !(points.len() >= 2 && ends && points.windows(2).all(rises)) {
            let allowed = "points from [0, 0] to [1, 1] that rise in both numbers: a curve that can be undone";
            return Err(error("tone_curve", format!("{points:?}"), allowed));
        }
        Ok(())
    }

    /// Codes of linear values, channel by channel; not a number gives 0.
    pub fn codes(&self, linear: [f64; 3]) -> [u8; 3] {
        let balanced: [f64; 3] =
            std::array::from_fn(|c| self.gain * self.white_balance[c] * linear[c]);
        // Not a number casts to 0.
        times(&self.matrix, balanced).map(|l| {
            let toned = along(&self.tone_curve, [0, 1], srgb(l.clamp(0.0, 1.0)));
            (255.0 * toned).round() as u8
        })
    }

    /// The linear values of codes from 0 to 255: of what was cut at black or at white, the cut; `None` of a development
    /// that [`Self::check`] refuses.
    pub fn linear(&self, codes: [f64; 3]) -> Option<[f64; 3]> {
        let inverse = self.inverse_matrix()?;
        let light = codes.map(|code| linear_of_srgb(along(&self.tone_curve, [1, 0], code / 255.0)));
        let balanced = times(&inverse, light);
        Some(std::array::from_fn(|c| {
            balanced[c] / (self.gain * self.white_balance[c])
        }))
    }

    /// By cofactors.
    fn inverse_matrix(&self) -> Option<[[f64; 3]; 3]> {
        let m = &self.matrix;
        let cofactor = |i: usize, j: usize| {
            let (a, b) = ((i + 1) % 3, (i + 2) % 3);
            let (c, d) = ((j + 1) % 3, (j + 2) % 3);
            m[a][c] * m[b][d] - m[a][d] * m[b][c]
        };
        let determinant: f64 = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum();
        let lengths: f64 = m
            .iter()
            .map(|row| row.iter().map(|v| v * v).sum::<f64>())
            .product();
        let sound = determinant.abs() >= LEAST_DETERMINANT * lengths.sqrt() && lengths > 0.0;
        (sound && determinant.is_finite())
            .then(|| std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant)))
    }
}

fn times(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2])
}

/// Along straight pieces: the second coordinate where the first is `x`.
fn along(points: &[[f64; 2]], [from, to]: [usize; 2], x: f64) -> f64 {
    let Some(last) = points.len().checked_sub(2) else {
        return x;
    };
    let i = points[1..]
        .iter()
        .position(|p| x <= p[from])
        .unwrap_or(last);
    let (a, b) = (points[i], points[i + 1]);
    a[to] + (x - a[from]) * (b[to] - a[to]) / (b[from] - a[from])
}

fn srgb(linear: f64) -> f64 {
    match linear <= 0.003_130_8 {
        true => 12.92 * linear,
        false => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
    }
}

fn linear_of_srgb(srgb: f64) -> f64 {
    match srgb <= 0.040_45 {
        true => srgb / 12.92,
        false => ((srgb + 0.055) / 1.055).powf(2.4),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    fn camera() -> Development {
        Development {
            gain: 1.3,
            white_balance: [1.9, 1.0, 1.6],
            matrix: [[1.7, -0.6, -0.1], [-0.2, 1.5, -0.3], [0.0, -0.5, 1.5]],
            tone_curve: vec![[0.0, 0.0], [0.25, 0.18], [0.7, 0.8], [1.0, 1.0]],
        }
    }

    #[test]
    fn a_picture_comes_back_to_within_half_a_code() {
        for development in [Development::default(), camera()] {
            development.check().unwrap();
            for code in 0..=255u8 {
                let codes = [code, 255 - code, code / 2];
                let linear = development.linear(codes.map(f64::from)).unwrap();
                assert_eq!(development.codes(linear), codes);
            }
        }
    }

    #[test]
    fn srgb_of_mid_grey_is_the_standards() {
        // 18 % is 117.6, and white is white.
        let codes = Development::default().codes([0.18, 1.0, 2.0]);
        assert_eq!(codes, [118, 255, 255]);
        assert_eq!(Development::default().codes([-1.0, f64::NAN, 0.0]), [0; 3]);
    }

    #[test]
    fn what_cannot_be_undone_is_named() {
        for (field, spoil) in [
            ("gain", (|d| d.gain = 0.0) as fn(&mut Development)),
            ("white_balance", |d| d.white_balance[1] = f64::NAN),
            ("matrix", |d| d.matrix[2] = d.matrix[1]),
            ("matrix", |d| d.matrix[0][0] = f64::INFINITY),
            ("tone_curve", |d| d.tone_curve[2][1] = 0.18),
            ("tone_curve", |d| d.tone_curve[1][0] = 0.8),
            ("tone_curve", |d| d.tone_curve.truncate(3)),
            ("tone_curve", |d| d.tone_curve.clear()),
            ("tone_curve", |d| d.tone_curve[1][1] = f64::NAN),
        ] {
            let mut development = camera();
            spoil(&mut development);
            let text = development.check().unwrap_err().to_string();
            assert!(text.starts_with(field), "{text}");
        }
    }
}
