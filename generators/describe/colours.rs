//! What `meta.json` says of colour: wavelengths and bands of the channels, and which effects of them were simulated.

use quadpixel::render::Camera;
use quadpixel::response::Response;
use quadpixel_datasets as spec;

use super::Exposed;
use crate::recipe::Recipe;

/// The colour channels: one wavelength each, or a band.
pub(super) fn channels(
    camera: &Camera,
    response: &Response,
    exposure: &Exposed,
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
            white: exposure.white_sr[c] * exposure.gain,
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

/// What of colour is simulated, and what is not.
pub(super) fn effects(
    recipe: &Recipe,
    camera: &Camera,
    response: &Response,
    simulated: &mut Vec<&'static str>,
    left_out: &mut Vec<(&'static str, &'static str)>,
) {
    let table_nm = match response {
        Response::Table(table) => Some(table.axes().wavelengths_nm.len()),
        Response::Geometric(_) => None,
    };
    let depends = "wavelength dependence of the response";
    match (camera.wavelengths().bands(), table_nm) {
        (Some(_), Some(2..)) => simulated.push(depends),
        (Some(_), Some(_)) => left_out.push((depends, "the response's table is of one wavelength")),
        (None, Some(_)) => left_out.push((
            depends,
            "all channels use the table at one wavelength, as in the paper",
        )),
        (_, None) => {}
    }
    if camera.wavelengths().bands().is_some() {
        simulated.push("width of the colour bands");
        left_out.push((
            "spectra of the scene",
            "its radiance in a channel is even over the channel's band",
        ));
    } else {
        left_out.push((
            "width of the colour bands",
            "each channel is traced at one wavelength",
        ));
    }
    if recipe.sensor.mosaic.is_some() {
        simulated.push("colour filter mosaic (in files of its own)");
        let crosstalk = "crosstalk through filters of another colour";
        if among_other_colours(response) {
            simulated.push(crosstalk);
            left_out.push((
                "light of other bands through a filter",
                "a channel knows the light of its own band",
            ));
        } else {
            left_out.push((
                crosstalk,
                "the pixel is simulated among pixels of its own colour, the paper's worst case",
            ));
        }
    } else {
        left_out.push((
            "colour filter mosaic",
            "every sub-pixel has all three channels, as in the paper",
        ));
    }
}

/// Whether the table's pixel was simulated in a mosaic of colour filters.
fn among_other_colours(response: &Response) -> bool {
    match response {
        Response::Table(table) => table.meta().pixel.mosaic.is_some(),
        Response::Geometric(_) => false,
    }
}
