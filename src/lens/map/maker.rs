//! What makes a map of given degrees and nodes, and measures it.

use glam::DVec2;
use rayon::prelude::*;

use super::edge;
use super::frame::{PupilFrame, SceneFrame};
use super::held_out::{HeldOut, RayErrors, edge_bands};
use super::lens_map::LensMap;
use super::node::{Design, Designs, Fitter, Node, enlarged, passing, rays};
use super::task::{MapFailure, MapReport, MapTask};
use crate::field::FieldGrid;
use crate::frames::camera_from_sensor_mm;
use crate::lens::{PacketTracer, chief_ray};
use crate::rays::RayBatch;
use crate::simd::SimdLevel;

/// Places a side at which limiting surfaces are looked for, and directions.
const EDGE_PLACES: usize = 7;
const EDGES: usize = 64;
/// Largest part of the bundle to be traced exactly at its edge: a cell with more is not mapped.
const MOST_EDGE: f64 = 0.04;

/// Around the chief ray of the window's middle.
fn middle_frame(task: &MapTask<'_>) -> Result<SceneFrame, MapFailure> {
    let middle = task.window.centre;
    let chief = chief_ray(task.system, middle.x, middle.y).map_err(|_| MapFailure::Dark)?;
    let mut batch = RayBatch::default();
    batch.push(chief.origin_mm, chief.direction);
    enlarged(task.system, None).trace_backward(&mut batch, SimdLevel::detect());
    let ray = batch.get(0).map_err(|_| MapFailure::Dark)?;
    Ok(SceneFrame::around(ray))
}

/// Numbers with which a map was made: those of the same lens at another wavelength will do as well, or nearly.
pub(super) struct Choice {
    pub slope: &'static Design,
    pub place: &'static Design,
    pub change: &'static Design,
    pub reach_mm: f64,
}

impl Choice {
    pub fn designs(&self) -> Designs<'_> {
        Designs {
            slope: self.slope,
            place: self.place,
            change: self.change,
        }
    }
}

/// The lens and its coordinates.
pub(super) struct Maker<'a> {
    pub task: MapTask<'a>,
    exact: PacketTracer,
    pupil: PupilFrame,
    scene: SceneFrame,
}

impl<'a> Maker<'a> {
    /// Looks for the middle's chief ray and for the pupils, or takes the coordinates of a map of another wavelength.
    pub fn new(task: MapTask<'a>, like: Option<&LensMap>) -> Result<Self, MapFailure> {
        let (pupil, scene) = match like {
            Some(like) => (like.pupil.clone(), like.scene),
            None => {
                let pupil = PupilFrame::new(task.pupils, task.window).ok_or(MapFailure::Dark)?;
                (pupil, middle_frame(&task)?)
            }
        };
        Ok(Self {
            exact: PacketTracer::new(task.system),
            pupil,
            scene,
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

    /// What fits its nodes, with the surfaces that limit its bundles.
    pub fn fitter(&self, like: Option<&LensMap>) -> Fitter<'_> {
        let system = self.task.system;
        let limits = match like {
            Some(like) => like.limiting.clone(),
            None => self.limiting(),
        };
        Fitter {
            pupil: &self.pupil,
            scene: &self.scene,
            sensor_z_mm: system.sensor_z_mm,
            larger: enlarged(system, None),
            limiting: (limits.into_iter())
                .map(|s| (s, enlarged(system, Some(s))))
                .collect(),
            step_mm: self.task.pitch_mm,
        }
    }

    fn limiting(&self) -> Vec<usize> {
        let places = self.task.places_mm(EDGE_PLACES).into_par_iter();
        let mut limits: Vec<usize> = places
            .flat_map_iter(|place| self.lost_beyond(place))
            .collect();
        limits.sort_unstable();
        limits.dedup();
        limits
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

    /// Errors at places, each with a node of its own; `None` where too little passes.
    pub fn errors_alone(
        &self,
        fitter: &Fitter<'_>,
        places: &[DVec2],
        designs: Designs<'_>,
        beside: bool,
    ) -> Vec<Option<RayErrors>> {
        let errors = places.par_iter().map(|&place| {
            let node = fitter.node(place, designs)?;
            let map = self.of_nodes(fitter, (4, 4), designs, &[&node; 16]);
            Some(self.held_out().at(&map, place, beside))
        });
        errors.collect()
    }

    /// The map of so many nodes, with what was measured of it; see [`Maker::measured`].
    pub fn checked(
        &self,
        fitter: &Fitter<'_>,
        size: (usize, usize),
        choice: &Choice,
    ) -> Option<LensMap> {
        let designs = choice.designs();
        let nodes: Option<Vec<Node>> = (0..size.0 * size.1)
            .into_par_iter()
            .map(|k| {
                let place = FieldGrid::node_mm(self.task.window, size, (k % size.0, k / size.0));
                fitter.node(place, designs)
            })
            .collect();
        let nodes = nodes?;
        self.measured(self.of_nodes(fitter, size, designs, &nodes.iter().collect::<Vec<_>>()))
    }

    /// The map with what was measured of it: its cells beyond the bound are unmapped. `None` where none is left.
    pub fn measured(&self, mut map: LensMap) -> Option<LensMap> {
        let size = map.nodes;
        // Those of a map that it was blended from hide what this one cannot do.
        map.bands.fill([0.0; 2]);
        map.far_mm = f64::INFINITY;
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
        map.bands = vec![[f32::INFINITY; 2]; cells.len()];
        (kept.iter()).for_each(|k| map.bands[*k] = bands[*k].0.map(|width| width as f32));
        let edges = kept.iter().map(|k| bands[*k].1);
        map.far_mm = self.held_out().far_mm(&map);
        map.report = MapReport {
            degree: map.degree,
            place_degree: map.place_degree,
            change_degree: map.change_degree,
            nodes: size,
            limiting_surfaces: map.limiting.len(),
            rms_px: errors.rms_px(),
            worst_px: errors.worst_px(),
            edge_share: edges.sum::<f64>() / kept.len() as f64,
            unmapped_share: 1.0 - kept.len() as f64 / cells.len() as f64,
        };
        Some(map)
    }

    /// The weighted sum of maps of the same lens at other wavelengths, all made like the first; not measured.
    pub fn blended(&self, maps: &[(&LensMap, f64)]) -> Option<LensMap> {
        let (first, _) = *maps.first()?;
        let mut constants = vec![0.0; first.constants.len()];
        let mut values = vec![0.0; first.values.len()];
        for (map, weight) in maps {
            let is_alike = map.nodes == first.nodes
                && map.degrees() == first.degrees()
                && map.values.len() == values.len();
            if !is_alike {
                return None;
            }
            let constant = constants.iter_mut().zip(&map.constants);
            constant.for_each(|(sum, x)| *sum += weight * x);
            let value = values.iter_mut().zip(&map.values);
            value.for_each(|(sum, x)| *sum += weight * f64::from(*x));
        }
        Some(LensMap {
            tracer: self.exact.clone(),
            constants,
            values: values.into_iter().map(|x| x as f32).collect(),
            ..first.clone()
        })
    }

    fn of_nodes(
        &self,
        fitter: &Fitter<'_>,
        size: (usize, usize),
        designs: Designs<'_>,
        nodes: &[&Node],
    ) -> LensMap {
        LensMap {
            window: self.task.window,
            pupil: self.pupil.clone(),
            scene: self.scene,
            tracer: self.exact.clone(),
            stop: self.task.system.stop as u16,
            degree: designs.slope.degree,
            place_degree: designs.place.degree,
            change_degree: designs.change.degree,
            limiting: fitter.limiting.iter().map(|(s, _)| *s).collect(),
            reach_mm: fitter.step_mm,
            far_mm: f64::INFINITY,
            nodes: size,
            bands: vec![[0.0; 2]; (size.0 - 1) * (size.1 - 1)],
            constants: nodes.iter().flat_map(|n| n.constants).collect(),
            values: nodes
                .iter()
                .flat_map(|n| n.values.iter().copied())
                .collect(),
            report: MapReport::default(),
        }
    }
}
