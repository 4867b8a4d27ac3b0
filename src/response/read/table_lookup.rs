//! A table at one wavelength: the planes that its lookups read.

use std::collections::BTreeMap;

use super::axes::Axes;
use super::{Interpolator, ShiftedInterpolator};
use crate::em::ShiftGrid;
use crate::em::symmetry::{Symmetry, symmetries_of};
use crate::response::AngularResponse;
use crate::sensor::Wandering;

impl AngularResponse {
    /// Bilinear lookup of the centred lens at `wavelength_nm`: linear between the two nearest wavelengths of the table,
    /// the end's own table beyond them.
    pub fn interpolator(&self, wavelength_nm: f64) -> Interpolator {
        let mut plane = self.blended(wavelength_nm, 0);
        self.meta().charge.share(self.meta().subpixels, &mut plane);
        self.bilinear(plane)
    }

    /// The lookup under any shift of the lens, at a wavelength as of [`Self::interpolator`]; `None` for a table of the
    /// centred lens.
    pub fn shifted_interpolator(&self, wavelength_nm: f64) -> Option<ShiftedInterpolator> {
        let grid = self.meta().shift_grid?;
        let symmetries = symmetries_of(self.meta().subpixels);
        let stored = self.stored_shifts(&grid, wavelength_nm);
        let (charge, subpixels) = (self.meta().charge, self.meta().subpixels);
        // Of a material without a number, of imported tables perhaps, all charge wanders equally far.
        let silicon = self.meta().pixel.silicon_at(wavelength_nm).ok();
        let wandering = silicon.map_or_else(Wandering::even, |silicon| {
            Wandering::new(charge.collected_at, &silicon)
        });
        Some(ShiftedInterpolator::new(
            subpixels,
            self.meta().frame,
            self.directions(),
            (&grid, &charge, &wandering),
            |node| {
                let mut plane = self.unfolded(&grid, &symmetries, &stored, node);
                charge.share(subpixels, &mut plane);
                plane
            },
        ))
    }

    /// Bilinear lookup of the light under the lens at one node of the shift grid, `[i, j]` from 0 to N − 1, before its
    /// charge wanders; `None` for a table of the centred lens or no such node.
    pub fn interpolator_at_shift(
        &self,
        node: [usize; 2],
        wavelength_nm: f64,
    ) -> Option<Interpolator> {
        let grid = self.meta().shift_grid?;
        if node.iter().any(|&i| i >= grid.per_pitch) {
            return None;
        }
        let symmetries = symmetries_of(self.meta().subpixels);
        let stored_node = grid.stands_for(&symmetries, node).0;
        let place = grid
            .stored(&symmetries)
            .iter()
            .position(|n| *n == stored_node)?;
        let stored = BTreeMap::from([(stored_node, self.blended(wavelength_nm, place))]);
        Some(self.bilinear(self.unfolded(&grid, &symmetries, &stored, node)))
    }

    fn directions(&self) -> Axes {
        let along = |axis: &[f64]| (axis.len(), axis[axis.len() - 1] as f32);
        Axes::new(along(&self.axes().u), along(&self.axes().v))
    }

    fn bilinear(&self, plane: Vec<f32>) -> Interpolator {
        Interpolator::new(
            self.meta().subpixels,
            self.meta().frame,
            self.directions(),
            plane,
        )
    }

    fn stored_shifts(
        &self,
        grid: &ShiftGrid,
        wavelength_nm: f64,
    ) -> BTreeMap<[usize; 2], Vec<f32>> {
        let nodes = grid.stored(&symmetries_of(self.meta().subpixels));
        let planes = nodes.into_iter().enumerate();
        planes
            .map(|(i, node)| (node, self.blended(wavelength_nm, i)))
            .collect()
    }

    /// The plane `[v][u][sub-pixel]` of any node of the grid, from the stored ones.
    fn unfolded(
        &self,
        grid: &ShiftGrid,
        symmetries: &[Symmetry],
        stored: &BTreeMap<[usize; 2], Vec<f32>>,
        node: [usize; 2],
    ) -> Vec<f32> {
        let (stored_node, symmetry) = grid.stands_for(symmetries, node);
        let source = &stored[&stored_node];
        let s = self.meta().subpixels;
        let (nu, nv) = (self.axes().u.len() as i64, self.axes().v.len() as i64);
        let mut plane = Vec::with_capacity(source.len());
        for iv in 0..nv {
            for iu in 0..nu {
                let (a, b) = symmetry.node((iu - nu / 2, iv - nv / 2));
                let at = ((b + nv / 2) * nu + a + nu / 2) as usize * s.count();
                plane.extend((0..s.count()).map(|i| source[at + symmetry.sub_pixel(s, i)]));
            }
        }
        plane
    }

    /// The plane of a stored shift at a wavelength.
    fn blended(&self, wavelength_nm: f64, shift: usize) -> Vec<f32> {
        let w = &self.axes().wavelengths_nm;
        let upper = w.partition_point(|&x| x < wavelength_nm);
        let (a, b) = (upper.saturating_sub(1), upper.min(w.len() - 1));
        let part = if a == b {
            0.0
        } else {
            ((wavelength_nm - w[a]) / (w[b] - w[a])) as f32
        };
        let low = &self.table()[self.plane(a, shift)];
        let high = &self.table()[self.plane(b, shift)];
        let both = low.iter().zip(high);
        both.map(|(&p, &q)| p * (1.0 - part) + q * part).collect()
    }
}
