//! Cell updates a second on one core.
use quadpixel::em::fdtd::*;
use quadpixel::simd::SimdLevel;
use std::sync::Arc;

/// Seconds this thread ran: other processes do not count.
fn cpu() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    text.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
}

fn main() {
    for (nx, nz) in [(62, 300), (64, 300), (126, 300)] {
        for phase in [0.0, 1.0] {
            for level in SimdLevel::ALL {
                let z: Vec<f64> = (0..=nz).map(|k| k as f64 * 0.02).collect();
                let grid = YeeGrid::new(nx, nx, 0.025, 0.025, z).unwrap();
                let media = vec![
                    Medium::VACUUM,
                    Medium::new(2.1, 0.0, vec![]).unwrap(),
                    Medium::new(16.0, 2.0, vec![]).unwrap(),
                ];
                let w = nx + 1;
                let map: Vec<u16> = (0..w * w * (nz + 1))
                    .map(|n| {
                        let (i, j, k) = (n % w, n / w % w, n / w / w);
                        if k > 200 {
                            0
                        } else if i % 31 < 3 || j % 31 < 3 {
                            1
                        } else {
                            2
                        }
                    })
                    .collect();
                let map = MaterialMap::new(&grid, media, map.clone(), map.clone(), map).unwrap();
                let dt = stable_step_um(&grid, &map).unwrap();
                let source = Source {
                    plane: 270,
                    waveform: Arc::new(|t| (11.0 * t).sin()),
                };
                let side = Lateral::Bloch { phase_rad: phase };
                let member = Member {
                    x: side,
                    y: Lateral::Bloch { phase_rad: 0.0 },
                    current: [1.0, 0.0],
                };
                let mut s = Simulation::new(
                    grid,
                    Arc::new(map),
                    &[member],
                    source,
                    CpmlSettings::new(20, 20, [4.0, 1.0]),
                    dt,
                )
                .unwrap();
                s.advance_at(40, level);
                let mut best = f64::INFINITY;
                for _ in 0..5 {
                    let t = cpu();
                    s.advance_at(20, level);
                    best = best.min(cpu() - t);
                }
                println!(
                    "{nx} {phase} {level:?} {:.1} M cells/s",
                    (nx * nx * nz * 20) as f64 / best * 1e-6
                );
            }
        }
    }
}
