//! Crosstalk under a mosaic of colour filters against the period of one colour.
//!
//! With one colour, what crosses over to a neighbour has passed a filter like its own; the paper (section 4) expects that real neighbours, of other
//! colours, give less crosstalk, and calls the period of one colour its worst case. Here both are solved: the supercell of 2×2 microlenses and, for each of
//! its filters, the period of that filter alone, at a wavelength of each colour, over θ at φ = 0.

mod figure;
mod report;
mod survey;

use quadpixel::command::CommandError;
use quadpixel::file;
use quadpixel::response::PixelModel;

use self::survey::Survey;
use super::curve::Angles;
use super::{StudyArgs, one_pixel, write};
use quadpixel_generators::observer::{Event, Observer};

pub(super) fn run(args: &StudyArgs, observer: &dyn Observer) -> Result<(), CommandError> {
    let stack = one_pixel(args, "1.6um-bayer")?;
    let model = args.model.model();
    if !matches!(model, PixelModel::Rcwa(_) | PixelModel::Fdtd(_)) {
        return Err(CommandError::input(format!(
            "--model is {}; allowed: rcwa or fdtd in the mosaic study (the others know no unlike neighbours)",
            args.model.name()
        )));
    }
    let angles = Angles::new(args.theta_step_deg, args.theta_max_deg)?;
    let began = std::time::Instant::now();
    let told = |done, total| observer.event(Event::Table { done, total });
    let survey = Survey::new(&stack, &model, &angles.one_side(), &told)?;
    let warned = survey.warned;
    if warned > 0 {
        observer.event(Event::Warning(&format!(
            "{warned} points did not converge or miss energy; `qpgen response --theta-deg` tells which"
        )));
    }
    observer.event(Event::End);
    let seconds = began.elapsed().as_secs_f64();

    file::create_folder(&args.out).map_err(CommandError::failed)?;
    let files = ["mosaic.csv", "mosaic-summary.csv", "mosaic.svg"].map(|f| args.out.join(f));
    let summary = report::summary(&survey);
    let title = format!("mosaic study, {}, model {}", stack.name, model.version());
    write(&files[0], &report::csv(&survey))?;
    write(&files[1], &report::summary_csv(&summary))?;
    write(&files[2], &figure::svg(&title, &survey))?;
    if args.json {
        println!(
            "{}",
            serde_json::json!({
                "study": "mosaic", "pixel": stack.name, "model": model.version(), "seconds": seconds, "solutions": survey.solutions,
                "slowest_mosaic_s": survey.slowest_s, "worst_imbalance": survey.imbalance, "files": files, "microlenses": summary
            })
        );
        return Ok(());
    }
    print!("{}", report::table(&summary));
    println!(
        "{}, {} solutions in {seconds:.1} s (the slowest mosaic {:.1} s), power missing at most {:.1e}: {}",
        model.version(),
        survey.solutions,
        survey.slowest_s,
        survey.imbalance,
        args.out.display()
    );
    Ok(())
}
