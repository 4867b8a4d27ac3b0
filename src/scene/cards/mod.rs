//! Flat cards: which one each ray of a batch meets first, where, and its radiance there.

mod crossings;
#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;

use std::ops::Range;

pub(crate) use self::crossings::Ways;
use self::crossings::{BLOCK, Crossings};
use super::hits::{Hits, NO_SURFACE};
use super::plane::{Solver, TexturedPlane};
use crate::rays::RaySlices;

/// Flat cards in front of an even environment.
#[derive(Clone, Debug, Default)]
pub(super) struct Cards {
    planes: Vec<TexturedPlane>,
    solvers: Vec<Solver>,
    environment: [f32; 3],
}

impl Cards {
    pub fn new(planes: Vec<TexturedPlane>, environment: [f32; 3]) -> Self {
        let solvers = planes.iter().map(TexturedPlane::solver).collect();
        Self {
            planes,
            solvers,
            environment,
        }
    }

    pub fn planes(&self) -> &[TexturedPlane] {
        &self.planes
    }

    pub fn environment(&self) -> [f32; 3] {
        self.environment
    }

    /// First hits of all rays, into hits that have been reset.
    pub fn intersect(&self, rays: RaySlices<'_>, hits: &mut Hits) {
        let n = hits.distance_mm.len();
        self.find(
            rays,
            n,
            |_| 0.0,
            |number, block, met| {
                self.take(number, block, met, &Ways::NONE, hits);
            },
        );
    }

    /// First hits of pairs of rays that lie beside these, into hits that have been reset. `reach`: the most by which s
    /// or t differs on a card for any of them; `ways` fills in how some of the rays (second) lie beside the crossings
    /// with a card (first).
    pub fn intersect_pairs(
        &self,
        rays: RaySlices<'_>,
        reach: impl Fn(usize) -> f64,
        ways: impl Fn(usize, Range<usize>, &mut [Ways; 2]),
        mut pairs: [&mut Hits; 2],
    ) {
        let n = rays.origin_mm[0].len();
        let mut beside = [Ways::NONE; 2];
        self.find(rays, n, reach, |number, block, met| {
            ways(number, block.clone(), &mut beside);
            for (beside, hits) in beside.iter().zip(&mut pairs) {
                self.take(number, block.clone(), met, beside, hits);
            }
        });
    }

    /// Calls `take` with the crossings of blocks of the first `n` rays with cards that they come near.
    #[inline(always)]
    fn find(
        &self,
        rays: RaySlices<'_>,
        n: usize,
        reach: impl Fn(usize) -> f64,
        mut take: impl FnMut(usize, Range<usize>, &mut Crossings),
    ) {
        let mut met = Crossings::NONE;
        for (number, solver) in self.solvers.iter().enumerate() {
            let reach = reach(number);
            for start in (0..n).step_by(BLOCK) {
                let block = start..n.min(start + BLOCK);
                let rays =
                    [rays.origin_mm, rays.direction].map(|all| all.map(|a| &a[block.clone()]));
                if met.find(solver, rays, reach) {
                    take(number, block, &mut met);
                }
            }
        }
    }

    /// Writes down the rays of a block that meet a card before what they met so far.
    fn take(
        &self,
        number: usize,
        block: Range<usize>,
        met: &mut Crossings,
        ways: &Ways,
        hits: &mut Hits,
    ) {
        let distance_mm = &mut hits.distance_mm[block.clone()];
        met.choose(ways, distance_mm);
        let plane = &self.planes[number];
        if plane.has_coverage() {
            met.leave_out(ways, block.len(), |s, t| !plane.is_solid_at(s, t));
        }
        let places = [&mut hits.cards.s, &mut hits.cards.t].map(|x| &mut x[block.clone()]);
        met.take(
            number as u16,
            ways,
            distance_mm,
            &mut hits.surface[block],
            places,
        );
    }

    /// Radiance of colour channel `channel` at each hit, into `out` (same length).
    pub fn radiance(&self, hits: &Hits, channel: usize, out: &mut [f32]) {
        // Most rays of a block meet one card.
        let seen = hits.surface.iter().find(|s| **s != NO_SURFACE);
        let first = seen.copied().unwrap_or(NO_SURFACE);
        let (s, t) = (&hits.cards.s, &hits.cards.t);
        match self.planes.get(first as usize) {
            Some(plane) => (plane.texture()).sample_channel_batch(s, t, channel, out),
            None => out.fill(self.environment[channel]),
        }
        let parts = (hits.surface.chunks(BLOCK).zip(out.chunks_mut(BLOCK)))
            .zip(s.chunks(BLOCK).zip(t.chunks(BLOCK)));
        for ((surfaces, out), (s, t)) in parts {
            if surfaces.iter().all(|surface| *surface == first) {
                continue;
            }
            for (number, plane) in self.planes.iter().enumerate() {
                if number != first as usize {
                    let met = |i: &usize| surfaces[*i] as usize == number;
                    sample_some(
                        (0..surfaces.len()).filter(met),
                        [s, t],
                        |[s, t], values| {
                            plane.texture().sample_channel_batch(s, t, channel, values);
                        },
                        out,
                    );
                }
            }
            for (out, surface) in out.iter_mut().zip(surfaces) {
                if *surface == NO_SURFACE {
                    *out = self.environment[channel];
                }
            }
        }
    }
}

/// Looks up those of a block's points whose numbers are given, side by side.
fn sample_some(
    numbers: impl Iterator<Item = usize>,
    [s, t]: [&[f32]; 2],
    sample: impl Fn([&[f32]; 2], &mut [f32]),
    out: &mut [f32],
) {
    let (mut from, mut count) = ([0; BLOCK], 0);
    let (mut points, mut values) = ([[0.0; BLOCK]; 2], [0.0; BLOCK]);
    for i in numbers {
        (from[count], points[0][count], points[1][count]) = (i, s[i], t[i]);
        count += 1;
    }
    sample(points.each_ref().map(|x| &x[..count]), &mut values[..count]);
    (from[..count].iter().zip(values)).for_each(|(&i, value)| out[i] = value);
}
