//! From a pixel and a transverse wavevector to powers: `solve`.
//!
//! Both polarizations are stepped as one batch. Where k∥ lies in a mirror plane of the pixel, half of the cell is enough (a quarter at
//! k∥ = 0, with real fields): a wave polarized across the plane meets electric, one along it magnetic walls.

use std::f64::consts::PI;
use std::sync::Arc;

use rustfft::num_complex::Complex64;

use super::answer::{FdtdAnswer, FdtdPowers, FdtdProgress, FdtdRun};
use super::dispersion::Numerics;
use super::error::within;
use super::incident::Incident;
use super::mesh::Mesh;
use super::phasors::Phasors;
use super::powers::{Absorbed, Fields, Footprint, Side};
use super::pulse::Pulse;
use super::raster::{Raster, Spectra, raster};
use super::{FdtdError, FdtdSettings, Lateral, Member, Simulation, Source, Wall, stable_step_um};
use crate::em::stack::{Indices, PixelStack};

type C = Complex64;

/// Name and version of the model: part of every table's key, so a change of the physics changes the key.
pub const MODEL: &str = "fdtd-2";

/// How often the absorbed power is looked at, in µm/c.
pub const CHECK_UM: f64 = 5.0;

/// |k∥|/k0 up to which a wave is taken for a plane wave in air.
const STEEPEST: f64 = 0.985;

/// Powers of a pixel under plane waves of transverse wavevector `bloch_per_um` = k∥ = k0 (u, v), at every wavelength, s and p.
///
/// Fails for a pixel, settings or wavelengths out of range, for waves that do not travel in air (|k∥| above 0.985 k0), and if the machine has
/// less free memory than the run needs.
pub fn solve(
    stack: &PixelStack,
    wavelengths_nm: &[f64],
    bloch_per_um: [f64; 2],
    settings: &FdtdSettings,
    progress: &dyn Fn(FdtdProgress),
) -> Result<FdtdRun, FdtdError> {
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
    let mut run = Run::new(stack, &mesh, &matter, wavelengths_nm, bloch_per_um)?;

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
        progress(FdtdProgress {
            time_um: run.sim.time_um(),
            residual,
        });
    }
    let g = &mesh.grid;
    Ok(FdtdRun {
        answers: run.answers(wavelengths_nm),
        residual,
        converged: quiet >= 2,
        steps: run.sim.steps(),
        time_um: run.sim.time_um(),
        seconds: began.elapsed().as_secs_f64(),
        memory_bytes,
        cells: [g.nx(), g.ny(), g.nz()],
        sets: run.members.iter().map(Member::sets).sum(),
    })
}

fn check(
    stack: &PixelStack,
    wavelengths_nm: &[f64],
    bloch: [f64; 2],
    settings: &FdtdSettings,
) -> Result<Vec<Indices>, FdtdError> {
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
pub(super) fn mirrors(stack: &PixelStack, bloch: [f64; 2]) -> [bool; 2] {
    [0, 1].map(|a| bloch[a] == 0.0 && stack.lens.shift_um[a] == 0.0)
}

/// s and p.
fn members(mesh: &Mesh, bloch: [f64; 2]) -> [Member; 2] {
    let k = bloch[0].hypot(bloch[1]);
    let p = if k > 0.0 {
        [bloch[0] / k, bloch[1] / k]
    } else {
        [1.0, 0.0]
    };
    [[-p[1], p[0]], p].map(|current| {
        let side = |a: usize| {
            let cells = if a == 0 {
                mesh.grid.nx()
            } else {
                mesh.grid.ny()
            };
            match (mesh.mirrors[a], current[a] != 0.0) {
                (true, true) => Lateral::Mirror(Wall::Electric),
                (true, false) => Lateral::Mirror(Wall::Magnetic),
                (false, _) => Lateral::Bloch {
                    phase_rad: bloch[a] * cells as f64 * mesh.lateral_um()[a],
                },
            }
        };
        Member {
            x: side(0),
            y: side(1),
            current,
        }
    })
}

/// First and last plane of the three sets of phasors: silicon, inlet, outlet.
fn monitors(mesh: &Mesh) -> [[usize; 2]; 3] {
    [
        [mesh.bottom - 1, mesh.surface + 1],
        [mesh.inlet - 1, mesh.inlet + 1],
        [mesh.outlet - 1, mesh.outlet + 1],
    ]
}

/// Bytes of fields, map and phasors of a run.
pub(super) fn memory_bytes(
    mesh: &Mesh,
    wavelengths: usize,
    bloch: [f64; 2],
) -> Result<usize, FdtdError> {
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
fn check_memory(needed: usize) -> Result<(), FdtdError> {
    let Ok(text) = std::fs::read_to_string("/proc/meminfo") else {
        return Ok(());
    };
    let free_kb: Option<usize> = text
        .lines()
        .find_map(|l| l.strip_prefix("MemAvailable:"))
        .and_then(|l| l.split_whitespace().next()?.parse().ok());
    match free_kb {
        Some(kb) if needed > kb * 1024 => Err(FdtdError::value(
            "memory",
            format!("{:.1} GiB needed", needed as f64 / 1024f64.powi(3)),
            format!(
                "{:.1} GiB free: use a coarser mesh",
                kb as f64 / 1024f64.powi(2)
            ),
        )),
        _ => Ok(()),
    }
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

/// The time step, what the grid makes of each wavelength, and the media.
struct Matter {
    dt_um: f64,
    numerics: Vec<Numerics>,
    raster: Raster,
}

impl Matter {
    fn new(
        stack: &PixelStack,
        mesh: &Mesh,
        indices: &[Indices],
        wavelengths_nm: &[f64],
        bloch: [f64; 2],
    ) -> Result<Self, FdtdError> {
        let omegas: Vec<f64> = wavelengths_nm
            .iter()
            .map(|w| 2.0 * PI / (w * 1e-3))
            .collect();
        let middle = Pulse::new(wavelengths_nm).omega;
        let nearest = |a: &usize, b: &usize| {
            (omegas[*a] - middle)
                .abs()
                .total_cmp(&(omegas[*b] - middle).abs())
        };
        let design = (0..omegas.len()).min_by(nearest).unwrap_or(0);
        // The corrected media bound the step, and the step is in the correction: two rounds settle it to the last per cent.
        let mut dt_um = 0.9 * mesh.grid.dx_um().min(mesh.grid.dy_um()) / 2f64.sqrt();
        for round in 0.. {
            let numerics: Vec<Numerics> = omegas
                .iter()
                .map(|omega| Numerics {
                    omega: *omega,
                    dt_um,
                    lateral_um: mesh.lateral_um(),
                    bloch,
                })
                .collect();
            let spectra = Spectra {
                indices,
                numerics: &numerics,
                design,
            };
            let raster = raster(stack, mesh, &spectra)?;
            let stable = stable_step_um(&mesh.grid, &raster.map)?;
            if dt_um <= stable && (dt_um > 0.96 * stable || round > 2) {
                return Ok(Self {
                    dt_um,
                    numerics,
                    raster,
                });
            }
            dt_um = 0.985 * stable;
        }
        Err(FdtdError::value("dt_um", dt_um, "a stable step"))
    }
}

/// A simulation with its monitors.
struct Run<'a> {
    stack: &'a PixelStack,
    mesh: &'a Mesh,
    matter: &'a Matter,
    members: [Member; 2],
    pulse: Pulse,
    sim: Simulation,
    /// Steps between samples.
    every: usize,
    /// By wavelength, member, monitor.
    phasors: Vec<[[Phasors; 3]; 2]>,
    /// ½ Ω is left out: Im ε of each medium as stepped, by wavelength.
    loss: Vec<Vec<f64>>,
    /// By wavelength, member.
    incident: Vec<[Incident; 2]>,
}

impl<'a> Run<'a> {
    fn new(
        stack: &'a PixelStack,
        mesh: &'a Mesh,
        matter: &'a Matter,
        wavelengths_nm: &[f64],
        bloch: [f64; 2],
    ) -> Result<Self, FdtdError> {
        let pulse = Pulse::new(wavelengths_nm);
        let members = members(mesh, bloch);
        let dt_um = matter.dt_um;
        let source = Source {
            plane: mesh.source,
            waveform: pulse.waveform(),
        };
        let sim = Simulation::new(
            mesh.grid.clone(),
            Arc::new(matter.raster.map.clone()),
            &members,
            source,
            mesh.cpml,
            dt_um,
        )?;
        let size = [mesh.grid.nx(), mesh.grid.ny()];
        let phasors = || monitors(mesh).map(|[first, last]| Phasors::new(size, first, last));
        let media = matter.raster.map.media();
        Ok(Self {
            stack,
            mesh,
            matter,
            members,
            pulse,
            sim,
            every: ((pulse.sampling_um() / dt_um) as usize).max(1),
            phasors: matter
                .numerics
                .iter()
                .map(|_| [phasors(), phasors()])
                .collect(),
            loss: matter
                .numerics
                .iter()
                .map(|n| {
                    media
                        .iter()
                        .map(|m| m.stepped_epsilon(n.omega, dt_um).im)
                        .collect()
                })
                .collect(),
            incident: matter
                .numerics
                .iter()
                .map(|n| {
                    let spectrum = pulse.spectrum(n.omega, dt_um);
                    members.map(|m| Incident::new(mesh, n, m.current, spectrum))
                })
                .collect(),
        })
    }

    /// Steps on by at least `by_um`, sampling on the way.
    fn advance(&mut self, by_um: f64) {
        let until = self.sim.time_um() + by_um;
        let dt = self.matter.dt_um;
        while self.sim.time_um() < until {
            self.sim.advance(self.every);
            let t = self.sim.time_um();
            for (numerics, by_member) in self.matter.numerics.iter().zip(&mut self.phasors) {
                let turn = C::from_polar(self.every as f64 * dt, numerics.omega * t);
                for (member, monitors) in by_member.iter_mut().enumerate() {
                    for phasors in monitors {
                        phasors.add(&self.sim, member, turn);
                    }
                }
            }
        }
    }

    fn fields(&self, wavelength: usize, member: usize, monitor: usize) -> Fields<'_> {
        Fields {
            mesh: self.mesh,
            numerics: &self.matter.numerics[wavelength],
            phasors: &self.phasors[wavelength][member][monitor],
            sides: [self.members[member].x, self.members[member].y],
        }
    }

    fn footprints(&self) -> Vec<Footprint> {
        (0..self.stack.photodiodes())
            .map(|i| Footprint::of_photodiode(self.mesh, self.stack, i))
            .collect()
    }

    /// P of every photodiode, by wavelength and member.
    fn absorbed(&self) -> Vec<f64> {
        let mut out = Vec::new();
        let footprints = self.footprints();
        for w in 0..self.phasors.len() {
            for m in 0..2 {
                let incident = self.incident[w][m].power(self.mesh);
                let fields = self.fields(w, m, 0);
                out.extend(footprints.iter().map(|f| {
                    fields
                        .absorbed(f, &self.matter.raster, &self.loss[w])
                        .silicon
                        / incident
                }));
            }
        }
        out
    }

    /// Largest difference of volume integral and flux of a photodiode: zero in a steady state, so it sees what is still on its way.
    fn mismatch(&self) -> f64 {
        let mut worst = 0.0f64;
        for w in 0..self.phasors.len() {
            for m in 0..2 {
                let incident = self.incident[w][m].power(self.mesh);
                let fields = self.fields(w, m, 0);
                for f in self.footprints() {
                    let absorbed = fields.absorbed(&f, &self.matter.raster, &self.loss[w]);
                    worst = worst.max((absorbed.total() - fields.entering(&f)).abs() / incident);
                }
            }
        }
        worst
    }

    fn answers(&self, wavelengths_nm: &[f64]) -> Vec<FdtdAnswer> {
        (0..wavelengths_nm.len())
            .map(|w| {
                let n = &self.matter.numerics[w];
                FdtdAnswer {
                    wavelength_nm: wavelengths_nm[w],
                    uv: n.bloch.map(|k| k / n.omega),
                    s: self.powers(w, 0),
                    p: self.powers(w, 1),
                }
            })
            .collect()
    }

    fn powers(&self, w: usize, m: usize) -> FdtdPowers {
        let [silicon, inlet, outlet] = [0, 1, 2].map(|i| self.fields(w, m, i));
        let mesh = self.mesh;
        let wave = &self.incident[w][m];
        let unit = 1.0 / wave.power(self.mesh);
        let whole = Footprint::whole(mesh);
        let (raster, loss) = (&self.matter.raster, &self.loss[w]);
        let footprints = self.footprints();
        let parts: Vec<Absorbed> = footprints
            .iter()
            .map(|f| silicon.absorbed(f, raster, loss))
            .collect();
        let absorbed: Vec<f64> = parts.iter().map(|p| p.silicon * unit).collect();
        let sum = |of: fn(&Absorbed) -> f64| parts.iter().map(of).sum::<f64>() * unit;
        let (trench, above) = (sum(|p| p.trench), sum(|p| p.above));
        let transmitted = -silicon.upward(&whole, mesh.bottom, Side::Both) * unit;
        let into_silicon = -silicon.upward(&whole, mesh.surface, Side::Above) * unit - above;
        let into_pixel = -inlet.upward(&whole, mesh.inlet, Side::Both) * unit;
        let up = outlet.upward(&whole, mesh.outlet, Side::Both);
        let reflected = wave.reflected(&outlet, up, self.members[m].current) * unit;
        let elsewhere = into_pixel - into_silicon + trench;
        let balance = reflected + absorbed.iter().sum::<f64>() + transmitted + elsewhere;
        let by_flux = footprints.iter().zip(&parts);
        FdtdPowers {
            absorbed_by_flux: by_flux
                .map(|(f, p)| (silicon.entering(f) - p.above - p.trench) * unit)
                .collect(),
            absorbed,
            reflected,
            transmitted,
            elsewhere,
            balance,
        }
    }
}
