//! Light from infinitely far: a panorama, drawn from in proportion to its brightness.
//!
//! Cells of the picture have the weight `luminance · sin θ`; a row is drawn first, then a column (M. Pharr, W. Jakob,
//! G. Humphreys, *Physically Based Rendering*, 3rd ed., 14.2.4). The density per solid angle is the cell's chance over
//! its solid angle.

use std::f32::consts::{PI, TAU};
use std::sync::Arc;

use glam::{Mat3, Vec3A as Vec3};

use super::description::Environment;
use crate::image::Image;

/// The environment, ready for rays.
#[derive(Clone, Debug)]
pub(super) enum Sky {
    Even(Vec3),
    Map(Box<Panorama>),
}

#[derive(Clone, Debug)]
pub(super) struct Panorama {
    image: Arc<Image>,
    camera_from_map: Mat3,
    scale: f32,
    /// Sums of rows' chances, and of cells' chances within each row; each ends in 1.
    rows: Vec<f32>,
    cells: Vec<f32>,
}

/// The chance of entry `i` of running sums.
fn chance(sums: &[f32], i: usize) -> f32 {
    sums[i] - if i == 0 { 0.0 } else { sums[i - 1] }
}

/// Running sums of weights, ending in 1; `None` if they are all zero.
fn running(weights: &[f64]) -> Option<Vec<f32>> {
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    let sums = weights.iter().map(|w| {
        sum += w / total;
        sum.min(1.0) as f32
    });
    (total > 0.0).then(|| sums.collect())
}

/// Which entry `u` falls on, and where in it (0 to 1).
fn draw(sums: &[f32], u: f32) -> (usize, f32) {
    let i = sums.partition_point(|s| *s <= u).min(sums.len() - 1);
    let width = chance(sums, i);
    let start = sums[i] - width;
    let place = if width > 0.0 {
        (u - start) / width
    } else {
        0.5
    };
    (i, place.clamp(0.0, 1.0))
}

impl Sky {
    pub fn new(environment: &Environment) -> Self {
        match environment {
            Environment::Even(radiance) => Self::Even(Vec3::from(*radiance)),
            Environment::Map {
                image,
                camera_from_map,
                scale,
            } => match Panorama::new(image.clone(), camera_from_map.as_mat3(), *scale) {
                Some(panorama) => Self::Map(Box::new(panorama)),
                None => Self::Even(Vec3::ZERO),
            },
        }
    }

    /// Whether nothing comes from anywhere.
    pub fn is_dark(&self) -> bool {
        matches!(self, Self::Even(radiance) if *radiance == Vec3::ZERO)
    }

    /// Radiance from a direction (away from the scene).
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Even(radiance) => *radiance,
            Self::Map(panorama) => panorama.radiance(direction),
        }
    }
}

impl Panorama {
    fn new(image: Arc<Image>, camera_from_map: Mat3, scale: f32) -> Option<Self> {
        let (width, height) = (image.width(), image.height());
        let luminance = |x: usize, y: usize| f64::from(image.pixel(x, y).iter().sum::<f32>());
        let mut row_weights = Vec::with_capacity(height);
        let mut cells = Vec::with_capacity(width * height);
        let mut weights = vec![0.0; width];
        for y in 0..height {
            let sin = ((y as f64 + 0.5) / height as f64 * std::f64::consts::PI).sin();
            for (x, weight) in weights.iter_mut().enumerate() {
                // Interpolation carries light half a cell over: neighbours count, so that nothing bright has no chance.
                let near = [(x + width - 1) % width, x, (x + 1) % width];
                let around = near.iter().flat_map(|&i| {
                    (y.saturating_sub(1)..=(y + 1).min(height - 1)).map(move |j| (i, j))
                });
                let around: f64 = around.map(|(i, j)| luminance(i, j)).sum();
                *weight = sin * (luminance(x, y) + 0.125 * around);
            }
            row_weights.push(weights.iter().sum());
            // A dark row is never drawn.
            cells.extend(running(&weights).unwrap_or_else(|| vec![1.0; width]));
        }
        if scale == 0.0 {
            return None;
        }
        Some(Self {
            rows: running(&row_weights)?,
            cells,
            image,
            camera_from_map,
            scale,
        })
    }

    /// Map coordinates of a direction, in 0..1: column and row.
    fn place(&self, direction: Vec3) -> [f32; 2] {
        let d = self.camera_from_map.transpose() * direction;
        [
            (0.5 + d.x.atan2(-d.z) / TAU).clamp(0.0, 1.0),
            (d.y.clamp(-1.0, 1.0).acos() / PI).clamp(0.0, 1.0),
        ]
    }

    fn radiance(&self, direction: Vec3) -> Vec3 {
        let (width, height) = (self.image.width(), self.image.height());
        let [u, v] = self.place(direction);
        let (x, y) = (u * width as f32 - 0.5, v * height as f32 - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let column = |k: i64| (x.floor() as i64 + k).rem_euclid(width as i64) as usize;
        let row = |k: i64| (y.floor() as i64 + k).clamp(0, height as i64 - 1) as usize;
        let at = |i: i64, j: i64| Vec3::from_slice(self.image.pixel(column(i), row(j)));
        let upper = at(0, 0).lerp(at(1, 0), fx);
        let lower = at(0, 1).lerp(at(1, 1), fx);
        upper.lerp(lower, fy) * self.scale
    }

    /// A direction and its density per solid angle.
    pub fn sample(&self, [s, t]: [f32; 2]) -> (Vec3, f32) {
        let (width, height) = (self.image.width(), self.image.height());
        let (row, fy) = draw(&self.rows, t);
        let (column, fx) = draw(&self.cells[row * width..][..width], s);
        let theta = (row as f32 + fy) / height as f32 * PI;
        let phi = ((column as f32 + fx) / width as f32 - 0.5) * TAU;
        let (sin, cos) = theta.sin_cos();
        let local = Vec3::new(sin * phi.sin(), cos, -sin * phi.cos());
        (
            self.camera_from_map * local,
            self.cell_density(column, row, sin),
        )
    }

    /// The density of drawing a direction.
    pub fn density(&self, direction: Vec3) -> f32 {
        let (width, height) = (self.image.width(), self.image.height());
        let [u, v] = self.place(direction);
        let column = ((u * width as f32) as usize).min(width - 1);
        let row = ((v * height as f32) as usize).min(height - 1);
        self.cell_density(column, row, (v * PI).sin())
    }

    fn cell_density(&self, column: usize, row: usize, sin: f32) -> f32 {
        let (width, height) = (self.image.width(), self.image.height());
        let chance = chance(&self.rows, row) * chance(&self.cells[row * width..][..width], column);
        // sin θ varies within a row: the solid angle element is sin θ dθ dφ.
        chance * (width * height) as f32 / (TAU * PI * sin.max(1e-6))
    }
}
