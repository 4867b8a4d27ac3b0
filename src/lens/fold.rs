//! A fold mirror, unfolded.
//!
//! A plane mirror with normal n reflects by M(n) = 1 − 2 n nᵀ. What stands behind the mirror is seen from in
//! front of it through that reflection; unfolding undoes the nominal one, n₀ = (0, 1, −1)/√2 (the axis turns up by
//! 90°). With the real normal n, what stands behind is therefore seen turned by M(n) M(n₀), the product of two
//! reflections and so a rotation: by twice the angle between the normals, about n₀ × n, through the mirror's vertex m.
//! The sensor holds the camera frame, so that here it is the surfaces **in front of** the mirror that turn, the other
//! way:
//!
//! ```text
//! p ↦ m + M(n₀) M(n) (p − m)        n = R(e_y', tilt) R(e_x, tip) n₀      e_y' = (0, 1, 1)/√2, in the mirror's plane
//! ```
//!
//! A tip by α turns them by 2α about x. A tilt by α turns them by 2α about e_y', that is by √2 α about y and by √2 α
//! about the axis. The scene stays bound to the sensor too: the camera is aimed anew, as a photographer would. A mirror
//! in front of the first surface then changes nothing.

use glam::{DMat3, DVec3};
use serde::Deserialize;
use std::f64::consts::FRAC_1_SQRT_2;

/// Where a plane mirror at 45° folds the axis. The prescription itself is unfolded.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fold {
    /// Index of the surface that the mirror follows; `None` when it stands in front of the first.
    pub after_surface: Option<usize>,
    /// Distance along the axis from that surface's vertex to the mirror (or from the mirror to the first vertex), mm.
    pub distance_mm: f64,
}

/// M(n₀) M(n): how a mirror's error turns what stands in front of it, the sensor held.
pub(super) fn turn_in_front(tip_deg: f64, tilt_deg: f64) -> DMat3 {
    let nominal = DVec3::new(0.0, FRAC_1_SQRT_2, -FRAC_1_SQRT_2);
    let in_plane = DVec3::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2);
    let normal = DMat3::from_axis_angle(in_plane, tilt_deg.to_radians())
        * (DMat3::from_rotation_x(tip_deg.to_radians()) * nominal);
    reflection(nominal) * reflection(normal)
}

fn reflection(n: DVec3) -> DMat3 {
    DMat3::from_cols(
        DVec3::X - 2.0 * n.x * n,
        DVec3::Y - 2.0 * n.y * n,
        DVec3::Z - 2.0 * n.z * n,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirror_tip_turns_the_front_by_twice_its_angle_about_x() {
        let turn = turn_in_front(0.3, 0.0);
        let expected = DMat3::from_rotation_x((-0.6_f64).to_radians());
        assert!(
            (turn - expected)
                .to_cols_array()
                .iter()
                .all(|e| e.abs() < 1e-14)
        );
    }

    #[test]
    fn mirror_tilt_turns_the_front_by_twice_its_angle_about_the_line_at_45_deg() {
        let turn = turn_in_front(0.0, 0.3);
        let axis = DVec3::new(0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2);
        let expected = DMat3::from_axis_angle(axis, (-0.6_f64).to_radians());
        assert!(
            (turn - expected)
                .to_cols_array()
                .iter()
                .all(|e| e.abs() < 1e-14)
        );
    }

    #[test]
    fn reflected_axis_leaves_a_tipped_mirror_at_twice_the_tip() {
        // By the law of reflection alone, in the folded world: the axis leaves a nominal mirror along +y.
        let tip = 0.7_f64.to_radians();
        let normal = DMat3::from_rotation_x(tip) * DVec3::new(0.0, 1.0, -1.0).normalize();
        let out = DVec3::Z - 2.0 * DVec3::Z.dot(normal) * normal;
        assert!((out.angle_between(DVec3::Y) - 2.0 * tip).abs() < 1e-12);
        // Unfolded with the nominal mirror, and seen from the sensor's side, the front must be turned the other way.
        let nominal = reflection(DVec3::new(0.0, 1.0, -1.0).normalize());
        let seen = nominal * out;
        assert!((turn_in_front(0.7, 0.0) * DVec3::Z - seen).length() < 1e-12);
    }
}
