//! What the pixels of a window see and get, in one channel: centroids of the bundle of each sub-pixel, over the sensor.
//!
//! Bundles are traced at few nodes with many rays each, as their centroids change slowly and their errors do not: by a
//! rule that errs by a ten-thousandth (see `polar_rule`), or by points, 8192 of which err by a third of a thousandth
//! through a pupil with a hard edge; the edges of ideal boxes ask for more.
//! Between the nodes the centroids are cubic, and the Jacobian ∂q̄/∂p is the cubic's slope (see `sight_nodes`).

use glam::{DMat2, DVec2};

use super::bundle::centroids;
use super::sight_line::SightLine;
use super::sight_nodes::SightNodes;
use crate::field::{FieldGrid, FieldRow};
use crate::render::Camera;
use crate::response::ResponseLookup;
use crate::sampling::SobolSet;
use crate::sensor::Subpixels;

/// Rays of a bundle, for a response that is smooth and for one of boxes.
const RAYS: usize = 8192;
const RAYS_OF_BOXES: usize = 16384;
/// Components of a node: the sum's q₀ (2) and q₁ (2), then per sub-pixel q₀, q₁, slope (each relative to the sum's) and
/// weight: 7. After refinement J₀ (4) and J₁ (4) stand in front of them.
pub(super) const SUM: usize = 4;
const PER_SUBPIXEL: usize = 7;
const JACOBIAN: usize = 8;

/// See the module.
#[derive(Clone, Debug)]
pub(super) struct SightField {
    grid: FieldGrid,
    subpixels: usize,
}

/// What one place of the window sees.
#[derive(Clone, Debug)]
pub(super) struct Sight(Vec<f64>);

/// What the places along a line of one y see.
pub(super) struct SightRow(FieldRow);

/// The lines of sight of the places along a line of one y.
pub(super) struct SightLines(FieldRow);

impl SightRow {
    /// At an x.
    pub fn at(&self, x_mm: f64) -> Sight {
        let mut sight = Sight(vec![0.0; self.0.components()]);
        self.read(x_mm, &mut sight);
        sight
    }

    /// The same into a sight that was had before.
    #[inline]
    pub fn read(&self, x_mm: f64, sight: &mut Sight) {
        self.0.sample(x_mm, &mut sight.0);
    }
}

impl SightLines {
    /// Of a field of q₀ (2) and q₁ (2, mm).
    pub fn of(lines: &FieldGrid, y_mm: f64) -> Self {
        Self(lines.row(y_mm, 0, SUM))
    }

    /// At an x.
    #[inline]
    pub fn at(&self, x_mm: f64) -> SightLine {
        let mut c = [0.0; SUM];
        self.0.sample(x_mm, &mut c);
        line(&c)
    }
}

impl SightField {
    /// Tabulates the camera's window in a channel.
    pub fn new(camera: &Camera, channel: usize) -> Self {
        let sensor = camera.sensor();
        let window = sensor.window_mm();
        let subpixels = sensor.subpixels().count();
        let components = SUM + PER_SUBPIXEL * subpixels;
        let is_ideal = matches!(camera.response(), ResponseLookup::Geometric(_));
        let samples = SobolSet::new(if is_ideal { RAYS_OF_BOXES } else { RAYS });
        let traced =
            |p: DVec2| node(camera, channel, p, &samples).unwrap_or_else(|| dark(components));
        let nodes = SightNodes::new(camera, channel, &traced);
        let many = [sensor.width(), sensor.height()].map(FieldGrid::nodes_for);
        let many = (many[0], many[1]);
        let pitch_mm = sensor.pitch_mm();
        let mut refined = Vec::with_capacity(many.0 * many.1 * (JACOBIAN + components));
        for k in 0..many.0 * many.1 {
            let p = FieldGrid::node_mm(window, many, (k % many.0, k / many.0));
            let [values, dx, dy] = nodes.sample(p);
            refined.extend(jacobians([&dx, &dy], pitch_mm).as_flattened());
            refined.extend(values);
        }
        let grid = FieldGrid::new(window, many, JACOBIAN + components, refined)
            .unwrap_or_else(|| unreachable!("components a node"));
        Self { grid, subpixels }
    }

    /// Sub-pixels of a pixel.
    pub fn subpixels(&self) -> usize {
        self.subpixels
    }

    /// What the pixel at `xy_mm` sees.
    pub fn at(&self, xy_mm: DVec2) -> Sight {
        let mut sight = Sight(vec![0.0; self.grid.components()]);
        self.grid.sample(xy_mm, &mut sight.0);
        sight
    }

    /// What the pixels along the line of a y see.
    pub fn row(&self, y_mm: f64) -> SightRow {
        SightRow(self.grid.row(y_mm, 0, self.grid.components()))
    }

    /// Only the lines that all sub-pixels together see from there.
    pub fn lines(&self, y_mm: f64) -> SightLines {
        SightLines(self.grid.row(y_mm, JACOBIAN, SUM))
    }

    /// The line of the places that all sub-pixels together see from `xy_mm`.
    pub fn line(&self, xy_mm: DVec2) -> SightLine {
        let mut c = [0.0; SUM];
        self.grid.sample_from(xy_mm, JACOBIAN, &mut c);
        line(&c)
    }

    /// The largest weight of a sub-pixel in the window, sr.
    pub fn largest_weight_sr(&self) -> f64 {
        let nodes = self.grid.data().chunks_exact(self.grid.components());
        let weights = nodes.flat_map(weights);
        weights.fold(0.0, f64::max)
    }
}

/// J₀ and J₁ of a node, of its slopes per mm.
fn jacobians([dx, dy]: [&[f64]; 2], pitch_mm: f64) -> [[f64; 4]; 2] {
    let column =
        |slope: &[f64], first: usize| DVec2::new(slope[first], slope[first + 1]) * pitch_mm;
    let jacobian = |first| DMat2::from_cols(column(dx, first), column(dy, first));
    [jacobian(0), jacobian(2)].map(|j| j.to_cols_array())
}

impl Sight {
    /// Of a node, with its slopes per mm.
    pub fn of_node(node: &[f64], slopes: [&[f64]; 2], pitch_mm: f64) -> Self {
        let jacobians = jacobians(slopes, pitch_mm).concat();
        Self(jacobians.into_iter().chain(node.iter().copied()).collect())
    }

    /// The line of the places that all sub-pixels together see.
    pub fn line(&self) -> SightLine {
        line(&self.0[JACOBIAN..])
    }

    /// J = J₀ + J₁/D: change of the mean direction per px.
    pub fn jacobian(&self, inverse_depth_per_mm: f64) -> DMat2 {
        let c = &self.0;
        DMat2::from_cols_array(&std::array::from_fn(|k| {
            c[k] + inverse_depth_per_mm * c[4 + k]
        }))
    }

    /// Per sub-pixel q₀ and q₁ (mm) from the sum's, and the slope from the sum's.
    pub fn beside(&self) -> impl Iterator<Item = [DVec2; 3]> {
        let subpixels = self.0[JACOBIAN + SUM..].chunks_exact(PER_SUBPIXEL);
        subpixels.map(|s| [0, 2, 4].map(|k| DVec2::new(s[k], s[k + 1])))
    }

    /// ∫ P cos θ dω of each sub-pixel, sr.
    pub fn weights_sr(&self) -> impl Iterator<Item = f64> {
        weights(&self.0)
    }
}

/// Of q₀ and q₁ of the sum.
fn line(c: &[f64]) -> SightLine {
    SightLine {
        q0: DVec2::new(c[0], c[1]),
        q1_mm: DVec2::new(c[2], c[3]),
    }
}

fn weights(node: &[f64]) -> impl Iterator<Item = f64> {
    let subpixels = node[JACOBIAN + SUM..].chunks_exact(PER_SUBPIXEL);
    subpixels.map(|s| s[PER_SUBPIXEL - 1])
}

/// What the place that mirrors a node's sees; `signs`: of x and y.
pub(super) fn mirrored(node: &[f64], signs: DVec2, subpixels: Subpixels) -> Vec<f64> {
    let signed = |from: &[f64]| {
        let pairs = from.chunks(2).flat_map(|v| match v {
            [x, y] => [Some(x * signs.x), Some(y * signs.y)],
            rest => [rest.first().copied(), None],
        });
        pairs.flatten().collect::<Vec<f64>>()
    };
    let mut mirrored = signed(&node[..SUM]);
    for s in 0..subpixels.count() {
        let from = subpixels.mirrored(s, [signs.x < 0.0, signs.y < 0.0]);
        mirrored.extend(signed(&node[SUM + PER_SUBPIXEL * from..][..PER_SUBPIXEL]));
    }
    mirrored
}

/// A node without light.
fn dark(components: usize) -> Vec<f64> {
    let mut c = vec![f64::NAN; components];
    c.iter_mut()
        .skip(SUM + PER_SUBPIXEL - 1)
        .step_by(PER_SUBPIXEL)
        .for_each(|w| *w = 0.0);
    c
}

/// All components of one node; `None` where no light passes.
fn node(camera: &Camera, channel: usize, p: DVec2, samples: &SobolSet) -> Option<Vec<f64>> {
    let (subpixels, all) = centroids(camera, channel, p, samples)?;
    let mut c = vec![all.q0.x, all.q0.y, all.q1_mm.x, all.q1_mm.y];
    for s in subpixels {
        // A sub-pixel that gets no light at all has no centroid, and so no disparity.
        let dark = if s.weight > 0.0 { 0.0 } else { f64::NAN };
        let (d0, d1, slope) = (s.q0 - all.q0, s.q1_mm - all.q1_mm, s.slope - all.slope);
        c.extend([d0.x, d0.y, d1.x, d1.y, slope.x, slope.y].map(|v| v + dark));
        c.push(s.weight);
    }
    Some(c)
}
