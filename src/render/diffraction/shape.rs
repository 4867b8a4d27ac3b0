//! The aperture as a place on the sensor sees it: an ellipse of directions, or an outline of its own.

use glam::{DMat2, DVec2, DVec3};

/// Radii of an outline, in units of its own ellipse, that differ from 1 by no more than this: diffracts as that one.
const ELLIPTIC: f64 = 0.01;

/// An aperture as a place sees it.
pub(super) struct Shape {
    pub middle: DVec2,
    /// From the ellipse with the second moments of its direction cosines to the unit disk.
    pub to_disk: DMat2,
    /// Its outline there, if it is no disk.
    pub clipped: Option<Vec<DVec2>>,
}

impl Shape {
    /// Of an outline (camera frame, mm) seen from a place; `None` for one without area.
    pub fn new(place_mm: DVec3, outline_mm: &[DVec3]) -> Option<Self> {
        let cosines = outline_mm
            .iter()
            .map(|p| (*p - place_mm).normalize().truncate());
        let cosines: Vec<DVec2> = cosines.collect();
        let (middle, covariance) = moments(&cosines)?;
        // Cholesky's root of 4 × the covariance, which is B Bᵀ of an ellipse B · (unit disk).
        let xx = 2.0 * covariance.x_axis.x.sqrt();
        let xy = 4.0 * covariance.x_axis.y / xx;
        let yy = (4.0 * covariance.y_axis.y - xy * xy).sqrt();
        if !(xx > 0.0 && yy > 0.0) {
            return None;
        }
        let to_disk = DMat2::from_cols_array(&[xx, xy, 0.0, yy]).inverse();
        let scaled: Vec<DVec2> = cosines.iter().map(|w| to_disk * (*w - middle)).collect();
        let is_disk = scaled.iter().all(|q| (q.length() - 1.0).abs() <= ELLIPTIC);
        Some(Self {
            middle,
            to_disk,
            clipped: (!is_disk).then_some(scaled),
        })
    }

    pub fn ellipse(&self) -> [f64; 6] {
        let [a, b, c, d] = self.to_disk.to_cols_array();
        [self.middle.x, self.middle.y, a, b, c, d]
    }
}

/// Centroid and covariance of a polygon's area; `None` if it has none.
fn moments(outline: &[DVec2]) -> Option<(DVec2, DMat2)> {
    let origin = outline.iter().sum::<DVec2>() / outline.len() as f64;
    let (mut area, mut first) = (0.0, DVec2::ZERO);
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
        // The triangle origin, a, b: its moments are those of its corners.
        let (a, b) = (*a - origin, *b - origin);
        let triangle = 0.5 * a.perp_dot(b);
        area += triangle;
        first += triangle / 3.0 * (a + b);
        xx += triangle / 6.0 * (a.x * a.x + b.x * b.x + a.x * b.x);
        yy += triangle / 6.0 * (a.y * a.y + b.y * b.y + a.y * b.y);
        xy += triangle / 12.0 * (2.0 * (a.x * a.y + b.x * b.y) + a.x * b.y + b.x * a.y);
    }
    if area == 0.0 || !area.is_finite() {
        return None;
    }
    let mean = first / area;
    let (xx, xy, yy) = (
        xx / area - mean.x * mean.x,
        xy / area - mean.x * mean.y,
        yy / area - mean.y * mean.y,
    );
    Some((origin + mean, DMat2::from_cols_array(&[xx, xy, xy, yy])))
}
