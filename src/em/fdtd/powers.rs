//! Powers from the phasors: fluxes through faces of boxes, and the absorption in them.
//!
//! With phasors of E and the grid's own H, the flux ½ Re(E × H*) through a plane of E nodes, H being the mean of both
//! sides, and the absorption ½ Ω Im ε |E|² of the nodes, those on faces by half, balance to round-off in a steady
//! state: what is left says how far the run is from it.

use std::ops::Range;

use rustfft::num_complex::Complex64;

use super::dispersion::Numerics;
use super::footprint::Footprint;
use super::mesh::Mesh;
use super::phasors::Phasors;
use super::raster::Raster;
use super::{Lateral, Stencil, Wall};

type C = Complex64;

/// Grid, phasors and sides of one member at one frequency.
pub(super) struct Fields<'a> {
    pub mesh: &'a Mesh,
    pub numerics: &'a Numerics,
    pub phasors: &'a Phasors,
    pub sides: [Lateral; 2],
}

/// What the nodes in and on the counted silicon absorb.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Absorbed {
    pub silicon: f64,
    pub trench: f64,
    /// The upper half of the nodes on the silicon's surface: absorption of the layer above.
    pub above: f64,
}

impl Absorbed {
    /// All of it: what enters through the faces of the box in a steady state.
    pub fn total(&self) -> f64 {
        self.silicon + self.trench + self.above
    }
}

/// Half weights at the ends of a range of nodes.
fn edge(i: usize, range: &Range<usize>) -> f64 {
    if i == range.start || i == range.end {
        0.5
    } else {
        1.0
    }
}

/// Where H is taken for a flux through a plane of E.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Above,
    Both,
}

impl Fields<'_> {
    fn over_omega(&self, curl: C) -> C {
        curl / C::new(0.0, self.numerics.leapfrog_omega())
    }

    /// E of a node up to two beyond the sides.
    fn e(&self, component: usize, node: [isize; 2], k: usize) -> C {
        let (mut place, mut factor) = (node, C::ONE);
        for (axis, place) in place.iter_mut().enumerate() {
            let n = self.cells(axis) as isize;
            let i = *place;
            match self.sides[axis] {
                Lateral::Bloch { phase_rad } if i < 0 || i > n => {
                    let periods = i.div_euclid(n);
                    *place = i - periods * n;
                    factor *= C::from_polar(1.0, periods as f64 * phase_rad);
                }
                Lateral::Mirror(wall) if i < 0 || i > n => {
                    *place = if i < 0 { -i } else { 2 * n - i };
                    factor *= if wall == Wall::Electric { -1.0 } else { 1.0 };
                }
                _ => (),
            }
        }
        let [i, j] = place.map(|i| i as usize);
        factor * self.phasors.e(component, i, j, k)
    }

    /// The stepper's derivative of a component of E along an axis, half a step beyond its node (i, j).
    fn along(&self, axis: usize, component: usize, node: [usize; 2], k: usize, by: Stencil) -> C {
        let value = |step: isize| {
            let mut at = node.map(|i| i as isize);
            at[axis] += step;
            self.e(component, at, k)
        };
        let near = by.near * (value(1) - value(0));
        if by.far == 0.0 {
            return near;
        }
        near + by.far * (value(2) - value(-1))
    }

    fn along_z(&self, component: usize, [i, j]: [usize; 2], k: usize) -> C {
        let p = self.phasors;
        (p.e(component, i, j, k + 1) - p.e(component, i, j, k)) / self.mesh.grid.thickness_um(k)
    }

    fn hx(&self, i: usize, j: usize, k: usize) -> C {
        let [_, y] = self.mesh.grid.in_layer(k);
        self.over_omega(self.along(1, 2, [i, j], k, y) - self.along_z(1, [i, j], k))
    }

    fn hy(&self, i: usize, j: usize, k: usize) -> C {
        let [x, _] = self.mesh.grid.in_layer(k);
        self.over_omega(self.along_z(0, [i, j], k) - self.along(0, 2, [i, j], k, x))
    }

    fn hz(&self, i: usize, j: usize, k: usize) -> C {
        let [x, y] = self.mesh.grid.on_plane(k);
        self.over_omega(self.along(0, 1, [i, j], k, x) - self.along(1, 0, [i, j], k, y))
    }

    /// Tangential H at Ex (Hy) or Ey (Hx) of plane k.
    pub fn h_on_plane(&self, axis: usize, [i, j, k]: [usize; 3], side: Side) -> C {
        let at = |k| {
            if axis == 0 {
                self.hy(i, j, k)
            } else {
                self.hx(i, j, k)
            }
        };
        match side {
            Side::Above => at(k),
            Side::Both => 0.5 * (at(k) + at(k - 1)),
        }
    }

    /// Flux through plane k, up.
    pub fn upward(&self, footprint: &Footprint, k: usize, side: Side) -> f64 {
        let mut sum = 0.0;
        for j in footprint.y.start..=footprint.y.end {
            for i in footprint.x.clone() {
                let h = self.h_on_plane(0, [i, j, k], side);
                sum += edge(j, &footprint.y) * (self.phasors.e(0, i, j, k) * h.conj()).re;
            }
        }
        for j in footprint.y.clone() {
            for i in footprint.x.start..=footprint.x.end {
                let h = self.h_on_plane(1, [i, j, k], side);
                sum -= edge(i, &footprint.x) * (self.phasors.e(1, i, j, k) * h.conj()).re;
            }
        }
        0.5 * sum * self.mesh.grid.dx_um() * self.mesh.grid.dy_um() * footprint.times
    }

    /// Flux through the plane x = node `i` (axis 0) or y = node `i` (axis 1) of a box between the planes `z`, towards
    /// larger x or y.
    fn sideward(&self, axis: usize, i: usize, across: &Range<usize>, z: &Range<usize>) -> f64 {
        if self.mesh.mirrors[axis] && (i == 0 || i == self.cells(axis)) {
            return 0.0;
        }
        let g = &self.mesh.grid;
        let (step, own) = if axis == 0 {
            (g.dy_um(), g.dx_um())
        } else {
            (g.dx_um(), g.dy_um())
        };
        // What the stepper takes for the area of a side: its difference is near × own of Yee's. In silicon there are no
        // far nodes.
        let mut sum = 0.0;
        for k in z.start..=z.end {
            // The box ends at the H nodes above the surface (Side::Above), so the surface's nodes are in it whole.
            let height = if k == z.end {
                g.dual_um(k)
            } else {
                self.height(k, z)
            };
            let height = height * g.on_plane(k)[axis].near * own;
            for j in across.clone() {
                // E along the face in the plane, with Hz.
                let (e, sign) = if axis == 0 {
                    (self.phasors.e(1, i, j, k), 1.0)
                } else {
                    (self.phasors.e(0, j, i, k), -1.0)
                };
                sum += sign * height * (e * self.h_beside(axis, i, j, k, true).conj()).re;
            }
        }
        for k in z.clone() {
            let height = g.thickness_um(k) * g.in_layer(k)[axis].near * own;
            for j in across.start..=across.end {
                let (e, sign) = if axis == 0 {
                    (self.phasors.e(2, i, j, k), -1.0)
                } else {
                    (self.phasors.e(2, j, i, k), 1.0)
                };
                let weight = height * edge(j, across);
                sum += sign * weight * (e * self.h_beside(axis, i, j, k, false).conj()).re;
            }
        }
        0.5 * sum * step
    }

    fn cells(&self, axis: usize) -> usize {
        if axis == 0 {
            self.mesh.grid.nx()
        } else {
            self.mesh.grid.ny()
        }
    }

    /// Mean of the H on both sides of node `i` of an axis: Hz, or the one along the other axis.
    fn h_beside(&self, axis: usize, i: usize, j: usize, k: usize, vertical: bool) -> C {
        let h = |i: usize| match (axis, vertical) {
            (0, true) => self.hz(i, j, k),
            (0, false) => self.hy(i, j, k),
            (_, true) => self.hz(j, i, k),
            (_, false) => self.hx(j, i, k),
        };
        let n = self.cells(axis);
        let turn = match self.sides[axis] {
            Lateral::Bloch { phase_rad } => C::from_polar(1.0, phase_rad),
            Lateral::Mirror(_) => C::ONE,
        };
        let before = if i == 0 {
            h(n - 1) * turn.conj()
        } else {
            h(i - 1)
        };
        let after = if i == n { h(0) * turn } else { h(i) };
        0.5 * (before + after)
    }

    /// Height that plane k stands for in a box.
    fn height(&self, k: usize, z: &Range<usize>) -> f64 {
        let g = &self.mesh.grid;
        if k == z.start {
            0.5 * g.thickness_um(k)
        } else if k == z.end {
            0.5 * g.thickness_um(k - 1)
        } else {
            g.dual_um(k)
        }
    }

    /// Power absorbed in the nodes of the counted silicon of a footprint.
    pub fn absorbed(&self, footprint: &Footprint, raster: &Raster, loss: &[f64]) -> Absorbed {
        let g = &self.mesh.grid;
        let z = self.mesh.bottom..self.mesh.surface;
        let mut sum = Absorbed::default();
        for k in z.start..=z.end {
            let on_surface = k == z.end;
            // What the node on the surface absorbs, the matter below it does: the raster knows which part.
            let tangential = if on_surface {
                g.dual_um(k)
            } else {
                self.height(k, &z)
            };
            for axis in 0..3 {
                if axis == 2 && on_surface {
                    continue;
                }
                let height = if axis == 2 {
                    g.thickness_um(k)
                } else {
                    tangential
                };
                let share = if on_surface {
                    &raster.surface_share[axis]
                } else {
                    &raster.silicon_share[axis]
                };
                let rows = if axis == 1 {
                    footprint.y.start..=footprint.y.end - 1
                } else {
                    footprint.y.start..=footprint.y.end
                };
                for j in rows {
                    let columns = if axis == 0 {
                        footprint.x.start..=footprint.x.end - 1
                    } else {
                        footprint.x.start..=footprint.x.end
                    };
                    for i in columns {
                        let wx = if axis == 0 {
                            1.0
                        } else {
                            edge(i, &footprint.x)
                        };
                        let wy = if axis == 1 {
                            1.0
                        } else {
                            edge(j, &footprint.y)
                        };
                        let power = loss[raster.map.at(axis, i, j, k)]
                            * wx
                            * wy
                            * height
                            * self.phasors.e(axis, i, j, k).norm_sqr();
                        let part = share[j * (g.nx() + 1) + i];
                        sum.silicon += part * power;
                        // On the surface the rest belongs to the layer above.
                        let rest = if on_surface {
                            &mut sum.above
                        } else {
                            &mut sum.trench
                        };
                        *rest += (1.0 - part) * power;
                    }
                }
            }
        }
        let unit = 0.5 * self.numerics.leapfrog_omega() * g.dx_um() * g.dy_um() * footprint.times;
        Absorbed {
            silicon: sum.silicon * unit,
            trench: sum.trench * unit,
            above: sum.above * unit,
        }
    }

    /// Power that enters the counted silicon of a footprint through its six faces.
    pub fn entering(&self, footprint: &Footprint) -> f64 {
        let z = self.mesh.bottom..self.mesh.surface;
        let down = self.upward(footprint, z.start, Side::Both)
            - self.upward(footprint, z.end, Side::Above);
        let x = self.sideward(0, footprint.x.start, &footprint.y, &z)
            - self.sideward(0, footprint.x.end, &footprint.y, &z);
        let y = self.sideward(1, footprint.y.start, &footprint.x, &z)
            - self.sideward(1, footprint.y.end, &footprint.x, &z);
        // A side face of a box that straddles a mirror is there twice, as is the box.
        down + footprint.times * (x + y)
    }
}
