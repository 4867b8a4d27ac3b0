//! Levels of the pixel model: P against converged Fourier modes, and seconds per direction.

use crate::error::LaboratoryError;
use quadpixel::em::fdtd::FdtdSettings;
use quadpixel::em::rcwa::RcwaSettings;
use quadpixel::em::wave::WaveSettings;
use quadpixel::em::{CorrectedSettings, PixelModel};
use quadpixel::em::{Level, Preset};
use quadpixel::response::TableSettings;

use super::clock::best_of;
use super::pixel::{Exact, WAVELENGTH_NM};
use super::row::{Curve, Row, Table};
use super::work::{PIXEL, Size};

/// Focal length of the ideal microlens, µm: pitch times an F-number of 2.5.
const FOCAL_UM: f64 = 4.0;
/// sin θ up to which a table's directions are simulated.
const LARGEST_SINE: f64 = 0.94;

/// A line of the picture: its name and the settings on it.
type Group = (&'static str, Vec<(String, PixelModel)>);

pub(super) fn table(size: Size) -> Result<Table, LaboratoryError> {
    let mut directions: Vec<[f64; 2]> = [0.0, 10.0, 20.0, 30.0].map(|theta| [theta, 0.0]).to_vec();
    if size == Size::Full {
        directions.extend([
            [5.0, 0.0],
            [15.0, 0.0],
            [25.0, 0.0],
            [12.0, 30.0],
            [25.0, 45.0],
        ]);
    }
    let exact = Exact::new(&directions, RcwaSettings::reference())?;
    let mut curves = Vec::new();
    for (name, settings) in groups(size) {
        let rows = settings
            .into_iter()
            .map(|(setting, model)| row(&exact, setting, &model));
        curves.push(Curve {
            name: name.into(),
            rows: rows.collect::<Result<_, LaboratoryError>>()?,
        });
    }
    Ok(Table {
        knob: "levels",
        work: format!(
            "P of the left and right half of {PIXEL}, mean of s and p, {WAVELENGTH_NM} nm, from (theta, phi) in deg: {directions:?}"
        ),
        reference: "Fourier modes, preset reference, which is within 0.3 % of finer ones and within 1 % of independent curves".into(),
        seconds_unit: "s a direction",
        error_unit: "RMS of P, % of the largest",
        curves,
        law: None,
        notes: vec![
            "The time of a corrected direction holds its part of the exact runs, spread over the directions of a standard table.".into(),
            "At phi = 0 a mirror makes rcwa about four times and fdtd about twice as fast as elsewhere.".into(),
            "The geometric level takes next to nothing, and is timed by the smallest steps that the clock has.".into(),
        ],
    })
}

fn groups(size: Size) -> Vec<Group> {
    let named = |name: &str, model: PixelModel| (name.to_owned(), model);
    let corrected = |runs: usize| {
        let exact = PixelModel::Rcwa(RcwaSettings::draft());
        let model = PixelModel::Corrected(CorrectedSettings::with(exact, runs));
        (format!("{runs} runs of rcwa draft"), model)
    };
    let geometric = PixelModel::Geometric {
        focal_length_um: FOCAL_UM,
    };
    let mut fdtd = vec![named("draft", PixelModel::Fdtd(FdtdSettings::draft()))];
    if size == Size::Full {
        fdtd.push(named(
            "reference",
            PixelModel::Fdtd(FdtdSettings::reference()),
        ));
    }
    let wave = [
        ("draft", WaveSettings::draft()),
        ("standard", WaveSettings::standard()),
        ("reference", WaveSettings::reference()),
    ];
    let rcwa = [
        ("draft", RcwaSettings::draft()),
        ("standard", RcwaSettings::standard()),
    ];
    vec![
        ("geometric", vec![named("boxes", geometric)]),
        (
            "wave",
            wave.map(|(name, s)| named(name, PixelModel::Wave(s)))
                .to_vec(),
        ),
        ("corrected wave", [6, 16].map(corrected).to_vec()),
        (
            "rcwa",
            rcwa.map(|(name, s)| named(name, PixelModel::Rcwa(s)))
                .to_vec(),
        ),
        ("fdtd", fdtd),
    ]
}

fn row(exact: &Exact, setting: String, model: &PixelModel) -> Result<Row, LaboratoryError> {
    let (mut seconds, error) = exact.judge(model)?;
    if let PixelModel::Corrected(settings) = model {
        seconds += of_exact_runs(exact, settings)? / directions_of_a_table(exact) as f64;
    }
    Ok(Row::new(setting, seconds, error))
}

/// Processor seconds of all exact runs of the corrected level.
fn of_exact_runs(exact: &Exact, settings: &CorrectedSettings) -> Result<f64, LaboratoryError> {
    // A run off the mirrors, which is what nearly all of them are, stands for each.
    let lit = settings.exact.solver(&exact.stack, WAVELENGTH_NM)?;
    let (seconds, answer) = best_of(1, || lit.on_microlens(0.3, 0.2));
    answer?;
    Ok(seconds * settings.runs as f64)
}

/// Directions that a standard table of the pixel simulates: an octant of its grid.
fn directions_of_a_table(exact: &Exact) -> usize {
    let settings = TableSettings::new(Level::Wave, Preset::Standard, &exact.stack);
    let step = settings.cosine_max / settings.steps as f64;
    let octant = (0..=settings.steps).flat_map(|i| (0..=i).map(move |j| (i as f64, j as f64)));
    octant
        .filter(|(i, j)| i.hypot(*j) * step <= LARGEST_SINE)
        .count()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn levels_come_nearer_to_fourier_modes_from_boxes_to_wave_to_rcwa_draft() {
        // Coarser than the reference, but an independent model of all that is judged here but rcwa itself.
        let exact = Exact::new(&[[0.0, 0.0], [10.0, 0.0]], RcwaSettings::standard()).unwrap();
        let error = |model: PixelModel| exact.judge(&model).unwrap().1;
        let boxes = error(PixelModel::Geometric {
            focal_length_um: FOCAL_UM,
        });
        let wave = error(PixelModel::Wave(WaveSettings::standard()));
        let rcwa = error(PixelModel::Rcwa(RcwaSettings::draft()));
        // Bounds stated by the presets: rcwa draft within 1 % of the strong half, so of the largest P.
        assert!(
            rcwa < 1.0 && rcwa < wave && wave < boxes,
            "{rcwa} {wave} {boxes}"
        );
    }
}
