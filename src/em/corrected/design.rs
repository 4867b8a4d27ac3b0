//! Where exact runs say most: each as far as can be from those before and their images.
//!
//! Distances are those of the fit: (u', v') in the moving frame, which follows the lobe, and the lens shift over the
//! height H that it acts through, by half: in the moving frame the response changes slowly with the shift. The lens
//! array repeats itself, so a shift by a whole pitch is no distance.

use crate::em::PixelStack;
use crate::em::light::{Incidence, SolverError};
use crate::em::shift_grid::ShiftGrid;
use crate::em::symmetry::{Symmetry, canonical_nodes, symmetries};
use crate::sensor::{MovingFrame, Subpixels};

/// Directions that runs are chosen from, from the normal to the reach along each axis: of one lens shift, and of all.
const LATTICE: i64 = 12;
const COARSE_LATTICE: i64 = 6;
/// Shifts a pitch that runs are chosen from.
const SHIFTS: usize = 8;
/// What a shift over H counts beside direction cosines.
const SHIFT_PART: f64 = 0.5;
/// Directions beyond are not simulated.
const LARGEST_SINE: f64 = 0.94;

/// Place of a plane wave as the fit sees it.
pub(super) type Point = [f64; 4];

/// How plane waves on a pixel lie to each other.
#[derive(Clone, Debug)]
pub(super) struct Space {
    pub subpixels: Subpixels,
    frame: MovingFrame,
    pitch_um: f64,
    pub group: Vec<Symmetry>,
}

impl Space {
    /// That of a pixel; the frame at the wavelength of the tables, 550 nm.
    ///
    /// # Errors
    /// A material that does not know the wavelength.
    pub fn new(stack: &PixelStack) -> Result<Self, SolverError> {
        Ok(Self {
            subpixels: stack.subpixels,
            frame: stack.moving_frame(550.0)?,
            pitch_um: stack.pitch_um,
            group: symmetries(stack),
        })
    }

    pub fn point(&self, incidence: Incidence) -> Point {
        let [u, v] = incidence.direction;
        let s = incidence.shift_um;
        let (u, v) = self.frame.centred_uv(u as f32, v as f32, s);
        let [x, y] = s.map(|s| SHIFT_PART * s / self.frame.height_um);
        [f64::from(u), f64::from(v), x, y]
    }

    /// The points of a plane wave under the lens and its neighbours in the array.
    pub fn periods(&self, incidence: Incidence) -> [Point; 9] {
        std::array::from_fn(|k| {
            let turns = [(k / 3) as f64 - 1.0, (k % 3) as f64 - 1.0];
            let mut next = incidence;
            for (s, turn) in next.shift_um.iter_mut().zip(turns) {
                *s += turn * self.pitch_um;
            }
            self.point(next)
        })
    }

    /// What a symmetry makes of a plane wave and of its sub-pixels' values.
    pub fn image(
        &self,
        symmetry: Symmetry,
        incidence: Incidence,
        values: &[f64],
    ) -> (Incidence, Vec<f64>) {
        let mut sent = vec![0.0; values.len()];
        for (i, v) in values.iter().enumerate() {
            sent[symmetry.sub_pixel(self.subpixels, i)] = *v;
        }
        let image = Incidence {
            direction: symmetry.direction(incidence.direction),
            shift_um: symmetry.direction(incidence.shift_um),
        };
        (image, sent)
    }
}

pub(super) fn distance(a: &Point, b: &Point) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

/// Candidates under the lens shift of the pixel.
pub(super) fn centred(stack: &PixelStack, reach: f64) -> Vec<Incidence> {
    let step = reach / LATTICE as f64;
    let nodes = canonical_nodes(LATTICE, &symmetries(stack)).into_iter();
    let all = nodes.map(|(a, b)| Incidence {
        direction: [a as f64 * step, b as f64 * step],
        shift_um: stack.lens.shift_um,
    });
    all.filter(|i| i.direction[0].hypot(i.direction[1]) <= reach + 1e-9)
        .collect()
}

/// Candidates under all lens shifts: about each shift's own chief ray.
pub(super) fn shifted(
    stack: &PixelStack,
    space: &Space,
    reach: f64,
) -> Result<Vec<Incidence>, SolverError> {
    let grid = ShiftGrid::new(stack.pitch_um, SHIFTS)?;
    let step = reach / COARSE_LATTICE as f64;
    let mut all = Vec::new();
    for node in grid.stored(&space.group) {
        let shift_um = grid.shift_um(node);
        for k in 0..(2 * COARSE_LATTICE + 1).pow(2) {
            let side = 2 * COARSE_LATTICE + 1;
            let at = [k / side, k % side].map(|i| (i - COARSE_LATTICE) as f64 * step);
            if at[0].hypot(at[1]) > reach + 1e-9 {
                continue;
            }
            // Back from the moving frame to the direction.
            let away = shift_um.map(|s| -s);
            let (u, v) = space.frame.centred_uv(at[0] as f32, at[1] as f32, away);
            let direction = [f64::from(u), f64::from(v)];
            if direction[0].hypot(direction[1]) <= LARGEST_SINE {
                all.push(Incidence {
                    direction,
                    shift_um,
                });
            }
        }
    }
    Ok(all)
}

/// Indices of `count` of the plane waves (fewer, if there are fewer): the first nearest to the normal under the lens
/// shifted least, each next one the farthest from all before it and their images under the pixel's symmetries. Fewer
/// are the beginning of more.
///
/// # Errors
/// A material that does not know 550 nm.
pub fn spread(
    all: &[Incidence],
    stack: &PixelStack,
    count: usize,
) -> Result<Vec<usize>, SolverError> {
    let space = Space::new(stack)?;
    let points: Vec<Point> = all.iter().map(|i| space.point(*i)).collect();
    let radius = |i: &usize| distance(&points[*i], &[0.0; 4]);
    let nearest = (0..all.len()).min_by(|a, b| radius(a).total_cmp(&radius(b)));
    let Some(mut next) = nearest else {
        return Ok(Vec::new());
    };
    let mut gap = vec![f64::INFINITY; all.len()];
    let mut chosen = Vec::new();
    while chosen.len() < count.min(all.len()) {
        chosen.push(next);
        for symmetry in &space.group {
            let (image, _) = space.image(*symmetry, all[next], &[]);
            for place in space.periods(image) {
                for (gap, point) in gap.iter_mut().zip(&points) {
                    *gap = gap.min(distance(point, &place));
                }
            }
        }
        gap[next] = -1.0;
        // The first of equals.
        for (i, g) in gap.iter().enumerate() {
            if *g > gap[next] + 1e-12 {
                next = i;
            }
        }
    }
    Ok(chosen)
}
