//! A map as it is kept.

use super::basis::terms;
use super::edge::DIRECTIONS;
use super::frame::{CHANGES, PupilFrame, SceneFrame};
use super::task::MapReport;
use crate::field::SensorWindowMm;
use crate::lens::PacketTracer;

/// What tracing through a lens gives, as polynomials over the pupil of each place of a window.
#[derive(Clone, Debug)]
pub struct LensMap {
    pub(super) window: SensorWindowMm,
    pub(super) pupil: PupilFrame,
    pub(super) scene: SceneFrame,
    /// The lens itself.
    pub(super) tracer: PacketTracer,
    pub(super) stop: u16,
    /// Of a ray's slopes.
    pub(super) degree: usize,
    /// Of its place.
    pub(super) place_degree: usize,
    pub(super) change_degree: usize,
    /// Surfaces that limit the bundle.
    pub(super) limiting: Vec<usize>,
    /// How far a ray may start from the place that it is said to start at, along x and y, mm.
    pub(super) reach_mm: f64,
    /// The same for a ray that diffraction displaces: the farther it goes, the more it may err.
    pub(super) far_mm: f64,
    /// Rays nearer to the edge than this are doubtful: for each cell of four nodes, row after row, of rays from the
    /// place itself and from as far beside it as the map reaches. Infinite where it does not hold.
    pub(super) bands: Vec<[f32; 2]>,
    pub(super) nodes: (usize, usize),
    pub(super) constants: Vec<f64>,
    pub(super) values: Vec<f32>,
    pub(super) report: MapReport,
}

impl LensMap {
    /// f32 values of a node.
    pub(super) fn stride(&self) -> usize {
        2 * (terms(self.place_degree) + terms(self.degree))
            + CHANGES * terms(self.change_degree)
            + self.limiting.len() * DIRECTIONS
    }

    /// Of slopes, place and change.
    pub(super) fn degrees(&self) -> [usize; 3] {
        [self.degree, self.place_degree, self.change_degree]
    }

    /// How far from the place that it is said to start at a ray is still mapped, along x and y, mm: its start errs by
    /// no more than a hundredth of that way (RMS of held-out rays; a tenth at worst).
    pub fn far_mm(&self) -> f64 {
        self.far_mm
    }

    /// What was measured.
    pub fn report(&self) -> &MapReport {
        &self.report
    }
}
