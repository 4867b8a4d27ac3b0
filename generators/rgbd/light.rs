//! Linear light of a picture's numbers.

use std::path::Path;

use quadpixel::image::{Image, srgb};

use super::error::PictureError;
use super::files::Stored;
use super::meaning::{Encoding, Meaning};

/// Places of red, green and blue among channels that have names (EXR) or numbers.
fn colours(channels: &[String]) -> Result<[usize; 3], String> {
    if channels.iter().all(|name| name.parse::<usize>().is_ok()) {
        return match channels.len() {
            1 | 2 => Ok([0; 3]),
            3 | 4 => Ok([0, 1, 2]),
            n => Err(format!(
                "a picture of {n} channels; allowed: 1 to 4 (gray or colour, alpha is dropped)"
            )),
        };
    }
    let place = |wanted: &str| channels.iter().position(|name| name == wanted);
    let lit: Vec<usize> = (0..channels.len())
        .filter(|i| channels[*i] != "A")
        .collect();
    match (place("R"), place("G"), place("B"), lit.as_slice()) {
        (Some(red), Some(green), Some(blue), _) => Ok([red, green, blue]),
        (_, _, _, &[gray]) => Ok([gray; 3]),
        _ => Err(format!(
            "a picture of the channels {}; allowed: R, G and B, or a single one (alpha is dropped)",
            channels.join(", ")
        )),
    }
}

/// W × H × 3 linear light; whole numbers have 1 at their full scale. Negative light, which filters leave in floats, is
/// 0; gray has three equal channels. `path` is what errors name.
pub(super) fn of(stored: &Stored, path: &Path, meaning: &Meaning) -> Result<Image, PictureError> {
    let is_srgb = match (meaning.encoding.unwrap_or_default(), stored.full_scale) {
        (Encoding::Srgb, _) | (Encoding::Auto, Some(_)) => true,
        (Encoding::Linear, _) | (Encoding::Auto, None) => false,
    };
    let scale = 1.0 / stored.full_scale.unwrap_or(1.0);
    let light = |code: f32| match is_srgb {
        true => srgb::to_linear((code * scale).max(0.0)),
        // NaN stays, and is refused with its place.
        false if code < 0.0 => 0.0,
        false => code * scale,
    };
    let image = &stored.image;
    let channels = colours(&stored.channels).map_err(|what| PictureError::File {
        path: path.to_owned(),
        what,
    })?;
    // Codes have few values: a table is quicker than as many powers.
    let table: Option<Vec<f32>> = (stored.full_scale.filter(|full| *full <= 65535.0))
        .map(|full| (0..=full as usize).map(|code| light(code as f32)).collect());
    let value = |v: f32| table.as_ref().map_or_else(|| light(v), |t| t[v as usize]);
    let pixels = image.data().chunks_exact(image.channels());
    let data = pixels.flat_map(|p| channels.map(|c| value(p[c])));
    let data = data.collect();
    Image::from_vec(image.width(), image.height(), 3, data).ok_or_else(|| PictureError::File {
        path: path.to_owned(),
        what: "its size does not match its data".into(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_found_by_their_names_and_no_other_channel_is_taken_for_one() {
        let of = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(ToString::to_string).collect();
            colours(&names)
        };
        assert_eq!(of(&["0", "1", "2", "3"]), Ok([0, 1, 2]));
        assert_eq!(of(&["A", "B", "G", "R"]), Ok([3, 2, 1]));
        assert_eq!(of(&["Y", "A"]), Ok([0; 3]));
        for bad in [
            &["Y", "RY", "BY"][..],
            &["A", "foo", "bar"],
            &["R", "G"],
            &["A"],
        ] {
            assert!(of(bad).is_err_and(|e| e.contains("R, G and B")), "{bad:?}");
        }
    }
}
