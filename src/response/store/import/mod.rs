//! Responses that were computed elsewhere: a CSV list of (θ, φ, sub-pixel, P), as commercial FDTD tools export it,
//! becomes a table.
//!
//! The directions may lie on a grid or anywhere; the table's nodes are read from them by [`scattered`]. Beyond the
//! largest angle of the file a node repeats what lies on its meridian there.

mod csv;
mod scattered;

use std::collections::BTreeMap;
use std::path::Path;

use rayon::prelude::*;

use self::csv::Row;
use self::scattered::{Sample, Scattered};
use crate::em::PixelStack;
use crate::em::light::direction_cosines;
use crate::em::symmetry::symmetries;
use crate::hash::canonical_json;
use crate::response::tabulate::resample::shares;
use crate::response::{AngularResponse, Provenance, ResponseAxes, ResponseError, ResponseMeta};

/// Table nodes from u = 0 to the table's end.
const STEPS: i64 = 60;
/// The table's end where the file goes further out.
const LARGEST_COSINE: f64 = 0.8;
/// The largest distance in (u, v) to the nearest direction: steps of 30° in φ at θ = 70° have it. More is a file that
/// does not cover its cone.
const LARGEST_HOLE: f64 = 0.25;
/// Directions nearer than this in (u, v) are the same one.
const SAME: f64 = 1e-6;

/// How a file is to be read.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportSettings {
    /// Wavelength in nm of a file that has no column for it.
    pub wavelength_nm: f64,
    /// The file holds only part of the directions; the symmetry of the pixel gives the others.
    pub symmetric: bool,
}

impl AngularResponse {
    /// Reads a CSV file. Its first line that is no `#` comment names the columns `theta_deg`, `phi_deg`, `subpixel`,
    /// `P`, in any order, and `wavelength_nm` if there are several; commas, semicolons or tabs part them. P is the
    /// power absorbed by the sub-pixel over `irradiance × pitch² × cos θ`, mean of both polarizations; light travels
    /// along (sin θ cos φ, sin θ sin φ, −cos θ). `stack` tells the pitch, the sub-pixels, and how a lens shift moves
    /// the response.
    ///
    /// # Errors
    /// A line and column that is no such thing, a direction without all sub-pixels, or directions that leave a hole.
    pub fn read_csv(
        path: &Path,
        stack: &PixelStack,
        settings: &ImportSettings,
    ) -> Result<Self, ResponseError> {
        stack.check()?;
        let bytes = crate::file::read(path).map_err(|e| ResponseError::Io {
            path: path.to_owned(),
            source: e.cause,
        })?;
        let format = |why: String| ResponseError::Format {
            path: path.to_owned(),
            why,
        };
        let text = std::str::from_utf8(&bytes).map_err(|e| format(e.to_string()))?;
        let rows = csv::read(text, stack.subpixels).map_err(format)?;
        let mut by_wavelength: BTreeMap<u64, Vec<Row>> = BTreeMap::new();
        for row in rows {
            let nm = row.wavelength_nm.unwrap_or(settings.wavelength_nm);
            // Positive floats sort as their bits do.
            by_wavelength.entry(nm.to_bits()).or_default().push(row);
        }
        let wavelengths_nm: Vec<f64> = by_wavelength.keys().map(|&b| f64::from_bits(b)).collect();
        let count = stack.subpixels.count();
        let mut planes = Vec::new();
        for rows in by_wavelength.into_values() {
            let samples = samples(rows, stack, settings.symmetric).map_err(format)?;
            planes.push(Scattered::new(samples, count));
        }
        let rim = planes.iter().map(Scattered::rim).fold(1.0, f64::min);
        let end = rim.min(LARGEST_COSINE);
        if end < 0.01 {
            return Err(format(
                "no direction is more than half a degree from the normal".into(),
            ));
        }
        let axis: Vec<f64> = (-STEPS..=STEPS)
            .map(|i| end * i as f64 / STEPS as f64)
            .collect();
        let mut values = Vec::new();
        for plane in &planes {
            values.extend(table_of(plane, &axis, count).map_err(format)?);
        }
        let json = |e: serde_json::Error| ResponseError::value("pixel", e, "finite numbers");
        let about = (stack, settings.wavelength_nm, settings.symmetric);
        let mut hash = blake3::Hasher::new();
        hash.update(&bytes);
        hash.update(canonical_json(&about).map_err(json)?.as_bytes());
        let file = path.file_name().unwrap_or_default().to_string_lossy();
        let meta = ResponseMeta {
            model: "import-1".into(),
            settings: Provenance::Imported {
                file: file.into_owned(),
                symmetric: settings.symmetric,
            },
            pixel: stack.clone(),
            pitch_um: stack.pitch_um,
            subpixels: stack.subpixels,
            frame: stack.moving_frame(wavelengths_nm[0])?,
            key: hash.finalize().to_hex().to_string(),
            shift_grid: None,
            chief_ray_shifts: None,
            corrections: Vec::new(),
            charge: Default::default(),
        };
        let axes = ResponseAxes {
            wavelengths_nm,
            shifts_um: vec![[0.0, 0.0]],
            u: axis.clone(),
            v: axis,
        };
        AngularResponse::new(axes, meta, values).map_err(|e| format(e.to_string()))
    }
}

/// The rows of one wavelength, by direction.
fn samples(rows: Vec<Row>, stack: &PixelStack, symmetric: bool) -> Result<Vec<Sample>, String> {
    let s = stack.subpixels;
    let whole = |x: f64| (x / SAME).round() as i64;
    // By direction, the rows of each sub-pixel: θ = 0 may stand there once for every φ.
    let mut places: BTreeMap<[i64; 2], Vec<Vec<Row>>> = BTreeMap::new();
    for row in rows {
        let at = direction_cosines(row.theta_deg, row.phi_deg).map(whole);
        let own = places
            .entry(at)
            .or_insert_with(|| vec![Vec::new(); s.count()]);
        own[row.sub_pixel].push(row);
    }
    let mut all = Vec::new();
    for own in places.into_values() {
        let mut sums = Vec::with_capacity(own.len());
        for rows in &own {
            agree(rows)?;
            sums.push((rows.iter().map(|row| row.p).sum::<f64>(), rows.len() as f64));
        }
        let Some(row) = own.iter().flatten().min_by_key(|row| row.line).cloned() else {
            continue;
        };
        let Row {
            line,
            theta_deg,
            phi_deg,
            ..
        } = row;
        if let Some(i) = sums.iter().position(|p| p.1 == 0.0) {
            return Err(format!(
                "line {line}: theta {theta_deg}, phi {phi_deg} has no value for sub-pixel {}",
                s.name(i)
            ));
        }
        let p: Vec<f64> = sums.iter().map(|(sum, n)| sum / n).collect();
        let sum: f64 = p.iter().sum();
        if sum > 1.0 + csv::SHARE_TOLERANCE {
            return Err(format!(
                "line {line}: theta {theta_deg}, phi {phi_deg}: P sums to {sum:.4}; allowed: at most 1 (of the power incident on the whole pixel)"
            ));
        }
        all.push(Sample {
            at: direction_cosines(theta_deg, phi_deg),
            p,
        });
    }
    Ok(if symmetric {
        mirrored(&all, stack)
    } else {
        all
    })
}

/// Rows of one direction and sub-pixel: none stands there twice, and all say the same within what monitors are off by.
fn agree(rows: &[Row]) -> Result<(), String> {
    for (i, row) in rows.iter().enumerate() {
        for earlier in &rows[..i] {
            let (line, other) = (row.line, earlier.line);
            if (row.theta_deg, row.phi_deg) == (earlier.theta_deg, earlier.phi_deg) {
                return Err(format!(
                    "line {line}: the direction and sub-pixel of line {other} again"
                ));
            }
            if (row.p - earlier.p).abs() > csv::SHARE_TOLERANCE {
                return Err(format!(
                    "line {line}: P is {}, but {} on line {other}, of the same direction and sub-pixel",
                    row.p, earlier.p
                ));
            }
        }
    }
    Ok(())
}

/// The samples and their images under the pixel's symmetries; the mean where they meet.
fn mirrored(samples: &[Sample], stack: &PixelStack) -> Vec<Sample> {
    let s = stack.subpixels;
    let mut places: BTreeMap<[i64; 2], (Sample, f64)> = BTreeMap::new();
    for sample in samples {
        for symmetry in symmetries(stack) {
            let at = symmetry.direction(sample.at);
            let mut p = vec![0.0; s.count()];
            for (i, &value) in sample.p.iter().enumerate() {
                p[symmetry.sub_pixel(s, i)] = value;
            }
            let key = at.map(|x| (x / SAME).round() as i64);
            let (sum, n) = places.entry(key).or_insert_with(|| {
                let p = vec![0.0; s.count()];
                (Sample { at, p }, 0.0)
            });
            sum.p.iter_mut().zip(&p).for_each(|(sum, p)| *sum += p);
            *n += 1.0;
        }
    }
    let mean = |(mut sample, n): (Sample, f64)| {
        sample.p.iter_mut().for_each(|p| *p /= n);
        sample
    };
    places.into_values().map(mean).collect()
}

fn table_of(plane: &Scattered, axis: &[f64], count: usize) -> Result<Vec<f32>, String> {
    let rim = plane.rim();
    let rows: Result<Vec<Vec<f64>>, String> = axis
        .par_iter()
        .map(|&v| {
            let mut row = Vec::with_capacity(axis.len() * count);
            for &u in axis {
                let inwards = (rim / u.hypot(v)).min(1.0);
                let at = [u * inwards, v * inwards];
                let hole = plane.nearest(at);
                if hole > LARGEST_HOLE {
                    let theta = at[0].hypot(at[1]).min(1.0).asin().to_degrees();
                    let phi = at[1].atan2(at[0]).to_degrees().rem_euclid(360.0);
                    return Err(format!(
                        "no direction near theta {theta:.0}, phi {phi:.0} deg (the nearest is {hole:.2} away in direction cosines); allowed: \
                         directions over the whole cone, or one part of it whose mirror images are the rest, imported as symmetric"
                    ));
                }
                row.extend(plane.at(at));
            }
            Ok(row)
        })
        .collect();
    Ok(shares(rows?.concat(), count).0)
}

#[cfg(test)]
mod tests;
