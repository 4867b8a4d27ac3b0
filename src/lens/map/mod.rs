//! Lens maps. (docs to come)

mod basis;
mod build;
mod edge;
mod frame;
mod kernel;
mod least_squares;
mod node;
mod place;

pub use build::{MapBound, MapFailure, MapReport, MapTask};
pub use place::PlaceBuffers;

use crate::field::SensorWindowMm;
use crate::lens::PacketTracer;
use edge::DIRECTIONS;
use frame::{PupilFrame, SceneFrame};
use kernel::{GRADIENTS, OUTPUTS};

/// See the module.
#[derive(Clone, Debug)]
pub struct LensMap {
    window: SensorWindowMm,
    pupil: PupilFrame,
    scene: SceneFrame,
    /// The lens itself.
    tracer: PacketTracer,
    stop: u16,
    degree: usize,
    gradient_degree: usize,
    /// Surfaces that limit the bundle.
    limits: usize,
    /// How far a ray may start from the place that it is said to start at, along x and y, mm.
    reach_mm: f64,
    /// Rays nearer to the edge than this are doubtful.
    band: f32,
    nodes: (usize, usize),
    constants: Vec<f64>,
    values: Vec<f32>,
    report: MapReport,
}

impl LensMap {
    /// f32 values of a node.
    fn stride(&self) -> usize {
        OUTPUTS * basis::terms(self.degree)
            + GRADIENTS * basis::terms(self.gradient_degree)
            + self.limits * DIRECTIONS
    }

    /// What was measured.
    pub fn report(&self) -> &MapReport {
        &self.report
    }
}
