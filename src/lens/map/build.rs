//! How a map is made: its degrees and nodes are the least whose error, measured with rays that took no part in the fit,
//! meets the bound.

use glam::DVec2;
use rayon::prelude::*;

use super::edge;
use super::frame::{PupilFrame, SceneFrame};
use super::held_out::{HeldOut, RayErrors, edge_bands};
use super::lens_map::LensMap;
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
const NODES: [usize; 7] = [4, 6, 9, 13, 19, 28, 41];
/// Least spacing of nodes, pitches: where they are closer, tracing all rays takes no longer.
const LEAST_SPACING: f64 = 48.0;
/// Places a side at which degrees are tried, and limiting surfaces looked for.
const PLACES: usize = 3;
const EDGE_PLACES: usize = 7;
/// Directions in which a limiting surface is looked for.
const EDGES: usize = 64;
/// Parts of the bound that may be taken by the polynomials of all places, and by those together with the change within
/// a pixel: the rest is for the way between the nodes.
const SHARES: [f64; 2] = [0.8, 0.9];
/// Largest part of the bundle to be traced exactly at its edge: a cell with more is not mapped.
const MOST_EDGE: f64 = 0.04;
/// Part of the window that may stay unmapped before more nodes are tried, and at all.
const UNMAPPED: [f64; 2] = [0.05, 0.5];

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
            let map = maker.checked(&fitter, like.nodes, &choice);
            let most = like.report.unmapped_share + UNMAPPED[0];
            if let Some(map) = map.filter(|m| m.report.unmapped_share <= most) {
                return Ok(map);
            }
        }
        let choice = maker.choice(&mut fitter)?;
        let mut best: Option<Self> = None;
        for size in maker.sizes() {
            let Some(map) = maker.checked(&fitter, size, &choice) else {
                continue;
            };
            let share = map.report.unmapped_share;
            let before = best
                .as_ref()
                .map_or(f64::INFINITY, |b| b.report.unmapped_share);
            if share < before {
                best = Some(map);
            }
            // More nodes help where these do.
            if share <= UNMAPPED[0] || (before < 1.0 && share > 0.7 * before) {
                break;
            }
        }
        let found = best.filter(|map| map.report.unmapped_share <= UNMAPPED[1]);
        found.ok_or(MapFailure::Nodes)
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

    /// The least degrees that do at places all over the window, each with a node of its own; or at most of them.
    fn choice(&self, fitter: &mut Fitter<'_>) -> Result<Choice, MapFailure> {
        let places = self.task.places_mm(PLACES);
        let limiting = std::mem::take(&mut fitter.limiting);
        let mut best: Option<(usize, Choice)> = None;
        for main in DEGREES.map(Design::new) {
            let least = best.as_ref().map_or(places.len() / 2, |(count, _)| *count);
            let lowest = Design::new(CHANGE_DEGREES[0]);
            let found = self.errors_alone(fitter, &places, (&main, &lowest), false);
            let meets = |e: &RayErrors| e.meet(&self.task.bound, 1.0);
            let good: Vec<DVec2> = (places.iter().zip(&found))
                .filter_map(|(place, e)| e.filter(meets).map(|_| *place))
                .collect();
            let sum = RayErrors::sum(found.into_iter().flatten().filter(meets));
            if good.len() <= least || !sum.meet(&self.task.bound, SHARES[0]) {
                continue;
            }
            if let Some((change, reach_mm)) = self.change(fitter, &good, &main) {
                let choice = Choice {
                    main,
                    change,
                    reach_mm,
                };
                best = Some((good.len(), choice));
                if good.len() == places.len() {
                    break;
                }
            }
        }
        fitter.limiting = limiting;
        let (_, choice) = best.ok_or(MapFailure::Degree)?;
        fitter.step_mm = choice.reach_mm;
        Ok(choice)
    }

    /// The least degree of the change within a pixel, and how far from a place it holds, mm.
    fn change(
        &self,
        fitter: &mut Fitter<'_>,
        places: &[DVec2],
        main: &Design,
    ) -> Option<(Design, f64)> {
        for reach in REACHES {
            fitter.step_mm = reach * self.task.pitch_mm;
            for change in CHANGE_DEGREES.map(Design::new) {
                let errors = self.errors_alone(fitter, places, (main, &change), true);
                let all: Option<Vec<RayErrors>> = errors.into_iter().collect();
                if RayErrors::sum(all?.into_iter()).meet(&self.task.bound, SHARES[1]) {
                    return Some((change, fitter.step_mm));
                }
            }
        }
        None
    }

    /// Errors at places, each with a node of its own; `None` where too little passes.
    fn errors_alone(
        &self,
        fitter: &Fitter<'_>,
        places: &[DVec2],
        designs: (&Design, &Design),
        beside: bool,
    ) -> Vec<Option<RayErrors>> {
        let errors = places.par_iter().map(|&place| {
            let node = fitter.node(place, designs.0, designs.1)?;
            let map = self.of_nodes(fitter, (4, 4), designs, &[&node; 16]);
            Some(self.held_out().at(&map, place, beside))
        });
        errors.collect()
    }

    /// Numbers of nodes along both sides, the fewest first.
    fn sizes(&self) -> Vec<(usize, usize)> {
        let w = self.task.window;
        let long = w.half_width.max(w.half_height);
        let most = 2.0 * long / (LEAST_SPACING * self.task.pitch_mm) + 1.0;
        let sizes = NODES
            .iter()
            .filter(|nodes| **nodes <= NODES[1] || **nodes as f64 <= most);
        sizes
            .map(|&nodes| {
                let along = |half: f64| (half / long * (nodes - 1) as f64).ceil() as usize + 1;
                (along(w.half_width).max(4), along(w.half_height).max(4))
            })
            .collect()
    }

    /// The map of so many nodes, with what was measured of it: its cells beyond the bound are unmapped. `None` where none
    /// is left.
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
        let cells = self.held_out().cells(&map);
        let bands = edge_bands(&cells, size.0 - 1);
        let bound = &self.task.bound;
        // The worst go first, until the others meet the bound together.
        let mut kept: Vec<usize> = (0..cells.len())
            .filter(|k| bands[*k].1 <= MOST_EDGE)
            .collect();
        let badness = |k: &usize| cells[*k].errors.badness(bound);
        kept.sort_by(|a, b| badness(a).total_cmp(&badness(b)));
        let errors = loop {
            let errors = RayErrors::sum(kept.iter().map(|k| cells[*k].errors));
            if errors.meet(bound, 1.0) {
                break errors;
            }
            kept.pop()?;
        };
        map.bands = vec![f32::INFINITY; cells.len()];
        kept.iter().for_each(|k| map.bands[*k] = bands[*k].0 as f32);
        let edges = kept.iter().map(|k| bands[*k].1);
        map.report = MapReport {
            degree: map.degree,
            change_degree: map.change_degree,
            nodes: size,
            limiting_surfaces: map.limits,
            rms_px: errors.rms_px(),
            worst_px: errors.worst_px(),
            edge_share: edges.sum::<f64>() / kept.len() as f64,
            unmapped_share: 1.0 - kept.len() as f64 / cells.len() as f64,
        };
        Some(map)
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
            nodes: size,
            bands: vec![0.0; (size.0 - 1) * (size.1 - 1)],
            constants: nodes.iter().flat_map(|n| n.constants).collect(),
            values: nodes
                .iter()
                .flat_map(|n| n.values.iter().copied())
                .collect(),
            report: MapReport::default(),
        }
    }
}
