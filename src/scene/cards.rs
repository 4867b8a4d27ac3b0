//! Flat cards: which one each ray of a batch meets first, where, and its radiance there.

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

    /// Radiance of colour channel `channel` at each hit, into `out` (same length).
    pub fn radiance(&self, hits: &Hits, channel: usize, out: &mut [f32]) {
        let first = hits.surface.first().copied().unwrap_or(NO_SURFACE);
        if first != NO_SURFACE && hits.surface.iter().all(|&s| s == first) {
            self.planes[first as usize].texture().sample_channel_batch(
                &hits.cards.s,
                &hits.cards.t,
                channel,
                out,
            );
            return;
        }
        for (i, o) in out.iter_mut().enumerate() {
            *o = match self.planes.get(hits.surface[i] as usize) {
                Some(plane) => {
                    plane
                        .texture()
                        .sample_channel(hits.cards.s[i], hits.cards.t[i], channel)
                }
                None => self.environment[channel],
            };
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
    let n = hits.distance_mm.len();
    let [ox, oy, oz] = rays.origin_mm.map(|a| &a[..n]);
    let [dx, dy, dz] = rays.direction.map(|a| &a[..n]);
    let (distance, surface) = (&mut hits.distance_mm[..n], &mut hits.surface[..n]);
    let (hit_s, hit_t) = (&mut hits.cards.s[..n], &mut hits.cards.t[..n]);
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
        let inside = (tau > 0.0) & (tau < distance[i]) & within(s) & within(t);
        if inside && solid(s, t) {
            distance[i] = tau;
            hit_s[i] = s as f32;
            hit_t[i] = t as f32;
            surface[i] = index;
        }
    }
}
