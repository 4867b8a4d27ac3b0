//! `qpgen study`: the paper's studies of the pixel (its Figs. 2, 3, 5, 11, 12, 13, the lines of section 3.1, and the worst case of section 4) with any pixel model, as tables, CSV files and plots.
//!
//! ```text
//! kind ─ cases ─▶ pixels and wavelengths ─ curve ─▶ P over θ, ranges ─ report ─▶ CSV, table, JSON
//!                                                                    └ figures ─ plot ─▶ SVG
//! ```

mod cases;
mod chief_ray;
mod corrected;
mod curve;
mod figures;
mod flat_field;
mod kept;
mod mosaic;
mod report;
mod size;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use quadpixel::em::PixelStack;
use quadpixel::file;

use self::curve::Angles;
use self::kept::Kept;
use quadpixel::command::CommandError;
use quadpixel_generators::assemble::pixel;
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_generators::pixel_model::PixelModelArgs;

/// Arguments of `qpgen study`.
#[derive(Args)]
pub struct StudyArgs {
    /// What to study.
    #[arg(value_enum)]
    kind: Kind,
    /// Pixels of the rejection and size studies, separated by commas, or the one of the cra, flat-field, corrected and mosaic studies: built-in names or
    /// TOML files; absent: 3.5um-roc3.5,3.5um, or 3.5um,1.6um (size), 3.5um-thin-filter (cra), 1.6um (flat-field, corrected), 1.6um-bayer (mosaic).
    #[arg(long, value_delimiter = ',')]
    pixel: Vec<String>,
    /// Of the flat-field study: lens shifts per pitch, a multiple of 8.
    #[arg(long, default_value_t = 16)]
    shifts: usize,
    /// Of the corrected study: under all lens shifts, not only the centred lens.
    #[arg(long)]
    all_shifts: bool,
    /// Of the cra study: F-number of the cone of light that the sub-pixels share equally.
    #[arg(long, default_value_t = 2.0)]
    cone_f_number: f64,
    #[command(flatten)]
    model: PixelModelArgs,
    /// Step of the angle of incidence, deg, such as 2.5.
    #[arg(long, default_value_t = 1.0)]
    theta_step_deg: f64,
    /// Largest angle of incidence, deg, from the chief ray.
    #[arg(long, default_value_t = 50.0)]
    theta_max_deg: f64,
    /// Folder for KIND.csv and KIND.svg (of flat-field a .png, of size a .jpg), also KIND-ranges.csv, or cra-shifts.csv. While the study runs: KIND.partial, from which a killed study goes on.
    #[arg(long, default_value = "study")]
    out: PathBuf,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// P of left and right sub-pixel over θ, and their ratio (Fig. 2).
    Rejection,
    /// Nine microlenses on the 3.5 µm pixel, ranked by the paper's four criteria (section 2.1.2).
    Microlens,
    /// R_a and R_b from 1.2 to 6 µm (Fig. 11).
    Pitch,
    /// 1.6 µm pixel at 400, 532 and 700 nm, centred and shifted for a chief ray at 25° (Fig. 13).
    Wavelength,
    /// Colour filters of 1 µm and 750 nm (Fig. 3(a)).
    Filter,
    /// Lens shifts by chief-ray angle, and the response of sub-pixel A under them (Fig. 5).
    Cra,
    /// A white wall over the whole 5.6 x 5.6 mm sensor, each view: interpolation between lens shifts (section 3.1).
    FlatField,
    /// Exact runs spent against error left, of the corrected wave model.
    Corrected,
    /// The alphabet chart 500 mm away, focus at 750 mm, by each pixel, classic and diffractive: views, their difference, and the disparity per pixel of
    /// defocus (Fig. 12).
    Size,
    /// Tungsten walls on the 2.8 µm pixel (Fig. 3(b)); needs a vector model.
    Tungsten,
    /// Crosstalk under a mosaic of colour filters against the period of one colour, the paper's worst case; needs a vector model: qpgen study mosaic
    /// --model rcwa --preset draft --theta-step-deg 5.
    Mosaic,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Rejection => "rejection",
            Self::Microlens => "microlens",
            Self::Pitch => "pitch",
            Self::Wavelength => "wavelength",
            Self::Filter => "filter",
            Self::Tungsten => "tungsten",
            Self::Cra => "cra",
            Self::FlatField => "flat-field",
            Self::Corrected => "corrected",
            Self::Size => "size",
            Self::Mosaic => "mosaic",
        }
    }
}

/// Computes, prints, writes.
///
/// # Errors
/// Bad arguments (2), or a disk that fails (1).
pub fn run(args: &StudyArgs, observer: &dyn Observer) -> Result<(), CommandError> {
    match args.kind {
        Kind::Cra => return chief_ray::run(args, observer),
        Kind::FlatField => return flat_field::run(args, observer),
        Kind::Corrected => return corrected::run(args, observer),
        Kind::Size => return size::run(args, observer),
        Kind::Mosaic => return mosaic::run(args, observer),
        _ => {}
    }
    let angles = Angles::new(args.theta_step_deg, args.theta_max_deg)?;
    let cases = cases::of(args.kind, &args.pixel)?;
    let began = std::time::Instant::now();
    let told = |done, total| observer.event(Event::Table { done, total });
    let model = args.model.model();
    file::create_folder(&args.out).map_err(CommandError::failed)?;
    let partial = args.out.join(format!("{}.partial", args.kind.name()));
    let kept = Kept::open(partial, &cases, &model)?;
    let curves = curve::all(&cases, &model, &angles, &kept, &told)?;
    let points = curves.iter().flat_map(|c| &c.points);
    let warned = points.filter(|p| p.warned).count();
    if warned > 0 {
        observer.event(Event::Warning(&format!(
            "{warned} points did not converge or miss energy; `qpgen response --theta-deg` tells which"
        )));
    }
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();

    let name = args.kind.name();
    let write = |file: String, text: &str| -> Result<PathBuf, CommandError> {
        let path = args.out.join(file);
        write(&path, text).map(|()| path)
    };
    let model = model.version();
    let files = [
        write(format!("{name}.csv"), &report::curves_csv(&cases, &curves))?,
        write(
            format!("{name}-ranges.csv"),
            &report::ranges_csv(&cases, &curves),
        )?,
        write(
            format!("{name}.svg"),
            &figures::svg(args.kind, &cases, &curves, model),
        )?,
    ];
    kept.remove();
    if args.json {
        println!(
            "{}",
            serde_json::json!({
                "study": name, "model": model, "seconds": seconds, "files": files,
                "cases": report::json(&cases, &curves)
            })
        );
        return Ok(());
    }
    print!("{}", report::table(&cases, &curves));
    if args.kind == Kind::Microlens {
        print!("{}", report::ranking(&cases, &curves));
    }
    println!(
        "{model}, {} angles in {seconds:.1} s: {}",
        curves.iter().map(|c| c.angles).sum::<usize>(),
        args.out.display()
    );
    Ok(())
}

/// The one pixel of a study that has but one.
fn one_pixel(args: &StudyArgs, default: &str) -> Result<PixelStack, CommandError> {
    match &args.pixel[..] {
        [] => pixel(default),
        [name] => pixel(name),
        _ => Err(CommandError::input(format!(
            "--pixel is {}; allowed: one pixel in this study",
            args.pixel.join(",")
        ))),
    }
}

fn write(path: &Path, text: &str) -> Result<(), CommandError> {
    file::write_aside(path, text.as_bytes()).map_err(CommandError::failed)
}
