//! The picture as surfaces: holes of the depth filled, a margin around it, torn at depth edges, and what goes on behind
//! them.
//!
//! What is not known is made up, and marked:
//!
//! - **Holes** of the depth take the farthest depth beside them, ring by ring: most are shadows of what is nearer.
//! - **The margin** beyond the picture's sides is its mirror image.
//! - **Behind an edge**, as far as any part of the pupil can look, the farther surface goes on at the depth that it has
//!   at the edge; its picture is mirrored there.

use super::levels::Levels;
use super::picture::DepthPicture;

/// Pixels beyond what parallax uncovers.
const BEYOND_PX: f64 = 2.0;

/// A picture with depth, ready to be spread: layers, slants, and what goes on behind its edges. Places are those of the
/// padded picture, row-major; what can be had of the picture again is not kept.
#[derive(Clone, Debug)]
pub struct Relief {
    picture: DepthPicture,
    /// Columns with the margin.
    pub(super) width: usize,
    /// Rows with the margin.
    pub(super) height: usize,
    /// Pixels around the picture.
    pub(super) margin: usize,
    /// Difference of neighbours, in layers, above which they are two surfaces.
    tear: f32,
    /// Depth in layers.
    level: Vec<f32>,
    /// Place in `behind` of the surface that goes on behind, or [`NONE`].
    behind_at: Vec<u32>,
    behind: Vec<Behind>,
}

/// No surface goes on there.
const NONE: u32 = u32::MAX;

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
        let known = (picture.depth_mm().data().iter())
            .map(|d| (!d.is_nan()).then(|| levels.level(*d)))
            .collect();
        let filled = fill_holes(known, inner_width);
        let (width, height) = (inner_width + 2 * margin, inner_height + 2 * margin);
        let mut relief = Self {
            picture: picture.clone(),
            width,
            height,
            margin,
            tear: levels.tear(),
            level: Vec::with_capacity(width * height),
            behind_at: vec![NONE; width * height],
            behind: Vec::new(),
        };
        for row in 0..height {
            let y = mirrored(row as i64 - margin as i64, inner_height);
            let place = |column: usize| mirrored(column as i64 - margin as i64, inner_width);
            let own = (0..width).map(|column| filled[y * inner_width + place(column)]);
            relief.level.extend(own);
        }
        relief.go_on(levels);
        relief
    }

    /// All places, column and row, row by row.
    pub(super) fn places(&self) -> impl Iterator<Item = [usize; 2]> + Clone {
        let columns = self.width;
        (0..self.height).flat_map(move |row| (0..columns).map(move |column| [column, row]))
    }

    #[inline]
    fn index(&self, [column, row]: [usize; 2]) -> usize {
        row * self.width + column
    }

    /// Depth in layers.
    #[inline]
    pub(super) fn level(&self, place: [usize; 2]) -> f32 {
        self.level[self.index(place)]
    }

    /// Radiance.
    #[inline]
    pub(super) fn light(&self, place: [usize; 2]) -> [f32; 3] {
        let light = self.picture.light();
        let inner = |k: usize, n: usize| match place[k].checked_sub(self.margin) {
            Some(i) if i < n => i,
            _ => mirrored(place[k] as i64 - self.margin as i64, n),
        };
        let light = light.pixel(inner(0, light.width()), inner(1, light.height()));
        [light[0], light[1], light[2]]
    }

    /// Whether the depth, or all of it, is made up.
    #[inline]
    pub(super) fn is_made_up(&self, place: [usize; 2]) -> bool {
        let depth = self.picture.depth_mm();
        // Outside the picture these wrap round to numbers far above its size.
        let [x, y] = place.map(|i| i.wrapping_sub(self.margin));
        x >= depth.width() || y >= depth.height() || depth.pixel(x, y)[0].is_nan()
    }

    /// The surface behind, where one goes on.
    #[inline]
    pub(super) fn behind(&self, place: [usize; 2]) -> Option<Behind> {
        let number = self.behind_at[self.index(place)];
        self.behind.get(number as usize).copied()
    }

    /// Change of the level per px along x and y, on its own surface: central differences, one-sided at its edges.
    #[inline]
    pub(super) fn slope(&self, place: [usize; 2]) -> [f32; 2] {
        let at = self.index(place);
        let own = self.level[at];
        let along = |k: usize, size: usize, step: usize| {
            let beside = |is_there: bool, other: usize| {
                let d = is_there.then(|| self.level[other] - own)?;
                (d.abs() <= self.tear).then_some(d)
            };
            let before = beside(place[k] > 0, at.wrapping_sub(step));
            match (before, beside(place[k] + 1 < size, at + step)) {
                (Some(a), Some(b)) => 0.5 * (b - a),
                (None, Some(b)) => b,
                (Some(a), None) => -a,
                (None, None) => 0.0,
            }
        };
        [along(0, self.width, 1), along(1, self.height, self.width)]
    }

    fn at(&self, x: i32, y: i32) -> Option<usize> {
        let inside = (0..self.width as i32).contains(&x) && (0..self.height as i32).contains(&y);
        inside.then(|| y as usize * self.width + x as usize)
    }

    /// Goes on behind the edges, ring by ring.
    fn go_on(&mut self, levels: &Levels) {
        let mut reached: Vec<Reached> = Vec::new();
        let mut reached_at = std::mem::take(&mut self.behind_at);
        let mut front = self.edges();
        let mut ring = 1.0;
        while !front.is_empty() {
            for &(i, from) in &front {
                reached_at[i] = reached.len() as u32;
                reached.push(from);
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
                    if reached_at[k] == NONE && apart > self.tear && ring <= seen_px {
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
        for (at, number) in reached_at.iter_mut().enumerate() {
            let Some(from) = reached.get(*number as usize) else {
                continue;
            };
            let (x, y) = ((at % self.width) as i32, (at / self.width) as i32);
            let mirror = (2 * from.edge.0 - x, 2 * from.edge.1 - y);
            let same = |k: &usize| (self.level[*k] - from.level).abs() <= self.tear;
            let source = self.at(mirror.0, mirror.1).filter(same);
            let source = source.or_else(|| self.at(from.edge.0, from.edge.1));
            *number = source.map_or(NONE, |source| {
                self.behind.push(Behind {
                    level: from.level,
                    light: self.light([source % self.width, source / self.width]),
                });
                self.behind.len() as u32 - 1
            });
        }
        self.behind_at = reached_at;
    }

    /// Steps across an edge, from the farther to the nearer side, which they are named by.
    fn edges(&self) -> Vec<(usize, Reached)> {
        let mut steps = Vec::new();
        for (i, own) in self.level.iter().enumerate() {
            let (x, y) = ((i % self.width) as i32, (i / self.width) as i32);
            let mut farthest: Option<Reached> = None;
            for (dx, dy) in SIDES {
                let Some(k) = self.at(x + dx, y + dy) else {
                    continue;
                };
                let level = self.level[k];
                let is_behind = level - own > self.tear;
                if is_behind && farthest.is_none_or(|f| level > f.level) {
                    let edge = (x + dx, y + dy);
                    farthest = Some(Reached { edge, level });
                }
            }
            steps.extend(farthest.map(|f| (i, f)));
        }
        steps
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
