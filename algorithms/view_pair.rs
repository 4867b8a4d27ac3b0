//! Two opposite views from files, made linear: black taken off, a transfer function undone, a white sheet divided out,
//! the part cut out that is wanted.

use std::path::{Path, PathBuf};

use quadpixel::image::Image;
use quadpixel::image::srgb::to_linear;
use rayon::prelude::*;

use crate::load::{self, LoadError};

/// What the user says of two views.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairOptions {
    /// Black, a part of the file's full scale; it is taken off, and what is darker is 0.
    pub black: f64,
    /// The files are in sRGB.
    pub is_srgb: bool,
    /// Views of a uniform white sheet by the same camera, left and right, in files of the same kind.
    pub white_sheet: Option<[PathBuf; 2]>,
    /// The middle of the views that is used: columns and rows, px.
    pub crop_px: Option<[usize; 2]>,
}

/// A pair that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum PairError {
    /// A picture cannot be read, or differs from the first in size or channels.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// Black that leaves nothing.
    #[error("black level {0} of full scale: allowed is 0 to below 1")]
    Black(f64),
    /// A crop larger than the views.
    #[error("{}: a crop of {} × {} pixels where it has {} × {}", path.display(), crop[0], crop[1], size[0], size[1])]
    Crop {
        /// The left view.
        path: PathBuf,
        /// Columns and rows asked for.
        crop: [usize; 2],
        /// Columns and rows that there are.
        size: [usize; 2],
    },
    /// A white sheet that was exposed too long.
    #[error(
        "{}: {percent:.1} % of the white sheet are saturated; allowed: 1 % at most, by a shorter exposure",
        path.display()
    )]
    SaturatedSheet {
        /// The sheet's view.
        path: PathBuf,
        /// Part of its values at the file's full scale.
        percent: f64,
    },
    /// Two views of a sheet that are no two halves of one exposure.
    #[error(
        "{}: the white sheet is {ratio:.3} times as bright as that of {}; allowed: 0.25 to 4, two views of one exposure \
         in files of one kind",
        path.display(), reference.display()
    )]
    SheetsDiffer {
        /// The right view.
        path: PathBuf,
        /// The left view.
        reference: PathBuf,
        /// The right one's mean over the left one's.
        ratio: f64,
    },
    /// A white sheet without light.
    #[error("{}: pixel (x {x}, y {y}) of the white sheet has no light in its surroundings", path.display())]
    DarkSheet {
        /// The sheet's view.
        path: PathBuf,
        /// Column.
        x: usize,
        /// Row.
        y: usize,
    },
}

/// The least light of a white sheet, of full scale: a code of 16 bits.
const LEAST_LIGHT: f32 = 1.0 / 65535.0;
/// Most of a white sheet that may be at the full scale of its file.
const SATURATED: f64 = 0.01;
/// Most by which one view of a white sheet may be brighter than the other.
const MOST_RATIO: f64 = 4.0;
/// Half the side of the square over which the sheet is averaged, px.
const SHEET_HALF_PX: usize = 50;

/// Reads the left and the right view; the right one is brought to the left one's brightness by the white sheet.
///
/// # Errors
/// Files that are no pictures or differ, black at white or above, a crop that does not fit, a sheet without light or
/// saturated, or whose views differ.
pub fn read_pair(
    left: &Path,
    right: &Path,
    options: &PairOptions,
) -> Result<[Image; 2], PairError> {
    if !(0.0..1.0).contains(&options.black) {
        return Err(PairError::Black(options.black));
    }
    let mut paths = vec![left.to_path_buf(), right.to_path_buf()];
    paths.extend(options.white_sheet.iter().flatten().cloned());
    let mut images = load::alike(&paths)?;
    for (sheet, path) in images.iter().zip(&paths).skip(2) {
        check_exposure(sheet, path)?;
    }
    let linear = |value: &mut f32| {
        let light = ((f64::from(*value) - options.black) / (1.0 - options.black)).max(0.0) as f32;
        *value = if options.is_srgb {
            to_linear(light)
        } else {
            light
        };
    };
    (images.par_iter_mut()).for_each(|image| image.data_mut().iter_mut().for_each(linear));
    if let [_, right, white_left, white_right] = images.as_mut_slice() {
        let mean = |sheet: &Image| box_mean(sheet, SHEET_HALF_PX);
        let sheets = <[Image; 2]>::from(rayon::join(|| mean(white_left), || mean(white_right)));
        for (sheet, path) in sheets.iter().zip(&paths[2..]) {
            if let Some(i) = sheet.data().iter().position(|&v| v < LEAST_LIGHT) {
                let pixel = i / sheet.channels();
                let (x, y) = (pixel % sheet.width(), pixel / sheet.width());
                return Err(PairError::DarkSheet {
                    path: path.clone(),
                    x,
                    y,
                });
            }
        }
        let light = |sheet: &Image| sheet.data().iter().map(|&v| f64::from(v)).sum::<f64>();
        let ratio = light(&sheets[1]) / light(&sheets[0]);
        if !(1.0 / MOST_RATIO..=MOST_RATIO).contains(&ratio) {
            return Err(PairError::SheetsDiffer {
                path: paths[3].clone(),
                reference: paths[2].clone(),
                ratio,
            });
        }
        let ratio = sheets[0].data().iter().zip(sheets[1].data());
        right
            .data_mut()
            .iter_mut()
            .zip(ratio)
            .for_each(|(v, (l, r))| *v *= l / r);
    }
    images.truncate(2);
    if let Some(crop) = options.crop_px {
        let size = [images[0].width(), images[0].height()];
        if (0..2).any(|i| crop[i] == 0 || crop[i] > size[i]) {
            return Err(PairError::Crop {
                path: left.to_path_buf(),
                crop,
                size,
            });
        }
        images
            .iter_mut()
            .for_each(|image| *image = middle(image, crop));
    }
    let right = images.remove(1);
    Ok([images.remove(0), right])
}

/// Refuses a sheet of integers of which much is at their largest. Floats have no full scale.
fn check_exposure(sheet: &Image, path: &Path) -> Result<(), PairError> {
    if !load::has_full_scale(path) {
        return Ok(());
    }
    let full = sheet.data().iter().filter(|v| **v >= 1.0).count();
    let part = full as f64 / sheet.data().len() as f64;
    match part > SATURATED {
        true => Err(PairError::SaturatedSheet {
            path: path.to_path_buf(),
            percent: 100.0 * part,
        }),
        false => Ok(()),
    }
}

/// The middle `width` × `height` pixels.
fn middle(image: &Image, [width, height]: [usize; 2]) -> Image {
    let (left, top) = ((image.width() - width) / 2, (image.height() - height) / 2);
    let mut cut = Image::zeros(width, height, image.channels());
    for y in 0..height {
        for x in 0..width {
            cut.pixel_mut(x, y)
                .copy_from_slice(image.pixel(left + x, top + y));
        }
    }
    cut
}

/// Mean over (2 `half` + 1)² pixels, less at the edges.
fn box_mean(image: &Image, half: usize) -> Image {
    let (width, height, channels) = (image.width(), image.height(), image.channels());
    let mut mean = image.clone();
    for (axis, length, lines) in [(0, width, height), (1, height, width)] {
        for (line, c) in (0..lines).flat_map(|line| (0..channels).map(move |c| (line, c))) {
            let place = |i: usize| if axis == 0 { (i, line) } else { (line, i) };
            let mut sums = vec![0.0f64; length + 1];
            for i in 0..length {
                let (x, y) = place(i);
                sums[i + 1] = sums[i] + f64::from(mean.pixel(x, y)[c]);
            }
            for i in 0..length {
                let (from, to) = (i.saturating_sub(half), (i + half + 1).min(length));
                let (x, y) = place(i);
                mean.pixel_mut(x, y)[c] = ((sums[to] - sums[from]) / (to - from) as f64) as f32;
            }
        }
    }
    mean
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use quadpixel::image::raster::{Levels, write_png16};

    use super::*;
    use crate::pictures::encode_float;

    fn write(path: &Path, value: impl Fn(usize, usize) -> f32) {
        let data = (0..20 * 10).map(|i| value(i % 20, i / 20)).collect();
        let image = Image::from_vec(20, 10, 1, data).unwrap();
        std::fs::write(path, encode_float("a", &["Y"], &image).unwrap()).unwrap();
    }

    #[test]
    fn black_and_a_white_sheet_are_taken_out_and_the_middle_is_cut() {
        let folder = tempfile::tempdir().unwrap();
        let [left, right, white, dim] =
            ["l", "r", "wl", "wr"].map(|n| folder.path().join(format!("{n}.exr")));
        write(&left, |x, _| 0.1 + 0.9 * x as f32 / 40.0);
        write(&right, |x, _| 0.1 + 0.45 * x as f32 / 40.0);
        write(&white, |_, _| 0.1 + 0.9 * 0.8);
        write(&dim, |_, _| 0.1 + 0.9 * 0.4);
        let options = PairOptions {
            black: 0.1,
            is_srgb: false,
            white_sheet: Some([white.clone(), dim.clone()]),
            crop_px: Some([10, 4]),
        };
        let [l, r] = read_pair(&left, &right, &options).unwrap();
        assert_eq!((l.width(), l.height()), (10, 4));
        for x in 0..10 {
            let wanted = (x + 5) as f32 / 40.0;
            assert!(
                (l.pixel(x, 1)[0] - wanted).abs() < 1e-6
                    && (r.pixel(x, 1)[0] - wanted).abs() < 1e-6
            );
        }
        let refused =
            |options: PairOptions| read_pair(&left, &right, &options).unwrap_err().to_string();
        assert!(
            refused(PairOptions {
                crop_px: Some([21, 4]),
                ..options.clone()
            })
            .contains("21 × 4")
        );
        assert!(
            refused(PairOptions {
                black: 1.0,
                ..options.clone()
            })
            .contains("black level 1")
        );
        write(&dim, |_, _| 0.1 + 0.9 * 0.1);
        assert!(refused(options.clone()).contains("0.125 times as bright"));
        write(&dim, |_, _| 0.1);
        assert!(refused(options).contains("no light"));
    }

    #[test]
    fn a_saturated_sheet_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let [view, sheet] = ["v.png", "s.png"].map(|n| folder.path().join(n));
        let picture = |path: &Path, saturated: usize| {
            let value = |i: usize| if i < saturated { 1.0 } else { 0.6 };
            let image = Image::from_vec(20, 10, 1, (0..200).map(value).collect()).unwrap();
            write_png16(path, &image, Levels::full_range(1.0)).unwrap();
        };
        picture(&view, 0);
        let options = PairOptions {
            white_sheet: Some([view.clone(), sheet.clone()]),
            ..PairOptions::default()
        };
        picture(&sheet, 2);
        assert!(read_pair(&view, &view, &options).is_ok());
        picture(&sheet, 5);
        let refused = read_pair(&view, &view, &options).unwrap_err().to_string();
        assert!(
            refused.contains("s.png") && refused.contains("2.5 %"),
            "{refused}"
        );
    }
}
