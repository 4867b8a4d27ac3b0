//! Rays per pixel: noise of the image against that of many more rays, with what a white wall is known to give, as
//! samples are rendered, and without. Random points have 1/√N; scrambled Sobol points better.

use crate::error::LaboratoryError;
use quadpixel::render::truth::WhiteField;
use quadpixel::spectrum::ChannelWavelengths;

use super::clock::best_of;
use super::row::{Curve, Row, Table, power};
use super::work::{FOCUS_MM, Size, Work, mosaic, mosaic_by_white, percent};

/// Distances of the chart, mm.
const DISTANCES: [(&str, f64); 2] = [("in focus", FOCUS_MM), ("out of focus", 400.0)];
/// Powers of two: Sobol points.
const RAYS: [usize; 9] = [4, 8, 16, 32, 64, 128, 256, 512, 1024];
/// Keys of the samples: the reference has others.
const SEEDS: [u64; 2] = [1, 2];

/// How much is done, at which size.
struct Plan<'a> {
    side: usize,
    rays: &'a [usize],
    reference: usize,
}

pub(super) fn table(size: Size) -> Result<Table, LaboratoryError> {
    let plan = match size {
        Size::Draft => Plan {
            side: 8,
            rays: &RAYS[..4],
            reference: 512,
        },
        Size::Affordable => Plan {
            side: 24,
            rays: &RAYS[..8],
            reference: 8192,
        },
        Size::Full => Plan {
            side: 48,
            rays: &RAYS,
            reference: 32768,
        },
    };
    of(&plan)
}

fn of(plan: &Plan) -> Result<Table, LaboratoryError> {
    let work = Work::new(plan.side)?;
    let camera = work.camera(ChannelWavelengths::default())?;
    let subpixels = camera.sensor().subpixels().count() as f64;
    let white = WhiteField::new(&camera);
    let (mut curves, mut notes) = (Vec::new(), Vec::new());
    for (name, distance_mm) in DISTANCES {
        let scene = work.scene(&camera, distance_mm, 7)?;
        let reference = mosaic(&camera, &scene, plan.reference, SEEDS[1]);
        for (how, by_white) in [("by the white wall", true), ("plain", false)] {
            let mut points = Vec::new();
            let mut rows = Vec::new();
            for &rays in plan.rays {
                let (seconds, image) = best_of(3, || match by_white {
                    true => mosaic_by_white(&camera, &scene, &white, rays, SEEDS[0]),
                    false => mosaic(&camera, &scene, rays, SEEDS[0]),
                });
                let error = percent(&image, &reference);
                points.push((rays as f64, error));
                let setting = format!(
                    "{rays} per pixel, {} per sub-pixel",
                    rays as f64 / subpixels
                );
                rows.push(Row::new(setting, seconds / work.pixels() * 1e6, error));
            }
            if let Some(power) = power(&points) {
                notes.push(format!(
                    "{name}, {how}: the error falls as N^{power:.2}, N rays (random points: N^-0.5)."
                ));
            }
            let name = format!("{name}, {distance_mm} mm, {how}");
            curves.push(Curve { name, rows });
        }
    }
    notes.push("A ray is splatted on all sub-pixels of its pixel, so rays per pixel and colour are what costs. Below 6 rays per sub-pixel the white wall is not asked.".into());
    Ok(Table {
        knob: "rays",
        work: work.text(),
        reference: format!(
            "{} rays a pixel and colour, other random numbers",
            plan.reference
        ),
        seconds_unit: "s a million microlenses",
        error_unit: "RMS, % of the mean signal",
        curves,
        law: Some(-0.5),
        notes,
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn error_of_the_image_falls_at_least_as_one_over_root_n() {
        let table = of(&Plan {
            side: 8,
            rays: &[16, 64, 256],
            reference: 4096,
        })
        .unwrap();
        for curve in &table.curves {
            let points: Vec<(f64, f64)> = (curve.rows.iter().zip([16.0, 64.0, 256.0]))
                .map(|(r, n)| (n, r.error))
                .collect();
            // 768 values give the RMS to some 5 %, so the exponent over 16 times N to 0.02.
            assert!(
                power(&points).unwrap() < -0.5 + 0.05,
                "{}: {points:?}",
                curve.name
            );
        }
    }
}
