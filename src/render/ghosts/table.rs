//! How rays are drawn: by bins of source, pair and place on the front disk.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::super::Camera;
use super::front::FrontDisk;
use super::pilot::{Pilot, PlaceBox};
use super::sources::{Source, sources};
use crate::lens::{GhostPairs, Reflections};
use crate::sampling::{hash, uniform};
use crate::scene::Scene;
use crate::spectrum::ChannelWavelengths;

/// Part of the rays that go by brightness alone.
const BLIND: f64 = 0.2;

/// See the module.
pub(super) struct GhostTable {
    pub pairs: GhostPairs,
    /// Cells on a side of the square around the front disk.
    cells: usize,
    sources: Vec<Source>,
    /// `[source][pair][place]`.
    bins: Vec<Bin>,
    /// Running sums of the bins' chances.
    sums: Vec<f64>,
}

/// How rays of a bin are drawn.
#[derive(Clone, Copy, Debug)]
struct Bin {
    /// Part of all rays that go through `part` of the cell of the front disk.
    aimed: f64,
    part: PlaceBox,
    /// Part of all rays that go through any place of the cell.
    blind: f64,
}

/// A ray as it was drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Drawn {
    pub pair: usize,
    pub place_mm: DVec3,
    /// Away from the camera.
    pub direction: DVec3,
    /// One over its density, mm² (d²s has no unit).
    pub weight: f64,
}

impl GhostTable {
    /// With so many cells on a side of the square around the front disk; `None` where no light comes near the window.
    pub fn new(
        camera: &Camera,
        reflections: &Reflections,
        scene: &Scene,
        front: &FrontDisk,
        cells: usize,
        seed: u64,
    ) -> Option<Self> {
        let system = camera.system(ChannelWavelengths::REFERENCE);
        let pairs = GhostPairs::new(reflections, system);
        let (sources, bright): (Vec<_>, Vec<_>) = sources(camera, scene, front, hash(seed, &[2]))
            .into_iter()
            .unzip();
        let places = cells * cells;
        let pilot = Pilot {
            system,
            reflections,
            pairs: &pairs,
            front,
            cells,
            window: camera.sensor().window_mm(),
            seed: hash(seed, &[3]),
        };
        let looks: Vec<Vec<(f64, PlaceBox)>> = (0..sources.len() * places)
            .into_par_iter()
            .map(|number| pilot.look(&sources[number / places], number % places, number as u64))
            .collect();
        let bins = (0..sources.len() * pairs.len() * places).map(|number| {
            let (source, pair, place) = split(number, pairs.len(), cells);
            let (found, part) = looks[source * places + place][pair];
            Bin {
                aimed: bright[source] * found,
                part,
                blind: bright[source] * reflections.pair_on_axis(system, pairs[pair]),
            }
        });
        let mut bins: Vec<Bin> = bins.collect();
        let aimed: f64 = bins.iter().map(|bin| bin.aimed).sum();
        let blind: f64 = bins.iter().map(|bin| bin.blind).sum();
        // Written so that NaN fails.
        if !(aimed > 0.0 && blind > 0.0) {
            return None;
        }
        let mut sum = 0.0;
        let sums = bins.iter_mut().map(|bin| {
            bin.aimed *= (1.0 - BLIND) / aimed;
            bin.blind *= BLIND / blind;
            sum += bin.aimed + bin.blind;
            sum
        });
        Some(Self {
            sums: sums.collect(),
            pairs,
            cells,
            sources,
            bins,
        })
    }

    /// Ray `number` of `rays`, each from its own part of the bins' sum; `None` where it would miss the disk.
    pub fn draw(&self, front: &FrontDisk, number: usize, rays: usize, seed: u64) -> Option<Drawn> {
        let random = |k: u64| uniform(seed, &[number as u64, k]);
        let all = self.sums.last().copied().unwrap_or(0.0);
        let along = all * (number as f64 + random(0)) / rays as f64;
        let chosen = self.sums.partition_point(|sum| *sum <= along);
        let chosen = chosen.min(self.sums.len() - 1);
        let (source, pair, place) = split(chosen, self.pairs.len(), self.cells);
        let bin = &self.bins[chosen];
        let part = match random(5) * (bin.aimed + bin.blind) < bin.aimed {
            true => bin.part,
            false => PlaceBox::WHOLE,
        };
        let within = part.least + DVec2::new(random(1), random(2)) * part.size();
        let place_mm = front.place_mm(place_at(place, self.cells, within))?;
        let direction = self.sources[source].direction(place_mm, random(3), random(4))?;
        let of_source = |(source, of): (usize, &Source)| {
            let row = source * self.pairs.len() + pair;
            let bin = &self.bins[row * self.cells * self.cells + place];
            let chance = bin.blind + bin.aimed * bin.part.density(within);
            chance * of.density(place_mm, direction)
        };
        let density: f64 = self.sources.iter().enumerate().map(of_source).sum();
        let side = front.side_mm() / self.cells as f64;
        Some(Drawn {
            pair,
            place_mm,
            direction,
            weight: all * side * side / density,
        })
    }
}

/// Source, pair and place of a bin.
fn split(bin: usize, pairs: usize, cells: usize) -> (usize, usize, usize) {
    let (row, place) = (bin / (cells * cells), bin % (cells * cells));
    (row / pairs, row % pairs, place)
}

/// −1 to 1 along each side of the square around the front disk, of a place `within` the cell, 0 to 1.
pub(super) fn place_at(place: usize, cells: usize, within: DVec2) -> DVec2 {
    let cell = DVec2::new((place % cells) as f64, (place / cells) as f64);
    (cell + within) * (2.0 / cells as f64) - 1.0
}
