//! What few wavelengths leave out: views of a white wall by M wavelengths against 16.
//!
//! ```text
//! cargo bench -p quadpixel-laboratory --bench spectral_accuracy
//! ```

#[path = "../../benches/support/frame.rs"]
#[allow(dead_code)] // because nothing is rendered here
mod frame;

use std::error::Error;

use frame::Frame;
use quadpixel::em::{Level, Preset};
use quadpixel::render::Camera;
use quadpixel::render::truth::WhiteField;
use quadpixel::response::{Response, ResponseCache, TablePlan, TableSettings};
use quadpixel::sensor::{Sensor, ShiftRule};
use quadpixel::spectrum::{Bands, ChannelWavelengths};

/// Views of a white wall on and off the axis, by M wavelengths of green against 16, and by the one response at 550 nm.
fn main() -> Result<(), Box<dyn Error>> {
    let frame = Frame::new()?;
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
            ..TableSettings::new(Level::Wave, Preset::Draft, stack)
        };
        let plan = TablePlan::new(stack, &settings)?.each_wavelength(550.0);
        let made = cache.table(&plan, &|_, _| ())?;
        let response = Response::Table(made.table);
        let mut views = Vec::new();
        for x_mm in [0.0, 0.7, 1.4] {
            let place = glam::DVec2::new(x_mm, 0.0);
            let sensor = Sensor::new(stack.pitch_um, stack.subpixels, (1, 1), place)?;
            let rule = ShiftRule::ChiefRay;
            let camera = Camera::new(&frame.lens, sensor.clone(), rule, &response, w)?;
            let white = WhiteField::new(&camera).of_subpixels_sr(&sensor);
            views.extend(white.iter().map(|view| f64::from(view.data()[1])));
        }
        Ok(views)
    };
    let best = views(ChannelWavelengths::from_bands(green(16))?)?;
    let error = |views: Vec<f64>| {
        let off = views.iter().zip(&best).map(|(a, b)| a / b - 1.0);
        let (square, most) = off.fold((0.0, 0f64), |(s, m), e| (s + e * e, m.max(e.abs())));
        (100.0 * (square / best.len() as f64).sqrt(), 100.0 * most)
    };
    for count in [1, 2, 3, 4, 6, 8] {
        let (rms, most) = error(views(ChannelWavelengths::from_bands(green(count))?)?);
        println!("{count} wavelengths: {rms:.3} % rms, {most:.3} % at most");
    }
    let (rms, most) = error(views(ChannelWavelengths::default())?);
    println!("the response at 550 nm: {rms:.3} % rms, {most:.3} % at most");
    Ok(())
}
