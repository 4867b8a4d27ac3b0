//! What `meta.json` says of colour: wavelengths and bands of the channels.

use quadpixel::lens::Paraxial;
use quadpixel::render::Camera;
use quadpixel::render::truth::Defocus;
use quadpixel::response::Response;
use quadpixel::units::M_PER_MM;
use quadpixel_datasets as spec;

/// The colour channels: one wavelength each, or a band, in which a white wall has the linear value `white`.
pub(super) fn channels(
    camera: &Camera,
    response: &Response,
    white: [f64; 3],
) -> Vec<spec::Channel> {
    let wavelengths = camera.wavelengths();
    // The geometric pixel depends on no wavelength; 0 would say it is read at one.
    let read = |nm: f64| match response {
        Response::Table(_) => response.read_nm(nm),
        Response::Geometric(_) => nm,
    };
    let channel = |(c, name): (usize, &str)| {
        let band = wavelengths.bands().map(|bands| spec::ChannelBand {
            width_nm: bands.width_nm[c],
            wavelengths_nm: wavelengths.traced_nm(c),
            response_wavelengths_nm: match response {
                Response::Table(_) => wavelengths.response_nm(c).into_iter().map(read).collect(),
                Response::Geometric(_) => Vec::new(),
            },
            white: white[c],
        });
        let (middle_nm, response_nm) = match wavelengths.bands() {
            Some(bands) => (bands.middle_nm[c], bands.middle_nm[c]),
            None if camera.is_dispersive() => (wavelengths.rgb_nm[c], wavelengths.reference_nm()),
            None => (wavelengths.reference_nm(), wavelengths.reference_nm()),
        };
        spec::Channel {
            name: name.to_string(),
            wavelength_nm: middle_nm,
            optics: optics(camera, c).unwrap_or_else(|| unreachable!("a camera with a lens")),
            response_wavelength_nm: read(response_nm),
            band,
        }
    };
    ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(channel)
        .collect()
}

/// The paraxial pinhole of a channel, on the plane z_s of [`Defocus`]; `None` for bare pixels.
fn optics(camera: &Camera, channel: usize) -> Option<spec::ChannelOptics> {
    let defocus = Defocus::for_channel(camera, channel)?;
    let focus_mm = defocus.focused_depth_mm();
    let lens = camera.channel_paraxial(channel)?;
    Some(spec::ChannelOptics {
        fx_px: focal_mm(defocus.pupil_distance_mm(), lens) / camera.sensor().pitch_mm(),
        entrance_pupil_diameter_m: 2.0 * lens.entrance_pupil_semi_mm * M_PER_MM,
        pinhole_behind_vertex_m: lens.entrance_pupil_z_mm * M_PER_MM,
        focus_distance_m: focus_mm.is_finite().then_some(focus_mm * M_PER_MM),
    })
}

/// With the entrance pupil at z_e and a plane D = `pupil_distance_mm` behind the exit pupil, a point at depth Z and
/// height X is seen at X · f/(Z + z_e) on the plane. A chief ray of slope m in object space leaves the exit pupil with
/// slope m · (pupil magnification)⁻¹ (Lagrange), so its height on the plane is m · D / magnification.
pub(super) fn focal_mm(pupil_distance_mm: f64, lens: &Paraxial) -> f64 {
    let magnification = lens.exit_pupil_semi_mm / lens.entrance_pupil_semi_mm;
    pupil_distance_mm / magnification
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use glam::DVec3;
    use quadpixel::lens::{chief_ray, trace_backward, trace_forward};
    use quadpixel::rays::Ray;

    use super::*;
    use crate::assemble;
    use crate::recipe::Recipe;

    /// Focal lengths in px against rays of the plain tracer that hardly leave the axis: on the sensor, and where the
    /// depth in focus is imaged. The lens's designer may have put the first beside the second.
    #[test]
    fn focal_lengths_are_those_of_traced_paraxial_rays() {
        for (name, shift_um) in [
            ("wide_US20120327520A1_emb3", 0.2),
            ("wide_US11940605B2_emb1", 3.3),
            ("wide_deeplens_cellphone80deg", -71.6),
        ] {
            let recipe: Recipe = toml::from_str(&format!(
                "lens = {{ name = {name:?}, focus_mm = 500 }}
                 sensor = {{ pitch_um = 2.0, subpixels = \"2x2\", width = 8, height = 8 }}
                 response = {{ model = \"geometric\" }}
                 render = {{ rays_per_pixel = 1, seed = 1 }}"
            ))
            .unwrap();
            let response = assemble::Responses::new().get(&recipe, &()).unwrap();
            let camera = assemble::camera(&recipe, &response).unwrap();
            let system = camera.system(1);
            let chief = chief_ray(system, 1e-4, 0.0).unwrap();
            let object = trace_backward(system, chief).unwrap().direction;
            let focal_mm = |x_mm: f64| (x_mm / (object.x / object.z)).abs();
            let on_sensor_mm = focal_mm(chief.origin_mm.x);
            // From the axis in focus, at 1e-6 of slope, to where it meets the axis again.
            let from = Ray {
                origin_mm: DVec3::new(0.0, 0.0, -500.0),
                direction: DVec3::new(1e-6, 0.0, 1.0).normalize(),
            };
            let axial = trace_forward(system, from).unwrap();
            let beyond_mm = -axial.origin_mm.x * axial.direction.z / axial.direction.x;
            assert!(
                (-1e3 * beyond_mm - shift_um).abs() < 0.1,
                "{name}: {beyond_mm} mm"
            );
            let slope = chief.direction.x / chief.direction.z;
            let in_focus_mm = focal_mm(chief.origin_mm.x + beyond_mm * slope);
            let pitch_mm = camera.sensor().pitch_mm();
            let intrinsics = super::super::intrinsics(&camera);
            let green = optics(&camera, 1).unwrap();
            for (fx_px, traced_mm) in [(intrinsics.fx_px, on_sensor_mm), (green.fx_px, in_focus_mm)]
            {
                let traced_px = traced_mm / pitch_mm;
                assert!(
                    (fx_px / traced_px - 1.0).abs() < 1e-7,
                    "{name}: {fx_px} against {traced_px}"
                );
            }
            let inverse =
                |depth_mm: f64| 1.0 / (depth_mm * M_PER_MM + green.pinhole_behind_vertex_m);
            let defocus = Defocus::new(&camera).unwrap();
            for depth_mm in [150.0, 2000.0, f64::INFINITY] {
                let coc_px = defocus.circle_of_confusion_mm(depth_mm) / pitch_mm;
                let by_optics = green.fx_px
                    * green.entrance_pupil_diameter_m
                    * (inverse(500.0) - inverse(depth_mm));
                assert!(
                    (coc_px / by_optics - 1.0).abs() < 1e-9,
                    "{name}: {coc_px} against {by_optics}"
                );
            }
        }
    }
}
