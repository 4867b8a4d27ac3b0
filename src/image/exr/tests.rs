//! EXR files come back as written, and broken ones are errors.

#![allow(clippy::unwrap_used)] // because tests fail by panicking

use super::*;

fn ramp(channels: usize) -> Image {
    let mut image = Image::zeros(37, 41, channels);
    let ramp = image.data_mut().iter_mut().enumerate();
    ramp.for_each(|(i, v)| *v = (i as f32 * 0.37).sin());
    image
}

#[test]
fn layers_come_back_bit_for_bit_with_nan_and_infinity() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let (mut rgb, mut disparity) = (ramp(3), ramp(2));
    rgb.data_mut()[0] = f32::INFINITY;
    disparity.data_mut()[5] = f32::NAN;
    for compression in [
        Compression::None,
        Compression::Rle,
        Compression::Zips,
        Compression::Zip,
        Compression::Piz,
    ] {
        let layer = |name, channels, image| Layer {
            name,
            channels,
            image,
            sample: Sample::Float,
        };
        let written = [
            layer("", &["R", "G", "B"][..], &rgb),
            layer("A", &["dx", "dy"][..], &disparity),
        ];
        write_layers(&path, &written, compression).unwrap();
        let read = read_layers(&path).unwrap();
        assert_eq!((read[0].name.as_str(), read[1].name.as_str()), ("", "A"));
        assert_eq!(read[0].channels, ["R", "G", "B"]);
        let bits = |image: &Image| image.data().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read[0].image), bits(&rgb), "{compression:?}");
        assert_eq!(bits(&read[1].image), bits(&disparity), "{compression:?}");
        assert_eq!(
            encode_layers(&path, &written, compression).unwrap(),
            file::read(&path).unwrap()
        );
    }
}

#[test]
fn the_bytes_do_not_know_how_many_rows_came_at_once() {
    let (rgb, disparity) = (ramp(3), ramp(2));
    let cut = |image: &Image, rows: std::ops::Range<usize>| {
        let row = image.width() * image.channels();
        let data = image.data()[rows.start * row..rows.end * row].to_vec();
        Image::from_vec(image.width(), rows.len(), image.channels(), data).unwrap()
    };
    let shape = |name: &str, channels: &[&str], sample| LayerShape {
        name: name.into(),
        channels: channels.iter().map(|c| (*c).to_owned()).collect(),
        sample,
    };
    let written = |compression, cuts: &[usize]| {
        let layers = vec![
            shape("B", &["R", "G", "B"], Sample::Half),
            shape("A", &["dx", "dy"], Sample::Float),
        ];
        let folder = std::env::temp_dir();
        let path = Path::new("rows.exr");
        let mut rows = ExrRows::new(path, &folder, (37, 41), layers, compression).unwrap();
        for ends in cuts.windows(2) {
            let [rgb, disparity] = [&rgb, &disparity].map(|image| cut(image, ends[0]..ends[1]));
            rows.rows(&[&rgb, &disparity]).unwrap();
        }
        let mut bytes = Cursor::new(Vec::new());
        rows.finish(&mut bytes).map(|()| bytes.into_inner())
    };
    for compression in [Compression::Zips, Compression::Zip, Compression::Piz] {
        let whole = written(compression, &[0, 41]).unwrap();
        assert_eq!(
            whole,
            written(compression, &[0, 1, 17, 32, 40, 41]).unwrap()
        );
        assert!(written(compression, &[0, 40]).is_err());
        let layers = decode_layers(Path::new("rows.exr"), &whole).unwrap();
        assert!(layers[0].image == disparity);
    }
}

#[test]
fn half_precision_rounds_to_eleven_bits_and_refuses_to_overflow() {
    fn layer(image: &Image) -> Layer<'_> {
        Layer {
            name: "",
            channels: &["Y"],
            image,
            sample: Sample::Half,
        }
    }
    let mut image = ramp(1);
    let path = Path::new("h.exr");
    let bytes = encode_layers(path, &[layer(&image)], Compression::Piz).unwrap();
    let read = decode_layers(path, &bytes).unwrap();
    for (a, b) in image.data().iter().zip(read[0].image.data()) {
        assert!((a - b).abs() <= a.abs() * 2f32.powi(-11) + 2f32.powi(-25));
    }
    image.data_mut()[7] = 65520.0;
    let error = encode_layers(path, &[layer(&image)], Compression::Piz).unwrap_err();
    assert!(matches!(error, ImageError::HalfOverflow { value, .. } if value == 65520.0));
}

#[test]
fn truncated_and_garbled_files_are_errors() {
    let path = Path::new("t.exr");
    let image = ramp(3);
    let layer = Layer {
        name: "A",
        channels: &["R", "G", "B"],
        image: &image,
        sample: Sample::Half,
    };
    let bytes = encode_layers(path, &[layer], Compression::Piz).unwrap();
    for length in (0..bytes.len()).step_by(7) {
        assert!(decode_layers(path, &bytes[..length]).is_err());
    }
    // A flipped byte may still decode: it must not panic.
    for place in (8..bytes.len()).step_by(11) {
        let mut garbled = bytes.clone();
        garbled[place] ^= 0x55;
        let _ = decode_layers(path, &garbled);
    }
}

#[test]
fn what_deflate_cannot_shrink_comes_back() {
    let mut noise = Image::zeros(16, 20, 1);
    let bits = (1u32..).map(|k| k.wrapping_mul(0x9E37_79B9).rotate_left(k % 32) ^ (k << 7));
    let noise_data = noise.data_mut().iter_mut().zip(bits);
    noise_data.for_each(|(v, bits)| *v = f32::from_bits(bits));
    let path = Path::new("noise.exr");
    let layers = [Layer {
        name: "",
        channels: &["Y"],
        image: &noise,
        sample: Sample::Float,
    }];
    let bytes = encode_layers(path, &layers, Compression::Zip).unwrap();
    assert!(bytes.len() > 4 * noise.data().len(), "{}", bytes.len());
    let read = decode_layers(path, &bytes).unwrap();
    let bits = |image: &Image| image.data().iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&read[0].image), bits(&noise));
}
