//! What is left of the phase signal as pixels shrink (section 3.2.1 of the paper, Fig. 12): one chart out of focus, seen by pixels of several
//! sizes, each by the ideal box (classic) and by its wave optics (diffractive).
//!
//! ```text
//! pixel × mode ─ camera ─▶ the same chart ─ render ─▶ views ─ shift ─▶ disparity a pixel of defocus, differences ─▶ CSV, JSON, picture
//! ```
//! All pixels see the same piece of the chart on the same piece of the sensor.

mod report;
mod shot;

use quadpixel::command::CommandError;
use quadpixel::file;
use quadpixel::response::{GeometricResponse, Response, ResponseCache};

use self::shot::{Bench, Shot};
use super::{StudyArgs, write};
use quadpixel_generators::assemble::pixel;
use quadpixel_generators::observer::{Event, Observer};

/// Pixels of Fig. 12.
const PIXELS: [&str; 2] = ["3.5um", "1.6um"];

/// How a pixel parts the light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    /// The ideal box of eq. 2.
    Classic,
    /// The pixel model's table.
    Diffractive,
}

impl Mode {
    fn name(self) -> &'static str {
        match self {
            Self::Classic => "classic",
            Self::Diffractive => "diffractive",
        }
    }
}

pub(super) fn run(args: &StudyArgs, observer: &dyn Observer) -> Result<(), CommandError> {
    let named: Vec<&str> = match &args.pixel[..] {
        [] => PIXELS.to_vec(),
        some => some.iter().map(String::as_str).collect(),
    };
    let stacks = named.iter().map(|name| pixel(name));
    let stacks = stacks.collect::<Result<Vec<_>, _>>()?;
    let input = |e: quadpixel::response::ResponseError| CommandError::input(e);
    let began = std::time::Instant::now();
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let bench = Bench::new()?;
    let mut shots: Vec<Shot> = Vec::new();
    for stack in &stacks {
        let s = stack.subpixels;
        if s.m() < 2 {
            return Err(CommandError::input(format!(
                "{}: subpixels is {s}; allowed: at least two columns, or there is nothing to part",
                stack.name
            )));
        }
        // The box that fits the main lens.
        let focal_um = stack.pitch_um * bench.f_number();
        let classic = GeometricResponse::new(s, stack.pitch_um, focal_um).map_err(input)?;
        let told = |done, total| observer.event(Event::Table { done, total });
        let table = cache
            .get_or_build(stack, &args.model.table(stack), &told)
            .map_err(input)?;
        for warning in &table.warnings {
            observer.event(Event::Warning(&warning.to_string()));
        }
        for (mode, response) in [
            (Mode::Classic, Response::Geometric(classic)),
            (Mode::Diffractive, Response::Table(table.table)),
        ] {
            observer.event(Event::Info(&format!("{}, {}", stack.name, mode.name())));
            shots.push(bench.shot(stack, mode, &response)?);
        }
    }
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();

    file::create_folder(&args.out).map_err(CommandError::failed)?;
    let files = ["size.csv", "size.jpg"].map(|f| args.out.join(f));
    write(&files[0], &report::csv(&shots))?;
    report::picture(&files[1], &shots)?;
    if args.json {
        println!(
            "{}",
            serde_json::json!({
                "study": "size", "lens": shot::LENS, "focus_mm": shot::FOCUS_MM, "chart_mm": shot::CHART_MM,
                "model": args.model.model().version(), "seconds": seconds, "files": files, "shots": report::json(&shots)
            })
        );
        return Ok(());
    }
    print!("{}", report::table(&shots));
    println!(
        "{}, focus {} mm, chart {} mm, {}, {seconds:.1} s: {}",
        shot::LENS,
        shot::FOCUS_MM,
        shot::CHART_MM,
        args.model.model().version(),
        args.out.display()
    );
    Ok(())
}
