//! The lines of the CSV file.

use crate::sensor::Subpixels;

/// What a P may be below 0, or P or a sum of P above 1: monitors of FDTD tools are not exact.
pub(super) const SHARE_TOLERANCE: f64 = 0.01;

/// One line.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    /// Counted from 1, as editors do.
    pub line: usize,
    pub wavelength_nm: Option<f64>,
    pub theta_deg: f64,
    pub phi_deg: f64,
    pub sub_pixel: usize,
    pub p: f64,
}

const COLUMNS: [&str; 5] = ["theta_deg", "phi_deg", "subpixel", "P", "wavelength_nm"];

/// All rows; an error names line and column.
pub(super) fn read(text: &str, subpixels: Subpixels) -> Result<Vec<Row>, String> {
    let text = text.trim_start_matches('\u{feff}');
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (number, heading) = lines
        .next()
        .ok_or("no line with the names of the columns")?;
    let comma = [',', ';', '\t']
        .into_iter()
        .find(|&c| heading.contains(c))
        .unwrap_or(',');
    let names: Vec<&str> = heading.split(comma).map(unquoted).collect();
    let mut places = [None; COLUMNS.len()];
    for (place, name) in names.iter().enumerate() {
        let Some(known) = COLUMNS.iter().position(|c| c.eq_ignore_ascii_case(name)) else {
            continue; // A column of something else is no harm.
        };
        if places[known].replace(place).is_some() {
            return Err(format!(
                "line {number}: two columns are named {}",
                COLUMNS[known]
            ));
        }
    }
    if let Some(missing) = (0..4).find(|&k| places[k].is_none()) {
        return Err(format!(
            "line {number}: no column {}; found: {}; needed: theta_deg, phi_deg, subpixel, P, and wavelength_nm if there are several",
            COLUMNS[missing],
            names.join(", ")
        ));
    }
    let mut rows = Vec::new();
    for (line, text) in lines {
        let cells: Vec<&str> = text.split(comma).map(unquoted).collect();
        let cell = |column: usize| -> Result<Option<&str>, String> {
            let Some(place) = places[column] else {
                return Ok(None);
            };
            match cells.get(place) {
                Some(cell) => Ok(Some(cell)),
                None => Err(format!(
                    "line {line}: {} columns, but {} is column {}",
                    cells.len(),
                    COLUMNS[column],
                    place + 1
                )),
            }
        };
        let refused = |column: usize, cell: &str, allowed: &str| {
            let place = places[column].map_or(0, |p| p + 1);
            let name = COLUMNS[column];
            format!("line {line}, column {place} ({name}) is `{cell}`; allowed: {allowed}")
        };
        let number = |column: usize, (low, high): (f64, f64), allowed: &str| {
            let Some(cell) = cell(column)? else {
                return Ok(None);
            };
            match cell.parse::<f64>() {
                Ok(x) if (low..=high).contains(&x) => Ok(Some(x)),
                _ => Err(refused(column, cell, allowed)),
            }
        };
        let needed = |x: Option<f64>| x.ok_or_else(|| format!("line {line}: a column is missing"));
        let theta = number(0, (-89.9, 89.9), "-89.9 to 89.9 degrees")?;
        let phi = number(1, (-720.0, 720.0), "degrees")?;
        let sub_pixel = cell(2)?.unwrap_or_default();
        let named = |i: &usize| subpixels.name(*i).eq_ignore_ascii_case(sub_pixel);
        let sub_pixel = (0..subpixels.count()).find(named).ok_or_else(|| {
            let names: Vec<String> = (0..subpixels.count()).map(|i| subpixels.name(i)).collect();
            refused(2, sub_pixel, &names.join(", "))
        })?;
        let p = number(3, (-SHARE_TOLERANCE, 1.0 + SHARE_TOLERANCE), "0 to 1")?;
        let wavelength_nm = number(4, (100.0, 3000.0), "100 to 3000 nm")?;
        rows.push(Row {
            line,
            wavelength_nm,
            theta_deg: needed(theta)?,
            phi_deg: needed(phi)?,
            sub_pixel,
            p: needed(p)?,
        });
    }
    if rows.is_empty() {
        return Err("no line below the names of the columns".into());
    }
    Ok(rows)
}

fn unquoted(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}
