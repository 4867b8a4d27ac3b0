//! What a run steps: its two polarizations, the media on the grid and the time step.

use std::f64::consts::PI;

use super::dispersion::Numerics;
use super::error::refused;
use super::mesh::Mesh;
use super::palette::Spectra;
use super::pulse::Pulse;
use super::raster::{Raster, raster};
use super::{Lateral, Member, SolverError, Wall, stable_step_um};
use crate::em::{Indices, PixelStack};
use crate::units::um_from_nm;

/// s and p.
pub(super) fn members(mesh: &Mesh, bloch: [f64; 2]) -> [Member; 2] {
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

/// The time step, what the grid makes of each wavelength, and the media.
pub(super) struct Matter {
    pub dt_um: f64,
    pub numerics: Vec<Numerics>,
    pub raster: Raster,
}

impl Matter {
    pub fn new(
        stack: &PixelStack,
        mesh: &Mesh,
        indices: &[Indices],
        wavelengths_nm: &[f64],
        bloch: [f64; 2],
    ) -> Result<Self, SolverError> {
        let omegas: Vec<f64> = wavelengths_nm
            .iter()
            .map(|w| 2.0 * PI / um_from_nm(*w))
            .collect();
        let middle = Pulse::new(wavelengths_nm).omega;
        let nearest = |a: &usize, b: &usize| {
            (omegas[*a] - middle)
                .abs()
                .total_cmp(&(omegas[*b] - middle).abs())
        };
        let design = (0..omegas.len()).min_by(nearest).unwrap_or(0);
        // The corrected media bound the step, and the step is in the correction: two rounds settle it to the last per
        // cent.
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
        Err(refused("dt_um", dt_um, "a stable step"))
    }
}
