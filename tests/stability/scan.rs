//! Where a ray crosses a surface, by a scan that shares nothing with the tracer: the sag from its own formula, many
//! places along the ray, bisection between two of unlike sign.

use glam::DVec3;
use quadpixel::lens::{OpticalSurface, Travel};
use quadpixel::rays::Ray;

/// Places along the ray.
pub const PLACES: usize = 1000;
/// Where the scan disagrees it looks again: two crossings may lie between two of its places.
pub const FINE_PLACES: usize = 200_000;

/// z − sag at `p`.
pub fn height(s: &OpticalSurface, p: DVec3) -> f64 {
    let (c, r2) = (s.curvature, p.x * p.x + p.y * p.y);
    let root = (1.0 - (1.0 + s.conic) * c * c * r2).sqrt();
    let terms = s.aspheric.iter().zip(1..);
    p.z - c * r2 / (1.0 + root) - terms.map(|(a, i)| a * r2.powi(i)).sum::<f64>()
}

pub fn sense(travel: Travel) -> f64 {
    match travel {
        Travel::Forward => 1.0,
        Travel::Backward => -1.0,
    }
}

/// The first place within the aperture, in the order of travel, where the ray crosses in its sense.
pub fn first(s: &OpticalSurface, ray: Ray, travel: Travel, places: usize) -> Option<DVec3> {
    let (o, d, sign) = (ray.origin_mm, ray.direction, sense(travel));
    let (across, flat) = (d.truncate().length_squared(), o.truncate());
    let middle = -flat.dot(d.truncate()) / across;
    let nearest = (flat + middle * d.truncate()).length_squared();
    let half = ((s.aperture.semi_mm.powi(2) - nearest) / across).sqrt();
    let at = |t: f64| sign * height(s, o + t * d);
    let mut before = None;
    for i in 0..=places {
        let t = middle + half * (2.0 * i as f64 / places as f64 - 1.0);
        let g = at(t);
        if let Some((mut low, below)) = before
            && below
            && g >= 0.0
        {
            let mut high = t;
            for _ in 0..100 {
                let m = 0.5 * (low + high);
                if at(m) < 0.0 {
                    low = m;
                } else {
                    high = m;
                }
            }
            return Some(o + high * d);
        }
        before = Some((t, g < 0.0));
    }
    None
}
