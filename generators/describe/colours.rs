//! What `meta.json` says of colour: wavelengths and bands of the channels.

use quadpixel::render::Camera;
use quadpixel::response::Response;
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
