//! Wavelengths a channel: a band of colour by a few of its wavelengths, against many, what the lens's dispersion does
//! apart from what the pixel's does.

use crate::error::LaboratoryError;
use quadpixel::em::PixelModel;
use quadpixel::em::PixelStack;
use quadpixel::em::light::direction_cosines;
use quadpixel::em::wave::WaveSettings;
use quadpixel::spectrum::{Bands, ChannelWavelengths};

use super::clock::best_of;
use super::row::{Curve, Row, Table, rms};
use super::work::{FOCUS_MM, PIXEL, Size, Work, mosaic, percent};

const COUNTS: [usize; 6] = [1, 2, 3, 4, 6, 8];
/// Rays a pixel and wavelength: all images have the same random numbers, so it is the wavelengths that differ.
const RAYS: usize = 64;
/// Angles of incidence of the pixel's light, deg, at φ = 0.
const THETA_DEG: [f64; 5] = [0.0, 5.0, 10.0, 20.0, 30.0];

pub(super) fn table(size: Size) -> Result<Table, LaboratoryError> {
    let (side, reference) = match size {
        Size::Draft => (8, 4),
        Size::Affordable => (20, 16),
        Size::Full => (48, Bands::MOST),
    };
    let work = Work::new(side)?;
    let image = image(&work, reference)?;
    let pixel = pixel(Bands::MOST)?;
    Ok(Table {
        knob: "wavelengths",
        work: format!(
            "the default bands (raised cosines of 80, 90, 80 nm at half maximum about 610, 550, 465 nm), each by n wavelengths of equal shares. Lens: {}, {RAYS} rays a wavelength. Pixel: P of each sub-pixel of {PIXEL}, wave model, \
             green band, at theta {THETA_DEG:?} deg; seconds of a direction as s, not those of an image",
            work.text()
        ),
        reference: format!("{reference} wavelengths a band (pixel: {})", Bands::MOST),
        seconds_unit: "s a million microlenses (pixel: s a direction)",
        error_unit: "RMS, % of the mean signal",
        curves: vec![image, pixel],
        law: None,
        notes: vec![
            "P of the pixel hardly converges before the parts are narrower than the fringes of its layers (some 20 nm).".into(),
            "The time is that of more rays in proportion; with the same rays parted among the wavelengths an image takes no longer.".into(),
        ],
    })
}

/// The wavelengths that stand for the bands of R, G, B.
fn bands(count: usize) -> Result<[Vec<f64>; 3], LaboratoryError> {
    let bands = Bands {
        wavelengths: count,
        ..Bands::default()
    };
    let wavelengths = ChannelWavelengths::from_bands(bands)?;
    Ok([0, 1, 2].map(|channel| wavelengths.traced_nm(channel)))
}

/// The chart in focus: what the lens's dispersion in a band does.
fn image(work: &Work, reference: usize) -> Result<Curve, LaboratoryError> {
    let mut wavelengths = ChannelWavelengths::default();
    let scene = work.scene(&work.camera(wavelengths)?, FOCUS_MM, 7)?;
    let mut mean = |count: usize, rounds: usize| -> Result<(f64, Vec<f32>), LaboratoryError> {
        let [red, green, blue] = bands(count)?;
        let mut sum: Vec<f32> = Vec::new();
        let mut seconds = 0.0;
        for ((red, green), blue) in red.into_iter().zip(green).zip(blue) {
            wavelengths.rgb_nm = [red, green, blue];
            let camera = work.camera(wavelengths)?;
            let (time, image) = best_of(rounds, || mosaic(&camera, &scene, RAYS, 1));
            seconds += time;
            sum.resize(image.len(), 0.0);
            sum.iter_mut()
                .zip(image)
                .for_each(|(s, x)| *s += x / count as f32);
        }
        Ok((seconds, sum))
    };
    let (_, exact) = mean(reference, 1)?;
    let row = |count: usize| {
        let (seconds, image) = mean(count, 2)?;
        let error = percent(&image, &exact);
        Ok(Row::new(
            count.to_string(),
            seconds / work.pixels() * 1e6,
            error,
        ))
    };
    Ok(Curve {
        name: "lens, chart in focus".into(),
        rows: COUNTS
            .into_iter()
            .map(row)
            .collect::<Result<_, LaboratoryError>>()?,
    })
}

/// P of the pixel, mean over the green band.
fn pixel(reference: usize) -> Result<Curve, LaboratoryError> {
    let stack = PixelStack::builtin(PIXEL)?;
    let model = PixelModel::Wave(WaveSettings::standard());
    let mean = |count: usize| -> Result<(f64, Vec<f64>), LaboratoryError> {
        let mut p = vec![0.0; THETA_DEG.len() * stack.subpixels.count()];
        let mut seconds = 0.0;
        let [_, green, _] = bands(count)?;
        for nm in green {
            let lit = model.solver(&stack, nm)?;
            let mut light = || -> Result<Vec<f64>, LaboratoryError> {
                let mut all = Vec::new();
                for theta in THETA_DEG {
                    let [u, v] = direction_cosines(theta, 0.0);
                    all.extend(lit.on_microlens(u, v)?.mean.absorbed);
                }
                Ok(all)
            };
            let (time, of_one) = best_of(1, &mut light);
            seconds += time / THETA_DEG.len() as f64;
            p.iter_mut()
                .zip(of_one?)
                .for_each(|(p, x)| *p += x / count as f64);
        }
        Ok((seconds, p))
    };
    let (_, exact) = mean(reference)?;
    let level = exact.iter().sum::<f64>() / exact.len() as f64;
    let row = |count: usize| {
        let (seconds, p) = mean(count)?;
        Ok(Row::new(
            count.to_string(),
            seconds,
            100.0 * rms(&p, &exact) / level,
        ))
    };
    Ok(Curve {
        name: "pixel, P".into(),
        rows: COUNTS
            .into_iter()
            .map(row)
            .collect::<Result<_, LaboratoryError>>()?,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn error_of_the_pixel_s_band_falls_with_the_number_of_wavelengths() {
        let curve = pixel(Bands::MOST).unwrap();
        let error: Vec<f64> = curve.rows.iter().map(|r| r.error).collect();
        // Interference in the layers has a period of some 20 nm, so order comes late: with parts of some 10 nm half the
        // error must be gone.
        assert!(error[5] < 0.5 * error[0], "{error:?}");
    }
}
