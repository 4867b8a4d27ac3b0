//! Small grids, sources and measurements.

use std::f64::consts::PI;
use std::sync::Arc;

use quadpixel::em::fdtd::{
    Component, CpmlSettings, Domain, Lateral, MaterialMap, Medium, Member, Part, Simulation,
    Source, Waveform, YeeGrid,
};
use rustfft::num_complex::Complex64;

/// Wavelength of the tests in µm, and its angular frequency.
pub const LAMBDA_UM: f64 = 0.55;
pub const OMEGA: f64 = 2.0 * PI / LAMBDA_UM;

/// Planes of equal step.
pub fn planes(nz: usize, step_um: f64) -> Vec<f64> {
    (0..=nz).map(|k| k as f64 * step_um).collect()
}

/// Numbers in [0, 1) that look random.
pub fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A smooth pulse around angular frequency `omega`.
pub fn pulse(omega: f64, width_um: f64) -> Waveform {
    Arc::new(move |t| {
        let s = (t - 4.0 * width_um) / width_um;
        (-0.5 * s * s).exp() * (omega * (t - 4.0 * width_um)).sin()
    })
}

/// A sine of angular frequency `omega` that rises over `ramp_um`.
pub fn ramped_sine(omega: f64, ramp_um: f64) -> Waveform {
    Arc::new(move |t| {
        let rise = 0.5 - 0.5 * (PI * (t / ramp_um).min(1.0)).cos();
        rise * (omega * t).sin()
    })
}

/// Bloch sides of one period with k∥ in 1/µm.
pub fn bloch(grid: &YeeGrid, k: [f64; 2]) -> [Lateral; 2] {
    let period = [
        grid.nx() as f64 * grid.dx_um(),
        grid.ny() as f64 * grid.dy_um(),
    ];
    [0, 1].map(|axis| Lateral::Bloch {
        phase_rad: k[axis] * period[axis],
    })
}

/// A single period across (one cell), driven at [`OMEGA`] by a sheet until it is steady.
pub struct Driven {
    pub simulation: Simulation,
    pub steps_per_cycle: usize,
}

impl Driven {
    /// `k` is k∥ in 1/µm, `current` the sheet's direction on plane `source`. The step is the largest stable one that
    /// divides the cycle.
    pub fn new(
        grid: YeeGrid,
        (media, layers): (Vec<Medium>, &dyn Fn(usize) -> u16),
        k: [f64; 2],
        current: [f64; 2],
        source: usize,
        cpml: CpmlSettings,
        cycles: usize,
    ) -> Self {
        let map = MaterialMap::layered(&grid, media, layers).unwrap();
        Self::with_map(grid, map, k, current, source, cpml, cycles)
    }

    /// As [`Self::new`] with any map.
    pub fn with_map(
        grid: YeeGrid,
        map: MaterialMap,
        k: [f64; 2],
        current: [f64; 2],
        source: usize,
        cpml: CpmlSettings,
        cycles: usize,
    ) -> Self {
        let largest = quadpixel::em::fdtd::stable_step_um(&grid, &map).unwrap();
        let steps_per_cycle = (LAMBDA_UM / largest).ceil() as usize;
        let [x, y] = bloch(&grid, k);
        let source = Source {
            plane: source,
            waveform: ramped_sine(OMEGA, 40.0 * LAMBDA_UM),
        };
        let mut simulation = Simulation::new(
            Domain {
                grid,
                map: Arc::new(map),
                cpml,
            },
            &[Member { x, y, current }],
            source,
            LAMBDA_UM / steps_per_cycle as f64,
        )
        .unwrap();
        simulation.advance(cycles * steps_per_cycle);
        Self {
            simulation,
            steps_per_cycle,
        }
    }

    /// Amplitudes (of e^(−iωt)) of a component at node (0, 0) of the given planes, over the next four cycles.
    pub fn amplitudes(&mut self, component: Component, planes: &[usize]) -> Vec<Complex64> {
        let samples = 4 * self.steps_per_cycle;
        let complex = self.simulation.members().next().unwrap().sets() == 2;
        let mut sums = vec![Complex64::default(); planes.len()];
        for _ in 0..samples {
            self.simulation.advance(1);
            let turn = Complex64::from_polar(1.0, OMEGA * self.simulation.time_um());
            for (sum, k) in sums.iter_mut().zip(planes) {
                let part =
                    |part| f64::from(self.simulation.row(0, part, component, 0, *k).unwrap()[0]);
                let im = if complex { part(Part::Im) } else { 0.0 };
                *sum += Complex64::new(part(Part::Re), im) * turn / samples as f64;
            }
        }
        sums
    }

    /// kz of the grid's own plane wave in a medium of (stepped) permittivity `epsilon` for layers of `dz_um`, in 1/µm:
    /// Yee's dispersion relation ε sin²(ω dt/2)/dt² = Σ sin²(k_i d_i/2)/d_i².
    pub fn kz(&self, k: [f64; 2], epsilon: f64, dz_um: f64) -> f64 {
        let grid = self.simulation.grid();
        let square = |k: f64, d: f64| (2.0 / d * (0.5 * k * d).sin()).powi(2);
        let left = epsilon * square(OMEGA, self.simulation.dt_um());
        let rest = left - square(k[0], grid.dx_um()) - square(k[1], grid.dy_um());
        2.0 / dz_um * (0.5 * dz_um * rest.sqrt()).asin()
    }
}

/// Amplitudes (up, down) at the first of two planes `dz_um` apart, from the field on both.
pub fn up_and_down(field: [Complex64; 2], kz: f64, dz_um: f64) -> [Complex64; 2] {
    let p = Complex64::from_polar(1.0, kz * dz_um);
    let up = (field[1] - field[0] / p) / (p - 1.0 / p);
    [up, field[0] - up]
}
