//! Flat cards: which one each ray of a batch meets first, where, and its radiance there.

use super::hits::{Hits, NO_SURFACE};
use super::plane::{Solver, TexturedPlane};
use crate::rays::RaySlices;
use crate::simd::SimdLevel;

/// Rays whose crossings with a card's plane are found together.
const BLOCK: usize = 128;

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
        for (index, (plane, solver)) in self.planes.iter().zip(&self.solvers).enumerate() {
            if plane.has_coverage() {
                update(solver, rays, hits, index as u16, |s, t| {
                    plane.is_solid_at(s, t)
                });
            } else {
                update(solver, rays, hits, index as u16, |_, _| true);
            }
        }
    }

    /// First hits of rays beside these, into hits that have been reset: `beside` has by how much s and t of a ray's
    /// crossing (second number) with a card (first number) change.
    pub fn intersect_beside(
        &self,
        rays: RaySlices<'_>,
        beside: impl Fn(usize, usize) -> [f32; 2],
        hits: &mut Hits,
    ) {
        let level = SimdLevel::detect();
        let n = hits.distance_mm.len();
        let mut met = Crossings::NONE;
        for (index, (plane, solver)) in self.planes.iter().zip(&self.solvers).enumerate() {
            for start in (0..n).step_by(BLOCK) {
                let block = start..n.min(start + BLOCK);
                let origins = rays.origin_mm.map(|a| &a[block.clone()]);
                let directions = rays.direction.map(|a| &a[block.clone()]);
                let distance = &mut hits.distance_mm[block.clone()];
                met.find(solver, [origins, directions], distance, level);
                for (i, ray) in block.enumerate() {
                    let [ds, dt] = beside(index, ray);
                    let (s, t) = (met.s[i] as f32 + ds, met.t[i] as f32 + dt);
                    let within = |x: f32| (0.0..=1.0).contains(&x);
                    let before = met.tau[i] > 0.0 && met.tau[i] < distance[i];
                    if before && within(s) && within(t) && plane.is_solid_at(s.into(), t.into()) {
                        distance[i] = met.tau[i];
                        (hits.cards.s[ray], hits.cards.t[ray]) = (s, t);
                        hits.surface[ray] = index as u16;
                    }
                }
            }
        }
    }

    /// Radiance of colour channel `channel` at each hit, into `out` (same length).
    pub fn radiance(&self, hits: &Hits, channel: usize, out: &mut [f32]) {
        // Most rays of a block meet one card.
        let seen = hits.surface.iter().find(|s| **s != NO_SURFACE);
        let first = seen.copied().unwrap_or(NO_SURFACE);
        let (s, t) = (&hits.cards.s, &hits.cards.t);
        if let Some(plane) = self.planes.get(first as usize) {
            (plane.texture()).sample_channel_batch(s, t, channel, out);
        }
        for (i, o) in out.iter_mut().enumerate() {
            let surface = hits.surface[i];
            if surface != first || surface == NO_SURFACE {
                *o = match self.planes.get(surface as usize) {
                    Some(plane) => plane.texture().sample_channel(s[i], t[i], channel),
                    None => self.environment[channel],
                };
            }
        }
    }
}

/// Takes over the rays that meet this plane before what they met so far.
#[inline(always)]
fn update(
    plane: &Solver,
    rays: RaySlices<'_>,
    hits: &mut Hits,
    index: u16,
    solid: impl Fn(f64, f64) -> bool,
) {
    let level = SimdLevel::detect();
    let n = hits.distance_mm.len();
    let mut met = Crossings::NONE;
    for start in (0..n).step_by(BLOCK) {
        let block = start..n.min(start + BLOCK);
        let distance = &mut hits.distance_mm[block.clone()];
        let origins = rays.origin_mm.map(|a| &a[block.clone()]);
        let directions = rays.direction.map(|a| &a[block.clone()]);
        if !met.find(plane, [origins, directions], distance, level) {
            continue;
        }
        for (i, ray) in block.enumerate() {
            let (s, t) = (met.s[i], met.t[i]);
            if met.inside[i] != 0 && solid(s, t) {
                distance[i] = met.tau[i];
                hits.cards.s[ray] = s as f32;
                hits.cards.t[ray] = t as f32;
                hits.surface[ray] = index;
            }
        }
    }
}

/// Where rays cross a card's plane.
struct Crossings {
    /// Distance along each ray.
    tau: [f64; BLOCK],
    s: [f64; BLOCK],
    t: [f64; BLOCK],
    /// Not 0: within the card, and before what the ray met so far.
    inside: [u64; BLOCK],
}

impl Crossings {
    const NONE: Self = Self {
        tau: [0.0; BLOCK],
        s: [0.0; BLOCK],
        t: [0.0; BLOCK],
        inside: [0; BLOCK],
    };

    /// Of rays by their origins and directions, as many as there are distances. Whether any lies within the card. The
    /// `level` changes the speed only.
    fn find(
        &mut self,
        plane: &Solver,
        rays: [[&[f64]; 3]; 2],
        distance_mm: &[f64],
        level: SimdLevel,
    ) -> bool {
        match level {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
            SimdLevel::Avx512 => unsafe { find_avx512(self, plane, rays, distance_mm) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 => unsafe { find_avx2(self, plane, rays, distance_mm) },
            _ => find(self, plane, rays, distance_mm),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn find_avx2(met: &mut Crossings, plane: &Solver, rays: [[&[f64]; 3]; 2], far: &[f64]) -> bool {
    find(met, plane, rays, far)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn find_avx512(met: &mut Crossings, plane: &Solver, rays: [[&[f64]; 3]; 2], far: &[f64]) -> bool {
    find(met, plane, rays, far)
}

/// Straight-line arithmetic, in one order at every SIMD level.
#[inline(always)]
fn find(
    met: &mut Crossings,
    plane: &Solver,
    [origins, directions]: [[&[f64]; 3]; 2],
    distance_mm: &[f64],
) -> bool {
    let n = distance_mm.len().min(BLOCK);
    let [ox, oy, oz] = origins.map(|a| &a[..n]);
    let [dx, dy, dz] = directions.map(|a| &a[..n]);
    let (taus, ss, ts) = (&mut met.tau[..n], &mut met.s[..n], &mut met.t[..n]);
    let (insides, distance_mm) = (&mut met.inside[..n], &distance_mm[..n]);
    let mut any = 0;
    for i in 0..n {
        let (o, d) = (
            glam::DVec3::new(ox[i], oy[i], oz[i]),
            glam::DVec3::new(dx[i], dy[i], dz[i]),
        );
        let tau = (plane.offset - plane.normal.dot(o)) / plane.normal.dot(d);
        let p = o + tau * d;
        let s = plane.s_axis.dot(p) + plane.s0;
        let t = plane.t_axis.dot(p) + plane.t0;
        // Written so that NaN (a lost ray, or one along the plane) is no hit.
        let within = |x: f64| (0.0..=1.0).contains(&x);
        let inside = (tau > 0.0) & (tau < distance_mm[i]) & within(s) & within(t);
        (taus[i], ss[i], ts[i]) = (tau, s, t);
        insides[i] = u64::from(inside);
        any |= insides[i];
    }
    any != 0
}
