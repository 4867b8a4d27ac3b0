//! A mosaic of colour filters: the lens above them repeats with every microlens and couples only orders of one of four
//! classes, the silicon below only those of a sub-pixel's; the filters couple all.
//!
//! ```text
//!   order 0 in air              from above, class by class: h = s − U E    lighting.rs
//!   lens, layers above filters
//!   ═══ filters ══════════════  (Y + U) E = s, modes of the whole          checker.rs
//!   layers, silicon             from below: h = Y E                        column.rs
//! ```
//! Of the work, lens and silicon are four times a single microlens's; what is done for the whole takes the cube of four
//! times the orders, but only a few times: for the filters, the layers below them, and to join both.

use super::SolverError;
use super::basis::{Basis, Class, Lattice, Sector};
use super::checker::Checker;
use super::column::{Column, Pixel};
use super::layers;
use super::lighting::{Lighting, Sunk, sink};
use super::linear::{C, Matrix, flux, solve};
use super::powers::{order_zero, powers};
use super::uniform::Uniform;
use crate::em::light::Powers;

/// The light of one class from the air down to the filters.
struct Falling {
    basis: Basis,
    incident: Matrix,
    /// Where its functions stand among all.
    places: Vec<usize>,
    below: Lighting,
    /// E at the top of E at the bottom of each layer, from the air down: passage, and what the source adds.
    passages: Vec<(Matrix, Matrix)>,
}

impl Falling {
    fn new(pixel: &Pixel, whole: &Basis, class: Class, waves: &[[f64; 2]], filter: usize) -> Self {
        let basis = Basis::new(whole.lattice, whole.sector, whole.cutoff, class);
        let incident = order_zero(&basis, waves);
        let mut light = Self {
            places: basis.places_in(whole).into_iter().flatten().collect(),
            below: Lighting::air(&basis, &incident),
            passages: Vec::new(),
            incident,
            basis,
        };
        let k0 = pixel.k0_per_um;
        for slice in 0..pixel.slices.count() {
            light.sink(|basis, above| pixel.slices.sink(basis, slice, k0, above));
        }
        let lens = pixel.indices.lens * pixel.indices.lens;
        let over = pixel.layers().into_iter().skip(filter + 1).rev();
        let flat = over.map(|(epsilon, thickness_um, _)| (epsilon, thickness_um));
        for (epsilon, thickness_um) in [(lens, pixel.slices.pedestal_um)].into_iter().chain(flat) {
            if thickness_um > 0.0 {
                light.sink(|basis, above| sink(basis, epsilon, k0 * thickness_um, above));
            }
        }
        light
    }

    fn sink(&mut self, layer: impl FnOnce(&Basis, &Lighting) -> Sunk) {
        let sunk = layer(&self.basis, &self.below);
        self.below = sunk.below;
        self.passages.push((sunk.passage, sunk.driven));
    }

    /// Fluxes into the lens and back into the air, of column `j` of E of all classes on the filters.
    fn fluxes(&self, whole: &Matrix, j: usize) -> [f64; 2] {
        let n = self.places.len();
        let lowest = Matrix::from_fn(n, whole.ncols(), |i, j| whole[(self.places[i], j)]);
        let up = |e: Matrix, (passage, driven): &(Matrix, Matrix)| passage * e + driven;
        let e = self.passages.iter().rev().fold(lowest, up);
        let air = Uniform::new(&self.basis, C::ONE);
        let back = &e - &self.incident;
        let h_back = air.times(&back);
        let h = air.times(&self.incident) - &h_back;
        [
            flux(e.as_ref(), h.as_ref(), j),
            flux(back.as_ref(), h_back.as_ref(), j),
        ]
    }
}

/// Powers of incident waves (E_x, E_y of order 0) of a sector, and the functions followed in silicon.
pub(super) fn light<const N: usize>(
    pixel: &Pixel,
    lattice: Lattice,
    sector: Sector,
    waves: [[f64; 2]; N],
    filters: [C; 4],
) -> Result<([Powers; N], usize), SolverError> {
    let filter = filter_place(pixel);
    let mut column = Column::below(pixel, lattice, sector, filter)?;
    let modes = Checker(filters.map(|n| n * n)).modes(&column.basis)?;
    let depth = pixel.k0_per_um * pixel.layers()[filter].1;
    column.climb(|_, below| layers::patterned(&modes, depth, below));

    let whole = &column.basis;
    let classes: Vec<Falling> = Class::all([2, 2], sector)
        .into_iter()
        .map(|class| Falling::new(pixel, whole, class, &waves, filter))
        .collect();
    let mut joined = column.admittance.clone();
    let mut source = Matrix::zeros(whole.len(), N);
    for class in &classes {
        for (i, row) in class.places.iter().enumerate() {
            for (j, to) in class.places.iter().enumerate() {
                joined[(*row, *to)] += class.below.admittance[(i, j)];
            }
            for j in 0..N {
                source[(*row, j)] = class.below.source[(i, j)];
            }
        }
    }
    let e = solve(&joined, &source);
    let inside = column.absorb(&e);
    let incident = order_zero(whole, &waves);
    let h_incident = Uniform::new(whole, C::ONE).times(&incident);
    let all: [Powers; N] = std::array::from_fn(|j| {
        let inside = &inside[j];
        let unit = 1.0 / flux(incident.as_ref(), h_incident.as_ref(), j);
        let [mut entering, mut reflected] = [0.0; 2];
        for class in &classes {
            let [down, up] = class.fluxes(&e, j);
            (entering, reflected) = (entering + down, reflected + up);
        }
        let mut powers = powers(inside, entering, reflected, unit);
        powers.absorbed = by_microlens(pixel, &powers.absorbed);
        powers
    });
    Ok((all, column.functions()))
}

/// Place of the filters among the layers of some thickness, from the silicon up.
fn filter_place(pixel: &Pixel) -> usize {
    let first = pixel.stack.filter_layer().map_or(0, |(i, _)| i + 1);
    let below = pixel.stack.layers.iter().skip(first);
    below.filter(|l| l.thickness_um > 0.0).count()
}

/// From rows of photodiodes over the supercell to microlens by microlens.
fn by_microlens(pixel: &Pixel, by_rows: &[f64]) -> Vec<f64> {
    let stack = &pixel.stack;
    let columns = stack.subpixels.m() * stack.microlenses_across();
    let place = |i| stack.photodiode_column_row(i);
    (0..stack.photodiodes())
        .map(|i| by_rows[place(i).1 * columns + place(i).0])
        .collect()
}
