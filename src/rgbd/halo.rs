//! Kernels in two parts: a core, and the halo of diffraction around it, one or two hundredths of the light on most of
//! the area.
//!
//! The halo changes little from pixel to pixel, so it is spread from whole blocks of sources: with the mean of the
//! block's halos, so that nothing is lost but what the light in a block has to do with a source's place in it.

use rayon::prelude::*;

use super::add::Point;
use crate::render::kernels::{DepthKernels, KernelBank, Support};

/// Side of a block, px.
pub(super) const BLOCK: usize = 4;
/// Parts of a kernel's light that may lie beside its core on each side: the first with which the halo is dim enough.
const BESIDE: [f64; 3] = [0.02, 0.01, 0.005];
/// Most light of a halo: what a kernel of 4096 rays errs by is twice what blocks of that err by.
const HALO: f64 = 0.03;
/// Taps of a core and of a halo per source, over those of the whole kernel, above which it stays whole.
const MOST: f64 = 0.8;

/// The parts of the kernels of one depth.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    pub core: Support,
    /// None: the core is the whole kernel.
    pub halo: Option<Halo>,
}

/// Means of the halos of a block's pixels, from its first pixel: `[node][row][column][lane]`.
#[derive(Clone, Debug)]
pub(super) struct Halo {
    pub support: Support,
    lanes: usize,
    values: Vec<f32>,
}

impl Parts {
    /// Of each depth of a bank of kernels that diffraction widens.
    pub fn of_bank(bank: &KernelBank) -> Vec<Self> {
        let (nodes, lanes) = (bank.size().0 * bank.size().1, bank.lanes());
        let depths = bank.depths().par_iter();
        depths.map(|d| Self::new(d, nodes, lanes)).collect()
    }

    /// Memory of the halos of a bank, at most, bytes: they are as large as its kernels, and the rings of one depth come
    /// beside them while they are made.
    pub fn bytes(bank: &KernelBank) -> u64 {
        let area = |s: Support| ((s.width + BLOCK - 1) * (s.height + BLOCK - 1)) as u64;
        let areas = bank.depths().iter().map(|d| area(d.support()));
        let (all, largest) = areas.fold((0, 0u64), |(all, largest), a| (all + a, largest.max(a)));
        let per_pixel = bank.size().0 * bank.size().1 * bank.lanes() * size_of::<f32>();
        (all + largest).saturating_mul(per_pixel as u64)
    }

    /// Whole kernels of each depth of a bank.
    pub fn whole(bank: &KernelBank) -> Vec<Self> {
        let whole = |depth: &DepthKernels| Self {
            core: depth.support(),
            halo: None,
        };
        bank.depths().iter().map(whole).collect()
    }

    fn new(depth: &DepthKernels, nodes: usize, lanes: usize) -> Self {
        let tried = BESIDE.iter().map(|&beside| depth.core(beside));
        let parts = tried.map(|core| Self::with_core(depth, nodes, lanes, core));
        parts.flatten().next().unwrap_or_else(|| Self {
            core: depth.support(),
            halo: None,
        })
    }

    /// `None` where it does not pay, or where the halo is too bright.
    fn with_core(depth: &DepthKernels, nodes: usize, lanes: usize, core: Support) -> Option<Self> {
        let whole = depth.support();
        let area = |s: Support| (s.width * s.height) as f64;
        let support = Support {
            width: whole.width + BLOCK - 1,
            height: whole.height + BLOCK - 1,
            ..whole
        };
        let taps = area(core) + area(support) / (BLOCK * BLOCK) as f64;
        if taps > MOST * area(whole) {
            return None;
        }
        let rings = (0..nodes).map(|k| ring(depth.of_node(k), lanes, whole, core));
        let rings: Vec<Vec<f32>> = rings.collect();
        let most = rings.iter().map(|ring| most_light(ring, lanes));
        if most.fold(0.0, f64::max) > HALO {
            return None;
        }
        let means = rings.iter().flat_map(|ring| block_mean(ring, lanes, whole));
        let halo = Halo {
            support,
            lanes,
            values: means.collect(),
        };
        Some(Self {
            core,
            halo: Some(halo),
        })
    }
}

impl Halo {
    /// Of a node: `[row][column][lane]`.
    pub fn of_node(&self, node: usize) -> &[f32] {
        let len = self.support.width * self.support.height * self.lanes;
        &self.values[node * len..][..len]
    }
}

/// A kernel without its core.
fn ring(kernel: &[f32], lanes: usize, whole: Support, core: Support) -> Vec<f32> {
    let left = (core.left - whole.left) as usize;
    let top = (core.top - whole.top) as usize;
    let mut ring = kernel.to_vec();
    let rows = ring.chunks_exact_mut(whole.width * lanes).skip(top);
    for row in rows.take(core.height) {
        row[left * lanes..][..core.width * lanes].fill(0.0);
    }
    ring
}

/// The light of the brightest lane.
fn most_light(ring: &[f32], lanes: usize) -> f64 {
    let light = |lane: usize| -> f64 {
        let values = ring.iter().skip(lane).step_by(lanes);
        values.map(|v| f64::from(*v)).sum()
    };
    (0..lanes).map(light).fold(0.0, f64::max)
}

/// The mean of a ring over a block of sources.
fn block_mean(ring: &[f32], lanes: usize, whole: Support) -> Vec<f32> {
    let wide = (whole.width + BLOCK - 1) * lanes;
    let mut along = vec![0f32; wide * whole.height];
    let rows = ring.chunks_exact(whole.width * lanes);
    for (to, from) in along.chunks_exact_mut(wide).zip(rows) {
        (0..BLOCK).for_each(|shift| add(&mut to[shift * lanes..], from));
    }
    let mut mean = vec![0f32; wide * (whole.height + BLOCK - 1)];
    for shift in 0..BLOCK {
        add(&mut mean[shift * wide..], &along);
    }
    let part = 1.0 / (BLOCK * BLOCK) as f32;
    mean.iter_mut().for_each(|v| *v *= part);
    mean
}

fn add(to: &mut [f32], from: &[f32]) {
    to.iter_mut().zip(from).for_each(|(t, f)| *t += f);
}

/// The points of a cell, in rows, as one point per block; `origin`: where the points' (0, 0) lies among the blocks.
pub(super) fn blocks<const L: usize>(
    points: &[Point<L>],
    origin: [usize; 2],
    out: &mut Vec<Point<L>>,
) {
    out.clear();
    let first = |at: i32, origin: usize| {
        let (at, origin, block) = (at as isize, origin as isize, BLOCK as isize);
        ((at + origin).div_euclid(block) * block - origin) as i32
    };
    let mut row = 0;
    for point in points {
        let (x, y) = (first(point.x, origin[0]), first(point.y, origin[1]));
        if out.get(row).is_none_or(|b| b.y != y) {
            row = out.len();
        }
        // A row of blocks is gone through once per row of points.
        let at = out[row..].partition_point(|b| b.x < x) + row;
        if out.get(at).is_none_or(|b| b.x != x) {
            let empty = Point {
                x,
                y,
                light: [0.0; L],
                cover: [0.0; L],
            };
            out.insert(at, empty);
        }
        let block = &mut out[at];
        for l in 0..L {
            block.light[l] += point.light[l];
            block.cover[l] += point.cover[l];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_sources_get_what_their_own_rings_give() {
        let whole = Support {
            left: -3,
            top: -2,
            width: 7,
            height: 5,
        };
        let core = Support {
            left: -1,
            top: -1,
            width: 3,
            height: 2,
        };
        let kernel: Vec<f32> = (0..35).map(|i| (i * i % 11) as f32).collect();
        let ring = ring(&kernel, 1, whole, core);
        let beside: f32 = kernel.iter().sum::<f32>() - ring.iter().sum::<f32>();
        let inside = [(2, 1), (3, 1), (4, 1), (2, 2), (3, 2), (4, 2)].map(|(x, y)| y * 7 + x);
        assert_eq!(beside, inside.map(|i| kernel[i]).iter().sum::<f32>());
        let mean = block_mean(&ring, 1, whole);
        // At a place, of all sources whose ring reaches it; of all blocks, by the mean times their sources.
        let blocks = (BLOCK * BLOCK) as f32;
        for y in 0..BLOCK {
            for x in 0..BLOCK {
                let rows = (y..whole.height + BLOCK - 1).step_by(BLOCK);
                let taps = rows.flat_map(|row| {
                    let row = &mean[row * 10..][..10];
                    row.iter().skip(x).step_by(BLOCK)
                });
                let light: f32 = taps.map(|tap| tap * blocks).sum();
                assert!((light - ring.iter().sum::<f32>()).abs() < 1e-4, "{x} {y}");
            }
        }
    }

    #[test]
    fn points_become_blocks_of_the_grid_whatever_the_tile() {
        let point = |x: i32, y: i32| Point {
            x,
            y,
            light: [x as f32 + 0.5],
            cover: [1.0],
        };
        let points: Vec<_> = (0..64).map(|i| point(i % 8 - 2, i / 8 - 3)).collect();
        let mut out = Vec::new();
        blocks(&points, [6, 7], &mut out);
        let places: Vec<_> = out.iter().map(|b| (b.x, b.y, b.cover[0])).collect();
        let all = [(-2, -3), (2, -3), (-2, 1), (2, 1)].map(|(x, y)| (x, y, 16.0));
        assert_eq!(places, all);
        assert_eq!(out[0].light[0], 4.0 * (-1.5 - 0.5 + 0.5 + 1.5));
    }
}
