//! One table of many wavelengths from tables of one each, which are simulated and kept apart: another set of
//! wavelengths uses again those that it shares.

use super::{AngularResponse, ResponseAxes, ResponseError, ResponseMeta};
use crate::em::mosaic::FilterColour;
use crate::spectrum::ChannelWavelengths;

impl AngularResponse {
    /// The table of all wavelengths of `tables`, which are of one pixel on the same directions and shifts, in the order
    /// of their wavelengths. How a lens shift moves the response, and which shift chief rays need, is taken from the
    /// table nearest to `reference_nm`.
    ///
    /// # Errors
    /// No table, or tables that differ in more than the wavelength.
    pub fn from_wavelengths(tables: &[Self], reference_nm: f64) -> Result<Self, ResponseError> {
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
            let other = t.axes();
            if (&other.u, &other.v, &other.shifts_um) != (&axes.u, &axes.v, &axes.shifts_um) {
                return Err(differ("u, v, shift_um", t));
            }
            let other = t.meta();
            if (other.subpixels, other.pitch_um) != (meta.subpixels, meta.pitch_um) {
                return Err(differ("sub-pixels, pitch", t));
            }
            if (&other.pixel, &other.model, &other.shift_grid)
                != (&meta.pixel, &meta.model, &meta.shift_grid)
            {
                return Err(differ("pixel, model, shift grid", t));
            }
        }
        let mut planes: Vec<(f64, &[f32])> = Vec::new();
        for t in tables {
            let wavelengths_nm = t.axes().wavelengths_nm.iter().copied();
            let length = t.table().len() / t.axes().wavelengths_nm.len();
            planes.extend(wavelengths_nm.zip(t.table().chunks_exact(length)));
        }
        planes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let wavelengths_nm: Vec<f64> = planes.iter().map(|(nm, _)| *nm).collect();
        let mut key = blake3::Hasher::new();
        for t in tables {
            key.update(t.meta().key.as_bytes());
        }
        let settings = meta.settings.at_wavelengths(&wavelengths_nm);
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
    /// One table for channels that are bands, of those of all colours of a mosaic (in the order of
    /// [`FilterColour::ALL`]): at each wavelength of a channel, what the microlenses of its colour make of it. Channels
    /// know no light but that of their bands, so what a filter lets through of the others is not in it.
    ///
    /// # Errors
    /// A wavelength of two channels, or one that the tables were not simulated at.
    pub fn from_channels(
        colours: [&Self; FilterColour::ALL.len()],
        wavelengths: &ChannelWavelengths,
    ) -> Result<Self, ResponseError> {
        let channels = 0..colours.len();
        let every: usize = channels.map(|c| wavelengths.response_nm(c).len()).sum();
        let nm = wavelengths.all_response_nm();
        if nm.len() < every {
            let allowed = "each in the band of one channel";
            return Err(ResponseError::value(
                "wavelengths_nm",
                format!("{nm:?}"),
                allowed,
            ));
        }
        let pixel = &colours[0].meta().pixel.with_colour(FilterColour::default());
        let mut parts = Vec::with_capacity(every);
        for (channel, table) in colours.into_iter().enumerate() {
            for nm in wavelengths.response_nm(channel) {
                parts.push(table.at_one(nm)?.with_pixel(pixel.clone()));
            }
        }
        Self::from_wavelengths(&parts, wavelengths.reference_nm())
    }

    /// The table at one of its wavelengths.
    ///
    /// # Errors
    /// A wavelength that it has not.
    fn at_one(&self, nm: f64) -> Result<Self, ResponseError> {
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
