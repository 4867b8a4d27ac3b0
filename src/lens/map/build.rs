//! How a map is made: its degrees and nodes are the least whose error, measured with rays that took no part in the fit,
//! meets the bound.

use glam::DVec2;
use rayon::prelude::*;

use super::LensMap;
use super::edge;
use super::frame::{PupilFrame, SceneFrame};
use super::held_out::{HeldOut, RayErrors};
use super::node::{Design, Fitter, Node, enlarged, passing, rays};
use super::task::{MapFailure, MapReport, MapTask};
use crate::field::FieldGrid;
use crate::frames::camera_from_sensor_mm;
use crate::lens::{PacketTracer, chief_ray};
use crate::rays::RayBatch;
use crate::simd::SimdLevel;

/// Degrees that are tried, of a ray's place and slopes and of their change within a pixel.
const DEGREES: [usize; 11] = [4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24];
const CHANGE_DEGREES: [usize; 4] = [1, 2, 4, 6];
/// How far from a place its map holds, pitches: as far as the next pixel's middle, or little beyond its own edge.
const REACHES: [f64; 2] = [1.0, 0.55];
/// Numbers of nodes along the longer side that are tried.
const NODES: [usize; 6] = [4, 6, 9, 13, 19, 28];
/// Places a side at which degrees are tried, and limiting surfaces looked for.
const PLACES: usize = 3;
const EDGE_PLACES: usize = 7;
/// Directions in which a limiting surface is looked for.
const EDGES: usize = 64;
/// Parts of the bound that may be taken by a place's polynomials, and by those together with the change within a pixel:
/// the rest is for the way between the nodes.
const SHARES: [f64; 2] = [0.8, 0.9];
/// Largest part of the bundle to be traced exactly.
const MOST_EXACT: f64 = 0.02;

/// Numbers with which a map was made: those of the same lens at another wavelength will do as well, or nearly.
struct Choice {
    main: Design,
    change: Design,
    reach_mm: f64,
}

struct Maker<'a> {
    task: MapTask<'a>,
    exact: PacketTracer,
    pupil: PupilFrame,
    scene: SceneFrame,
}

impl LensMap {
    /// Makes the smallest map that meets the bound. `like` is that of another wavelength of the same lens and window:
    /// its numbers are tried first.
    ///
    /// # Errors
    /// Why there is none.
    pub fn new(task: &MapTask<'_>, like: Option<&LensMap>) -> Result<Self, MapFailure> {
        let maker = Maker::new(*task)?;
        let mut fitter = maker.fitter();
        if let Some(like) = like {
            let choice = Choice {
                main: Design::new(like.degree),
                change: Design::new(like.change_degree),
                reach_mm: like.reach_mm,
            };
            fitter.step_mm = choice.reach_mm;
            if let Some(map) = maker.checked(&fitter, like.nodes, &choice) {
                return Ok(map);
            }
        }
        let choice = maker.choice(&mut fitter)?;
        let w = task.window;
        let long = w.half_width.max(w.half_height);
        let sizes = NODES.map(|nodes| {
            let along = |half: f64| (half / long * (nodes - 1) as f64).ceil() as usize + 1;
            (along(w.half_width).max(4), along(w.half_height).max(4))
        });
        let mut maps = sizes
            .into_iter()
            .filter_map(|size| maker.checked(&fitter, size, &choice));
        maps.next().ok_or(MapFailure::Nodes)
    }
}

impl<'a> Maker<'a> {
    fn new(task: MapTask<'a>) -> Result<Self, MapFailure> {
        let middle = task.window.centre;
        let chief = chief_ray(task.system, middle.x, middle.y).map_err(|_| MapFailure::Dark)?;
        let mut batch = RayBatch::default();
        batch.push(chief.origin_mm, chief.direction);
        enlarged(task.system, None).trace_backward(&mut batch, SimdLevel::detect());
        Ok(Self {
            exact: PacketTracer::new(task.system),
            pupil: PupilFrame::new(task.pupils, task.window).ok_or(MapFailure::Dark)?,
            scene: SceneFrame::around(batch.get(0).map_err(|_| MapFailure::Dark)?),
            task,
        })
    }

    fn held_out(&self) -> HeldOut<'_> {
        HeldOut {
            task: &self.task,
            exact: &self.exact,
            pupil: &self.pupil,
            scene: &self.scene,
        }
    }

    fn fitter(&self) -> Fitter<'_> {
        let system = self.task.system;
        let places = self.task.places_mm(EDGE_PLACES).into_par_iter();
        let mut limits: Vec<usize> = places
            .flat_map_iter(|place| self.lost_beyond(place))
            .collect();
        limits.sort_unstable();
        limits.dedup();
        Fitter {
            pupil: &self.pupil,
            scene: &self.scene,
            sensor_z_mm: system.sensor_z_mm,
            larger: enlarged(system, None),
            limiting: limits.iter().map(|&s| enlarged(system, Some(s))).collect(),
            step_mm: self.task.pitch_mm,
        }
    }

    /// Surfaces at which rays of a place just beyond the edge of its bundle are lost.
    fn lost_beyond(&self, place: DVec2) -> Vec<usize> {
        let origin = camera_from_sensor_mm(place, self.task.system.sensor_z_mm);
        let (disk, z_mm) = (self.pupil.at(place), self.pupil.z_mm);
        let targets = |points: &[DVec2]| -> Vec<DVec2> {
            points
                .iter()
                .map(|p| disk.target(*p, DVec2::ZERO))
                .collect()
        };
        let spacing = (edge::DIRECTIONS / EDGES) as f64;
        let directions: Vec<DVec2> = (0..EDGES)
            .map(|k| edge::on_square(k as f64 * spacing))
            .collect();
        let pass = |points: &[DVec2]| passing(&self.exact, origin, z_mm, &targets(points));
        let reach = edge::reach(&directions, pass);
        let beyond: Vec<DVec2> = directions
            .iter()
            .zip(reach)
            .map(|(d, r)| *d * (r + 1e-4))
            .collect();
        let mut batch = rays(origin, z_mm, &targets(&beyond));
        self.exact.trace_backward(&mut batch, SimdLevel::detect());
        let lost = batch
            .status
            .iter()
            .zip(&batch.surface)
            .filter(|(status, _)| **status != 0);
        lost.map(|(_, surface)| usize::from(*surface)).collect()
    }

    /// The least degrees that do at places all over the window, each with a node of its own.
    fn choice(&self, fitter: &mut Fitter<'_>) -> Result<Choice, MapFailure> {
        let places = self.task.places_mm(PLACES);
        let limiting = std::mem::take(&mut fitter.limiting);
        let meets = |fitter: &Fitter<'_>, main: &Design, change: &Design, beside: bool| {
            let errors = places.par_iter().map(|&place| {
                let node = fitter.node(place, main, change)?;
                let map = self.of_nodes(fitter, (4, 4), (main, change), &[&node; 16]);
                Some(self.held_out().at(&map, place, beside))
            });
            let errors: Option<Vec<RayErrors>> = errors.collect();
            errors.is_some_and(|errors| {
                let mut sum = RayErrors::default();
                errors.into_iter().for_each(|e| sum.add(e));
                sum.meet(&self.task.bound, SHARES[usize::from(beside)])
            })
        };
        let mut found = None;
        'degrees: for degree in DEGREES {
            let main = Design::new(degree);
            if !meets(fitter, &main, &Design::new(CHANGE_DEGREES[0]), false) {
                continue;
            }
            for reach in REACHES {
                fitter.step_mm = reach * self.task.pitch_mm;
                for change in CHANGE_DEGREES.map(Design::new) {
                    if meets(fitter, &main, &change, true) {
                        found = Some(Choice {
                            main,
                            change,
                            reach_mm: fitter.step_mm,
                        });
                        break 'degrees;
                    }
                }
            }
        }
        fitter.limiting = limiting;
        found.ok_or(MapFailure::Degree)
    }

    /// The map of so many nodes, if it meets the bound.
    fn checked(
        &self,
        fitter: &Fitter<'_>,
        size: (usize, usize),
        choice: &Choice,
    ) -> Option<LensMap> {
        let designs = (&choice.main, &choice.change);
        let nodes: Option<Vec<Node>> = (0..size.0 * size.1)
            .into_par_iter()
            .map(|k| {
                let place = FieldGrid::node_mm(self.task.window, size, (k % size.0, k / size.0));
                fitter.node(place, designs.0, designs.1)
            })
            .collect();
        let nodes = nodes?;
        let mut map = self.of_nodes(fitter, size, designs, &nodes.iter().collect::<Vec<_>>());
        let (errors, band) = self.held_out().over_window(&map);
        map.band = band.half_width as f32;
        map.report = MapReport {
            degree: map.degree,
            change_degree: map.change_degree,
            nodes: size,
            limiting_surfaces: map.limits,
            rms_px: errors.rms_px(),
            worst_px: errors.worst_px(),
            exact_share: band.share,
        };
        (errors.meet(&self.task.bound, 1.0) && band.share <= MOST_EXACT).then_some(map)
    }

    fn of_nodes(
        &self,
        fitter: &Fitter<'_>,
        size: (usize, usize),
        (main, change): (&Design, &Design),
        nodes: &[&Node],
    ) -> LensMap {
        LensMap {
            window: self.task.window,
            pupil: self.pupil.clone(),
            scene: self.scene,
            tracer: self.exact.clone(),
            stop: self.task.system.stop as u16,
            degree: main.degree,
            change_degree: change.degree,
            limits: fitter.limiting.len(),
            reach_mm: fitter.step_mm,
            band: 0.0,
            nodes: size,
            constants: nodes.iter().flat_map(|n| n.constants).collect(),
            values: nodes
                .iter()
                .flat_map(|n| n.values.iter().copied())
                .collect(),
            report: MapReport::default(),
        }
    }
}
