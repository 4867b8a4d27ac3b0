//! Wavelengths a channel: a band of colour by a few of its wavelengths, against many. The lens's dispersion and the pixel's are apart:
//! datasets trace the lens at each channel's own wavelength, and have the pixel's response at one.

use quadpixel::command::CommandError;
use quadpixel::em::PixelStack;
use quadpixel::em::wave::WaveSettings;
use quadpixel::response::{LitPixel, PixelModel, direction_cosines};
use quadpixel::spectrum::ChannelWavelengths;

use super::Size;
use super::clock::best_of;
use super::row::{Curve, Row, Table, rms};
use super::work::{FOCUS_MM, PIXEL, Work, failed, mosaic, percent};

/// Width of each channel's band, nm: about that of absorbing filters at half maximum.
const WIDTH_NM: f64 = 80.0;
const COUNTS: [usize; 6] = [1, 2, 3, 4, 6, 8];
/// Rays a pixel and wavelength: all images have the same random numbers, so it is the wavelengths that differ.
const RAYS: usize = 64;
/// Angles of incidence of the pixel's light, deg, at φ = 0.
const THETA_DEG: [f64; 5] = [0.0, 5.0, 10.0, 20.0, 30.0];

pub(super) fn table(size: Size) -> Result<Table, CommandError> {
    let (side, reference) = match size {
        Size::Affordable => (24, 24),
        Size::Full => (48, 48),
    };
    let work = Work::new(side)?;
    let image = image(&work, reference)?;
    let pixel = pixel(reference)?;
    Ok(Table {
        knob: "wavelengths",
        work: format!(
            "even bands of {WIDTH_NM} nm about 610, 550 and 465 nm, by the middles of equal parts. Lens: {}, {RAYS} rays a wavelength. Pixel: P of each sub-pixel of {PIXEL}, wave model, \
             green band, at theta {THETA_DEG:?} deg; seconds of a direction as s, not those of an image",
            work.text()
        ),
        reference: format!("{reference} wavelengths a band"),
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

/// The middles of `count` equal parts of a band.
fn middles(middle_nm: f64, count: usize) -> Vec<f64> {
    let part = |i: usize| (i as f64 + 0.5) / count as f64 - 0.5;
    (0..count).map(|i| middle_nm + WIDTH_NM * part(i)).collect()
}

/// The chart in focus: what the lens's dispersion in a band does.
fn image(work: &Work, reference: usize) -> Result<Curve, CommandError> {
    let rgb_nm = ChannelWavelengths::default().rgb_nm;
    let scene = work.scene(&work.camera(rgb_nm)?, FOCUS_MM, 7)?;
    let mean = |count: usize, rounds: usize| -> Result<(f64, Vec<f32>), CommandError> {
        let bands = rgb_nm.map(|nm| middles(nm, count));
        let mut sum: Vec<f32> = Vec::new();
        let mut seconds = 0.0;
        for i in 0..count {
            let camera = work.camera([0, 1, 2].map(|c| bands[c][i]))?;
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
            .collect::<Result<_, CommandError>>()?,
    })
}

/// P of the pixel, mean over the green band.
fn pixel(reference: usize) -> Result<Curve, CommandError> {
    let stack = PixelStack::builtin(PIXEL).map_err(failed)?;
    let model = PixelModel::Wave(WaveSettings::standard());
    let middle_nm = ChannelWavelengths::default().reference_nm();
    let mean = |count: usize| -> Result<(f64, Vec<f64>), CommandError> {
        let mut p = vec![0.0; THETA_DEG.len() * stack.subpixels.count()];
        let mut seconds = 0.0;
        for nm in middles(middle_nm, count) {
            let lit = LitPixel::new(&stack, &model, nm).map_err(failed)?;
            let mut light = || -> Result<Vec<f64>, CommandError> {
                let mut all = Vec::new();
                for theta in THETA_DEG {
                    let [u, v] = direction_cosines(theta, 0.0);
                    all.extend(lit.light(u, v).map_err(failed)?.mean.absorbed);
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
            .collect::<Result<_, CommandError>>()?,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn middles_of_equal_parts_have_the_band_s_mean_and_variance_in_the_limit() {
        assert_eq!(middles(550.0, 1), [550.0]);
        assert_eq!(middles(550.0, 2), [530.0, 570.0]);
        let many = middles(550.0, 100);
        let variance = many.iter().map(|nm| (nm - 550.0).powi(2)).sum::<f64>() / 100.0;
        assert!((variance / (WIDTH_NM * WIDTH_NM / 12.0) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn error_of_the_pixel_s_band_falls_with_the_number_of_wavelengths() {
        let curve = pixel(24).unwrap();
        let error: Vec<f64> = curve.rows.iter().map(|r| r.error).collect();
        // Interference in the layers has a period of some 20 nm, so order comes late: with parts of 10 nm half the error must be gone.
        assert!(error[5] < 0.5 * error[0], "{error:?}");
    }
}
