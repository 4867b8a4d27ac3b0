//! What accuracy costs in time. Each knob's error against time, on stated work, against a converged reference.
//!
//! ```text
//! knobs ─ one thread each, as many at once as there are cores ─▶ tables of rows ─▶ CSV, SVG, Markdown, JSON
//! ```
//!
//! A knob is a file here; the knobs of matching and warping are benches of `algorithms`, which sees images only.

pub mod clock;
mod grid;
mod levels;
mod mesh;
pub mod picture;
mod pixel;
mod rays;
pub mod report;
pub mod row;
mod wavelengths;
mod work;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use quadpixel::file;
use quadpixel_generators::observer::{Event, Observer};

use self::row::Table;
pub use self::work::Size;
use crate::error::LaboratoryError;

/// Above the pictures.
const TITLE: &str = "error against processor time";

/// What is turned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Knob {
    /// Rays per pixel: noise of the image, % of its mean.
    Rays,
    /// Wavelengths per colour channel: % of the image's mean.
    Wavelengths,
    /// Levels of the pixel model (geometric, wave, corrected, rcwa, fdtd): P, % of the largest.
    Levels,
    /// Steps and interpolation of the response table: P, % of the largest.
    Grid,
    /// The mesh of fdtd: P, % of the largest.
    Mesh,
}

impl Knob {
    /// In the order in which they begin: the longest first.
    pub const ALL: [Self; 5] = [
        Self::Levels,
        Self::Mesh,
        Self::Grid,
        Self::Wavelengths,
        Self::Rays,
    ];

    fn table(self, size: Size) -> Result<Table, LaboratoryError> {
        match self {
            Self::Rays => rays::table(size),
            Self::Wavelengths => wavelengths::table(size),
            Self::Levels => levels::table(size),
            Self::Grid => grid::table(size),
            Self::Mesh => mesh::table(size),
        }
    }
}

/// The tables of all knobs, each measured on a thread of its own, in the order of `knobs`.
///
/// # Errors
/// A knob that cannot be measured.
pub fn measured(
    knobs: &[Knob],
    size: Size,
    observer: &dyn Observer,
) -> Result<Vec<Table>, LaboratoryError> {
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, Result<Table, LaboratoryError>)>> = Mutex::new(Vec::new());
    let work = || -> Result<(), LaboratoryError> {
        let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let one = one.map_err(|_| LaboratoryError::Thread)?;
        while let Some((i, knob)) =
            Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|i| Some((i, *knobs.get(i)?)))
        {
            let began = Instant::now();
            let table = one.install(|| knob.table(size));
            if let Ok(table) = &table {
                let seconds = began.elapsed().as_secs_f64();
                observer.event(Event::Info(&format!("{}: {seconds:.0} s", table.knob)));
            }
            // A poisoned lock only means that another thread stopped.
            done.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push((i, table));
        }
        Ok(())
    };
    let threads = rayon::current_num_threads().min(knobs.len());
    let ends: Vec<Result<(), LaboratoryError>> = std::thread::scope(|scope| {
        let all: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let joined = all.into_iter().map(|t| t.join());
        joined
            .map(|end| end.unwrap_or(Err(LaboratoryError::Thread)))
            .collect()
    });
    ends.into_iter().collect::<Result<(), _>>()?;
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(i, _)| *i);
    done.into_iter().map(|(_, table)| table).collect()
}

/// Writes KNOB.csv and KNOB.svg of each table, accuracy.md and accuracy.svg into the folder `out`, which is there; the
/// files written.
///
/// # Errors
/// A disk that fails, or files of others under these names.
pub fn write(out: &Path, tables: &[Table]) -> Result<Vec<String>, LaboratoryError> {
    let mut files = Vec::new();
    let mut file = |name: String, text: String| files.push((name, text.into_bytes()));
    for table in tables {
        file(format!("{}.csv", table.knob), report::csv(table));
        let svg = picture::svg(TITLE, std::slice::from_ref(table));
        file(format!("{}.svg", table.knob), svg);
    }
    file("accuracy.md".into(), report::markdown(tables));
    file("accuracy.svg".into(), picture::svg(TITLE, tables));
    file::write_reports(out, &files)?;
    let path = |(name, _): &(String, Vec<u8>)| out.join(name).display().to_string();
    Ok(files.iter().map(path).collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::row::{Curve, Row};
    use super::*;

    #[test]
    fn every_row_of_a_knob_is_in_its_files_exact_ones_too() {
        let folder = tempfile::tempdir().unwrap();
        let table = Table {
            knob: "rays",
            work: "a picture".into(),
            reference: "many rays".into(),
            seconds_unit: "s",
            error_unit: "%",
            curves: vec![Curve {
                name: "in focus".into(),
                rows: vec![
                    Row::new("4", 0.1, 8.0),
                    Row::new("16", 0.4, 4.0),
                    Row::new("all", 9.0, 0.0),
                ],
            }],
            law: Some(-0.5),
            notes: vec!["a note".into()],
        };
        let files = write(folder.path(), &[table]).unwrap();
        let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
        assert_eq!(files.len(), 4);
        assert_eq!(read("rays.csv").lines().count(), 1 + 3);
        for text in ["| in focus | 16 | 0.400 | 4.00 |", "- a note"] {
            assert!(read("accuracy.md").contains(text), "{text}");
        }
        // Two rows with logarithms: two marks; no number that is none.
        let svg = read("rays.svg");
        assert_eq!(svg.matches("<circle").count(), 2);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert_eq!(svg, read("accuracy.svg"));
    }
}
