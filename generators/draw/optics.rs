//! Draws what production does to a lens.

use quadpixel::lens::{Deviation, ElementRef, Misalignment, Prescription};

use super::dice::{Dice, Purpose};
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
        let number = |draw, purpose| dice.draw(draw, purpose, k as u64);
        Misalignment {
            element: ElementRef::Element(k),
            dx_um: number(&config.decentre_um, Purpose::DecentreX),
            dy_um: number(&config.decentre_um, Purpose::DecentreY),
            dz_um: number(&config.despace_um, Purpose::Despace),
            tip_deg: number(&config.tilt_deg, Purpose::Tip),
            tilt_deg: number(&config.tilt_deg, Purpose::Tilt),
        }
    };
    let moved = |m: &Misalignment| *m != Misalignment::none(m.element);
    let misalignments = (1..=lens.elements().len()).map(element).filter(moved);
    let surfaces = lens.surfaces.iter().zip(1..);
    let deviation = surfaces.map(|(surface, number)| {
        let of_surface = |draw, purpose| dice.draw(draw, purpose, number as u64);
        let curved = surface.curvature != 0.0;
        Deviation {
            surface: number,
            radius_percent: if curved {
                of_surface(&config.radius_percent, Purpose::Radius)
            } else {
                0.0
            },
            index: surface
                .glass
                .map_or(0.0, |_| of_surface(&config.index, Purpose::Index)),
        }
    });
    let deviations = deviation.filter(|d| d.radius_percent != 0.0 || d.index != 0.0);
    Ok((misalignments.collect(), deviations.collect()))
}
