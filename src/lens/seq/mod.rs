//! Prescriptions from CODE V sequence files (`.seq`).
//!
//! Commands stand one to a line or part by `;`, `!` begins a comment, `&` goes on in the next line. Read: `RDM` (radii;
//! without it the second number of a surface is a curvature), `TIT`, `DIM M|C|I`, `EPD`, `FNO`, `WL` (nm),
//! `YAN`/`XAN` (deg) and `YIM` (mm) for the field, and surfaces `SO`, `S`, `S1`, …, `SI` with `STO`, `CIR`,
//! `CON`/`ASP` with `K` and `A` to `I` (r⁴ to r²⁰), `THI`, `RDY`, `CUY`, `GLA`, `SLB`. Object and image surface, and
//! plane dummies in air that are not the stop, are joined to the distances beside them. What would change the rays and
//! is not read is refused: mirrors, decentred or tilted surfaces, other surface types, apertures that are not circles,
//! private catalogues. Every other command is passed over.
//!
//! **Apertures.** A surface without `CIR` is as large as the paraxial bundles of axis and largest field are on it,
//! with [`ROOM`] to spare; `EPD` or `FNO` sets the stop.
//!
//! **Glass.** `NAME_CATALOG` by the catalogue of this crate (hyphens do not count), or the number of a fictitious glass
//! `nnnnnn.vvvvvv`: n_d = 1.nnnnnn, V_d = vv.vvvv.

mod bundle;
mod commands;
mod surface;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;

use super::error::LensError;
use super::prescription::{PrescribedSurface, Prescription, Stated, Verification};
use super::zmx::format_error;
use commands::Reader;
use surface::SeqSurface;

/// A bundle's height on a surface times this is the surface's semi-aperture, where the file gives none.
const ROOM: f64 = 1.05;

impl Prescription {
    /// Reads and checks a CODE V sequence file; `file` is what errors call it.
    ///
    /// # Errors
    /// [`LensError::Format`] for what cannot be read or is not supported, naming the surface and the command;
    /// [`LensError::Value`] for values that no lens can have (see [`Prescription::check`]).
    pub fn from_seq(bytes: &[u8], file: &str) -> Result<Prescription, LensError> {
        let mut reader = Reader::new(file);
        reader.read(&super::zmx::decode(bytes))?;
        let Reader {
            header,
            mut surfaces,
            ..
        } = reader;
        if surfaces.len() < 3 {
            let reason = format!(
                "{} surfaces: there must be SO, a lens and SI",
                surfaces.len()
            );
            return Err(format_error(file, "S", &reason));
        }
        let scale = header.mm_per_unit;
        surfaces.iter_mut().for_each(|s| s.scale(scale));
        let aperture = bundle::entrance_pupil(file, &surfaces, &header)?;
        bundle::fill_apertures(&mut surfaces, &aperture, &header, ROOM);
        if let Some(stop) = bundle::stop(&surfaces) {
            surfaces[stop].semi_mm = Some(aperture.stop_semi_mm);
        }
        Prescription {
            file: file.into(),
            name: header.title,
            source: file.into(),
            notes: String::new(),
            surfaces: prescribed(surfaces, file)?,
            wavelengths_nm: header.wavelengths_nm,
            fold: None,
            stated: Stated::default(),
            verification: Verification::default(),
            warnings: Vec::new(),
        }
        .checked()
    }
}

/// Object and image surface taken off, plane dummies in air joined to the distance before them.
fn prescribed(surfaces: Vec<SeqSurface>, file: &str) -> Result<Vec<PrescribedSurface>, LensError> {
    let last = surfaces.len() - 1;
    let mut kept: Vec<PrescribedSurface> = Vec::new();
    for (number, s) in surfaces.into_iter().enumerate().take(last).skip(1) {
        let in_air = s.glass.is_none() && kept.last().is_none_or(|before| before.glass.is_none());
        if in_air && s.is_plane() && !s.is_stop {
            if let Some(before) = kept.last_mut() {
                before.thickness_mm += s.thickness;
            }
            continue;
        }
        let semi_aperture_mm = s.semi_mm.filter(|semi| *semi > 0.0).ok_or_else(|| {
            let field = format!("S{number} CIR");
            format_error(
                file,
                &field,
                "nothing tells its size; allowed: a semi-diameter, or EPD or FNO with a field",
            )
        })?;
        kept.push(PrescribedSurface {
            curvature: s.curvature,
            thickness_mm: s.thickness,
            glass: s.glass,
            conic: s.conic,
            aspheric: s.aspheric,
            semi_aperture_mm,
            reflectance: None,
            is_stop: s.is_stop,
            label: s.label,
        });
    }
    Ok(kept)
}
