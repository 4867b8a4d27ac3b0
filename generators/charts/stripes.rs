//! Charts of edges: slanted edge (ISO 12233), Siemens star and checkerboard.

use super::error::{ChartError, side, tones, within};
use super::keyed::Key;
use super::paint::{edge_coverage, square_wave};
use quadpixel::scene::texture::Texture;
use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// Parameters of the `slanted-edge` chart: a straight edge through the middle, dark on the left, for the e-SFR of
/// ISO 12233.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SlantedEdge {
    /// Turn of the edge from the vertical, degrees, −180..=180, positive: its lower end goes to the left; default 5.
    pub angle_deg: f64,
    /// Reflectance of the dark side, 0..=1; default 0.05.
    pub dark: f64,
    /// Reflectance of the light side, 0..=1; default 0.8.
    pub light: f64,
}

impl Default for SlantedEdge {
    fn default() -> Self {
        Self {
            angle_deg: 5.0,
            dark: 0.05,
            light: 0.8,
        }
    }
}

impl SlantedEdge {
    pub(super) fn random(key: Key) -> Self {
        let [dark, light] = random_tones(key);
        Self {
            angle_deg: key.range(2, -180.0, 180.0),
            dark,
            light,
        }
    }

    pub(super) fn draw(&self, size_px: usize) -> Result<Texture, ChartError> {
        tones("slanted-edge", self.dark, self.light)?;
        within("slanted-edge", "angle_deg", self.angle_deg, -180.0, 180.0)?;
        side(size_px)?;
        let (sin, cos) = self.angle_deg.to_radians().sin_cos();
        let normal = [cos as f32, sin as f32];
        let middle = 0.5 * size_px as f64;
        Ok(Texture::from_fn(size_px, size_px, |x, y| {
            // f64: the distance must be good to far below a texel across the largest raster.
            let d = (x as f64 + 0.5 - middle) * cos + (y as f64 + 0.5 - middle) * sin;
            [tone(self.dark, self.light, edge_coverage(d as f32, normal))]
        })?)
    }
}

/// Parameters of the `siemens-star` chart: a disk of equal dark and light sectors, grey where they are finer than the
/// raster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SiemensStar {
    /// Dark sectors, 2..=720; default 72.
    pub spokes: u32,
    /// Radius of the disk as a share of the side, 0.05..=0.75; default 0.47.
    pub radius: f64,
    /// Turn of the star, degrees, −360..=360; default 0 (a light sector points to the right).
    pub rotation_deg: f64,
    /// Reflectance of the dark sectors, 0..=1; default 0.05.
    pub dark: f64,
    /// Reflectance of the light sectors and the ground, 0..=1; default 0.8.
    pub light: f64,
}

impl Default for SiemensStar {
    fn default() -> Self {
        Self {
            spokes: 72,
            radius: 0.47,
            rotation_deg: 0.0,
            dark: 0.05,
            light: 0.8,
        }
    }
}

impl SiemensStar {
    pub(super) fn random(key: Key) -> Self {
        let [dark, light] = random_tones(key);
        Self {
            spokes: key.whole(2, 8, 180),
            radius: key.range(3, 0.35, 0.7),
            rotation_deg: key.range(4, 0.0, 360.0),
            dark,
            light,
        }
    }

    pub(super) fn draw(&self, size_px: usize) -> Result<Texture, ChartError> {
        const NAME: &str = "siemens-star";
        tones(NAME, self.dark, self.light)?;
        within(NAME, "spokes", self.spokes.into(), 2.0, 720.0)?;
        within(NAME, "radius", self.radius, 0.05, 0.75)?;
        within(NAME, "rotation_deg", self.rotation_deg, -360.0, 360.0)?;
        side(size_px)?;
        let middle = 0.5 * size_px as f32;
        let radius = (self.radius * size_px as f64) as f32;
        let cycles_per_rad = (f64::from(self.spokes) / TAU) as f32;
        let turn = self.rotation_deg.to_radians() as f32;
        Ok(Texture::from_fn(size_px, size_px, |x, y| {
            let (dx, dy) = (x as f32 + 0.5 - middle, y as f32 + 0.5 - middle);
            let r = dx.hypot(dy).max(1e-3);
            if r > radius + 1.0 {
                return [self.light as f32];
            }
            let out = [dx / r, dy / r];
            let phase = (dy.atan2(dx) - turn) * cycles_per_rad;
            let light = square_wave(phase, cycles_per_rad / r, [-out[1], out[0]]);
            let inside = edge_coverage(radius - r, out);
            [tone(self.dark, self.light, 1.0 - inside * (1.0 - light))]
        })?)
    }
}

/// Parameters of the `checkerboard` chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Checkerboard {
    /// Squares along a side, 1..=4096; default 16. A light one lies in the upper left corner when there is no slant.
    pub squares: f64,
    /// Turn of the board about its middle, degrees, −90..=90; default 0.
    pub slant_deg: f64,
    /// Reflectance of the dark squares, 0..=1; default 0.05.
    pub dark: f64,
    /// Reflectance of the light squares, 0..=1; default 0.8.
    pub light: f64,
}

impl Default for Checkerboard {
    fn default() -> Self {
        Self {
            squares: 16.0,
            slant_deg: 0.0,
            dark: 0.05,
            light: 0.8,
        }
    }
}

impl Checkerboard {
    pub(super) fn random(key: Key) -> Self {
        let [dark, light] = random_tones(key);
        Self {
            squares: key.range(2, 6.0, 64.0),
            slant_deg: key.range(3, -45.0, 45.0),
            dark,
            light,
        }
    }

    pub(super) fn draw(&self, size_px: usize) -> Result<Texture, ChartError> {
        const NAME: &str = "checkerboard";
        tones(NAME, self.dark, self.light)?;
        within(NAME, "squares", self.squares, 1.0, 4096.0)?;
        within(NAME, "slant_deg", self.slant_deg, -90.0, 90.0)?;
        side(size_px)?;
        let (sin, cos) = self.slant_deg.to_radians().sin_cos();
        let cycles_per_texel = 0.5 * self.squares / size_px as f64;
        let middle = 0.5 * size_px as f64;
        // The middle of the board is `squares`/2 squares from its corner, where a light square begins a quarter cycle
        // before the crest of the wave.
        let start = 0.25 * self.squares - 0.25;
        let (n, m) = ([cos as f32, sin as f32], [-sin as f32, cos as f32]);
        let frequency = cycles_per_texel as f32;
        Ok(Texture::from_fn(size_px, size_px, |x, y| {
            let (dx, dy) = (x as f64 + 0.5 - middle, y as f64 + 0.5 - middle);
            let u = (dx * cos + dy * sin) * cycles_per_texel + start;
            let v = (dy * cos - dx * sin) * cycles_per_texel + start;
            let u = 2.0 * square_wave((u - u.round()) as f32, frequency, n) - 1.0;
            let v = 2.0 * square_wave((v - v.round()) as f32, frequency, m) - 1.0;
            [tone(self.dark, self.light, 0.5 + 0.5 * u * v)]
        })?)
    }
}

/// Reflectance between dark (0) and light (1).
fn tone(dark: f64, light: f64, share: f32) -> f32 {
    let (dark, light) = (dark as f32, light as f32);
    (dark + (light - dark) * share).clamp(dark, light)
}

/// A dark and a light reflectance at least 0.2 apart (numbers 0 and 1 of `key`).
pub(super) fn random_tones(key: Key) -> [f64; 2] {
    let dark = key.range(0, 0.02, 0.4);
    [dark, key.range(1, dark + 0.2, 0.95)]
}
