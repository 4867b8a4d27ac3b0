//! What a map is made for, and what was measured of it.

use glam::DVec2;

use crate::field::SensorWindowMm;
use crate::lens::{ExitPupilMap, OpticalSystem};

/// How far a map may err: the place of a ray in the scene, referred to the sensor, at any depth from half of that in
/// focus to infinity.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MapBound {
    /// Root mean square over the rays, px.
    pub rms_px: f64,
    /// Largest, px.
    pub worst_px: f64,
}

impl Default for MapBound {
    fn default() -> Self {
        Self {
            rms_px: 0.01,
            worst_px: 0.1,
        }
    }
}

/// Why there is no map: the lens is traced exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MapFailure {
    /// There is nothing to aim at.
    #[error("no chief ray passes in the middle of the window, or a part of the window is dark")]
    Dark,
    /// Polynomials over the pupil do not converge, or so slowly that they do not pay.
    #[error(
        "over most of the window, polynomials of the highest degree that pays err by more than the bound"
    )]
    Degree,
    /// The lens changes too quickly over the window.
    #[error(
        "with as many nodes as pay, its map errs by more than the bound over most of the window"
    )]
    Nodes,
}

/// What a map is made for.
#[derive(Clone, Copy, Debug)]
pub struct MapTask<'a> {
    /// The lens at one wavelength.
    pub system: &'a OpticalSystem,
    /// Its bundles over the window.
    pub pupils: &'a ExitPupilMap,
    /// Places on the sensor.
    pub window: SensorWindowMm,
    /// Pitch of its pixels, mm.
    pub pitch_mm: f64,
    /// Depth in focus, mm from the first vertex; may be infinite.
    pub focus_mm: f64,
    /// How far it may err.
    pub bound: MapBound,
    /// Rays that are to go through it: making it may take as long as a part of them take to be traced exactly.
    pub rays: usize,
}

/// Part of the time of tracing all rays exactly that making a map may take.
const MAKING_SHARE: f64 = 0.5;

impl MapTask<'_> {
    /// Whether work of so many rays, traced exactly, pays.
    pub(super) fn pays(&self, work_rays: f64) -> bool {
        work_rays <= MAKING_SHARE * self.rays as f64
    }

    /// The place (sensor frame, mm) at −1 to 1 of the window's half width and height.
    pub(super) fn place_mm(&self, part: DVec2) -> DVec2 {
        self.window.centre + part * DVec2::new(self.window.half_width, self.window.half_height)
    }

    /// Places evenly over the window, `side` a side, its corners among them.
    pub(super) fn places_mm(&self, side: usize) -> Vec<DVec2> {
        let at = |i: usize| 2.0 * i as f64 / (side - 1) as f64 - 1.0;
        (0..side * side)
            .map(|k| self.place_mm(DVec2::new(at(k % side), at(k / side))))
            .collect()
    }
}

/// What was measured of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapReport {
    /// Total degree over the pupil of a ray's slopes.
    pub degree: usize,
    /// That of its place, for which less accuracy does.
    pub place_degree: usize,
    /// That of their change within a pixel.
    pub change_degree: usize,
    /// Nodes along the window's width and height.
    pub nodes: (usize, usize),
    /// Surfaces that limit the bundle.
    pub limiting_surfaces: usize,
    /// Error of held-out rays where it is mapped, px.
    pub rms_px: f64,
    /// Largest error of a held-out ray, px.
    pub worst_px: f64,
    /// Part of the bundle so near to its edge that rays are traced exactly.
    pub edge_share: f64,
    /// Part of the window where the bound is not met: all rays are traced exactly there.
    pub unmapped_share: f64,
}

impl MapReport {
    /// The larger of each number.
    pub fn worse(self, other: &Self) -> Self {
        let (a, b) = (self.nodes, other.nodes);
        Self {
            degree: self.degree.max(other.degree),
            place_degree: self.place_degree.max(other.place_degree),
            change_degree: self.change_degree.max(other.change_degree),
            nodes: (a.0.max(b.0), a.1.max(b.1)),
            limiting_surfaces: self.limiting_surfaces.max(other.limiting_surfaces),
            rms_px: self.rms_px.max(other.rms_px),
            worst_px: self.worst_px.max(other.worst_px),
            edge_share: self.edge_share.max(other.edge_share),
            unmapped_share: self.unmapped_share.max(other.unmapped_share),
        }
    }
}
