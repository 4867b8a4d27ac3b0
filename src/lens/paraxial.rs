//! Paraxial optics of the aligned lens.
//!
//! A ray of height y and slope u meets surface after surface (Welford, Aberrations of Optical Systems, section 3.2):
//!
//! ```text
//! refraction  n' u' = n u − y (n' − n) c̃ ,  c̃ = c + 2 A_2        transfer  y' = y + u' t
//! ```
//!
//! (a term A_2 r² adds its own curvature at the vertex). The map (y, u) ↦ (A y + B u, C y + D u) from the first vertex
//! to the last gives
//!
//! ```text
//! EFL = −1/C    BFL = −A/C    front focal point z = D/C
//! image of distance s at −(A s + B)/(C s + D) behind the last vertex
//! ```
//!
//! With the map to the stop, y_stop = A y + B u: entrance pupil at z = B/A, magnified 1/A. With the map from the stop
//! to the last vertex: exit pupil B/D in front of it, magnified (AD − BC)/D.

use super::system::{OpticalSurface, OpticalSystem};

/// First-order data at one wavelength. Positions are z in the camera frame, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paraxial {
    /// Effective focal length, mm.
    pub efl_mm: f64,
    /// From the last surface's vertex to the rear focal point, mm.
    pub bfl_mm: f64,
    /// EFL over the diameter of the entrance pupil.
    pub f_number: f64,
    /// Entrance pupil.
    pub entrance_pupil_z_mm: f64,
    /// Its semi-diameter, mm.
    pub entrance_pupil_semi_mm: f64,
    /// Exit pupil; infinite when the lens is telecentric on the image's side.
    pub exit_pupil_z_mm: f64,
    /// Its semi-diameter, mm.
    pub exit_pupil_semi_mm: f64,
    /// Front focal point.
    pub front_focal_z_mm: f64,
    /// Front principal point.
    pub front_principal_z_mm: f64,
    /// Rear principal point.
    pub rear_principal_z_mm: f64,
    last_vertex_z_mm: f64,
    lens: RayMap,
}

/// (y, u) ↦ (A y + B u, C y + D u).
#[derive(Clone, Copy, Debug, PartialEq)]
struct RayMap {
    a: f64,
    b: f64,
    c: f64,
    d: f64,
}

impl RayMap {
    const IDENTITY: RayMap = RayMap {
        a: 1.0,
        b: 0.0,
        c: 0.0,
        d: 1.0,
    };

    fn then_refract(self, surface: &OpticalSurface) -> RayMap {
        let vertex = surface.curvature + 2.0 * surface.aspheric[0];
        let (n, n2) = (surface.index_before, surface.index_after);
        let power = (n2 - n) * vertex / n2;
        RayMap {
            c: n / n2 * self.c - power * self.a,
            d: n / n2 * self.d - power * self.b,
            ..self
        }
    }

    fn then_travel(self, t_mm: f64) -> RayMap {
        RayMap {
            a: self.a + t_mm * self.c,
            b: self.b + t_mm * self.d,
            ..self
        }
    }
}

impl Paraxial {
    /// First-order data of a system whose surfaces all stand square on the axis; misalignments are not looked at.
    pub fn from_aligned(system: &OpticalSystem) -> Paraxial {
        let surfaces = &system.surfaces;
        let stop = &surfaces[system.stop];
        let z = |i: usize| surfaces[i].pose.vertex_mm.z;
        let last = surfaces.len() - 1;
        let map = |from: usize, to: usize, refract_last: bool| {
            (from..=to).fold(RayMap::IDENTITY, |map, i| {
                let arrived = map.then_travel(z(i) - z(if i == from { i } else { i - 1 }));
                if i < to || refract_last {
                    arrived.then_refract(&surfaces[i])
                } else {
                    arrived
                }
            })
        };
        let lens = map(0, last, true);
        let front = map(0, system.stop, false);
        let back = map(system.stop, last, true);
        let semi = stop.aperture.semi_mm;
        let efl_mm = -1.0 / lens.c;
        let entrance_pupil_semi_mm = (semi / front.a).abs();
        let front_focal_z_mm = z(0) + lens.d / lens.c;
        let bfl_mm = -lens.a / lens.c;
        Paraxial {
            efl_mm,
            bfl_mm,
            f_number: efl_mm / (2.0 * entrance_pupil_semi_mm),
            entrance_pupil_z_mm: z(0) + front.b / front.a,
            entrance_pupil_semi_mm,
            exit_pupil_z_mm: z(last) - back.b / back.d,
            exit_pupil_semi_mm: (semi * (back.a * back.d - back.b * back.c) / back.d).abs(),
            front_focal_z_mm,
            front_principal_z_mm: front_focal_z_mm + efl_mm,
            rear_principal_z_mm: z(last) + bfl_mm - efl_mm,
            last_vertex_z_mm: z(last),
            lens,
        }
    }

    /// z of the image of an object `distance_mm` in front of the first vertex (infinite allowed), mm; `None` at or
    /// within the front focal point, where there is no real image.
    pub fn image_z_mm(&self, distance_mm: f64) -> Option<f64> {
        if distance_mm == f64::INFINITY {
            return Some(self.last_vertex_z_mm + self.bfl_mm);
        }
        let RayMap { a, b, c, d } = self.lens;
        let slope = c * distance_mm + d;
        (slope < 0.0).then(|| self.last_vertex_z_mm - (a * distance_mm + b) / slope)
    }
}

/// Focal length in mm of the glass between `front` and `back` alone in air, `thickness_mm` thick: the lensmaker's
/// equation 1/f = (n − 1)(c̃₁ − c̃₂ + (n − 1) t c̃₁ c̃₂ / n). Infinite for a plate.
pub fn singlet_efl_mm(front: &OpticalSurface, back: &OpticalSurface) -> f64 {
    let n = front.index_after;
    let c1 = front.curvature + 2.0 * front.aspheric[0];
    let c2 = back.curvature + 2.0 * back.aspheric[0];
    let t = back.pose.vertex_mm.z - front.pose.vertex_mm.z;
    1.0 / ((n - 1.0) * (c1 - c2 + (n - 1.0) * t * c1 * c2 / n))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use crate::lens::{Lens, Prescription};

    #[test]
    fn newtons_equation_holds_between_the_focal_points() {
        // x x' = f², x from the front focal point to the object, x' from the rear one to the image.
        let lens =
            Lens::new(&Prescription::builtin("lib_double_gauss_100mm_glass").unwrap()).unwrap();
        let p = lens.paraxial(587.5618).unwrap();
        let infinity = p.image_z_mm(f64::INFINITY).unwrap();
        for distance in [400.0, 1000.0, 1e5] {
            let x = distance + p.front_focal_z_mm;
            let behind = p.image_z_mm(distance).unwrap() - infinity;
            assert!((x * behind / (p.efl_mm * p.efl_mm) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn image_point_lies_where_the_principal_planes_say() {
        let lens = Lens::new(&Prescription::builtin("lib_dgauss_50mm").unwrap()).unwrap();
        let p = lens.paraxial(587.5618).unwrap();
        let object = 700.0 + p.front_principal_z_mm;
        let image = p.image_z_mm(700.0).unwrap() - p.rear_principal_z_mm;
        assert!((1.0 / object + 1.0 / image - 1.0 / p.efl_mm).abs() < 1e-12);
    }
}
