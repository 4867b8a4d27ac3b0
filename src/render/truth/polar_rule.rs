//! Centroids of a pixel's bundle by a rule that follows the edge of what passes the lens.
//!
//! The pupil's ellipse, of semi-diameters a and b (mm), is the image of the unit disk (r, θ). Along evenly spread θ
//! the edge ρ(θ) of what passes is sought from the middle outwards; within it the integral over r is that of Gauss
//! and Legendre:
//!
//! ```text
//! ∫ f dA = ∫∫ f |a × b| r dr dθ = |a × b| Σ_θ Δθ ρ² Σ_k w_k r_k f(ρ r_k, θ)
//! ```
//!
//! f is the response's weight times cos θ dω per area of the pupil's plane, alone or times what the ray sees: smooth
//! within the edge. Points all over the disk err by those that fall on the wrong side of the edge, and are three times
//! as many. The wavelengths of a channel have directions between each other's.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::bundle::Centroid;
use crate::frames::{camera_from_sensor_mm, uv_from_camera_direction};
use crate::lens::{PupilEllipse, last_that_pass};
use crate::rays::RayBatch;
use crate::render::Camera;
use crate::render::tracer::Tracer;
use crate::response::ResponseLookup;
use crate::simd::SimdLevel;

/// Directions of a channel, and the fewest of each wavelength.
const DIRECTIONS: usize = 128;
const FEWEST_DIRECTIONS: usize = 32;
/// Gauss's nodes and weights on (0, 1) for eight points along a direction (Abramowitz & Stegun, table 25.4, halved).
const GAUSS: [(f64, f64); 8] = [
    (0.019_855_071_751_231_9, 0.050_614_268_145_188_2),
    (0.101_666_761_293_186_6, 0.111_190_517_226_687_3),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_7),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_7),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_3),
    (0.980_144_928_248_768_2, 0.050_614_268_145_188_2),
];
/// Where the edge is looked for first: what no aperture clips fills the ellipse to about there.
const FIRST: f64 = 0.95;
/// Places along a direction between which the edge is known.
const END: u32 = 1 << 10;

/// Centroids of each sub-pixel's rays, and of all together, from the sensor position `xy_mm`, at a channel's
/// wavelengths. `None` where the rule does not hold: a response with edges of its own, a bundle that its own middle is
/// not part of, or one with a hole that a ray of the rule meets.
pub(super) fn centroids(
    camera: &Camera,
    channel: usize,
    xy_mm: DVec2,
) -> Option<(Vec<Centroid>, Centroid)> {
    if matches!(camera.response(), ResponseLookup::Geometric(_)) {
        return None;
    }
    let pupil = camera.pupil_at(xy_mm)?;
    let origin = camera_from_sensor_mm(xy_mm, camera.sensor_z_mm());
    let shift_um = camera.shift_at_um(xy_mm).to_array();
    let subpixels = camera.sensor().subpixels().count();
    let colours = camera.colours();
    let shares = colours.count();
    let count = (DIRECTIONS / shares).max(FEWEST_DIRECTIONS);
    let mut of_subpixel = vec![Centroid::default(); subpixels];
    let mut of_all = Centroid::default();
    let mut response = vec![0f32; GAUSS.len() * count * subpixels];
    for wavelength in 0..shares {
        let bundle = Aimed {
            pupil,
            origin,
            tracer: colours.tracer(channel, wavelength),
        };
        let turn = wavelength as f64 / shares as f64;
        let directions: Vec<DVec2> = (0..count)
            .map(|i| DVec2::from_angle(TAU * (i as f64 + turn) / count as f64))
            .collect();
        let edge = bundle.edge(&directions)?;
        let points = directions.iter().zip(&edge);
        let points: Vec<DVec2> = points
            .flat_map(|(&d, &rho)| GAUSS.map(|(r, _)| rho * r * d))
            .collect();
        let (aimed, traced) = bundle.trace(&points);
        if traced.status.iter().any(|s| *s != 0) {
            return None;
        }
        let uv = aimed.iter().map(|d| uv_from_camera_direction(-*d));
        let (mut u, mut v): (Vec<f32>, Vec<f32>) = uv.map(|uv| (uv.x as f32, uv.y as f32)).unzip();
        let lookup = colours.response(colours.response_number(channel, wavelength));
        lookup.weights_under(shift_um, &mut u, &mut v, &mut response);
        let area = pupil.axis_a_mm.perp_dot(pupil.axis_b_mm).abs() * TAU / (count * shares) as f64;
        for (i, d) in aimed.iter().enumerate() {
            let ((r, w), rho) = (GAUSS[i % GAUSS.len()], edge[i / GAUSS.len()]);
            // cos θ dω of the plane's dA at the distance h along z is d_z⁴/h² dA.
            let to_plane_mm = pupil.centre_mm.z - origin.z;
            let measure = area * rho * rho * w * r * d.z.powi(4) / to_plane_mm.powi(2);
            let o = DVec3::new(traced.ox[i], traced.oy[i], traced.oz[i]);
            let m = DVec2::new(traced.dx[i], traced.dy[i]) / traced.dz[i];
            let seen = [-m, o.truncate() - o.z * m, d.truncate() / d.z];
            of_all.incident += measure;
            let weights = &response[i * subpixels..][..subpixels];
            for (s, w) in of_subpixel.iter_mut().zip(weights) {
                let weight = f64::from(*w) * measure;
                s.add(weight, seen);
                of_all.add(weight, seen);
            }
        }
    }
    let normalised = of_subpixel.into_iter().map(|s| s.normalised(1.0));
    (of_all.weight > 0.0).then(|| (normalised.collect(), of_all.normalised(1.0)))
}

/// The rays of a place through its pupil's ellipse.
struct Aimed<'a> {
    pupil: PupilEllipse,
    /// Camera frame, mm.
    origin: DVec3,
    tracer: &'a Tracer,
}

impl Aimed<'_> {
    /// Unit directions to points of the unit disk, and the rays traced.
    fn trace(&self, points: &[DVec2]) -> (Vec<DVec3>, RayBatch) {
        let PupilEllipse {
            centre_mm,
            axis_a_mm,
            axis_b_mm,
        } = self.pupil;
        let towards = |p: &DVec2| {
            let target = centre_mm + (p.x * axis_a_mm + p.y * axis_b_mm).extend(0.0);
            (target - self.origin).normalize()
        };
        let directions: Vec<DVec3> = points.iter().map(towards).collect();
        let mut batch = RayBatch::with_capacity(points.len());
        directions.iter().for_each(|&d| batch.push(self.origin, d));
        self.tracer.trace_backward(&mut batch, SimdLevel::detect());
        (directions, batch)
    }

    /// How far out along each direction rays pass, at most 1; `None` where the middle does not.
    fn edge(&self, directions: &[DVec2]) -> Option<Vec<f64>> {
        let rim: Vec<DVec2> = directions.iter().copied().chain([DVec2::ZERO]).collect();
        let (_, rim) = self.trace(&rim);
        let (middle, rim) = rim.status.split_last()?;
        if *middle != 0 {
            return None;
        }
        let known = rim.iter().map(|status| (*status == 0).then_some(END));
        let last = last_that_pass(known.collect(), END, &mut |questions| {
            let points = questions.iter();
            let points: Vec<DVec2> = points
                .map(|&(i, place)| bracket(place)[0] * directions[i])
                .collect();
            let (_, traced) = self.trace(&points);
            traced.status.iter().map(|status| *status == 0).collect()
        });
        let edge = last.iter().map(|&last| match last == END {
            true => 1.0,
            false => bracket(last).iter().sum::<f64>() / 2.0,
        });
        Some(edge.collect())
    }
}

/// Place `number` of the [`END`] along a direction, and the next: what bisections find whose first one asks at
/// [`FIRST`].
fn bracket(number: u32) -> [f64; 2] {
    let (mut low, mut high) = (0.0, 1.0);
    let (mut middle, mut half) = (FIRST, END / 2);
    let mut above = number;
    while half > 0 {
        match above >= half {
            true => (low, above) = (middle, above - half),
            false => high = middle,
        }
        (middle, half) = (0.5 * (low + high), half / 2);
    }
    [low, high]
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::super::bundle::of_points;
    use super::*;
    use crate::em::{Level, PixelStack, Preset};
    use crate::lens::{FocusBy, Lens, Prescription, builtin_names};
    use crate::response::{GeometricResponse, Response, TableSettings, build_table};
    use crate::sampling::SobolSet;
    use crate::sensor::{Sensor, ShiftRule, Subpixels};
    use crate::spectrum::{Bands, ChannelWavelengths};

    type Found = (Vec<Centroid>, Centroid);

    /// Largest difference of weights, over the sum's, and of what is seen through the pupil, over its semi-diameter at
    /// the sensor's side (slope) and before the lens (mm).
    fn apart(a: &Found, b: &Found, [slope, mm]: [f64; 2]) -> f64 {
        let pairs = a.0.iter().chain([&a.1]).zip(b.0.iter().chain([&b.1]));
        let errors = pairs.flat_map(|(x, y)| {
            [
                (x.weight - y.weight).abs() / b.1.weight,
                (x.incident - y.incident).abs() / b.1.incident,
                (x.slope - y.slope).length() / slope,
                (x.q1_mm - y.q1_mm).length() / mm,
            ]
        });
        errors.fold(0.0, f64::max)
    }

    #[test]
    fn the_rule_is_nearer_to_many_points_than_8192_points_are() {
        let stack = PixelStack::builtin("2.8um").unwrap();
        let settings = TableSettings::new(Level::Wave, Preset::Standard, &stack);
        let built = build_table(&stack, &settings, None, &|_, _| ()).unwrap();
        let response = Response::Table(built.table);
        let (few, many) = (SobolSet::new(8192), SobolSet::new(1 << 17));
        let plain = ChannelWavelengths::default();
        let banded = ChannelWavelengths::from_bands(Bands::default()).unwrap();
        let mut errors: Vec<[f64; 2]> = Vec::new();
        for name in builtin_names() {
            let prescription = Prescription::builtin(name).unwrap();
            let lens = Lens::new(&prescription).unwrap();
            let focus_mm = 50.0 * lens.paraxial(550.0).unwrap().efl_mm;
            let lens = lens.focused_at(focus_mm, FocusBy::Sensor, 550.0).unwrap();
            let paraxial = lens.paraxial(550.0).unwrap();
            let semi = 0.5 / paraxial.f_number;
            let last_mm = (prescription.stated.image_height_mm).unwrap_or(0.2 * paraxial.efl_mm);
            for (part, bands) in [(0.0, plain), (0.35, plain), (0.7, plain), (0.7, banded)] {
                let place = DVec2::new(0.8, 0.6) * part * last_mm;
                let sensor = Sensor::new(2.8, response.subpixels(), (16, 16), place).unwrap();
                let camera = Camera::new(&lens, sensor, ShiftRule::ChiefRay, &response, bands);
                let camera = camera.unwrap();
                let truth = of_points(&camera, 0, place, &many).unwrap();
                let found = [
                    centroids(&camera, 0, place).unwrap(),
                    of_points(&camera, 0, place, &few).unwrap(),
                ];
                let pupil = [semi, semi * paraxial.efl_mm];
                let [rule, points] = found.map(|f| apart(&f, &truth, pupil));
                println!("{name} {part}: rule {rule:.2e}, points {points:.2e}");
                errors.push([rule, points]);
            }
        }
        let rms = |of: usize| {
            let squares: f64 = errors.iter().map(|e| e[of] * e[of]).sum();
            (squares / errors.len() as f64).sqrt()
        };
        println!("RMS {:.2e}, of points {:.2e}", rms(0), rms(1));
        // Of sixteen times as many points the error is an eighth.
        let near = |[rule, points]: &[f64; 2]| *rule < 2.5e-4 + points / 8.0;
        assert!(
            errors.iter().all(near) && rms(0) < 0.4 * rms(1),
            "{errors:?}"
        );
    }

    /// A middle that no light comes from, and a response of boxes, are left to points.
    #[test]
    fn what_the_rule_does_not_hold_for_is_left() {
        let lens = Lens::new(&Prescription::builtin("lib_dgauss_50mm").unwrap()).unwrap();
        let subpixels = Subpixels::new(2, 2).unwrap();
        let boxes = GeometricResponse::new(subpixels, 4.0, 10.0).unwrap();
        let response = Response::Geometric(boxes);
        let sensor = Sensor::new(4.0, subpixels, (16, 16), DVec2::ZERO).unwrap();
        let bands = ChannelWavelengths::default();
        let camera = Camera::new(&lens, sensor, ShiftRule::ChiefRay, &response, bands).unwrap();
        assert!(centroids(&camera, 0, DVec2::ZERO).is_none());
        let aimed = Aimed {
            pupil: camera.pupil_at(DVec2::ZERO).unwrap(),
            // Far beside the image circle.
            origin: camera_from_sensor_mm(DVec2::X * 100.0, camera.sensor_z_mm()),
            tracer: camera.colours().tracer(0, 0),
        };
        assert_eq!(aimed.edge(&[DVec2::X]), None);
    }
}
