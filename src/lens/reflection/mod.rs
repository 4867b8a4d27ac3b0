//! Reflections in the lens: how much each surface and the sensor reflect, and the paths of light reflected twice.
//!
//! Light of a bright source that two surfaces reflect comes to the sensor beside the image: a ghost; many ghosts, and
//! those far out of focus, are veiling glare. A path is reflected at a surface b on its way to the sensor and at a
//! surface f in front of it on its way back; the sensor itself may be b. The part of a ray's radiance that arrives is
//!
//! ```text
//! W_fb = R_b R_f Π (1 − R_k)      over all surfaces k that the path goes through
//! ```
//!
//! R is Fresnel's reflectance of unpolarised light at bare glass (Born & Wolf, Principles of Optics, section 1.5.2),
//!
//! ```text
//! F = (r_s² + r_p²)/2
//! r_s = (n cos θ − n' cos θ')/(n cos θ + n' cos θ')
//! r_p = (n' cos θ − n cos θ')/(n' cos θ + n cos θ')
//! ```
//!
//! and R_0 F(θ)/F(0), at most 1, at a surface coated to reflect R_0 of light square on it. Paths of four reflections
//! and more are left out: they carry about R² of this. So is interference, and the sensor reflects as a mirror.

mod path;
#[cfg(test)]
mod tests;

pub use path::{GhostPair, GhostPairs, Reflected};

use super::error::LensError;
use super::placed::Lens;
use super::system::{OpticalSurface, SurfaceKind};

/// How surfaces between glass and air reflect that the lens file says nothing of.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Coating {
    /// One of the words.
    Named(NamedCoating),
    /// Reflectance of light square on the surface, 0 to 1.
    Reflectance(f64),
}

/// Words for [`Coating`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum NamedCoating {
    /// None: as the glass reflects.
    BareGlass,
}

/// What reflects, and how much.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReflectionSettings {
    /// Of the surfaces between glass and air of which the lens file gives no reflectance.
    pub coating: Coating,
    /// Part of the light that the sensor sends back, as a mirror, 0 to 1.
    pub sensor: f64,
}

impl Default for ReflectionSettings {
    /// A usual multilayer coating and a sensor under microlenses.
    fn default() -> Self {
        Self {
            coating: Coating::Reflectance(0.003),
            sensor: 0.05,
        }
    }
}

impl ReflectionSettings {
    /// Whether they are the default.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

/// What each surface of a lens and the sensor reflect.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflections {
    /// Of each surface: reflectance of light square on it; `None`: bare.
    surfaces: Vec<Option<f64>>,
    sensor: f64,
}

impl Reflections {
    /// Of a lens, whose file's reflectances count before the settings.
    ///
    /// # Errors
    /// A reflectance of the settings that is not between 0 and 1.
    pub fn new(lens: &Lens, settings: &ReflectionSettings) -> Result<Self, LensError> {
        let prescription = lens.prescription();
        let coating = match settings.coating {
            Coating::Named(NamedCoating::BareGlass) => None,
            Coating::Reflectance(value) => Some(value),
        };
        let given = [
            ("reflections.coating", coating.unwrap_or(0.0)),
            ("reflections.sensor", settings.sensor),
        ];
        for (field, value) in given {
            if !(0.0..=1.0).contains(&value) {
                return Err(prescription.refuse(field, value, "between 0 and 1"));
            }
        }
        let surfaces = &prescription.surfaces;
        let of_surface = |i: usize| {
            let before = (i > 0).then(|| surfaces[i - 1].glass).flatten();
            let cemented = before.is_some() && surfaces[i].glass.is_some();
            let default = if cemented { None } else { coating };
            surfaces[i].reflectance.or(default)
        };
        Ok(Self {
            surfaces: (0..surfaces.len()).map(of_surface).collect(),
            sensor: settings.sensor,
        })
    }

    /// Of the sensor.
    pub fn sensor(&self) -> f64 {
        self.sensor
    }

    /// Reflectance of surface `i`, which is `surface` at a wavelength, where light makes an angle of cosine `cos` with
    /// its normal in the medium of index `from` on its way to that of index `to`.
    fn at(&self, i: usize, surface: &OpticalSurface, cos: f64, (from, to): (f64, f64)) -> f64 {
        if surface.kind == SurfaceKind::Stop {
            return 0.0;
        }
        let bare = fresnel(cos, from, to);
        let square = square_on(from, to);
        match self.surfaces.get(i).copied().flatten() {
            // Beyond the critical angle there is no other way, whatever the coating.
            Some(coated) if bare < 1.0 && square > 0.0 => (coated * bare / square).min(1.0),
            _ => bare,
        }
    }

    /// The same square on the surface.
    fn at_vertex(&self, i: usize, surface: &OpticalSurface) -> f64 {
        self.at(i, surface, 1.0, (surface.index_before, surface.index_after))
    }
}

/// F(0).
fn square_on(from: f64, to: f64) -> f64 {
    ((from - to) / (from + to)).powi(2)
}

/// Reflectance of unpolarised light between media of these indices, at an angle of this cosine in the first.
fn fresnel(cos: f64, from: f64, to: f64) -> f64 {
    let sin2 = (from / to).powi(2) * (1.0 - cos * cos);
    if sin2 >= 1.0 {
        return 1.0;
    }
    let behind = (1.0 - sin2).sqrt();
    let s = (from * cos - to * behind) / (from * cos + to * behind);
    let p = (to * cos - from * behind) / (to * cos + from * behind);
    0.5 * (s * s + p * p)
}
