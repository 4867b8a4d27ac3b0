//! `qpgen accuracy`: what accuracy costs in time, as tables, CSV files and plots.

use crate::{out, outln};
use std::path::PathBuf;
use std::time::Instant;

use crate::exit::CommandError;
use crate::log::Log;
use crate::progress::Progress;
use clap::{Args, ValueEnum};
use quadpixel::file;
use quadpixel_generators::observer::{Event, Observer};
use quadpixel_laboratory::accuracy::{self, Knob, Size, report};

/// Arguments of `qpgen accuracy`.
#[derive(Args)]
pub struct AccuracyArgs {
    /// Knobs to measure; absent: all of them.
    #[arg(value_enum)]
    knobs: Vec<KnobName>,
    /// Folder for accuracy.md, accuracy.svg, and KNOB.csv and KNOB.svg of each.
    #[arg(long, short, default_value = "accuracy")]
    out: PathBuf,
    /// Also settings that take minutes each, more directions, larger images: half an hour and more.
    #[arg(long)]
    full: bool,
    /// Knobs rays and wavelengths on smaller images: a first look, in seconds.
    #[arg(long, conflicts_with = "full")]
    draft: bool,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum KnobName {
    /// Rays per pixel: noise of the image, % of its mean.
    Rays,
    /// Tracing the lens exactly or by polynomials, which is measured no more.
    #[value(hide = true)]
    Lens,
    /// Wavelengths per colour channel: % of the image's mean.
    Wavelengths,
    /// Levels of the pixel model (geometric, wave, corrected, rcwa, fdtd): P, % of the largest.
    Levels,
    /// Steps and interpolation of the response table: P, % of the largest.
    Grid,
    /// The mesh of fdtd: P, % of the largest.
    Mesh,
}

impl KnobName {
    fn knob(self) -> Result<Knob, CommandError> {
        match self {
            Self::Rays => Ok(Knob::Rays),
            Self::Wavelengths => Ok(Knob::Wavelengths),
            Self::Levels => Ok(Knob::Levels),
            Self::Grid => Ok(Knob::Grid),
            Self::Mesh => Ok(Knob::Mesh),
            Self::Lens => Err(CommandError::input(
                "knob is lens; allowed: rays, wavelengths, levels, grid or mesh (polynomials in place of lens tracing \
                 were measured once: benches/runs/2026-11-21/accuracy.md)",
            )),
        }
    }
}

/// Measures, writes, prints.
///
/// # Errors
/// A knob that is gone (2); one that cannot be measured, or a disk that fails (1).
pub fn run(args: &AccuracyArgs, log: Log) -> Result<(), CommandError> {
    let named = args.knobs.iter().map(|name| name.knob());
    let named = named.collect::<Result<Vec<_>, _>>()?;
    let wanted = |knob: &Knob| named.is_empty() || named.contains(knob);
    let knobs: Vec<Knob> = Knob::ALL.into_iter().filter(wanted).collect();
    let size = match (args.full, args.draft) {
        (true, _) => Size::Full,
        (_, true) => Size::Draft,
        _ => Size::Affordable,
    };
    // What is measured is built in: no argument mends a failure.
    file::probe_folder(&args.out)?;
    let observer = Progress::new(log.json(args.json));
    let began = Instant::now();
    let tables = accuracy::measured(&knobs, size, &observer).map_err(CommandError::failed)?;
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();
    let files = accuracy::write(&args.out, &tables)?;
    if args.json {
        outln!(
            "{}",
            serde_json::json!({ "accuracy": tables, "seconds": seconds, "full": args.full, "files": files })
        );
        return Ok(());
    }
    out!("{}", report::markdown(&tables));
    outln!(
        "Processor seconds of one thread, best of several runs where they are short. {seconds:.0} s in all: {}",
        args.out.display()
    );
    Ok(())
}
