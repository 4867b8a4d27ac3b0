//! A diffraction pattern to draw displacements from, ray by ray.
//!
//! Any draw that leaves the pattern's density even over the pupil gives its blur. Light that passes near the edge is
//! what the edge diffracts, so each ray is displaced by its place in the pupil: as far as the share of the pupil
//! within its radius is the share of the energy within that of the displacement, and along its own direction from
//! the pupil's middle, to either side. With that the blur of rays and pattern together follows the waves closely also
//! with aberrations (up to half the cutoff frequency within 0.05 for half a wave of defocus or astigmatism, where an
//! independent draw errs by 0.2): the transfer function of the waves at a frequency is a mean over the part of the
//! pupil that the frequency shifts into itself, and the rays at the edge, which are not in it, are those displaced far.
//!
//! The pattern is tabulated over the root h of the share of energy and the share t of a turn. Far out the energy beyond
//! a radius falls with 1/radius, so the table holds displacement × (1 − h²).

use glam::DVec2;

use super::pattern::{ANGLES, Pattern, RADII, STEP};

/// Cells along h and along the turn.
const RINGS: usize = 512;
const SECTORS: usize = 64;
/// The energy beyond the farthest displacement, which is put there: 0.6 λ/(this share · numerical aperture) away.
const BEYOND: f64 = 1e-4;
/// Shares of the pupil whose rays are displaced alike, each by a random part of its share of the energy: rays by an
/// edge that is known to 0.2 % cannot tell how far in the last of them they are.
const SHARES: f64 = 16.0;

/// See the module. Displacements are in units of λ/2π over the scale of the outline.
#[derive(Clone, Debug)]
pub(super) struct Kernel {
    /// `[ring][sector]`, each with its last repeated; of a disk, which is alike all round, one sector: along x.
    table: Vec<DVec2>,
    /// `None` for a disk of radius 1.
    edge: Option<Edge>,
}

impl Kernel {
    /// Of a disk of radius 1.
    pub fn disk() -> Self {
        let at = |i: u32| DVec2::from_angle(std::f64::consts::TAU * f64::from(i) / 720.0);
        let pattern = Pattern::new(&(0..720).map(at).collect::<Vec<_>>());
        let radial = Radial::new(&pattern);
        let ring = |ring: usize| radial.scaled(ring, &pattern).0 * DVec2::X;
        Self {
            table: (0..=RINGS).map(ring).collect(),
            edge: None,
        }
    }

    /// Of the region inside an outline around the origin.
    pub fn new(outline: &[DVec2]) -> Self {
        let pattern = Pattern::new(outline);
        let radial = Radial::new(&pattern);
        let mut table = Vec::with_capacity((RINGS + 1) * (SECTORS + 1));
        for ring in 0..=RINGS {
            let (scaled, density) = radial.scaled(ring, &pattern);
            let angles = Angles::new(&density);
            table.extend((0..=SECTORS).map(|sector| {
                scaled * DVec2::from_angle(angles.at(sector as f64 / SECTORS as f64))
            }));
        }
        Self {
            table,
            edge: Some(Edge::new(outline)),
        }
    }

    /// Farthest point of the outline.
    pub fn radius(&self) -> f64 {
        self.edge.as_ref().map_or(1.0, |edge| edge.bounds[1])
    }

    /// Whether a point lies in the pupil.
    pub fn is_inside(&self, q: DVec2) -> bool {
        let squared = q.length_squared();
        let [nearest, farthest] = self.edge.as_ref().map_or([1.0; 2], |edge| edge.bounds);
        squared < nearest * nearest
            || squared < farthest * farthest
                && (self.edge.as_ref()).is_some_and(|edge| squared < edge.at(q).0.powi(2))
    }

    /// The displacement of the ray through the point `q` of the pupil, in the units of the outline; `sample` in [0, 1).
    #[inline]
    pub fn displacement(&self, q: DVec2, sample: f64) -> DVec2 {
        let turned = if sample < 0.5 { 1.0 } else { -1.0 };
        let part = (2.0 * sample).fract();
        let share = |within: f64| ((within * SHARES).floor().min(SHARES - 1.0) + part) / SHARES;
        match &self.edge {
            None => {
                let within = q.length_squared();
                let length = self.along_x(share(within)) * turned / within.sqrt();
                if length.is_finite() {
                    q * length
                } else {
                    DVec2::ZERO
                }
            }
            Some(edge) => {
                let (radius, turn) = edge.at(q);
                turned * self.around(share(q.length_squared() / (radius * radius)), turn)
            }
        }
    }

    /// The displacement beyond which 1 − `share` of the energy lies, at the share `turn` of the ring's energy.
    pub fn displacement_at(&self, share: f64, turn: f64) -> DVec2 {
        match self.edge {
            None => DVec2::from_angle(std::f64::consts::TAU * turn) * self.along_x(share),
            Some(_) => self.around(share, turn),
        }
    }

    fn along_x(&self, share: f64) -> f64 {
        let (ring, part) = cell(share.sqrt(), RINGS);
        let (near, far) = (self.table[ring].x, self.table[ring + 1].x);
        (near + part * (far - near)) / (1.0 - share).max(BEYOND)
    }

    fn around(&self, share: f64, turn: f64) -> DVec2 {
        let (ring, outwards) = cell(share.sqrt(), RINGS);
        let (sector, onwards) = cell(turn, SECTORS);
        let between = |ring: usize| {
            let at = ring * (SECTORS + 1) + sector;
            self.table[at] + onwards * (self.table[at + 1] - self.table[at])
        };
        let (near, far) = (between(ring), between(ring + 1));
        (near + outwards * (far - near)) / (1.0 - share).max(BEYOND)
    }
}

/// Cell and part of it of a number from 0 to 1 on a table of so many cells.
#[inline]
fn cell(x: f64, cells: usize) -> (usize, f64) {
    let at = x * cells as f64;
    let cell = (at as usize).min(cells - 1);
    (cell, at - cell as f64)
}

/// The edge of a region around the origin.
#[derive(Clone, Debug)]
struct Edge {
    /// Radius, and the share of the area up to there, at even angles from 0 on, the last a whole turn.
    at: Vec<(f64, f64)>,
    /// The least and the largest radius.
    bounds: [f64; 2],
}

impl Edge {
    /// Angles that the edge is tabulated at.
    const COUNT: usize = 256;

    fn new(outline: &[DVec2]) -> Self {
        let mut at: Vec<(f64, f64)> = (0..=Self::COUNT)
            .map(|k| {
                let angle = std::f64::consts::TAU * k as f64 / Self::COUNT as f64;
                (radius(outline, DVec2::from_angle(angle)), 0.0)
            })
            .collect();
        for k in 1..at.len() {
            at[k].1 = at[k - 1].1 + at[k - 1].0 * at[k].0;
        }
        let all = at[Self::COUNT].1;
        at.iter_mut().for_each(|(_, share)| *share /= all);
        let radii = at.iter().map(|(radius, _)| *radius);
        let bounds = radii.fold([f64::INFINITY, 0.0], |[least, most], r| {
            [least.min(r), most.max(r)]
        });
        Self { at, bounds }
    }

    /// The radius in the direction of a point, and the share of the area before it.
    fn at(&self, q: DVec2) -> (f64, f64) {
        let turn = (q.y.atan2(q.x) / std::f64::consts::TAU).rem_euclid(1.0);
        let (k, part) = cell(turn, Self::COUNT);
        let ((r0, s0), (r1, s1)) = (self.at[k], self.at[k + 1]);
        (r0 + part * (r1 - r0), s0 + part * (s1 - s0))
    }
}

/// How far the edge of a polygon around the origin is in a direction.
fn radius(outline: &[DVec2], direction: DVec2) -> f64 {
    let next = outline.iter().cycle().skip(1);
    let crossings = outline.iter().zip(next).filter_map(|(&a, &b)| {
        let (before, after) = (direction.perp_dot(a), direction.perp_dot(b));
        let crosses = (before <= 0.0) != (after <= 0.0);
        let along = direction.dot(a + (b - a) * (before / (before - after)));
        (crosses && along > 0.0).then_some(along)
    });
    crossings.fold(0.0, f64::max).max(f64::MIN_POSITIVE)
}

/// Energy within a radius.
struct Radial {
    /// At the radii j · [`STEP`], 1 for all the energy there is; and its slope, per step.
    within: Vec<f64>,
    slope: Vec<f64>,
    /// radius × energy beyond, far out.
    far: f64,
}

impl Radial {
    fn new(pattern: &Pattern) -> Self {
        let mean = |ring: &[f64; ANGLES]| ring.iter().sum::<f64>() / ANGLES as f64;
        let density = |j: usize| j as f64 * STEP * mean(&pattern.intensity[j]);
        let mut within = vec![0.0; RADII];
        // The trapezoidal rule and its first correction (Euler and Maclaurin): fourth order.
        let slope = |j: usize| match j {
            0 => 1.0,
            _ if j + 1 == RADII => (density(j) - density(j - 1)) / STEP,
            _ => (density(j + 1) - density(j - 1)) / (2.0 * STEP),
        };
        for j in 1..RADII {
            let correction = STEP / 6.0 * (slope(j) - slope(j - 1));
            within[j] = within[j - 1] + 0.5 * STEP * (density(j - 1) + density(j) - correction);
        }
        // ∫ K k dk beyond k is far/k.
        let far = mean(&pattern.far);
        let all = within[RADII - 1] + far / ((RADII - 1) as f64 * STEP);
        within.iter_mut().for_each(|w| *w /= all);
        Self {
            within,
            slope: (0..RADII).map(|j| density(j) * STEP / all).collect(),
            far: far / all,
        }
    }

    /// Radius × (1 − h²) at ring number h · [`RINGS`], and the density over the angle there.
    fn scaled(&self, ring: usize, pattern: &Pattern) -> (f64, [f64; ANGLES]) {
        let share = (ring as f64 / RINGS as f64).powi(2);
        let (radius, density) = self.ring(share, pattern);
        (
            radius.map_or(self.far, |radius| radius * (1.0 - share)),
            density,
        )
    }

    /// The radius with this share of the energy within, `None` for infinity, and the density over the angle there.
    fn ring(&self, share: f64, pattern: &Pattern) -> (Option<f64>, [f64; ANGLES]) {
        let j = self.within.partition_point(|&w| w <= share);
        if j == RADII {
            let radius = (share < 1.0).then(|| self.far / (1.0 - share));
            return (radius, pattern.far);
        }
        let part = self.part_of_step(j, share);
        let radius = ((j - 1) as f64 + part) * STEP;
        let (a, b) = (&pattern.intensity[j - 1], &pattern.intensity[j]);
        let density = std::array::from_fn(|k| a[k] + part * (b[k] - a[k]));
        (Some(radius), density)
    }

    /// The part of the step before radius `j` at which a share of the energy lies within: on the cubic through values
    /// and slopes at its ends, by bisection.
    fn part_of_step(&self, j: usize, share: f64) -> f64 {
        let (e0, e1) = (self.within[j - 1], self.within[j]);
        let (d0, d1) = (self.slope[j - 1], self.slope[j]);
        let energy = |t: f64| {
            let (u, rise) = (1.0 - t, t * t * (3.0 - 2.0 * t));
            e0 + (e1 - e0) * rise + t * u * (d0 * u - d1 * t)
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if energy(middle) <= share {
                low = middle;
            } else {
                high = middle;
            }
        }
        low
    }
}

/// Angles by their share of a ring's energy.
struct Angles {
    /// Up to the angle π k/ANGLES, of half a turn.
    within: [f64; ANGLES + 1],
}

impl Angles {
    /// Of a density at the angles π k/ANGLES; an even one where there is no light.
    fn new(density: &[f64; ANGLES]) -> Self {
        let mut within = [0.0; ANGLES + 1];
        for k in 0..ANGLES {
            within[k + 1] = within[k] + 0.5 * (density[k] + density[(k + 1) % ANGLES]);
        }
        let all = within[ANGLES];
        for (k, w) in within.iter_mut().enumerate() {
            *w = if all > 0.0 {
                *w / all
            } else {
                k as f64 / ANGLES as f64
            };
        }
        Self { within }
    }

    /// The angle up to which a share (0 to 1) of the whole turn's energy lies, rad.
    fn at(&self, share: f64) -> f64 {
        let half = if share < 0.5 { 0.0 } else { 1.0 };
        let part = 2.0 * share - half;
        let k = self.within.partition_point(|&w| w <= part).clamp(1, ANGLES);
        let (a, b) = (self.within[k - 1], self.within[k]);
        let inside = if b > a { (part - a) / (b - a) } else { 0.0 };
        std::f64::consts::PI * (half + ((k - 1) as f64 + inside.min(1.0)) / ANGLES as f64)
    }
}
