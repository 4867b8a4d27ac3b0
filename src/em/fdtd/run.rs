//! From a pixel and a transverse wavevector to powers: `solve`.
//!
//! Both polarizations are stepped as one batch. Where k∥ lies in a mirror plane of the pixel, half of the cell is
//! enough (a quarter at k∥ = 0, with real fields): a wave polarized across the plane meets electric, one along it
//! magnetic walls.

use std::f64::consts::PI;

use super::answer::{BALANCE, FdtdRun};
use super::error::{refused, within};
use super::matter::{Matter, members};
use super::mesh::Mesh;
use super::monitored::{Monitored, monitors};
use super::phasors::Phasors;
use super::{FdtdSettings, Member, Simulation, SolverError};
use crate::em::light::{Light, Powers, SolverProgress, largest};
use crate::em::{Indices, PixelStack};
use crate::memory;

/// Name and version of the model: part of every table's key, so a change of the physics changes the key.
pub const MODEL: &str = "fdtd-2";

/// How often the absorbed power is looked at, in µm/c.
pub const CHECK_UM: f64 = 5.0;

/// |k∥|/k0 up to which a wave is taken for a plane wave in air.
const STEEPEST: f64 = 0.985;

/// Powers of a pixel under plane waves of transverse wavevector `bloch_per_um` = k∥ = k0 (u, v), at every wavelength, s
/// and p.
///
/// # Errors
/// A pixel, settings or wavelengths out of range, waves that do not travel in air (|k∥| above 0.985 k0), or a machine
/// with less free memory than the run needs.
pub fn solve(
    stack: &PixelStack,
    wavelengths_nm: &[f64],
    bloch_per_um: [f64; 2],
    settings: &FdtdSettings,
    watch: &dyn Fn(SolverProgress),
) -> Result<FdtdRun, SolverError> {
    let began = std::time::Instant::now();
    let indices = check(stack, wavelengths_nm, bloch_per_um, settings)?;
    let mesh = Mesh::new(
        stack,
        wavelengths_nm,
        mirrors(stack, bloch_per_um),
        settings,
    )?;
    let memory_bytes = memory_bytes(&mesh, wavelengths_nm.len(), bloch_per_um)?;
    check_memory(memory_bytes)?;
    let matter = Matter::new(stack, &mesh, &indices, wavelengths_nm, bloch_per_um)?;
    let mut run = Monitored::new(stack, &mesh, &matter, wavelengths_nm, bloch_per_um)?;

    let mut before: Option<Vec<f64>> = None;
    let (mut residual, mut quiet) = (f64::INFINITY, 0);
    // P of a photodiode is of the light on its microlens.
    let microlenses = (mesh.microlenses * mesh.microlenses) as f64;
    // Light has to be there before it can be quiet.
    let earliest = run.pulse.end_um() + 2.0 * optical_height_um(stack, &indices);
    while quiet < 2 && run.sim.time_um() < settings.longest_um {
        run.advance(CHECK_UM);
        let now = run.absorbed();
        if let Some(before) = &before {
            let change = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
            residual = microlenses * change.fold(run.mismatch(), f64::max);
        }
        before = Some(now);
        let settled = residual < settings.tolerance && run.sim.time_um() > earliest;
        quiet = if settled { quiet + 1 } else { 0 };
        watch(SolverProgress {
            time_um: run.sim.time_um(),
            residual,
        });
    }
    let g = &mesh.grid;
    let outcome = Outcome {
        residual,
        converged: quiet >= 2,
        steps: run.sim.steps(),
        time_um: run.sim.time_um(),
    };
    let answers = run.answers().into_iter().zip(wavelengths_nm);
    Ok(FdtdRun {
        answers: answers
            .map(|(both, nm)| outcome.answer(both, *nm))
            .collect(),
        residual,
        converged: outcome.converged,
        steps: outcome.steps,
        time_um: run.sim.time_um(),
        seconds: began.elapsed().as_secs_f64(),
        memory_bytes,
        cells: [g.nx(), g.ny(), g.nz()],
        sets: run.members.iter().map(Member::sets).sum(),
    })
}

/// How a run ended.
struct Outcome {
    residual: f64,
    converged: bool,
    steps: u64,
    time_um: f64,
}

impl Outcome {
    /// What is answered of s and p at a wavelength, with what is wrong: not converged, or energy lost or made.
    fn answer(&self, [s, p]: [Powers; 2], wavelength_nm: f64) -> Light {
        let mut warnings = Vec::new();
        if !self.converged {
            warnings.push(format!(
                "not converged after {:.0} um/c: P still changes by {:.1e}",
                self.time_um, self.residual
            ));
        }
        for (name, balance) in [("s", s.balance()), ("p", p.balance())] {
            if (balance - 1.0).abs() > BALANCE {
                warnings.push(format!(
                    "{wavelength_nm} nm, {name}: reflected + absorbed + transmitted = {balance:.4}"
                ));
            }
        }
        Light {
            residual: self.residual,
            imbalance: largest([&s, &p].map(|p| p.balance() - 1.0)),
            steps: Some(self.steps as usize),
            warnings,
            ..Light::from_polarizations(s, p)
        }
    }
}

fn check(
    stack: &PixelStack,
    wavelengths_nm: &[f64],
    bloch: [f64; 2],
    settings: &FdtdSettings,
) -> Result<Vec<Indices>, SolverError> {
    stack.check()?;
    settings.check()?;
    within(
        "wavelengths (count)",
        wavelengths_nm.len() as f64,
        1.0,
        100.0,
    )?;
    let indices = wavelengths_nm
        .iter()
        .map(|w| stack.indices(*w))
        .collect::<Result<Vec<_>, _>>()?;
    for w in wavelengths_nm {
        let sine = bloch[0].hypot(bloch[1]) * w * 1e-3 / (2.0 * PI);
        within("sine of the angle of incidence", sine, 0.0, STEEPEST)?;
    }
    Ok(indices)
}

/// Which axes the pixel and k∥ allow to be halved. A mosaic keeps the mirrors through the centres of its microlenses.
fn mirrors(stack: &PixelStack, bloch: [f64; 2]) -> [bool; 2] {
    [0, 1].map(|a| bloch[a] == 0.0 && stack.lens.shift_um[a] == 0.0)
}

impl FdtdSettings {
    /// Bytes that a run of this pixel takes at the shortest of its wavelengths and the transverse wavevector k∥ (0: the
    /// least, by symmetry).
    ///
    /// # Errors
    /// A pixel or settings out of range.
    pub fn memory_bytes(
        &self,
        stack: &PixelStack,
        wavelengths_nm: &[f64],
        bloch_per_um: [f64; 2],
    ) -> Result<usize, SolverError> {
        stack.check()?;
        self.check()?;
        let mesh = Mesh::new(stack, wavelengths_nm, mirrors(stack, bloch_per_um), self)?;
        memory_bytes(&mesh, wavelengths_nm.len(), bloch_per_um)
    }
}

/// Bytes of fields, map and phasors of a run.
fn memory_bytes(mesh: &Mesh, wavelengths: usize, bloch: [f64; 2]) -> Result<usize, SolverError> {
    let g = &mesh.grid;
    let members = members(mesh, bloch);
    // A pulse needs poles in most layers; at one wavelength only metals do.
    let polar = if wavelengths > 1 { [g.nz(), 2] } else { [0, 0] };
    let fields = Simulation::bytes(g, &members, &mesh.cpml, polar)?;
    let phasors: usize = monitors(mesh)
        .iter()
        .map(|[first, last]| Phasors::bytes([g.nx(), g.ny()], *first, *last))
        .sum();
    // Indices of the map, and ε of every node while it is made.
    let map = (g.nx() + 1) * (g.ny() + 1) * (g.nz() + 1) * 6;
    Ok(fields + phasors * wavelengths * members.len() + map)
}

/// Fails if the machine has less memory free. Where it does not say how much it has, nothing is checked.
fn check_memory(needed: usize) -> Result<(), SolverError> {
    memory::check("a simulation", needed as u64).map_err(|e| {
        let gigabytes = |bytes: u64| bytes as f64 / 1024f64.powi(3);
        refused(
            "memory",
            format!("{:.1} GiB needed", gigabytes(e.needed)),
            format!("{:.1} GiB free: use a coarser mesh", gigabytes(e.allowed)),
        )
    })
}

fn optical_height_um(stack: &PixelStack, indices: &[Indices]) -> f64 {
    let Some(n) = indices.first() else {
        return 0.0;
    };
    let layers: f64 = n
        .layers
        .iter()
        .zip(&stack.layers)
        .map(|(n, l)| n.re * l.thickness_um)
        .sum();
    layers + n.lens.re * stack.lens.height_um + n.silicon.re * stack.silicon_um
}
