//! The Yee grid of one period (K. S. Yee, IEEE Trans. Antennas Propag. 14, 302 (1966)): uniform in x and y, graded in
//! z.
//!
//! ```text
//!   z ▲                      Ex (i+½, j,   k  )     Hx (i,   j+½, k+½)
//!     │  y                   Ey (i,   j+½, k  )     Hy (i+½, j,   k+½)
//!     │ ╱                    Ez (i,   j,   k+½)     Hz (i+½, j+½, k  )
//!     └────▶ x
//! ```
//! Node (i, j, k) is at (i dx, j dy, z_um[k]); k grows towards the scene, light travels to −z. The planes k = 0 and k =
//! nz are perfect conductors behind the absorbing layers.

use super::SolverError;
use super::error::within;

/// A lateral derivative between nodes: near (f(½) − f(−½)) + far (f(3/2) − f(−3/2)), in 1/µm, f at so many steps from
/// its place. Its symbol is 2 near sin(kd/2) + 2 far sin(3kd/2) in place of k.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stencil {
    /// Weight of the two nodes beside the place.
    pub near: f64,
    /// Weight of the next two; 0: Yee's own difference.
    pub far: f64,
}

impl Stencil {
    /// Yee's: (f(½) − f(−½))/d.
    pub fn yee(step_um: f64) -> Self {
        Self {
            near: 1.0 / step_um,
            far: 0.0,
        }
    }

    /// K of a wave of wavenumber `k` in 1/µm on nodes `step_um` apart.
    pub fn symbol(&self, k: f64, step_um: f64) -> f64 {
        let half = 0.5 * k * step_um;
        2.0 * (self.near * half.sin() + self.far * (3.0 * half).sin())
    }

    /// The largest K of all waves, or a little more.
    pub fn largest(&self) -> f64 {
        2.0 * (self.near.abs() + self.far.abs())
    }
}

/// Cells and spacing.
#[derive(Clone, Debug, PartialEq)]
pub struct YeeGrid {
    nx: usize,
    ny: usize,
    dx_um: f64,
    dy_um: f64,
    z_um: Vec<f64>,
    /// Of Ex, Ey, Hz on plane k: along x, along y.
    on_planes: Vec<[Stencil; 2]>,
    /// Of Hx, Hy, Ez between the planes k and k + 1.
    in_layers: Vec<[Stencil; 2]>,
}

impl YeeGrid {
    /// `nx × ny` cells of `dx_um × dy_um`, and layers between the ascending planes `z_um`.
    ///
    /// # Errors
    /// Fewer than 1 × 1 × 4 cells, more than 4096 across or 65 536 high, and steps outside 1e-5 to 10 µm.
    pub fn new(
        nx: usize,
        ny: usize,
        dx_um: f64,
        dy_um: f64,
        z_um: Vec<f64>,
    ) -> Result<Self, SolverError> {
        for (field, n) in [("nx", nx), ("ny", ny)] {
            within(field, n as f64, 1.0, 4096.0)?;
        }
        within("nz", z_um.len().saturating_sub(1) as f64, 4.0, 65_536.0)?;
        within("dx_um", dx_um, 1e-5, 10.0)?;
        within("dy_um", dy_um, 1e-5, 10.0)?;
        for pair in z_um.windows(2) {
            within("step of z_um", pair[1] - pair[0], 1e-5, 10.0)?;
        }
        let yee = [Stencil::yee(dx_um), Stencil::yee(dy_um)];
        Ok(Self {
            nx,
            ny,
            dx_um,
            dy_um,
            on_planes: vec![yee; z_um.len()],
            in_layers: vec![yee; z_um.len() - 1],
            z_um,
        })
    }

    /// With these lateral derivatives (along x, along y) on each plane (nz + 1) and in each layer (nz) instead of
    /// Yee's. Fails for other numbers of them, for weights that are not finite, and for far nodes where there are fewer
    /// than 2 × 2 cells.
    pub fn with_stencils(
        self,
        on_planes: Vec<[Stencil; 2]>,
        in_layers: Vec<[Stencil; 2]>,
    ) -> Result<Self, SolverError> {
        let (planes, layers) = (self.nz() + 1, self.nz());
        within(
            "stencils on planes",
            on_planes.len() as f64,
            planes as f64,
            planes as f64,
        )?;
        within(
            "stencils in layers",
            in_layers.len() as f64,
            layers as f64,
            layers as f64,
        )?;
        let least = self.nx.min(self.ny) as f64;
        for s in on_planes.iter().chain(&in_layers).flatten() {
            within("near weight of a stencil", s.near, 1e-3, 1e6)?;
            within("far weight of a stencil", s.far, -1e6, 1e6)?;
            if s.far != 0.0 {
                within("cells under wide stencils", least, 2.0, 4096.0)?;
            }
        }
        Ok(Self {
            on_planes,
            in_layers,
            ..self
        })
    }

    /// Derivatives along x and y of Ex, Ey and Hz on plane k.
    pub fn on_plane(&self, k: usize) -> [Stencil; 2] {
        self.on_planes[k]
    }

    /// Derivatives along x and y of Hx, Hy and Ez between the planes k and k + 1.
    pub fn in_layer(&self, k: usize) -> [Stencil; 2] {
        self.in_layers[k]
    }

    /// Cells in x.
    pub fn nx(&self) -> usize {
        self.nx
    }

    /// Cells in y.
    pub fn ny(&self) -> usize {
        self.ny
    }

    /// Layers in z; there are `nz() + 1` planes.
    pub fn nz(&self) -> usize {
        self.z_um.len() - 1
    }

    /// Step in x in µm.
    pub fn dx_um(&self) -> f64 {
        self.dx_um
    }

    /// Step in y in µm.
    pub fn dy_um(&self) -> f64 {
        self.dy_um
    }

    /// The planes of tangential E, ascending, in µm.
    pub fn z_um(&self) -> &[f64] {
        &self.z_um
    }

    /// Thickness of layer k in µm: between the planes k and k+1.
    pub fn thickness_um(&self, k: usize) -> f64 {
        self.z_um[k + 1] - self.z_um[k]
    }

    /// Distance between the H nodes on both sides of plane k in µm; at the two outer planes half a layer.
    pub fn dual_um(&self, k: usize) -> f64 {
        let z = &self.z_um;
        0.5 * (z[(k + 1).min(self.nz())] - z[k.saturating_sub(1)])
    }

    /// Cells.
    pub fn cells(&self) -> usize {
        self.nx * self.ny * self.nz()
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn layers_of_no_thickness_and_empty_grids_are_refused() {
        let planes = vec![0.0, 0.1, 0.1, 0.2, 0.3];
        let e = YeeGrid::new(2, 2, 0.1, 0.1, planes).unwrap_err();
        assert!(e.to_string().contains("step of z_um is 0"), "{e}");
        assert!(YeeGrid::new(0, 2, 0.1, 0.1, vec![0.0, 1.0, 2.0, 3.0, 4.0]).is_err());
        assert!(YeeGrid::new(2, 2, f64::NAN, 0.1, vec![0.0, 1.0, 2.0, 3.0, 4.0]).is_err());
        assert!(YeeGrid::new(2, 2, 0.1, 0.1, vec![]).is_err());
    }

    #[test]
    fn dual_steps_join_the_middles_of_layers() {
        let g = YeeGrid::new(1, 1, 1.0, 1.0, vec![0.0, 1.0, 3.0, 6.0, 10.0]).unwrap();
        assert_eq!(g.dual_um(1), 1.5);
        assert_eq!(g.dual_um(0), 0.5);
        assert_eq!(g.dual_um(4), 2.0);
    }
}
