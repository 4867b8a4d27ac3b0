//! The picture as surfaces: holes of the depth filled, a margin around it, torn at depth edges, and what goes on behind
//! them.
//!
//! What is not known is made up, and marked:
//!
//! - **Holes** of the depth take the farthest depth beside them, ring by ring: most are shadows of what is nearer.
//! - **The margin** beyond the picture's sides is its mirror image.
//! - **Behind an edge**, as far as any part of the pupil can look, the farther surface goes on at the depth that it has
//!   at the edge; its picture is mirrored there.

use rayon::prelude::*;

use super::levels::Levels;
use super::picture::DepthPicture;

/// Pixels beyond what parallax uncovers.
const BEYOND_PX: f64 = 2.0;

/// A picture with depth, ready to be spread: layers, slants, and what goes on behind its edges. Arrays hold the padded
/// picture, row-major.
#[derive(Clone, Debug)]
pub struct Relief {
    /// Columns with the margin.
    pub(super) width: usize,
    /// Rows with the margin.
    pub(super) height: usize,
    /// Pixels around the picture.
    pub(super) margin: usize,
    /// Depth in layers.
    pub(super) level: Vec<f32>,
    /// Change of the level per px along x and y, on its own surface.
    pub(super) slope: Vec<[f32; 2]>,
    /// Radiance.
    pub(super) light: Vec<[f32; 3]>,
    /// Whether the depth, or all of it, is made up.
    pub(super) made_up: Vec<bool>,
    /// The surface behind, where one goes on.
    pub(super) behind: Vec<Option<Behind>>,
}

/// A made-up point behind another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Behind {
    pub level: f32,
    pub light: [f32; 3],
}

/// How a hidden point was reached: the place on the edge, and its depth.
#[derive(Clone, Copy)]
struct Reached {
    edge: (i32, i32),
    level: f32,
}

impl Relief {
    /// Of a picture, with `margin` pixels around it.
    pub fn new(picture: &DepthPicture, levels: &Levels, margin: usize) -> Self {
        let (inner_width, inner_height) = (picture.light().width(), picture.light().height());
        let depths = picture.depth_mm().data();
        let known: Vec<Option<f32>> = depths
            .iter()
            .map(|d| (!d.is_nan()).then(|| levels.level(*d)))
            .collect();
        let filled = fill_holes(known, inner_width);
        let (width, height) = (inner_width + 2 * margin, inner_height + 2 * margin);
        let count = width * height;
        let mut relief = Self {
            width,
            height,
            margin,
            level: Vec::with_capacity(count),
            slope: Vec::new(),
            light: Vec::with_capacity(count),
            made_up: Vec::with_capacity(count),
            behind: Vec::new(),
        };
        for row in 0..height {
            let y = mirrored(row as i64 - margin as i64, inner_height);
            let inside_rows = (margin..margin + inner_height).contains(&row);
            for column in 0..width {
                let x = mirrored(column as i64 - margin as i64, inner_width);
                let inside = inside_rows && (margin..margin + inner_width).contains(&column);
                let at = y * inner_width + x;
                let p = picture.light().pixel(x, y);
                relief.level.push(filled[at]);
                relief.light.push([p[0], p[1], p[2]]);
                relief.made_up.push(!inside || depths[at].is_nan());
            }
        }
        relief.slope = relief.slopes(levels.tear());
        relief.behind = relief.continued(levels);
        relief
    }

    fn at(&self, x: i32, y: i32) -> Option<usize> {
        let inside = (0..self.width as i32).contains(&x) && (0..self.height as i32).contains(&y);
        inside.then(|| y as usize * self.width + x as usize)
    }

    /// Central differences on a surface, one-sided at its edges.
    fn slopes(&self, tear: f32) -> Vec<[f32; 2]> {
        let along = |i: usize, before: Option<usize>, after: Option<usize>| {
            let beside = |k: Option<usize>| {
                let d = self.level[k?] - self.level[i];
                (d.abs() <= tear).then_some(d)
            };
            match (beside(before), beside(after)) {
                (Some(a), Some(b)) => 0.5 * (b - a),
                (None, Some(b)) => b,
                (Some(a), None) => -a,
                (None, None) => 0.0,
            }
        };
        let slope = |i: usize| {
            let (x, y) = ((i % self.width) as i32, (i / self.width) as i32);
            [
                along(i, self.at(x - 1, y), self.at(x + 1, y)),
                along(i, self.at(x, y - 1), self.at(x, y + 1)),
            ]
        };
        (0..self.level.len()).into_par_iter().map(slope).collect()
    }

    /// What goes on behind the edges, ring by ring.
    fn continued(&self, levels: &Levels) -> Vec<Option<Behind>> {
        let tear = levels.tear();
        let mut reached: Vec<Option<Reached>> = vec![None; self.level.len()];
        let mut front: Vec<(usize, Reached)> = Vec::new();
        // A step across an edge, from the farther to the nearer side.
        for i in 0..self.level.len() {
            let (x, y) = ((i % self.width) as i32, (i / self.width) as i32);
            let mut farthest: Option<Reached> = None;
            for (dx, dy) in SIDES {
                let Some(k) = self.at(x + dx, y + dy) else {
                    continue;
                };
                let level = self.level[k];
                let is_behind = level - self.level[i] > tear;
                if is_behind && farthest.is_none_or(|f| level > f.level) {
                    let edge = (x + dx, y + dy);
                    farthest = Some(Reached { edge, level });
                }
            }
            front.extend(farthest.map(|f| (i, f)));
        }
        let mut ring = 1.0;
        while !front.is_empty() {
            for &(i, from) in &front {
                reached[i] = Some(from);
            }
            ring += 1.0;
            let mut next: Vec<(usize, Reached)> = Vec::new();
            for &(i, from) in &front {
                let (x, y) = ((i % self.width) as i32, (i / self.width) as i32);
                for (dx, dy) in SIDES {
                    let Some(k) = self.at(x + dx, y + dy) else {
                        continue;
                    };
                    let apart = from.level - self.level[k];
                    let seen_px = f64::from(apart) * levels.parallax_px() + BEYOND_PX;
                    if reached[k].is_none() && apart > tear && ring <= seen_px {
                        next.push((k, from));
                    }
                }
            }
            // Of several, the farthest, then the one from the first edge.
            next.sort_unstable_by(|a, b| {
                let order = a.0.cmp(&b.0).then(b.1.level.total_cmp(&a.1.level));
                order.then(a.1.edge.cmp(&b.1.edge))
            });
            next.dedup_by_key(|n| n.0);
            front = next;
        }
        let point = |(i, reached): (usize, &Option<Reached>)| {
            let from = (*reached)?;
            let (x, y) = ((i % self.width) as i32, (i / self.width) as i32);
            let mirror = (2 * from.edge.0 - x, 2 * from.edge.1 - y);
            let same = |k: &usize| (self.level[*k] - from.level).abs() <= tear;
            let source = self.at(mirror.0, mirror.1).filter(same);
            let source = source.or_else(|| self.at(from.edge.0, from.edge.1))?;
            Some(Behind {
                level: from.level,
                light: self.light[source],
            })
        };
        reached.iter().enumerate().map(point).collect()
    }
}

/// The four neighbours.
const SIDES: [(i32, i32); 4] = [(-1, 0), (1, 0), (0, -1), (0, 1)];

/// The index that `i` mirrors in 0..n; an edge pixel is its own neighbour's mirror.
fn mirrored(i: i64, n: usize) -> usize {
    let period = 2 * n as i64;
    let i = i.rem_euclid(period);
    (if i < n as i64 { i } else { period - 1 - i }) as usize
}

/// The farthest level beside a hole, ring by ring; 0 if none is known.
fn fill_holes(known: Vec<Option<f32>>, width: usize) -> Vec<f32> {
    let height = known.len() / width;
    let beside = |i: usize| {
        let (x, y) = (i % width, i / width);
        let sides = [
            (x > 0).then(|| i - 1),
            (x + 1 < width).then_some(i + 1),
            (y > 0).then(|| i - width),
            (y + 1 < height).then_some(i + width),
        ];
        sides.into_iter().flatten()
    };
    let mut level = known;
    let next_to_known = |level: &[Option<f32>], i: usize| beside(i).any(|k| level[k].is_some());
    let holes = (0..level.len()).filter(|&i| level[i].is_none());
    let mut front: Vec<usize> = holes.filter(|&i| next_to_known(&level, i)).collect();
    while !front.is_empty() {
        let farthest = |i: &usize| {
            let levels = beside(*i).filter_map(|k| level[k]);
            (*i, levels.fold(f32::NEG_INFINITY, f32::max))
        };
        let found: Vec<(usize, f32)> = front.iter().map(farthest).collect();
        found.iter().for_each(|&(i, l)| level[i] = Some(l));
        let mut next: Vec<usize> = front.iter().flat_map(|&i| beside(i)).collect();
        next.retain(|&i| level[i].is_none());
        next.sort_unstable();
        next.dedup();
        front = next;
    }
    level.into_iter().map(|l| l.unwrap_or(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_has_no_gap_at_its_edges() {
        let indices: Vec<usize> = (-4..7).map(|i| mirrored(i, 3)).collect();
        assert_eq!(indices, [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
    }

    #[test]
    fn a_hole_takes_the_farthest_depth_beside_it() {
        let known = vec![Some(1.0), None, Some(5.0), None, None, None];
        assert_eq!(fill_holes(known, 3), [1.0, 5.0, 5.0, 1.0, 5.0, 5.0]);
    }
}
