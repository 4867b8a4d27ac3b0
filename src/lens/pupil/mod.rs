//! The exit pupil as each sensor position sees it: bounds of the bundle that passes the lens, so that no ray is wasted.
//!
//! Traced backward from a sensor position, the rays that pass fill a region of the plane at the exit pupil's z: a disk
//! on the axis, a cat's eye in the vignetted field. An ellipse around it is tabulated over the sensor window:
//!
//! ```text
//! p = centre + a·axis_a + b·axis_b ,  a² + b² ≤ 1        area = π |axis_a × axis_b|
//! ```
//!
//! At each node of a grid of sensor positions the region's edge is traced and the smallest ellipse is put around it.
//! Between nodes, centre and axes (columns of the symmetric root of the shape, so that they do not turn about in
//! circles) are interpolated linearly. How far that errs is measured where it would be worse: over patches of 2×2
//! cells, interpolated from their corners alone, against the edges traced at the nodes between. Half the spacing at
//! least halves the error (quarters it, where no aperture begins to clip), so the ellipses grow by half of what stuck
//! out there. The idea of tabulated bounds is that of Pharr, Jakob & Humphreys, Physically Based Rendering, section
//! 6.4.5; there they are boxes.

mod edge;
mod ellipse;
mod outline;

use glam::{DMat2, DVec2, DVec3};
use rayon::prelude::*;

use super::packet::PacketTracer;
use super::paraxial::Paraxial;
use super::system::OpticalSystem;
use crate::field::{SensorWindowMm, mirrored};
use crate::simd::SimdLevel;
pub(crate) use edge::last_that_pass;
use ellipse::Ellipse;
use outline::Aim;

/// Nodes along each side of the window, an odd number: the few that are tried first, and the many.
const SIDES: [usize; 2] = [9, 17];
/// Growth up to which the few do: rays that pass beside the bundle cost as much as the others.
const GROWTH: f64 = 1.003;
/// Every ellipse is this much larger than what was found: the edge is sampled, and bends between the nodes.
const MARGIN: f64 = 1.012;

/// An ellipse in a plane z = const of the camera frame, by its centre and two conjugate semi-diameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PupilEllipse {
    /// Centre, mm.
    pub centre_mm: DVec3,
    /// One semi-diameter (x, y), mm.
    pub axis_a_mm: DVec2,
    /// The conjugate one, mm.
    pub axis_b_mm: DVec2,
}

impl PupilEllipse {
    /// Its area, mm².
    pub fn area_mm2(&self) -> f64 {
        std::f64::consts::PI * self.axis_a_mm.perp_dot(self.axis_b_mm).abs()
    }
}

/// Bounds of the passing bundle over a sensor window.
#[derive(Clone, Debug)]
pub struct ExitPupilMap {
    window: SensorWindowMm,
    plane_z_mm: f64,
    /// Nodes along each side of the window.
    side: usize,
    /// Row by row; `None` where nothing passes.
    nodes: Vec<Option<Ellipse>>,
    /// Growth in each of the patches of 2×2 cells.
    growth: Vec<f64>,
    /// At every node its place (sensor frame, mm) and the bundle's edge (camera frame, mm).
    outlines: Vec<(DVec2, Vec<DVec3>)>,
}

impl ExitPupilMap {
    /// Traces the bounds over `window` (sensor frame). An ellipse holds the bundle of every one of `systems`: the same
    /// lens at one or more wavelengths, of which three are looked at. Without systems, or without surfaces, nothing
    /// passes.
    pub fn new(systems: &[OpticalSystem], window: SensorWindowMm) -> ExitPupilMap {
        let Some(first) = systems.first().filter(|s| !s.surfaces.is_empty()) else {
            return Self::dark(window, SIDES[0], 0.0);
        };
        let (plane_z_mm, pupil_semi_mm) = aim_plane(first);
        let systems = few(systems);
        // What is the same around the axis mirrors itself in a window on it.
        let is_mirrored =
            window.is_on_axis() && systems.iter().all(|system| system.is_rotational());
        let aim = Aim {
            is_mirrored,
            tracers: systems.iter().map(|s| PacketTracer::new(s)).collect(),
            systems,
            plane_z_mm,
            pupil_semi_mm,
            level: SimdLevel::detect(),
        };
        let few = Self::traced(&aim, window, SIDES[0], None);
        match few.growth.iter().all(|g| *g <= GROWTH) {
            true => few,
            false => Self::traced(&aim, window, SIDES[1], Some(few)),
        }
    }

    /// Nothing passes.
    fn dark(window: SensorWindowMm, side: usize, plane_z_mm: f64) -> Self {
        Self {
            window,
            plane_z_mm,
            side,
            nodes: vec![None; side * side],
            growth: vec![1.0; (side / 2) * (side / 2)],
            outlines: Vec::new(),
        }
    }

    /// `known`: a map whose nodes are every second of these.
    fn traced(aim: &Aim<'_>, window: SensorWindowMm, side: usize, known: Option<Self>) -> Self {
        let mut map = Self::dark(window, side, aim.plane_z_mm);
        let known = known.filter(|map| 2 * map.side - 1 == side);
        let edge = |i: usize| {
            let (column, row) = (i % side, i / side);
            match &known {
                Some(known) if column % 2 == 0 && row % 2 == 0 => {
                    let (_, edge) = &known.outlines[row / 2 * known.side + column / 2];
                    edge.iter().map(|p| p.truncate()).collect()
                }
                _ => aim.outline(map.position_mm(column, row)),
            }
        };
        let first = |i: usize| match aim.is_mirrored {
            true => mirrored(i, (side, side)),
            false => (i, DVec2::ONE),
        };
        let nodes = (0..side * side).into_par_iter();
        let mut edges: Vec<Vec<DVec2>> = nodes
            .map(|i| match first(i).0 == i {
                true => edge(i),
                false => Vec::new(),
            })
            .collect();
        map.nodes = (edges.par_iter())
            .map(|edge| (!edge.is_empty()).then(|| Ellipse::around(edge).grown(MARGIN)))
            .collect();
        for i in 0..edges.len() {
            let (first, signs) = first(i);
            if first != i {
                edges[i] = outline::mirrored(&edges[first], signs);
                map.nodes[i] = map.nodes[first].map(|ellipse| ellipse.mirrored(signs));
            }
        }
        let patches = side / 2;
        map.growth = (0..patches * patches)
            .map(|i| map.growth_of_patch(2 * (i % patches), 2 * (i / patches), &edges))
            .collect();
        map.outlines = (edges.into_iter().enumerate())
            .map(|(i, edge)| {
                let edge = edge.into_iter().map(|p| p.extend(aim.plane_z_mm)).collect();
                (map.position_mm(i % side, i / side), edge)
            })
            .collect();
        map
    }

    /// Nodes along each side of the window: 9, or 17 where ellipses between so few would have to be much larger than
    /// the bundle.
    pub fn side(&self) -> usize {
        self.side
    }

    /// The bundle's edge at [`Self::side`]² nodes of the window, row by row: each with its place (sensor frame, mm)
    /// and points in order around the edge (camera frame, mm), none where nothing passes. Empty without a lens.
    pub fn outlines(&self) -> &[(DVec2, Vec<DVec3>)] {
        &self.outlines
    }

    /// The window.
    pub fn window(&self) -> SensorWindowMm {
        self.window
    }

    /// Bounds at a position of the window (sensor frame, mm; positions outside are taken to its edge); `None` where no
    /// light passes.
    pub fn at(&self, x_mm: f64, y_mm: f64) -> Option<PupilEllipse> {
        let w = &self.window;
        let cells = (self.side - 1) as f64;
        let place = |x: f64, centre: f64, half: f64| {
            let p = (x - centre + half) / (2.0 * half) * cells;
            if p.is_finite() {
                p.clamp(0.0, cells)
            } else {
                0.5 * cells
            }
        };
        let p = place(x_mm, w.centre.x, w.half_width);
        let q = place(y_mm, w.centre.y, w.half_height);
        let column = (p as usize).min(self.side - 2);
        let row = (q as usize).min(self.side - 2);
        let part = DVec2::new(p - column as f64, q - row as f64);
        let ellipse = self
            .blended((column, row), 1, part)?
            .grown(self.growth[row / 2 * (self.side / 2) + column / 2]);
        Some(PupilEllipse {
            centre_mm: ellipse.centre.extend(self.plane_z_mm),
            axis_a_mm: ellipse.shape.x_axis,
            axis_b_mm: ellipse.shape.y_axis,
        })
    }

    /// How much the ellipses of the patch of 2×2 cells at a node must grow.
    fn growth_of_patch(&self, column: usize, row: usize, edges: &[Vec<DVec2>]) -> f64 {
        let reach = [(1, 1), (1, 0), (0, 1), (2, 1), (1, 2)]
            .into_iter()
            .filter_map(|(i, j)| {
                let part = DVec2::new(i as f64, j as f64) * 0.5;
                let coarse = self.blended((column, row), 2, part)?;
                Some(MARGIN * coarse.reach(&edges[(row + j) * self.side + column + i]))
            })
            .fold(1.0, f64::max);
        1.0 + 0.5 * (reach - 1.0)
    }

    /// Ellipse at `part` (0 to 1 each way) of the cell of `stride` nodes at a node, before growth: the mean of its
    /// corners, weighted; dark ones do not count.
    fn blended(&self, node: (usize, usize), stride: usize, part: DVec2) -> Option<Ellipse> {
        let mut sum = (0.0, DVec2::ZERO, DMat2::ZERO);
        for (i, j, w) in [
            (0, 0, (1.0 - part.x) * (1.0 - part.y)),
            (1, 0, part.x * (1.0 - part.y)),
            (0, 1, (1.0 - part.x) * part.y),
            (1, 1, part.x * part.y),
        ] {
            if let Some(e) = self.nodes[(node.1 + j * stride) * self.side + node.0 + i * stride] {
                sum = (sum.0 + w, sum.1 + w * e.centre, sum.2 + e.shape * w);
            }
        }
        (sum.0 > 0.0).then(|| Ellipse {
            centre: sum.1 / sum.0,
            shape: sum.2 * (1.0 / sum.0),
        })
    }

    fn position_mm(&self, column: usize, row: usize) -> DVec2 {
        let part = DVec2::new(column as f64, row as f64) * (2.0 / (self.side - 1) as f64) - 1.0;
        self.window.centre + part * DVec2::new(self.window.half_width, self.window.half_height)
    }
}

/// All of up to three; of more the middle, the shortest and the longest wavelength: between them bundles change
/// smoothly.
fn few(systems: &[OpticalSystem]) -> Vec<&OpticalSystem> {
    let mut few: Vec<&OpticalSystem> = systems.iter().collect();
    if few.len() > 3 {
        few.sort_by(|a, b| a.wavelength_nm.total_cmp(&b.wavelength_nm));
        let last = few.len() - 1;
        few = [last / 2, 0, last].map(|place| few[place]).to_vec();
    }
    few
}

/// z of the plane to aim at and the paraxial pupil's semi-diameter in it: the exit pupil's own plane where it stands
/// well in front of the sensor, else (telecentric, or behind the sensor) the last vertex's.
fn aim_plane(system: &OpticalSystem) -> (f64, f64) {
    let paraxial = Paraxial::from_aligned(system);
    let sensor_z = system.sensor_z_mm;
    let last_z = system.surfaces[system.surfaces.len() - 1].pose.vertex_mm.z;
    let (pupil, back) = (sensor_z - paraxial.exit_pupil_z_mm, sensor_z - last_z);
    if pupil.is_finite() && pupil > 0.3 * back && pupil < 1e3 * paraxial.efl_mm.abs().max(back) {
        return (paraxial.exit_pupil_z_mm, paraxial.exit_pupil_semi_mm);
    }
    // The cone to the axis has slope semi/pupil; telecentric: 1/(2 F).
    let slope = paraxial.exit_pupil_semi_mm / pupil.abs();
    let slope = if slope.is_finite() {
        slope
    } else {
        0.5 / paraxial.f_number.abs()
    };
    (last_z, slope * back)
}
