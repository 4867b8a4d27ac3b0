//! Displacements of rays that give the blur of waves with the lens's own phases, in focus and beside it.
//!
//! With the phase W of the wave over the pupil, the light of a point spreads on the sensor as
//!
//! ```text
//! I_c(κ) = |∫ exp(i (W(q) + c |q|² − κ·q)) d²q|² ,      ∫ I_c = 1
//! ```
//!
//! c: defocus. Rays put the light of q at ∇W(q) + 2 c q. Particles (q, D), even over the pupil, stand for the rays and
//! their displacements: D is sought such that ∇W + 2 c q + D is spread as I_c *for several c at once*. Waves have no
//! such particles exactly: the joint density of place and direction that does it (Wigner's) is below 0 in places. The
//! search goes through the planes c in turn and moves the particles part of the way towards I_c, by one dimension at a
//! time: along a direction, the particles in their order go to the quantiles of I_c in theirs (sliced transport; Pitié,
//! Kokaram, Dahyot, ICCV 2005). The plane in focus is taken every other time, and last.
//!
//! I_c is summed directly up to |κ| = `reach`; its light beyond is what the edge of the pupil diffracts far, and the
//! particles that the pattern without phases ([`super::kernel`]) displaces the farthest stay there.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, Vec2};

use super::kernel::Kernel;
use super::planes::{Plane, Pupil, Turns};
use super::wavefront::Wavefront;

/// Particles, about.
const PARTICLES: usize = 3072;
/// Cells over the square around the pupil, along each side.
const CELLS: usize = 24;
/// Least and most |κ| that the intensity is summed up to: half of what the points resolve.
const REACH: [f64; 2] = [40.0, 90.0];
/// Defocus at the edge |q| = 1 of the planes, waves.
const PLANES: [f64; 9] = [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0];
/// The plane in focus.
const IN_FOCUS: usize = 4;
/// Planes in the order in which they are taken, again and again: neighbours far apart, as each undoes a little of what
/// the one before did.
const TURNS: [usize; 10] = [0, 5, 2, 7, IN_FOCUS, 1, 6, 3, 8, IN_FOCUS];
/// Reach over how far rays pass the point in any plane, at least.
const SPREAD: f64 = 2.0;
/// How often.
const SWEEPS: usize = 14;
/// Steps in focus at the end.
const LAST: usize = 2;
/// Longest move of a particle along a direction in a step.
const LONGEST: f64 = 20.0;
/// Steps of the golden ratio, and of the plastic number: points in a line and in the plane, evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
pub(super) const PLASTIC: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];

/// Displacements by the place in the pupil, in the units of [`Kernel`].
#[derive(Clone, Debug)]
pub(super) struct PhaseDraw {
    /// Cells per unit along the sides of the square that they divide.
    per_unit: f64,
    /// Where the particles of each cell begin, row by row; one more: where the last ends.
    first: Vec<u32>,
    displacements: Vec<Vec2>,
}

impl PhaseDraw {
    /// For the waves `phases` over the pupil of `kernel`. `None` where phases change faster than can be summed.
    pub fn new(kernel: &Kernel, phases: &Wavefront) -> Option<Self> {
        let half = kernel.radius();
        let places = places(kernel, half);
        let slopes: Vec<DVec2> = places.iter().map(|&q| phases.gradient(q)).collect();
        let farthest = PLANES
            .iter()
            .map(|p| 4.0 * PI * p.abs() * half)
            .fold(0.0, f64::max)
            + slopes.iter().map(|s| s.length()).fold(0.0, f64::max);
        if farthest.is_nan() || SPREAD * farthest > REACH[1] {
            return None;
        }
        let reach = (SPREAD * farthest).max(REACH[0]);
        let drawn = |(i, &q): (usize, &DVec2)| kernel.displacement(q, (i as f64 * GOLDEN).fract());
        let mut displacements: Vec<DVec2> = places.iter().enumerate().map(drawn).collect();
        let pupil = Pupil::new(kernel, phases, half);
        let turns = Turns::new(&pupil.axis, reach);
        let planes = PLANES.map(|waves| Plane::new(&pupil, &turns, TAU * waves, reach));
        // The others stay far out.
        let is_near = |i: &usize| displacements[*i].length() <= reach;
        let order: Vec<usize> = (0..places.len()).filter(is_near).collect();
        let near = Near {
            places: &places,
            slopes: &slopes,
            numbers: &order,
        };
        let targets: Vec<Vec<DVec2>> = planes.iter().map(|p| p.samples(order.len())).collect();
        let mut buffers = Buffers::default();
        let steps = (0..SWEEPS).flat_map(|sweep| {
            let part = if 2 * sweep < SWEEPS { 0.5 } else { 0.25 };
            TURNS.map(|plane| (plane, part))
        });
        for (number, (plane, part)) in steps.chain([(IN_FOCUS, 1.0); LAST]).enumerate() {
            let turn = DVec2::from_angle(PI * (number as f64 * GOLDEN).fract());
            let defocus = 2.0 * TAU * PLANES[plane];
            buffers.step(
                &near,
                &mut displacements,
                defocus,
                &targets[plane],
                [turn, part * DVec2::ONE],
            );
        }
        Some(Self::sorted(half, &places, &displacements))
    }

    /// The displacement of the ray through the point `q` of the pupil; `sample` in [0, 1).
    #[inline]
    pub fn displacement(&self, q: DVec2, sample: f64) -> DVec2 {
        let cell = cell(q, self.per_unit);
        let (first, last) = (self.first[cell], self.first[cell + 1]);
        let number = first as usize + (sample * f64::from(last - first)) as i32 as usize;
        self.displacements[number].as_dvec2()
    }

    fn sorted(half: f64, places: &[DVec2], displacements: &[DVec2]) -> Self {
        let per_unit = 0.5 * CELLS as f64 / half;
        let mut cells: Vec<Vec<DVec2>> = vec![Vec::new(); CELLS * CELLS];
        for (place, d) in places.iter().zip(displacements) {
            // The wave's place is that of the ray, less its displacement.
            cells[cell(*place, per_unit)].push(-*d);
        }
        // From inwards to outwards, so that the samples of neighbouring rays, which differ, take them to both sides.
        for (c, displacements) in cells.iter_mut().enumerate() {
            let corner = DVec2::new((c % CELLS) as f64, (c / CELLS) as f64);
            let outwards = corner + 0.5 - 0.5 * CELLS as f64;
            displacements.sort_by(|a, b| a.dot(outwards).total_cmp(&b.dot(outwards)));
        }
        let filled: Vec<usize> = (0..cells.len()).filter(|&c| !cells[c].is_empty()).collect();
        let mut sorted = Self {
            per_unit,
            first: vec![0],
            displacements: Vec::new(),
        };
        for c in 0..cells.len() {
            let apart = |other: &usize| {
                let (dx, dy) = (
                    (c % CELLS).abs_diff(other % CELLS),
                    (c / CELLS).abs_diff(other / CELLS),
                );
                dx * dx + dy * dy
            };
            // A ray by the edge may fall into a cell without particles.
            let nearest = filled
                .iter()
                .min_by_key(|other| apart(other))
                .copied()
                .unwrap_or(c);
            (sorted.displacements).extend(cells[nearest].iter().map(|d| d.as_vec2()));
            sorted.first.push(sorted.displacements.len() as u32);
        }
        sorted
    }
}

#[inline]
fn cell(q: DVec2, per_unit: f64) -> usize {
    let along = |x: f64| {
        let at = x * per_unit + 0.5 * CELLS as f64;
        (at.max(0.0) as i32).min(CELLS as i32 - 1) as usize
    };
    along(q.y) * CELLS + along(q.x)
}

/// Points even over the pupil.
fn places(kernel: &Kernel, half: f64) -> Vec<DVec2> {
    let point = |i: usize| {
        let part = DVec2::from(PLASTIC.map(|step| (0.5 + i as f64 * step).fract()));
        half * (2.0 * part - 1.0)
    };
    let all = (PARTICLES as f64 * 4.0 / PI) as usize;
    (0..all)
        .map(point)
        .filter(|q| kernel.is_inside(*q))
        .collect()
}

/// The particles that are moved.
struct Near<'a> {
    places: &'a [DVec2],
    slopes: &'a [DVec2],
    numbers: &'a [usize],
}

/// Memory of a step.
#[derive(Default)]
struct Buffers {
    places: Vec<f32>,
    /// Particles in the order of their places.
    order: Vec<u32>,
    along: Vec<f32>,
    /// Places of the target in their order.
    target: Vec<u32>,
    moves: Vec<DVec2>,
}

impl Buffers {
    /// Moves the particles towards the target in a plane, part of the way along a direction and across it.
    fn step(
        &mut self,
        near: &Near<'_>,
        displacements: &mut [DVec2],
        defocus: f64,
        target: &[DVec2],
        [turn, part]: [DVec2; 2],
    ) {
        self.moves.clear();
        self.moves.resize(near.numbers.len(), DVec2::ZERO);
        for (along, part) in [(turn, part.x), (turn.perp(), part.y)] {
            self.places.clear();
            self.places.extend(near.numbers.iter().map(|&i| {
                let at = near.slopes[i] + defocus * near.places[i] + displacements[i];
                at.dot(along) as f32
            }));
            self.along.clear();
            self.along
                .extend(target.iter().map(|t| t.dot(along) as f32));
            sort(&self.places, &mut self.order);
            sort(&self.along, &mut self.target);
            for (&k, &to) in self.order.iter().zip(&self.target) {
                let (k, to) = (k as usize, to as usize);
                let way = f64::from(self.along[to] - self.places[k]);
                self.moves[k] += part * way.clamp(-LONGEST, LONGEST) * along;
            }
        }
        for (&i, way) in near.numbers.iter().zip(&self.moves) {
            displacements[i] += *way;
        }
    }
}

/// Parts of the values' span that [`sort`] tells apart: at the largest reach a thirtieth of the pattern's rings.
const PARTS: usize = 1 << 11;
/// Values that are compared side by side.
const LANES: usize = 8;

/// Numbers of the values in their order, to a part of what they span: counted, then placed.
fn sort(values: &[f32], order: &mut Vec<u32>) {
    let [first, last] = span(values);
    let per_unit = (PARTS - 1) as f32 / (last - first).max(f32::MIN_POSITIVE);
    let part = |value: f32| ((value - first) * per_unit) as i32 as usize & (PARTS - 1);
    let mut next = [0u32; PARTS];
    values.iter().for_each(|value| next[part(*value)] += 1);
    let mut begin = 0;
    for next in &mut next {
        (*next, begin) = (begin, begin + *next);
    }
    order.clear();
    order.resize(values.len(), 0);
    for (k, value) in values.iter().enumerate() {
        let at = &mut next[part(*value)];
        order[*at as usize] = k as u32;
        *at += 1;
    }
}

/// Least and largest of the values, in lanes.
fn span(values: &[f32]) -> [f32; 2] {
    let mut spans = [[f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]];
    for values in values.chunks(LANES) {
        let [least, largest] = &mut spans;
        for (value, (least, largest)) in values.iter().zip(least.iter_mut().zip(largest)) {
            *least = if value < least { *value } else { *least };
            *largest = if value > largest { *value } else { *largest };
        }
    }
    let [least, largest] = spans;
    [
        least.into_iter().fold(f32::INFINITY, f32::min),
        largest.into_iter().fold(f32::NEG_INFINITY, f32::max),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::uniform;

    #[test]
    fn values_are_in_order_to_a_part_of_their_span() {
        let values: Vec<f32> = (0..5000)
            .map(|k| uniform(7, &[k]) as f32 * 30.0 - 11.0)
            .collect();
        let mut order = Vec::new();
        sort(&values, &mut order);
        let mut numbers = order.clone();
        numbers.sort_unstable();
        assert!(numbers.iter().copied().eq(0..5000));
        let mut highest = f32::NEG_INFINITY;
        for &k in &order {
            assert!(values[k as usize] > highest - 30.0 / (PARTS - 1) as f32);
            highest = highest.max(values[k as usize]);
        }
        sort(&[4.0; 3], &mut order);
        assert_eq!(order, [0, 1, 2]);
        sort(&[], &mut order);
        assert!(order.is_empty());
    }
}
