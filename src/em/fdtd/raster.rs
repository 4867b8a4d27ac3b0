//! Matter on the E nodes: the permittivity of each node, from what its cell is filled with.
//!
//! ```text
//!   lens surface   1/ε_a = n_a² ⟨1/ε⟩ + (1 − n_a²)/⟨ε⟩ for component a, n the normal, averages over the node's cell
//!   trenches       the same with vertical normals; a trench thinner than a cell keeps its area
//!   filters        of a mosaic: the same, with the normals of the microlenses' borders
//!   flat planes    the mean of both sides by thickness (exact, see dispersion.rs)
//! ```
//! The diagonal of the smoothed tensor of A. Farjadpour et al., Opt. Lett. 31, 2972 (2006). All in complex ε at each
//! wavelength, so lossy interfaces are averaged as well; a node of Re ε < 1 becomes a Drude term.

use std::collections::HashMap;

use rustfft::num_complex::Complex64;

use super::dispersion::{Layers, Numerics};
use super::fills::{Fills, Pattern, Spectrum, smooth};
use super::mesh::{Filling, Mesh, Slab};
use super::{FdtdError, MaterialMap, Medium, poles};
use crate::em::mosaic::MICROLENSES;
use crate::em::{Indices, PixelStack};

type C = Complex64;

/// Columns of a voxel across which the lens surface is sampled, per axis.
const SAMPLES: usize = 4;
/// Steps of ε in which nodes on the lens surface are told apart: keeps the list of media short.
const LENS_STEPS: f64 = 2500.0;

/// The map, and how much of a node's absorption is silicon's.
pub(super) struct Raster {
    pub map: MaterialMap,
    /// In the silicon slab, by component, x fastest, (nx+1)(ny+1) entries.
    pub silicon_share: [Vec<f64>; 3],
    /// On the plane of the silicon's surface: Ex, Ey.
    pub surface_share: [Vec<f64>; 2],
}

/// Permittivities and frequencies of a run.
pub(super) struct Spectra<'a> {
    /// Indices of the stack by wavelength.
    pub indices: &'a [Indices],
    /// By wavelength.
    pub numerics: &'a [Numerics],
    /// Which wavelength the correction is made for.
    pub design: usize,
}

impl Spectra<'_> {
    /// Corrected ε of a medium in such layers.
    fn corrected(&self, layers: &Layers, index: impl Fn(&Indices) -> C) -> Spectrum {
        let n = index(&self.indices[self.design]);
        let factor = self.numerics[self.design].permittivity(n, layers) / (n * n);
        self.indices
            .iter()
            .map(|i| {
                let n = index(i);
                let e = n * n * factor;
                C::new(e.re, e.im.max(0.0))
            })
            .collect()
    }
}

/// Makes the map.
pub(super) fn raster(
    stack: &PixelStack,
    mesh: &Mesh,
    spectra: &Spectra,
) -> Result<Raster, FdtdError> {
    let grid = &mesh.grid;
    let plane = (grid.nx() + 1) * (grid.ny() + 1);
    let fill = Fills::new(stack, mesh);
    let cells: Vec<Cell> = mesh
        .slabs
        .iter()
        .map(|s| Cell::new(stack, s, spectra))
        .collect();
    let slab_of: Vec<usize> = mesh
        .slabs
        .iter()
        .enumerate()
        .flat_map(|(i, s)| std::iter::repeat_n(i, s.cells.len()))
        .collect();
    // ε of a node within one slab, for slabs that are alike at every height.
    let tables: Vec<[Vec<Spectrum>; 3]> = cells
        .iter()
        .map(|cell| {
            [0, 1, 2].map(|axis| {
                (0..plane)
                    .map(|at| cell.flat(axis, &fill, at))
                    .collect::<Vec<_>>()
            })
        })
        .collect();
    let mut media = Palette::new(spectra);
    let mut components: [Vec<u16>; 3] =
        [0, 1, 2].map(|_| Vec::with_capacity(plane * (grid.nz() + 1)));
    let z = grid.z_um();
    for k in 0..=grid.nz() {
        let above = slab_of[k.min(grid.nz() - 1)];
        let below = slab_of[k.saturating_sub(1)];
        let is_lens = |s: usize| mesh.slabs[s].filling == Filling::Lens;
        for (axis, map) in components.iter_mut().enumerate() {
            let vertical = axis == 2;
            let lens = is_lens(above) || (!vertical && is_lens(below));
            if !lens {
                let whole = vertical || above == below;
                let mut known: HashMap<(usize, usize), u16> = HashMap::new();
                for (at, here) in tables[above][axis].iter().enumerate() {
                    // Neighbouring nodes mostly repeat; the class of a node is its ε on both sides.
                    let class = (
                        fill.class(cells[above].pattern(), axis, at),
                        fill.class(cells[below].pattern(), axis, at),
                    );
                    let id = match known.get(&class) {
                        Some(id) => *id,
                        None => {
                            let e = if whole {
                                here.clone()
                            } else {
                                let weights = [grid.thickness_um(k), grid.thickness_um(k - 1)];
                                mean(here, &tables[below][axis][at], weights)
                            };
                            let id = media.of(e, f64::INFINITY)?;
                            known.insert(class, id);
                            id
                        }
                    };
                    map.push(id);
                }
                continue;
            }
            // The voxel's part in lens and air, and below the lens's lowest points something else.
            let mid = |k: usize| 0.5 * (z[k] + z[k + 1]);
            let (low, high) = if vertical {
                (z[k], z[k + 1])
            } else if is_lens(below) {
                (mid(k - 1), mid(k))
            } else {
                (z[k], mid(k))
            };
            let slab = if is_lens(above) { above } else { below };
            for (at, under) in tables[below][axis].iter().enumerate() {
                let e = cells[slab].lens(stack, mesh, axis, at, [low, high]);
                let e = if vertical || is_lens(below) {
                    e
                } else {
                    let weights = [grid.thickness_um(k), grid.thickness_um(k - 1)];
                    mean(&e, under, weights)
                };
                map.push(media.of(e, LENS_STEPS)?);
            }
        }
    }
    let [ex, ey, ez] = components;
    let silicon = &cells[0];
    let over = &tables[slab_of[mesh.surface]];
    let weights = [
        grid.thickness_um(mesh.surface),
        grid.thickness_um(mesh.surface - 1),
    ];
    Ok(Raster {
        map: MaterialMap::new(grid, media.media, ex, ey, ez)?,
        silicon_share: [0, 1, 2].map(|axis| {
            (0..plane)
                .map(|at| silicon.share(&fill, axis, at))
                .collect()
        }),
        surface_share: [0, 1].map(|axis| {
            (0..plane)
                .map(|at| {
                    let inside = tables[0][axis][at][0].im * weights[1];
                    let outside = over[axis][at][0].im * weights[0];
                    let part = if outside > 0.0 {
                        inside / (inside + outside)
                    } else {
                        1.0
                    };
                    part * silicon.share(&fill, axis, at)
                })
                .collect()
        }),
    })
}

fn mean(a: &Spectrum, b: &Spectrum, [wa, wb]: [f64; 2]) -> Spectrum {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a * wa + b * wb) / (wa + wb))
        .collect()
}

/// What one slab is made of.
struct Cell {
    base: Spectrum,
    inset: Inset,
    air: Spectrum,
}

/// What else there is in a slab.
enum Inset {
    Nothing,
    /// Trenches or walls.
    Bands(Spectrum, Pattern),
    /// The filters of a mosaic, by microlens, in place of the base.
    Filters([Spectrum; MICROLENSES]),
}

impl Cell {
    fn new(stack: &PixelStack, slab: &Slab, spectra: &Spectra) -> Self {
        let layers = &slab.layers;
        let of = |index: &dyn Fn(&Indices) -> C| spectra.corrected(layers, index);
        let air = of(&|_| C::ONE);
        let (base, inset) = match slab.filling {
            Filling::Silicon if stack.trench_um > 0.0 => (
                of(&|n| n.silicon),
                Inset::Bands(of(&|n| n.trench), Pattern::Trenches),
            ),
            Filling::Silicon => (of(&|n| n.silicon), Inset::Nothing),
            Filling::Layer(i) => (of(&|n| n.layers[i]), in_layer(stack, i, &of)),
            Filling::Pedestal | Filling::Lens => (of(&|n| n.lens), Inset::Nothing),
            Filling::Air => (air.clone(), Inset::Nothing),
        };
        Self { base, inset, air }
    }

    fn pattern(&self) -> Option<Pattern> {
        match &self.inset {
            Inset::Nothing => None,
            Inset::Bands(_, pattern) => Some(*pattern),
            Inset::Filters(_) => Some(Pattern::Microlenses),
        }
    }

    /// ε of a node, the slab being alike at every height.
    fn flat(&self, component: usize, fills: &Fills, at: usize) -> Spectrum {
        match &self.inset {
            Inset::Nothing => self.base.clone(),
            Inset::Filters(filters) => fills.mixed(filters, component, at),
            Inset::Bands(inset, what) => {
                let (fill, along) = fills.at(*what, component, at);
                inset
                    .iter()
                    .zip(&self.base)
                    .map(|(a, b)| smooth(*a, *b, fill, along))
                    .collect()
            }
        }
    }

    /// Part of the absorption of a silicon node that is silicon's.
    fn share(&self, fills: &Fills, component: usize, at: usize) -> f64 {
        let Inset::Bands(inset, what) = &self.inset else {
            return 1.0;
        };
        let (fill, _) = fills.at(*what, component, at);
        let (trench, silicon) = (fill * inset[0].im, (1.0 - fill) * self.base[0].im);
        if trench > 0.0 {
            silicon / (silicon + trench)
        } else {
            1.0
        }
    }

    /// ε of a node whose voxel reaches over the heights `z_um` of the lens.
    fn lens(
        &self,
        stack: &PixelStack,
        mesh: &Mesh,
        component: usize,
        at: usize,
        z_um: [f64; 2],
    ) -> Spectrum {
        let (i, j) = (at % (mesh.grid.nx() + 1), at / (mesh.grid.nx() + 1));
        let centre = [
            mesh.across_um(0, i, component == 0),
            mesh.across_um(1, j, component == 1),
        ];
        let (fill, normal) = lens_fill(stack, mesh, centre, z_um);
        let along = normal[component];
        self.base
            .iter()
            .zip(&self.air)
            .map(|(a, b)| smooth(*a, *b, fill, along))
            .collect()
    }
}

/// Which of a stack's indices is meant.
type IndexOf<'a> = &'a dyn Fn(&Indices) -> C;

/// What layer `i` holds; `of` makes spectra for it.
fn in_layer(stack: &PixelStack, i: usize, of: &dyn Fn(IndexOf) -> Spectrum) -> Inset {
    if stack.walls_in(i).is_some() {
        return Inset::Bands(of(&|n| n.metal), Pattern::Walls);
    }
    let mosaic = stack.mosaic.as_ref().and(stack.filter_layer());
    if mosaic.is_none_or(|(filter, _)| filter != i) {
        return Inset::Nothing;
    }
    // A stack with a mosaic has its indices.
    let filter = |n: &Indices, microlens: usize| n.mosaic.map_or(n.layers[i], |m| m.n[microlens]);
    Inset::Filters([0, 1, 2, 3].map(|microlens| of(&|n| filter(n, microlens))))
}

/// Part of a voxel below the lens's surface, and the squared normal of the surface in it.
fn lens_fill(
    stack: &PixelStack,
    mesh: &Mesh,
    centre: [f64; 2],
    [low, high]: [f64; 2],
) -> (f64, [f64; 3]) {
    let size = mesh.lateral_um();
    let p = stack.pitch_um;
    let r = stack.lens.radius_um;
    // The lens's base is the top of the flat layers.
    let top: f64 = mesh.lens_apex_um();
    let (mut fill, mut normal) = (0.0, [0.0; 3]);
    let wrap = |x: f64| x - p * (x / p).round();
    for a in 0..SAMPLES {
        for b in 0..SAMPLES {
            let offset = |s: usize| (s as f64 + 0.5) / SAMPLES as f64 - 0.5;
            let x = wrap(centre[0] + offset(a) * size[0] - stack.lens.shift_um[0]);
            let y = wrap(centre[1] + offset(b) * size[1] - stack.lens.shift_um[1]);
            let up = (r * r - x * x - y * y).max(0.0).sqrt();
            let part = ((top - r + up - low) / (high - low)).clamp(0.0, 1.0);
            fill += part / (SAMPLES * SAMPLES) as f64;
            // Columns cut by the surface say where it looks; a steep one is cut by few, so all near it count a little.
            let weight = part * (1.0 - part) + 1e-3;
            normal[0] += weight * x * x;
            normal[1] += weight * y * y;
            normal[2] += weight * up * up;
        }
    }
    let sum: f64 = normal.iter().sum();
    (fill, normal.map(|n| if sum > 0.0 { n / sum } else { 0.0 }))
}

/// The media met so far.
struct Palette<'a> {
    spectra: &'a Spectra<'a>,
    media: Vec<Medium>,
    known: HashMap<Vec<[i64; 2]>, u16>,
}

impl<'a> Palette<'a> {
    fn new(spectra: &'a Spectra<'a>) -> Self {
        Self {
            spectra,
            media: Vec::new(),
            known: HashMap::new(),
        }
    }

    /// Number of the medium of these ε, rounded to 1/`steps` (∞: not rounded).
    fn of(&mut self, mut epsilon: Spectrum, steps: f64) -> Result<u16, FdtdError> {
        if steps.is_finite() {
            for e in &mut epsilon {
                *e = C::new(
                    (e.re * steps).round() / steps,
                    (e.im * steps).round() / steps,
                );
            }
        }
        let bits = |x: f64| (x * 1e9).round() as i64;
        let key: Vec<[i64; 2]> = epsilon.iter().map(|e| [bits(e.re), bits(e.im)]).collect();
        if let Some(id) = self.known.get(&key) {
            return Ok(*id);
        }
        let id = u16::try_from(self.media.len())
            .map_err(|_| FdtdError::value("media", self.media.len() + 1, "at most 65536"))?;
        self.media.push(self.medium(&epsilon)?);
        self.known.insert(key, id);
        Ok(id)
    }

    fn medium(&self, epsilon: &Spectrum) -> Result<Medium, FdtdError> {
        let omegas: Vec<f64> = self
            .spectra
            .numerics
            .iter()
            .map(Numerics::trapezoid_omega)
            .collect();
        match (epsilon.as_slice(), omegas.as_slice()) {
            // Corrected air lies a little below 1 and stays a plain dielectric.
            ([e], [omega]) if e.re >= 0.8 => Medium::new(e.re, omega * e.im, Vec::new()),
            ([e], [omega]) => Medium::from_permittivity(*e, *omega),
            _ => poles::medium(&omegas, epsilon),
        }
    }
}
