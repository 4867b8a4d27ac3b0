//! How a map is made: the degree and the nodes are those whose error, measured with rays that took no part in the fit,
//! meets the bound.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::LensMap;
use super::edge::{self, DIRECTIONS};
use super::frame::{PupilFrame, SceneFrame};
use super::kernel::OUTPUTS;
use super::node::{Design, Fitter, Node, enlarged, passing, rays};
use super::place::PlaceBuffers;
use crate::field::SensorWindowMm;
use crate::frames::camera_from_sensor_mm;
use crate::lens::{ExitPupilMap, OpticalSystem, PacketTracer, chief_ray};
use crate::rays::{Ray, RayBatch};
use crate::sampling::{concentric_disk, uniform};
use crate::simd::SimdLevel;

/// Degrees that are tried.
const DEGREES: [usize; 9] = [4, 6, 8, 10, 12, 14, 16, 18, 20];
const GRADIENT_DEGREES: [usize; 5] = [1, 2, 3, 4, 6];
/// Nodes along the longer side that are tried.
const NODES: [usize; 7] = [4, 6, 9, 13, 19, 28, 41];
const HELD_OUT_PLACES: usize = 5;
const HELD_OUT_RAYS: usize = 256;
const HELD_OUT_EDGES: usize = 64;
/// Part of the bound that the fit at a place may take.
const SHARE: f64 = 0.8;

/// How far a map may err; a ray's place, referred to the sensor.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MapBound {
    /// Root mean square, px.
    pub rms_px: f64,
    /// Largest, px.
    pub worst_px: f64,
}

impl Default for MapBound {
    fn default() -> Self {
        Self { rms_px: 0.01, worst_px: 0.1 }
    }
}

/// Why there is no map.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MapFailure {
    /// There is no chief ray in the middle, or no pupil somewhere.
    #[error("no chief ray passes in the middle of the window, or a part of it is dark")]
    Dark,
    /// Of no degree.
    #[error("polynomials of degree 20 over the pupil err by more than the bound")]
    Degree,
    /// Of no number of nodes.
    #[error("nodes over the window are too far apart for the bound")]
    Nodes,
}

/// What a map is made for.
#[derive(Clone, Copy, Debug)]
pub struct MapTask<'a> {
    /// The lens at one wavelength.
    pub system: &'a OpticalSystem,
    /// Its bundles.
    pub pupils: &'a ExitPupilMap,
    /// Places on the sensor.
    pub window: SensorWindowMm,
    /// Pitch of its pixels, mm.
    pub pitch_mm: f64,
    /// Depth in focus, mm: the error is that of every depth beyond half of it.
    pub focus_mm: f64,
    /// What is allowed.
    pub bound: MapBound,
}

/// What was measured of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapReport {
    pub degree: usize,
    pub gradient_degree: usize,
    pub nodes: (usize, usize),
    pub limits: usize,
    pub rms_px: f64,
    pub worst_px: f64,
    /// Share of the pupil's area within the band.
    pub doubtful_share: f64,
    /// Half width of the band, disk radii.
    pub band: f64,
}

struct Maker<'a> {
    task: MapTask<'a>,
    exact: PacketTracer,
    pupil: PupilFrame,
    scene: SceneFrame,
}

#[derive(Clone, Copy, Default)]
struct Error {
    rays: f64,
    squares: f64,
    worst: f64,
}

impl Error {
    fn add(&mut self, other: Error) {
        self.rays += other.rays;
        self.squares += other.squares;
        self.worst = self.worst.max(other.worst);
    }
    fn rms(&self) -> f64 {
        (self.squares / self.rays.max(1.0)).sqrt()
    }
    fn meets(&self, bound: &MapBound, share: f64) -> bool {
        self.rays > 0.0 && self.rms() <= share * bound.rms_px && self.worst <= share * bound.worst_px
    }
}

impl LensMap {
    /// Makes a map that meets the bound.
    ///
    /// # Errors
    /// Why there is none.
    pub fn new(task: &MapTask<'_>) -> Result<Self, MapFailure> {
        let maker = Maker::new(*task).ok_or(MapFailure::Dark)?;
        let fitter = maker.fitter();
        let (main, gradient) = maker.degrees(&fitter)?;
        let w = task.window;
        for nodes in NODES {
            let long = w.half_width.max(w.half_height);
            let along = |half: f64| ((half / long * (nodes - 1) as f64).ceil() as usize + 1).max(4);
            let size = (along(w.half_width), along(w.half_height));
            let t0 = std::time::Instant::now();
            let Some(mut map) = maker.map(&fitter, size, (&main, &gradient)) else { continue };
            let t1 = std::time::Instant::now();
            let (error, edge, doubt) = maker.held_out(&map);
            if std::env::var("MAP_VERBOSE").is_ok() {
                eprintln!("  nodes {size:?} rms {:.5} worst {:.4} edge {edge:.5} build {:?} test {:?}", error.rms(), error.worst, t1-t0, t1.elapsed());
            }
            if error.meets(&task.bound, 1.0) && edge < 4e-3 {
                map.band = edge as f32;
                map.report = MapReport {
                    degree: map.degree,
                    gradient_degree: map.gradient_degree,
                    nodes: map.nodes,
                    limits: map.limits,
                    rms_px: error.rms(),
                    worst_px: error.worst,
                    doubtful_share: doubt,
                    band: edge,
                };
                return Ok(map);
            }
        }
        Err(MapFailure::Nodes)
    }
}

impl<'a> Maker<'a> {
    fn new(task: MapTask<'a>) -> Option<Self> {
        let middle = task.window.centre;
        let exact = PacketTracer::new(task.system);
        let chief = chief_ray(task.system, middle.x, middle.y).ok()?;
        let mut batch = RayBatch::default();
        batch.push(chief.origin_mm, chief.direction);
        enlarged(task.system, None).trace_backward(&mut batch, SimdLevel::detect());
        let scene = SceneFrame::around(batch.get(0).ok()?);
        Some(Self { pupil: PupilFrame::new(task.pupils, task.window)?, exact, scene, task })
    }

    fn fitter(&self) -> Fitter<'_> {
        let system = self.task.system;
        // Surfaces at which rays just beyond the edge are lost.
        let mut limits: Vec<usize> = self.places(7, 1.0).into_par_iter().flat_map_iter(|place| {
            let origin = camera_from_sensor_mm(place, system.sensor_z_mm);
            let disk = self.pupil.at(place);
            let directions: Vec<DVec2> = (0..64).map(|k| edge::on_square(4.0 * k as f64)).collect();
            let targets = |points: &[DVec2]| -> Vec<DVec2> { points.iter().map(|p| disk.centre + disk.shape * *p).collect() };
            let reach = edge::reach(&directions, |points| passing(&self.exact, origin, self.pupil.z_mm, &targets(points)));
            let beyond: Vec<DVec2> = directions.iter().zip(reach).map(|(d, r)| *d * (r + 1e-4)).collect();
            let mut batch = rays(origin, self.pupil.z_mm, &targets(&beyond));
            self.exact.trace_backward(&mut batch, SimdLevel::detect());
            let lost = (0..beyond.len()).filter(|&i| batch.status[i] != 0).map(|i| usize::from(batch.surface[i]));
            lost.collect::<Vec<_>>()
        }).collect();
        limits.sort_unstable();
        limits.dedup();
        if std::env::var("MAP_VERBOSE").is_ok() {
            eprintln!("  limits {limits:?}");
        }
        Fitter {
            pupil: &self.pupil,
            scene: &self.scene,
            sensor_z_mm: system.sensor_z_mm,
            larger: enlarged(system, None),
            limiting: limits.iter().map(|&s| enlarged(system, Some(s))).collect(),
            step_mm: self.task.pitch_mm,
        }
    }

    /// Least degrees that meet the bound at places all over the window, each with a node of its own.
    fn degrees(&self, fitter: &Fitter<'_>) -> Result<(Design, Design), MapFailure> {
        let alone = Fitter { limiting: Vec::new(), larger: fitter.larger.clone(), ..*fitter };
        let places = self.places(3, 1.0);
        let error = |main: &Design, gradient: &Design, with_offset: bool| -> Option<Error> {
            let each: Vec<Option<Error>> = places.par_iter().map(|&place| {
                let node = alone.node(place, main, gradient)?;
                let map = self.of_nodes(&alone, (4, 4), (main, gradient), &vec![&node; 16]);
                Some(self.error_at(&map, place, if with_offset { 1.0 } else { 0.0 }))
            }).collect();
            let mut sum = Error::default();
            for each in each {
                sum.add(each?);
            }
            Some(sum)
        };
        let meets = |e: Option<Error>, share: f64| e.is_some_and(|e| e.meets(&self.task.bound, share));
        let lowest = Design::new(GRADIENT_DEGREES[0]);
        let main = DEGREES.into_iter().map(Design::new).find(|main| {
            let e = error(main, &lowest, false);
            if let (Some(e), true) = (e, std::env::var("MAP_VERBOSE").is_ok()) {
                eprintln!("  degree {} rms {:.5} worst {:.4}", main.degree, e.rms(), e.worst);
            }
            meets(e, SHARE)
        }).ok_or(MapFailure::Degree)?;
        let gradient = GRADIENT_DEGREES.into_iter().map(Design::new).find(|gradient| {
            let e = error(&main, gradient, true);
            if let (Some(e), true) = (e, std::env::var("MAP_VERBOSE").is_ok()) {
                eprintln!("  gradient degree {} rms {:.5} worst {:.4}", gradient.degree, e.rms(), e.worst);
            }
            meets(e, 1.1 * SHARE)
        }).ok_or(MapFailure::Degree)?;
        Ok((main, gradient))
    }

    fn map(&self, fitter: &Fitter<'_>, size: (usize, usize), designs: (&Design, &Design)) -> Option<LensMap> {
        let w = self.task.window;
        let nodes: Option<Vec<Node>> = (0..size.0 * size.1).into_par_iter().map(|k| {
            let place = crate::field::FieldGrid::node_mm(w, size, (k % size.0, k / size.0));
            fitter.node(place, designs.0, designs.1)
        }).collect();
        Some(self.of_nodes(fitter, size, designs, &nodes?.iter().collect::<Vec<_>>()))
    }

    fn of_nodes(&self, fitter: &Fitter<'_>, size: (usize, usize), (main, gradient): (&Design, &Design), nodes: &[&Node]) -> LensMap {
        LensMap {
            window: self.task.window,
            pupil: self.pupil.clone(),
            scene: self.scene,
            tracer: self.exact.clone(),
            stop: self.task.system.stop as u16,
            degree: main.degree,
            gradient_degree: gradient.degree,
            limits: fitter.limiting.len(),
            reach_mm: 1.001 * self.task.pitch_mm,
            band: -1.0,
            nodes: size,
            constants: nodes.iter().flat_map(|n| n.constants).collect(),
            values: nodes.iter().flat_map(|n| n.values.iter().copied()).collect(),
            report: MapReport::default(),
        }
    }

    /// Places evenly over the window, `side` a side, out to `part` of its half width and height.
    fn places(&self, side: usize, part: f64) -> Vec<DVec2> {
        let w = self.task.window;
        let at = |i: usize| part * (2.0 * i as f64 / (side - 1) as f64 - 1.0);
        (0..side * side).map(|k| w.centre + DVec2::new(at(k % side) * w.half_width, at(k / side) * w.half_height)).collect()
    }

    /// Error of the ray's place and of the edge, and the share of doubtful rays, in the middle of cells.
    fn held_out(&self, map: &LensMap) -> (Error, f64, f64) {
        let (nx, ny) = map.nodes;
        let w = self.task.window;
        let cell = |k: usize, n: usize| {
            // The middle of a cell, from the first to the last.
            let cells = n - 1;
            let places = HELD_OUT_PLACES.min(cells);
            let cell = (k * (cells - 1)) / (places - 1).max(1);
            (2.0 * (cell as f64 + 0.5)) / cells as f64 - 1.0
        };
        let (px, py) = (HELD_OUT_PLACES.min(nx - 1), HELD_OUT_PLACES.min(ny - 1));
        let each: Vec<(Error, Vec<f64>, f64)> = (0..px * py).into_par_iter().map(|k| {
            let at = DVec2::new(cell(k % px, nx), cell(k / px, ny));
            let place = w.centre + at * DVec2::new(w.half_width, w.half_height);
            let (edges, length) = self.edges_at(map, place, k as u64);
            (self.error_at(map, place, 1.0), edges, length)
        }).collect();
        let mut error = Error::default();
        let mut edge = 0.0_f64;
        let mut share = 0.0;
        for (e, edges, length) in &each {
            error.add(*e);
            edge = edges.iter().fold(edge, |m, x| m.max(*x));
            share += length / each.len() as f64;
        }
        let edge = 1.5 * edge + 1e-5;
        (error, edge, 2.0 * edge * share)
    }

    /// How far the outline is off in directions between those of the nodes, disk units, and the outline's length over
    /// the area of the disk.
    fn edges_at(&self, map: &LensMap, place: DVec2, key: u64) -> (Vec<f64>, f64) {
        let mut buffers = PlaceBuffers::default();
        buffers.go(map, place);
        let origin = camera_from_sensor_mm(place, self.task.system.sensor_z_mm);
        let disk = self.pupil.at(place);
        let t: Vec<f64> = (0..HELD_OUT_EDGES).map(|k| {
            (k as f64 + uniform(key, &[k as u64, 77])) * (DIRECTIONS as f64 / HELD_OUT_EDGES as f64)
        }).collect();
        let directions: Vec<DVec2> = t.iter().map(|&t| edge::on_square(t)).collect();
        let truth = edge::reach(&directions, |points| {
            let targets: Vec<DVec2> = points.iter().map(|p| disk.centre + disk.shape * *p).collect();
            passing(&self.exact, origin, self.pupil.z_mm, &targets)
        });
        let errors = t.iter().zip(&truth).map(|(&t, truth)| {
            let k = (t as usize).min(DIRECTIONS - 1);
            let (a, b) = (f64::from(buffers.place.edge.0[k]), f64::from(buffers.place.edge.0[k + 1]));
            (a + (t - k as f64) * (b - a) - truth).abs()
        }).collect();
        let length: f64 = truth.iter().sum::<f64>() / HELD_OUT_EDGES as f64 * 8.0;
        (errors, length / std::f64::consts::PI)
    }

    /// Errors of rays that pass, at one place, from up to `offset` pitches beside it.
    fn error_at(&self, map: &LensMap, place: DVec2, offset: f64) -> Error {
        let disk = self.pupil.at(place);
        let h = self.task.pitch_mm;
        let key = place.x.to_bits() ^ place.y.to_bits().rotate_left(17);
        let z = self.task.system.sensor_z_mm;
        let mut batch = RayBatch::with_capacity(HELD_OUT_RAYS);
        for i in 0..HELD_OUT_RAYS as u64 {
            let u = |k: u64| uniform(key, &[i, k]);
            let (p, q) = concentric_disk(u(0), u(1));
            let target = (disk.centre + disk.shape * DVec2::new(p, q)).extend(self.pupil.z_mm);
            let origin = camera_from_sensor_mm(place, z) + DVec3::new(2.0 * u(2) - 1.0, 2.0 * u(3) - 1.0, 0.0) * (h * offset);
            batch.push(origin, (target - origin).normalize());
        }
        let mut exact = batch.clone();
        self.exact.trace_backward(&mut exact, SimdLevel::detect());
        let mut buffers = PlaceBuffers::default();
        // The map's polynomials alone, whatever the edge.
        let open = LensMap { band: f32::NEG_INFINITY, ..map.clone() };
        open.trace_backward(&mut batch, place, &mut buffers, SimdLevel::detect());
        let near = 0.5 * self.task.focus_mm.min(1e6) / self.scene.axes.z_axis.z.abs().max(0.1);
        let c = &buffers.place.constants;
        let mut error = Error::default();
        for i in 0..HELD_OUT_RAYS {
            let (Ok(exact), ray) = (exact.get(i), batch.ray(i)) else { continue };
            let Some(exact) = self.scene.coordinates(exact) else { continue };
            let ray = self.scene.coordinates(Ray { ..ray }).unwrap_or([f64::NAN; 4]);
            let e: [f64; OUTPUTS] = std::array::from_fn(|k| ray[k] - exact[k]);
            // At the nearest depth and at infinity, by the scene's shift per shift on the sensor.
            let at = |place: f64, slope: f64| {
                let v = |k: usize, e: &dyn Fn(usize) -> f64| place * e(k) + slope * e(k + 2);
                let j = glam::DMat2::from_cols(
                    DVec2::new(v(0, &|k| c[4 + k]), v(1, &|k| c[4 + k])),
                    DVec2::new(v(0, &|k| c[8 + k]), v(1, &|k| c[8 + k])),
                );
                (j.inverse() * DVec2::new(v(0, &|k| e[k]), v(1, &|k| e[k]))).length() / h
            };
            let px = at(1.0, near).max(at(0.0, 1.0));
            let px = if px.is_finite() { px } else { 1e9 };
            error.rays += 1.0;
            error.squares += px * px;
            error.worst = error.worst.max(px);
        }
        error
    }
}
