//! One tile of the converted picture: its sources by layers, spread and laid over each other from the front.

use std::ops::Range;

use glam::DVec2;

use super::add::{Point, Sum, add};
use super::cell_kernels::{CELL, CellKernels, HALO_CELLS};
use super::halo::{self, Parts};
use super::relief::Relief;
use crate::render::kernels::KernelBank;
use crate::sensor::Sensor;

/// By how much a slant may stretch what a sub-pixel sees.
const STRETCH: [f32; 2] = [0.25, 4.0];
/// Layers beside a pixel's own that are its own surface: half a layer of interpolation, and the tear.
const OWN_LAYERS: f32 = 1.5;

/// What all tiles share.
pub(super) struct Scatter<'a, const L: usize> {
    kernels: CellKernels<'a, L>,
    relief: &'a Relief,
    /// Everything in one layer, with neither slant nor background.
    is_flat: bool,
    reach: usize,
    /// Part of the light of each sub-pixel in the middle of the window.
    shares: Vec<f32>,
}

/// A rectangle of the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tile {
    pub x: usize,
    pub y: usize,
    pub width: usize,
    pub height: usize,
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

/// A source in a layer.
#[derive(Clone, Copy)]
struct Source {
    cell: (usize, usize),
    x: i32,
    y: i32,
    weight: f32,
    light: [f32; 3],
    slope: [f32; 2],
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
    /// Of kernels, their parts, and surfaces; flat: every source in the first layer.
    pub fn new(
        (bank, parts): (&'a KernelBank, &'a [Parts]),
        relief: &'a Relief,
        sensor: &'a Sensor,
        is_flat: bool,
    ) -> Self {
        let subpixels = bank.subpixels().count();
        let (nx, ny) = bank.size();
        let channel = (bank.channels() - 1).min(1);
        let middle = ny / 2 * nx + nx / 2;
        let light = |s| bank.figures(0, middle, channel, s).white_sr as f32;
        let all: f32 = (0..subpixels).map(light).sum();
        Self {
            kernels: CellKernels::new((bank, parts), sensor),
            relief,
            is_flat,
            reach: bank.support().map_or(0, |s| s.reach()),
            shares: (0..subpixels)
                .map(|s| light(s) / all.max(f32::MIN_POSITIVE))
                .collect(),
        }
    }

    /// One tile.
    pub fn tile(&self, tile: Tile) -> TileSums<L> {
        let layers = self.layers(tile);
        let mut pixels = self.pixels(tile);
        let origin = [tile.x, tile.y].map(|at| at + self.relief.margin);
        let mut sums: Vec<Sum<L>> = vec![[[0.0; L]; 2]; tile.width * tile.height];
        for (key, sources) in layers.iter().enumerate() {
            if sources.is_empty() {
                continue;
            }
            let (level, is_made_up) = level_of(key);
            // A layer is in the way of its own rows alone.
            let reached = self.rows_reached(sources, level, tile.height);
            let reached = reached.start * tile.width..reached.end * tile.width;
            sums[reached.clone()].fill([[0.0; L]; 2]);
            let (mut points, mut blocks) = (Vec::new(), Vec::new());
            let mut around_halo = None;
            for cell in sources.chunk_by(|a, b| a.cell == b.cell) {
                let place = [cell[0].cell.0, cell[0].cell.1]
                    .map(|i| i as i32 - (self.relief.margin / CELL) as i32);
                let around = self.kernels.around(place);
                let drift = self.kernels.drift(around);
                points.clear();
                points.extend(cell.iter().map(|s| self.point(s, &drift)));
                let core = self.kernels.core(around, level);
                add(&core, &points, tile.width, &mut sums);
                let place = place.map(|i| i.div_euclid(HALO_CELLS));
                if around_halo.as_ref().is_none_or(|(at, _)| *at != place) {
                    around_halo = self.kernels.halo(place, level).map(|taps| (place, taps));
                }
                if let Some((_, taps)) = &around_halo {
                    halo::blocks(&points, origin, &mut blocks);
                    add(taps, &blocks, tile.width, &mut sums);
                }
            }
            for (pixel, sum) in pixels[reached.clone()].iter_mut().zip(&sums[reached]) {
                self.lay_under(pixel, sum, level as f32, is_made_up);
            }
        }
        self.finished(&pixels)
    }

    /// Sources that reach the tile by their keys, cell by cell.
    fn layers(&self, tile: Tile) -> Vec<Vec<Source>> {
        let relief = self.relief;
        let mut layers: Vec<Vec<Source>> =
            vec![Vec::new(); key_of(self.kernels.bank.depths().len(), true)];
        // Whole blocks, whatever the tile.
        let reaching = |at: usize, len: usize, most: usize| {
            let first = at + relief.margin - self.reach;
            let end = first + len + 2 * self.reach;
            first / halo::BLOCK * halo::BLOCK..end.next_multiple_of(halo::BLOCK).min(most)
        };
        let columns = reaching(tile.x, tile.width, relief.width);
        let rows = reaching(tile.y, tile.height, relief.height);
        for cell_row in rows.start / CELL..=(rows.end - 1) / CELL {
            for cell_column in columns.start / CELL..=(columns.end - 1) / CELL {
                let cell = (cell_column, cell_row);
                for row in within(cell_row, &rows) {
                    for column in within(cell_column, &columns) {
                        let place = [(column, tile.x), (row, tile.y)];
                        let [x, y] =
                            place.map(|(at, tile)| at as i32 - (relief.margin + tile) as i32);
                        self.place([column, row], (cell, x, y), &mut layers);
                    }
                }
            }
        }
        layers
    }

    /// Puts a source, and what goes on behind it, into their layers.
    fn place(
        &self,
        place: [usize; 2],
        (cell, x, y): ((usize, usize), i32, i32),
        layers: &mut [Vec<Source>],
    ) {
        let relief = self.relief;
        let mut put = |level: f32, is_made_up: bool, light: [f32; 3], slope: [f32; 2]| {
            let near = level.floor();
            let behind = level - near;
            for (layer, weight) in [(near as usize, 1.0 - behind), (near as usize + 1, behind)] {
                if weight > 0.0 {
                    layers[key_of(layer, is_made_up)].push(Source {
                        cell,
                        x,
                        y,
                        weight,
                        light,
                        slope,
                    });
                }
            }
        };
        if self.is_flat {
            return put(0.0, false, relief.light(place), [0.0; 2]);
        }
        put(
            relief.level(place),
            relief.is_made_up(place),
            relief.light(place),
            relief.slope(place),
        );
        if let Some(behind) = relief.behind(place) {
            put(behind.level, true, behind.light, [0.0; 2]);
        }
    }

    /// Rows of a tile that sources of a layer may reach, their halos included.
    fn rows_reached(&self, sources: &[Source], level: usize, height: usize) -> Range<usize> {
        let rows = sources.iter().map(|source| source.y);
        let (first, last) = rows.fold((i32::MAX, i32::MIN), |(a, b), y| (a.min(y), b.max(y)));
        let reach = (self.kernels.bank.depths()[level].support().reach() + halo::BLOCK) as i32;
        let within = |row: i32| row.clamp(0, height as i32) as usize;
        within(first - reach)..within(last + reach + 1)
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
        let depths = self.kernels.bank.depths();
        let mut pixels = Vec::with_capacity(tile.width * tile.height);
        for row in tile.y..tile.y + tile.height {
            for column in tile.x..tile.x + tile.width {
                let place = [column, row].map(|i| i + relief.margin);
                let own = if self.is_flat {
                    0.0
                } else {
                    relief.level(place)
                };
                let [x, y] = relief.slope(place);
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
    #[inline]
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

/// Order in which layers are laid: made-up sources of a layer come after those that are seen a layer farther, which
/// they may be in the way of otherwise.
fn key_of(layer: usize, is_made_up: bool) -> usize {
    match is_made_up {
        false => 2 * layer,
        true => 2 * layer + 3,
    }
}

/// Layer of a key, and whether its sources are made up.
fn level_of(key: usize) -> (usize, bool) {
    match key % 2 {
        0 => (key / 2, false),
        _ => ((key - 3) / 2, true),
    }
}

/// The part of a cell that lies in a range.
fn within(cell: usize, range: &Range<usize>) -> Range<usize> {
    (cell * CELL).max(range.start)..((cell + 1) * CELL).min(range.end)
}
