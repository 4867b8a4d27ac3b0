//! What bands of wavelengths and lookups under all lens shifts cost: processor seconds of a reduced frame against 2D monochrome, the modes in
//! turn in one run; and what few wavelengths leave out.
//!
//! ```text
//! cargo bench --bench spectral                 cost: medians of the ratios of five rounds
//! cargo bench --bench spectral -- --accuracy   views of a white wall by M wavelengths against 16
//! ```
//!
//! Cost needs tables of the size that `qpgen` makes, not their values: one wavelength's table serves as all of them, under all shifts.

#[path = "support/frame.rs"]
mod support;

use std::error::Error;
use std::time::Instant;

use quadpixel::render::truth::WhiteField;
use quadpixel::response::{
    AngularResponse, MovingFrame, Response, ResponseAxes, ResponseCache, ResponseMeta, ShiftGrid,
    ShiftedSettings, TableSettings,
};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::{Bands, ChannelWavelengths};
use support::Frame;

const SIDE: usize = 96;
const ROUNDS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let frame = Frame::new()?;
    if std::env::args().any(|a| a == "--accuracy") {
        accuracy(&frame)
    } else {
        cost(&frame)
    }
}

fn bands(wavelengths: usize) -> Result<ChannelWavelengths, Box<dyn Error>> {
    Ok(ChannelWavelengths::of_bands(Bands {
        wavelengths,
        ..Bands::default()
    })?)
}

/// A made-up table on the directions of `settings`, at `wavelengths_nm`, of the centred lens or of all shifts.
fn table(
    frame: &Frame,
    settings: &TableSettings,
    wavelengths_nm: Vec<f64>,
    shifts: Option<ShiftGrid>,
) -> Result<Response, Box<dyn Error>> {
    let stack = &frame.stack;
    let half = (settings.steps * settings.refine) as i32;
    let axis: Vec<f64> = (-half..=half)
        .map(|i| settings.cosine_max * f64::from(i) / f64::from(half))
        .collect();
    let side = |c: f64| 1.0 / (1.0 + (-8.0 * c).exp());
    let mut plane = Vec::new();
    for &v in &axis {
        for &u in &axis {
            let share = |i: usize| {
                let (x, y) = stack.subpixels.centre(i);
                0.8 * side(u * x.signum()) * side(v * y.signum())
            };
            plane.extend((0..stack.subpixels.count()).map(|i| share(i) as f32));
        }
    }
    let shifts_um = match &shifts {
        None => vec![[0.0, 0.0]],
        Some(grid) => (0..=grid.per_pitch / 2)
            .flat_map(|i| (0..=i).map(move |j| [i, j]))
            .map(|node| grid.shift_um(node))
            .collect(),
    };
    let planes = wavelengths_nm.len() * shifts_um.len();
    let meta = ResponseMeta {
        model: "made-up".into(),
        settings: serde_json::json!({}),
        pixel: serde_json::json!({}),
        pitch_um: stack.pitch_um,
        subpixels: stack.subpixels,
        frame: MovingFrame::of(stack, 550.0)?,
        key: String::new(),
        shift_grid: shifts,
        chief_ray_shifts: None,
        corrections: Vec::new(),
    };
    let axes = ResponseAxes {
        wavelengths_nm,
        shifts_um,
        u: axis.clone(),
        v: axis,
    };
    Ok(Response::Table(AngularResponse::new(
        axes,
        meta,
        plane.repeat(planes),
    )?))
}

fn cost(frame: &Frame) -> Result<(), Box<dyn Error>> {
    let centred = TableSettings::wave_standard_for(&frame.stack);
    let all = ShiftedSettings::wave_for(&frame.stack);
    let grid = ShiftGrid::new(frame.stack.pitch_um, all.per_pitch)?;
    let lines = ChannelWavelengths::default();
    let of = |settings: &TableSettings, w: &ChannelWavelengths, shifts| {
        table(frame, settings, w.all_response_nm(), shifts)
    };
    let mut modes = Vec::new();
    for (name, w, shifts) in [
        ("2D, monochrome", lines, None),
        ("2D, bands of 1", bands(1)?, None),
        ("2D, bands of 2", bands(2)?, None),
        ("2D, bands of 4", bands(4)?, None),
        ("2D, bands of 8", bands(8)?, None),
        ("4D, monochrome", lines, Some(grid)),
        ("4D, bands of 2", bands(2)?, Some(grid)),
        ("4D, bands of 4", bands(4)?, Some(grid)),
    ] {
        let settings = if shifts.is_some() {
            &all.table
        } else {
            &centred
        };
        let response = of(settings, &w, shifts)?;
        let began = Instant::now();
        let camera = frame.camera(SIDE, &response, w)?;
        modes.push((name, camera, began.elapsed().as_secs_f64(), Vec::new()));
    }
    for _ in 0..ROUNDS {
        for (_, camera, _, seconds) in &mut modes {
            let before = processor_s()?;
            frame.shot(camera);
            seconds.push(processor_s()? - before);
        }
    }
    let base = modes[0].3.clone();
    let median = |mut v: Vec<f64>| {
        v.sort_by(f64::total_cmp);
        v[v.len() / 2]
    };
    println!(
        "{SIDE} × {SIDE} microlenses, {ROUNDS} rounds; processor seconds of the render, camera made in wall seconds"
    );
    for (name, _, made_s, seconds) in &modes {
        let ratios = seconds.iter().zip(&base).map(|(s, b)| s / b).collect();
        println!(
            "{name:16} {:7.2} s  {:6.3} of 2D monochrome   camera {made_s:.2} s",
            median(seconds.clone()),
            median(ratios)
        );
    }
    Ok(())
}

/// Processor seconds of this process, all threads: what other jobs on the machine change least.
fn processor_s() -> Result<f64, Box<dyn Error>> {
    // Fields 14 and 15 of stat(5), in ticks of 10 ms; the name before them may hold spaces, and ends with a bracket.
    let stat = std::fs::read_to_string("/proc/self/stat")?;
    let fields = stat.rsplit_once(')').map_or("", |(_, rest)| rest);
    let ticks: Result<Vec<f64>, _> = (fields.split_whitespace().skip(11).take(2))
        .map(str::parse)
        .collect();
    Ok(ticks?.iter().sum::<f64>() * 0.01)
}

/// Views of a white wall on and off the axis, by M wavelengths of green against 16, and by the one response at 550 nm.
fn accuracy(frame: &Frame) -> Result<(), Box<dyn Error>> {
    let cache = ResponseCache::open(ResponseCache::default_dir());
    let stack = &frame.stack;
    let green = |wavelengths| Bands {
        middle_nm: [550.0; 3],
        width_nm: [90.0; 3],
        wavelengths,
    };
    let views = |w: ChannelWavelengths| -> Result<Vec<f64>, Box<dyn Error>> {
        let settings = TableSettings {
            wavelengths_nm: w.all_response_nm(),
            ..TableSettings::wave_draft()
        };
        let made = cache.get_or_build_each(stack, &settings, 550.0, &|_, _| ())?;
        let response = Response::Table(made.table);
        let mut views = Vec::new();
        for x_mm in [0.0, 0.7, 1.4] {
            let place = glam::DVec2::new(x_mm, 0.0);
            let sensor = Sensor::new(stack.pitch_um, stack.subpixels, (1, 1), place)?;
            let rule = ShiftRule::ChiefRay;
            let camera =
                quadpixel::render::Camera::new(&frame.lens, sensor.clone(), rule, &response, w)?;
            let white = WhiteField::new(&camera).of_subpixels_sr(&sensor);
            views.extend(white.iter().map(|view| f64::from(view.data()[1])));
        }
        Ok(views)
    };
    let best = views(ChannelWavelengths::of_bands(green(16))?)?;
    let error = |views: Vec<f64>| {
        let off = views.iter().zip(&best).map(|(a, b)| a / b - 1.0);
        let (square, most) = off.fold((0.0, 0f64), |(s, m), e| (s + e * e, m.max(e.abs())));
        (100.0 * (square / best.len() as f64).sqrt(), 100.0 * most)
    };
    for count in [1, 2, 3, 4, 6, 8] {
        let (rms, most) = error(views(ChannelWavelengths::of_bands(green(count))?)?);
        println!("{count} wavelengths: {rms:.3} % rms, {most:.3} % at most");
    }
    let (rms, most) = error(views(ChannelWavelengths::default())?);
    println!("the response at 550 nm: {rms:.3} % rms, {most:.3} % at most");
    Ok(())
}
