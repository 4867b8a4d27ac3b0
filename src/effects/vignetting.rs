//! How much light the apertures beside the stop take.

use glam::DVec2;
use rayon::prelude::*;

use crate::frames::camera_from_sensor_mm;
use crate::lens::{Clipping, Travel, trace_visiting};
use crate::rays::Ray;
use crate::render::Camera;
use crate::sampling::{SobolSet, concentric_disk};
use crate::spectrum::ChannelWavelengths;

const RAYS: usize = 256;
/// The paraxial exit pupil is looked at this much larger: pupils move and grow off the axis.
const MARGIN: f64 = 1.3;

/// RMS over the corners and the middle of the window of the part of the stop's light that other apertures take; `None`
/// for bare pixels.
pub(super) fn lost_light(camera: &Camera) -> Option<f64> {
    let p = camera.paraxial()?;
    let (pupil_z, semi) = (p.exit_pupil_z_mm, MARGIN * p.exit_pupil_semi_mm);
    if !(pupil_z.is_finite() && semi.is_finite()) {
        return None;
    }
    let system = camera.system(ChannelWavelengths::REFERENCE);
    let w = camera.sensor().window_mm();
    let samples = SobolSet::new(RAYS);
    let (mut a, mut b) = (vec![0.0; RAYS], vec![0.0; RAYS]);
    samples.fill(2, 1, 0, &mut a);
    samples.fill(3, 1, 0, &mut b);
    let places = [
        (0.0, 0.0),
        (-1.0, -1.0),
        (1.0, -1.0),
        (-1.0, 1.0),
        (1.0, 1.0),
    ];
    let lost = places.par_iter().map(|&(x, y)| {
        let place = w.centre + DVec2::new(x * w.half_width, y * w.half_height);
        let origin_mm = camera_from_sensor_mm(place, camera.sensor_z_mm());
        let (mut by_stop, mut by_all) = (0.0, 0.0);
        for (&a, &b) in a.iter().zip(&b) {
            let (p, q) = concentric_disk(a, b);
            let aim = (DVec2::new(p, q) * semi).extend(pupil_z) - origin_mm;
            let ray = Ray {
                origin_mm,
                direction: aim.normalize(),
            };
            let passes = |clipping| {
                trace_visiting(system, ray, Travel::Backward, clipping, |_, _| {}).is_ok()
            };
            if passes(Clipping::StopOnly) {
                by_stop += 1.0;
                by_all += f64::from(u8::from(passes(Clipping::All)));
            }
        }
        if by_stop > 0.0 {
            1.0 - by_all / by_stop
        } else {
            0.0
        }
    });
    let lost: Vec<f64> = lost.collect();
    let squares: f64 = lost.iter().map(|l| l * l).sum();
    Some((squares / lost.len() as f64).sqrt())
}
