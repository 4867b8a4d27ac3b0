//! P at a few angles, for a person or a program.

use crate::outln;
use quadpixel::em::PixelStack;
use quadpixel::em::light::SolverProgress;
use quadpixel::em::light::{Light, Powers, direction_cosines};
use quadpixel::sensor::Subpixels;
use rayon::prelude::*;

use super::args::ResponseArgs;
use crate::exit::CommandError;
use crate::log::{Level, Log};
use crate::progress::Progress;
use quadpixel_generators::observer::{Event, Observer};

/// The response to one plane wave.
struct Direction {
    wavelength_nm: f64,
    theta_deg: f64,
    phi_deg: f64,
    answer: Light,
    seconds: f64,
}

impl Direction {
    /// Polarizations known, by name, the mean last.
    fn powers(&self) -> Vec<(&'static str, &Powers)> {
        let polarized = self.answer.polarized.iter().flatten();
        let mut all: Vec<_> = ["s", "p"].into_iter().zip(polarized).collect();
        all.push(("mean", &self.answer.mean));
        all
    }
}

pub(super) fn print(args: &ResponseArgs, stack: &PixelStack, log: Log) -> Result<(), CommandError> {
    let outside = |t: &&f64| t.is_nan() || t.abs() >= 90.0;
    if let Some(theta) = args.theta_deg.iter().find(outside) {
        return Err(CommandError::input(format!(
            "--theta-deg is {theta}; allowed: above -90, below 90"
        )));
    }
    if let Some(phi) = args.phi_deg.iter().find(|p| !p.is_finite()) {
        return Err(CommandError::input(format!(
            "--phi-deg is {phi}; allowed: a finite angle"
        )));
    }
    let light = |nm: &f64| nm.is_finite() && *nm > 0.0;
    if let Some(nm) = args.wavelength_nm.iter().find(|nm| !light(nm)) {
        return Err(CommandError::input(format!(
            "--wavelength-nm is {nm}; allowed: a positive number"
        )));
    }
    let progress = Progress::new(log);
    let all = solve(args, stack, &progress)?;
    progress.finish();
    for d in &all {
        for warning in &d.answer.warnings {
            let text = format!("theta {}, phi {}: {warning}", d.theta_deg, d.phi_deg);
            log.line(Level::Warn, &text, &[]);
        }
    }
    if args.json {
        let rows: Vec<_> = all.iter().map(|d| json(d, stack.subpixels)).collect();
        outln!(
            "{}",
            serde_json::json!({
                "pixel": stack.name, "pitch_um": stack.pitch_um, "model": args.model.model().version(), "directions": rows
            })
        );
    } else {
        print_table(&all, stack.subpixels)?;
    }
    Ok(())
}

fn solve(
    args: &ResponseArgs,
    stack: &PixelStack,
    progress: &Progress,
) -> Result<Vec<Direction>, CommandError> {
    let model = args.model.model();
    let mut all = Vec::new();
    for &wavelength_nm in &args.wavelength_nm {
        let pixel = model
            .solver(stack, wavelength_nm)
            .map_err(CommandError::input)?;
        let of_phi = |&phi| args.theta_deg.iter().map(move |&theta| (theta, phi));
        let angles: Vec<(f64, f64)> = args.phi_deg.iter().flat_map(of_phi).collect();
        let one = |&(theta_deg, phi_deg): &(f64, f64)| {
            let began = std::time::Instant::now();
            let [u, v] = direction_cosines(theta_deg, phi_deg);
            let watch = |run: SolverProgress| {
                progress.event(Event::Simulation(&format!(
                    "{theta_deg}°, φ {phi_deg}°, {wavelength_nm} nm: {:.0} µm/c of light, residual {:.1e}",
                    run.time_um, run.residual
                )));
            };
            let answer = pixel
                .on_period_watched(u, v, &watch)
                .map(|light| light.on_microlens(stack))
                .map_err(CommandError::input)?;
            Ok(Direction {
                wavelength_nm,
                theta_deg,
                phi_deg,
                answer,
                seconds: began.elapsed().as_secs_f64(),
            })
        };
        let found = angles.par_iter().map(one);
        all.extend(found.collect::<Result<Vec<_>, CommandError>>()?);
    }
    Ok(all)
}

fn json(d: &Direction, subpixels: Subpixels) -> serde_json::Value {
    let powers = |powers: &Powers| {
        let p = powers.absorbed.iter().enumerate();
        let p: serde_json::Map<_, _> = p.map(|(i, &p)| (subpixels.name(i), p.into())).collect();
        serde_json::json!({
            "p": p, "reflected": powers.reflected, "transmitted": powers.transmitted, "elsewhere": powers.elsewhere
        })
    };
    let by_name = d.powers().into_iter();
    let by_name: serde_json::Map<_, _> = by_name
        .map(|(name, p)| (name.to_owned(), powers(p)))
        .collect();
    serde_json::json!({
        "wavelength_nm": d.wavelength_nm, "theta_deg": d.theta_deg, "phi_deg": d.phi_deg, "powers": by_name,
        "residual": d.answer.residual, "imbalance": d.answer.imbalance, "steps": d.answer.steps, "warnings": d.answer.warnings, "seconds": d.seconds
    })
}

fn print_table(all: &[Direction], subpixels: Subpixels) -> Result<(), CommandError> {
    let names =
        (0..subpixels.count()).map(|i| format!("{:>8}", format!("P_{}", subpixels.name(i))));
    outln!(
        "{:>7} {:>7} {:>7} {:>4} {} {:>8} {:>8} {:>8} {:>9} {:>9} {:>7} {:>8}",
        "λ nm",
        "θ deg",
        "φ deg",
        "pol",
        names.collect::<Vec<_>>().join(" "),
        "R",
        "T",
        "other",
        "imbalance",
        "residual",
        "steps",
        "s"
    );
    for d in all {
        for (name, powers) in d.powers() {
            let p = powers.absorbed.iter().map(|p| format!("{p:8.4}"));
            let steps = d.answer.steps.map_or("-".into(), |s| s.to_string());
            outln!(
                "{:7.1} {:7.2} {:7.1} {name:>4} {} {:8.4} {:8.4} {:8.4} {:+9.4} {:9.1e} {steps:>7} {:8.2}",
                d.wavelength_nm,
                d.theta_deg,
                d.phi_deg,
                p.collect::<Vec<_>>().join(" "),
                powers.reflected,
                powers.transmitted,
                powers.elsewhere,
                d.answer.imbalance,
                d.answer.residual,
                d.seconds
            );
        }
    }
    Ok(())
}
