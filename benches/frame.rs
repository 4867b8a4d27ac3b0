//! The paper's frame: 3400 × 3400 sub-pixels (1700 × 1700 microlenses), 32 rays a sub-pixel, of a flat chart, in classic and in
//! diffractive mode, with the table of the centred lens (2D lookup) and that of all lens shifts (4D), at three wavelengths (the paper: about 12 hours on 6 cores, diffractive about 20 % slower than classic).
//!
//! ```text
//! cargo bench --bench frame              a quarter of the side, the modes in turn, medians of three
//! cargo bench --bench frame -- --full    the whole frame
//! ```

#[path = "support/frame.rs"]
mod support;

use std::time::Instant;

use quadpixel::response::{
    GeometricResponse, Response, ResponseCache, ShiftedSettings, TableSettings,
};
use quadpixel::spectrum::ChannelWavelengths;
use support::{Frame, RAYS_PER_SUBPIXEL};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let full = std::env::args().any(|a| a == "--full");
    let side = if full { 1700 } else { 425 };
    let repeats = if full { 1 } else { 3 };
    let frame = Frame::new()?;
    let (stack, lens) = (&frame.stack, &frame.lens);
    let f_number = lens.paraxial(550.0)?.f_number;
    let classic = Response::Geometric(GeometricResponse::new(
        stack.subpixels,
        stack.pitch_um,
        stack.pitch_um * f_number,
    )?);
    let cached = ResponseCache::open(ResponseCache::default_dir()).get_or_build(
        stack,
        &TableSettings::wave_standard_for(stack),
        &|_, _| (),
    )?;
    let diffractive = Response::Table(cached.table);
    // Minutes the first time.
    let shifted = ResponseCache::open(ResponseCache::default_dir()).get_or_build_shifted(
        stack,
        &ShiftedSettings::wave_for(stack),
        &|_, _| (),
    )?;
    let shifted = Response::Table(shifted.table);
    let shot = |response: &Response| -> Result<(f64, u64, u64), Box<dyn std::error::Error>> {
        let began = Instant::now();
        let camera = frame.camera(side, response, ChannelWavelengths::default())?;
        let rendered = frame.shot(&camera);
        Ok((
            began.elapsed().as_secs_f64(),
            rendered.stats.rays,
            rendered.stats.lost.total(),
        ))
    };
    let (mut classic_s, mut diffractive_s, mut shifted_s) = (Vec::new(), Vec::new(), Vec::new());
    let mut rays = (0, 0);
    for _ in 0..repeats {
        let (s, n, lost) = shot(&classic)?;
        classic_s.push(s);
        rays = (n, lost);
        diffractive_s.push(shot(&diffractive)?.0);
        shifted_s.push(shot(&shifted)?.0);
    }
    let median = |v: &mut Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    let (c, d) = (median(&mut classic_s), median(&mut diffractive_s));
    let sub = 2 * side;
    println!(
        "frame {sub}×{sub} sub-pixels, {RAYS_PER_SUBPIXEL} rays a sub-pixel and wavelength, 3 wavelengths, {} threads",
        rayon::current_num_threads()
    );
    println!(
        "rays {} M, lost {:.1} %",
        rays.0 / 1_000_000,
        100.0 * rays.1 as f64 / rays.0 as f64
    );
    println!(
        "classic     {c:8.2} s  {:6.2} M rays/s",
        rays.0 as f64 / c * 1e-6
    );
    println!(
        "diffractive {d:8.2} s  {:6.2} M rays/s",
        rays.0 as f64 / d * 1e-6
    );
    let s = median(&mut shifted_s);
    println!(
        "all shifts  {s:8.2} s  {:6.2} M rays/s",
        rays.0 as f64 / s * 1e-6
    );
    println!("diffractive / classic {:.3}", d / c);
    println!(
        "4D lookup (all shifts) / 2D lookup (diffractive) {:.3}",
        s / d
    );
    if let Some(line) = peak_memory() {
        println!("peak memory {line}");
    }
    Ok(())
}

/// Peak resident memory of this process, where the system tells.
fn peak_memory() -> Option<String> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM"))?;
    Some(line.split_once(':')?.1.trim().to_string())
}
