//! The field nodes of a plan: those that are traced, and those that mirror them.

use glam::DVec2;
use rayon::prelude::*;

use super::bank::BankPlan;
use super::error::KernelError;
use super::node::{Node, NodeRays};
use super::support::Support;
use crate::field::{FieldGrid, mirrored};
use crate::memory;
use crate::render::Camera;
use crate::render::truth::{DisparityField, SightRays};
use crate::sampling::SobolSet;
use crate::sensor::Subpixels;

/// A node of the field as the picture of a traced one.
#[derive(Clone, Copy, Debug)]
pub(super) struct MirrorImage {
    /// Number of the traced node.
    pub of: usize,
    /// Whether x and y are turned about.
    pub turned: [bool; 2],
}

/// Nodes and their rays.
pub(super) struct Traced {
    /// Only for places and weights.
    pub grid: FieldGrid,
    pub nodes: Vec<Node>,
    /// One per node of the field.
    pub images: Vec<MirrorImage>,
    is_mirrored: bool,
}

impl Traced {
    /// Of a quarter of the window, where the camera is symmetric.
    pub fn new(
        camera: &Camera,
        sight: &SightRays,
        fields: &[DisparityField],
        plan: &BankPlan,
    ) -> Result<Self, KernelError> {
        let (nx, ny) = plan.nodes;
        let rays = (nx * ny * fields.len()) as u64 * plan.rays as u64;
        let subpixels = camera.sensor().subpixels();
        memory::check("rays of kernels", rays * NodeRays::bytes(subpixels))?;
        let samples = SobolSet::new(plan.rays);
        let grid = FieldGrid::new(
            camera.sensor().window_mm(),
            plan.nodes,
            1,
            vec![0.0; nx * ny],
        );
        let grid = grid.ok_or(KernelError::Dark)?;
        let is_mirrored = camera.is_mirrored();
        let first = |k: usize| match is_mirrored {
            true => mirrored(k, plan.nodes),
            false => (k, DVec2::ONE),
        };
        let own: Vec<usize> = (0..nx * ny).filter(|&k| first(k).0 == k).collect();
        let nodes = (own.par_iter())
            .map(|&k| Node::new(camera, sight, fields, grid.place_mm(k), &samples))
            .collect::<Option<Vec<_>>>();
        let images = (0..nx * ny).map(first).map(|(first, signs)| MirrorImage {
            of: own.partition_point(|&k| k < first),
            turned: [signs.x < 0.0, signs.y < 0.0],
        });
        Ok(Self {
            grid,
            nodes: nodes.ok_or(KernelError::Dark)?,
            images: images.collect(),
            is_mirrored,
        })
    }

    /// Holds all rays at an inverse depth, and so many pixels on each side.
    pub fn support(&self, inverse_depth_per_mm: f64, more: i32) -> Support {
        let bounds = (self.nodes.iter()).map(|node| node.bounds_px(inverse_depth_per_mm));
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let mut bounds = bounds.fold(start, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        if self.is_mirrored {
            bounds = (bounds.0.min(-bounds.1), bounds.1.max(-bounds.0));
        }
        Support::around(bounds, more)
    }

    /// ∫ P cos θ dω, `[node][channel][sub-pixel]`, sr.
    pub fn white_sr(&self, subpixels: Subpixels) -> Vec<f64> {
        let mut all = Vec::new();
        for image in &self.images {
            for rays in &self.nodes[image.of].channels {
                let from = |s: usize| rays.weights_sr[subpixels.mirrored(s, image.turned)];
                all.extend((0..subpixels.count()).map(from));
            }
        }
        all
    }
}
