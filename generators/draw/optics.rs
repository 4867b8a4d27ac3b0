//! Draws what production does to a lens.

use quadpixel::lens::{Deviation, ElementRef, Misalignment, Prescription};

use super::dice::{Dice, For};
use crate::config::ToleranceConfig;
use crate::recipe::RecipeError;

/// Misplaced elements and deviating surfaces of the lens `name`; a fold mirror stays in its place.
pub(super) fn defects(
    config: &ToleranceConfig,
    dice: &Dice,
    name: &str,
) -> Result<(Vec<Misalignment>, Vec<Deviation>), RecipeError> {
    let lens = Prescription::named(name)?;
    let element = |k: usize| {
        let of = |draw, what| dice.of(draw, what, k as u64);
        Misalignment {
            element: ElementRef::Element(k),
            dx_um: of(&config.decentre_um, For::DecentreX),
            dy_um: of(&config.decentre_um, For::DecentreY),
            dz_um: of(&config.despace_um, For::Despace),
            tip_deg: of(&config.tilt_deg, For::Tip),
            tilt_deg: of(&config.tilt_deg, For::Tilt),
        }
    };
    let moved = |m: &Misalignment| *m != Misalignment::none(m.element);
    let misalignments = (1..=lens.elements().len()).map(element).filter(moved);
    let surfaces = lens.surfaces.iter().zip(1..);
    let deviation = surfaces.map(|(surface, number)| {
        let of = |draw, what| dice.of(draw, what, number as u64);
        let curved = surface.curvature != 0.0;
        Deviation {
            surface: number,
            radius_percent: if curved {
                of(&config.radius_percent, For::Radius)
            } else {
                0.0
            },
            index: surface.glass.map_or(0.0, |_| of(&config.index, For::Index)),
        }
    });
    let deviations = deviation.filter(|d| d.radius_percent != 0.0 || d.index != 0.0);
    Ok((misalignments.collect(), deviations.collect()))
}
