//! Misaligned elements and a fold mirror that is not quite at 45°.
//!
//! An element (glass between two airs; a cemented group moves as one) is shifted by (Δx, Δy, Δz) and turned about the vertex of
//! its first surface by R = R_y(tilt) R_x(tip), right-handed about the axes of the camera frame. Nothing else moves with it.
//!
//! **The fold mirror, unfolded.** A plane mirror with normal n reflects by M(n) = 1 − 2 n nᵀ. What stands behind the mirror is seen from in
//! front of it through that reflection; unfolding undoes the nominal one, n₀ = (0, 1, −1)/√2 (the axis turns up by 90°).
//! With the real normal n, what stands behind is therefore seen turned by M(n) M(n₀), the product of two reflections and so a
//! rotation: by twice the angle between the normals, about n₀ × n, through the mirror's vertex m. The sensor holds
//! the camera frame, so that here it is the surfaces **in front of** the mirror that turn, the other way:
//!
//! ```text
//! p ↦ m + M(n₀) M(n) (p − m)        n = R(e_y', tilt) R(e_x, tip) n₀      e_y' = (0, 1, 1)/√2, in the mirror's plane
//! ```
//!
//! A tip by α turns them by 2α about x. A tilt by α turns them by 2α about e_y', that is by √2 α about y and by √2 α about the
//! axis. The scene stays bound to the sensor too: the camera is aimed anew, as a photographer would. A mirror in front of
//! the first surface then changes nothing.

use glam::{DMat3, DVec3};
use serde::Deserialize;
use std::f64::consts::FRAC_1_SQRT_2;

use super::error::LensError;
use super::prescription::Prescription;
use super::system::Pose;
use crate::units::MM_PER_UM;

/// Largest tip or tilt accepted, degrees: beyond it surfaces would run into each other.
pub const LARGEST_TURN_DEG: f64 = 10.0;

/// Where a plane mirror at 45° folds the axis. The prescription itself is unfolded.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fold {
    /// Index of the surface that the mirror follows; `None` when it stands in front of the first.
    pub after_surface: Option<usize>,
    /// Distance along the axis from that surface's vertex to the mirror (or from the mirror to the first vertex), mm.
    pub distance_mm: f64,
}

/// What is out of place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ElementRef {
    /// A glass element, counted from 1 at the scene's side (see [`Prescription::elements`]).
    Element(usize),
    /// The fold mirror, which can only tip and tilt.
    Mirror,
}

/// By how much one element is out of place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misalignment {
    /// Which element.
    pub element: ElementRef,
    /// Decentre along x, µm.
    pub dx_um: f64,
    /// Decentre along y, µm.
    pub dy_um: f64,
    /// Despace along z, towards the sensor, µm.
    pub dz_um: f64,
    /// Turn about x, degrees.
    pub tip_deg: f64,
    /// Turn about y (for the mirror: about e_y' in its plane), degrees.
    pub tilt_deg: f64,
}

impl Misalignment {
    /// An element in its place, to be moved by struct update.
    pub fn none(element: ElementRef) -> Misalignment {
        Misalignment {
            element,
            dx_um: 0.0,
            dy_um: 0.0,
            dz_um: 0.0,
            tip_deg: 0.0,
            tilt_deg: 0.0,
        }
    }
}

/// The manufacturing defects of the paper's Table 1, for a folded lens of at least four elements.
pub fn table1_defects() -> Vec<Misalignment> {
    let at = |element| Misalignment::none(ElementRef::Element(element));
    vec![
        Misalignment {
            dz_um: 1.5,
            ..at(1)
        },
        Misalignment {
            dx_um: 6.0,
            dy_um: 6.0,
            ..at(2)
        },
        Misalignment {
            tip_deg: 0.625,
            tilt_deg: 0.25,
            ..Misalignment::none(ElementRef::Mirror)
        },
        Misalignment {
            dx_um: 9.0,
            dy_um: 5.0,
            tip_deg: 0.2,
            tilt_deg: 0.2,
            ..at(3)
        },
        Misalignment {
            dx_um: 4.0,
            dy_um: 2.5,
            ..at(4)
        },
    ]
}

impl Prescription {
    /// The prescription with its fold between elements 2 and 3, in the middle of the air there: where Table 1 counts the mirror
    /// of the paper's ML-2. (US 10,571,665's own fold is in front of its first element, where a mirror's error only
    /// re-aims the camera.)
    ///
    /// # Errors
    /// [`LensError::Request`] when the lens has fewer than three elements.
    pub fn folded_as_in_table1(&self) -> Result<Prescription, LensError> {
        let elements = self.elements();
        let &[_, (_, end), _, ..] = elements.as_slice() else {
            return Err(LensError::Request {
                lens: self.file.clone(),
                quantity: "fold between elements 2 and 3",
                value: format!("{} elements", elements.len()),
                allowed: "asked of a lens of three elements or more".into(),
            });
        };
        let fold = Fold {
            after_surface: Some(end),
            distance_mm: 0.5 * self.surfaces[end].thickness_mm,
        };
        Ok(Prescription {
            fold: Some(fold),
            ..self.clone()
        })
    }
}

impl Fold {
    /// z of the mirror's vertex in the camera frame, mm.
    pub fn z_mm(&self, prescription: &Prescription) -> f64 {
        self.after_surface.map_or(-self.distance_mm, |i| {
            prescription.vertices_z_mm()[i] + self.distance_mm
        })
    }

    pub(crate) fn check(&self, prescription: &Prescription) -> Result<(), LensError> {
        if !(self.distance_mm >= 0.0 && self.distance_mm.is_finite()) {
            let value = self.distance_mm.to_string();
            return Err(prescription.value("fold.distance_mm", &value, "a length of 0 or more"));
        }
        match self.after_surface {
            Some(i)
                if prescription
                    .surfaces
                    .get(i)
                    .is_none_or(|s| s.glass.is_some()) =>
            {
                let allowed = "the index of a surface with air behind it, or null";
                Err(prescription.value("fold.after_surface", &i.to_string(), allowed))
            }
            _ => Ok(()),
        }
    }
}

/// Checks misalignments against the lens they are for.
pub(crate) fn check_misalignments(
    lens: &Prescription,
    misalignments: &[Misalignment],
) -> Result<(), LensError> {
    let count = lens.elements().len();
    let refuse = |quantity, value: String, allowed: String| {
        Err(LensError::Request {
            lens: lens.file.clone(),
            quantity,
            value,
            allowed,
        })
    };
    for (k, m) in misalignments.iter().enumerate() {
        if misalignments[..k].iter().any(|n| n.element == m.element) {
            let value = format!("{:?} twice", m.element);
            return refuse("misalignment.element", value, "given once each".into());
        }
        match m.element {
            ElementRef::Element(i) if i == 0 || i > count => {
                let allowed = format!("1 to {count}, or the mirror");
                return refuse("misalignment.element", i.to_string(), allowed);
            }
            ElementRef::Mirror if lens.fold.is_none() => {
                let allowed = "an element: this lens has no fold".into();
                return refuse("misalignment.element", "mirror".into(), allowed);
            }
            _ => {}
        }
        let shifts = [
            ("misalignment.dx_um", m.dx_um),
            ("misalignment.dy_um", m.dy_um),
            ("misalignment.dz_um", m.dz_um),
        ];
        for (name, value) in shifts {
            let fits = match m.element {
                ElementRef::Element(_) => value.is_finite(),
                ElementRef::Mirror => value == 0.0,
            };
            if !fits {
                let allowed = "a finite length, and 0 for the mirror".into();
                return refuse(name, value.to_string(), allowed);
            }
        }
        let turns = [
            ("misalignment.tip_deg", m.tip_deg),
            ("misalignment.tilt_deg", m.tilt_deg),
        ];
        for (name, value) in turns {
            if !(value.abs() <= LARGEST_TURN_DEG) {
                let allowed = format!("{LARGEST_TURN_DEG} degrees at most either way");
                return refuse(name, value.to_string(), allowed);
            }
        }
    }
    Ok(())
}

/// Moves the surfaces' poses, given in the order of the prescription, as the misalignments say.
pub(crate) fn misalign(lens: &Prescription, misalignments: &[Misalignment], poses: &mut [Pose]) {
    let elements = lens.elements();
    for m in misalignments {
        let ElementRef::Element(k) = m.element else {
            continue;
        };
        let (first, last) = elements[k - 1];
        let turn = DMat3::from_rotation_y(m.tilt_deg.to_radians())
            * DMat3::from_rotation_x(m.tip_deg.to_radians());
        let pivot = poses[first].vertex_mm;
        let shift = DVec3::new(m.dx_um, m.dy_um, m.dz_um) * MM_PER_UM;
        for pose in &mut poses[first..=last] {
            turn_about(pose, pivot, turn);
            pose.vertex_mm += shift;
        }
    }
    let mirror = misalignments
        .iter()
        .find(|m| m.element == ElementRef::Mirror);
    if let (Some(m), Some(fold)) = (mirror, lens.fold) {
        let turn = turn_of_the_front(m.tip_deg, m.tilt_deg);
        let pivot = DVec3::new(0.0, 0.0, fold.z_mm(lens));
        let in_front = fold.after_surface.map_or(0, |i| i + 1);
        for pose in &mut poses[..in_front] {
            turn_about(pose, pivot, turn);
        }
    }
}

/// M(n₀) M(n): how a mirror's error turns what stands in front of it, the sensor held.
fn turn_of_the_front(tip_deg: f64, tilt_deg: f64) -> DMat3 {
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

fn turn_about(pose: &mut Pose, pivot: DVec3, turn: DMat3) {
    if turn == DMat3::IDENTITY {
        return;
    }
    pose.vertex_mm = pivot + turn * (pose.vertex_mm - pivot);
    pose.rotation = Some(turn * pose.rotation.unwrap_or(DMat3::IDENTITY));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirror_tip_turns_the_front_by_twice_its_angle_about_x() {
        let turn = turn_of_the_front(0.3, 0.0);
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
        let turn = turn_of_the_front(0.0, 0.3);
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
        assert!((turn_of_the_front(0.7, 0.0) * DVec3::Z - seen).length() < 1e-12);
    }
}
