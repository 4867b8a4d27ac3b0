//! A run in steps: a simulation with its monitors, and the powers that they tell.

use std::sync::Arc;

use rustfft::num_complex::Complex64;

use super::footprint::Footprint;
use super::incident::Incident;
use super::matter::{Matter, members};
use super::mesh::Mesh;
use super::phasors::Phasors;
use super::powers::{Absorbed, Fields, Side};
use super::pulse::Pulse;
use super::{Domain, Member, Simulation, SolverError, Source};
use crate::em::PixelStack;
use crate::em::light::Powers;

type C = Complex64;

/// First and last plane of the three sets of phasors: silicon, inlet, outlet.
pub(super) fn monitors(mesh: &Mesh) -> [[usize; 2]; 3] {
    [
        [mesh.bottom - 1, mesh.surface + 1],
        [mesh.inlet - 1, mesh.inlet + 1],
        [mesh.outlet - 1, mesh.outlet + 1],
    ]
}

/// A simulation with its monitors.
pub(super) struct Monitored<'a> {
    stack: &'a PixelStack,
    mesh: &'a Mesh,
    matter: &'a Matter,
    pub members: [Member; 2],
    pub pulse: Pulse,
    pub sim: Simulation,
    /// Steps between samples.
    every: usize,
    /// By wavelength, member, monitor.
    phasors: Vec<[[Phasors; 3]; 2]>,
    /// ½ Ω is left out: Im ε of each medium as stepped, by wavelength.
    loss: Vec<Vec<f64>>,
    /// By wavelength, member.
    incident: Vec<[Incident; 2]>,
}

impl<'a> Monitored<'a> {
    pub fn new(
        stack: &'a PixelStack,
        mesh: &'a Mesh,
        matter: &'a Matter,
        wavelengths_nm: &[f64],
        bloch: [f64; 2],
    ) -> Result<Self, SolverError> {
        let pulse = Pulse::new(wavelengths_nm);
        let members = members(mesh, bloch);
        let dt_um = matter.dt_um;
        let source = Source {
            plane: mesh.source,
            waveform: pulse.waveform(),
        };
        let sim = Simulation::new(
            Domain {
                grid: mesh.grid.clone(),
                map: Arc::new(matter.raster.map.clone()),
                cpml: mesh.cpml,
            },
            &members,
            source,
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
    pub fn advance(&mut self, by_um: f64) {
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
            .map(|i| Footprint::for_photodiode(self.mesh, self.stack, i))
            .collect()
    }

    /// P of every photodiode, by wavelength and member.
    pub fn absorbed(&self) -> Vec<f64> {
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

    /// Largest difference of volume integral and flux of a photodiode: zero in a steady state, so it sees what is still
    /// on its way.
    pub fn mismatch(&self) -> f64 {
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

    /// Powers of s and p, by wavelength.
    pub fn answers(&self) -> Vec<[Powers; 2]> {
        let wavelengths = 0..self.phasors.len();
        wavelengths
            .map(|w| [0, 1].map(|m| self.powers(w, m)))
            .collect()
    }

    fn powers(&self, w: usize, m: usize) -> Powers {
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
        let sum = |part: fn(&Absorbed) -> f64| parts.iter().map(part).sum::<f64>() * unit;
        let (trench, above) = (sum(|p| p.trench), sum(|p| p.above));
        let transmitted = -silicon.upward(&whole, mesh.bottom, Side::Both) * unit;
        let into_silicon = -silicon.upward(&whole, mesh.surface, Side::Above) * unit - above;
        let into_pixel = -inlet.upward(&whole, mesh.inlet, Side::Both) * unit;
        let up = outlet.upward(&whole, mesh.outlet, Side::Both);
        let reflected = wave.reflected(&outlet, up, self.members[m].current) * unit;
        let elsewhere = into_pixel - into_silicon + trench;
        let by_flux = footprints.iter().zip(&parts);
        Powers {
            // Through the six faces of its box, less what its trenches absorb.
            absorbed_by_flux: by_flux
                .map(|(f, p)| (silicon.entering(f) - p.above - p.trench) * unit)
                .collect(),
            absorbed,
            reflected,
            transmitted,
            elsewhere,
        }
    }
}
