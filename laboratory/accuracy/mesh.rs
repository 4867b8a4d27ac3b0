//! The FDTD mesh: P against converged Fourier modes, and seconds per direction.

use crate::error::LaboratoryError;
use quadpixel::em::PixelModel;
use quadpixel::em::fdtd::FdtdSettings;
use quadpixel::em::rcwa::RcwaSettings;

use super::pixel::{Exact, WAVELENGTH_NM};
use super::row::{Curve, Row, Table};
use super::work::{PIXEL, Size};

/// Directions (θ, φ), deg.
const DIRECTIONS: [[f64; 2]; 3] = [[0.0, 0.0], [10.0, 0.0], [20.0, 0.0]];

pub(super) fn table(size: Size) -> Result<Table, LaboratoryError> {
    let exact = Exact::new(&DIRECTIONS, RcwaSettings::reference())?;
    let coarse = FdtdSettings {
        lateral_nm: 55.0,
        cells_per_wavelength: 6.0,
        ..FdtdSettings::draft()
    };
    let mut settings = vec![
        ("coarser than draft", coarse),
        ("draft", FdtdSettings::draft()),
    ];
    if size == Size::Full {
        settings.push(("standard", FdtdSettings::standard()));
        settings.push(("reference", FdtdSettings::reference()));
    }
    let mut rows = Vec::new();
    for (name, s) in settings {
        let (seconds, error) = exact.judge(&PixelModel::Fdtd(s))?;
        let setting = format!(
            "{name}: {} nm, {} layers a wavelength",
            s.lateral_nm, s.cells_per_wavelength
        );
        rows.push(Row::new(setting, seconds, error));
    }
    Ok(Table {
        knob: "mesh",
        work: format!("P of the left and right half of {PIXEL} by fdtd, mean of s and p, {WAVELENGTH_NM} nm, from (theta, phi) in deg: {DIRECTIONS:?}"),
        reference: "Fourier modes, preset reference".into(),
        seconds_unit: "s a direction",
        error_unit: "RMS of P, % of the largest",
        curves: vec![Curve {
            name: "fdtd".into(),
            rows,
        }],
        law: None,
        notes: vec!["Presets standard (four times the time of draft) and reference (twenty to thirty times) run with --full.".into()],
    })
}
