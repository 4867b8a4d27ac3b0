//! `qpgen lens`: what a main lens is and does, as tables and pictures.

mod comparison;
mod import;
mod info;

use crate::number::number;
use crate::{out, outln};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use quadpixel::file::write_aside;
use quadpixel::lens::Field;
use quadpixel::lens::{FocusBy, Lens, LensError, Prescription, builtin_names};
use quadpixel::lens::{SPOT_LINES_NM, rms_radius};
use quadpixel::units::D_LINE_NM;

use crate::exit::CommandError;
use crate::log::{Level, Log};
use quadpixel_laboratory::lens_drawing::{layout_svg, spots_svg};

/// The five-element phone lens that the default dataset looks through.
const DEFAULT_LENS: &str = "wide_US20120327520A1_emb3";
/// Parts of the half field shown in the table, in the spot diagrams and in the section.
const TABLE_FIELDS: [f64; 7] = [0.0, 0.25, 0.5, 0.7, 0.85, 0.95, 1.0];
const SPOT_FIELDS: [f64; 5] = [0.0, 0.35, 0.7, 0.85, 1.0];
const SECTION_FIELDS: [f64; 3] = [0.0, 0.6, 1.0];

/// Arguments of `qpgen lens`.
#[derive(Args, Debug)]
pub struct LensArgs {
    #[command(subcommand)]
    command: LensCommand,
}

#[derive(Subcommand, Debug)]
enum LensCommand {
    /// Lists the built-in lenses.
    ///
    /// Example: qpgen lens list
    #[command(verbatim_doc_comment)]
    List {
        /// Prints one JSON object on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Surfaces, focal lengths and pupils in mm, and chief ray, distortion, spot and illumination over the field.
    ///
    /// Example: qpgen lens info tele_US10571665B2_220b
    #[command(verbatim_doc_comment)]
    Info {
        #[command(flatten)]
        lens: Which,
        /// Prints one JSON object on stdout, full precision.
        #[arg(long)]
        json: bool,
    },
    /// Draws spot diagrams (µm) over the field at the F, d and C lines, with the Airy disk.
    ///
    /// Example: qpgen lens spots lib_double_gauss_100mm_glass -o spots.svg
    #[command(verbatim_doc_comment)]
    Spots {
        #[command(flatten)]
        lens: Which,
        /// Picture to write; absent: NAME-spots.svg.
        #[arg(long, short)]
        output: Option<PathBuf>,
        /// Prints the points (mm on the sensor, camera frame) as one JSON object on stdout; a picture only with -o.
        #[arg(long)]
        json: bool,
    },
    /// Draws the section of the lens with fans of rays.
    ///
    /// Example: qpgen lens layout my_lens.zmx -o layout.svg
    #[command(verbatim_doc_comment)]
    Layout {
        #[command(flatten)]
        lens: Which,
        /// Picture to write; absent: NAME-layout.svg.
        #[arg(long, short)]
        output: Option<PathBuf>,
    },
    /// Reads every .json, .zmx and .seq file of a folder and below it, and says what loads: F-number, half field
    /// (deg), focal length and back focal length (mm) of each lens, and why the others do not. Writes lenses.csv and
    /// a section of each lens, layouts/NUMBER.svg.
    ///
    /// Example: qpgen lens import my-lenses -o imported
    #[command(verbatim_doc_comment)]
    Import {
        /// Folder of lens files.
        folder: PathBuf,
        /// Folder of the report.
        #[arg(long, short, default_value = "lenses")]
        out: PathBuf,
        /// Prints one JSON object on stdout, full precision.
        #[arg(long)]
        json: bool,
    },
    /// Compares lenses with the figures that their files state; prints a Markdown table. Exit code 1 if a figure
    /// differs and the file gives no reason, 2 if a lens cannot be read; the others are compared.
    ///
    /// Example: qpgen lens check
    #[command(verbatim_doc_comment)]
    Check {
        /// Names or files; absent: every built-in lens.
        names: Vec<String>,
        /// Prints one JSON object on stdout, full precision.
        #[arg(long)]
        json: bool,
    },
}

/// Which lens, and how it is set.
#[derive(Args, Debug)]
struct Which {
    /// Name of a built-in lens (see `qpgen lens list`), or a .json, .zmx or .seq file.
    #[arg(default_value = DEFAULT_LENS)]
    name: String,
    /// F-number to stop down to; absent: fully open.
    #[arg(value_parser = number, long)]
    f_number: Option<f64>,
    /// Distance of the plane in focus from the first vertex, mm, reached by moving the sensor; absent: infinity.
    #[arg(value_parser = number, long)]
    focus_mm: Option<f64>,
}

impl Which {
    fn lens(&self, log: Log) -> Result<Lens, CommandError> {
        let prescription = Prescription::named(&self.name)?;
        warn(&prescription, log);
        let mut lens = Lens::new(&prescription)?;
        if let Some(f_number) = self.f_number {
            lens = lens.with_f_number(f_number)?;
        }
        if let Some(distance_mm) = self.focus_mm {
            lens = lens.focused_at(distance_mm, FocusBy::Sensor, D_LINE_NM)?;
        }
        Ok(lens)
    }

    /// `NAME-what.svg` in the working folder, for a lens or a lens file.
    fn default_output(&self, what: &str) -> PathBuf {
        let stem = Path::new(&self.name).file_stem().unwrap_or_default();
        PathBuf::from(format!("{}-{what}.svg", stem.to_string_lossy()))
    }
}

/// Says what was changed when a lens was read.
fn warn(prescription: &Prescription, log: Log) {
    for warning in &prescription.warnings {
        log.line(Level::Warn, warning, &[]);
    }
}

/// Runs `qpgen lens`; tables and JSON go to stdout.
///
/// # Errors
/// [`CommandError::Input`] for a lens that does not exist or cannot be, [`CommandError::Failed`] for a picture that
/// cannot be written or a lens that differs from its own figures.
pub fn run(args: LensArgs, log: Log) -> Result<(), CommandError> {
    match args.command {
        LensCommand::List { json } => list(json),
        LensCommand::Info { lens, json } => {
            let lens = lens.lens(log)?;
            let fields = fields_deg(&lens, &TABLE_FIELDS)?;
            let info = info::Info::new(&lens, &fields)?;
            if json {
                outln!("{}", info.json());
            } else {
                out!("{}", info.text());
            }
            Ok(())
        }
        LensCommand::Spots { lens, output, json } => spots(&lens, (output, json), log),
        LensCommand::Layout { lens, output } => {
            let placed = lens.lens(log)?;
            let fields = fields_deg(&placed, &SECTION_FIELDS)?;
            let picture = layout_svg(&placed, &fields)?;
            write(
                &output.unwrap_or_else(|| lens.default_output("layout")),
                &picture,
            )
        }
        LensCommand::Import { folder, out, json } => import::run(&folder, &out, json, log),
        LensCommand::Check { names, json } => comparison::run(&names, json, log),
    }
}

fn list(json: bool) -> Result<(), CommandError> {
    let mut rows = Vec::new();
    for name in builtin_names() {
        let lens = Lens::new(&Prescription::builtin(name)?)?;
        let p = lens.paraxial(D_LINE_NM)?;
        rows.push((
            name,
            p.efl_mm,
            p.f_number,
            lens.prescription().title().to_owned(),
        ));
    }
    if json {
        let lenses: Vec<_> = rows
            .iter()
            .map(|(name, efl, f, title)| {
                serde_json::json!({"name": name, "efl_mm": efl, "f_number": f, "title": title})
            })
            .collect();
        outln!("{}", serde_json::json!({ "lenses": lenses }));
    } else {
        for (name, efl, f, title) in rows {
            outln!("{name:<30} {efl:>8.2} mm  F/{f:<5.2} {title}");
        }
    }
    Ok(())
}

fn spots(
    which: &Which,
    (output, json): (Option<PathBuf>, bool),
    log: Log,
) -> Result<(), CommandError> {
    let lens = which.lens(log)?;
    let fields = fields_deg(&lens, &SPOT_FIELDS)?;
    if json {
        let spot = |angle: f64, line: f64| {
            let spot = lens.spot(Field::up(angle), line)?;
            let points: Vec<[f64; 2]> = spot.points_mm.iter().map(|p| p.to_array()).collect();
            Ok(serde_json::json!({
                "field_deg": angle, "wavelength_nm": line, "rays_sent": spot.sent,
                "rms_um": rms_radius(&spot.points_mm).map(|r| r * 1e3), "points_mm": points,
            }))
        };
        let all: Result<Vec<_>, LensError> = fields
            .iter()
            .flat_map(|&angle| SPOT_LINES_NM.map(|line| spot(angle, line)))
            .collect();
        let name = &lens.prescription().file;
        outln!("{}", serde_json::json!({ "lens": name, "spots": all? }));
    }
    match output {
        None if json => Ok(()),
        output => {
            let picture = spots_svg(&lens, &fields)?;
            let path = output.unwrap_or_else(|| which.default_output("spots"));
            if json {
                save(&path, &picture)
            } else {
                write(&path, &picture)
            }
        }
    }
}

fn fields_deg(lens: &Lens, parts: &[f64]) -> Result<Vec<f64>, CommandError> {
    let half = lens.half_field_deg()?;
    Ok(parts.iter().map(|part| part * half).collect())
}

/// Writes a picture and says where.
fn write(path: &Path, picture: &str) -> Result<(), CommandError> {
    save(path, picture)?;
    outln!("{}", path.display());
    Ok(())
}

fn save(path: &Path, picture: &str) -> Result<(), CommandError> {
    Ok(write_aside(path, picture.as_bytes())?)
}
