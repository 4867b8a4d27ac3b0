//! `qpgen response`: a pixel's angular response, as a table for the renderer or at a few angles for a person.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use quadpixel::em::PixelStack;
use quadpixel::em::wave::{WaveModel, WaveSettings};
use quadpixel::response::{GeometricResponse, TableSettings, build_table};
use rayon::prelude::*;
use serde::Serialize;

use crate::assemble::{pixel_stack, subpixels};
use crate::command_error::CommandError;
use crate::progress::Progress;

/// Arguments of `qpgen response`.
#[derive(Args)]
pub struct ResponseArgs {
    /// Pixel: a built-in name or a TOML file.
    #[arg(long, default_value = "2.8um")]
    pixel: String,
    /// Sub-pixels, columns x rows.
    #[arg(long, default_value = "2x2")]
    subpixels: String,
    /// Pixel model.
    #[arg(long, value_enum, default_value_t = Model::Wave)]
    model: Model,
    /// Focal length of the ideal microlens of the geometric model, µm.
    #[arg(long, default_value_t = 7.0)]
    focal_length_um: f64,
    /// Wavelengths, nm, parted by commas.
    #[arg(
        long,
        alias = "wavelength",
        value_delimiter = ',',
        default_value = "550"
    )]
    wavelength_nm: Vec<f64>,
    /// How finely the wave model computes.
    #[arg(long, value_enum, default_value_t = Preset::Standard)]
    preset: Preset,
    /// Only these angles of incidence, deg, parted by commas.
    #[arg(long, value_delimiter = ',')]
    theta_deg: Vec<f64>,
    /// Azimuths of the angles, deg, parted by commas.
    #[arg(long, value_delimiter = ',', default_value = "0")]
    phi_deg: Vec<f64>,
    /// Table to write, an .npz that NumPy reads; absent: NAME-MODEL.npz.
    #[arg(long, short)]
    output: Option<PathBuf>,
    /// Prints the pixel as a TOML file to start from, and stops.
    #[arg(long)]
    print_pixel: bool,
    /// Prints one JSON object on stdout.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Model {
    /// The ideal box of the paper's equation 2.
    Geometric,
    /// Wave propagation through the pixel stack.
    Wave,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Preset {
    Draft,
    Standard,
    Reference,
}

/// The response to one plane wave, mean of s and p polarization.
#[derive(Clone, Debug, Serialize)]
struct Direction {
    wavelength_nm: f64,
    theta_deg: f64,
    phi_deg: f64,
    /// P of each sub-pixel, by name.
    p: Vec<(String, f64)>,
    /// Reflected part; `None` for the geometric model.
    reflected: Option<f64>,
    /// Seconds.
    seconds: f64,
}

/// Computes, prints, writes.
///
/// # Errors
/// Bad arguments (2), or a disk that fails (1).
pub fn run(args: &ResponseArgs) -> Result<(), CommandError> {
    let stack = pixel_stack(&args.pixel, subpixels(&args.subpixels)?)?;
    if args.print_pixel {
        let text =
            toml::to_string(&stack).map_err(|e| CommandError::failed(format!("pixel: {e}")))?;
        print!(
            "# A pixel, from the microlens down; lengths in um. A material is a table's name or {{ n, k }}.\n{text}"
        );
        return Ok(());
    }
    if args.theta_deg.is_empty() {
        table(args, &stack)
    } else {
        directions(args, &stack)
    }
}

fn settings(preset: Preset) -> WaveSettings {
    match preset {
        Preset::Draft => WaveSettings::draft(),
        Preset::Standard => WaveSettings::standard(),
        Preset::Reference => WaveSettings::reference(),
    }
}

fn table(args: &ResponseArgs, stack: &PixelStack) -> Result<(), CommandError> {
    if args.model == Model::Geometric {
        return Err(CommandError::input(
            "--model geometric is exact and needs no table; allowed: --theta-deg with it, or --model wave".into(),
        ));
    }
    let preset = match args.preset {
        Preset::Draft => TableSettings::wave_draft(),
        Preset::Standard => TableSettings::wave_standard_for(stack),
        Preset::Reference => TableSettings::wave_reference(),
    };
    let table = TableSettings {
        wavelengths_nm: args.wavelength_nm.clone(),
        ..preset
    };
    let progress = Progress::stderr();
    let angles = |done: usize, total: usize| progress.angles(done, total);
    let began = std::time::Instant::now();
    let response = build_table(stack, &table, None, &angles)
        .map_err(|e| CommandError::input(e.to_string()))?
        .table;
    progress.finish();
    let seconds = began.elapsed().as_secs_f64();
    let path = args
        .output
        .clone()
        .unwrap_or_else(|| PathBuf::from(format!("{}-wave.npz", stack.name)));
    response
        .write_npz(&path)
        .map_err(|e| CommandError::failed(e.to_string()))?;
    let axes = response.axes();
    let nodes = axes.u.len() * axes.v.len() * axes.wavelengths_nm.len();
    if args.json {
        let key = &response.meta().key;
        println!(
            "{}",
            serde_json::json!({ "file": path, "nodes": nodes, "seconds": seconds, "key": key })
        );
    } else {
        println!("{}: {nodes} directions in {seconds:.1} s", path.display());
    }
    Ok(())
}

fn directions(args: &ResponseArgs, stack: &PixelStack) -> Result<(), CommandError> {
    let input = |e: &dyn std::fmt::Display| CommandError::input(e.to_string());
    if let Some(theta) = args
        .theta_deg
        .iter()
        .find(|t| t.is_nan() || t.abs() >= 90.0)
    {
        return Err(CommandError::input(format!(
            "--theta-deg is {theta}; allowed: above −90, below 90"
        )));
    }
    let sub = stack.subpixels;
    let geometric =
        GeometricResponse::new(sub, stack.pitch_um, args.focal_length_um).map_err(|e| input(&e))?;
    let mut all = Vec::new();
    for &wavelength_nm in &args.wavelength_nm {
        let model =
            WaveModel::new(stack, wavelength_nm, &settings(args.preset)).map_err(|e| input(&e))?;
        let angles: Vec<(f64, f64)> = args
            .phi_deg
            .iter()
            .flat_map(|&phi| args.theta_deg.iter().map(move |&theta| (theta, phi)))
            .collect();
        let one = |&(theta_deg, phi_deg): &(f64, f64)| {
            let began = std::time::Instant::now();
            let (sin, (sin_phi, cos_phi)) =
                (theta_deg.to_radians().sin(), phi_deg.to_radians().sin_cos());
            let (u, v) = (sin * cos_phi, sin * sin_phi);
            let (p, reflected) = match args.model {
                Model::Wave => {
                    let powers = model.solve(u, v).map_err(|e| input(&e))?;
                    (powers.absorbed, Some(powers.reflected))
                }
                Model::Geometric => {
                    let mut p = vec![0f32; sub.count()];
                    geometric.weights(u as f32, v as f32, &mut p);
                    (p.into_iter().map(f64::from).collect(), None)
                }
            };
            let p = p
                .into_iter()
                .enumerate()
                .map(|(i, p)| (sub.name(i), p))
                .collect();
            let seconds = began.elapsed().as_secs_f64();
            Ok(Direction {
                wavelength_nm,
                theta_deg,
                phi_deg,
                p,
                reflected,
                seconds,
            })
        };
        all.extend(
            angles
                .par_iter()
                .map(one)
                .collect::<Result<Vec<_>, CommandError>>()?,
        );
    }
    if args.json {
        let rows: Vec<_> = all
            .iter()
            .map(|d| {
                let p: serde_json::Map<_, _> = d.p.iter().map(|(name, p)| (name.clone(), (*p).into())).collect();
                serde_json::json!({
                    "wavelength_nm": d.wavelength_nm, "theta_deg": d.theta_deg, "phi_deg": d.phi_deg,
                    "p": p, "reflected": d.reflected, "seconds": d.seconds
                })
            })
            .collect();
        println!(
            "{}",
            serde_json::json!({ "pixel": stack.name, "pitch_um": stack.pitch_um, "directions": rows })
        );
        return Ok(());
    }
    let names: Vec<String> = (0..sub.count())
        .map(|i| format!("{:>8}", format!("P_{}", sub.name(i))))
        .collect();
    println!(
        "{:>8} {:>9} {:>8} {} {:>8}",
        "λ nm",
        "θ deg",
        "φ deg",
        names.join(" "),
        "R"
    );
    for d in &all {
        let p: Vec<String> = d.p.iter().map(|(_, p)| format!("{p:8.4}")).collect();
        let reflected = d.reflected.map_or("-".into(), |r| format!("{r:.4}"));
        println!(
            "{:8.1} {:9.2} {:8.1} {} {reflected:>8}",
            d.wavelength_nm,
            d.theta_deg,
            d.phi_deg,
            p.join(" ")
        );
    }
    Ok(())
}
