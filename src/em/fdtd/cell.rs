//! What the slabs of a pixel are made of, node by node.

use rustfft::num_complex::Complex64;

use super::fills::{Fills, Pattern, Spectrum, smooth};
use super::mesh::{Filling, Mesh, Slab};
use super::palette::Spectra;
use crate::em::mosaic::MICROLENSES;
use crate::em::{Indices, PixelStack};

type C = Complex64;

/// Columns of a voxel across which the lens surface is sampled, per axis.
const SAMPLES: usize = 4;
/// What one slab is made of.
pub(super) struct Cell {
    base: Spectrum,
    inset: Inset,
    air: Spectrum,
    /// Whether charge is lost between photodiodes.
    isolated: bool,
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
    pub fn new(stack: &PixelStack, slab: &Slab, spectra: &Spectra) -> Self {
        let layers = &slab.layers;
        let spectrum = |index: &dyn Fn(&Indices) -> C| spectra.corrected(layers, index);
        let air = spectrum(&|_| C::ONE);
        let (base, inset) = match slab.filling {
            Filling::Silicon if stack.trench_um > 0.0 => (
                spectrum(&|n| n.silicon),
                Inset::Bands(spectrum(&|n| n.trench), Pattern::Trenches),
            ),
            Filling::Silicon => (spectrum(&|n| n.silicon), Inset::Nothing),
            Filling::Layer(i) => (spectrum(&|n| n.layers[i]), in_layer(stack, i, &spectrum)),
            Filling::Pedestal | Filling::Lens => (spectrum(&|n| n.lens), Inset::Nothing),
            Filling::Air => (air.clone(), Inset::Nothing),
        };
        Self {
            base,
            inset,
            air,
            isolated: stack.is_isolated(),
        }
    }

    pub fn pattern(&self) -> Option<Pattern> {
        match &self.inset {
            Inset::Nothing => None,
            Inset::Bands(_, pattern) => Some(*pattern),
            Inset::Filters(_) => Some(Pattern::Microlenses),
        }
    }

    /// ε of a node, the slab being alike at every height.
    pub fn flat(&self, component: usize, fills: &Fills, at: usize) -> Spectrum {
        match &self.inset {
            Inset::Nothing => self.base.clone(),
            Inset::Filters(filters) => fills.mixed(filters, component, at),
            Inset::Bands(inset, pattern) => {
                let (fill, along) = fills.at(*pattern, component, at);
                inset
                    .iter()
                    .zip(&self.base)
                    .map(|(a, b)| smooth(*a, *b, fill, along))
                    .collect()
            }
        }
    }

    /// Part of the absorption of a silicon node that is a photodiode's.
    pub fn share(&self, fills: &Fills, component: usize, at: usize) -> f64 {
        let silicon = self.silicon_share(fills, component, at);
        if !self.isolated || silicon == 0.0 {
            return silicon;
        }
        // Of the voxel's silicon what no isolation takes.
        let fill = |pattern| fills.at(pattern, component, at).0;
        silicon * (1.0 - fill(Pattern::Isolation)) / (1.0 - fill(Pattern::Trenches))
    }

    fn silicon_share(&self, fills: &Fills, component: usize, at: usize) -> f64 {
        let Inset::Bands(inset, pattern) = &self.inset else {
            return 1.0;
        };
        let (fill, _) = fills.at(*pattern, component, at);
        let (trench, silicon) = (fill * inset[0].im, (1.0 - fill) * self.base[0].im);
        if trench > 0.0 {
            silicon / (silicon + trench)
        } else {
            1.0
        }
    }

    /// ε of a node whose voxel reaches over the heights `z_um` of the lens.
    pub fn lens(
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

/// What layer `i` holds; `spectrum` makes spectra for it.
fn in_layer(stack: &PixelStack, i: usize, spectrum: &dyn Fn(IndexOf) -> Spectrum) -> Inset {
    if stack.walls_in(i).is_some() {
        return Inset::Bands(spectrum(&|n| n.metal), Pattern::Walls);
    }
    let mosaic = stack.mosaic.as_ref().and(stack.filter_layer());
    if mosaic.is_none_or(|(filter, _)| filter != i) {
        return Inset::Nothing;
    }
    // A stack with a mosaic has its indices.
    let filter = |n: &Indices, microlens: usize| n.mosaic.map_or(n.layers[i], |m| m.n[microlens]);
    Inset::Filters([0, 1, 2, 3].map(|microlens| spectrum(&|n| filter(n, microlens))))
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
