//! `qpgen psf`: a bank of kernels as numbers and pictures.

use std::path::PathBuf;

use crate::exit::CommandError;
use crate::log::{Level, Log};
use crate::number::number;
use crate::outln;
use crate::progress::Progress;
use clap::{Args, ValueEnum};
use quadpixel::file;
use quadpixel::render::kernels::Footprint;
use quadpixel_generators::assemble::{self, Responses};
use quadpixel_generators::bank::{self, Bank, BankRequest};
use quadpixel_generators::observer::Observer;
use quadpixel_generators::recipe::{Recipe, parse_recipe, read_recipe};

use crate::qpgen::camera_arg::CameraArg;
use crate::qpgen::render::DEFAULT_TOML;

/// Microlenses of the window where no recipe says.
const DEFAULT_SIZE: (usize, usize) = (1024, 768);

/// Arguments of `qpgen psf`.
#[derive(Args)]
pub struct PsfArgs {
    /// Recipe of lens, focus, sensor and response (TOML, see `qpgen render --print-scene`; what it shows is left
    /// aside), or the meta.json of a sample; absent: the built-in one on a window of 1024x768 pixels.
    recipe: Option<PathBuf>,
    #[command(flatten)]
    camera: CameraArg,
    /// File of the numbers (.npz); pictures of the kernels (.exr) and a contact sheet (.png) are written beside it.
    ///
    /// `kernel` f32 [depth, field row, field column, channel, sub-pixel, y, x]: parts of its light, sum 1 - `beyond`,
    /// whole support, in pixels of the sensor (x right, y down as stored). `energy_sr` [field row, field column,
    /// channel, sub-pixel]: what a white wall of radiance 1 gives the sub-pixel, sr; times `kernel` it is what a pixel
    /// of radiance 1 gives. `centroid_px` [.., 2]: (x, y) from the point, which is the sub-pixel's disparity. `beyond`:
    /// part of the light that diffraction takes beyond the support. `origin`: row and column of the point's own pixel.
    /// `depth_m`, `field_mm`: the axes. `meta`: JSON.
    #[arg(long, short, default_value = "bank.npz")]
    out: PathBuf,
    /// Depths, m from the first lens vertex, such as 0.5,1,inf; absent: nine even in inverse depth, from half the focus
    /// to infinity, and the focus.
    #[arg(value_parser = number, long, value_delimiter = ',', value_name = "M,M,...")]
    depths_m: Vec<f64>,
    /// Field nodes, columns x rows over the window, its corners included.
    #[arg(long, default_value = "5x5", value_name = "NxN")]
    fields: String,
    /// Rays per field node and colour channel.
    #[arg(long, default_value_t = 16384)]
    rays: usize,
    /// What shines.
    #[arg(long, value_enum, default_value_t = Source::Point)]
    source: Source,
    /// Replaces files that are there; absent: such a file ends the command.
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    pub json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Source {
    /// A point that the sum of the sub-pixels shows in the middle of a pixel.
    Point,
    /// A square of one pixel.
    Pixel,
    /// A sample of a picture that is bilinear between its pixels.
    Sample,
}

impl Source {
    fn footprint(self) -> Footprint {
        match self {
            Self::Point => Footprint::Point,
            Self::Pixel => Footprint::Pixel,
            Self::Sample => Footprint::Sample,
        }
    }
}

/// Traces the bank and writes it.
///
/// # Errors
/// A bad recipe, depth or field, or a file that is there already (2); a disk that fails (1).
pub fn run(args: &PsfArgs, log: Log) -> Result<(), CommandError> {
    let recipe = recipe(args, log)?;
    let request = request(args)?;
    request.plan(&recipe)?;
    check_outputs(args)?;
    let progress = Progress::new(log.json(args.json));
    let mut responses = Responses::new();
    let observer: &dyn Observer = &progress;
    let response = responses.get(&recipe, &observer)?;
    let camera = assemble::camera(&recipe, &response)?;
    for warning in responses.take_warnings() {
        progress.warn(&warning);
    }
    let (kernels, depths_m, about) = request.trace(&recipe, &camera)?;
    let bank = Bank {
        kernels: &kernels,
        depths_m: &depths_m,
        about,
    };
    let written = bank::write(&args.out, &bank)?.map(|path| path.display().to_string());
    let support = kernels.support().map_or((0, 0), |s| (s.width, s.height));
    if args.json {
        let object =
            serde_json::json!({ "files": written, "depths_m": depths_m, "support_px": support });
        outln!("{object}");
        return Ok(());
    }
    let [npz, exr, png] = written;
    outln!(
        "{npz}: kernels of {} x {} px; pictures: {exr}, {png}",
        support.0,
        support.1
    );
    Ok(())
}

fn recipe(args: &PsfArgs, log: Log) -> Result<Recipe, CommandError> {
    let mut recipe = match &args.recipe {
        Some(path) => read_recipe(path)?,
        None => {
            let mut recipe = parse_recipe(DEFAULT_TOML, "built-in recipe")?;
            (recipe.sensor.width, recipe.sensor.height) = DEFAULT_SIZE;
            recipe
        }
    };
    for warning in args.camera.put_into_recipe(&mut recipe)? {
        log.line(Level::Warn, &warning, &[]);
    }
    Ok(recipe)
}

fn request(args: &PsfArgs) -> Result<BankRequest, CommandError> {
    let nodes = args.fields.split_once('x');
    let nodes = nodes.and_then(|(x, y)| Some((x.parse().ok()?, y.parse().ok()?)));
    let Some(nodes) = nodes else {
        let text = format!("--fields is {}; allowed: such as 5x5", args.fields);
        return Err(CommandError::input(text));
    };
    Ok(BankRequest {
        depths_m: args.depths_m.clone(),
        nodes,
        rays: args.rays,
        footprint: args.source.footprint(),
    })
}

/// The files can be written, and replace nothing of others.
fn check_outputs(args: &PsfArgs) -> Result<(), CommandError> {
    let refused = |path: &PathBuf, what: &str| {
        Err(CommandError::input(format!("{}: {what}", path.display())))
    };
    if args.out.extension().is_none_or(|e| e != "npz") {
        return refused(
            &args.out,
            "is no name of the numbers; allowed: one that ends in .npz",
        );
    }
    for ending in ["npz", "exr", "png"] {
        let path = args.out.with_extension(ending);
        if !args.force && path.symlink_metadata().is_ok() {
            return refused(
                &path,
                "is there already; move it away, or give --force, which replaces it",
            );
        }
        file::probe_file(&path)?;
    }
    Ok(())
}
