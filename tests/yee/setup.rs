//! Small grids and runs.

use std::sync::Arc;

use quadpixel::em::fdtd::{
    CpmlSettings, Lateral, MaterialMap, Medium, Member, Simulation, Source, Waveform, YeeGrid,
    stable_step_um,
};

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

/// Bloch sides of period `nx dx` with k∥ in 1/µm.
pub fn bloch(grid: &YeeGrid, k: [f64; 2]) -> [Lateral; 2] {
    [
        Lateral::Bloch {
            phase_rad: k[0] * grid.nx() as f64 * grid.dx_um(),
        },
        Lateral::Bloch {
            phase_rad: k[1] * grid.ny() as f64 * grid.dy_um(),
        },
    ]
}

/// A simulation at `courant` times the largest stable step.
pub fn simulation(
    grid: YeeGrid,
    map: MaterialMap,
    members: &[Member],
    source: Source,
    cpml: CpmlSettings,
    courant: f64,
) -> Simulation {
    let dt = courant * stable_step_um(&grid, &map).unwrap();
    Simulation::new(grid, Arc::new(map), members, source, cpml, dt).unwrap()
}

/// Vacuum everywhere.
pub fn vacuum(grid: &YeeGrid) -> MaterialMap {
    MaterialMap::layered(grid, vec![Medium::VACUUM], |_| 0).unwrap()
}
