//! The grid of a pixel: z = 0 is the silicon's surface, x and y run from −pitch/2 (to 0 where a mirror halves the cell;
//! of a mosaic from −pitch, as its mirrors go through the centres of microlenses).
//!
//! Each flat layer is divided evenly into grid layers of the same optical thickness, so interfaces lie on planes of
//! tangential E and reflect what they should; silicon is fine and air coarse. Between the lens's corner and its apex,
//! and in the air above, the step is the resin's: a step that changes within one medium reflects. Each slab has lateral
//! differences of its own ([`super::dispersion`]).

use std::ops::Range;

use rustfft::num_complex::Complex64;

use super::dispersion::{Layers, between, stencil};
use super::error::within;
use super::{CpmlSettings, FdtdSettings, SolverError, Stencil, YeeGrid};
use crate::em::{Indices, PixelStack};
use crate::units::um_from_nm;

/// Layers thinner than this are left out: less than a thousandth of a wavelength.
const THINNEST_UM: f64 = 5e-4;
/// A lens whose sag is less than this part of a step is flat, at its mean height.
const FLAT: f64 = 0.2;

/// What fills a slab of the cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Filling {
    /// Silicon and trenches.
    Silicon,
    /// Flat layer of this number, with its walls if it has any.
    Layer(usize),
    /// The lens's material below its corners.
    Pedestal,
    /// Lens below, air above its surface.
    Lens,
    Air,
}

/// Grid layers `cells` filled alike and equally thick.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Slab {
    pub filling: Filling,
    pub cells: Range<usize>,
    pub layers: Layers,
}

/// The grid, what fills it, and the planes at which powers are taken.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mesh {
    pub grid: YeeGrid,
    pub slabs: Vec<Slab>,
    /// Which axes hold only the half from minus half the period to 0.
    pub mirrors: [bool; 2],
    /// Microlenses of the period along an axis.
    pub microlenses: usize,
    /// Plane at the bottom of the counted silicon.
    pub bottom: usize,
    /// Plane of the silicon's surface.
    pub surface: usize,
    /// Plane between lens and source.
    pub inlet: usize,
    /// Plane of the source.
    pub source: usize,
    /// Plane above the source.
    pub outlet: usize,
    pub cpml: CpmlSettings,
}

impl Mesh {
    /// The mesh for the shortest of the wavelengths. `mirrors`: which axes are halved.
    ///
    /// # Errors
    /// A wavelength out of range, or a material that does not know it.
    pub fn new(
        stack: &PixelStack,
        wavelengths_nm: &[f64],
        mirrors: [bool; 2],
        settings: &FdtdSettings,
    ) -> Result<Self, SolverError> {
        let shortest = wavelengths_nm.iter().copied().fold(f64::INFINITY, f64::min);
        within("wavelength_nm", shortest, 100.0, 10_000.0)?;
        let n = stack.indices(shortest)?;
        // Matter that absorbs strongly has its skin depth to be followed.
        let step = |n: Complex64| {
            um_from_nm(shortest) / ((n.re + 2.0 * n.im).max(1.0) * settings.cells_per_wavelength)
        };
        let ends = settings.absorbing_layers;

        let silicon = step(n.silicon);
        let counted = (stack.silicon_um / silicon).ceil().max(4.0) as usize;
        let dz = stack.silicon_um / counted as f64;
        let parts = [stack.subpixels.m(), stack.subpixels.n()];
        let microlenses = stack.microlenses_across();
        let of_microlens = parts.map(|m| cells_across(stack.pitch_um, m, settings.lateral_nm));
        let lateral_um = of_microlens.map(|n| stack.pitch_um / n as f64);
        let [nx, ny] = of_microlens.map(|n| n * microlenses);
        // Directions are made right in the middle of the band, if there is one.
        let longest = wavelengths_nm.iter().copied().fold(0.0, f64::max);
        let k0 = 1e3 * std::f64::consts::PI * (1.0 / shortest + 1.0 / longest);
        let stencils = |filling, dz_um| {
            let (media, wide) = lateral_media(stack, &n, filling);
            lateral_um.map(|d| stencil(&media, k0, dz_um, d, wide))
        };
        let mut build = Builder::new(&stencils, -stack.silicon_um - (ends + 2) as f64 * dz);
        build.even(Filling::Silicon, ends + 2, dz);
        let bottom = build.planes();
        build.even(Filling::Silicon, counted, dz);
        // The silicon's surface is at exactly 0, whatever the sums.
        build.snap(0.0);
        let surface = build.planes();
        for (i, layer) in stack.layers.iter().enumerate().rev() {
            let finest = in_layer(&n, i).into_iter().map(step);
            let finest = finest.fold(f64::INFINITY, f64::min);
            build.slab(Filling::Layer(i), layer.thickness_um, finest);
        }
        let air = build.lens(stack, step(n.lens), step(Complex64::ONE));
        let apex = build.planes();
        build.even(Filling::Air, 10 + ends, air);

        let halved = |n: usize, mirror| if mirror { n / 2 } else { n };
        let grid = YeeGrid::new(
            halved(nx, mirrors[0]),
            halved(ny, mirrors[1]),
            lateral_um[0],
            lateral_um[1],
            build.z_um,
        )?;
        let grid = with_stencils(grid, &build.slabs)?;
        let index = [n.silicon.re, 1.0];
        Ok(Self {
            grid,
            slabs: build.slabs,
            mirrors,
            microlenses,
            bottom,
            surface,
            inlet: apex + 3,
            source: apex + 6,
            outlet: apex + 8,
            cpml: CpmlSettings::new(ends, ends, index),
        })
    }

    /// Height of the lens's apex in µm: where the air begins.
    pub fn lens_apex_um(&self) -> f64 {
        let air = self.slabs.last().map_or(0, |s| s.cells.start);
        self.grid.z_um()[air]
    }

    /// dx, dy.
    pub fn lateral_um(&self) -> [f64; 2] {
        [self.grid.dx_um(), self.grid.dy_um()]
    }

    /// The air, with the source and what measures reflection.
    pub fn air(&self) -> &Layers {
        &self.slabs[self.slabs.len() - 1].layers
    }

    /// Place of E node (i, ...) along an axis, in the pixel's frame; `half` for nodes between the integer ones.
    pub fn across_um(&self, axis: usize, i: usize, half: bool) -> f64 {
        let d = self.lateral_um()[axis];
        (i as f64 + if half { 0.5 } else { 0.0 } - self.origin(axis)) * d
    }

    /// Cells from the grid's side to the centre of the first microlens: half a period to a mirror, half a pitch to a
    /// border.
    fn origin(&self, axis: usize) -> f64 {
        let n = [self.grid.nx(), self.grid.ny()][axis] as f64;
        if self.mirrors[axis] {
            n
        } else {
            0.5 * n / self.microlenses as f64
        }
    }
}

/// Even, and divisible by the parts, so that trenches' centres lie on nodes.
fn cells_across(pitch_um: f64, parts: usize, lateral_nm: f64) -> usize {
    let unit = if parts.is_multiple_of(2) {
        parts
    } else {
        2 * parts
    };
    ((pitch_um / um_from_nm(lateral_nm) - 1e-9).ceil() as usize)
        .max(8)
        .next_multiple_of(unit)
}

/// Indices in layer `i`: several where the filters of a mosaic share it.
fn in_layer(n: &Indices, i: usize) -> Vec<Complex64> {
    match &n.mosaic {
        Some(filters) if filters.layer == i => filters.distinct(),
        _ => vec![n.layers[i]],
    }
}

/// Real indices that the lateral differences of a slab are made for, and whether these may have far nodes.
fn lateral_media(stack: &PixelStack, n: &Indices, filling: Filling) -> (Vec<f64>, bool) {
    match filling {
        // Narrow without trenches, too: the sides of a photodiode are sides of cells.
        Filling::Silicon => (vec![n.silicon.re], false),
        Filling::Layer(i) => {
            let all = in_layer(n, i).into_iter().map(|n| n.re.max(1.0));
            (all.collect(), stack.walls_in(i).is_none())
        }
        Filling::Pedestal => (vec![n.lens.re], true),
        Filling::Lens => (vec![n.lens.re, 1.0], true),
        Filling::Air => (vec![1.0], false),
    }
}

/// The grid with the lateral differences of its slabs in the layers, and between them on the planes.
fn with_stencils(grid: YeeGrid, slabs: &[Slab]) -> Result<YeeGrid, SolverError> {
    let in_layers: Vec<&Layers> = slabs
        .iter()
        .flat_map(|s| std::iter::repeat_n(&s.layers, s.cells.len()))
        .collect();
    let last = in_layers.len() - 1;
    let on_planes =
        (0..=last + 1).map(|k| between(in_layers[k.saturating_sub(1)], in_layers[k.min(last)]));
    grid.with_stencils(
        on_planes.collect(),
        in_layers.iter().map(|l| l.stencils).collect(),
    )
}

/// Slabs from the bottom up.
struct Builder<'a> {
    stencils: &'a dyn Fn(Filling, f64) -> [Stencil; 2],
    z_um: Vec<f64>,
    slabs: Vec<Slab>,
}

impl<'a> Builder<'a> {
    fn new(stencils: &'a dyn Fn(Filling, f64) -> [Stencil; 2], bottom_um: f64) -> Self {
        Self {
            stencils,
            z_um: vec![bottom_um],
            slabs: Vec::new(),
        }
    }

    /// Number of the uppermost plane.
    fn planes(&self) -> usize {
        self.z_um.len() - 1
    }

    fn top(&self) -> f64 {
        self.z_um[self.planes()]
    }

    fn snap(&mut self, z_um: f64) {
        let top = self.planes();
        self.z_um[top] = z_um;
    }

    fn slab(&mut self, filling: Filling, thickness_um: f64, step_um: f64) {
        if thickness_um >= THINNEST_UM {
            let cells = (thickness_um / step_um).round().max(1.0);
            self.even(filling, cells as usize, thickness_um / cells);
        }
    }

    /// Pedestal and lens, by steps in the resin; the step of the air above.
    fn lens(&mut self, stack: &PixelStack, resin: f64, air: f64) -> f64 {
        let sag = stack.sag_um();
        if sag < FLAT * resin {
            self.slab(Filling::Pedestal, stack.mean_lens_height_um(), resin);
            return air;
        }
        self.slab(Filling::Pedestal, stack.lens.height_um - sag, resin);
        let cells = (sag / resin).round().max(1.0);
        self.even(Filling::Lens, cells as usize, sag / cells);
        sag / cells
    }

    fn even(&mut self, filling: Filling, cells: usize, step_um: f64) {
        let (start, below) = (self.planes(), self.top());
        for i in 1..=cells {
            self.z_um.push(below + i as f64 * step_um);
        }
        let cells = start..start + cells;
        let layers = Layers {
            dz_um: step_um,
            stencils: (self.stencils)(filling, step_um),
        };
        self.slabs.push(Slab {
            filling,
            cells,
            layers,
        });
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn interfaces_lie_on_planes_and_steps_are_of_equal_optical_thickness() {
        let stack = PixelStack::builtin("1.6um").unwrap();
        let settings = FdtdSettings::standard();
        let m = Mesh::new(&stack, &[550.0], [false, true], &settings).unwrap();
        let z = m.grid.z_um();
        // The lens's radius is half the diagonal to f64's round-off, of which the sag has the root.
        let near = |h: f64| z.iter().any(|z| (z - h).abs() < 1e-7);
        for h in [-4.0, 0.0, 0.65, 1.4, 1.9, 1.9 + stack.lens.height_um] {
            assert!(near(h), "{h}");
        }
        assert_eq!((z[m.bottom] + 4.0).abs() < 1e-12, z[m.surface] == 0.0);
        let oxide = m.grid.thickness_um(m.surface) * 1.46;
        let silicon = m.grid.thickness_um(m.surface - 1) * 4.077;
        assert!((oxide / silicon - 1.0).abs() < 0.05);
        assert_eq!(m.grid.nx(), 2 * m.grid.ny());
        assert!((m.across_um(0, m.grid.nx() / 2, false)).abs() < 1e-12);
        assert!((m.across_um(1, m.grid.ny(), false)).abs() < 1e-12);
    }

    #[test]
    fn layers_of_no_thickness_are_left_out() {
        let mut stack = PixelStack::builtin("1.6um").unwrap();
        for layer in &mut stack.layers {
            layer.thickness_um = 0.0;
        }
        let m = Mesh::new(&stack, &[550.0], [true, true], &FdtdSettings::draft()).unwrap();
        assert!(
            m.slabs
                .iter()
                .all(|s| !matches!(s.filling, Filling::Layer(_)))
        );
        assert_eq!(m.grid.nx(), m.grid.ny());
    }
}
