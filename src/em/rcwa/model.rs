//! From a pixel and a direction to powers.

use std::f64::consts::PI;
use std::time::Instant;

use super::basis::{Basis, Class, Lattice, Parity, Sector};
use super::error::within;
use super::grid::Grid;
use super::layers::{self, Climbed, narrowed, whole};
use super::lens::LensSlices;
use super::linear::{C, Matrix, flux, plus_one, solve};
use super::silicon::Silicon;
use super::uniform::Uniform;
use super::{RcwaAnswer, RcwaError, RcwaPowers, RcwaSettings};
use crate::em::PixelStack;
use crate::em::stack::Indices;

/// Name and version of the model: part of every table's key, so a change of the physics changes the key.
pub const MODEL: &str = "rcwa-1";

/// sin θ up to which a wave is taken for a plane wave in air.
const STEEPEST: f64 = 0.999;

/// A pixel at one wavelength, ready to be lit from any direction.
pub struct RcwaModel {
    stack: PixelStack,
    settings: RcwaSettings,
    indices: Indices,
    k0_per_um: f64,
    slices: LensSlices,
}

impl RcwaModel {
    /// Checks pixel, settings and wavelength.
    pub fn new(
        stack: &PixelStack,
        wavelength_nm: f64,
        settings: &RcwaSettings,
    ) -> Result<Self, RcwaError> {
        stack.check()?;
        settings.check()?;
        let indices = stack.indices(wavelength_nm)?;
        let k0_per_um = 2.0 * PI / (wavelength_nm * 1e-3);
        let step = 2.0 * PI / (stack.pitch_um * k0_per_um);
        // The sum of two order numbers, each up to (cutoff + 1)/step.
        let most = 2 * ((settings.lens_cutoff + 1.0) / step).ceil() as usize;
        Ok(Self {
            stack: stack.clone(),
            settings: *settings,
            k0_per_um,
            slices: LensSlices::new(stack, indices.lens, settings.slice_nm * 1e-3, most),
            indices,
        })
    }

    /// Where the light of a plane wave of direction cosines (u, v) goes. Needs √(u² + v²) ≤ 0.999.
    pub fn solve(&self, u: f64, v: f64) -> Result<RcwaAnswer, RcwaError> {
        let began = Instant::now();
        within("sine of the angle of incidence", u.hypot(v), 0.0, STEEPEST)?;
        // cos 90° in binary is not quite 0, and a mirror is worth a factor of four.
        let [u, v] = [u, v].map(|x| if x.abs() < 1e-12 { 0.0 } else { x });
        let lattice = Lattice {
            bloch: [u, v],
            step: 2.0 * PI / (self.stack.pitch_um * self.k0_per_um),
        };
        let mirrors =
            [0, 1].map(|axis| lattice.bloch[axis] == 0.0 && self.stack.lens.shift_um[axis] == 0.0);
        let waves = incident(lattice.bloch);
        let mut functions = 0;
        let mut answers = Vec::new();
        if mirrors == [false, false] {
            let sector = Sector {
                x: Parity::None,
                y: Parity::None,
            };
            answers = self.sector(lattice, sector, &waves, &mut functions)?;
        } else {
            for wave in waves {
                let sector = sector_of(wave, mirrors);
                answers.extend(self.sector(lattice, sector, &[wave], &mut functions)?);
            }
        }
        let mut answers = answers.into_iter();
        match (answers.next(), answers.next()) {
            (Some(s), Some(p)) => Ok(RcwaAnswer {
                s,
                p,
                functions,
                seconds: began.elapsed().as_secs_f64(),
            }),
            _ => Err(RcwaError::Value {
                field: "polarizations",
                value: "fewer than 2".into(),
                allowed: "2".into(),
            }),
        }
    }

    /// Powers of incident waves (E_x, E_y of order 0) of one sector.
    fn sector(
        &self,
        lattice: Lattice,
        sector: Sector,
        waves: &[[f64; 2]],
        functions: &mut usize,
    ) -> Result<Vec<RcwaPowers>, RcwaError> {
        let k0 = self.k0_per_um;
        let n = &self.indices;
        let high = Basis::new(lattice, sector, self.settings.lens_cutoff, Class::WHOLE);
        let walls = self.walls();
        let mut basis = match walls {
            Some(_) => whole(&high, self.settings.wall_cutoff),
            None => high.clone(),
        };
        // What lies over the silicon, from the silicon up.
        let over: Vec<(usize, C, f64)> = n
            .layers
            .iter()
            .zip(&self.stack.layers)
            .enumerate()
            .filter(|(_, (_, l))| l.thickness_um > 0.0)
            .map(|(i, (n, l))| (i, n * n, l.thickness_um))
            .rev()
            .collect();
        let lens = n.lens * n.lens;
        let nearest = over.first().map_or(lens, |o| o.1);
        let [cols, rows] = [self.stack.subpixels.m(), self.stack.subpixels.n()];
        let grid = Grid {
            parts: [cols as i32, rows as i32],
            wall: self.stack.trench_um / self.stack.pitch_um,
            inside: n.silicon * n.silicon,
            outside: n.trench * n.trench,
        };
        let cutoff = n.silicon.re + self.settings.silicon_margin * lattice.step;
        let silicon = Silicon::new(&basis, grid, nearest, cutoff)?;
        *functions = (*functions).max(silicon.functions());
        let in_nearest = Uniform::new(&basis, nearest);
        let rho = silicon.reflection(basis.len());

        let mut climbed: Vec<Climbed> = Vec::new();
        let mut admittance = layers::admittance(&in_nearest, &rho);
        let mut go = |c: Climbed, admittance: &mut Matrix| {
            admittance.clone_from(&c.above);
            climbed.push(c);
        };
        for (place, (index, epsilon, thickness)) in over.iter().enumerate() {
            match walls {
                Some((layer, wall)) if layer == *index => {
                    let walls = Grid {
                        inside: *epsilon,
                        ..wall
                    };
                    go(
                        layers::walled(&basis, &walls, k0 * thickness, &admittance)?,
                        &mut admittance,
                    );
                    let above = over.get(place + 1).map_or(lens, |o| o.1);
                    go(narrowed(&basis, &high, above, &admittance), &mut admittance);
                    basis = high.clone();
                }
                _ => go(
                    layers::uniform(&basis, *epsilon, k0 * thickness, &admittance),
                    &mut admittance,
                ),
            }
        }
        if walls.is_some() && basis.len() != high.len() {
            // The layer with the walls has no thickness.
            go(narrowed(&basis, &high, lens, &admittance), &mut admittance);
            basis = high.clone();
        }
        if self.slices.pedestal_um > 0.0 {
            go(
                layers::uniform(&basis, lens, k0 * self.slices.pedestal_um, &admittance),
                &mut admittance,
            );
        }
        for slice in (0..self.slices.count()).rev() {
            let (above, passage) = self.slices.climb(&basis, slice, k0, &admittance);
            go(Climbed { above, passage }, &mut admittance);
        }

        // Air.
        let air = Uniform::new(&basis, C::ONE);
        let incident = order_zero(&basis, waves);
        let e = solve(
            &(air.matrix() + &admittance),
            &(air.times(&incident) * faer::Scale(C::new(2.0, 0.0))),
        );
        let up = &e - &incident;
        let (h_in, h_up) = (air.times(&incident), air.times(&up));
        // Down again.
        let mut field = e.clone();
        for c in climbed.iter().rev() {
            field = &c.passage * &field;
        }
        // E of both waves at the silicon: the one that falls in is (1 + ρ)⁻¹ E.
        let down = solve(&plus_one(rho), &field);
        let inside = silicon.absorb(&down, k0, self.stack.silicon_um);
        Ok(inside
            .into_iter()
            .enumerate()
            .map(|(j, inside)| {
                let unit = 1.0 / flux(incident.as_ref(), h_in.as_ref(), j);
                let h = &admittance * &e;
                let entering = flux(e.as_ref(), h.as_ref(), j);
                RcwaPowers {
                    absorbed: inside.absorbed.iter().map(|p| p * unit).collect(),
                    absorbed_by_flux: (inside.entering - inside.leaving) * unit,
                    reflected: flux(up.as_ref(), h_up.as_ref(), j) * unit,
                    transmitted: inside.leaving * unit,
                    elsewhere: (entering - inside.entering) * unit,
                }
            })
            .collect())
    }

    /// The layer with metal walls, and these (their host to be filled in).
    fn walls(&self) -> Option<(usize, Grid)> {
        let metal = self.stack.metal.as_ref()?;
        let layer = self
            .stack
            .layers
            .iter()
            .position(|l| l.name == metal.layer)?;
        let epsilon = self.indices.metal * self.indices.metal;
        Some((
            layer,
            Grid {
                parts: [1, 1],
                wall: metal.width_um / self.stack.pitch_um,
                inside: epsilon,
                outside: epsilon,
            },
        ))
    }
}

/// Tangential E of s and p, of unit strength.
fn incident([u, v]: [f64; 2]) -> [[f64; 2]; 2] {
    let sine = u.hypot(v);
    let [c, s] = if sine > 0.0 {
        [u / sine, v / sine]
    } else {
        [1.0, 0.0]
    };
    let cosine = (1.0 - sine * sine).sqrt();
    [[-s, c], [c * cosine, s * cosine]]
}

/// The parities of E_x that a wave makes, where there are mirrors. Its E lies along or across each of them.
fn sector_of([ex, _]: [f64; 2], mirrors: [bool; 2]) -> Sector {
    let [x, y] = mirrors.map(|mirror| match (mirror, ex != 0.0) {
        (false, _) => Parity::None,
        (true, true) => Parity::Even,
        (true, false) => Parity::Odd,
    });
    Sector { x, y }
}

/// Order 0, a column a wave.
fn order_zero(basis: &Basis, waves: &[[f64; 2]]) -> Matrix {
    let mut out = Matrix::zeros(basis.len(), waves.len());
    for (i, (orders, first)) in [(&basis.x, 0), (&basis.y, basis.x.len())]
        .into_iter()
        .enumerate()
    {
        if let Some(at) = orders.iter().position(|o| o.n == [0, 0]) {
            for (j, wave) in waves.iter().enumerate() {
                out[(first + at, j)] = C::from(wave[i]);
            }
        }
    }
    out
}
