//! The nodes that a field of sight is traced at, and the field between them.
//!
//! What the centroids are from one guiding ray per place, which takes the distortion out, changes slowly; the guiding
//! rays are cheap. So the nodes begin far apart, and are halved in distance until what is traced between them is met.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::Defocus;
use super::sight_field::{SUM, Sight, mirrored as mirrored_node};
use super::sight_line::SightLine;
use crate::field::{CubicGrid, FieldGrid, mirrored};
use crate::frames::camera_from_sensor_mm;
use crate::rays::RayBatch;
use crate::render::Camera;
use crate::simd::SimdLevel;

/// Distance of nodes, px: of the guiding rays and, at the least, of all; and those that are tried before.
const NODES_PX: usize = 48;
const COARSER_PX: [usize; 2] = [192, 96];
/// Errors between nodes that are let pass: of a place or a disparity, px, and so much of the circle of confusion, which
/// is about that of the rays themselves; of a weight, parts of the largest.
const ERROR_PX: f64 = 0.005;
const ERROR_OF_BLUR: f64 = 5e-4;
const ERROR_OF_WEIGHT: f64 = 2e-3;
/// Depths at which they are looked at, in inverse distances of the focus.
const DEPTHS: [f64; 3] = [0.0, 1.0, 2.0];

/// See the module.
pub(super) struct SightNodes {
    cubic: CubicGrid,
    /// Lines of the guiding rays, where every place has one.
    guide: Option<CubicGrid>,
}

impl SightNodes {
    /// Traces a channel of a camera by `traced(place_mm)`, which gives a node's values, those of the sum's line first.
    pub fn new(
        camera: &Camera,
        channel: usize,
        traced: &(dyn Fn(DVec2) -> Vec<f64> + Sync),
    ) -> Self {
        let sensor = camera.sensor();
        let window = sensor.window_mm();
        let size = |every_px: usize| {
            let along = |length| CubicGrid::nodes_for(length, every_px);
            (along(sensor.width()), along(sensor.height()))
        };
        let guide = guide(camera, channel, size(NODES_PX));
        let traced = |p: DVec2| {
            let mut values = traced(p);
            if let Some(guide) = &guide {
                let [line, ..] = guide.sample(p);
                values.iter_mut().zip(line).for_each(|(v, l)| *v -= l);
            }
            values
        };
        let is_mirrored = camera.is_mirrored();
        let cubic = |size: (usize, usize)| {
            let place = |k: usize| FieldGrid::node_mm(window, size, (k % size.0, k / size.0));
            let first = |k: usize| match is_mirrored {
                true => mirrored(k, size),
                false => (k, DVec2::ONE),
            };
            let count = size.0 * size.1;
            let known = (0..count).into_par_iter();
            let known: Vec<Vec<f64>> = known
                .map(|k| match first(k).0 == k {
                    true => traced(place(k)),
                    false => Vec::new(),
                })
                .collect();
            let nodes: Vec<Vec<f64>> = (0..count)
                .map(|k| {
                    let (first, signs) = first(k);
                    mirrored_node(&known[first], signs, sensor.subpixels())
                })
                .collect();
            CubicGrid::new(window, size, nodes[0].len(), nodes.concat())
                .unwrap_or_else(|| unreachable!("four nodes a side, as many values each"))
        };
        let bounds = Bounds::new(camera);
        let slopes = |p: DVec2| guide.as_ref().map(|guide| guide.sample(p));
        let is_met = |cubic: &CubicGrid, size| {
            let places = CubicGrid::tests_mm(window, size, is_mirrored);
            places.par_iter().all(|&p| {
                let between = with_guide(cubic.sample(p), slopes(p));
                let [there, ..] = with_guide([traced(p), Vec::new(), Vec::new()], slopes(p));
                bounds.are_met(&between, &there)
            })
        };
        let last = size(NODES_PX);
        let mut sizes = COARSER_PX.map(size).to_vec();
        sizes.dedup();
        let mut coarser = sizes.into_iter().filter(|size| *size != last);
        let met = coarser.find_map(|size| Some(cubic(size)).filter(|cubic| is_met(cubic, size)));
        let cubic = met.unwrap_or_else(|| cubic(last));
        Self { cubic, guide }
    }

    /// Values at a place within the window, and their slopes along x and y, per mm.
    pub fn sample(&self, xy_mm: DVec2) -> [Vec<f64>; 3] {
        let line = self.guide.as_ref().map(|guide| guide.sample(xy_mm));
        with_guide(self.cubic.sample(xy_mm), line)
    }
}

/// Values and slopes with those of the guiding ray.
fn with_guide(mut values: [Vec<f64>; 3], line: Option<[Vec<f64>; 3]>) -> [Vec<f64>; 3] {
    for (values, line) in values.iter_mut().zip(line.into_iter().flatten()) {
        values.iter_mut().zip(line).for_each(|(v, l)| *v += l);
    }
    values
}

/// Lines of the rays from each place through the middle of the paraxial exit pupil; `None` where one of them is lost.
fn guide(camera: &Camera, channel: usize, size: (usize, usize)) -> Option<CubicGrid> {
    let window = camera.sensor().window_mm();
    let pupil_z_mm = camera.paraxial()?.exit_pupil_z_mm;
    let mut batch = RayBatch::default();
    for k in 0..size.0 * size.1 {
        let place = FieldGrid::node_mm(window, size, (k % size.0, k / size.0));
        let origin = camera_from_sensor_mm(place, camera.sensor_z_mm());
        let towards = DVec3::new(0.0, 0.0, pupil_z_mm) - origin;
        // A pupil at infinity: along the axis.
        let away = (towards * -towards.z.signum()).try_normalize();
        batch.push(origin, away.unwrap_or(DVec3::NEG_Z));
    }
    let colours = camera.colours();
    let tracer = colours.tracer(channel, colours.count() / 2);
    tracer.trace_backward(&mut batch, SimdLevel::detect());
    let mut lines = Vec::with_capacity(SUM * batch.len());
    for i in 0..batch.len() {
        let line = SightLine::from_ray(&batch.get(i).ok()?);
        lines.extend([line.q0.x, line.q0.y, line.q1_mm.x, line.q1_mm.y]);
    }
    CubicGrid::new(window, size, SUM, lines)
}

/// What may be missed between nodes.
struct Bounds {
    pitch_mm: f64,
    /// Inverse depths, per mm, and what a place or a disparity may err by there, px.
    depths: Vec<(f64, f64)>,
}

impl Bounds {
    fn new(camera: &Camera) -> Self {
        let pitch_mm = camera.sensor().pitch_mm();
        let depths = |defocus: Defocus| {
            DEPTHS.map(|part| {
                let inverse = part / camera.focus_distance_mm();
                let blur_px = defocus.circle_of_confusion_mm(1.0 / inverse).abs() / pitch_mm;
                (inverse, ERROR_PX + ERROR_OF_BLUR * blur_px)
            })
        };
        Self {
            pitch_mm,
            depths: Defocus::new(camera).map_or(Vec::new(), |defocus| depths(defocus).to_vec()),
        }
    }

    /// Whether values and their slopes per mm, as they are between nodes, meet what is traced there.
    fn are_met(&self, [between, dx, dy]: &[Vec<f64>; 3], traced: &[f64]) -> bool {
        let [between, traced] =
            [between, traced].map(|node| Sight::of_node(node, [dx, dy], self.pitch_mm));
        let largest = traced.weights_sr().fold(0.0, f64::max);
        let mut weights = between.weights_sr().zip(traced.weights_sr());
        // Written so that NaN fails.
        weights.all(|(a, b)| (a - b).abs() <= ERROR_OF_WEIGHT * largest)
            && self.depths.iter().all(|&(inverse, error_px)| {
                let to_px = between.jacobian(inverse).inverse();
                let near = |[a0, a1]: [DVec2; 2], [b0, b1]: [DVec2; 2]| {
                    let error = to_px * (a0 - b0 + inverse * (a1 - b1));
                    error.length() <= error_px
                };
                let line = |sight: &Sight| [sight.line().q0, sight.line().q1_mm];
                let mut views = between.beside().zip(traced.beside());
                near(line(&between), line(&traced))
                    && views.all(|([a0, a1, _], [b0, b1, _])| near([a0, a1], [b0, b1]))
            })
    }
}
