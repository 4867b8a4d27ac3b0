//! Outlines of cards that stand in the way: binary, so that an occluding edge is one depth or the other.
//!
//! The shape lies in the unit square (s right, t down), turned by a random angle about its middle; x, y below are from
//! there. Round shapes are inside r < R(θ); the blob's contour is the Fourier series R = R₀ (1 + Σ a_k cos(kθ + φ_k)),
//! k = 2..7, a_k ∝ 1/k, scaled to stay in the square.

use super::error::{ChartError, side};
use super::keyed::Key;
use quadpixel::scene::coverage::Coverage;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

/// Largest distance from the middle that a turned shape may have.
const REACH: f64 = 0.49;

/// A family of outlines; the seed chooses its proportions and turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mask {
    /// A disk, 0.3..0.49 in radius.
    Disk,
    /// A rectangle of aspect 1..3 with rounded corners.
    RoundedRectangle,
    /// A star of 4 to 9 points.
    Star,
    /// A smooth closed random contour.
    Blob,
    /// Thin bars across the whole card with two rails: holes and thin parts.
    Fence,
    /// The pointed overlap of two disks.
    Leaf,
}

/// A shape with its numbers drawn.
enum Shape {
    Disk { radius: f64 },
    RoundedRectangle { half: [f64; 2], corner: f64 },
    Star { points: f64, inner: f64 },
    Blob { base: f64, terms: [[f64; 2]; 6] },
    Fence { pitch: f64, width: f64, shift: f64 },
    Leaf { radius: f64, offset: f64 },
}

impl Mask {
    /// All families.
    pub const ALL: [Self; 6] = [
        Self::Disk,
        Self::RoundedRectangle,
        Self::Star,
        Self::Blob,
        Self::Fence,
        Self::Leaf,
    ];

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Disk => "disk",
            Self::RoundedRectangle => "rounded-rectangle",
            Self::Star => "star",
            Self::Blob => "blob",
            Self::Fence => "fence",
            Self::Leaf => "leaf",
        }
    }

    /// The family of this name.
    ///
    /// # Errors
    /// An unknown name: the names that there are.
    pub fn from_name(name: &str) -> Result<Self, ChartError> {
        let found = Self::ALL.into_iter().find(|mask| mask.name() == name);
        found.ok_or_else(|| ChartError::UnknownMask {
            kind: name.to_owned(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }

    /// Draws the outline, `size_px` texels per side (1..=16384). The same seed gives the same bytes.
    ///
    /// # Errors
    /// A side out of its range.
    pub fn generate(self, seed: u64, size_px: usize) -> Result<Coverage, ChartError> {
        side(size_px)?;
        let key = Key::new(seed, self.name());
        let shape = self.shape(key);
        let (sin, cos) = key.range(100, 0.0, TAU).sin_cos();
        let mut data = vec![0u8; size_px * size_px];
        data.par_chunks_mut(size_px)
            .enumerate()
            .for_each(|(row, texels)| {
                let t = (row as f64 + 0.5) / size_px as f64 - 0.5;
                for (column, texel) in texels.iter_mut().enumerate() {
                    let s = (column as f64 + 0.5) / size_px as f64 - 0.5;
                    *texel = u8::from(shape.contains(s * cos + t * sin, t * cos - s * sin));
                }
            });
        Coverage::new(size_px, data).map_err(|_| ChartError::Size { size_px })
    }

    fn shape(self, key: Key) -> Shape {
        match self {
            Self::Disk => Shape::Disk {
                radius: key.range(0, 0.3, REACH),
            },
            Self::RoundedRectangle => {
                let aspect = key.range(0, 1.0, 3.0);
                let short = REACH / (1.0 + aspect * aspect).sqrt();
                Shape::RoundedRectangle {
                    half: [short * aspect, short],
                    corner: short * key.range(1, 0.05, 0.9),
                }
            }
            Self::Star => Shape::Star {
                points: key.whole(0, 4, 9).into(),
                inner: key.range(1, 0.15, 0.3),
            },
            Self::Blob => {
                let terms: [[f64; 2]; 6] = std::array::from_fn(|i| {
                    let k = i as u64;
                    [
                        key.range(2 * k, 0.0, 0.6) / (k + 2) as f64,
                        key.range(2 * k + 1, 0.0, TAU),
                    ]
                });
                let swing: f64 = terms.iter().map(|[a, _]| a).sum();
                Shape::Blob {
                    base: REACH / (1.0 + swing),
                    terms,
                }
            }
            Self::Fence => {
                let pitch = key.range(0, 0.08, 0.2);
                Shape::Fence {
                    pitch,
                    width: pitch * key.range(1, 0.2, 0.5),
                    shift: pitch * key.uniform(2),
                }
            }
            Self::Leaf => {
                // Two disks of radius r, ±d from the middle, meet at ±√(r² − d²) = ±REACH.
                let half_width = REACH * key.range(0, 0.25, 0.6);
                let radius = (REACH * REACH + half_width * half_width) / (2.0 * half_width);
                Shape::Leaf {
                    radius,
                    offset: radius - half_width,
                }
            }
        }
    }
}

impl Shape {
    fn contains(&self, x: f64, y: f64) -> bool {
        match *self {
            Self::Disk { radius } => x.hypot(y) < radius,
            Self::RoundedRectangle { half, corner } => {
                let (dx, dy) = (x.abs() - half[0] + corner, y.abs() - half[1] + corner);
                dx.max(0.0).hypot(dy.max(0.0)) < corner && dx.max(dy) < corner
            }
            Self::Star { points, inner } => {
                // Straight from a tip at (REACH, 0) to a notch at `inner` and the half angle.
                let half = PI / points;
                let angle = y.atan2(x).rem_euclid(2.0 * half);
                let angle = angle.min(2.0 * half - angle);
                let r = x.hypot(y);
                let (px, py) = (r * angle.cos(), r * angle.sin());
                let (nx, ny) = (inner * half.cos(), inner * half.sin());
                (px - REACH) * ny - py * (nx - REACH) < 0.0
            }
            Self::Blob { base, ref terms } => {
                let angle = y.atan2(x);
                let swing: f64 = (2u8..)
                    .zip(terms)
                    .map(|(k, [a, phase])| a * (f64::from(k) * angle + phase).cos())
                    .sum();
                x.hypot(y) < base * (1.0 + swing)
            }
            Self::Fence {
                pitch,
                width,
                shift,
            } => {
                let bar = (x + shift).rem_euclid(pitch) < width;
                let rail = (y.abs() - 0.25).abs() < 0.5 * width;
                bar || rail
            }
            Self::Leaf { radius, offset } => (y.abs() + offset).hypot(x) < radius,
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn areas_follow_the_shapes_geometry() {
        for seed in 0..5 {
            for mask in Mask::ALL {
                let want = match mask.shape(Key::new(seed, mask.name())) {
                    Shape::Disk { radius } => PI * radius * radius,
                    Shape::RoundedRectangle { half, corner } => {
                        4.0 * half[0] * half[1] - (4.0 - PI) * corner * corner
                    }
                    Shape::Star { points, inner } => points * REACH * inner * (PI / points).sin(),
                    // ½ ∫ R² dθ
                    Shape::Blob { base, terms } => {
                        PI * base
                            * base
                            * (1.0 + 0.5 * terms.iter().map(|[a, _]| a * a).sum::<f64>())
                    }
                    Shape::Leaf { radius, offset } => {
                        let half = (offset / radius).acos();
                        radius * radius * (2.0 * half - (2.0 * half).sin())
                    }
                    Shape::Fence { .. } => continue, // cut by the card's turned border
                };
                let got = mask.generate(seed, 600).unwrap().area();
                // Counting texels along a contour a few sides long: a few parts in 600².
                assert!(
                    (got - want).abs() < 1e-3,
                    "{} {seed}: {got} {want}",
                    mask.name()
                );
            }
        }
    }

    #[test]
    fn masks_are_keyed_by_the_seed_and_leave_the_border_empty() {
        for mask in Mask::ALL {
            let a = mask.generate(1, 128).unwrap();
            assert_eq!(a, mask.generate(1, 128).unwrap());
            assert_ne!(a, mask.generate(2, 128).unwrap());
            assert!((0.05..0.8).contains(&a.area()), "{}", mask.name());
            assert_eq!(Mask::from_name(mask.name()).unwrap(), mask);
            if mask != Mask::Fence {
                assert!((0..128).all(|i| a.data()[i] == 0 && a.data()[127 * 128 + i] == 0));
            }
        }
        assert!(
            Mask::from_name("cat")
                .unwrap_err()
                .to_string()
                .contains("known: disk, ")
        );
        assert!(Mask::Disk.generate(0, 0).is_err());
    }
}
