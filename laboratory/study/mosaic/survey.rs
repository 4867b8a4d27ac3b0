//! The supercell and the periods of one colour, at each wavelength and angle.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::error::LaboratoryError;
use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel::em::light::direction_cosines;
use quadpixel::em::mosaic::{FilterColour, MICROLENSES};
use rayon::prelude::*;

/// A wavelength in the band of each colour, nm.
const BANDS: [(FilterColour, f64); 3] = [
    (FilterColour::Blue, 450.0),
    (FilterColour::Green, 532.0),
    (FilterColour::Red, 620.0),
];

/// P of one microlens, as parts of the light that falls on one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Halves {
    /// Of a row of sub-pixels, against the light's direction.
    pub left: f64,
    /// Of a row of sub-pixels, where the light is aimed.
    pub right: f64,
    /// Of all sub-pixels.
    pub total: f64,
}

/// One angle at one wavelength.
#[derive(Clone, Debug)]
pub(super) struct Point {
    pub theta_deg: f64,
    /// By microlens of the supercell.
    pub mosaic: Vec<Halves>,
    /// By colour ([`FilterColour::ALL`]): the period of that colour alone.
    pub alone: Vec<Halves>,
}

/// One wavelength over θ, ascending.
pub(super) struct Band {
    pub colour: FilterColour,
    pub wavelength_nm: f64,
    pub points: Vec<Point>,
}

/// All that was solved.
pub(super) struct Survey {
    pub bands: Vec<Band>,
    pub solutions: usize,
    pub warned: usize,
    /// Wall clock of the slowest solution of the supercell.
    pub slowest_s: f64,
    /// Largest imbalance of power.
    pub imbalance: f64,
}

/// What one solution tells.
struct Solved {
    microlenses: Vec<Halves>,
    warned: bool,
    imbalance: f64,
    seconds: f64,
}

impl Survey {
    pub fn new(
        stack: &PixelStack,
        model: &PixelModel,
        theta_deg: &[f64],
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, LaboratoryError> {
        if stack.mosaic.is_none() || stack.subpixels.m() < 2 {
            return Err(LaboratoryError::NoMosaic {
                pixel: stack.name.clone(),
            });
        }
        // The supercell first: it takes longest.
        let mut stacks = vec![stack.clone()];
        for colour in FilterColour::ALL {
            stacks.push(stack.with_single_filter(colour)?);
        }
        let mut lit = Vec::new();
        for (_, wavelength_nm) in BANDS {
            for stack in &stacks {
                lit.push(model.solver(stack, wavelength_nm)?);
            }
        }
        let kinds = stacks.len();
        let of_kind = |kind| (0..BANDS.len()).map(move |band| (kind, band));
        let wanted: Vec<(usize, usize, f64)> = (0..kinds)
            .flat_map(of_kind)
            .flat_map(|(kind, band)| theta_deg.iter().map(move |t| (kind, band, *t)))
            .collect();
        let done = AtomicUsize::new(0);
        let one = |&(kind, band, theta_deg): &(usize, usize, f64)| {
            let began = Instant::now();
            let [u, v] = direction_cosines(theta_deg, 0.0);
            let answer = lit[band * kinds + kind].on_period(u, v);
            let answer = answer?;
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, wanted.len());
            let by_microlens = stacks[kind].by_microlens(&answer.mean.absorbed);
            Ok(Solved {
                microlenses: by_microlens.iter().map(|p| halves(stack, p)).collect(),
                warned: !answer.warnings.is_empty(),
                imbalance: answer.imbalance.abs(),
                seconds: began.elapsed().as_secs_f64(),
            })
        };
        let solved: Vec<Solved> = wanted
            .par_iter()
            .with_max_len(1)
            .map(one)
            .collect::<Result<_, LaboratoryError>>()?;
        let count = theta_deg.len();
        let at =
            |kind: usize, band: usize, i: usize| &solved[(kind * BANDS.len() + band) * count + i];
        let bands = BANDS
            .iter()
            .enumerate()
            .map(|(band, &(colour, wavelength_nm))| Band {
                colour,
                wavelength_nm,
                points: (0..count)
                    .map(|i| Point {
                        theta_deg: theta_deg[i],
                        mosaic: at(0, band, i).microlenses.clone(),
                        alone: (1..kinds)
                            .flat_map(|kind| at(kind, band, i).microlenses.clone())
                            .collect(),
                    })
                    .collect(),
            });
        let supercells = &solved[..BANDS.len() * count];
        Ok(Self {
            bands: bands.collect(),
            solutions: solved.len(),
            warned: solved.iter().filter(|s| s.warned).count(),
            slowest_s: supercells.iter().map(|s| s.seconds).fold(0.0, f64::max),
            imbalance: solved.iter().map(|s| s.imbalance).fold(0.0, f64::max),
        })
    }
}

impl Band {
    /// The microlenses of the band's own colour, by their place in the supercell.
    pub fn own(&self) -> impl Iterator<Item = usize> + '_ {
        (0..MICROLENSES).filter(|i| FilterColour::OF_MICROLENSES[*i] == self.colour)
    }

    /// Place of the band's colour among [`FilterColour::ALL`].
    pub fn colour_place(&self) -> usize {
        place(self.colour)
    }
}

/// Place among [`FilterColour::ALL`].
pub(super) fn place(colour: FilterColour) -> usize {
    let mut all = FilterColour::ALL.iter();
    all.position(|c| *c == colour).unwrap_or(0)
}

fn halves(stack: &PixelStack, p: &[f64]) -> Halves {
    let s = stack.subpixels;
    let half = |side: f64| -> f64 {
        let own = p.iter().enumerate();
        let own = own.filter(|(k, _)| s.centre(*k).0 * side > 0.0);
        own.map(|(_, p)| p).sum::<f64>() / s.n() as f64
    };
    Halves {
        left: half(-1.0),
        right: half(1.0),
        total: p.iter().sum(),
    }
}
