//! The numbers of one time step, made once.
//!
//! E of a node with ε∞, σ and poles, where P'' + γ P' + ω0² P = s E, q = P' dt, and σ and the poles go by the trapezoid
//! rule:
//!
//! ```text
//!   E ← ca E + cb dt curl H − Σ (g q − h P)      den = ε∞ + σ dt/2 + Σ ξ/2,  ca = (2 ε∞ − den)/den,  cb = 1/den
//!   q ← α q − β P + ξ (E + E before)             D = 1 + γ dt/2 + ω0² dt²/4,  α = (2 − D)/D,  β = ω0² dt²/D
//!   P ← P + (q + q before)/2                     ξ = s dt²/(2 D),  g = (1 + α)/(2 den),  h = β/(2 den)
//! ```
//! It loses energy where the medium does and nowhere else, so it is stable whenever the vacuum leapfrog with ε∞ is.
//!
//! A node's coefficients are looked up by rows: rows of equal media are kept once. In flat layers and in silicon with
//! its trenches a handful of rows serves everything from the first-level cache; only the layers through the lens have
//! many.

use std::collections::HashMap;

use super::cpml::{CpmlSettings, stretch};
use super::error::{refused, within};
use super::layout::Layout;
use super::{MaterialMap, Medium, Pole, SolverError, YeeGrid};

/// The largest time step in µm/c that is stable whatever the fields do.
///
/// The leapfrog needs dt² < 4 / λ, λ the largest eigenvalue of ε⁻¹ curl curl. On a product grid curl curl = −∇² − grad
/// div and the last term only lowers λ; Gershgorin's theorem on ε⁻¹(−∇²) gives λ ≤ max over nodes of (K_x² + K_y² +
/// g_z) / ε∞, K the largest symbol of the lateral differences (2/dx; of those beside the node, where they change with
/// z), g_z the row sum of the graded second difference. So fine layers in silicon do not bound the step of the coarse
/// ones in air.
///
/// # Errors
/// A map of another grid.
pub fn stable_step_um(grid: &YeeGrid, map: &MaterialMap) -> Result<f64, SolverError> {
    if !map.fits(grid) {
        return Err(unfit());
    }
    let square = |s: [super::Stencil; 2]| s.iter().map(|s| s.largest().powi(2)).sum::<f64>();
    let mut largest = 0.0f64;
    for k in 0..grid.nz() {
        let thin = grid.thickness_um(k);
        let beside = [
            grid.in_layer(k.saturating_sub(1)),
            grid.in_layer(k),
            grid.on_plane(k),
            grid.on_plane(k + 1),
        ];
        let lateral = beside.map(square).into_iter().fold(0.0, f64::max);
        // The outer planes are conductors: neither tangential E nor a divergence of E is there.
        let inverse_dual = |k: usize| match k {
            k if k == 0 || k == grid.nz() => 0.0,
            k => 1.0 / grid.dual_um(k),
        };
        let below = grid.thickness_um(k.saturating_sub(1));
        let on_plane = 2.0 * inverse_dual(k) * (1.0 / thin + 1.0 / below);
        let between = 2.0 / thin * (inverse_dual(k) + inverse_dual(k + 1));
        for axis in 0..3 {
            let epsilon = smallest_permittivity(grid, map, axis, k);
            let vertical = if axis == 2 { between } else { on_plane };
            largest = largest.max((lateral + vertical) / epsilon);
        }
    }
    Ok(2.0 / largest.sqrt())
}

fn unfit() -> SolverError {
    refused("map", "made for another grid", "a map of this grid's size")
}

fn smallest_permittivity(grid: &YeeGrid, map: &MaterialMap, axis: usize, k: usize) -> f64 {
    let plane = map.index(0, 0, k)..map.index(grid.nx(), grid.ny(), k) + 1;
    map.component(axis)[plane]
        .iter()
        .map(|m| map.media()[usize::from(*m)].permittivity())
        .fold(f64::INFINITY, f64::min)
}

/// α, β, ξ, g, h of one pole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PoleStep {
    pub alpha: f32,
    pub beta: f32,
    pub xi: f32,
    pub g: f32,
    pub h: f32,
}

/// What E of a node needs.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MediumStep {
    pub ca: f32,
    pub cb: f32,
    pub poles: Vec<PoleStep>,
}

impl MediumStep {
    fn new(medium: &Medium, dt: f64) -> Self {
        let parts = |p: &Pole| {
            let loss = 0.5 * p.damping * dt;
            let swing = 0.25 * (p.resonance * dt).powi(2);
            let d = 1.0 + loss + swing;
            let alpha = (1.0 - loss - swing) / d;
            (alpha, 4.0 * swing / d, 0.5 * p.strength * dt * dt / d)
        };
        let half = 0.5 * medium.conductivity() * dt
            + medium.poles().iter().map(|p| 0.5 * parts(p).2).sum::<f64>();
        let den = medium.permittivity() + half;
        let poles = medium.poles().iter().map(|p| {
            let (alpha, beta, xi) = parts(p);
            PoleStep {
                alpha: alpha as f32,
                beta: beta as f32,
                xi: xi as f32,
                g: (0.5 * (1.0 + alpha) / den) as f32,
                h: (0.5 * beta / den) as f32,
            }
        });
        Self {
            ca: ((medium.permittivity() - half) / den) as f32,
            cb: (1.0 / den) as f32,
            poles: poles.collect(),
        }
    }
}

/// The z difference of one plane or layer: dt/(κ dz), and b and c dt/dz of the absorbing layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vertical {
    pub rate: f32,
    pub stretch: Option<[f32; 2]>,
}

impl Vertical {
    fn new(grid: &YeeGrid, cpml: &CpmlSettings, dt: f64, z_um: f64, step_um: f64) -> Self {
        match stretch(cpml, grid, dt, z_um) {
            None => Self {
                rate: (dt / step_um) as f32,
                stretch: None,
            },
            Some(s) => Self {
                rate: (s.inverse_kappa * dt / step_um) as f32,
                stretch: Some([s.b as f32, (s.c * dt / step_um) as f32]),
            },
        }
    }
}

/// The lateral differences on one plane or in one layer: dt times the weights of the near and the far nodes, along x
/// and along y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Across {
    pub x: [f32; 2],
    pub y: [f32; 2],
}

impl Across {
    fn new(stencils: [super::Stencil; 2], dt: f64) -> Self {
        let [x, y] = stencils.map(|s| [(dt * s.near) as f32, (dt * s.far) as f32]);
        Self { x, y }
    }

    /// Whether far nodes count.
    #[inline(always)]
    pub fn is_wide(&self) -> bool {
        self.x[1] != 0.0 || self.y[1] != 0.0
    }
}

/// Coefficients along one row of E nodes, `width` places each, zero beyond the nodes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Row {
    pub ca: Vec<f32>,
    pub cb: Vec<f32>,
    /// α, β, ξ, g, h of each pole.
    pub poles: Vec<[Vec<f32>; 5]>,
}

impl Row {
    fn new(media: &[u16], steps: &[MediumStep], width: usize) -> Self {
        let row_of = |get: &dyn Fn(&MediumStep) -> f32| {
            let mut row = vec![0.0; width];
            for (place, m) in row.iter_mut().zip(media) {
                *place = get(&steps[usize::from(*m)]);
            }
            row
        };
        let poles = media
            .iter()
            .map(|m| steps[usize::from(*m)].poles.len())
            .max()
            .unwrap_or(0);
        let pole = |p: usize, get: fn(&PoleStep) -> f32| {
            row_of(&|s: &MediumStep| s.poles.get(p).map_or(0.0, get))
        };
        Self {
            ca: row_of(&|s| s.ca),
            cb: row_of(&|s| s.cb),
            poles: (0..poles)
                .map(|p| {
                    [
                        pole(p, |s| s.alpha),
                        pole(p, |s| s.beta),
                        pole(p, |s| s.xi),
                        pole(p, |s| s.g),
                        pole(p, |s| s.h),
                    ]
                })
                .collect(),
        }
    }
}

/// All coefficients of a run; every member shares them.
pub(super) struct Coefficients {
    /// Of Ex, Ey, Hz on plane k.
    pub on_plane: Vec<Across>,
    /// Of Hx, Hy, Ez in layer k.
    pub in_layer: Vec<Across>,
    /// Of E on plane k.
    pub e_vertical: Vec<Vertical>,
    /// Of H between the planes k and k + 1.
    pub h_vertical: Vec<Vertical>,
    pub steps: Vec<MediumStep>,
    pub rows: Vec<Row>,
    /// Number of the row of (layer k, component, row j).
    row_of: Vec<u32>,
    rows_per_layer: usize,
    /// Place of layer k in the arrays of the poles, if it has any.
    pub polar_layer: Vec<Option<usize>>,
    /// Layers with poles, and the most poles of a medium there.
    pub polar: [usize; 2],
}

impl Coefficients {
    /// # Errors
    /// A map of another grid, or a time step above the stable one.
    pub fn new(
        grid: &YeeGrid,
        map: &MaterialMap,
        layout: &Layout,
        cpml: &CpmlSettings,
        dt_um: f64,
    ) -> Result<Self, SolverError> {
        cpml.check(grid)?;
        let stable = stable_step_um(grid, map)?;
        within("dt_um", dt_um, 1e-9, stable)?;
        let steps: Vec<MediumStep> = map
            .media()
            .iter()
            .map(|m| MediumStep::new(m, dt_um))
            .collect();
        let mut out = Self {
            on_plane: Vec::with_capacity(grid.nz()),
            in_layer: Vec::with_capacity(grid.nz()),
            e_vertical: Vec::new(),
            h_vertical: Vec::new(),
            steps,
            rows: Vec::new(),
            row_of: Vec::with_capacity(grid.nz() * 3 * layout.rows),
            rows_per_layer: layout.rows,
            polar_layer: Vec::with_capacity(grid.nz()),
            polar: [0, 0],
        };
        let z = grid.z_um();
        let mut known: HashMap<&[u16], u32> = HashMap::new();
        for k in 0..grid.nz() {
            let vertical = |z, step| Vertical::new(grid, cpml, dt_um, z, step);
            out.on_plane.push(Across::new(grid.on_plane(k), dt_um));
            out.in_layer.push(Across::new(grid.in_layer(k), dt_um));
            out.e_vertical.push(vertical(z[k], grid.dual_um(k)));
            out.h_vertical
                .push(vertical(0.5 * (z[k] + z[k + 1]), grid.thickness_um(k)));
            let mut poles = 0;
            for axis in 0..3 {
                for j in 0..layout.rows {
                    let start = map.index(0, j, k);
                    let media = &map.component(axis)[start..start + layout.lanes];
                    let next = out.rows.len() as u32;
                    let id = *known.entry(media).or_insert(next);
                    if id == next {
                        out.rows.push(Row::new(media, &out.steps, layout.width));
                    }
                    poles = poles.max(out.rows[id as usize].poles.len());
                    out.row_of.push(id);
                }
            }
            out.polar_layer.push((poles > 0).then_some(out.polar[0]));
            out.polar[0] += usize::from(poles > 0);
            out.polar[1] = out.polar[1].max(poles);
        }
        Ok(out)
    }

    /// Row j of component `axis` in layer k.
    #[inline(always)]
    pub fn row(&self, axis: usize, j: usize, k: usize) -> &Row {
        let at = (k * 3 + axis) * self.rows_per_layer + j;
        &self.rows[self.row_of[at] as usize]
    }
}
