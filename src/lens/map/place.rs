//! A map at one place on the sensor: its nodes' coefficients, blended.

use glam::{DMat2, DVec2};

use super::edge::DIRECTIONS;
use super::frame::CONSTANTS;
use super::lens_map::LensMap;
use crate::frames::camera_from_sensor_mm;
use crate::rays::RayBatch;
use crate::simd::SimdLevel;

/// Reach where no surface limits the bundle.
const UNLIMITED: f32 = 1e9;

/// Rays that are traced exactly.
#[derive(Clone, Debug, Default)]
pub(super) struct Doubtful {
    pub numbers: Vec<usize>,
    pub batch: RayBatch,
}

/// Buffers for one map, which a thread takes from place to place; places of one row share work.
#[derive(Clone, Debug, Default)]
pub struct PlaceBuffers {
    /// Where it is.
    at_mm: Option<DVec2>,
    /// y of the row that is blended, mm.
    row: Option<f64>,
    row_constants: Vec<f64>,
    row_values: Vec<f32>,
    pub(super) place: Place,
    pub(super) rays: Doubtful,
}

/// The least of the outlines of all limiting surfaces.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    /// Reach in each direction, and the first again.
    pub reach: [f32; DIRECTIONS + 1],
    /// How far the bundle may go beyond the chord from a direction to the next: where two outlines cross between them,
    /// it has a corner.
    pub corner: [f32; DIRECTIONS],
}

impl Default for Edge {
    fn default() -> Self {
        Self {
            reach: [UNLIMITED; DIRECTIONS + 1],
            corner: [0.0; DIRECTIONS],
        }
    }
}

impl Edge {
    #[inline(always)]
    fn set(&mut self, outlines: &[f32]) {
        self.reach.fill(UNLIMITED);
        self.corner.fill(UNLIMITED);
        let least = |a: f32, b: f32| if b < a { b } else { a };
        for outline in outlines.chunks_exact(DIRECTIONS) {
            for k in 0..DIRECTIONS {
                let middle = 0.5 * (outline[k] + outline[(k + 1) % DIRECTIONS]);
                self.reach[k] = least(self.reach[k], outline[k]);
                self.corner[k] = least(self.corner[k], middle);
            }
        }
        self.reach[DIRECTIONS] = self.reach[0];
        for k in 0..DIRECTIONS {
            // The chord is concave with one bend: at the bend it is at most twice as high as in the middle.
            let chord = 0.5 * (self.reach[k] + self.reach[k + 1]);
            self.corner[k] = 2.0 * (self.corner[k] - chord);
        }
    }
}

/// What the kernel takes.
#[derive(Clone, Debug, Default)]
pub(super) struct Place {
    /// The place, camera frame, mm.
    pub origin: DVec2,
    /// Pupil coordinates: (p, q) = inverse · (target − centre − drift · off), `off` being from the place to the ray's
    /// start.
    pub centre: DVec2,
    pub inverse: DMat2,
    pub drift: DMat2,
    /// Rays nearer to the edge than this are doubtful: of those that start at the place, and of those that start as far
    /// beside it as the map reaches; infinite where it does not hold.
    pub band: [f32; 2],
    pub constants: Vec<f64>,
    /// Coefficients, changes' coefficients, outlines.
    pub values: Vec<f32>,
    /// The least of the outlines, and its first value again.
    pub edge: Edge,
}

impl PlaceBuffers {
    /// Goes to a place.
    pub(super) fn go(&mut self, map: &LensMap, place_mm: DVec2, level: SimdLevel) {
        if self.at_mm == Some(place_mm) {
            return;
        }
        self.at_mm = Some(place_mm);
        match level.min(SimdLevel::detect()) {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX-512 F, DQ and VL on this CPU.
            SimdLevel::Avx512 => unsafe { go_avx512(self, map, place_mm) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 => unsafe { go_avx2(self, map, place_mm) },
            _ => self.blend_at(map, place_mm),
        }
    }

    /// Goes to a place where every ray passes.
    pub(super) fn go_unbounded(&mut self, map: &LensMap, place_mm: DVec2) {
        self.go(map, place_mm, SimdLevel::detect());
        self.place.edge = Edge::default();
        self.at_mm = None;
    }

    /// Blends the nodes around a place: the same bits with all instructions, as nothing is contracted.
    #[inline(always)]
    fn blend_at(&mut self, map: &LensMap, place_mm: DVec2) {
        let (nx, ny) = map.nodes;
        let stride = map.stride();
        let w = &map.window;
        let rows = Stencil::new(place_mm.y - w.centre.y, w.half_height, ny);
        if self.row != Some(place_mm.y) {
            self.row = Some(place_mm.y);
            blend(
                &mut self.row_constants,
                &map.constants,
                nx * CONSTANTS,
                &rows,
            );
            blend(&mut self.row_values, &map.values, nx * stride, &rows);
        }
        let columns = Stencil::new(place_mm.x - w.centre.x, w.half_width, nx);
        let place = &mut self.place;
        blend(
            &mut place.constants,
            &self.row_constants,
            CONSTANTS,
            &columns,
        );
        blend(&mut place.values, &self.row_values, stride, &columns);
        place.band = map.bands[rows.cell * (nx - 1) + columns.cell];
        (place.edge).set(&place.values[stride - map.limiting.len() * DIRECTIONS..]);
        let disk = map.pupil.at(place_mm);
        place.origin = camera_from_sensor_mm(place_mm, 0.0).truncate();
        place.centre = disk.centre;
        place.drift = disk.drift;
        place.inverse = disk.shape.inverse();
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn go_avx2(buffers: &mut PlaceBuffers, map: &LensMap, place_mm: DVec2) {
    buffers.blend_at(map, place_mm);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl")]
fn go_avx512(buffers: &mut PlaceBuffers, map: &LensMap, place_mm: DVec2) {
    buffers.blend_at(map, place_mm);
}

/// The polynomial through some nodes next to a place, all of them or this many: its degree is one less.
const STENCIL: usize = 6;

/// Nodes next to a place, and their weights.
struct Stencil {
    /// The cell that the place is in.
    cell: usize,
    first: usize,
    count: usize,
    weights: [f64; STENCIL],
}

impl Stencil {
    /// At offset x from the middle of n nodes over ±half.
    fn new(x: f64, half: f64, n: usize) -> Self {
        let last = (n - 1) as f64;
        let f = ((x / half + 1.0) * 0.5 * last).clamp(0.0, last);
        let f = if f.is_finite() { f } else { 0.5 * last };
        let cell = (f as usize).min(n - 2);
        let count = n.min(STENCIL);
        let first = (cell + 1).saturating_sub(count / 2).min(n - count);
        let t = f - first as f64;
        let mut weights = [0.0; STENCIL];
        for (k, weight) in weights.iter_mut().enumerate().take(count) {
            // Lagrange's.
            let others = (0..count).filter(|j| *j != k);
            *weight = others.fold(1.0, |w, j| w * (t - j as f64) / (k as f64 - j as f64));
        }
        Self {
            cell,
            first,
            count,
            weights,
        }
    }
}

/// Numbers that are blended.
trait Number: Copy + std::ops::AddAssign + std::ops::Mul<Output = Self> {
    const ZERO: Self;
    fn rounded(x: f64) -> Self;
}

impl Number for f64 {
    const ZERO: Self = 0.0;
    fn rounded(x: f64) -> Self {
        x
    }
}

impl Number for f32 {
    const ZERO: Self = 0.0;
    fn rounded(x: f64) -> Self {
        x as f32
    }
}

/// The weighted sum of the stencil's parts of `len` numbers each.
#[inline(always)]
fn blend<T: Number>(out: &mut Vec<T>, parts: &[T], len: usize, stencil: &Stencil) {
    out.clear();
    out.resize(len, T::ZERO);
    for (k, weight) in stencil.weights.iter().enumerate().take(stencil.count) {
        let weight = T::rounded(*weight);
        let part = &parts[(stencil.first + k) * len..][..len];
        out.iter_mut()
            .zip(part)
            .for_each(|(o, p)| *o += weight * *p);
    }
}
