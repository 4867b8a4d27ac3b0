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

use super::cell::Cell;
use super::fills::{Fills, Spectrum};
use super::mesh::{Filling, Mesh};
use super::palette::{Palette, Spectra};
use super::{MaterialMap, SolverError};
use crate::em::PixelStack;

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

/// Makes the map.
pub(super) fn raster(
    stack: &PixelStack,
    mesh: &Mesh,
    spectra: &Spectra,
) -> Result<Raster, SolverError> {
    let grid = &mesh.grid;
    let slabs = Slabs::new(stack, mesh, spectra);
    let mut media = Palette::new(spectra);
    let mut components: [Vec<u16>; 3] = [(); 3].map(|()| Vec::new());
    for k in 0..=grid.nz() {
        for (axis, map) in components.iter_mut().enumerate() {
            slabs.number(k, axis, &mut media, map)?;
        }
    }
    let [ex, ey, ez] = components;
    Ok(Raster {
        map: MaterialMap::new(grid, media.media, ex, ey, ez)?,
        silicon_share: [0, 1, 2].map(|axis| slabs.silicon_share(axis).collect()),
        surface_share: [0, 1].map(|axis| slabs.surface_share(axis)),
    })
}

/// The slabs of a mesh and what their nodes are filled with.
struct Slabs<'a> {
    stack: &'a PixelStack,
    mesh: &'a Mesh,
    fills: Fills,
    cells: Vec<Cell>,
    /// Number of the slab of each grid layer.
    slab_of: Vec<usize>,
    /// ε of a node within each slab, by component, for slabs that are alike at every height.
    tables: Vec<[Vec<Spectrum>; 3]>,
}

impl<'a> Slabs<'a> {
    fn new(stack: &'a PixelStack, mesh: &'a Mesh, spectra: &Spectra) -> Self {
        let plane = (mesh.grid.nx() + 1) * (mesh.grid.ny() + 1);
        let fills = Fills::new(stack, mesh);
        let slabs = mesh.slabs.iter();
        let cells: Vec<Cell> = slabs.map(|s| Cell::new(stack, s, spectra)).collect();
        let numbered = mesh.slabs.iter().enumerate();
        let table = |cell: &Cell| {
            [0, 1, 2].map(|axis| (0..plane).map(|at| cell.flat(axis, &fills, at)).collect())
        };
        Self {
            slab_of: numbered
                .flat_map(|(i, s)| std::iter::repeat_n(i, s.cells.len()))
                .collect(),
            tables: cells.iter().map(table).collect(),
            stack,
            mesh,
            fills,
            cells,
        }
    }

    fn is_lens(&self, slab: usize) -> bool {
        self.mesh.slabs[slab].filling == Filling::Lens
    }

    /// Adds the media of a component's nodes in layer k (of Ez) or on plane k.
    fn number(
        &self,
        k: usize,
        axis: usize,
        media: &mut Palette,
        map: &mut Vec<u16>,
    ) -> Result<(), SolverError> {
        let above = self.slab_of[k.min(self.mesh.grid.nz() - 1)];
        let below = self.slab_of[k.saturating_sub(1)];
        let lens = self.is_lens(above) || (axis != 2 && self.is_lens(below));
        let plane = Plane {
            k,
            axis,
            above,
            below,
        };
        match lens {
            true => self.number_lens(&plane, media, map),
            false => self.number_flat(&plane, media, map),
        }
    }

    fn number_flat(
        &self,
        plane: &Plane,
        media: &mut Palette,
        map: &mut Vec<u16>,
    ) -> Result<(), SolverError> {
        let (k, axis) = (plane.k, plane.axis);
        let (above, below) = (plane.above, plane.below);
        let whole = axis == 2 || above == below;
        let mut known: HashMap<[usize; 2], u16> = HashMap::new();
        for (at, upper) in self.tables[above][axis].iter().enumerate() {
            // Neighbouring nodes mostly repeat; the class of a node is its ε on both sides.
            let class = [above, below].map(|s| self.fills.class(self.cells[s].pattern(), axis, at));
            let id = match known.get(&class) {
                Some(id) => *id,
                None => {
                    let e = match whole {
                        true => upper.clone(),
                        false => mean(upper, &self.tables[below][axis][at], self.thickness_um(k)),
                    };
                    let id = media.number(e, f64::INFINITY)?;
                    known.insert(class, id);
                    id
                }
            };
            map.push(id);
        }
        Ok(())
    }

    /// Nodes whose voxels are part lens, part air; below the lens's lowest points lies something else.
    fn number_lens(
        &self,
        plane: &Plane,
        media: &mut Palette,
        map: &mut Vec<u16>,
    ) -> Result<(), SolverError> {
        let (k, axis) = (plane.k, plane.axis);
        let (above, below) = (plane.above, plane.below);
        let z = self.mesh.grid.z_um();
        let vertical = axis == 2;
        let mid = |k: usize| 0.5 * (z[k] + z[k + 1]);
        let (low, high) = if vertical {
            (z[k], z[k + 1])
        } else if self.is_lens(below) {
            (mid(k - 1), mid(k))
        } else {
            (z[k], mid(k))
        };
        let slab = if self.is_lens(above) { above } else { below };
        for (at, under) in self.tables[below][axis].iter().enumerate() {
            let e = self.cells[slab].lens(self.stack, self.mesh, axis, at, [low, high]);
            let e = match vertical || self.is_lens(below) {
                true => e,
                false => mean(&e, under, self.thickness_um(k)),
            };
            map.push(media.number(e, LENS_STEPS)?);
        }
        Ok(())
    }

    /// Thickness of the layers above and below plane k.
    fn thickness_um(&self, k: usize) -> [f64; 2] {
        [k, k - 1].map(|k| self.mesh.grid.thickness_um(k))
    }

    /// Part of the absorption in the silicon slab that is silicon's, node by node.
    fn silicon_share(&self, axis: usize) -> impl Iterator<Item = f64> {
        let nodes = 0..self.tables[0][axis].len();
        nodes.map(move |at| self.cells[0].share(&self.fills, axis, at))
    }

    /// The same on the plane of the silicon's surface.
    fn surface_share(&self, axis: usize) -> Vec<f64> {
        let over = &self.tables[self.slab_of[self.mesh.surface]][axis];
        let under = &self.tables[0][axis];
        let [weight_over, weight_under] = self.thickness_um(self.mesh.surface);
        let one = |(at, silicon): (usize, f64)| {
            let inside = under[at][0].im * weight_under;
            let outside = over[at][0].im * weight_over;
            let part = if outside > 0.0 {
                inside / (inside + outside)
            } else {
                1.0
            };
            part * silicon
        };
        self.silicon_share(axis).enumerate().map(one).collect()
    }
}

/// Nodes of one component on a plane, or in the layer above it, and the slabs on both sides.
struct Plane {
    k: usize,
    axis: usize,
    above: usize,
    below: usize,
}

fn mean(a: &Spectrum, b: &Spectrum, [wa, wb]: [f64; 2]) -> Spectrum {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a * wa + b * wb) / (wa + wb))
        .collect()
}
