//! `qpgen validate`: the paper's two experiments as numbers (`validation.json`) and polar plots (`validation.png`).

use crate::number::number;
use crate::outln;
use std::path::PathBuf;

use clap::Args;
use quadpixel::em::{Level, Preset};
use quadpixel::file;
use quadpixel::image::raster;
use quadpixel::response::{AngularResponse, ResponseCache, TablePlan, TableSettings};
use quadpixel::sensor::Subpixels;

use crate::exit::CommandError;
use crate::log::Log;
use crate::progress::Progress;
use quadpixel::image::colour::{blue_white_red, viridis};
use quadpixel_generators::assemble::pixel_stack;
use quadpixel_generators::observer::Observer;
use quadpixel_generators::preview::canvas::Sheet;
use quadpixel_laboratory::validate::{Experiment, Probe, masked_plane, moving_disk};

/// Arguments of `qpgen validate`.
#[derive(Args)]
pub struct ValidateArgs {
    /// Pixel: a built-in name (3.5um, 2.8um, 1.6um) or a TOML file.
    #[arg(long, default_value = "2.8um")]
    pixel: String,
    /// Sub-pixels, columns × rows.
    #[arg(long, default_value = "2x2")]
    subpixels: Subpixels,
    /// Rays per direction.
    #[arg(long, default_value_t = 16384)]
    rays: usize,
    /// Largest angle of incidence, deg.
    #[arg(value_parser = number, long, default_value_t = 50.0)]
    theta_max_deg: f64,
    /// Folder for validation.json and validation.png.
    #[arg(long, short, default_value = "validation")]
    out: PathBuf,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Side of a polar plot, px, and the room around it.
const PANEL: usize = 300;
const MARGIN: usize = 20;
/// Difference at which the colour of the difference plots is full.
const FULL_DIFFERENCE: f64 = 0.02;

/// Runs both experiments.
///
/// # Errors
/// Bad arguments (2), or a disk that fails (1).
pub fn run(args: &ValidateArgs, log: Log) -> Result<(), CommandError> {
    if !(args.theta_max_deg > 0.0 && args.theta_max_deg <= 70.0) {
        return Err(CommandError::input(format!(
            "--theta-max-deg is {}; allowed: above 0, up to 70",
            args.theta_max_deg
        )));
    }
    if !(1..=1 << 24).contains(&args.rays) {
        return Err(CommandError::input(format!(
            "--rays is {}; allowed: 1 to 16777216",
            args.rays
        )));
    }
    let stack = pixel_stack(&args.pixel, args.subpixels)?;
    file::probe_folder(&args.out)?;
    let progress = Progress::new(log.json(args.json));
    let angles: &dyn Observer = &progress;
    let settings = TableSettings::new(Level::default(), Preset::default(), &stack);
    let plan = TablePlan::new(&stack, &settings).map_err(CommandError::failed)?;
    let cached = ResponseCache::open(ResponseCache::default_dir())
        .table(&plan, &angles)
        .map_err(CommandError::failed)?;
    let response = cached.table;
    let warnings = cached.warnings.iter();
    warnings.for_each(|w| progress.warn(&w.to_string()));
    let disk = moving_disk(&response, args.theta_max_deg, args.rays)?;
    let stride = (response.axes().u.len() / 40).max(1);
    let plane = masked_plane(&response, args.theta_max_deg, stride, args.rays)?;
    progress.finish();

    let report = serde_json::json!({
        "pixel": args.pixel, "subpixels": args.subpixels, "rays": args.rays, "theta_max_deg": args.theta_max_deg,
        "experiment_1_moving_disk": disk, "experiment_2_masked_plane": plane,
    });
    let text = serde_json::to_vec_pretty(&report).map_err(CommandError::failed)?;
    let sheet = plots(
        &response,
        args.subpixels,
        args.theta_max_deg,
        [&disk, &plane],
    );
    let picture = args.out.join("validation.png");
    let png = raster::encode_png8(&picture, &sheet.rgb, sheet.width, sheet.height, 3)
        .map_err(CommandError::failed)?;
    file::write_reports(
        &args.out,
        &[("validation.json", text), ("validation.png", png)],
    )?;
    if args.json {
        outln!("{report}");
    } else {
        outln!(
            "response that came back against the one put in, in parts of its peak ({}, {} rays per direction)",
            args.pixel,
            args.rays
        );
        for (name, e) in [
            ("1 (moving 5 mm disk at 1 m)", &disk),
            ("2 (masked endless plane)", &plane),
        ] {
            outln!(
                "experiment {name}: {} directions, RMS {:.2e}, maximum {:.2e}",
                e.probes.len(),
                e.rms,
                e.maximum
            );
        }
        outln!("polar plots: {}", picture.display());
    }
    Ok(())
}

/// Polar plots of the first right, lower sub-pixel's response (A of a 2×2 pixel): put in, experiments 1 and 2, and
/// below the differences. Radius: θ up to `theta_max_deg`; φ = 0 to the right, counted towards +y of the sensor, which
/// is stored downwards.
fn plots(
    response: &AngularResponse,
    subpixels: Subpixels,
    theta_max_deg: f64,
    experiments: [&Experiment; 2],
) -> Sheet {
    let index = subpixels.index(subpixels.m() - 1, 0);
    let name = subpixels.name(index);
    let cell = PANEL + 2 * MARGIN;
    let mut sheet = Sheet::new(3 * cell, 2 * cell + MARGIN, [255; 3]);
    let peak = experiments
        .iter()
        .flat_map(|e| &e.probes)
        .map(|p| p.put_in[index])
        .fold(1e-12, f64::max);
    let interpolator =
        response.interpolator(quadpixel::spectrum::ChannelWavelengths::default().reference_nm());
    let put_in = |theta: f64, phi: f64| {
        let mut p = vec![0.0; subpixels.count()];
        interpolator.weights(
            (theta.sin() * phi.cos()) as f32,
            (theta.sin() * phi.sin()) as f32,
            &mut p,
        );
        f64::from(p[index]) / peak
    };
    let titles = ["PUT IN", "1 MOVING DISK", "2 MASKED PLANE"];
    for (column, title) in titles.into_iter().enumerate() {
        sheet.text(
            column * cell + MARGIN,
            4,
            2,
            &format!("{title} {name}"),
            [0; 3],
        );
    }
    polar(&mut sheet, (0, MARGIN), theta_max_deg, |t, p| {
        viridis(put_in(t, p) as f32)
    });
    for (k, experiment) in experiments.into_iter().enumerate() {
        let at = |theta: f64, phi: f64| nearest(&experiment.probes, theta, phi);
        let x = (k + 1) * cell;
        polar(&mut sheet, (x, MARGIN), theta_max_deg, |t, p| {
            viridis((at(t, p).came_back[index] / peak) as f32)
        });
        sheet.text(
            x + MARGIN,
            cell + MARGIN,
            1,
            &format!("DIFFERENCE, FULL COLOUR {:.0}%", 100.0 * FULL_DIFFERENCE),
            [0; 3],
        );
        polar(&mut sheet, (x, cell + MARGIN), theta_max_deg, |t, p| {
            let probe = at(t, p);
            let difference = (probe.came_back[index] - probe.put_in[index]) / peak;
            blue_white_red((0.5 + 0.5 * difference / FULL_DIFFERENCE) as f32)
        });
    }
    sheet
}

/// Fills a disk; `colour(θ, φ)` in rad.
fn polar(
    sheet: &mut Sheet,
    (x0, y0): (usize, usize),
    theta_max_deg: f64,
    colour: impl Fn(f64, f64) -> [u8; 3],
) {
    let half = PANEL as f64 / 2.0;
    for y in 0..PANEL {
        for x in 0..PANEL {
            let (dx, dy) = (
                (x as f64 + 0.5 - half) / half,
                (y as f64 + 0.5 - half) / half,
            );
            let radius = dx.hypot(dy);
            if radius <= 1.0 {
                let theta = radius * theta_max_deg.to_radians();
                sheet.set(
                    x0 + MARGIN + x,
                    y0 + MARGIN + y,
                    colour(theta, dy.atan2(dx)),
                );
            }
        }
    }
}

fn nearest(probes: &[Probe], theta: f64, phi: f64) -> &Probe {
    let place = |theta: f64, phi: f64| (theta * phi.cos(), theta * phi.sin());
    let (x, y) = place(theta, phi);
    let distance = |p: &&Probe| {
        let (px, py) = place(p.theta_deg.to_radians(), p.phi_deg.to_radians());
        (px - x).hypot(py - y)
    };
    let closest = probes
        .iter()
        .min_by(|a, b| distance(a).total_cmp(&distance(b)));
    closest.unwrap_or_else(|| unreachable!("an experiment has the direction θ = 0 at least"))
}
