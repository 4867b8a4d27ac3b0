//! `qpgen study`: the paper's studies of the pixel with any pixel model, as tables, CSV files and plots.

use crate::number::number;
use crate::{out, outln};
use std::path::PathBuf;

use crate::exit::CommandError;
use crate::log::Log;
use crate::progress::Progress;
use crate::qpgen::pixel_model::PixelModelArgs;
use clap::{Args, ValueEnum};
use quadpixel::em::PixelStack;
use quadpixel::file;
use quadpixel::response::{ShiftSettings, TableSettings};
use quadpixel_generators::assemble::pixel;
use quadpixel_laboratory::study::{self, Angles, CurveStudy, StudyReport};

/// Arguments of `qpgen study`.
#[derive(Args)]
pub struct StudyArgs {
    /// What to study.
    #[arg(value_enum)]
    kind: Kind,
    /// Pixels of the rejection, size and coherent studies, separated by commas, or the one of the cra, flat-field,
    /// corrected and mosaic studies: built-in names or TOML files; absent: 3.5um-roc3.5,3.5um, or 3.5um,1.6um (size),
    /// 1.6um,2.8um,3.5um (coherent), 3.5um-thin-filter (cra), 1.6um (flat-field, corrected), 1.6um-bayer (mosaic).
    #[arg(long, value_delimiter = ',')]
    pixel: Vec<String>,
    /// Of the flat-field study: lens shifts per pitch, a multiple of 8; absent: 16.
    #[arg(long)]
    shifts: Option<usize>,
    /// Of the corrected study: under all lens shifts, not only the centred lens.
    #[arg(long)]
    all_shifts: bool,
    /// Of the cra and flat-field studies: F-number of the cone of light that the sub-pixels share equally; absent: 2.
    #[arg(value_parser = number, long)]
    cone_f_number: Option<f64>,
    #[command(flatten)]
    model: PixelModelArgs,
    /// Of studies over the angle of incidence: its step, deg, such as 2.5; absent: 1.
    #[arg(value_parser = number, long)]
    theta_step_deg: Option<f64>,
    /// Of the same: its largest, deg, from the chief ray; absent: 50.
    #[arg(value_parser = number, long)]
    theta_max_deg: Option<f64>,
    /// Folder for KIND.csv and KIND.svg (of flat-field a .png, of size a .jpg), also KIND-ranges.csv, or
    /// cra-shifts.csv. While the study runs: KIND.partial, from which a killed study goes on.
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
    /// The alphabet chart 500 mm away, focus at 750 mm, by each pixel, classic and diffractive: views, their
    /// difference, and the disparity per pixel of defocus (Fig. 12).
    Size,
    /// Tungsten walls on the 2.8 µm pixel (Fig. 3(b)); needs a vector model.
    Tungsten,
    /// A spot in focus against its place in the pixel: the sum of fields over the lens's cone with their phases, beside
    /// the model, which has none; F/1.7, 2.8 and 8, 550 nm: qpgen study coherent --model rcwa --preset draft.
    Coherent,
    /// Crosstalk under a mosaic of colour filters against the period of one colour, the paper's worst case:
    /// qpgen study mosaic --theta-step-deg 5, or with --model rcwa --preset draft.
    Mosaic,
}

/// Computes, prints, writes.
///
/// # Errors
/// Bad arguments (2), or a disk that fails (1).
pub fn run(args: &StudyArgs, log: Log) -> Result<(), CommandError> {
    // Before the work, not after it.
    file::probe_folder(&args.out)?;
    let observer = Progress::new(log.json(args.json));
    let report = studied(args, &observer)?;
    if args.json {
        outln!("{}", report.json);
    } else {
        out!("{}", report.table);
        outln!("{}: {}", report.summary, args.out.display());
    }
    Ok(())
}

fn studied(args: &StudyArgs, observer: &Progress) -> Result<StudyReport, CommandError> {
    args.check_options()?;
    let out = &args.out;
    let report = match args.kind {
        Kind::Cra => {
            let stack = args.one_pixel("3.5um-thin-filter")?;
            let model = args.model.choice().for_all_shifts(&stack).0;
            study::chief_ray(&stack, &model, args.cone_f_number(), out, observer)
        }
        Kind::FlatField => {
            let (stack, settings) = args.flat_field()?;
            study::flat_field(&stack, &settings, out, observer)
        }
        Kind::Corrected => {
            let stack = args.one_pixel("1.6um")?;
            study::corrected(
                &stack,
                &args.model.choice().corrected(),
                args.all_shifts,
                out,
                observer,
            )
        }
        Kind::Size => {
            let stacks = args.pixels(&["3.5um", "1.6um"]).into_iter().map(|name| {
                let stack = pixel(&name)?;
                let settings = args.model.table(&stack);
                Ok((stack, settings))
            });
            let stacks = stacks.collect::<Result<Vec<_>, CommandError>>()?;
            study::size(&stacks, out, observer)
        }
        Kind::Mosaic => {
            let stack = args.one_pixel("1.6um-bayer")?;
            let model = args.model.model();
            study::mosaic(&stack, &model, &args.angles()?, out, observer)
        }
        Kind::Coherent => {
            let names = args.pixels(&["1.6um", "2.8um", "3.5um"]);
            let stacks = names.iter().map(|name| pixel(name));
            let stacks = stacks.collect::<Result<Vec<_>, _>>()?;
            study::coherent(&stacks, &args.model.model(), out, observer)
        }
        Kind::Rejection => {
            let pixels = args.pixels(&["3.5um-roc3.5", "3.5um"]);
            return args.curves(&CurveStudy::Rejection { pixels }, observer);
        }
        Kind::Microlens => return args.curves(&CurveStudy::Microlens, observer),
        Kind::Pitch => return args.curves(&CurveStudy::Pitch, observer),
        Kind::Wavelength => return args.curves(&CurveStudy::Wavelength, observer),
        Kind::Filter => return args.curves(&CurveStudy::Filter, observer),
        Kind::Tungsten => return args.curves(&CurveStudy::Tungsten, observer),
    };
    Ok(report?)
}

impl StudyArgs {
    /// An option that the study does not ask for is refused, not passed over.
    fn check_options(&self) -> Result<(), CommandError> {
        use Kind::{
            Coherent, Corrected, Cra, Filter, FlatField, Microlens, Mosaic, Pitch, Rejection, Size,
            Tungsten, Wavelength,
        };
        self.model.check(self.kind == Corrected)?;
        let over_angles = [
            Rejection, Microlens, Pitch, Wavelength, Filter, Tungsten, Mosaic,
        ];
        let of_pixels = [Rejection, Size, Coherent, Cra, FlatField, Corrected, Mosaic];
        let options: [(&str, bool, &[Kind]); 6] = [
            ("pixel", !self.pixel.is_empty(), &of_pixels),
            ("shifts", self.shifts.is_some(), &[FlatField]),
            ("all-shifts", self.all_shifts, &[Corrected]),
            (
                "cone-f-number",
                self.cone_f_number.is_some(),
                &[Cra, FlatField],
            ),
            (
                "theta-step-deg",
                self.theta_step_deg.is_some(),
                &over_angles,
            ),
            ("theta-max-deg", self.theta_max_deg.is_some(), &over_angles),
        ];
        let ignored =
            |(_, given, kinds): &&(&str, bool, &[Kind])| *given && !kinds.contains(&self.kind);
        let Some((option, _, kinds)) = options.iter().find(ignored) else {
            return Ok(());
        };
        let name = |kind: &Kind| Some(kind.to_possible_value()?.get_name().to_owned());
        let names: Vec<String> = kinds.iter().filter_map(name).collect();
        Err(CommandError::input(format!(
            "--{option} does not apply to this study; allowed: with {}",
            names.join(", ")
        )))
    }

    fn cone_f_number(&self) -> f64 {
        self.cone_f_number.unwrap_or(2.0)
    }

    /// The pixels, or else those of the study.
    fn pixels(&self, default: &[&str]) -> Vec<String> {
        match &self.pixel[..] {
            [] => default.iter().map(|&name| name.to_owned()).collect(),
            names => names.to_vec(),
        }
    }

    /// The one pixel of a study that has but one.
    fn one_pixel(&self, default: &str) -> Result<PixelStack, CommandError> {
        match &self.pixels(&[default])[..] {
            [name] => Ok(pixel(name)?),
            names => Err(CommandError::input(format!(
                "--pixel is {}; allowed: one pixel in this study",
                names.join(",")
            ))),
        }
    }

    fn angles(&self) -> Result<Angles, CommandError> {
        let step_deg = self.theta_step_deg.unwrap_or(1.0);
        Angles::new(step_deg, self.theta_max_deg.unwrap_or(50.0)).map_err(|e| {
            CommandError::input(format!(
                "--theta-step-deg is {} and --theta-max-deg {}; allowed: {}",
                e.step_deg, e.largest_deg, e.allowed
            ))
        })
    }

    /// Pixel and table of the flat-field study.
    fn flat_field(&self) -> Result<(PixelStack, TableSettings), CommandError> {
        let shifts = self.shifts.unwrap_or(16);
        if !(8..=32).contains(&shifts) || !shifts.is_multiple_of(8) {
            return Err(CommandError::input(format!(
                "--shifts is {shifts}; allowed: 8, 16, 24 or 32"
            )));
        }
        let stack = self.one_pixel("1.6um")?;
        let settings = TableSettings {
            shifts: Some(ShiftSettings {
                per_pitch: shifts,
                cone_f_number: self.cone_f_number(),
            }),
            ..self.model.shifted(&stack, shifts)
        };
        Ok((stack, settings))
    }

    fn curves(&self, study: &CurveStudy, observer: &Progress) -> Result<StudyReport, CommandError> {
        let angles = self.angles()?;
        let model = self.model.model();
        Ok(study::curves(study, &model, &angles, &self.out, observer)?)
    }
}
