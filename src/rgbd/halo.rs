//! Kernels in two parts: a core, and the halo of diffraction around it, some percent of the light on most of the area.
//!
//! The halo changes little from pixel to pixel, so it is spread from whole blocks of sources: with the mean of the
//! block's halos, so that nothing is lost but what the light in a block has to do with a source's place in it.

use super::add::Point;
use crate::render::kernels::{DepthKernels, KernelBank, Support};

/// Side of a block, px.
pub(super) const BLOCK: usize = 4;
/// Part of a kernel's light that may lie beside its core on each side.
const CORE_SHARE: f64 = 0.02;
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
    /// Of each depth of a bank.
    pub fn of_bank(bank: &KernelBank) -> Vec<Self> {
        let (nodes, lanes) = (bank.size().0 * bank.size().1, bank.lanes());
        let depths = bank.depths().iter();
        depths.map(|d| Self::new(d, nodes, lanes)).collect()
    }

    fn new(depth: &DepthKernels, nodes: usize, lanes: usize) -> Self {
        let (whole, core) = (depth.support(), depth.core(CORE_SHARE));
        let area = |s: Support| (s.width * s.height) as f64;
        let support = Support {
            width: whole.width + BLOCK - 1,
            height: whole.height + BLOCK - 1,
            ..whole
        };
        let taps = area(core) + area(support) / (BLOCK * BLOCK) as f64;
        if taps > MOST * area(whole) {
            return Self {
                core: whole,
                halo: None,
            };
        }
        let values = (0..nodes).flat_map(|k| block_mean(depth.of_node(k), lanes, whole, core));
        let halo = Halo {
            support,
            lanes,
            values: values.collect(),
        };
        Self {
            core,
            halo: Some(halo),
        }
    }
}

impl Halo {
    /// Of a node: `[row][column][lane]`.
    pub fn of_node(&self, node: usize) -> &[f32] {
        let len = self.support.width * self.support.height * self.lanes;
        &self.values[node * len..][..len]
    }
}

/// The mean of a kernel without its core over a block of sources.
fn block_mean(kernel: &[f32], lanes: usize, whole: Support, core: Support) -> Vec<f32> {
    let left = (core.left - whole.left) as usize;
    let top = (core.top - whole.top) as usize;
    let mut ring = kernel.to_vec();
    for row in ring
        .chunks_exact_mut(whole.width * lanes)
        .skip(top)
        .take(core.height)
    {
        row[left * lanes..][..core.width * lanes].fill(0.0);
    }
    let wide = (whole.width + BLOCK - 1) * lanes;
    let mut along = vec![0f32; wide * whole.height];
    for (to, from) in along
        .chunks_exact_mut(wide)
        .zip(ring.chunks_exact(whole.width * lanes))
    {
        for shift in 0..BLOCK {
            add(&mut to[shift * lanes..], from);
        }
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
