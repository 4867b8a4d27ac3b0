//! One node of a map: rays traced from its place, and polynomials fitted to them.

use std::sync::{LazyLock, OnceLock};

use glam::{DVec2, DVec3};

use super::basis;
use super::edge;
use super::frame::{CHANGES, CONSTANTS, OUTPUTS, PupilFrame, SceneFrame};
use super::least_squares::{Factor, Squares};
use crate::frames::camera_from_sensor_mm;
use crate::lens::{OpticalSystem, PacketTracer};
use crate::rays::{RayBatch, RayStatus};
use crate::simd::SimdLevel;

/// The lens that is fitted has apertures larger by this factor: so a bundle has neighbours' rays beyond its edge.
pub(super) const ENLARGED: f64 = 1.04;
/// Points per term: where all pass, and where the bundle fills a part of the disk only.
const POINTS: [usize; 7] = [3, 4, 5, 6, 8, 12, 24];
/// Least number per term of those that pass: of the first set, and of the others.
const LEAST_POINTS: [f64; 2] = [2.4, 2.8];
/// Of which the next set is expected to have this many.
const WANTED_POINTS: f64 = 3.2;

/// Products that are summed in the time in which a ray is traced exactly.
const PRODUCTS_PER_RAY: f64 = 1500.0;

/// What all nodes share.
pub(super) struct Fitter<'a> {
    pub pupil: &'a PupilFrame,
    pub scene: &'a SceneFrame,
    pub sensor_z_mm: f64,
    /// The lens with larger apertures.
    pub larger: PacketTracer,
    /// Surfaces that limit the bundle, each with the same lens but for that surface, which is as it is.
    pub limiting: Vec<(usize, PacketTracer)>,
    /// Half the way over which changes with the place are taken, mm.
    pub step_mm: f64,
}

/// The lens with every aperture larger, but for one.
pub(super) fn enlarged(system: &OpticalSystem, but: Option<usize>) -> PacketTracer {
    let mut system = system.clone();
    for (i, surface) in system.surfaces.iter_mut().enumerate() {
        if Some(i) != but {
            surface.aperture.semi_mm *= ENLARGED;
        }
    }
    PacketTracer::new(&system)
}

/// Polynomials of one degree over fixed points of the disk.
pub(super) struct Design {
    pub degree: usize,
    count: usize,
    /// Few points, which do where all pass; many.
    sets: [LazyLock<Points, Box<dyn FnOnce() -> Points + Send>>; POINTS.len()],
    /// Of the orthogonal polynomials: coefficients of the powers.
    powers: Vec<f64>,
}

/// Those of a map.
#[derive(Clone, Copy)]
pub(super) struct Designs<'a> {
    pub slope: &'a Design,
    /// Of the slopes' degree or a lower one.
    pub place: &'a Design,
    pub change: &'a Design,
}

struct Points {
    at: Vec<DVec2>,
    /// Values of all polynomials, point after point.
    rows: Vec<f64>,
    /// Of all rows.
    squares: Squares,
    /// Where every point is taken.
    whole: Option<Factor>,
}

impl Points {
    fn new(degree: usize, points: usize) -> Self {
        let count = basis::terms(degree);
        let at = spiral(points);
        let mut rows = vec![0.0; at.len() * count];
        for (row, at) in rows.chunks_exact_mut(count).zip(&at) {
            basis::values(degree, at.x, at.y, row);
        }
        let squares = Squares::new(&rows, count);
        let all: Vec<u32> = (0..at.len() as u32).collect();
        let whole = (points == POINTS[0] * count)
            .then(|| Factor::of_taken(&squares, &rows, &all))
            .flatten();
        Self {
            at,
            rows,
            squares,
            whole,
        }
    }
}

/// Degrees of designs, at most.
const MOST_DEGREE: usize = 24;

impl Design {
    /// That of a degree, [`MOST_DEGREE`] at most: it is the same for every lens, and made once.
    pub fn of(degree: usize) -> &'static Self {
        static ALL: [OnceLock<Design>; MOST_DEGREE + 1] =
            [const { OnceLock::new() }; MOST_DEGREE + 1];
        ALL[degree].get_or_init(|| Self::new(degree))
    }

    fn new(degree: usize) -> Self {
        let count = basis::terms(degree);
        let sets = POINTS.map(
            |per_term| -> LazyLock<Points, Box<dyn FnOnce() -> Points + Send>> {
                LazyLock::new(Box::new(move || Points::new(degree, per_term * count)))
            },
        );
        Self {
            degree,
            count,
            sets,
            powers: basis::in_powers(degree),
        }
    }

    /// Coefficients of the powers of each of the `K` values that `trace` gives at the points, each of a design of this
    /// degree or a lower one; `None` where too few pass.
    fn fit<const K: usize>(
        &self,
        of: [&Design; K],
        trace: impl Fn(&[DVec2]) -> Vec<Option<[f64; K]>>,
    ) -> Option<[Vec<f64>; K]> {
        let count = self.count;
        let mut set = 0;
        while let Some(points) = self.sets.get(set) {
            let least = LEAST_POINTS[set.min(1)];
            let traced = trace(&points.at);
            let taken: Vec<u32> = (0..traced.len() as u32)
                .filter(|&i| traced[i as usize].is_some())
                .collect();
            let is_whole = taken.len() == traced.len();
            let is_enough = is_whole || taken.len() as f64 >= least * count as f64;
            if !is_enough {
                let share = taken.len() as f64 / traced.len() as f64;
                let enough = |n: &usize| *n as f64 * share >= WANTED_POINTS;
                let next = POINTS.iter().position(enough)?;
                set = next.max(set + 1);
                continue;
            }
            let own;
            let factor = match &points.whole {
                Some(whole) if is_whole => whole,
                _ => {
                    own = Factor::of_taken(&points.squares, &points.rows, &taken)?;
                    &own
                }
            };
            let mut sums = vec![0.0; K * count];
            for &i in &taken {
                let row = &points.rows[i as usize * count..][..count];
                for (sums, value) in sums
                    .chunks_exact_mut(count)
                    .zip(traced[i as usize].unwrap_or([0.0; K]))
                {
                    sums.iter_mut().zip(row).for_each(|(s, r)| *s += value * r);
                }
            }
            let mut out = of.map(|design| vec![0.0; design.count]);
            for ((design, out), sums) in of.iter().zip(&mut out).zip(sums.chunks_exact_mut(count)) {
                let sums = &mut sums[..design.count];
                factor.solve(sums);
                for (weight, powers) in sums.iter().zip(design.powers.chunks_exact(design.count)) {
                    out.iter_mut()
                        .zip(powers)
                        .for_each(|(o, p)| *o += weight * p);
                }
            }
            return Some(out);
        }
        None
    }
}

impl Fitter<'_> {
    /// The work of a node in rays that would take as long to be traced exactly.
    pub fn work_rays(&self, Designs { slope, change, .. }: Designs<'_>) -> f64 {
        let fit = |design: &Design, sides: f64| {
            let count = design.count as f64;
            let points = WANTED_POINTS * count;
            sides * points + points * count * count / PRODUCTS_PER_RAY
        };
        let outlines = (self.limiting.len() * edge::RAYS) as f64;
        fit(slope, 1.0) + fit(change, 4.0) + outlines
    }
}

/// Points that fill the unit disk, denser at its edge: a polynomial through them errs as much there as in the middle.
fn spiral(count: usize) -> Vec<DVec2> {
    let golden = std::f64::consts::TAU * 0.381_966_011_250_105_1;
    let point = |i: usize| {
        let u = (i as f64 + 0.5) / count as f64;
        (u * (2.0 - u)).sqrt() * DVec2::from_angle(i as f64 * golden)
    };
    (0..count).map(point).collect()
}

/// A node's values; see [`super::place::Place`].
pub(super) struct Node {
    pub constants: [f64; CONSTANTS],
    pub values: Vec<f32>,
}

impl Fitter<'_> {
    /// The node of a place; `None` where the lens lets too little pass.
    pub fn node(&self, place_mm: DVec2, designs: Designs<'_>) -> Option<Node> {
        let disk = self.pupil.at(place_mm);
        let origin = camera_from_sensor_mm(place_mm, self.sensor_z_mm);
        let targets = |points: &[DVec2], off: DVec2| -> Vec<DVec2> {
            points.iter().map(|p| disk.target(*p, off)).collect()
        };
        let traced = |points: &[DVec2], off: DVec2| {
            self.traced(origin + off.extend(0.0), &targets(points, off))
        };
        let Designs {
            slope,
            place,
            change,
        } = designs;
        let mut main = slope.fit([place, place, slope, slope], |points| {
            traced(points, DVec2::ZERO)
        })?;
        let h = self.step_mm;
        let mut changes = change.fit([change; CHANGES], |points| {
            let sides =
                [-DVec2::X, DVec2::X, -DVec2::Y, DVec2::Y].map(|side| traced(points, h * side));
            (0..points.len())
                .map(|i| {
                    let [x0, x1, y0, y1] = [0, 1, 2, 3].map(|s| sides[s][i]);
                    let (x0, x1, y0, y1) = (x0?, x1?, y0?, y1?);
                    let change = |k: usize| match k < OUTPUTS {
                        true => (x1[k] - x0[k]) / (2.0 * h),
                        false => (y1[k - OUTPUTS] - y0[k - OUTPUTS]) / (2.0 * h),
                    };
                    Some(std::array::from_fn::<f64, CHANGES, _>(change))
                })
                .collect()
        })?;
        let mut constants = [0.0; CONSTANTS];
        for (constant, of) in constants
            .iter_mut()
            .zip(main.iter_mut().chain(&mut changes))
        {
            *constant = std::mem::take(of.last_mut()?);
        }
        let mut values = Vec::new();
        for together in [&main[..2], &main[2..], &changes[..]] {
            let terms = together[0].len();
            let term = |k: usize| together.iter().map(move |of| of[k] as f32);
            values.extend((0..terms).flat_map(term));
        }
        for (_, tracer) in &self.limiting {
            let pass = |points: &[DVec2]| {
                passing(
                    tracer,
                    origin,
                    self.pupil.z_mm,
                    &targets(points, DVec2::ZERO),
                )
            };
            values.extend(edge::outline(pass).iter().map(|&x| x as f32));
        }
        Some(Node { constants, values })
    }

    /// Rays from a place to targets on the pupil's plane, through the larger lens.
    pub fn traced(&self, origin: DVec3, targets: &[DVec2]) -> Vec<Option<[f64; OUTPUTS]>> {
        let mut batch = rays(origin, self.pupil.z_mm, targets);
        self.larger.trace_backward(&mut batch, SimdLevel::detect());
        (0..targets.len())
            .map(|i| self.scene.coordinates(batch.get(i).ok()?))
            .collect()
    }
}

/// Rays from a place to targets on a plane.
pub(super) fn rays(origin: DVec3, plane_z_mm: f64, targets: &[DVec2]) -> RayBatch {
    let mut batch = RayBatch::with_capacity(targets.len());
    targets
        .iter()
        .for_each(|t| batch.push(origin, (t.extend(plane_z_mm) - origin).normalize()));
    batch
}

/// Which of the rays from a place to targets on a plane pass.
pub(super) fn passing(
    tracer: &PacketTracer,
    origin: DVec3,
    plane_z_mm: f64,
    targets: &[DVec2],
) -> Vec<bool> {
    let mut batch = rays(origin, plane_z_mm, targets);
    tracer.trace_backward(&mut batch, SimdLevel::detect());
    batch
        .status
        .iter()
        .map(|&s| s == RayStatus::Ok as u8)
        .collect()
}
