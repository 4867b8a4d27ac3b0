//! The kernels of one depth: those of all field nodes on one support.

use glam::DVec2;

use super::footprint::Footprint;
use super::node::Node;
use super::support::{Support, kept, marginals, totals};
use super::traced::MirrorImage;
use crate::sensor::Subpixels;

/// Pixels around the rays that diffraction reaches: beyond is the asymptote, one or two thousandths of the light.
const DIFFRACTION_REACH: i32 = 8;

/// The kernels of every field node, channel and sub-pixel at one depth, on one support: the picture of a point, px (x
/// right, y down as stored).
#[derive(Clone, Debug)]
pub struct DepthKernels {
    inverse_depth_per_mm: f64,
    support: Support,
    lanes: usize,
    /// `[node][row][column][lane]`; the kernel of a lane sums to 1, or to 0 where it is dark.
    values: Vec<f32>,
    /// `[node][lane]`: part of the light that diffraction takes beyond the support.
    beyond: Vec<f64>,
}

impl DepthKernels {
    /// Pixels around the rays that their kernels take.
    pub(super) fn margin_px(is_diffracted: bool) -> i32 {
        if is_diffracted { DIFFRACTION_REACH } else { 1 }
    }

    /// From the rays of the nodes, `lanes` values per pixel of a support: channels outermost, sub-pixels, padding.
    pub(super) fn new(
        nodes: &[Node],
        lanes: usize,
        footprint: Footprint,
        inverse_depth_per_mm: f64,
        support: Support,
    ) -> Self {
        let mut kernels = Self {
            inverse_depth_per_mm,
            support,
            lanes,
            values: Vec::new(),
            beyond: Vec::new(),
        };
        for node in nodes {
            kernels.add(node, footprint);
        }
        kernels
    }

    /// Of displacements in the picture, px: `[node][channel]`, one lane per channel.
    pub(super) fn from_displacements(
        nodes: &[Vec<Vec<DVec2>>],
        lanes: usize,
        footprint: Footprint,
    ) -> Self {
        let reach = DVec2::splat(f64::from(DIFFRACTION_REACH));
        let mut kernels = Self {
            inverse_depth_per_mm: 0.0,
            support: Support::around((-reach, reach), 1),
            lanes,
            values: Vec::new(),
            beyond: Vec::new(),
        };
        for channels in nodes {
            let mut sums = kernels.empty();
            let mut lit = vec![false; lanes];
            for (first, displacements) in channels.iter().enumerate() {
                lit[first] = true;
                let share = [1.0 / displacements.len() as f64];
                let landings = displacements.iter().map(|d| (*d, &share[..]));
                kernels.spread(landings, first, footprint, &mut sums);
            }
            kernels.store(&sums, &lit);
        }
        kernels
    }

    /// Those of all nodes of a field, on a support that is symmetric where any is turned about.
    pub(super) fn mirrored(self, images: &[MirrorImage], subpixels: Subpixels) -> Self {
        let Support { width, height, .. } = self.support;
        let (lanes, count) = (self.lanes, subpixels.count());
        if images.len() * lanes == self.beyond.len() {
            return self;
        }
        let mut values = Vec::with_capacity(images.len() * width * height * lanes);
        let mut beyond = Vec::with_capacity(images.len() * lanes);
        for image in images {
            let [x, y] = image.turned;
            // Padding stays where it is.
            let from = |lane: usize| match lane < lanes / count * count {
                true => lane - lane % count + subpixels.mirrored(lane % count, image.turned),
                false => lane,
            };
            let from: Vec<usize> = (0..lanes).map(from).collect();
            let kernel = self.of_node(image.of);
            for row in 0..height {
                let row = if y { height - 1 - row } else { row };
                for column in 0..width {
                    let column = if x { width - 1 - column } else { column };
                    let pixel = &kernel[(row * width + column) * lanes..][..lanes];
                    values.extend(from.iter().map(|&lane| pixel[lane]));
                }
            }
            let own = self.beyond(image.of);
            beyond.extend(from.iter().map(|&lane| own[lane]));
        }
        Self {
            values,
            beyond,
            ..self
        }
    }

    fn add(&mut self, node: &Node, footprint: Footprint) {
        let mut sums = self.empty();
        let to_px = node.to_px(self.inverse_depth_per_mm);
        let mut first = 0;
        let mut lit = vec![false; self.lanes];
        for rays in &node.channels {
            for (lit, sr) in lit[first..].iter_mut().zip(&rays.weights_sr) {
                *lit = *sr > 0.0;
            }
            let landings = rays.landings(to_px, self.inverse_depth_per_mm);
            self.spread(landings, first, footprint, &mut sums);
            first += rays.weights_sr.len();
        }
        self.store(&sums, &lit);
    }

    fn empty(&self) -> Vec<f64> {
        vec![0.0; self.support.width * self.support.height * self.lanes]
    }

    /// Adds light that lands at places, px, with its shares of the lanes from `first` on.
    fn spread<'a>(
        &self,
        landings: impl Iterator<Item = (DVec2, &'a [f64])>,
        first: usize,
        footprint: Footprint,
        sums: &mut [f64],
    ) {
        let Support {
            left,
            top,
            width,
            height,
        } = self.support;
        let lanes = self.lanes;
        for (at, shares) in landings {
            let nearest = at.round();
            let (column, row) = (nearest.x as i32 - left, nearest.y as i32 - top);
            // Also false where it is not finite.
            let inside =
                (1..width as i32 - 1).contains(&column) && (1..height as i32 - 1).contains(&row);
            if !inside {
                continue;
            }
            let beside = at - nearest;
            let (along, down) = (footprint.shares(beside.x), footprint.shares(beside.y));
            for (j, down) in down.into_iter().enumerate() {
                for (i, along) in along.into_iter().enumerate() {
                    let pixel = (row as usize + j - 1) * width + column as usize + i - 1;
                    let to = &mut sums[pixel * lanes + first..][..shares.len()];
                    add_scaled(to, shares, along * down);
                }
            }
        }
    }

    /// Keeps the sums of a node.
    fn store(&mut self, sums: &[f64], lit: &[bool]) {
        let lanes = self.lanes;
        let inside = totals(sums, lanes);
        let beyond = lit.iter().zip(&inside);
        (self.beyond).extend(beyond.map(|(lit, sum)| if *lit { 1.0 - sum } else { 0.0 }));
        let whole = sums
            .iter()
            .enumerate()
            .map(|(i, v)| match inside[i % lanes] {
                sum if sum > 0.0 => (v / sum) as f32,
                _ => 0.0,
            });
        self.values.extend(whole);
    }

    /// Depth that they belong to, inverse, per mm.
    pub fn inverse_depth_per_mm(&self) -> f64 {
        self.inverse_depth_per_mm
    }

    /// Their pixels.
    pub fn support(&self) -> Support {
        self.support
    }

    /// Kernels of a node: `[row][column][lane]`, each lane's sum 1, or 0 where it is dark.
    pub fn of_node(&self, node: usize) -> &[f32] {
        let len = self.support.width * self.support.height * self.lanes;
        &self.values[node * len..][..len]
    }

    /// Part of the light of each lane of a node that diffraction takes beyond the support.
    pub fn beyond(&self, node: usize) -> &[f64] {
        &self.beyond[node * self.lanes..][..self.lanes]
    }

    /// The smallest support beside which no kernel has more than `share` of its light on any side.
    pub(crate) fn core(&self, share: f64) -> Support {
        let Support { width, height, .. } = self.support;
        let (mut columns, mut rows) = (vec![0f64; width], vec![0f64; height]);
        for values in self.values.chunks_exact(width * height * self.lanes) {
            let [along, down] = marginals(values, width, self.lanes);
            let most = |to: &mut [f64], from: &[f64]| {
                for (to, lanes) in to.iter_mut().zip(from.chunks_exact(self.lanes)) {
                    *to = lanes.iter().fold(*to, |m, v| m.max(*v));
                }
            };
            most(&mut columns, &along);
            most(&mut rows, &down);
        }
        let (left, right) = kept(&columns, share);
        let (top, bottom) = kept(&rows, share);
        Support {
            left: self.support.left + left as i32,
            top: self.support.top + top as i32,
            width: right - left,
            height: bottom - top,
        }
    }

    /// On its [`Self::core`]; what is cut is made up for in the rest.
    pub(super) fn trimmed(self, share: f64) -> Self {
        let support = self.core(share);
        let Support { width, height, .. } = self.support;
        let kernel = width * height * self.lanes;
        let left = (support.left - self.support.left) as usize;
        let top = (support.top - self.support.top) as usize;
        let (right, bottom) = (left + support.width, top + support.height);
        let mut values = Vec::with_capacity(self.beyond.len() * support.width * support.height);
        for from in self.values.chunks_exact(kernel) {
            let first = values.len();
            for row in from.chunks_exact(width * self.lanes).take(bottom).skip(top) {
                values.extend_from_slice(&row[left * self.lanes..right * self.lanes]);
            }
            let kept = &mut values[first..];
            let sums = totals(kept, self.lanes);
            for (i, v) in kept.iter_mut().enumerate() {
                let sum = sums[i % self.lanes];
                *v = if sum > 0.0 {
                    (f64::from(*v) / sum) as f32
                } else {
                    0.0
                };
            }
        }
        Self {
            support,
            values,
            ..self
        }
    }
}

/// to += part · shares.
#[inline(always)]
fn add_scaled(to: &mut [f64], shares: &[f64], part: f64) {
    // Four sub-pixels are a vector.
    if let (Ok(to), Ok(shares)) = (<&mut [f64; 4]>::try_from(&mut *to), shares.try_into()) {
        let shares: &[f64; 4] = shares;
        (0..4).for_each(|k| to[k] += part * shares[k]);
        return;
    }
    to.iter_mut().zip(shares).for_each(|(t, s)| *t += part * s);
}
