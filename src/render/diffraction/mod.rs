//! Diffraction at the main lens's aperture.
//!
//! Seen from a place on the sensor, the aperture is a cone of directions. A wave that fills it does not meet in a point
//! but in the cone's diffraction pattern ([`pattern`]), so the sensor shows the picture of the rays blurred by it. The
//! renderer draws this blur with the rays: each starts beside its place on the sensor, by a displacement drawn from the
//! pattern at its wavelength, towards the same point of the pupil; the pixel's response sees it arrive undisplaced.
//!
//! ```text
//! E(x) = ∫ K(d; Ω(x), λ) E_rays(x − d) d²d ,     ∫ K = 1
//! ```
//!
//! That is exact in focus for a lens without aberrations. With aberrations or out of focus the blurs of rays and
//! pattern are not independent: [`kernel`] has how a ray's displacement depends on its place in the pupil. Where the
//! lens's own phases ([`wavefront`]) are told from none, [`phase_draw`] finds displacements that follow waves with
//! these phases, in focus and beside it. `docs/effects.md` has how near both come.

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod against_waves;
mod blur;
mod kernel;
mod pattern;
mod phase_draw;
mod planes;
mod shape;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
mod wavefront;

use std::sync::Arc;

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use crate::field::{FieldGrid, mirrored};
use crate::frames::camera_from_sensor_mm;
use crate::lens::{ExitPupilMap, OpticalSystem};
use crate::sampling::uniform;
pub(super) use blur::{BlurField, PixelBlur};
use kernel::Kernel;
use phase_draw::PhaseDraw;
use shape::Shape;
use wavefront::{Sight, Wavefront, opened};

/// Steps from kernel to kernel along each side of the window: every second or fourth node of the pupil's map has one.
const STEPS: usize = 4;
/// RMS of phases over the pupil that are told from none, and from those of another node, waves.
const PHASES_TOLD: f64 = 0.03;
/// Keeps the choice of a node apart from the samples.
const NODE: u64 = 0xD1FF_0DE5;
/// Steps of the golden ratio fill [0, 1) evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// The pattern over a window.
#[derive(Clone, Debug)]
pub(super) struct LensDiffraction {
    /// Of the ellipse with the pupil's second moments, in direction cosines (camera frame, backward): its middle (2),
    /// and the columns of the map from there to the unit disk (4).
    ellipses: FieldGrid,
    /// At the corners of [`STEPS`]² parts of the window; a single one where all are ellipses.
    kernels: Vec<Arc<Kernel>>,
    /// By the lens's phases, at the same nodes; empty of a lens without any.
    draws: Vec<Option<NodePhases>>,
    /// For the weights of `kernels` at a place.
    nodes: FieldGrid,
}

/// What waves with the lens's phases do at a node: the draw of a node that it mirrors, with the signs of x and y.
#[derive(Clone, Debug)]
struct NodePhases {
    draw: Arc<PhaseDraw>,
    signs: DVec2,
}

impl LensDiffraction {
    /// From the outlines of the pupil over a window, for a sensor at `sensor_z_mm`; `None` where no light passes.
    pub fn new(pupils: &ExitPupilMap, sensor_z_mm: f64) -> Option<Self> {
        let shapes: Vec<Option<Shape>> = (pupils.outlines().par_iter())
            .map(|(place_mm, outline)| {
                Shape::new(camera_from_sensor_mm(*place_mm, sensor_z_mm), outline)
            })
            .collect();
        let lit = shapes.iter().flatten().next()?;
        let side = pupils.side();
        let ellipses = shapes
            .iter()
            .flat_map(|s| s.as_ref().unwrap_or(lit).ellipse());
        let ellipses = FieldGrid::new(pupils.window(), (side, side), 6, ellipses.collect())?;
        let (few, every) = (STEPS + 1, (side - 1) / STEPS);
        let nodes = FieldGrid::new(pupils.window(), (few, few), 1, vec![0.0; few * few])?;
        let disk = Arc::new(Kernel::disk());
        let shape = |k: usize| shapes[k / few * every * side + k % few * every].as_ref();
        let kernels = if shapes.iter().flatten().all(|s| s.clipped.is_none()) {
            vec![disk]
        } else {
            let kernel = |k: usize| match shape(k).and_then(|s| s.clipped.as_ref()) {
                Some(outline) => Arc::new(Kernel::new(outline)),
                None => disk.clone(),
            };
            (0..few * few).into_par_iter().map(kernel).collect()
        };
        Some(Self {
            ellipses,
            kernels,
            draws: Vec::new(),
            nodes,
        })
    }

    /// The same by waves with the phases of a lens that is in focus at a depth (mm, may be infinite), at the lens's
    /// wavelength; others are taken to have the same phases.
    pub fn with_phases(self, system: &OpticalSystem, depth_mm: f64) -> Self {
        let Some(fit) = Wavefront::fit() else {
            return self;
        };
        // A lens that is the same around its axis mirrors itself in a window on it.
        let is_mirrored = self.ellipses.window().is_on_axis() && system.is_rotational();
        let first = |node: usize| match is_mirrored {
            true => mirrored(node, (STEPS + 1, STEPS + 1)),
            false => (node, DVec2::ONE),
        };
        let open = opened(system);
        let front = |node: usize| {
            let place_mm = self.nodes.place_mm(node);
            let (middle, to_disk) = self.ellipse(place_mm);
            let place_mm = camera_from_sensor_mm(place_mm, system.sensor_z_mm);
            let sight = Sight {
                system,
                open: &open,
                place_mm,
                depth_mm,
                middle,
                to_disk,
            };
            Wavefront::traced(&sight, self.kernel(node).radius(), &fit)
        };
        let count = self.nodes.data().len();
        let fronts: Vec<Option<Wavefront>> = (0..count)
            .into_par_iter()
            .map(|node| (first(node).0 == node).then(|| front(node)).flatten())
            .collect();
        // Nodes with the same pupil and the same phases share a draw: the first of them.
        let told = |front: &Wavefront| front.rms_waves() >= PHASES_TOLD;
        let like = |a: usize, b: usize| match (&fronts[a], &fronts[b]) {
            (Some(x), Some(y)) => {
                std::ptr::eq(self.kernel(a), self.kernel(b)) && x.differs_waves(y) < PHASES_TOLD
            }
            _ => false,
        };
        let mut firsts: Vec<usize> = Vec::new();
        let mut of_node: Vec<Option<(usize, DVec2)>> = Vec::with_capacity(count);
        for (node, front) in fronts.iter().enumerate() {
            let (from, signs) = first(node);
            let own = || {
                front.as_ref().filter(|front| told(front))?;
                let known = firsts.iter().position(|&first| like(first, node));
                Some((known.unwrap_or(firsts.len()), DVec2::ONE))
            };
            let draw = match from == node {
                true => own(),
                false => of_node[from].map(|(first, turned)| (first, signs * turned)),
            };
            if draw.is_some_and(|(first, _)| first == firsts.len()) {
                firsts.push(node);
            }
            of_node.push(draw);
        }
        let draw =
            |&node: &usize| PhaseDraw::new(self.kernel(node), fronts[node].as_ref()?).map(Arc::new);
        let draws: Vec<Option<Arc<PhaseDraw>>> = firsts.par_iter().map(draw).collect();
        let draws = of_node.into_iter().map(|of_node| {
            let (first, signs) = of_node?;
            let draw = draws[first].clone()?;
            Some(NodePhases { draw, signs })
        });
        Self {
            draws: draws.collect(),
            ..self
        }
    }

    /// The same of a lens without aberrations.
    pub fn without_phases(&self) -> Self {
        Self {
            draws: Vec::new(),
            ..self.clone()
        }
    }

    /// What the rays of a pixel draw from; its place: sensor frame, mm. `key`: the pixel's.
    pub fn at(&self, place_mm: DVec2, key: u64) -> PlaceDiffraction<'_> {
        let (middle, to_disk) = self.ellipse(place_mm);
        PlaceDiffraction {
            middle,
            to_disk,
            scale: to_disk.transpose() * (1.0 / std::f64::consts::TAU),
            kernels: self.around(place_mm),
            turn: uniform(key, &[NODE]),
        }
    }

    /// Displacements that the pattern at a place gives a picture, px (x right, y down as stored), by pairs of samples
    /// in [0, 1).
    pub fn displacements_px(
        &self,
        place_mm: DVec2,
        [wavelength_mm, pitch_mm]: [f64; 2],
        samples: impl Iterator<Item = (f64, f64)>,
    ) -> Vec<DVec2> {
        let here = self.at(place_mm, 0);
        let scale = here.to_disk.transpose();
        // Columns grow with x of the sensor frame, against that of the camera frame.
        let to_px = wavelength_mm / pitch_mm / std::f64::consts::TAU * DVec2::new(-1.0, 1.0);
        let displacement =
            |(i, (s, t))| to_px * (scale * here.pick(i).kernel.displacement_at(s, t));
        samples.enumerate().map(displacement).collect()
    }

    fn ellipse(&self, place_mm: DVec2) -> (DVec2, DMat2) {
        let mut e = [0.0; 6];
        self.ellipses.sample(place_mm, &mut e);
        let [x, y, columns @ ..] = e;
        (DVec2::new(x, y), DMat2::from_cols_array(&columns))
    }

    /// The kernels around a place and their weights.
    fn around(&self, place_mm: DVec2) -> [(NodeDraw<'_>, f64); 4] {
        let around = self.nodes.around(place_mm);
        around.map(|(node, weight)| {
            let phases = self.draws.get(node).and_then(Option::as_ref);
            (
                NodeDraw {
                    kernel: self.kernel(node),
                    phases,
                },
                weight,
            )
        })
    }

    fn kernel(&self, node: usize) -> &Kernel {
        self.kernels.get(node).unwrap_or(&self.kernels[0])
    }
}

/// What a node's rays draw from.
#[derive(Clone, Copy)]
struct NodeDraw<'a> {
    kernel: &'a Kernel,
    phases: Option<&'a NodePhases>,
}

/// The pattern at one place: a mixture of those of the four nodes around it.
pub(in crate::render) struct PlaceDiffraction<'a> {
    middle: DVec2,
    to_disk: DMat2,
    scale: DMat2,
    kernels: [(NodeDraw<'a>, f64); 4],
    turn: f64,
}

impl PlaceDiffraction<'_> {
    /// Displacement over wavelength, camera frame, of ray `number` of these direction cosines by a sample in [0, 1).
    #[inline]
    pub fn displacement(&self, number: usize, direction: DVec2, sample: f64) -> DVec2 {
        let q = self.to_disk * (direction - self.middle);
        let node = self.pick(number);
        self.scale
            * match node.phases {
                Some(phases) => phases.signs * phases.draw.displacement(phases.signs * q, sample),
                None => node.kernel.displacement(q, sample),
            }
    }

    /// The same of rays from number `first` on: `x` holds their samples, and takes displacements along x.
    pub fn displacements(&self, first: usize, [dx, dy]: [&[f64]; 2], [x, y]: [&mut [f64]; 2]) {
        let [a, b, c, d] = self.kernels.map(|(node, _)| node.phases);
        let (Some(a), Some(b), Some(c), Some(d)) = (a, b, c, d) else {
            for (i, (x, y)) in x.iter_mut().zip(y).enumerate() {
                let d = self.displacement(first + i, DVec2::new(dx[i], dy[i]), *x);
                (*x, *y) = (d.x, d.y);
            }
            return;
        };
        // Which node a ray draws from is not to be foretold: no branch depends on it.
        let nodes = [a, b, c, d];
        for (i, (x, y)) in x.iter_mut().zip(y).enumerate() {
            let q = self.to_disk * (DVec2::new(dx[i], dy[i]) - self.middle);
            let NodePhases { draw, signs } = nodes[self.turn_of(first + i)];
            let d = self.scale * (*signs * draw.displacement(*signs * q, *x));
            (*x, *y) = (d.x, d.y);
        }
    }

    /// Displacement over wavelength of phase 1 at the pupil's edge.
    pub fn phase(&self) -> f64 {
        self.scale.determinant().abs().sqrt()
    }

    /// The node whose turn it is.
    #[inline]
    fn pick(&self, number: usize) -> NodeDraw<'_> {
        self.kernels[self.turn_of(number)].0
    }

    /// The nodes take turns by their weights.
    #[inline]
    fn turn_of(&self, number: usize) -> usize {
        let turns = self.turn + number as f64 * GOLDEN;
        // What is left of a whole number: `fract` is a call where processors may lack the instruction.
        let rest = turns - f64::from(turns as i32);
        let [a, b, c, d] = self.kernels.map(|(_, weight)| weight);
        let past = [a, a + b, a + b + c, a + b + c + d].map(|sum| usize::from(rest >= sum));
        // Weights that rounding leaves below 1.
        past.iter().sum::<usize>() & 3
    }
}
