//! The response: lookups a second on one core (the renderer's inner loop), and what the wave model costs a direction.

use std::hint::black_box;
use std::time::Instant;

use quadpixel::em::PixelStack;
use quadpixel::em::wave::{WaveModel, WaveSettings};
use quadpixel::response::{GeometricResponse, Response, ResponseError, TableSettings, build_table};
use quadpixel::sensor::Subpixels;

/// Best of several runs, in seconds.
fn best(runs: usize, mut work: impl FnMut()) -> f64 {
    (0..runs)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn main() -> Result<(), ResponseError> {
    let stack = PixelStack::builtin("1.6um")?;
    let table = build_table(&stack, &TableSettings::wave_draft(), None, &|_, _| {})?.table;
    let geometric = GeometricResponse::matched_to_f_number(Subpixels::QUAD, 1.6, 1.8)?;
    // Directions of an F/1.8 cone in scrambled order, in batches of 64 as a renderer has them.
    let rays = 1 << 16;
    let (u, v): (Vec<f32>, Vec<f32>) = (0..rays)
        .map(|i: usize| {
            let part = |k: usize| (i.wrapping_mul(k) % 65_536) as f32 / 65_536.0 - 0.5;
            (part(40_503) * 0.54, part(25_173) * 0.54)
        })
        .unzip();
    let mut out = vec![0.0; 64 * 4];
    for (name, response) in [
        ("table", Response::Table(table)),
        ("geometric", Response::Geometric(geometric)),
    ] {
        let lookup = response.at(550.0);
        let frame = lookup.frame();
        let mut sum = 0.0f32;
        let seconds = best(20, || {
            for (u, v) in u.chunks(64).zip(v.chunks(64)) {
                lookup.weights_batch(u, v, &mut out);
                sum += black_box(&out)[0];
            }
        });
        let moved = best(20, || {
            for (u, v) in u.chunks(64).zip(v.chunks(64)) {
                let (mut a, mut b) = ([0.0; 64], [0.0; 64]);
                a.copy_from_slice(u);
                b.copy_from_slice(v);
                frame.centred_batch([0.3, -0.1], &mut a, &mut b);
                lookup.weights_batch(&a, &b, &mut out);
                sum += black_box(&out)[0];
            }
        });
        black_box(sum);
        let rate = |s: f64| rays as f64 / s * 1e-6;
        println!(
            "lookup, {name}: {:.0} M directions/s, under a shifted lens {:.0}",
            rate(seconds),
            rate(moved)
        );
    }
    for name in ["1.6um", "2.8um"] {
        let stack = PixelStack::builtin(name)?;
        let settings = TableSettings::wave_standard_for(&stack);
        let start = Instant::now();
        black_box(build_table(&stack, &settings, None, &|_, _| {})?);
        println!(
            "table, {name}, one wavelength: {:.1} s on all cores",
            start.elapsed().as_secs_f64()
        );
    }
    for name in PixelStack::builtin_names() {
        let stack = PixelStack::builtin(name)?;
        if stack.metal.is_some() {
            continue; // The wave model refuses it.
        }
        for (preset, settings) in [
            ("draft", WaveSettings::draft()),
            ("standard", WaveSettings::standard()),
        ] {
            let model = WaveModel::new(&stack, 550.0, &settings)?;
            let mut outcome = Ok(());
            let seconds = best(3, || {
                for (u, v) in [(0.05, 0.0), (0.2, 0.1), (0.4, 0.3)] {
                    outcome = model.solve(u, v).map(|p| {
                        black_box(p);
                    });
                }
            });
            outcome?;
            println!(
                "wave, {name}, {preset}: {:.0} ms a direction",
                seconds / 3.0 * 1e3
            );
        }
    }
    Ok(())
}
