//! Misaligned elements and a fold mirror that is not quite at 45°.
//!
//! An element (glass between two airs; a cemented group moves as one) is shifted by (Δx, Δy, Δz) and turned about the
//! vertex of its first surface by R = R_y(tilt) R_x(tip), right-handed about the axes of the camera frame. Nothing else
//! moves with it. What a misaligned fold mirror does is in [`super::fold`].

use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::error::LensError;
use super::fold::turn_in_front;
use super::prescription::Prescription;
use super::system::Pose;
use crate::units::MM_PER_UM;

/// Largest tip or tilt accepted, degrees: beyond it surfaces would run into each other.
pub const LARGEST_TURN_DEG: f64 = 10.0;

/// What is out of place. In files: its number, or `"mirror"`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "ElementName", into = "ElementName")]
pub enum ElementRef {
    /// A glass element, counted from 1 at the scene's side (see [`Prescription::elements`]).
    Element(usize),
    /// The fold mirror, which can only tip and tilt.
    Mirror,
}

/// How files name what is out of place.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum ElementName {
    Number(usize),
    Word(String),
}

impl TryFrom<ElementName> for ElementRef {
    type Error = String;

    fn try_from(name: ElementName) -> Result<ElementRef, String> {
        match name {
            ElementName::Number(i) => Ok(ElementRef::Element(i)),
            ElementName::Word(word) if word == "mirror" => Ok(ElementRef::Mirror),
            ElementName::Word(word) => Err(format!(
                "element = `{word}`: must be the number of an element, from 1, or \"mirror\""
            )),
        }
    }
}

impl From<ElementRef> for ElementName {
    fn from(element: ElementRef) -> ElementName {
        match element {
            ElementRef::Element(i) => ElementName::Number(i),
            ElementRef::Mirror => ElementName::Word("mirror".into()),
        }
    }
}

/// By how much one element is out of place. What a file leaves out is 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Misalignment {
    /// Which element.
    pub element: ElementRef,
    /// Decentre along x, µm.
    #[serde(default)]
    pub dx_um: f64,
    /// Decentre along y, µm.
    #[serde(default)]
    pub dy_um: f64,
    /// Despace along z, towards the sensor, µm.
    #[serde(default)]
    pub dz_um: f64,
    /// Turn about x, degrees.
    #[serde(default)]
    pub tip_deg: f64,
    /// Turn about y (for the mirror: about e_y' in its plane), degrees.
    #[serde(default)]
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

/// The manufacturing defects of the paper's Table 1 (Chataignier et al., Opt. Express 27, 30486 (2019)), for a folded
/// lens of at least four elements; in the library, `tele_US10571665B2_220b`.
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

/// Checks misalignments against the lens they are for.
pub(crate) fn check_misalignments(
    lens: &Prescription,
    misalignments: &[Misalignment],
) -> Result<(), LensError> {
    let count = lens.elements().len();
    for (k, m) in misalignments.iter().enumerate() {
        if misalignments[..k].iter().any(|n| n.element == m.element) {
            let value = format!("{:?} twice", m.element);
            return Err(lens.refuse("misalignment.element", value, "given once each"));
        }
        match m.element {
            ElementRef::Element(i) if i == 0 || i > count => {
                let allowed = format!("1 to {count}, or the mirror");
                return Err(lens.refuse("misalignment.element", i, allowed));
            }
            ElementRef::Mirror if lens.fold.is_none() => {
                let allowed = "an element: this lens has no fold";
                return Err(lens.refuse("misalignment.element", "mirror", allowed));
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
                let allowed = "a finite length, and 0 for the mirror";
                return Err(lens.refuse(name, value, allowed));
            }
        }
        let turns = [
            ("misalignment.tip_deg", m.tip_deg),
            ("misalignment.tilt_deg", m.tilt_deg),
        ];
        for (name, value) in turns {
            if !(-LARGEST_TURN_DEG..=LARGEST_TURN_DEG).contains(&value) {
                let allowed = format!("{LARGEST_TURN_DEG} degrees at most either way");
                return Err(lens.refuse(name, value, allowed));
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
    if let (Some(m), Some(fold), Some(z_mm)) = (mirror, lens.fold, lens.fold_z_mm()) {
        let turn = turn_in_front(m.tip_deg, m.tilt_deg);
        let pivot = DVec3::new(0.0, 0.0, z_mm);
        let in_front = fold.after_surface.map_or(0, |i| i + 1);
        for pose in &mut poses[..in_front] {
            turn_about(pose, pivot, turn);
        }
    }
}

fn turn_about(pose: &mut Pose, pivot: DVec3, turn: DMat3) {
    if turn == DMat3::IDENTITY {
        return;
    }
    pose.vertex_mm = pivot + turn * (pose.vertex_mm - pivot);
    pose.rotation = Some(turn * pose.rotation.unwrap_or(DMat3::IDENTITY));
}
