//! A relief as shining patches: one per pixel and per point behind it, whose corners are shared along a surface and
//! apart at its edges.

use std::sync::Arc;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::error::RgbdError;
use super::levels::Levels;
use super::relief::Relief;
use crate::render::Camera;
use crate::render::truth::SightRays;
use crate::scene::Scene;
use crate::scene::world::{Patch, Patches, surface_number};

/// Pixels from which the lines of sight are continued beyond the window.
const BASE_PX: usize = 16;

/// The surfaces of a relief, before a camera.
pub(super) struct Surfaces {
    patches: Arc<Patches>,
    light: Vec<[f32; 3]>,
    made_up: Vec<bool>,
}

/// A pixel's own surface, or what goes on behind it.
#[derive(Clone, Copy)]
struct Entry {
    level: f32,
    slope: [f32; 2],
}

/// What the corners of the grid are gone through with.
struct Weaver<'a> {
    relief: &'a Relief,
    tear: f32,
    entries: Vec<Entry>,
    /// Of the second entry of a position.
    behind: Vec<Option<u32>>,
    patches: Vec<Patch>,
    /// Column, row and level of each corner of a patch.
    corners: Vec<([usize; 2], f32)>,
    /// Union of entries: each one's elder.
    elder: Vec<u32>,
}

impl Surfaces {
    /// Of a relief, whose points lie where the rays of sight of the picture's pixels see them.
    ///
    /// # Errors
    /// A window with a dark part.
    pub fn new(
        camera: &Camera,
        sight: &SightRays,
        relief: &Relief,
        levels: &Levels,
    ) -> Result<Self, RgbdError> {
        let mut weaver = Weaver::new(relief, levels.tear());
        for row in 0..=relief.height {
            for column in 0..=relief.width {
                weaver.corner(column, row);
            }
        }
        let (corners, patches) = weaver.finish();
        let place = |&([column, row], level): &([usize; 2], f32)| {
            let at = |k: usize, n: usize| match k {
                // The outermost ones reach farther than any ray.
                0 => -(relief.margin as f64) - 2.0 * n as f64,
                k if k == n => 2.0 * n as f64,
                k => k as f64 - relief.margin as f64 - 0.5,
            };
            let at = DVec2::new(at(column, relief.width), at(row, relief.height));
            point(camera, sight, at, levels.depth_mm(level))
        };
        let positions: Vec<DVec3> = corners.par_iter().map(place).collect();
        if !positions.iter().all(|p| p.is_finite()) {
            return Err(RgbdError::Dark);
        }
        let behind = || relief.places().filter_map(|place| relief.behind(place));
        Ok(Self {
            patches: Arc::new(Patches::new(&positions, &patches)),
            light: (relief.places().map(|place| relief.light(place)))
                .chain(behind().map(|b| b.light))
                .collect(),
            made_up: (relief.places().map(|place| relief.is_made_up(place)))
                .chain(behind().map(|_| true))
                .collect(),
        })
    }

    /// The picture as a scene; what no ray should meet shines as the mean of all.
    pub fn scene(&self) -> Scene {
        let mean = |c: usize| {
            let sum: f64 = self.light.iter().map(|l| f64::from(l[c])).sum();
            (sum / self.light.len().max(1) as f64) as f32
        };
        Scene::from_patches(
            self.patches.clone(),
            self.light.clone(),
            [0, 1, 2].map(mean),
        )
    }

    /// A scene that shines where its place is made up.
    pub fn made_up(&self) -> Scene {
        let shines = |is: &bool| [if *is { 1.0 } else { 0.0 }; 3];
        let samples = self.made_up.iter().map(shines).collect();
        Scene::from_patches(self.patches.clone(), samples, [1.0; 3])
    }
}

/// Where the ray of sight of a place (column, row) in the stored picture is at a depth; outside of the window as its
/// nearest pixels go on.
fn point(camera: &Camera, sight: &SightRays, at: DVec2, depth_mm: f64) -> DVec3 {
    let sensor = camera.sensor();
    let last = DVec2::new((sensor.width() - 1) as f64, (sensor.height() - 1) as f64);
    let inside = at.clamp(DVec2::ZERO, last);
    let seen = |at: DVec2| {
        let line = sight.line(camera, sensor.position_mm(at.x, at.y));
        line.map_or(DVec2::NAN, |line| line.q0 * depth_mm + line.q1_mm)
    };
    let here = seen(inside);
    let beyond = at - inside;
    let along = |axis: DVec2| {
        let (far, last) = (beyond.dot(axis), last.dot(axis));
        let base = last.min(BASE_PX as f64);
        if far == 0.0 || base == 0.0 {
            return DVec2::ZERO;
        }
        (here - seen(inside - axis * base * far.signum())) * (far.abs() / base)
    };
    (here + along(DVec2::X) + along(DVec2::Y)).extend(-depth_mm)
}

impl<'a> Weaver<'a> {
    fn new(relief: &'a Relief, tear: f32) -> Self {
        let own = relief.places().map(|place| Entry {
            level: relief.level(place),
            slope: relief.slope(place),
        });
        let behind = relief.places().map(|place| relief.behind(place));
        let other = behind.clone().flatten().map(|b| Entry {
            level: b.level,
            slope: [0.0; 2],
        });
        let mut number = (relief.width * relief.height) as u32;
        let behind = behind.map(|b| {
            b.map(|_| {
                number += 1;
                number - 1
            })
        });
        let behind = behind.collect();
        let entries: Vec<Entry> = own.chain(other).collect();
        let patch = Patch {
            corners: [0; 4],
            around: [[None; 4]; 4],
            surface: 0,
        };
        Self {
            relief,
            tear,
            behind,
            patches: vec![patch; entries.len()],
            corners: Vec::with_capacity(entries.len()),
            elder: (0..entries.len() as u32).collect(),
            entries,
        }
    }

    /// Makes the corners that the surfaces around a place of the grid have there.
    fn corner(&mut self, column: usize, row: usize) {
        let (width, height) = (self.relief.width, self.relief.height);
        // Of each of the four pixels around: its own surface, and what is behind it.
        let mut around = [[None; 2]; 4];
        for (k, around) in around.iter_mut().enumerate() {
            let (x, y) = (column + k % 2, row + k / 2);
            if (1..=width).contains(&x) && (1..=height).contains(&y) {
                let at = (y - 1) * width + x - 1;
                *around = [Some(at as u32), self.behind[at]];
            }
        }
        let mut left: Vec<(usize, u32)> = (around.iter().enumerate())
            .flat_map(|(k, both)| both.iter().flatten().map(move |&e| (k, e)))
            .collect();
        while let Some(first) = left.pop() {
            let mut members = vec![first];
            let mut next = 0;
            while let Some(&from) = members.get(next) {
                next += 1;
                left.retain(|&to| {
                    let is_same = self.are_one(from, to);
                    if is_same {
                        members.push(to);
                    }
                    !is_same
                });
            }
            self.join(&members, [column, row]);
        }
    }

    /// Whether two entries that lie side by side are of one surface.
    fn are_one(&self, a: (usize, u32), b: (usize, u32)) -> bool {
        let level = |e: u32| self.entries[e as usize].level;
        (a.0 ^ b.0).count_ones() == 1 && (level(a.1) - level(b.1)).abs() <= self.tear
    }

    fn join(&mut self, members: &[(usize, u32)], place: [usize; 2]) {
        let number = self.corners.len() as u32;
        let mut level = 0.0;
        let mut samples = [None; 4];
        for &(k, e) in members {
            let entry = &self.entries[e as usize];
            // Pixel 0 lies to the left of and above the corner.
            let side = [k % 2, k / 2].map(|far| if far == 0 { 0.5 } else { -0.5 });
            level += entry.level + side[0] * entry.slope[0] + side[1] * entry.slope[1];
            samples[k] = Some(e);
        }
        self.corners.push((place, level / members.len() as f32));
        let eldest = members.iter().map(|&(_, e)| self.eldest(e)).min();
        for &(k, e) in members {
            let own = &mut self.patches[e as usize];
            own.corners[3 - k] = number;
            own.around[3 - k] = samples;
            own.around[3 - k][k] = Some(e);
            let old = self.eldest(e);
            self.elder[old as usize] = eldest.unwrap_or(old);
        }
    }

    fn eldest(&mut self, mut e: u32) -> u32 {
        while self.elder[e as usize] != e {
            self.elder[e as usize] = self.elder[self.elder[e as usize] as usize];
            e = self.elder[e as usize];
        }
        e
    }

    fn finish(mut self) -> (Vec<([usize; 2], f32)>, Vec<Patch>) {
        let mut number = vec![None; self.entries.len()];
        let mut count = 0;
        for e in 0..self.entries.len() {
            let eldest = self.eldest(e as u32) as usize;
            let surface = *number[eldest].get_or_insert_with(|| {
                count += 1;
                surface_number(count - 1)
            });
            self.patches[e].surface = surface;
        }
        (self.corners, self.patches)
    }
}
