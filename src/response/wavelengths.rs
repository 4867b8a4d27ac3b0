//! One table of many wavelengths from tables of one each, which are simulated and kept apart: another set of wavelengths uses again those
//! that it shares.

use super::{
    AngularResponse, CachedTable, ResponseAxes, ResponseCache, ResponseError, ResponseMeta,
    TableSettings,
};
use crate::em::PixelStack;

impl AngularResponse {
    /// The table of all wavelengths of `tables`, which are of one pixel on the same directions and shifts, in the order of their
    /// wavelengths. How a lens shift moves the response, and which shift chief rays need, is taken from the table nearest to
    /// `reference_nm`.
    ///
    /// # Errors
    /// No table, or tables that differ in more than the wavelength.
    pub fn of_wavelengths(tables: &[Self], reference_nm: f64) -> Result<Self, ResponseError> {
        let distance = |t: &&Self| (t.axes().wavelengths_nm[0] - reference_nm).abs();
        let nearest = tables
            .iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let differ = |what: &'static str, t: &Self| {
            let nm = &t.axes().wavelengths_nm;
            ResponseError::value(
                what,
                format!("another at {nm:?} nm"),
                "the same in all tables",
            )
        };
        let Some(main) = nearest else {
            return Err(ResponseError::value("tables", 0, "at least one"));
        };
        let (axes, meta) = (main.axes(), main.meta());
        for t in tables {
            let own = t.axes();
            if (&own.u, &own.v, &own.shifts_um) != (&axes.u, &axes.v, &axes.shifts_um) {
                return Err(differ("u, v, shift_um", t));
            }
            let own = t.meta();
            if (own.subpixels, own.pitch_um) != (meta.subpixels, meta.pitch_um) {
                return Err(differ("sub-pixels, pitch", t));
            }
            if (&own.pixel, &own.model, &own.shift_grid)
                != (&meta.pixel, &meta.model, &meta.shift_grid)
            {
                return Err(differ("pixel, model, shift grid", t));
            }
        }
        let mut planes: Vec<(f64, &[f32])> = Vec::new();
        for t in tables {
            let own = t.axes().wavelengths_nm.iter().copied();
            let length = t.table().len() / t.axes().wavelengths_nm.len();
            planes.extend(own.zip(t.table().chunks_exact(length)));
        }
        planes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let wavelengths_nm: Vec<f64> = planes.iter().map(|(nm, _)| *nm).collect();
        let mut key = blake3::Hasher::new();
        for t in tables {
            key.update(t.meta().key.as_bytes());
        }
        let mut settings = meta.settings.clone();
        // Of tables of all shifts they stand one level below.
        for place in ["/wavelengths_nm", "/table/wavelengths_nm"] {
            if let Some(told) = settings.pointer_mut(place) {
                *told = wavelengths_nm.clone().into();
            }
        }
        Self::new(
            ResponseAxes {
                wavelengths_nm,
                ..axes.clone()
            },
            ResponseMeta {
                settings,
                key: key.finalize().to_hex().to_string(),
                corrections: (tables.iter().flat_map(|t| t.meta().corrections.clone())).collect(),
                ..meta.clone()
            },
            planes.iter().flat_map(|(_, p)| p.iter().copied()).collect(),
        )
    }
}

impl AngularResponse {
    /// The table at one of its wavelengths.
    ///
    /// # Errors
    /// None of them.
    pub(super) fn at_one(&self, nm: f64) -> Result<Self, ResponseError> {
        let all = &self.axes().wavelengths_nm;
        let Some(place) = all.iter().position(|w| *w == nm) else {
            let what = format!("{nm} nm");
            return Err(ResponseError::value(
                "wavelength",
                what,
                "one of the table's",
            ));
        };
        let length = self.table().len() / all.len();
        let axes = ResponseAxes {
            wavelengths_nm: vec![nm],
            ..self.axes().clone()
        };
        let table = self.table()[place * length..][..length].to_vec();
        Self::new(axes, self.meta().clone(), table)
    }
}

impl ResponseCache {
    /// The table of all wavelengths of `settings`, each from the cache or made for it and kept ([`Self::get_or_build`]). The report is that
    /// of none.
    ///
    /// # Errors
    /// Bad settings, or a model that fails.
    pub fn get_or_build_each(
        &self,
        stack: &PixelStack,
        settings: &TableSettings,
        reference_nm: f64,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<CachedTable, ResponseError> {
        settings.check()?;
        let count = settings.wavelengths_nm.len();
        let (mut tables, mut warnings) = (Vec::with_capacity(count), Vec::new());
        for (i, &nm) in settings.wavelengths_nm.iter().enumerate() {
            let one = TableSettings {
                wavelengths_nm: vec![nm],
                ..settings.clone()
            };
            // A wavelength has as many directions as any other.
            let part = |done, total| progress(i * total + done, count * total);
            let made = self.get_or_build(stack, &one, &part)?;
            warnings.extend(made.warnings);
            tables.push(made.table);
        }
        Ok(CachedTable {
            table: match <[AngularResponse; 1]>::try_from(tables) {
                Ok([only]) => only,
                Err(several) => AngularResponse::of_wavelengths(&several, reference_nm)?,
            },
            report: None,
            warnings,
        })
    }
}
