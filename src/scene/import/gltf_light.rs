//! Punctual lights of glTF (`KHR_lights_punctual`).

use glam::DAffine3;

use super::json::Light as JsonLight;
use crate::scene::world::Light;

/// A light at a place (rigid, mm), along whose −z it shines; `None` for a type that is not known.
pub(super) fn light(light: &JsonLight, place: DAffine3) -> Option<Light> {
    let strength = light.color.map(|c| (c * light.intensity).max(0.0) as f32);
    let (position_mm, direction) = (place.translation, -place.matrix3.z_axis);
    Some(match light.kind.as_str() {
        "directional" => Light::Sun {
            direction,
            irradiance: strength,
            half_angle_deg: 0.0,
        },
        "point" => Light::Point {
            position_mm,
            intensity_m2: strength,
        },
        "spot" => {
            let spot = light.spot.as_ref();
            let outer = spot
                .and_then(|s| s.outer_cone_angle)
                .unwrap_or(std::f64::consts::FRAC_PI_4);
            let outer_deg = outer.to_degrees().clamp(0.01, 90.0);
            let inner = spot.and_then(|s| s.inner_cone_angle).unwrap_or(0.0);
            Light::Spot {
                position_mm,
                direction,
                intensity_m2: strength,
                inner_deg: inner.to_degrees().clamp(0.0, 0.999 * outer_deg),
                outer_deg,
            }
        }
        _ => return None,
    })
}
