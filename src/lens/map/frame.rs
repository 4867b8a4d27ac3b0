//! The coordinates of a map: where on the pupil a ray is aimed, and where it leaves in the scene.

use glam::{DMat2, DMat3, DVec2, DVec3};

use crate::field::SensorWindowMm;
use crate::lens::ExitPupilMap;
use crate::rays::Ray;

/// What a map gives of a ray in the scene: place (x, y) and slopes.
pub(super) const OUTPUTS: usize = 4;
/// Their changes with the place's x, then with its y.
pub(super) const CHANGES: usize = 2 * OUTPUTS;
/// Values of a node in f64: the outputs in the middle of the pupil, and their changes.
pub(super) const CONSTANTS: usize = OUTPUTS + CHANGES;
/// Places a side at which the pupils are looked at.
const PLACES: usize = 9;
/// Directions in which each is.
const DIRECTIONS: usize = 48;
/// Room around them: a polynomial is at its worst at its edge.
const ROOM: f64 = 1.01;
/// Least cosine of a ray to the axis of the scene's frame: beyond it slopes are steep.
const LEAST_COSINE: f64 = 0.05;

/// Pupil coordinates: the unit disk is an ellipse around the bundle of each place, that changes with the square of the
/// place and so without a bend.
#[derive(Clone, Debug)]
pub(super) struct PupilFrame {
    window: SensorWindowMm,
    pub z_mm: f64,
    /// Of 1, ξ, η, ξ², ξη, η²: centre (x, y), shape (xx, xy, yy), camera frame, mm.
    terms: [[f64; 5]; 6],
}

/// The unit disk of one place: target = centre + shape · (p, q).
#[derive(Clone, Copy, Debug)]
pub(super) struct PupilDisk {
    pub centre: DVec2,
    pub shape: DMat2,
    /// How the centre moves with the place, both in the camera frame.
    pub drift: DMat2,
}

impl PupilDisk {
    /// The target of (p, q) for a ray that starts `off` beside the place, camera frame, mm.
    pub fn target(&self, pq: DVec2, off: DVec2) -> DVec2 {
        self.centre + self.drift * off + self.shape * pq
    }
}

impl PupilFrame {
    /// Around the bounds of the bundles of a window; `None` where a part of it is dark.
    pub fn new(pupils: &ExitPupilMap, window: SensorWindowMm) -> Option<Self> {
        let mut z_mm = 0.0;
        let mut ellipses = Vec::new();
        for k in 0..PLACES * PLACES {
            let at = DVec2::new((k % PLACES) as f64, (k / PLACES) as f64);
            let part = at * (2.0 / (PLACES - 1) as f64) - 1.0;
            let place = window.centre + part * DVec2::new(window.half_width, window.half_height);
            let pupil = pupils.at(place.x, place.y)?;
            z_mm = pupil.centre_mm.z;
            let (a, b, c) = (pupil.axis_a_mm, pupil.axis_b_mm, pupil.centre_mm);
            ellipses.push((part, place, [c.x, c.y, a.x, 0.5 * (a.y + b.x), b.y]));
        }
        let rows: Vec<f64> = ellipses.iter().flat_map(|e| squares(e.0)).collect();
        let factor = super::least_squares::Factor::new(&rows, 6)?;
        let mut terms = [[0.0; 5]; 6];
        for component in 0..5 {
            let mut x = [0.0; 6];
            for (row, (_, _, ellipse)) in rows.chunks_exact(6).zip(&ellipses) {
                x.iter_mut()
                    .zip(row)
                    .for_each(|(x, r)| *x += r * ellipse[component]);
            }
            factor.solve(&mut x);
            terms.iter_mut().zip(x).for_each(|(t, x)| t[component] = x);
        }
        let mut frame = Self {
            window,
            z_mm,
            terms,
        };
        let mut reach = 0.0_f64;
        for (_, place, [x, y, xx, xy, yy]) in &ellipses {
            let disk = frame.at(*place);
            let inverse = disk.shape.inverse();
            let shape = DMat2::from_cols_array(&[*xx, *xy, *xy, *yy]);
            for k in 0..DIRECTIONS {
                let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
                let edge = DVec2::new(*x, *y) + shape * DVec2::from_angle(angle);
                reach = reach.max((inverse * (edge - disk.centre)).length());
            }
        }
        let grown = |t: &mut [f64; 5]| t[2..].iter_mut().for_each(|x| *x *= reach * ROOM);
        frame.terms.iter_mut().for_each(grown);
        reach.is_finite().then_some(frame)
    }

    /// The disk of a place, sensor frame, mm.
    pub fn at(&self, place_mm: DVec2) -> PupilDisk {
        let half = DVec2::new(self.window.half_width, self.window.half_height);
        let part = (place_mm - self.window.centre) / half;
        let powers = squares(part);
        let mut sum = [0.0; 5];
        for (power, terms) in powers.iter().zip(&self.terms) {
            sum.iter_mut().zip(terms).for_each(|(s, t)| *s += power * t);
        }
        let t = &self.terms;
        let along = |k: usize| {
            let slope_x = t[1][k] + 2.0 * part.x * t[3][k] + part.y * t[4][k];
            let slope_y = t[2][k] + part.x * t[4][k] + 2.0 * part.y * t[5][k];
            // x points the other way in the camera frame.
            (-slope_x / half.x, slope_y / half.y)
        };
        let ((xx, xy), (yx, yy)) = (along(0), along(1));
        PupilDisk {
            drift: DMat2::from_cols_array(&[xx, yx, xy, yy]),
            centre: DVec2::new(sum[0], sum[1]),
            shape: DMat2::from_cols_array(&[sum[2], sum[3], sum[3], sum[4]]),
        }
    }
}

fn squares(at: DVec2) -> [f64; 6] {
    [1.0, at.x, at.y, at.x * at.x, at.x * at.y, at.y * at.y]
}

/// Where a ray crosses a plane square to the chief ray of the window's middle, and its slopes to that ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct SceneFrame {
    pub origin_mm: DVec3,
    /// Two axes in the plane, and the one into the scene: camera-from-local.
    pub axes: DMat3,
}

impl SceneFrame {
    /// Around a ray in the scene.
    pub fn around(ray: Ray) -> Self {
        let along = ray.direction;
        let x = (DVec3::X - along * along.x)
            .try_normalize()
            .unwrap_or(DVec3::Y);
        Self {
            origin_mm: ray.origin_mm,
            axes: DMat3::from_cols(x, along.cross(x), along),
        }
    }

    /// Place (x, y) in the plane, mm, and slopes; `None` for a ray almost along the plane.
    pub fn coordinates(&self, ray: Ray) -> Option<[f64; OUTPUTS]> {
        let inverse = self.axes.transpose();
        let (o, d) = (
            inverse * (ray.origin_mm - self.origin_mm),
            inverse * ray.direction,
        );
        let slope = DVec2::new(d.x, d.y) / d.z;
        (d.z > LEAST_COSINE).then_some([o.x - o.z * slope.x, o.y - o.z * slope.y, slope.x, slope.y])
    }
}
