//! `qpalgo sharpness`: the three measures of pictures, with every choice printed.

use crate::number::number;
use crate::outln;
use std::path::PathBuf;

use clap::{Args, ValueEnum};

use crate::exit::CommandError;
use crate::progress::Progress;
use quadpixel_algorithms::load;
use quadpixel_algorithms::metrics::sharpness::{
    Eigenvalues, Energy, GradientKernel, Mean, Plane, Samples, Sharpness, SharpnessSettings,
    sharpness,
};

/// Arguments of `qpalgo sharpness`. What is not given is the preset's.
#[derive(Clone, Debug, Args)]
pub struct SharpnessArgs {
    /// Pictures (EXR, PNG, TIFF), all of one size, as the measures depend on it; integers are read as 0 to 1.
    #[arg(required = true)]
    images: Vec<PathBuf>,
    /// Set of choices: wee-abstract, or table-2 (fits the size of the paper's Table 2).
    #[arg(long, default_value = SharpnessSettings::PRESETS[0])]
    preset: String,
    /// Wee: norm of the image, its energy Σf² or the root of it.
    #[arg(long, value_enum)]
    norm: Option<NormArg>,
    /// Wee: mean that is taken away.
    #[arg(long, value_enum)]
    mean: Option<MeanArg>,
    /// Wee: N of the covariance g gᵀ/(N − 1), which matters for pictures that are not square (the paper's are); absent:
    /// columns.
    #[arg(long, value_enum)]
    samples: Option<SamplesArg>,
    /// Wee: number of eigenvalues, from the largest down; 0: all.
    #[arg(long)]
    k: Option<usize>,
    /// Wee: what is added up.
    #[arg(long, value_enum)]
    eigenvalues: Option<EigenvaluesArg>,
    /// Wee: factor on the values read (255: as 8-bit codes).
    #[arg(value_parser = number, long)]
    wee_scale: Option<f64>,
    /// Gradient: kernel.
    #[arg(long, value_enum)]
    kernel: Option<KernelArg>,
    /// Gradient: factor on the values read.
    #[arg(value_parser = number, long)]
    gradient_scale: Option<f64>,
    /// Prints one JSON object on stdout, full precision.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum NormArg {
    /// Σf².
    Energy,
    /// √Σf².
    Root,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum MeanArg {
    /// Of the whole image.
    Image,
    /// Of each column.
    Column,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SamplesArg {
    /// The picture's width.
    Columns,
    /// The picture's height.
    Rows,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum EigenvaluesArg {
    /// λ.
    Plain,
    /// λ².
    Squared,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum KernelArg {
    /// 3×3, not normalised.
    Sobel,
    /// Half the difference of the neighbours.
    Central,
}

/// Measures each channel of each picture.
pub fn run(args: &SharpnessArgs, progress: Progress) -> Result<(), CommandError> {
    let settings = settings(args)?;
    progress.stage("reading the pictures");
    let images = load::alike(&args.images).map_err(CommandError::input)?;
    let mut rows: Vec<(String, usize, Sharpness)> = Vec::new();
    for (path, image) in args.images.iter().zip(&images) {
        let name = path.display().to_string();
        progress.stage(format!("measuring {name}"));
        for channel in 0..image.channels() {
            let measured = Plane::from_image(image, channel)
                .and_then(|plane| sharpness(&plane, &settings))
                .map_err(|e| CommandError::input(format!("{name}: {e}")))?;
            rows.push((name.clone(), channel, measured));
        }
    }
    drop(progress);
    if args.json {
        let rows: Vec<_> = rows
            .iter()
            .map(|(image, channel, s)| {
                serde_json::json!({
                    "image": image, "channel": channel,
                    "de": s.de, "de_count": s.de_count, "wee": s.wee, "gradient": s.gradient
                })
            })
            .collect();
        outln!(
            "{}",
            serde_json::json!({ "settings": settings, "images": rows })
        );
    } else {
        outln!("channel  De        Wee          gradient   image");
        for (image, channel, s) in &rows {
            outln!(
                "{channel:<8} {:<9.6} {:<12.5e} {:<10.6} {image}",
                s.de,
                s.wee,
                s.gradient
            );
        }
    }
    Ok(())
}

fn settings(args: &SharpnessArgs) -> Result<SharpnessSettings, CommandError> {
    let mut settings: SharpnessSettings = args
        .preset
        .parse()
        .map_err(|e| CommandError::input(format!("--preset: {e}")))?;
    match args.norm {
        Some(NormArg::Energy) => settings.wee_energy = Energy::SumOfSquares,
        Some(NormArg::Root) => settings.wee_energy = Energy::Root,
        None => {}
    }
    match args.mean {
        Some(MeanArg::Image) => settings.wee_mean = Mean::Image,
        Some(MeanArg::Column) => settings.wee_mean = Mean::Column,
        None => {}
    }
    match args.samples {
        Some(SamplesArg::Columns) => settings.wee_samples = Samples::Columns,
        Some(SamplesArg::Rows) => settings.wee_samples = Samples::Rows,
        None => {}
    }
    match args.k {
        Some(0) => settings.wee_k = None,
        Some(k) => settings.wee_k = Some(k),
        None => {}
    }
    match args.eigenvalues {
        Some(EigenvaluesArg::Plain) => settings.wee_eigenvalues = Eigenvalues::Plain,
        Some(EigenvaluesArg::Squared) => settings.wee_eigenvalues = Eigenvalues::Squared,
        None => {}
    }
    match args.kernel {
        Some(KernelArg::Sobel) => settings.gradient_kernel = GradientKernel::Sobel,
        Some(KernelArg::Central) => settings.gradient_kernel = GradientKernel::Central,
        None => {}
    }
    settings.wee_scale = args.wee_scale.unwrap_or(settings.wee_scale);
    settings.gradient_scale = args.gradient_scale.unwrap_or(settings.gradient_scale);
    Ok(settings)
}
