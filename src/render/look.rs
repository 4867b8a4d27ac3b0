//! What the rays of a block meet, and its radiance: by points, or over the areas that rays stand for.

use std::ops::Range;

use glam::DVec2;

use super::footprints::{Footprints, Slopes};
use super::workspace::{Segment, Workspace};
use crate::rays::RaySlices;
use crate::scene::world::PathKey;
use crate::scene::{Hits, Scene, Ways};

/// What is looked up where rays stand for areas: buffers of a thread.
#[derive(Clone, Debug, Default)]
pub(super) struct Areas {
    /// How each card is met beside each pixel of a run: pixels outermost.
    slopes: Vec<Slopes>,
    /// What the mirror images of rays in their pixels meet, and its radiance.
    mirrored: Hits,
    other: Vec<f32>,
}

impl Workspace {
    /// Finds what the rays of a run of pixels stand for.
    pub fn stand_for(
        &mut self,
        footprints: Option<&Footprints>,
        places_mm: impl Iterator<Item = DVec2>,
    ) {
        let slopes = &mut self.areas.slopes;
        slopes.clear();
        if let Some(footprints) = footprints {
            places_mm.for_each(|place_mm| footprints.add_slopes(place_mm, slopes));
        }
    }

    /// The radiance of the channels along the traced rays.
    pub fn look(&mut self, scene: &Scene, channels: Range<usize>, key: impl Fn(usize) -> PathKey) {
        let rays = RaySlices::from_batch(&self.batch);
        scene.find_surfaces(rays, &mut self.hits);
        scene.radiance(rays, &mut self.hits, channels, key, &mut self.radiance);
    }

    /// The same over the areas that rays stand for, in the footprints' scene: the mean of a quarter of the pixel and of
    /// the opposite one.
    pub fn look_around(
        &mut self,
        footprints: &Footprints,
        channels: Range<usize>,
        key: impl Fn(usize) -> PathKey,
    ) {
        let scene = footprints.scene();
        let rays = RaySlices::from_batch(&self.batch);
        let Areas {
            slopes,
            mirrored,
            other,
        } = &mut self.areas;
        let [x, y, ..] = &self.samples;
        let places = Places {
            cards: scene.planes().len(),
            slopes,
            pixels: &self.segments,
            x,
            y,
        };
        let hits = &mut self.hits;
        scene.intersect_pairs(
            rays,
            |card| places.reach(card),
            |card, rays, ways| places.fill(card, rays, ways),
            [hits, mirrored],
        );
        for channel in channels {
            let each = channel..channel + 1;
            scene.radiance(rays, mirrored, each.clone(), &key, &mut self.radiance);
            other.clone_from(&self.radiance[channel]);
            scene.radiance(rays, hits, each, &key, &mut self.radiance);
            for (own, other) in self.radiance[channel].iter_mut().zip(&*other) {
                *own = 0.5 * (*own + other);
            }
        }
    }
}

/// How s and t of the cards change over the pixels of a block, and where in their pixels its rays start.
struct Places<'a> {
    /// Cards of the scene.
    cards: usize,
    /// Pixels outermost.
    slopes: &'a [Slopes],
    pixels: &'a [Segment],
    /// Places in the pixel, 0 to 1.
    x: &'a [f64],
    y: &'a [f64],
}

/// A place in a pixel and the middle of its quarter of it, from the pixel's middle, px.
#[inline(always)]
fn in_quarter(x: f64) -> (f32, f32) {
    let x = x as f32 - 0.5;
    (x, 0.25f32.copysign(x))
}

/// Change of s and t.
#[inline(always)]
fn change([sx, tx, sy, ty]: Slopes, x: f32, y: f32) -> [f32; 2] {
    [sx * x + sy * y, tx * x + ty * y]
}

impl Places<'_> {
    /// The most by which s or t of a card differs between two places in one of the pixels.
    fn reach(&self, card: usize) -> f64 {
        let all = self.slopes.chunks_exact(self.cards);
        let most = (self.pixels.iter().zip(all))
            .map(|(_, slopes)| slopes[card].map(|slope| f64::from(slope).abs()))
            .map(|[sx, tx, sy, ty]| (sx + sy).max(tx + ty))
            .fold(0.0, f64::max);
        // Rounding of single precision.
        1.001 * most + 1e-6
    }

    /// From where rays meet a card to where the middles of their quarters would; and to where their mirror images would
    /// and the middles of those images' quarters.
    fn fill(&self, card: usize, rays: Range<usize>, [own, opposite]: &mut [Ways; 2]) {
        let first = (self.pixels).partition_point(|pixel| pixel.rays.end <= rays.start);
        let all = self.slopes.chunks_exact(self.cards);
        for (pixel, slopes) in self.pixels.iter().zip(all).skip(first) {
            let here = pixel.rays.start.max(rays.start)..pixel.rays.end.min(rays.end);
            if here.is_empty() {
                break;
            }
            let slopes = slopes[card];
            let (x, y) = (&self.x[here.clone()], &self.y[here.clone()]);
            let block = here.start - rays.start..here.end - rays.start;
            let [own_s, own_t] = own.to_place.each_mut().map(|x| &mut x[block.clone()]);
            let [card_s, card_t] = (opposite.to_card.each_mut()).map(|x| &mut x[block.clone()]);
            let [other_s, other_t] = (opposite.to_place.each_mut()).map(|x| &mut x[block.clone()]);
            for i in 0..here.len() {
                let ((x, qx), (y, qy)) = (in_quarter(x[i]), in_quarter(y[i]));
                let (back, middle) = (change(slopes, -x, -y), change(slopes, qx, qy));
                [own_s[i], own_t[i]] = [back[0] + middle[0], back[1] + middle[1]];
                [card_s[i], card_t[i]] = [2.0 * back[0], 2.0 * back[1]];
                [other_s[i], other_t[i]] = [back[0] - middle[0], back[1] - middle[1]];
            }
        }
    }
}
