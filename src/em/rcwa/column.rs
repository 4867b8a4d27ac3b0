//! The pixel from its silicon up to the air, for one k∥ and sector: the admittance that the air sees, and the way back down.

use super::basis::{Basis, Class, Lattice, Sector};
use super::grid::Grid;
use super::layers::{self, Climbed};
use super::lens::LensSlices;
use super::linear::{C, Matrix, plus_one, solve};
use super::silicon::{InSilicon, Silicon};
use super::uniform::Uniform;
use super::{RcwaError, RcwaSettings};
use crate::em::PixelStack;
use crate::em::stack::Indices;

/// A pixel at one wavelength.
pub(super) struct Pixel {
    pub stack: PixelStack,
    pub settings: RcwaSettings,
    pub indices: Indices,
    pub k0_per_um: f64,
    /// Of the reciprocal lattice, in k0.
    pub step: f64,
    pub slices: LensSlices,
}

impl Pixel {
    /// Silicon and its trenches.
    fn silicon(&self) -> Grid {
        let [m, n] = [self.stack.subpixels.m(), self.stack.subpixels.n()];
        Grid {
            parts: [m as i32, n as i32],
            wall: self.stack.trench_um / self.stack.pitch_um,
            inside: self.indices.silicon * self.indices.silicon,
            outside: self.indices.trench * self.indices.trench,
        }
    }

    /// Layers of some thickness from the silicon up: ε, thickness in µm, and metal walls with the layer between them.
    fn layers(&self) -> Vec<(C, f64, Option<Grid>)> {
        let (n, metal) = (&self.indices, self.stack.metal.as_ref());
        let both = n.layers.iter().zip(&self.stack.layers).rev();
        both.filter(|(_, layer)| layer.thickness_um > 0.0)
            .map(|(n_layer, layer)| {
                let epsilon = n_layer * n_layer;
                let walls = metal.filter(|m| m.layer == layer.name).map(|m| Grid {
                    parts: [1, 1],
                    wall: m.width_um / self.stack.pitch_um,
                    inside: epsilon,
                    outside: n.metal * n.metal,
                });
                (epsilon, layer.thickness_um, walls)
            })
            .collect()
    }
}

/// See the module's head.
pub(super) struct Column {
    /// Functions in the air.
    pub basis: Basis,
    /// h of E in the air.
    pub admittance: Matrix,
    /// E at the bottom of E at the top of each layer, from the silicon up.
    passages: Vec<Matrix>,
    /// What the silicon reflects into the medium above it.
    reflection: Matrix,
    silicon: Silicon,
    k0_per_um: f64,
    silicon_um: f64,
}

impl Column {
    pub fn new(pixel: &Pixel, lattice: Lattice, sector: Sector) -> Result<Self, RcwaError> {
        let (k0, settings) = (pixel.k0_per_um, &pixel.settings);
        let of = |cutoff| Basis::new(lattice, sector, cutoff, Class::WHOLE);
        let high = of(settings.lens_cutoff);
        let over = pixel.layers();
        // Up to the walls, if there are some, their many functions are followed.
        let low = match over.iter().any(|(.., walls)| walls.is_some()) {
            true => of(settings.wall_cutoff.max(settings.lens_cutoff)),
            false => high.clone(),
        };
        let lens = pixel.indices.lens * pixel.indices.lens;
        let medium = |i: usize| over.get(i).map_or(lens, |layer| layer.0);
        let grid = pixel.silicon();
        // Without trenches silicon couples no orders: those that come down are all.
        let cutoff = match grid.is_plain() {
            true => low.cutoff,
            false => pixel.indices.silicon.re + settings.silicon_margin * lattice.step,
        };
        let silicon = Silicon::new(&low, grid, medium(0), cutoff)?;
        let reflection = silicon.reflection(low.len());

        let mut basis = low;
        let mut admittance = layers::admittance(&Uniform::new(&basis, medium(0)), &reflection);
        let mut passages = Vec::new();
        let mut climb = |c: Climbed| {
            passages.push(c.passage);
            c.above
        };
        for (i, (epsilon, thickness_um, walls)) in over.iter().enumerate() {
            let depth = k0 * thickness_um;
            if let Some(walls) = walls {
                admittance = climb(layers::walled(&basis, walls, depth, &admittance)?);
                admittance = climb(layers::narrowed(&basis, &high, medium(i + 1), &admittance));
                basis = high.clone();
            } else {
                admittance = climb(layers::uniform(&basis, *epsilon, depth, &admittance));
            }
        }
        let pedestal = k0 * pixel.slices.pedestal_um;
        if pedestal > 0.0 {
            admittance = climb(layers::uniform(&basis, lens, pedestal, &admittance));
        }
        for slice in (0..pixel.slices.count()).rev() {
            admittance = climb(pixel.slices.climb(&basis, slice, k0, &admittance));
        }
        Ok(Self {
            basis,
            admittance,
            passages,
            reflection,
            silicon,
            k0_per_um: k0,
            silicon_um: pixel.stack.silicon_um,
        })
    }

    /// Functions followed in silicon.
    pub fn functions(&self) -> usize {
        self.silicon.functions()
    }

    /// What becomes in the silicon of fields E in the air, a column each.
    pub fn absorb(&self, e: &Matrix) -> Vec<InSilicon> {
        let down = |e, passage: &Matrix| passage * e;
        let at_silicon = self.passages.iter().rev().fold(e.clone(), down);
        // E is that of both waves; the one that falls in is (1 + ρ)⁻¹ E.
        let falling = solve(&plus_one(self.reflection.clone()), &at_silicon);
        self.silicon
            .absorb(&falling, self.k0_per_um, self.silicon_um)
    }
}
