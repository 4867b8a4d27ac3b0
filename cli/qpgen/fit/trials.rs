//! The fit held to cameras that are drawn.

use quadpixel::sensor::CollectedAt;
use quadpixel_laboratory::fit::camera_model::{CameraModel, Optics};
use quadpixel_laboratory::fit::capture::{CaptureDescription, EXAMPLE_TOML};
use quadpixel_laboratory::fit::conjugates::Conjugates;
use quadpixel_laboratory::fit::noise::Noise;
use quadpixel_laboratory::fit::parameters::Known;
use quadpixel_laboratory::fit::truth::{TruthResult, TruthSettings, trial};

use super::{FitArgs, fineness, pixel, priors};
use crate::exit::CommandError;
use crate::outln;
use crate::progress::Progress;

/// Disk of the cameras that are drawn, px of the views.
const DRAWN_DISK_PX: f64 = 18.0;

/// Draws `count` cameras, fits them blind, and prints how far the fits are off.
pub(super) fn trials(args: &FitArgs, count: u64, progress: &Progress) -> Result<(), CommandError> {
    let known = Known {
        pitch_um: 1.4,
        f_number: 1.8,
        disk_px: DRAWN_DISK_PX,
        focal_length_mm: 4.4,
        pupil_mm: None,
        focus_mm: None,
        has_kernels: true,
    };
    let parameters = priors(known.parameters(), &args.prior)?;
    let description: CaptureDescription =
        toml::from_str(EXAMPLE_TOML).map_err(CommandError::failed)?;
    let stack = pixel(args, &description)?;
    let optics = Optics {
        f_number: known.f_number,
        unit_mm: known.unit_mm(),
        side: 61,
        view_pixel_um: 2.8,
        collected_at: CollectedAt::Anywhere,
        conjugates: Conjugates {
            focal_length_mm: known.focal_length_mm,
            hiatus_mm: 0.0,
        },
    };
    let model = CameraModel::new(&stack, 550.0, optics, fineness(args))?;
    let mut results: Vec<TruthResult> = Vec::new();
    for seed in args.seed..args.seed + count {
        let settings = TruthSettings {
            seed,
            grid: [8, 6],
            field_mm: 0.47,
            sheet_half_mm: 2.8,
            sheet_columns: 64,
            noise: Noise {
                kernel: 0.05,
                sheet: 0.005,
                plane: 1.0,
            },
        };
        let result = trial(&model, &parameters, &settings, 2.8, progress)?;
        if !args.json {
            outln!(
                "camera {seed}: worst parameter {:.2} sigma; kept out: shift {:.2} %, kernels {:.2} %, sheet {:.2} %",
                result.worst_sigmas,
                100.0 * result.shift_error,
                100.0 * result.kernel_error,
                100.0 * result.sheet_error
            );
        }
        results.push(result);
    }
    progress.finish();
    let all: Vec<f64> = results
        .iter()
        .flat_map(|r| r.parameters.iter().map(|p| (p.2 - p.1).abs() / p.3))
        .collect();
    let within = all.iter().filter(|z| **z <= 3.0).count() as f64 / all.len() as f64;
    let good = results.iter().filter(|r| r.worst_sigmas <= 3.0).count();
    if args.json {
        outln!(
            "{}",
            serde_json::json!({ "within_3_sigma": within, "trials": results })
        );
    } else {
        outln!(
            "parameters within 3 sigma: {:.2} % of {}; cameras with all within: {good} of {count}",
            100.0 * within,
            all.len()
        );
    }
    Ok(())
}
