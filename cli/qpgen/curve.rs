//! `qpgen curve`: a camera's disparity against distance over the field, for `qpalgo depth --curve`.

use std::path::PathBuf;

use crate::exit::CommandError;
use crate::log::{Level, Log};
use crate::number::number;
use crate::outln;
use crate::progress::Progress;
use clap::{Args, ValueEnum};
use quadpixel::file;
use quadpixel_generators::assemble::{self, Responses};
use quadpixel_generators::observer::Observer;
use quadpixel_generators::recipe::{Recipe, parse_recipe, read_recipe};
use quadpixel_laboratory::curve::{CountedFrom, CurvePlan, field_curve};

use crate::qpgen::camera_arg::CameraArg;
use crate::qpgen::render::DEFAULT_TOML;
use crate::qpgen::scene_args;

/// Arguments of `qpgen curve`.
#[derive(Args)]
pub struct CurveArgs {
    /// Recipe of lens, focus, sensor and response (TOML, see `qpgen render --print-scene`; what it shows is left
    /// aside), or the meta.json of a sample.
    #[arg(required_unless_present = "camera")]
    recipe: Option<PathBuf>,
    #[command(flatten)]
    camera: CameraArg,
    /// Depth in focus, m from the first lens vertex; absent: as the recipe says.
    #[arg(value_parser = number, long)]
    focus_m: Option<f64>,
    /// Number of microlenses, columns x rows, such as 640x480; absent: as the recipe says.
    #[arg(long, value_name = "NxN")]
    size: Option<String>,
    /// File of the curve (JSON).
    #[arg(long, short, default_value = "curve.json")]
    out: PathBuf,
    /// Nearest distance, m; absent: half of that in focus, 5 m where that is infinity.
    #[arg(value_parser = number, long)]
    nearest_m: Option<f64>,
    /// Farthest distance, m, or inf.
    #[arg(value_parser = number, long, default_value_t = f64::INFINITY)]
    farthest_m: f64,
    /// Distances, even in 1/Z.
    #[arg(long, default_value_t = 25)]
    distances: usize,
    /// Where distances count from.
    #[arg(long, value_enum, default_value_t = From::Vertex)]
    counted_from: From,
    /// Nodes, columns x rows over the picture, its sides included.
    #[arg(long, default_value = "9x7", value_name = "NxN")]
    fields: String,
    /// Shifts as windows of this side match them, px (odd, 5 to 31), for `qpalgo depth --sparse`; absent: those of the
    /// views' centroids, which dense matching finds.
    #[arg(long)]
    window: Option<usize>,
    /// Replaces a file that is there; absent: such a file ends the command.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum From {
    /// The first lens vertex.
    Vertex,
    /// The sensor.
    Sensor,
}

/// Traces the curve and writes it.
///
/// # Errors
/// A bad recipe or argument, a file that is there already (2); a disk that fails (1).
pub fn run(args: &CurveArgs, log: Log) -> Result<(), CommandError> {
    let (recipe, name) = recipe(args, log)?;
    let nodes = nodes(&args.fields)?;
    if args.out.exists() && !args.force {
        return Err(CommandError::input(format!(
            "{}: is there already; allowed: another name, or --force",
            args.out.display()
        )));
    }
    let focus_m = recipe.lens.focus_mm.map(|mm| 1e-3 * mm);
    let inverse_distances_per_m = inverse_distances(args, focus_m.unwrap_or(10.0))?;
    let window_px = args.window.map(window).transpose()?;
    file::probe_file(&args.out)?;
    let progress = Progress::new(log.json(args.json));
    let observer: &dyn Observer = &progress;
    let mut responses = Responses::new();
    let response = responses.get(&recipe, &observer)?;
    let camera = assemble::camera(&recipe, &response)?;
    for warning in responses.take_warnings() {
        progress.warn(&warning);
    }
    let focus = focus_m.map_or("at infinity".into(), |m| format!("{m} m"));
    let plan = CurvePlan {
        source: format!(
            "simulated: {}, lens {}, focus {focus}",
            name, recipe.lens.name
        ),
        counted_from: match args.counted_from {
            From::Vertex => CountedFrom::Vertex,
            From::Sensor => CountedFrom::Sensor,
        },
        inverse_distances_per_m,
        nodes,
        window_px,
    };
    let asked = plan.inverse_distances_per_m.len();
    let curve = field_curve(&camera, plan).map_err(CommandError::input)?;
    let encoded = serde_json::to_vec(&curve).map_err(CommandError::failed)?;
    file::write_aside(&args.out, &encoded)?;
    drop(progress);
    let (kept, out) = (&curve.inverse_distances_per_m, args.out.display());
    let ends = [kept[kept.len() - 1], kept[0]].map(|inverse| 1.0 / inverse);
    if args.json {
        let object = serde_json::json!({
            "file": out.to_string(), "distances": kept.len(), "left_out": asked - kept.len(), "nearest_m": ends[0],
        });
        outln!("{object}");
        return Ok(());
    }
    outln!(
        "{out}: {} distances from {:.3} to {:.3} m",
        kept.len(),
        ends[0],
        ends[1]
    );
    if kept.len() < asked {
        outln!(
            "{} distances are left out: the blur there is too wide for a window",
            asked - kept.len()
        );
    }
    Ok(())
}

/// The recipe, and what it is called.
fn recipe(args: &CurveArgs, log: Log) -> Result<(Recipe, String), CommandError> {
    let (mut recipe, mut name) = match &args.recipe {
        Some(path) => (read_recipe(path)?, path.display().to_string()),
        None => (
            parse_recipe(DEFAULT_TOML, "built-in recipe")?,
            String::from("built-in recipe"),
        ),
    };
    for warning in args.camera.put_into_recipe(&mut recipe)? {
        log.line(Level::Warn, &warning, &[]);
    }
    if let Some(camera) = &args.camera.camera {
        name = camera.display().to_string();
    }
    if let Some(focus_m) = args.focus_m {
        recipe.lens.focus_mm = Some(1e3 * focus_m).filter(|mm| *mm != f64::INFINITY);
    }
    if let Some(size) = &args.size {
        (recipe.sensor.width, recipe.sensor.height) = scene_args::size(size)?;
    }
    Ok((recipe, name))
}

fn inverse_distances(args: &CurveArgs, focus_m: f64) -> Result<Vec<f64>, CommandError> {
    let nearest_m = args.nearest_m.unwrap_or(0.5 * focus_m);
    if !(nearest_m > 0.0 && nearest_m.is_finite() && args.farthest_m > nearest_m) {
        return Err(CommandError::input(format!(
            "--nearest-m is {nearest_m} and --farthest-m {}; allowed: above 0, the nearest below the farthest",
            args.farthest_m
        )));
    }
    if !(3..=1000).contains(&args.distances) {
        let text = format!("--distances is {}; allowed: 3 to 1000", args.distances);
        return Err(CommandError::input(text));
    }
    let (first, last) = (1.0 / args.farthest_m, 1.0 / nearest_m);
    let step = (last - first) / (args.distances - 1) as f64;
    Ok((0..args.distances)
        .map(|k| first + step * k as f64)
        .collect())
}

fn window(px: usize) -> Result<usize, CommandError> {
    match (5..=31).contains(&px) && !px.is_multiple_of(2) {
        true => Ok(px),
        false => Err(CommandError::input(format!(
            "--window is {px}; allowed: odd, 5 to 31"
        ))),
    }
}

fn nodes(text: &str) -> Result<(usize, usize), CommandError> {
    let sides = text.split_once('x');
    let parsed = sides.and_then(|(x, y)| Some((x.parse().ok()?, y.parse().ok()?)));
    parsed
        .filter(|(x, y): &(usize, usize)| (1..=65).contains(x) && (1..=65).contains(y))
        .ok_or_else(|| {
            CommandError::input(format!(
                "--fields is {text}; allowed: such as 9x7, 1 to 65 each"
            ))
        })
}
