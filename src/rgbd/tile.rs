//! One tile of the converted picture: its sources by layers, spread and laid over each other from the front.

use glam::DVec2;

use super::add::{Point, Sum, Taps, add};
use super::relief::Relief;
use super::sources::{CELL, Source, Sources, Tile, level_of, reached};
use crate::render::kernels::KernelBank;
use crate::sensor::Sensor;
use crate::simd::SimdLevel;

/// By how much a slant may stretch what a sub-pixel sees.
const STRETCH: [f32; 2] = [0.25, 4.0];
/// Layers beside a pixel's own that are its own surface: half a layer of interpolation, and the tear.
const OWN_LAYERS: f32 = 1.5;

/// What all tiles share.
pub(super) struct Scatter<'a, const L: usize> {
    bank: &'a KernelBank,
    relief: &'a Relief,
    sensor: &'a Sensor,
    sources: Sources<'a>,
    /// `[node][sub-pixel]`: change of the centroid per layer, px.
    drift: Vec<DVec2>,
    /// Part of the light of each sub-pixel in the middle of the window.
    shares: Vec<f32>,
}

/// What a tile's pixels get, row by row.
pub(super) struct TileSums<const L: usize> {
    /// Mean radiance per lane.
    pub light: Vec<[f32; L]>,
    /// Part of the light from other surfaces than the pixel's own.
    pub other: Vec<f32>,
    /// Part of the light from places that are made up.
    pub made_up: Vec<f32>,
}

/// A pixel while the layers are laid over it.
#[derive(Clone, Copy)]
struct Pixel<const L: usize> {
    light: [f32; L],
    covered: [f32; L],
    other: f32,
    made_up: f32,
    /// Layers of its own surface.
    own: [f32; 2],
}

impl<'a, const L: usize> Scatter<'a, L> {
    /// Of kernels and surfaces; flat: every source in the first layer.
    pub fn new(
        bank: &'a KernelBank,
        relief: &'a Relief,
        sensor: &'a Sensor,
        is_flat: bool,
    ) -> Self {
        let subpixels = bank.subpixels().count();
        let (nx, ny) = bank.size();
        let channel = (bank.channels() - 1).min(1);
        let last = bank.depths().len() - 1;
        let drift = |k: usize| {
            let (node, s) = (k / subpixels, k % subpixels);
            let [near, far] = [0, last].map(|d| bank.figures(d, node, channel, s).centroid_px);
            let drift = (far - near) / last.max(1) as f64;
            if drift.is_finite() {
                drift
            } else {
                DVec2::ZERO
            }
        };
        let middle = ny / 2 * nx + nx / 2;
        let light = |s| bank.figures(0, middle, channel, s).white_sr as f32;
        let all: f32 = (0..subpixels).map(light).sum();
        Self {
            bank,
            relief,
            sensor,
            sources: Sources {
                relief,
                is_flat,
                layers: bank.depths().len(),
                reach: bank.support().map_or(0, |s| s.reach()),
            },
            drift: (0..nx * ny * subpixels).map(drift).collect(),
            shares: (0..subpixels)
                .map(|s| light(s) / all.max(f32::MIN_POSITIVE))
                .collect(),
        }
    }

    /// One tile, by the best instructions of this processor, which change no bit.
    pub fn tile(&self, tile: Tile) -> TileSums<L> {
        match SimdLevel::detect() {
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `detect` found AVX2 (or more) on this CPU.
            SimdLevel::Avx2 | SimdLevel::Avx512 => unsafe { tile_avx2(self, tile) },
            _ => self.tile_all(tile),
        }
    }

    #[inline(always)]
    fn tile_all(&self, tile: Tile) -> TileSums<L> {
        let layers = self.sources.of(tile);
        let mut pixels = self.pixels(tile);
        let mut sums: Vec<Sum<L>> = vec![[[0.0; L]; 2]; tile.width * tile.height];
        for (key, sources) in layers.iter().enumerate() {
            if sources.is_empty() {
                continue;
            }
            let (level, is_made_up) = level_of(key);
            let support = self.bank.depths()[level].support();
            let [columns, rows] = reached(sources, support, tile);
            for row in rows.clone() {
                sums[row * tile.width..][columns.clone()].fill([[0.0; L]; 2]);
            }
            let mut points = Vec::new();
            for cell in sources.chunk_by(|a, b| a.cell == b.cell) {
                let (taps, drift) = self.taps(cell[0].cell, level);
                points.clear();
                points.extend(cell.iter().map(|s| self.point(s, &drift)));
                add(&taps, &points, tile.width, &mut sums);
            }
            for row in rows {
                let sums = &sums[row * tile.width..][columns.clone()];
                let pixels = &mut pixels[row * tile.width..][columns.clone()];
                for (pixel, sum) in pixels.iter_mut().zip(sums) {
                    self.lay_under(pixel, sum, level as f32, is_made_up);
                }
            }
        }
        self.finished(&pixels)
    }

    /// The kernel of a cell in a layer, and how each sub-pixel's centroid drifts there.
    #[inline(always)]
    fn taps(&self, cell: (usize, usize), level: usize) -> (Taps<L>, Vec<DVec2>) {
        let middle =
            |cell: usize| (cell * CELL + CELL / 2) as f64 - 0.5 - self.relief.margin as f64;
        let place = self.sensor.position_mm(middle(cell.0), middle(cell.1));
        let around = self.bank.around(place);
        let depth = &self.bank.depths()[level];
        let (lanes, channels) = (self.bank.lanes(), self.bank.channels());
        let subpixels = self.shares.len();
        let support = depth.support();
        let mut values = vec![[0f32; L]; support.width * support.height];
        let mut drift = vec![DVec2::ZERO; subpixels];
        for (node, weight) in around {
            let part = weight as f32;
            let kernels = depth.of_node(node).chunks_exact(lanes);
            for (to, from) in values.iter_mut().zip(kernels) {
                for c in 0..3 {
                    let from = &from[c.min(channels - 1) * subpixels..][..subpixels];
                    let to = &mut to[c * subpixels..][..subpixels];
                    to.iter_mut().zip(from).for_each(|(t, f)| *t += part * f);
                }
            }
            let own = &self.drift[node * subpixels..][..subpixels];
            drift
                .iter_mut()
                .zip(own)
                .for_each(|(t, d)| *t += weight * *d);
        }
        (Taps { support, values }, drift)
    }

    fn point(&self, source: &Source, drift: &[DVec2]) -> Point<L> {
        let mut point = Point {
            x: source.x,
            y: source.y,
            light: [0.0; L],
            cover: [0.0; L],
        };
        let [along, down] = source.slope;
        for (s, d) in drift.iter().enumerate() {
            let stretch = 1.0 + d.x as f32 * along + d.y as f32 * down;
            let cover = source.weight * stretch.clamp(STRETCH[0], STRETCH[1]);
            for (c, light) in source.light.iter().enumerate() {
                point.cover[c * drift.len() + s] = cover;
                point.light[c * drift.len() + s] = cover * light;
            }
        }
        point
    }

    fn pixels(&self, tile: Tile) -> Vec<Pixel<L>> {
        let relief = self.relief;
        let depths = self.bank.depths();
        let mut pixels = Vec::with_capacity(tile.width * tile.height);
        for row in tile.y..tile.y + tile.height {
            for column in tile.x..tile.x + tile.width {
                let at = (row + relief.margin) * relief.width + column + relief.margin;
                let own = if self.sources.is_flat {
                    0.0
                } else {
                    relief.level[at]
                };
                let [x, y] = relief.slope[at];
                let reach = depths[own as usize].support().reach() as f32;
                let more = OWN_LAYERS + x.hypot(y) * reach;
                pixels.push(Pixel {
                    light: [0.0; L],
                    covered: [0.0; L],
                    other: 0.0,
                    made_up: 0.0,
                    own: [own - more, own + more],
                });
            }
        }
        pixels
    }

    /// Lays a layer under what is there.
    #[inline(always)]
    fn lay_under(&self, pixel: &mut Pixel<L>, sum: &Sum<L>, level: f32, is_made_up: bool) {
        let [light, cover] = sum;
        let mut taken = [0f32; L];
        for l in 0..L {
            taken[l] = cover[l].min(1.0 - pixel.covered[l]).max(0.0);
            pixel.covered[l] += taken[l];
            let share = if cover[l] > 0.0 {
                taken[l] / cover[l]
            } else {
                0.0
            };
            pixel.light[l] += light[l] * share;
        }
        // Green stands for all.
        let green = &taken[self.shares.len()..][..self.shares.len()];
        let part: f32 = green.iter().zip(&self.shares).map(|(t, s)| t * s).sum();
        if !(pixel.own[0]..=pixel.own[1]).contains(&level) {
            pixel.other += part;
        }
        if is_made_up {
            pixel.made_up += part;
        }
    }

    fn finished(&self, pixels: &[Pixel<L>]) -> TileSums<L> {
        let subpixels = self.shares.len();
        let mean = |p: &Pixel<L>| {
            std::array::from_fn(|l| {
                let covered = p.covered[l];
                if covered > 0.0 {
                    p.light[l] / covered
                } else {
                    0.0
                }
            })
        };
        let covered = |p: &Pixel<L>| -> f32 {
            let green = &p.covered[subpixels..][..subpixels];
            green.iter().zip(&self.shares).map(|(c, s)| c * s).sum()
        };
        TileSums {
            light: pixels.iter().map(mean).collect(),
            other: (pixels.iter())
                .map(|p| p.other / covered(p).max(f32::MIN_POSITIVE))
                .collect(),
            made_up: (pixels.iter())
                .map(|p| p.made_up + (1.0 - covered(p)).max(0.0))
                .collect(),
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn tile_avx2<const L: usize>(scatter: &Scatter<'_, L>, tile: Tile) -> TileSums<L> {
    scatter.tile_all(tile)
}
