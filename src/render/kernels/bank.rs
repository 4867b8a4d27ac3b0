//! A bank of kernels over the window and a range of depths.

use glam::DVec2;
use rayon::prelude::*;

use super::depth::DepthKernels;
use super::error::KernelError;
use super::footprint::Footprint;
use super::support::Support;
use super::traced::Traced;
use crate::field::FieldGrid;
use crate::memory;
use crate::render::Camera;
use crate::render::truth::{DisparityField, SightRays};
use crate::sampling::SobolSet;
use crate::sensor::Subpixels;

/// Values that are handled together: lanes are padded to a multiple of it.
const LANE_STEP: usize = 4;

/// What a bank holds.
#[derive(Clone, Debug, PartialEq)]
pub struct BankPlan {
    /// Field nodes along the window's width and height.
    pub nodes: (usize, usize),
    /// Inverse depths from the first lens vertex, per mm; 0 is infinity.
    pub inverse_depths_per_mm: Vec<f64>,
    /// Rays per node and channel.
    pub rays: usize,
    /// What a kernel is the picture of.
    pub footprint: Footprint,
    /// Part of a kernel's light that may be cut off on each side; 0 keeps the whole support.
    pub cut_share: f64,
}

/// The kernels of a camera's window: over field nodes, inverse depths, channels and sub-pixels; the equations are in
/// [`crate::render::kernels`]. Lanes are the values of a pixel: R, G, B (or one for all) times sub-pixels in stored
/// order, then padding.
#[derive(Clone, Debug)]
pub struct KernelBank {
    subpixels: Subpixels,
    channels: usize,
    size: (usize, usize),
    /// Only for places and weights.
    fields: FieldGrid,
    depths: Vec<DepthKernels>,
    /// `[node][channel][sub-pixel]`.
    white_sr: Vec<f64>,
}

/// Figures of one kernel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneFigures {
    /// What a white wall gives the sub-pixel there, sr: the kernel's energy.
    pub white_sr: f64,
    /// Centroid from the point's own pixel, px (x right, y down as stored); not finite where it is dark.
    pub centroid_px: DVec2,
    /// Part of the light that diffraction takes beyond the support.
    pub beyond: f64,
}

impl KernelBank {
    /// Traces a camera. `fields`: its channels' ([`DisparityField::of_channels`]); `sight`: what a pixel of the picture
    /// refers to.
    ///
    /// # Errors
    /// A dark node of the window; more memory than is allowed.
    pub fn new(
        camera: &Camera,
        sight: &SightRays,
        fields: &[DisparityField],
        plan: &BankPlan,
    ) -> Result<Self, KernelError> {
        let traced = Traced::new(camera, sight, fields, plan)?;
        let subpixels = camera.sensor().subpixels();
        let lanes = lanes_of(fields.len(), subpixels);
        let more = DepthKernels::margin_px(camera.is_diffracted());
        let depths = plan.inverse_depths_per_mm.iter();
        let depths: Vec<_> = depths
            .map(|&inverse| (inverse, traced.support(inverse, more)))
            .collect();
        memory::check(
            "kernels of all depths",
            kernel_bytes(&depths, traced.images.len() * lanes),
        )?;
        let depths = depths.into_par_iter().map(|(inverse, support)| {
            let kernels = DepthKernels::new(&traced.nodes, lanes, plan.footprint, inverse, support)
                .mirrored(&traced.images, subpixels);
            match plan.cut_share > 0.0 {
                true => kernels.trimmed(plan.cut_share),
                false => kernels,
            }
        });
        Ok(Self {
            subpixels,
            channels: fields.len(),
            size: plan.nodes,
            depths: depths.collect(),
            white_sr: traced.white_sr(subpixels),
            fields: traced.grid,
        })
    }

    /// How far from its point the farthest ray of a plan lands, px: no kernel is made, so that it takes no memory.
    ///
    /// # Errors
    /// As of [`Self::new`].
    pub fn reach_px(
        camera: &Camera,
        sight: &SightRays,
        fields: &[DisparityField],
        plan: &BankPlan,
    ) -> Result<usize, KernelError> {
        let traced = Traced::new(camera, sight, fields, plan)?;
        let supports = plan.inverse_depths_per_mm.iter();
        let reach = supports.map(|&inverse| traced.support(inverse, 0).reach());
        Ok(reach.max().unwrap_or(0))
    }

    /// What diffraction at the lens's aperture does to a picture, one lane per channel, with as many displacements per
    /// node and channel and a share cut off as in a [`BankPlan`]; a picture's own samples where the camera has none.
    /// `None` for no node.
    pub fn of_aperture(
        camera: &Camera,
        (nx, ny): (usize, usize),
        count: usize,
        cut_share: f64,
    ) -> Option<Self> {
        let window = camera.sensor().window_mm();
        let grid = FieldGrid::new(window, (nx, ny), 1, vec![0.0; nx * ny])?;
        let set = SobolSet::new(count);
        let (mut s, mut t) = (vec![0.0; count], vec![0.0; count]);
        set.fill(0, 0, 0, &mut s);
        set.fill(1, 0, 0, &mut t);
        let pitch_mm = camera.sensor().pitch_mm();
        let displacements = |node: usize, channel: usize| match camera.lens_diffraction() {
            None => vec![DVec2::ZERO],
            Some(diffraction) => {
                let wavelength_mm = camera.system(channel).wavelength_nm * 1e-6;
                let samples = s.iter().copied().zip(t.iter().copied());
                let place = grid.place_mm(node);
                diffraction.displacements_px(place, [wavelength_mm, pitch_mm], samples)
            }
        };
        let node = |k: usize| (0..3).map(|c| displacements(k, c)).collect();
        let nodes: Vec<Vec<Vec<DVec2>>> = (0..nx * ny).into_par_iter().map(node).collect();
        let subpixels = Subpixels::new(1, 1).ok()?;
        let lanes = lanes_of(3, subpixels);
        let depth = DepthKernels::from_displacements(&nodes, lanes, Footprint::Sample);
        Some(Self {
            subpixels,
            channels: 3,
            size: (nx, ny),
            fields: grid,
            depths: vec![depth.trimmed(cut_share)],
            white_sr: vec![1.0; 3 * nx * ny],
        })
    }

    /// Sub-pixels of a pixel.
    pub fn subpixels(&self) -> Subpixels {
        self.subpixels
    }
    /// 3 for R, G, B; 1 where they see the same.
    pub fn channels(&self) -> usize {
        self.channels
    }
    /// Values per pixel of a kernel, padding included.
    pub fn lanes(&self) -> usize {
        lanes_of(self.channels, self.subpixels)
    }
    /// Field nodes along the window's width and height.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }
    /// Sensor position of a node by its row-major number, mm.
    pub fn node_mm(&self, node: usize) -> DVec2 {
        self.fields.place_mm(node)
    }
    /// The nodes around a sensor position, and their weights.
    pub fn around(&self, xy_mm: DVec2) -> [(usize, f64); 4] {
        self.fields.around(xy_mm)
    }
    /// Kernels of each depth, in the order of the plan.
    pub fn depths(&self) -> &[DepthKernels] {
        &self.depths
    }

    /// What holds the kernels of all depths; `None` without a depth.
    pub fn support(&self) -> Option<Support> {
        let all = self.depths.iter().map(DepthKernels::support);
        all.reduce(Support::union)
    }

    /// Figures of the kernel of a depth, node, channel and sub-pixel.
    pub fn figures(
        &self,
        depth: usize,
        node: usize,
        channel: usize,
        subpixel: usize,
    ) -> LaneFigures {
        let kernels = &self.depths[depth];
        let lane = channel * self.subpixels.count() + subpixel;
        let Support {
            left, top, width, ..
        } = kernels.support();
        let (mut sum, mut first) = (0.0, DVec2::ZERO);
        let pixels = kernels.of_node(node).chunks_exact(self.lanes());
        for (i, pixel) in pixels.enumerate() {
            let at = glam::IVec2::new(left + (i % width) as i32, top + (i / width) as i32);
            let light = f64::from(pixel[lane]);
            sum += light;
            first += light * at.as_dvec2();
        }
        LaneFigures {
            white_sr: self.white_sr[node * self.channels * self.subpixels.count() + lane],
            centroid_px: first / sum,
            beyond: kernels.beyond(node)[lane],
        }
    }
}

/// Bytes of the kernels of all depths, `lanes` values per pixel of a support, and of two more of the largest depth.
fn kernel_bytes(depths: &[(f64, Support)], lanes: usize) -> u64 {
    let pixels = depths
        .iter()
        .map(|(_, s)| (s.width as u64) * (s.height as u64));
    let (all, largest) = pixels.fold((0u64, 0u64), |(all, largest), p| (all + p, largest.max(p)));
    // What is trimmed is copied.
    (all + 2 * largest).saturating_mul((lanes * size_of::<f32>()) as u64)
}

fn lanes_of(channels: usize, subpixels: Subpixels) -> usize {
    (channels * subpixels.count()).next_multiple_of(LANE_STEP)
}
