//! Binary outline of a card: which texels of the unit square are solid.
//!
//! Looked up by nearest texel, so that an occluding edge is exactly one depth or the other. Coordinates are the
//! texture's: s to the right, t down, both in [0, 1); outside nothing is solid.

use thiserror::Error;

/// A square raster of solid (1) and empty (0) texels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Coverage {
    size_px: usize,
    data: Vec<u8>,
}

/// Why a [`Coverage`] was refused.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("coverage: {size_px}×{size_px} texels need {} values (side at least 1), got {got}", size_px * size_px)]
pub struct CoverageError {
    size_px: usize,
    got: usize,
}

impl Coverage {
    /// Wraps `data`, row-major from the top; non-zero is solid. Fails when it is empty or not `size_px`² long.
    ///
    /// # Errors
    /// A side of zero, or data of another length.
    pub fn new(size_px: usize, data: Vec<u8>) -> Result<Self, CoverageError> {
        if size_px == 0 || size_px.checked_mul(size_px) != Some(data.len()) {
            return Err(CoverageError {
                size_px,
                got: data.len(),
            });
        }
        Ok(Self { size_px, data })
    }

    /// Side in texels.
    pub fn size_px(&self) -> usize {
        self.size_px
    }

    /// Texels, row-major from the top; non-zero is solid.
    pub fn data(&self) -> &[u8] {
        &self.data
    }

    /// Whether the card is solid at (s right, t down); false outside [0, 1) and at NaN.
    #[inline]
    pub fn covers(&self, s: f32, t: f32) -> bool {
        if !((0.0..1.0).contains(&s) && (0.0..1.0).contains(&t)) {
            return false;
        }
        let n = self.size_px;
        // s just below 1 may round up to n.
        let x = ((s * n as f32) as usize).min(n - 1);
        let y = ((t * n as f32) as usize).min(n - 1);
        self.data[y * n + x] != 0
    }

    /// Solid share of the area, 0..1.
    pub fn area(&self) -> f64 {
        self.data.iter().filter(|&&v| v != 0).count() as f64 / self.data.len() as f64
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn nearest_texel_decides_and_outside_is_empty() {
        let c = Coverage::new(2, vec![1, 0, 0, 1]).unwrap();
        assert!(c.covers(0.0, 0.0) && c.covers(0.49, 0.49) && c.covers(0.51, 0.51));
        assert!(!c.covers(0.51, 0.49) && !c.covers(0.49, 0.51));
        assert!(c.covers(1.0 - f32::EPSILON / 2.0, 0.9));
        for (s, t) in [
            (-0.01, 0.2),
            (0.2, -0.01),
            (1.0, 0.9),
            (0.9, 1.0),
            (f32::NAN, 0.5),
        ] {
            assert!(!c.covers(s, t));
        }
        assert_eq!(c.area(), 0.5);
    }

    #[test]
    fn wrong_length_is_refused() {
        assert!(Coverage::new(0, vec![]).is_err());
        assert!(Coverage::new(2, vec![0; 3]).is_err());
    }
}
