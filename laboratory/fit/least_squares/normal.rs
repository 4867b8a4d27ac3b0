//! The normal equations at a point, by differences of residuals, with the places of the blocks eliminated.

use faer::Mat;
use rayon::prelude::*;

use super::super::error::FitError;
use super::super::parameters::Parameter;
use super::Forward;

/// Step of the derivatives by places, px.
const PLACE_STEP: f64 = 0.02;
/// Step of the derivatives by parameters, in units of their prior's deviation.
const STEP: f64 = 5e-2;

/// Of a block with a place: (J_oᵀJ_o)⁻¹, J_pᵀJ_o, J_oᵀr.
pub(super) type Eliminated = ([[f64; 2]; 2], Vec<[f64; 2]>, [f64; 2]);

/// The normal equations at a point.
pub(super) struct Normal {
    pub(super) matrix: Mat<f64>,
    pub(super) right: Mat<f64>,
    pub(super) places: Vec<Eliminated>,
}

/// Differences of two sets of residuals per step.
fn slopes(moved: &[Vec<f64>], base: &[Vec<f64>], step: f64) -> Vec<Vec<f64>> {
    let pairs = moved.iter().zip(base);
    pairs
        .map(|(m, b)| m.iter().zip(b).map(|(m, b)| (m - b) / step).collect())
        .collect()
}

pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) type Point<'a> = (&'a [f64], &'a [[f64; 2]], &'a [Vec<f64>]);

/// Derivatives of the residuals by the free parameters; those by costly ones may be of an earlier point.
pub(super) struct Columns<'a> {
    forward: &'a dyn Forward,
    parameters: &'a [Parameter],
    free: &'a [usize],
    by_parameter: Vec<Vec<Vec<f64>>>,
    /// Points since those by costly ones were taken.
    pub(super) age: usize,
}

impl<'a> Columns<'a> {
    pub(super) fn new(
        forward: &'a dyn Forward,
        parameters: &'a [Parameter],
        free: &'a [usize],
    ) -> Self {
        Self {
            forward,
            parameters,
            free,
            by_parameter: vec![Vec::new(); free.len()],
            age: 0,
        }
    }

    /// The normal equations at a point; `anew` with the derivatives by costly parameters there.
    pub(super) fn normal_at(
        &mut self,
        (values, places, base): Point,
        anew: bool,
    ) -> Result<Normal, FitError> {
        let (forward, parameters, free) = (self.forward, self.parameters, self.free);
        let mut is_old = false;
        for (column, &i) in self.by_parameter.iter_mut().zip(free) {
            if !anew && forward.is_costly(i) {
                is_old = true;
                continue;
            }
            let p = &parameters[i];
            // Into the bounds, where a bound is near.
            let size = STEP * p.sigma;
            let step = if values[i] + size > p.bounds[1] {
                -size
            } else {
                size
            };
            let mut moved = values.to_vec();
            moved[i] += step;
            *column = slopes(&forward.residuals(&moved, places)?, base, step);
        }
        self.age = if is_old { self.age + 1 } else { 0 };
        let mut by_place = Vec::with_capacity(2);
        for axis in 0..2 {
            let mut moved = places.to_vec();
            moved.iter_mut().for_each(|p| p[axis] += PLACE_STEP);
            by_place.push(slopes(
                &forward.residuals(values, &moved)?,
                base,
                PLACE_STEP,
            ));
        }
        let n = free.len();
        let mut matrix = Mat::<f64>::zeros(n, n);
        let mut right = Mat::<f64>::zeros(n, 1);
        for (a, &i) in free.iter().enumerate() {
            let p = &parameters[i];
            matrix[(a, a)] += p.sigma.powi(-2);
            right[(a, 0)] -= (values[i] - p.prior) * p.sigma.powi(-2);
        }
        let one = |b: usize| block_of(b, &self.by_parameter, &by_place, base, b < places.len());
        let blocks: Vec<Block> = (0..base.len()).into_par_iter().map(one).collect();
        let mut eliminated = Vec::with_capacity(places.len());
        for block in blocks {
            for a in 0..n {
                right[(a, 0)] -= block.right[a];
                for c in 0..n {
                    matrix[(a, c)] += block.matrix[a * n + c];
                }
            }
            eliminated.extend(block.place);
        }
        Ok(Normal {
            matrix,
            right,
            places: eliminated,
        })
    }
}

/// What one block adds.
struct Block {
    matrix: Vec<f64>,
    right: Vec<f64>,
    place: Option<Eliminated>,
}

fn block_of(
    b: usize,
    by_parameter: &[Vec<Vec<f64>>],
    by_place: &[Vec<Vec<f64>>],
    base: &[Vec<f64>],
    has_place: bool,
) -> Block {
    let n = by_parameter.len();
    let mut matrix = vec![0.0; n * n];
    for a in 0..n {
        for c in 0..=a {
            let product = dot(&by_parameter[a][b], &by_parameter[c][b]);
            (matrix[a * n + c], matrix[c * n + a]) = (product, product);
        }
    }
    let mut right: Vec<f64> = by_parameter.iter().map(|j| dot(&j[b], &base[b])).collect();
    if !has_place {
        return Block {
            matrix,
            right,
            place: None,
        };
    }
    let [x, y] = [&by_place[0][b], &by_place[1][b]];
    let [xx, xy, yy] = [dot(x, x), dot(x, y), dot(y, y)];
    let determinant = (xx * yy - xy * xy).max(f64::MIN_POSITIVE);
    let inverse = [
        [yy / determinant, -xy / determinant],
        [-xy / determinant, xx / determinant],
    ];
    let cross: Vec<[f64; 2]> = (by_parameter.iter())
        .map(|j| [dot(&j[b], x), dot(&j[b], y)])
        .collect();
    let own = [dot(x, &base[b]), dot(y, &base[b])];
    for a in 0..n {
        let half = [0, 1].map(|k| cross[a][0] * inverse[0][k] + cross[a][1] * inverse[1][k]);
        right[a] -= half[0] * own[0] + half[1] * own[1];
        for c in 0..n {
            matrix[a * n + c] -= half[0] * cross[c][0] + half[1] * cross[c][1];
        }
    }
    Block {
        matrix,
        right,
        place: Some((inverse, cross, own)),
    }
}
