//! What a ray stands for on a card: not a point of its picture but the area that a quarter of its pixel sees.
//!
//! All places of a quarter of a pixel that look through one point of the pupil meet a card in a parallelogram (H.
//! Igehy, *Tracing ray differentials*, SIGGRAPH 1999; the differentials are found here by tracing at the nodes of a
//! grid over the window). So a ray looks up the mean over that parallelogram, in a picture that was averaged once,
//! by its second moments ([`WindowMoments`]). Its mirror image in the pixel, through the same point of the pupil, does
//! so, too; it may meet another card (`look.rs`). Quarters have as many rays each. What a pixel holds of fine detail is
//! hardly noise any more. Contrast is that of points to some thousandths, down to periods of two pixels.
//!
//! Cards that are seen at angles too different for that are looked up at points.

use std::sync::Arc;

use glam::{DMat2, DVec2, DVec3};

use super::camera::Camera;
use crate::field::FieldGrid;
use crate::frames::camera_from_sensor_mm;
use crate::rays::RayBatch;
use crate::scene::texture::{Texture, WindowMoments};
use crate::scene::{Scene, TexturedPlane};
use crate::simd::SimdLevel;

/// Nodes along each side of the window.
const NODES: usize = 17;
/// Largest change of contrast at two pixels a period.
const TRANSFER: f64 = 0.005;
/// A card's nodes are those that see it, or what lies so far beside it, in parts of its sides.
const BESIDE: f64 = 0.5;

/// The cards of a scene as pixels see them: for [`Render::footprints`](super::Render::footprints).
#[derive(Clone, Debug)]
pub struct Footprints {
    scene: Scene,
    /// How s and t change with x and y of the sensor frame, per mm: columns of a matrix. `None`: looked up at points.
    slopes: Vec<Option<FieldGrid>>,
    pitch_mm: f64,
}

/// How s and t of a card change with the place in a pixel, per px.
pub(super) type Slopes = [f32; 4];

impl Footprints {
    /// Of the cards that a camera sees; `None` where no card has any.
    pub fn new(camera: &Camera, scene: &Scene) -> Option<Self> {
        if scene.planes().is_empty() {
            return None;
        }
        let window = camera.sensor().window_mm();
        let place =
            |node: usize| FieldGrid::node_mm(window, (NODES, NODES), (node % NODES, node / NODES));
        let sights = Sights::traced(camera, (0..NODES * NODES).map(place));
        let pitch_mm = camera.sensor().pitch_mm();
        let mut planes = scene.planes().to_vec();
        let slopes: Vec<Option<FieldGrid>> = (planes.iter_mut())
            .map(|plane| {
                let nodes = sights.on(plane)?;
                let quarter = Quarter::new(&nodes, pitch_mm)?;
                let smoothed = plane
                    .texture()
                    .smoothed(|s, t| quarter.moments(plane.texture(), s, t))?;
                *plane = plane.with_texture(Arc::new(smoothed));
                let slopes = nodes.iter().flat_map(|node| node.slopes.to_cols_array());
                FieldGrid::new(window, (NODES, NODES), 4, slopes.collect())
            })
            .collect();
        slopes.iter().any(Option::is_some).then(|| Self {
            scene: scene.with_planes(planes),
            slopes,
            pitch_mm,
        })
    }

    /// The scene, of which cards have averaged pictures.
    pub(super) fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Adds the slopes of all cards at a place; 0 of those that are looked up at points.
    pub(super) fn add_slopes(&self, place_mm: DVec2, slopes: &mut Vec<Slopes>) {
        slopes.extend(self.slopes.iter().map(|card| {
            let mut here = [0.0; 4];
            if let Some(card) = card {
                card.sample(place_mm, &mut here);
            }
            here.map(|slope| (slope * self.pitch_mm) as f32)
        }));
    }
}

/// Rays from around each node through one point of the pupil: from the node, and half a pixel beside it.
struct Sights {
    batch: RayBatch,
    pitch_mm: f64,
}

/// From a node, px.
const AROUND: [[f64; 2]; 5] = [[0.0, 0.0], [-0.5, 0.0], [0.5, 0.0], [0.0, -0.5], [0.0, 0.5]];

impl Sights {
    fn traced(camera: &Camera, places_mm: impl Iterator<Item = DVec2>) -> Self {
        let pitch_mm = camera.sensor().pitch_mm();
        let mut batch = RayBatch::with_capacity(NODES * NODES * AROUND.len());
        for place_mm in places_mm {
            let towards = camera.pupil_at(place_mm).map(|pupil| pupil.centre_mm);
            for beside in AROUND {
                let from = place_mm + pitch_mm * DVec2::from(beside);
                let origin = camera_from_sensor_mm(from, camera.sensor_z_mm());
                // Without a pupil: away from the scene, so that nothing is met.
                let towards = towards.unwrap_or(origin + DVec3::X);
                batch.push(origin, (towards - origin).normalize());
            }
        }
        (camera.reference_tracer()).trace_backward(&mut batch, SimdLevel::detect());
        Self { batch, pitch_mm }
    }

    /// What the nodes see of a card; where a node does not, as the nearest that does. `None` where there is none.
    fn on(&self, plane: &TexturedPlane) -> Option<Vec<Node>> {
        let at = |node: usize| {
            let rays = node * AROUND.len()..(node + 1) * AROUND.len();
            let met: Vec<DVec2> = rays
                .filter(|&i| self.batch.failure(i).is_none())
                .filter_map(|i| plane.crossing(&self.batch.ray(i)))
                .collect();
            let [met, left, right, above, below] = met.try_into().ok()?;
            let slopes = DMat2::from_cols(right - left, below - above) * (1.0 / self.pitch_mm);
            let near = |x: f64| (-BESIDE..=1.0 + BESIDE).contains(&x);
            let is_seen = near(met.x) && near(met.y);
            (slopes.determinant() != 0.0 && slopes.is_finite()).then_some(Node {
                met,
                slopes,
                is_seen,
            })
        };
        let nodes: Vec<Option<Node>> = (0..NODES * NODES).map(at).collect();
        let nearest = |number: usize| {
            let apart = |other: usize| {
                let along = |a: usize, b: usize| a.abs_diff(b).pow(2);
                along(number % NODES, other % NODES) + along(number / NODES, other / NODES)
            };
            let known = (0..nodes.len()).filter(|&other| nodes[other].is_some());
            let node = nodes[known.min_by_key(|&other| apart(other))?]?;
            Some(Node {
                is_seen: false,
                ..node
            })
        };
        (0..nodes.len())
            .map(|number| nodes[number].or_else(|| nearest(number)))
            .collect()
    }
}

/// What a node of the window sees of a card.
#[derive(Clone, Copy)]
struct Node {
    /// (s, t) in the middle.
    met: DVec2,
    /// How s and t change over the sensor, per mm.
    slopes: DMat2,
    /// The card, or what is not far beside it.
    is_seen: bool,
}

/// Second moments of what a quarter of a pixel sees of a card, in parts of its sides, by where on it.
struct Quarter(Vec<(DVec2, DMat2)>);

impl Quarter {
    /// `None` where the card is not seen, or neighbouring nodes see it so differently that this is not good enough.
    fn new(nodes: &[Node], pitch_mm: f64) -> Option<Self> {
        let variance = (0.5 * pitch_mm).powi(2) / 12.0;
        let own = |node: &Node| node.slopes * node.slopes.transpose() * variance;
        // By how much an area half way to another node is too large or too small, over a quarter's own.
        let off = |node: &Node, other: &Node| {
            let back = node.slopes.inverse() * (1.0 / variance.sqrt());
            0.5 * largest_turn(back * own(other) * back.transpose() - DMat2::IDENTITY)
        };
        let pairs = (0..nodes.len()).flat_map(|node| {
            let beside = (node % NODES + 1 < NODES).then_some(node + 1);
            [beside, Some(node + NODES)]
                .into_iter()
                .flatten()
                .map(move |other| (node, other))
        });
        let seen = |node: usize| nodes.get(node).filter(|node| node.is_seen);
        let worst = pairs
            .filter_map(|(node, other)| Some(off(seen(node)?, seen(other)?)))
            .fold(0.0, |most: f64, off| if off <= most { most } else { off });
        // Of a window with the variance v px² the contrast at a period of 2 px is 1 − (2π/2)² v/2.
        let change = 0.5 * std::f64::consts::PI.powi(2) * worst / 48.0;
        let all: Vec<(DVec2, DMat2)> = (nodes.iter())
            .filter(|node| node.is_seen)
            .map(|node| (node.met, own(node)))
            .collect();
        (change <= TRANSFER && !all.is_empty()).then_some(Self(all))
    }

    /// Between the nodes by D. Shepard's weights (Proc. ACM National Conference, 517 (1968)).
    fn moments(&self, picture: &Texture, s: f64, t: f64) -> WindowMoments {
        let (mut sum, mut weights) = (DMat2::ZERO, 0.0);
        for (met, moments) in &self.0 {
            let weight = (met.distance_squared(DVec2::new(s, t)) + 1e-12).powi(-2);
            sum += *moments * weight;
            weights += weight;
        }
        let [ss, st, _, tt] = (sum * (1.0 / weights)).to_cols_array();
        let (width, height) = (picture.width() as f64, picture.height() as f64);
        WindowMoments {
            ss: ss * width * width,
            st: st * width * height,
            tt: tt * height * height,
        }
    }
}

/// Largest |eigenvalue| of a symmetric matrix.
fn largest_turn(m: DMat2) -> f64 {
    let [a, b, _, d] = m.to_cols_array();
    0.5 * (a + d).abs() + (0.25 * (a - d) * (a - d) + b * b).sqrt()
}
