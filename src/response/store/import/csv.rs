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
    let columns = Columns::new(number, heading)?;
    let rows = lines.map(|(line, text)| columns.row(line, text, subpixels));
    let rows = rows.collect::<Result<Vec<Row>, String>>()?;
    if rows.is_empty() {
        return Err("no line below the names of the columns".into());
    }
    Ok(rows)
}

/// Where the columns stand.
struct Columns {
    separator: char,
    /// How many there are.
    count: usize,
    /// By [`COLUMNS`].
    places: [Option<usize>; COLUMNS.len()],
}

impl Columns {
    fn new(number: usize, heading: &str) -> Result<Self, String> {
        let separator = [',', ';', '\t']
            .into_iter()
            .find(|&c| heading.contains(c))
            .unwrap_or(',');
        let names: Vec<&str> = heading.split(separator).map(unquoted).collect();
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
        match (0..4).find(|&k| places[k].is_none()) {
            Some(missing) => Err(format!(
                "line {number}: no column {}; found: {}; needed: theta_deg, phi_deg, subpixel, P, and wavelength_nm if there are several",
                COLUMNS[missing],
                names.join(", ")
            )),
            None => Ok(Self {
                separator,
                count: names.len(),
                places,
            }),
        }
    }

    fn row(&self, line: usize, text: &str, subpixels: Subpixels) -> Result<Row, String> {
        let cells: Vec<&str> = text.split(self.separator).map(unquoted).collect();
        if let Some(more) = cells
            .get(self.count..)
            .and_then(|c| c.iter().find(|c| !c.is_empty()))
        {
            // A decimal comma between commas would be read as two cells, the first of them a 0.
            return Err(format!(
                "line {line}: {} cells, but {} names of columns; `{more}` is one too many (a decimal comma? allowed: a point)",
                cells.len(),
                self.count
            ));
        }
        let number = |column: usize, (low, high): (f64, f64), allowed: &str| {
            let Some(cell) = self.cell(line, &cells, column)? else {
                return Ok(None);
            };
            match cell.parse::<f64>() {
                Ok(x) if (low..=high).contains(&x) => Ok(Some(x)),
                _ => Err(self.refused(line, column, cell, allowed)),
            }
        };
        let needed = |x: Option<f64>| x.ok_or_else(|| format!("line {line}: a column is missing"));
        let theta = number(0, (-89.9, 89.9), "-89.9 to 89.9 degrees")?;
        let phi = number(1, (-720.0, 720.0), "degrees")?;
        let sub_pixel = self.cell(line, &cells, 2)?.unwrap_or_default();
        let named = |i: &usize| subpixels.name(*i).eq_ignore_ascii_case(sub_pixel);
        let sub_pixel = (0..subpixels.count()).find(named).ok_or_else(|| {
            let names: Vec<String> = (0..subpixels.count()).map(|i| subpixels.name(i)).collect();
            self.refused(line, 2, sub_pixel, &names.join(", "))
        })?;
        let p = number(3, (-SHARE_TOLERANCE, 1.0 + SHARE_TOLERANCE), "0 to 1")?;
        let wavelength_nm = number(4, (100.0, 3000.0), "100 to 3000 nm")?;
        Ok(Row {
            line,
            wavelength_nm,
            theta_deg: needed(theta)?,
            phi_deg: needed(phi)?,
            sub_pixel,
            p: needed(p)?,
        })
    }

    /// The cell of a column, `None` of one that the file does not have.
    fn cell<'a>(
        &self,
        line: usize,
        cells: &[&'a str],
        column: usize,
    ) -> Result<Option<&'a str>, String> {
        let Some(place) = self.places[column] else {
            return Ok(None);
        };
        cells.get(place).copied().map(Some).ok_or_else(|| {
            format!(
                "line {line}: {} columns, but {} is column {}",
                cells.len(),
                COLUMNS[column],
                place + 1
            )
        })
    }

    fn refused(&self, line: usize, column: usize, cell: &str, allowed: &str) -> String {
        let place = self.places[column].map_or(0, |p| p + 1);
        let name = COLUMNS[column];
        format!("line {line}, column {place} ({name}) is `{cell}`; allowed: {allowed}")
    }
}

fn unquoted(cell: &str) -> &str {
    cell.trim().trim_matches('"').trim()
}
