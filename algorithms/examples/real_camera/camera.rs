//! The camera: lens, stop, focus, sensor and pixel.

use glam::DVec2;
use quadpixel::command::CommandError;
use quadpixel::em::PixelStack;
use quadpixel::lens::{Lens, Prescription};
use quadpixel::render::Camera;
use quadpixel::response::{GeometricResponse, Response, ResponseCache, TableSettings};
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::spectrum::ChannelWavelengths;

/// Pixels of the sensor, and the pitch of the captures' pixels: 36 mm / 768, of 7.8 × 7.8 sensor pixels each.
pub const PIXEL_UM: f64 = 6.0;
/// Focus as it was set, from the sensor.
pub const FOCUS_MM: f64 = 1000.0;
/// Focus as it is found: the blur of the plane at 600 mm, F/4, is that of 630 mm from a camera focused at 1000 mm, and its picture is
/// larger than the F/20 one by what 0.1 mm of the lens's way makes. No disparity went into it.
pub const FOUND_FOCUS_MM: f64 = 965.0;
/// See [`contrast`]; fitted to the plane at 600 mm and the wall of `box-001`, both over the field.
const CROSSTALK_MM: f64 = 19.0;
/// Width of the sensor.
pub const SENSOR_MM: f64 = 36.0;

/// Semi-aperture of the stop at a marked F-number: as noted beside the lens file, else in proportion to the noted one of F/4.
pub fn stop_semi_mm(mark: f64) -> f64 {
    match mark {
        1.8 => 8.0,
        2.8 => 5.69,
        5.6 => 2.85,
        _ => 3.65 * 4.0 / mark,
    }
}

/// Contrast of the halves at `x_mm` from the axis, in the direction of the split, against that of the simulated pixel: 1 − 2c, c the
/// part of each half's signal that turns up in the other. `1/(1 + (x/x₀)²)`, found by its effect; see the page.
pub fn contrast(x_mm: f64) -> f64 {
    1.0 / (1.0 + (x_mm / CROSSTALK_MM).powi(2))
}

/// The lens at a marked F-number, focused `focus_mm` from the sensor.
pub fn lens(name: &str, mark: f64, focus_mm: f64) -> Result<Lens, CommandError> {
    let input = |e: quadpixel::lens::LensError| CommandError::input(e.to_string());
    Prescription::named(name)
        .and_then(|p| Lens::new(&p))
        .and_then(|l| l.with_stop_semi_mm(stop_semi_mm(mark)))
        .and_then(|l| l.focused_from_sensor(focus_mm, ChannelWavelengths::default().reference_nm()))
        .map_err(input)
}

/// A sharp split of the pupil.
pub fn sharp_split() -> Result<Response, CommandError> {
    // So short that all light of the lens lands on the pixel.
    GeometricResponse::new(Subpixels::DUAL_X, PIXEL_UM, PIXEL_UM)
        .map(Response::Geometric)
        .map_err(|e| CommandError::failed(e.to_string()))
}

/// What is tabulated of the wave model: to 24°, more than the F/1.8 pupil's corner.
fn table_settings() -> TableSettings {
    TableSettings {
        cosine_max: 0.4,
        steps: 12,
        refine: 4,
        ..TableSettings::wave_standard()
    }
}

/// The wave model of a stack.
pub fn wave(stack: &PixelStack) -> Result<Response, CommandError> {
    let settings = table_settings();
    ResponseCache::open(ResponseCache::default_dir())
        .get_or_build(stack, &settings, &|_, _| ())
        .map(|made| Response::Table(made.table))
        .map_err(|e| CommandError::input(e.to_string()))
}

/// The whole sensor in `width` × `height` pixels.
pub fn camera(
    lens: &Lens,
    response: &Response,
    (width, height): (usize, usize),
    shift: ShiftRule,
) -> Result<Camera, CommandError> {
    let input = |e: String| CommandError::input(e);
    let pitch_um = SENSOR_MM * 1e3 / width as f64;
    let sensor = Sensor::new(pitch_um, Subpixels::DUAL_X, (width, height), DVec2::ZERO)
        .map_err(|e| input(e.to_string()))?;
    Camera::new(lens, sensor, shift, response, ChannelWavelengths::default())
        .map_err(|e| input(e.to_string()))
}
