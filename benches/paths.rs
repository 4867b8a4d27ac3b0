//! Path tracing on a room of 250,000 triangles: paths a second on one core, and noise against time.
//!
//! ```text
//! cargo bench --bench paths
//! ```
//!
//! The scene is drawn up in `support/room.rs`; `tests/peers/mitsuba_speed.py` times Mitsuba 3 on it. Paths end after 5 segments (Mitsuba's
//! `max_depth = 5`), without Russian roulette.

#[path = "support/room.rs"]
mod room;

use std::time::Instant;

use glam::DVec3;
use quadpixel::sampling::uniform;
use quadpixel::scene::world::{CameraRay, PathKey, PathSettings, World};

const SIDE_PX: usize = 256;
/// Tangent of half the horizontal angle of view.
const HALF_WIDTH: f64 = 0.5;
/// Five segments from the camera: the last scattering is the fourth.
const SETTINGS: PathSettings = PathSettings {
    max_bounces: 4,
    roulette_after: u32::MAX,
    clamp: None,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let began = Instant::now();
    let world = World::new(room::room())?;
    println!(
        "{} triangles, prepared in {:.2} s",
        world.triangles(),
        began.elapsed().as_secs_f64()
    );

    let mut speeds: Vec<f64> = (0..5)
        .map(|round| {
            let began = Clock::now();
            let image = shoot(&world, 4, round);
            std::hint::black_box(&image);
            (4 * SIDE_PX * SIDE_PX) as f64 / began.seconds() * 1e-6
        })
        .collect();
    speeds.sort_by(f64::total_cmp);
    println!(
        "one thread: {:.3} M paths/s (median of 5; {:.3} to {:.3}), mean radiance {:.4}",
        speeds[2],
        speeds[0],
        speeds[4],
        mean(&shoot(&world, 4, 0))
    );

    println!("samples a pixel, seconds, RMS error over mean (two halves' difference / 2)");
    for samples in [1, 4, 16, 64] {
        let began = Clock::now();
        let (a, b) = (shoot(&world, samples, 100), shoot(&world, samples, 101));
        let seconds = began.seconds() / 2.0;
        let squares = a.iter().zip(&b).map(|(x, y)| f64::from((x - y).powi(2)));
        let rms = (squares.sum::<f64>() / a.len() as f64 / 2.0).sqrt() / mean(&a);
        println!("{samples:4}  {seconds:8.2}  {rms:.4}");
    }
    Ok(())
}

/// Time on the processor of this thread where the system tells (other programs do not count), else time by the clock.
struct Clock(Instant, Option<f64>);

impl Clock {
    fn now() -> Self {
        Self(Instant::now(), Self::on_processor())
    }

    fn on_processor() -> Option<f64> {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
        Some(nanoseconds * 1e-9)
    }

    fn seconds(&self) -> f64 {
        match (self.1, Self::on_processor()) {
            (Some(began), Some(now)) => now - began,
            _ => self.0.elapsed().as_secs_f64(),
        }
    }
}

fn mean(image: &[f32]) -> f64 {
    image.iter().map(|x| f64::from(*x)).sum::<f64>() / image.len() as f64
}

/// A pinhole picture at the origin towards −z, RGB, on this thread.
fn shoot(world: &World, samples: u32, seed: u64) -> Vec<f32> {
    let mut image = vec![0.0; SIDE_PX * SIDE_PX * 3];
    let mut rays = Vec::with_capacity(SIDE_PX * samples as usize);
    for (row, out) in image.chunks_exact_mut(SIDE_PX * 3).enumerate() {
        rays.clear();
        for column in 0..SIDE_PX {
            let key = seed << 32 | (row * SIDE_PX + column) as u64;
            rays.extend((0..samples).map(|sample| {
                let jitter = |d| uniform(key, &[u64::from(sample), d]);
                let place = |p: usize, d| {
                    ((p as f64 + jitter(d)) / SIDE_PX as f64 * 2.0 - 1.0) * HALF_WIDTH
                };
                CameraRay {
                    origin_mm: DVec3::ZERO,
                    direction: DVec3::new(place(column, 0), -place(row, 1), -1.0).normalize(),
                    key: PathKey {
                        key,
                        first: sample,
                        spread: 1e-3,
                    },
                }
            }));
        }
        world.radiances(&rays, &SETTINGS, |number, l| {
            let pixel = &mut out[number / samples as usize * 3..][..3];
            pixel
                .iter_mut()
                .zip(l)
                .for_each(|(s, l)| *s += l / samples as f32);
        });
    }
    image
}
