//! `qpgen lens import`: what loads of a folder of lens files, with figures and a layout of each.

use std::collections::BTreeMap;
use std::path::Path;

use crate::exit::CommandError;
use crate::log::Log;
use crate::progress::Progress;
use crate::{out, outln};
use quadpixel::file;
use quadpixel::lens::{Lens, LensError, LensFigures, Prescription, lens_files};
use quadpixel_laboratory::lens_drawing::layout_svg;
use rayon::prelude::*;

use super::SECTION_FIELDS;

/// Reasons that are printed, at most.
const REASONS: usize = 12;

/// A lens of the folder, or why it is none.
struct Tried {
    /// Relative to the folder.
    file: String,
    lens: Result<(LensFigures, String), LensError>,
}

/// Reads all, writes the report.
///
/// # Errors
/// A folder that cannot be read or has no lens file (2); a disk that fails (1).
pub(super) fn run(folder: &Path, out: &Path, json: bool, log: Log) -> Result<(), CommandError> {
    let files = lens_files(folder).map_err(CommandError::input)?;
    if files.is_empty() {
        return Err(CommandError::input(format!(
            "{}: no lens file; allowed: a folder with .json, .zmx or .seq files in it or below it",
            folder.display()
        )));
    }
    file::probe_folder(out)?;
    let progress = Progress::stages(log);
    progress.stage(format!("reading {} files", files.len()));
    let tried: Vec<Tried> = files.par_iter().map(|file| tried(folder, file)).collect();
    progress.stage("writing".to_owned());
    let reports = reports(&tried);
    file::create_folder(&out.join("layouts"))?;
    file::write_reports(out, &reports)?;
    drop(progress);
    let loaded = tried.iter().filter(|t| t.lens.is_ok()).count();
    if json {
        let lenses: Vec<_> = tried.iter().map(as_json).collect();
        let object = serde_json::json!({
            "files": tried.len(), "loaded": loaded, "out": out.display().to_string(), "lenses": lenses
        });
        outln!("{object}");
        return Ok(());
    }
    for t in &tried {
        if let Ok((lens, _)) = &t.lens {
            outln!("{}", row(&t.file, lens));
        }
    }
    out!("{}", reasons(&tried));
    outln!(
        "{loaded} of {} files load: {}",
        tried.len(),
        out.join("lenses.csv").display()
    );
    Ok(())
}

fn tried(folder: &Path, file: &Path) -> Tried {
    let read = || {
        let lens = Lens::new(&Prescription::from_file(file)?)?;
        let figures = LensFigures::of(&lens)?;
        let fields = SECTION_FIELDS.map(|part| part * figures.half_field_deg);
        let layout = layout_svg(&lens, &fields)?;
        Ok((figures, layout))
    };
    let relative = file.strip_prefix(folder).unwrap_or(file);
    Tried {
        file: relative.display().to_string(),
        lens: read(),
    }
}

fn row(file: &str, lens: &LensFigures) -> String {
    format!(
        "{file:<44} {:>9.3} mm  F/{:<6.2} ±{:>5.1}°  BFL {:>9.3} mm  {}",
        lens.efl_mm,
        lens.f_number,
        lens.half_field_deg,
        lens.bfl_mm,
        if lens.warnings.is_empty() {
            ""
        } else {
            "trimmed"
        }
    )
}

/// How many files fail for the same reason, the most frequent first: of a message what stands behind the file.
fn reasons(tried: &[Tried]) -> String {
    let mut counts: BTreeMap<String, (usize, &str)> = BTreeMap::new();
    for t in tried {
        if let Err(error) = &t.lens {
            let text = error.to_string();
            let what = text
                .split_once(&t.file)
                .map_or(text.as_str(), |(_, what)| what);
            let what = what.trim_start_matches([':', ' ']);
            counts.entry(what.to_owned()).or_insert((0, &t.file)).0 += 1;
        }
    }
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|(_, (count, _))| std::cmp::Reverse(*count));
    let line = |(what, (count, file)): &(String, (usize, &str))| {
        format!("{count:>5} × {what}  (such as {file})\n")
    };
    let more = match counts.len().saturating_sub(REASONS) {
        0 => String::new(),
        more => format!("      and {more} other reasons: see lenses.csv\n"),
    };
    counts.iter().take(REASONS).map(line).collect::<String>() + &more
}

fn as_json(t: &Tried) -> serde_json::Value {
    match &t.lens {
        Ok((lens, _)) => serde_json::json!({ "file": t.file, "lens": lens, "kind": lens.kind() }),
        Err(error) => serde_json::json!({ "file": t.file, "error": error.to_string() }),
    }
}

/// lenses.csv, and a layout of each lens by its number in it.
fn reports(tried: &[Tried]) -> Vec<(String, Vec<u8>)> {
    let quoted = |text: &str| {
        format!(
            "\"{}\"",
            text.replace('"', "\"\"").replace(['\n', '\r'], " ")
        )
    };
    let mut csv = String::from(
        "number,file,title,kind,efl_mm,f_number,half_field_deg,bfl_mm,surfaces,layout,warnings,error\n",
    );
    let mut files = Vec::new();
    for (number, t) in (1..).zip(tried) {
        match &t.lens {
            Ok((lens, layout)) => {
                let name = format!("layouts/{number:06}.svg");
                let kind = serde_json::to_value(lens.kind()).unwrap_or_default();
                csv += &format!(
                    "{number},{},{},{},{:.6},{:.4},{:.3},{:.6},{},{name},{},\n",
                    quoted(&t.file),
                    quoted(&lens.title),
                    kind.as_str().unwrap_or_default(),
                    lens.efl_mm,
                    lens.f_number,
                    lens.half_field_deg,
                    lens.bfl_mm,
                    lens.surfaces,
                    quoted(&lens.warnings.join(" "))
                );
                files.push((name, layout.clone().into_bytes()));
            }
            Err(error) => {
                let file = quoted(&t.file);
                csv += &format!("{number},{file},,,,,,,,,,{}\n", quoted(&error.to_string()));
            }
        }
    }
    files.push(("lenses.csv".to_owned(), csv.into_bytes()));
    files
}
