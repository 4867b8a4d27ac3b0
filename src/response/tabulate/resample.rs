//! From the simulated grid of directions to the table's.
//!
//! The simulated grid is fine enough for a cubic (Catmull-Rom) to follow the response; the table samples that cubic
//! more finely, so that the renderer's bilinear lookup follows it too.

use std::collections::BTreeMap;

use crate::em::symmetry::Node;

/// A square grid of nodes `[v][u][sub-pixel]`, `2 steps + 1` a side.
pub(in crate::response) struct Grid {
    pub steps: i64,
    pub count: usize,
    pub values: Vec<f64>,
}

impl Grid {
    /// The whole square from the nodes known. A node beyond `rim` (nodes from the middle) repeats what lies on its
    /// meridian at the rim, or as far out as the four nodes around are known.
    pub fn filled(known: &BTreeMap<Node, Vec<f64>>, steps: i64, rim: f64, count: usize) -> Self {
        let mut values = Vec::new();
        for b in -steps..=steps {
            for a in -steps..=steps {
                match known.get(&(a, b)) {
                    Some(p) => values.extend_from_slice(p),
                    None => values.extend(on_the_rim(known, (a, b), rim, count)),
                }
            }
        }
        Self {
            steps,
            count,
            values,
        }
    }

    /// The cubic at `places` along both axes, `[v][u][sub-pixel]`.
    pub fn at(&self, places: &[Place]) -> Vec<f64> {
        let n = (2 * self.steps + 1) as usize;
        let along_u = rows_at(&self.values, n, places, self.count);
        let turned = transpose(&along_u, n, places.len(), self.count);
        let both = rows_at(&turned, n, places, self.count);
        transpose(&both, places.len(), places.len(), self.count)
    }
}

/// A place on an axis of the grid: a node counted from the axis's start, and the part of the way to the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::response) struct Place {
    pub node: i64,
    pub part: f64,
}

impl Place {
    /// The places `i / refine × scale`, i = −half to half, in nodes from the middle of an axis with `steps` nodes each
    /// side.
    pub fn axis(half: i64, refine: i64, scale: f64, steps: i64) -> Vec<Self> {
        let place = |i: i64| {
            // Whole numbers where they can be: the same bits however far out.
            let (node, part) = if scale == 1.0 {
                let part = i.rem_euclid(refine) as f64 / refine as f64;
                (i.div_euclid(refine), part)
            } else {
                let x = i as f64 / refine as f64 * scale;
                (x.floor() as i64, x - x.floor())
            };
            Self {
                node: node + steps,
                part,
            }
        };
        (-half..=half).map(place).collect()
    }
}

fn on_the_rim(known: &BTreeMap<Node, Vec<f64>>, (a, b): Node, rim: f64, count: usize) -> Vec<f64> {
    /// How far each try goes inwards, in nodes.
    const INWARDS: f64 = 0.25;
    let reach = (a as f64).hypot(b as f64);
    let mut radius = rim.min(reach);
    while radius > 0.0 {
        let (x, y) = (a as f64 * radius / reach, b as f64 * radius / reach);
        let (i, j) = (x.floor() as i64, y.floor() as i64);
        let (t, s) = (x - i as f64, y - j as f64);
        let corner = |di: i64, dj: i64| known.get(&(i + di, j + dj));
        let corners = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
        if let (Some(p00), Some(p10), Some(p01), Some(p11)) = corners {
            let mix = |k: usize| {
                (1.0 - s) * ((1.0 - t) * p00[k] + t * p10[k])
                    + s * ((1.0 - t) * p01[k] + t * p11[k])
            };
            return (0..count).map(mix).collect();
        }
        radius -= INWARDS;
    }
    known.get(&(0, 0)).cloned().unwrap_or(vec![0.0; count])
}

fn rows_at(grid: &[f64], n: usize, places: &[Place], count: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(grid.len() / n * places.len());
    for row in grid.chunks_exact(n * count) {
        // Beyond the ends the row goes on straight.
        let at = |i: i64, k: usize| -> f64 {
            let node = |i: usize| row[i * count + k];
            if i < 0 {
                2.0 * node(0) - node(1)
            } else if i as usize >= n {
                2.0 * node(n - 1) - node(n - 2)
            } else {
                node(i as usize)
            }
        };
        for &Place { node: i, part: t } in places {
            for k in 0..count {
                let (a, b) = (at(i - 1, k), at(i, k));
                let (c, d) = (at(i + 1, k), at(i + 2, k));
                let cubic = t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a));
                out.push(b + 0.5 * t * (c - a + cubic));
            }
        }
    }
    out
}

fn transpose(grid: &[f64], rows: usize, columns: usize, count: usize) -> Vec<f64> {
    let mut out = Vec::with_capacity(grid.len());
    for c in 0..columns {
        for r in 0..rows {
            let at = (r * columns + c) * count;
            out.extend_from_slice(&grid[at..at + count]);
        }
    }
    out
}

/// Cuts negative values to 0 and scales sums above 1 to 1, node by node; the largest change is returned with the
/// values.
pub(in crate::response) fn shares(mut p: Vec<f64>, count: usize) -> (Vec<f32>, f64) {
    let mut most = 0.0f64;
    for node in p.chunks_exact_mut(count) {
        for p in node.iter_mut() {
            most = most.max(-*p);
            *p = p.max(0.0);
        }
        let sum: f64 = node.iter().sum();
        if sum > 1.0 {
            most = most.max(sum - 1.0);
            node.iter_mut().for_each(|p| *p /= sum);
        }
    }
    (p.iter().map(|&p| p as f32).collect(), most)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(steps: i64, radius: f64, f: impl Fn(f64, f64) -> f64) -> BTreeMap<Node, Vec<f64>> {
        let nodes = (-steps..=steps).flat_map(|a| (-steps..=steps).map(move |b| (a, b)));
        nodes
            .filter(|&(a, b)| (a as f64).hypot(b as f64) <= radius)
            .map(|(a, b)| ((a, b), vec![f(a as f64, b as f64)]))
            .collect()
    }

    #[test]
    fn a_parabola_comes_back_exactly_between_nodes_of_any_scale() {
        // Catmull-Rom is exact for quadratics; the ends of a row are not (they go on straight), so stay one node
        // inside.
        let f = |x: f64, y: f64| 0.3 + 0.02 * x - 0.01 * x * x + 0.005 * y * y - 0.004 * x * y;
        let grid = Grid::filled(&known(6, 99.0, f), 6, 99.0, 1);
        for scale in [1.0, 0.8123] {
            let places = Place::axis(10, 2, scale, 6);
            let fine = grid.at(&places);
            for (j, row) in fine.chunks_exact(21).enumerate() {
                for (i, value) in row.iter().enumerate() {
                    let x = |i: usize| (i as f64 - 10.0) / 2.0 * scale;
                    assert!((value - f(x(i), x(j))).abs() < 1e-12);
                }
            }
        }
    }

    #[test]
    fn nodes_beyond_the_rim_repeat_their_meridian() {
        // A function of the direction alone is the same however far out it is read.
        let f = |x: f64, y: f64| y.atan2(x);
        let grid = Grid::filled(&known(12, 9.0, f), 12, 9.0, 1);
        let at = |a: i64, b: i64| grid.values[((b + 12) * 25 + a + 12) as usize];
        for (a, b) in [(12, 0), (10, 7), (5, 12), (12, 12), (8, -9)] {
            assert!((at(a, b) - f(a as f64, b as f64)).abs() < 0.02);
        }
    }

    #[test]
    fn what_is_no_share_of_the_light_is_cut_and_told() {
        let (p, most) = shares(vec![-0.02, 0.4, 0.9, 0.6], 2);
        assert_eq!((p, (most * 1e3).round()), (vec![0.0, 0.4, 0.6, 0.4], 500.0));
    }
}
