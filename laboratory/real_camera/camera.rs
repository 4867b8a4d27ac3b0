//! The camera: lens, stop, focus, sensor and pixel.

use glam::DVec2;
use quadpixel::em::{Level, PixelStack, Preset};
use quadpixel::lens::{Lens, Prescription};
use quadpixel::render::Camera;
use quadpixel::response::{
    AngularResponse, GeometricResponse, Response, ResponseCache, TablePlan, TableSettings,
};
use quadpixel::sensor::{Sensor, ShiftRule, Subpixels};
use quadpixel::spectrum::ChannelWavelengths;
use std::error::Error;

use crate::exact::Runs;
use crate::spread::spread;

/// Pixels of the sensor, and the pitch of the captures' pixels: 36 mm / 768, of 7.8 × 7.8 sensor pixels each.
pub const PIXEL_UM: f64 = 6.0;
/// Focus as it was set, from the sensor.
pub const FOCUS_MM: f64 = 1000.0;
/// The capture that the pixel's two fitted parameters were fitted on: distance from the sensor in mm, mark. All others
/// are predicted.
pub const FITTED_ON: (f64, f64) = (600.0, 4.0);
/// How far charge wanders before it is collected, σ in µm: the second fitted parameter, to the fall of the shift to the
/// sides of [`FITTED_ON`]. The first, the thickness of the wiring, is in the pixel file.
pub const CHARGE_SPREAD_UM: f64 = 0.6;
/// Microlenses stand over the middle of their pixels, as in the published model of this camera (He et al., ICCV 2025);
/// the noise of the views, which tells how much light each had before the converter made them equally bright, says so,
/// too.
pub const MICROLENSES: ShiftRule = ShiftRule::Centred;
/// Width of the sensor.
pub const SENSOR_MM: f64 = 36.0;

/// Semi-aperture of the stop at a marked F-number: as noted beside the lens file, else in proportion to the noted one
/// of F/4.
pub fn stop_semi_mm(mark: f64) -> f64 {
    match mark {
        1.8 => 8.0,
        2.8 => 5.69,
        5.6 => 2.85,
        _ => 3.65 * 4.0 / mark,
    }
}

/// The lens at a marked F-number, focused `focus_mm` from the sensor.
pub fn lens(name: &str, mark: f64, focus_mm: f64) -> Result<Lens, Box<dyn Error>> {
    Prescription::named(name)
        .and_then(|p| Lens::new(&p))
        .and_then(|l| l.with_stop_semi_mm(stop_semi_mm(mark)))
        .and_then(|l| l.focused_from_sensor(focus_mm, ChannelWavelengths::default().reference_nm()))
        .map_err(Into::into)
}

/// A sharp split of the pupil.
fn sharp_split() -> Result<Response, Box<dyn Error>> {
    // So short that all light of the lens lands on the pixel.
    GeometricResponse::new(Subpixels::DUAL_X, PIXEL_UM, PIXEL_UM)
        .map(Response::Geometric)
        .map_err(Into::into)
}

/// What is tabulated of the wave model: to 24°, more than the F/1.8 pupil's corner.
fn table_settings(stack: &PixelStack) -> TableSettings {
    TableSettings {
        cosine_max: 0.4,
        steps: 12,
        refine: 4,
        ..TableSettings::new(Level::Wave, Preset::Standard, stack)
    }
}

/// A pixel as it is simulated.
pub struct Model {
    pub name: &'static str,
    pub response: Response,
    /// Where its microlenses stand.
    pub rule: ShiftRule,
}

/// The models of a stack: first the wave model; last the sharp split, an ideal whose microlenses follow the chief ray.
pub fn models(stack: &PixelStack) -> Result<Vec<Model>, Box<dyn Error>> {
    let settings = table_settings(stack);
    let plan = TablePlan::new(stack, &settings)?;
    let wave = ResponseCache::open(ResponseCache::default_dir())
        .table(&plan, &|_, _| ())?
        .table;
    let wandering = |table: &AngularResponse| {
        let spread = spread(table, CHARGE_SPREAD_UM);
        spread.map(Response::Table)
    };
    let mut models = vec![Model {
        name: "wave",
        response: wandering(&wave)?,
        rule: MICROLENSES,
    }];
    match Runs::kept(stack)? {
        Some(runs) => models.push(Model {
            name: "exact",
            response: wandering(&runs.correct(&wave)?)?,
            rule: MICROLENSES,
        }),
        None => eprintln!("real_camera: no exact runs of this pixel: no exact rows"),
    }
    models.push(Model {
        name: "wave, charge collected where it is made, microlenses on the chief ray",
        response: Response::Table(wave),
        rule: ShiftRule::ChiefRay,
    });
    models.push(Model {
        name: "sharp split",
        response: sharp_split()?,
        rule: ShiftRule::ChiefRay,
    });
    Ok(models)
}

/// The whole sensor in `width` × `height` pixels.
pub fn camera(
    lens: &Lens,
    model: &Model,
    (width, height): (usize, usize),
) -> Result<Camera, Box<dyn Error>> {
    let pitch_um = SENSOR_MM * 1e3 / width as f64;
    let sensor = Sensor::new(pitch_um, Subpixels::DUAL_X, (width, height), DVec2::ZERO)?;
    let wavelengths = ChannelWavelengths::default();
    Camera::new(lens, sensor, model.rule, &model.response, wavelengths).map_err(Into::into)
}
