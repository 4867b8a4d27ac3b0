//! Pictures read from files (EXR, PNG of 8 or 16 bits, TIFF, JPEG), with only finite numbers in them.
//!
//! Integers are divided by their full scale. A transfer function, where the file has one, is not undone: what comes in
//! is what the algorithms work on.

use std::path::{Path, PathBuf};

use quadpixel::image::exr::{NamedLayer, read_layers};
use quadpixel::image::{Image, ImageError, raster};
use rayon::prelude::*;

/// A picture that is no input.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// It cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// It has no pixel.
    #[error("{}: it has no pixel", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A sample is NaN or infinite.
    #[error("{}: pixel (x {x}, y {y}) holds {value} in channel {channel}: only finite numbers are allowed", path.display())]
    NotFinite {
        /// The file.
        path: PathBuf,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
        /// Channel, with its layer where it has one.
        channel: String,
        /// NaN or ±∞.
        value: f32,
    },
    /// Two pictures that belong together differ in size or channels.
    #[error("{}: {found} where {} has {expected}: both must be of one size", path.display(), reference.display())]
    Differs {
        /// The file.
        path: PathBuf,
        /// Its size.
        found: String,
        /// The file it goes with.
        reference: PathBuf,
        /// That one's size.
        expected: String,
    },
}

/// Reads a picture: of an EXR its unnamed layer, else its first.
///
/// # Errors
/// The file cannot be read, is no picture, is empty, or holds a number that is not finite.
pub fn image(path: &Path) -> Result<Image, LoadError> {
    let first = layers(path)?.into_iter().next();
    first.map(|layer| layer.image).ok_or(LoadError::Empty {
        path: path.to_path_buf(),
    })
}

/// Reads all layers of an EXR; any other picture is one layer with no name.
///
/// # Errors
/// The file cannot be read, is no picture, is empty, or holds a number that is not finite.
pub fn layers(path: &Path) -> Result<Vec<NamedLayer>, LoadError> {
    let layers = if is_exr(path) {
        read_layers(path)?
    } else {
        let image = raster::read(path)?;
        let names: &[&str] = match image.channels() {
            1 => &["Y"],
            _ => &["R", "G", "B"],
        };
        vec![NamedLayer {
            name: String::new(),
            channels: names.iter().map(ToString::to_string).collect(),
            image,
        }]
    };
    layers.iter().try_for_each(|layer| check(path, layer))?;
    Ok(layers)
}

/// Whether a picture's numbers are parts of a full scale: those of an EXR have none.
pub(crate) fn has_full_scale(path: &Path) -> bool {
    !is_exr(path)
}

fn is_exr(path: &Path) -> bool {
    (path.extension()).is_some_and(|e| e.eq_ignore_ascii_case("exr"))
}

/// Reads pictures that must have one size and one number of channels.
///
/// # Errors
/// One of them cannot be read (see [`image`]) or differs from the first.
pub fn alike(paths: &[PathBuf]) -> Result<Vec<Image>, LoadError> {
    let mut images: Vec<Image> = Vec::with_capacity(paths.len());
    let read: Vec<Result<Image, LoadError>> = paths.par_iter().map(|path| image(path)).collect();
    for (path, next) in paths.iter().zip(read) {
        let next = next?;
        if let Some(first) = images.first()
            && size_of(first) != size_of(&next)
        {
            return Err(LoadError::Differs {
                path: path.clone(),
                found: size_of(&next),
                reference: paths[0].clone(),
                expected: size_of(first),
            });
        }
        images.push(next);
    }
    Ok(images)
}

/// `width × height, channels`, in words.
pub fn size_of(image: &Image) -> String {
    format!(
        "{} × {} pixels of {} channel(s)",
        image.width(),
        image.height(),
        image.channels()
    )
}

fn check(path: &Path, layer: &NamedLayer) -> Result<(), LoadError> {
    let image = &layer.image;
    if image.data().is_empty() {
        return Err(LoadError::Empty {
            path: path.to_path_buf(),
        });
    }
    let Some(index) = image.data().iter().position(|value| !value.is_finite()) else {
        return Ok(());
    };
    let (pixel, name) = (
        index / image.channels(),
        &layer.channels[index % image.channels()],
    );
    let parted = if layer.name.is_empty() { "" } else { "." };
    Err(LoadError::NotFinite {
        path: path.to_path_buf(),
        x: pixel % image.width(),
        y: pixel / image.width(),
        channel: format!("{}{parted}{name}", layer.name),
        value: image.data()[index],
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;
    use quadpixel::image::exr::{Compression, Layer, Sample, write_layers};

    fn write_exr(path: &Path, image: &Image) {
        let layer = Layer {
            name: "A",
            channels: &["Y"],
            image,
            sample: Sample::Float,
        };
        write_layers(path, &[layer], Compression::Zip).unwrap();
    }

    #[test]
    fn nan_and_infinity_are_refused_with_the_pixel_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut image = Image::zeros(5, 4, 1);
            image.pixel_mut(3, 2)[0] = bad;
            write_exr(&path, &image);
            let text = layers(&path).unwrap_err().to_string();
            assert!(
                text.contains("(x 3, y 2)") && text.contains("A.Y"),
                "{text}"
            );
            assert!(super::image(&path).is_err());
        }
    }

    #[test]
    fn empty_and_truncated_files_are_errors_that_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write_exr(&path, &Image::zeros(64, 64, 1));
        let whole = std::fs::read(&path).unwrap();
        for length in [0, 3, 10, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..length]).unwrap();
            for text in [
                layers(&path).unwrap_err().to_string(),
                super::image(&path).unwrap_err().to_string(),
            ] {
                assert!(text.contains("a.exr"), "{text}");
            }
        }
    }

    #[test]
    fn pictures_of_unequal_size_are_told_apart() {
        let folder = tempfile::tempdir().unwrap();
        let paths = [folder.path().join("a.exr"), folder.path().join("b.exr")];
        write_exr(&paths[0], &Image::zeros(5, 4, 1));
        write_exr(&paths[1], &Image::zeros(4, 5, 1));
        let text = alike(&paths).unwrap_err().to_string();
        assert!(text.contains("b.exr") && text.contains("5 × 4"), "{text}");
    }
}
