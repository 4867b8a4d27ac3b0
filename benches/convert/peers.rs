//! How others make dual-pixel pictures from depth, with our kernels where theirs are parametric, so that what is
//! compared is the method.
//!
//! - **Gather**: each pixel averages its neighbours with the kernel of its own depth (per-pixel PSFs as in P. Wadhwa et
//!   al., SIGGRAPH 2018, and S. Xin et al., ICCV 2021, without their guards at edges).
//! - **Layers, added**: the picture is cut by depth, each layer convolved by its kernel, and the results added; no
//!   layer covers another.
//! - **Layers of quarter disks**: kernels are parts of the thin lens's disk (A. Punnappurath et al., ICCP 2020; A.
//!   Abuolaim et al., ICCV 2021), layers lie over each other by their blurred masks, and nothing is behind them.

use glam::DVec2;
use quadpixel::image::Image;
use quadpixel::render::kernels::{BankPlan, Footprint, KernelBank, Support};
use quadpixel::render::truth::{Defocus, DisparityField, SightRays, WhiteField};
use quadpixel::render::{Camera, SubPixelImage};
use quadpixel::rgbd::{DepthPicture, Levels};
use rayon::prelude::*;

/// Pixels with one kernel per layer.
const CELL: usize = 16;
/// Light of 3 colours in 4 sub-pixels, and the coverage in each.
const VALUES: usize = 16;

pub struct Peers<'a> {
    camera: &'a Camera,
    bank: KernelBank,
    picture: &'a DepthPicture,
    /// Nearest layer of each pixel.
    layers: Vec<usize>,
    white: Vec<Image>,
    coc_px: Vec<f64>,
}

/// Four kernels on one support.
struct Kernel {
    support: Support,
    values: Vec<[f32; 4]>,
}

impl<'a> Peers<'a> {
    pub fn new(
        camera: &'a Camera,
        sight: &SightRays,
        fields: &[DisparityField],
        picture: &'a DepthPicture,
    ) -> Self {
        let levels = Levels::new(camera, picture.inverse_range_per_mm()).unwrap();
        let inverse_depths_per_mm = levels.inverse_depths_per_mm();
        let plan = BankPlan {
            nodes: (3, 3),
            inverse_depths_per_mm: inverse_depths_per_mm.clone(),
            rays: 4096,
            footprint: Footprint::Sample,
            cut_share: 2.5e-4,
        };
        let bank = KernelBank::new(camera, sight, fields, &plan).unwrap();
        assert_eq!(bank.channels(), 1, "one kernel for all colours");
        let defocus = Defocus::new(camera).unwrap();
        let pitch = camera.sensor().pitch_mm();
        let coc = |t: &f64| defocus.circle_of_confusion_mm(1.0 / t) / pitch;
        Self {
            coc_px: inverse_depths_per_mm.iter().map(coc).collect(),
            layers: (picture.depth_mm().data().iter())
                .map(|d| levels.level(*d).round() as usize)
                .collect(),
            white: WhiteField::from_fields(camera, fields).of_subpixels_sr(camera.sensor()),
            camera,
            bank,
            picture,
        }
    }

    fn size(&self) -> (usize, usize) {
        (self.picture.light().width(), self.picture.light().height())
    }

    /// The kernel of a layer in the middle of a cell.
    fn kernel(&self, layer: usize, cell: (usize, usize)) -> Kernel {
        let middle = |c: usize| (c * CELL + CELL / 2) as f64 - 0.5;
        let place = (self.camera.sensor()).position_mm(middle(cell.0), middle(cell.1));
        let depth = &self.bank.depths()[layer];
        let support = depth.support();
        let mut values = vec![[0f32; 4]; support.width * support.height];
        for (node, weight) in self.bank.around(place) {
            let from = depth.of_node(node).chunks_exact(self.bank.lanes());
            for (to, from) in values.iter_mut().zip(from) {
                (to.iter_mut().zip(from)).for_each(|(t, f)| *t += weight as f32 * f);
            }
        }
        Kernel { support, values }
    }

    /// A quarter of the thin lens's disk for each sub-pixel, on the side where its light is.
    fn disks(&self, layer: usize) -> Kernel {
        const FINE: i32 = 8;
        let radius = (0.5 * self.coc_px[layer].abs()).max(0.5);
        let reach = radius.ceil() as i32 + 1;
        let side = (2 * reach + 1) as usize;
        let mut values = vec![[0f32; 4]; side * side];
        let middle = self.bank.size().0 * self.bank.size().1 / 2;
        for s in 0..4 {
            let towards = self.bank.figures(layer, middle, 0, s).centroid_px;
            let mut sum = 0.0;
            for fine_y in 0..side as i32 * FINE {
                for fine_x in 0..side as i32 * FINE {
                    let at = |k: i32| (f64::from(k) + 0.5) / f64::from(FINE) - 0.5;
                    let at = DVec2::new(at(fine_x), at(fine_y)) - f64::from(reach);
                    let is_own = at.x * towards.x >= 0.0 && at.y * towards.y >= 0.0;
                    if is_own && at.length() <= radius {
                        values[(fine_y / FINE * side as i32 + fine_x / FINE) as usize][s] += 1.0;
                        sum += 1.0;
                    }
                }
            }
            values.iter_mut().for_each(|v| v[s] /= sum);
        }
        let support = Support {
            left: -reach,
            top: -reach,
            width: side,
            height: side,
        };
        Kernel { support, values }
    }

    pub fn gather(&self) -> SubPixelImage {
        let (width, height) = self.size();
        let mirror = |i: i32, n: usize| {
            let i = if i < 0 { -1 - i } else { i };
            (if i >= n as i32 {
                2 * n as i32 - 1 - i
            } else {
                i
            }) as usize
        };
        let cells = (width.div_ceil(CELL), height.div_ceil(CELL));
        let cell = |k: usize| {
            let cell = (k % cells.0, k / cells.0);
            let mut kernels: Vec<Option<Kernel>> = Vec::new();
            kernels.resize_with(self.coc_px.len(), || None);
            let mut done = Vec::new();
            for y in cell.1 * CELL..((cell.1 + 1) * CELL).min(height) {
                for x in cell.0 * CELL..((cell.0 + 1) * CELL).min(width) {
                    let layer = self.layers[y * width + x];
                    let kernel = kernels[layer].get_or_insert_with(|| self.kernel(layer, cell));
                    let mut light = [0f32; 12];
                    for (i, taps) in kernel.values.iter().enumerate() {
                        let columns = kernel.support.width;
                        let dx = kernel.support.left + (i % columns) as i32;
                        let dy = kernel.support.top + (i / columns) as i32;
                        let from = (mirror(x as i32 - dx, width), mirror(y as i32 - dy, height));
                        let pixel = self.picture.light().pixel(from.0, from.1);
                        for (k, light) in light.iter_mut().enumerate() {
                            *light += taps[k % 4] * pixel[k / 4];
                        }
                    }
                    done.push((y * width + x, light));
                }
            }
            done
        };
        let all: Vec<_> = (0..cells.0 * cells.1)
            .into_par_iter()
            .flat_map_iter(cell)
            .collect();
        let mut values = vec![[0f32; VALUES]; width * height];
        for (i, light) in all {
            values[i][..12].copy_from_slice(&light);
        }
        self.shaded(&values)
    }

    /// A layer, convolved: light and coverage.
    fn blurred(&self, layer: usize, disks: Option<&Kernel>) -> Vec<[f32; VALUES]> {
        let (width, height) = self.size();
        let mut sums = vec![[0f32; VALUES]; width * height];
        let cells = (width.div_ceil(CELL), height.div_ceil(CELL));
        for k in 0..cells.0 * cells.1 {
            let cell = (k % cells.0, k / cells.0);
            let (columns, rows) = (
                cell.0 * CELL..((cell.0 + 1) * CELL).min(width),
                cell.1 * CELL..((cell.1 + 1) * CELL).min(height),
            );
            let own = |&(x, y): &(usize, usize)| self.layers[y * width + x] == layer;
            let places = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
            let places: Vec<(usize, usize)> = places.filter(own).collect();
            if places.is_empty() {
                continue;
            }
            let traced = disks.is_none().then(|| self.kernel(layer, cell));
            let Some(kernel) = disks.or(traced.as_ref()) else {
                continue;
            };
            for (x, y) in places {
                let light = self.picture.light().pixel(x, y);
                for (i, taps) in kernel.values.iter().enumerate() {
                    let columns = kernel.support.width;
                    let to_x = x as i32 + kernel.support.left + (i % columns) as i32;
                    let to_y = y as i32 + kernel.support.top + (i / columns) as i32;
                    if (0..width as i32).contains(&to_x) && (0..height as i32).contains(&to_y) {
                        let sum = &mut sums[to_y as usize * width + to_x as usize];
                        for (k, sum) in sum.iter_mut().enumerate() {
                            let light = light.get(k / 4).copied().unwrap_or(1.0);
                            *sum += taps[k % 4] * light;
                        }
                    }
                }
            }
        }
        sums
    }

    pub fn added_layers(&self) -> SubPixelImage {
        let (width, height) = self.size();
        let all: Vec<_> = (0..self.coc_px.len())
            .into_par_iter()
            .map(|layer| self.blurred(layer, None))
            .collect();
        let mut values = vec![[0f32; VALUES]; width * height];
        for layer in all {
            for (to, from) in values.iter_mut().zip(layer) {
                to.iter_mut().zip(from).for_each(|(t, f)| *t += f);
            }
        }
        self.shaded(&values)
    }

    pub fn disk_layers(&self) -> SubPixelImage {
        let (width, height) = self.size();
        let all: Vec<_> = (0..self.coc_px.len())
            .into_par_iter()
            .map(|layer| self.blurred(layer, Some(&self.disks(layer))))
            .collect();
        let mut values = vec![[0f32; VALUES]; width * height];
        for layer in all.iter().rev() {
            for (to, from) in values.iter_mut().zip(layer) {
                for k in 0..12 {
                    to[k] = to[k] * (1.0 - from[12 + k % 4].min(1.0)) + from[k];
                }
            }
        }
        self.shaded(&values)
    }

    /// Mean radiance times what a white wall gives there.
    fn shaded(&self, values: &[[f32; VALUES]]) -> SubPixelImage {
        let (width, height) = self.size();
        let subpixels = self.bank.subpixels();
        let mut mosaic = Image::zeros(2 * width, 2 * height, 3);
        for (i, value) in values.iter().enumerate() {
            let (x, y) = (i % width, i / width);
            for s in 0..4 {
                let to = mosaic.pixel_mut(2 * x + s % 2, 2 * y + s / 2);
                let white = self.white[s].pixel(x, y);
                for (c, to) in to.iter_mut().enumerate() {
                    *to = value[4 * c + s] * white[c];
                }
            }
        }
        SubPixelImage { subpixels, mosaic }
    }
}
