//! The pixel from its silicon up, for one k∥ and sector: the admittance that is seen from above, and the way back down.

use rustfft::num_complex::Complex32;

use super::basis::{Basis, Class, Lattice, Sector};
use super::grid::Grid;
use super::layers::{self, Climbed};
use super::lens::LensSlices;
use super::linear::{C, Matrix, plus_one, solve};
use super::silicon::{InSilicon, Silicon};
use super::uniform::Uniform;
use super::{RcwaSettings, SolverError};
use crate::em::Indices;
use crate::em::PixelStack;

/// A pixel at one wavelength.
pub(super) struct Pixel {
    pub stack: PixelStack,
    pub settings: RcwaSettings,
    pub indices: Indices,
    pub k0_per_um: f64,
    /// Of the reciprocal lattice of the period, in k0.
    pub step: f64,
    /// Largest transverse wavenumber followed in silicon, in k0.
    pub silicon_cutoff: f64,
    pub slices: LensSlices,
}

impl Pixel {
    /// ε of the lens.
    pub fn resin(&self) -> C {
        self.indices.lens * self.indices.lens
    }

    /// Silicon and its trenches.
    pub fn silicon(&self) -> Grid {
        let microlenses = self.stack.microlenses_across();
        let [m, n] = [self.stack.subpixels.m(), self.stack.subpixels.n()];
        Grid {
            parts: [(m * microlenses) as i32, (n * microlenses) as i32],
            wall: self.stack.trench_um / self.stack.period_um(),
            uncollected: self
                .stack
                .uncollected_um()
                .map(|w| w / self.stack.period_um()),
            of_pixel: [m, n].map(|count| count as i32),
            border: 0.5 / microlenses as f64,
            inside: self.indices.silicon * self.indices.silicon,
            outside: self.indices.trench * self.indices.trench,
        }
    }

    /// Layers of some thickness from the silicon up: ε, thickness in µm, and metal walls with the layer between them.
    pub fn layers(&self) -> Vec<(C, f64, Option<Grid>)> {
        let (n, metal) = (&self.indices, self.stack.metal.as_ref());
        let microlenses = self.stack.microlenses_across();
        let both = n.layers.iter().zip(&self.stack.layers).rev();
        both.filter(|(_, layer)| layer.thickness_um > 0.0)
            .map(|(n_layer, layer)| {
                let epsilon = n_layer * n_layer;
                let walls = metal.filter(|m| m.layer == layer.name).map(|m| Grid {
                    parts: [microlenses as i32; 2],
                    wall: m.width_um / self.stack.period_um(),
                    uncollected: [0.0; 2],
                    of_pixel: [1; 2],
                    border: 0.5 / microlenses as f64,
                    inside: epsilon,
                    outside: n.metal * n.metal,
                });
                (epsilon, layer.thickness_um, walls)
            })
            .collect()
    }
}

/// Silicon and layers above it, as seen from their top.
pub(super) struct Column {
    /// Functions at the top.
    pub basis: Basis,
    /// h of E at the top.
    pub admittance: Matrix,
    /// E at the bottom of E at the top of each layer, from the silicon up.
    passages: Vec<Matrix>,
    /// What the silicon reflects into the medium above it.
    reflection: Matrix,
    pub silicon: Silicon,
    k0_per_um: f64,
    silicon_um: f64,
}

impl Column {
    /// The whole pixel, up to the air.
    ///
    /// # Errors
    /// Modes that are not found.
    pub fn new(pixel: &Pixel, lattice: Lattice, sector: Sector) -> Result<Self, SolverError> {
        let mut column = Self::below_lens(pixel, lattice, sector)?;
        let k0 = pixel.k0_per_um;
        for slice in (0..pixel.slices.count()).rev() {
            column.climb(|basis, y| pixel.slices.climb(basis, slice, k0, y));
        }
        Ok(column)
    }

    /// All that no shift of the lens changes: silicon, layers, and resin that no lens reaches.
    ///
    /// # Errors
    /// Modes that are not found.
    pub fn below_lens(
        pixel: &Pixel,
        lattice: Lattice,
        sector: Sector,
    ) -> Result<Self, SolverError> {
        let mut column = Self::below(pixel, lattice, sector, pixel.layers().len())?;
        let pedestal = pixel.k0_per_um * pixel.slices.pedestal_um;
        if pedestal > 0.0 {
            column.climb(|basis, y| layers::uniform(basis, pixel.resin(), pedestal, y));
        }
        Ok(column)
    }

    /// Silicon and the first of the layers above it.
    ///
    /// # Errors
    /// Modes that are not found.
    pub fn below(
        pixel: &Pixel,
        lattice: Lattice,
        sector: Sector,
        first: usize,
    ) -> Result<Self, SolverError> {
        let (k0, settings) = (pixel.k0_per_um, &pixel.settings);
        let basis_up_to = |cutoff| Basis::new(lattice, sector, cutoff, Class::WHOLE);
        let high = basis_up_to(settings.lens_cutoff);
        let over = pixel.layers();
        // Up to the walls, if there are some, their many functions are followed.
        let low = match over.iter().any(|(.., walls)| walls.is_some()) {
            true => basis_up_to(settings.wall_cutoff.max(settings.lens_cutoff)),
            false => high.clone(),
        };
        let lens = pixel.resin();
        let medium = |i: usize| over.get(i).map_or(lens, |layer| layer.0);
        let silicon = Silicon::new(&low, pixel.silicon(), medium(0), pixel.silicon_cutoff)?;
        let reflection = silicon.reflection(low.len());
        let mut column = Self {
            admittance: layers::admittance(&Uniform::new(&low, medium(0)), &reflection),
            basis: low,
            passages: Vec::new(),
            reflection,
            silicon,
            k0_per_um: k0,
            silicon_um: pixel.stack.silicon_um,
        };
        for (i, (epsilon, thickness_um, walls)) in over.iter().take(first).enumerate() {
            let depth = k0 * thickness_um;
            if let Some(walls) = walls {
                let through = layers::walled(&column.basis, walls, depth, &column.admittance)?;
                column.climb(|_, _| through);
                column.climb(|low, y| layers::narrowed(low, &high, medium(i + 1), y));
                column.basis = high.clone();
            } else {
                column.climb(|basis, y| layers::uniform(basis, *epsilon, depth, y));
            }
        }
        Ok(column)
    }

    /// Adds a layer on top.
    pub fn climb(&mut self, layer: impl FnOnce(&Basis, &Matrix) -> Climbed) {
        let Climbed { above, passage } = layer(&self.basis, &self.admittance);
        self.admittance = above;
        self.passages.push(passage);
    }

    /// Functions followed in silicon.
    pub fn functions(&self) -> usize {
        self.silicon.functions()
    }

    /// What falls into the silicon of fields E at the top, a column each.
    pub fn falling(&self, e: &Matrix) -> Matrix {
        let down = |e, passage: &Matrix| passage * e;
        let at_silicon = self.passages.iter().rev().fold(e.clone(), down);
        // E is that of both waves; the one that falls in is (1 + ρ)⁻¹ E.
        solve(&plus_one(self.reflection.clone()), &at_silicon)
    }

    /// Fields in the photodiodes of fields E at the top, a column each: see [`Silicon::fields`].
    pub fn fields(&self, e: &Matrix) -> Vec<Vec<Complex32>> {
        let depth = self.k0_per_um * self.silicon_um;
        self.silicon.fields(&self.falling(e), depth)
    }

    /// What becomes in the silicon of fields E at the top, a column each.
    pub fn absorb(&self, e: &Matrix) -> Vec<InSilicon> {
        self.silicon
            .absorb(&self.falling(e), self.k0_per_um, self.silicon_um)
    }
}
