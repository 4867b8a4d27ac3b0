//! The ledger of a sample's effects: the plan's decisions, and what follows from how its camera and scene were put
//! together.

use quadpixel::effects::{Decision, Tolerance, Verdict};
use quadpixel::render::Camera;
use quadpixel::response::{Response, ResponseLookup};
use quadpixel::sensor::ShiftRule;
use quadpixel_datasets::{Effect, Effects, EstimatedError, Reason};

use crate::assemble::ColourCall;
use crate::recipe::{Recipe, is_no_law};

/// Every effect that the pictures have or lack. `camera` is the one that they were made with.
pub(crate) fn ledger(
    recipe: &Recipe,
    camera: &Camera,
    response: &Response,
    (decisions, call): (&[Decision], &ColourCall),
    tolerance: &Tolerance,
) -> Effects {
    let mut ledger = Effects::default();
    for decision in decisions {
        let absent = decision.verdict == Verdict::Absent;
        if absent && decision.effect == Effect::LensReflections && recipe.lens.reflects() {
            ledger.leave_out(Effect::LensReflections, Reason::DirectLight);
        } else {
            decision.enter(&mut ledger, tolerance);
        }
    }
    lens(recipe, &mut ledger);
    pixel(recipe, camera, &mut ledger);
    colours(recipe, camera, (response, call), &mut ledger);
    world(recipe, &mut ledger);
    ledger
}

fn lens(recipe: &Recipe, ledger: &mut Effects) {
    ledger.simulate(Effect::Defocus);
    let lens = &recipe.lens;
    if !(lens.misalignments.is_empty() && lens.deviations.is_empty()) {
        ledger.simulate(Effect::LensTolerances);
    }
    if lens.focus_error_um != 0.0 {
        ledger.simulate(Effect::FocusError);
    }
}

fn pixel(recipe: &Recipe, camera: &Camera, ledger: &mut Effects) {
    let sensor = &recipe.sensor;
    if sensor.microlens_offset_um != [0.0; 2] || !is_no_law(&sensor.microlens_law) {
        ledger.simulate(Effect::MicrolensOffset);
    }
    if recipe
        .response
        .table()
        .is_some_and(|table| table.stack_scale != 1.0)
    {
        ledger.simulate(Effect::LayerThickness);
    }
    if recipe.sensor.microlens_shift == ShiftRule::Centred {
        ledger.leave_out(Effect::MicrolensShift, Reason::CentredMicrolenses);
        return;
    }
    ledger.simulate(Effect::MicrolensShift);
    match camera.response() {
        ResponseLookup::Shifted(_) | ResponseLookup::Fixed(_) => {
            ledger.simulate(Effect::ShiftDistortion);
        }
        _ => ledger.leave_out(Effect::ShiftDistortion, Reason::MovingFrame),
    }
}

fn colours(
    recipe: &Recipe,
    camera: &Camera,
    (response, call): (&Response, &ColourCall),
    ledger: &mut Effects,
) {
    let banded = camera.wavelengths().bands().is_some();
    if let Response::Table(table) = response {
        match (banded, table.axes().wavelengths_nm.len()) {
            (true, 2..) => ledger.simulate(Effect::ResponseSpectrum),
            (true, _) => ledger.leave_out(Effect::ResponseSpectrum, Reason::OneTabulatedWavelength),
            (false, _) => {
                let errors = call.response_errors();
                ledger.leave_out_at(Effect::ResponseSpectrum, call.reason, errors);
            }
        }
    }
    if banded {
        ledger.leave_out(Effect::SceneSpectra, Reason::EvenRadiance);
    }
    if recipe.sensor.mosaic.is_none() {
        ledger.leave_out(Effect::ColourMosaic, Reason::AllChannels);
        return;
    }
    ledger.simulate(Effect::ColourMosaic);
    if among_other_colours(response) {
        ledger.simulate(Effect::ColourCrosstalk);
        ledger.leave_out(Effect::FilterLeakage, Reason::OwnBand);
    } else {
        let errors = crosstalk_errors(camera);
        ledger.leave_out_at(Effect::ColourCrosstalk, Reason::EqualNeighbours, errors);
    }
}

/// What unlike neighbours would change, RMS over the cone and the halves of all colours, by the one pixel that both
/// periods were solved of (`benches/runs/2026-11-21/mosaic.md`); empty of others.
fn crosstalk_errors(camera: &Camera) -> Vec<EstimatedError> {
    /// Pitches that the pixel of 1.6 µm stands for, µm.
    const PITCHES_UM: std::ops::RangeInclusive<f64> = 1.4..=1.8;
    /// F-number, %: what the halves of light from 0° to the cone's edge differ by.
    const ERRORS: [(f64, f64); 3] = [(1.7, 24.4), (2.0, 20.0), (2.8, 14.6)];
    let Some(lens) = camera.paraxial() else {
        return Vec::new();
    };
    let known = ERRORS.iter().rev().find(|(f, _)| lens.f_number >= *f);
    let percent = known.filter(|_| PITCHES_UM.contains(&camera.sensor().pitch_um()));
    percent
        .map(|(_, percent)| EstimatedError::SignalPercent(*percent))
        .into_iter()
        .collect()
}

/// Whether the table's pixel was simulated in a mosaic of colour filters.
fn among_other_colours(response: &Response) -> bool {
    match response {
        Response::Table(table) => table.meta().pixel.mosaic.is_some(),
        Response::Geometric(_) => false,
    }
}

fn world(recipe: &Recipe, ledger: &mut Effects) {
    let Some(world) = &recipe.world else {
        return;
    };
    let max_bounces = world.paths.max_bounces;
    ledger.leave_out(Effect::LongPaths, Reason::PathLimit { max_bounces });
    if max_bounces <= 1 {
        ledger.leave_out(
            Effect::GlobalIllumination,
            Reason::PathLimit { max_bounces },
        );
    }
    if let Some(radiance) = world.paths.clamp {
        ledger.leave_out(Effect::BrightPaths, Reason::Clamp { radiance });
    }
}
