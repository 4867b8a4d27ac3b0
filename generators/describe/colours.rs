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

/// The paraxial pinhole of a channel on the camera's sensor; `None` for bare pixels.
fn optics(camera: &Camera, channel: usize) -> Option<spec::ChannelOptics> {
    let focus_mm = Defocus::for_channel(camera, channel)?.focused_depth_mm();
    let lens = camera.channel_paraxial(channel)?;
    Some(spec::ChannelOptics {
        fx_px: focal_mm(camera, lens) / camera.sensor().pitch_mm(),
        entrance_pupil_diameter_m: 2.0 * lens.entrance_pupil_semi_mm * M_PER_MM,
        pinhole_behind_vertex_m: lens.entrance_pupil_z_mm * M_PER_MM,
        focus_distance_m: focus_mm.is_finite().then_some(focus_mm * M_PER_MM),
    })
}

/// With the entrance pupil at z_e and the exit pupil D in front of the sensor, a point at depth Z and height X images at
/// X · f/(Z + z_e). A chief ray of slope m in object space leaves the exit pupil with slope m · (pupil magnification)⁻¹
/// (Lagrange), so the height on the sensor is m · D / magnification.
pub(super) fn focal_mm(camera: &Camera, lens: &Paraxial) -> f64 {
    let magnification = lens.exit_pupil_semi_mm / lens.entrance_pupil_semi_mm;
    (camera.sensor_z_mm() - lens.exit_pupil_z_mm) / magnification
}
