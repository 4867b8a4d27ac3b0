//! The random numbers of a sample.

use quadpixel::sampling::{hash, uniform};

use crate::config::Draw;

/// What a drawn number is for; part of its key.
#[derive(Clone, Copy)]
#[repr(u64)]
pub(super) enum For {
    Lens = 1,
    Focus,
    FNumber,
    Pixel,
    WindowHeight,
    WindowAzimuth,
    Background,
    TiltX,
    TiltY,
    Cards,
    CardDepth,
    CardSize,
    CardX,
    CardY,
    CardRoll,
    CardChart,
    Chart,
    Mask,
    Exposure,
    Render,
    Pitch,
    Photons,
    ExposureTime,
    DarkCurrent,
    FullWell,
    Prnu,
    ReadNoise,
    Gain,
    GainMismatch,
    SubpixelGain,
    Sensor,
    Shot,
    DecentreX,
    DecentreY,
    Despace,
    Tip,
    Tilt,
    Radius,
    Index,
    FocusError,
    MicrolensX,
    MicrolensY,
    StackVariant,
    StackScale,
    Near,
    Far,
    Objects,
    Thin,
    Clear,
    Glints,
    Difficulty,
    World,
    Camera,
    Distance,
    Size,
    Yaw,
    Elevation,
    Panorama,
    Sky,
}

/// Numbers of one sample.
#[derive(Clone, Copy)]
pub(super) struct Dice {
    pub(super) seed: u64,
    pub(super) index: u64,
}

impl Dice {
    pub(super) fn of(&self, draw: &Draw, what: For, card: u64) -> f64 {
        draw.at(self.seed, &[self.index, what as u64, card])
    }
    pub(super) fn unit(&self, what: For, card: u64) -> f64 {
        uniform(self.seed, &[self.index, what as u64, card])
    }
    pub(super) fn key(&self, what: For, card: u64) -> u64 {
        // 53 bits: survives a round trip through TOML and JSON readers that hold numbers as f64.
        hash(self.seed, &[self.index, what as u64, card]) >> 11
    }
    pub(super) fn choice<'a, T>(&self, of: &'a [T], what: For, card: u64) -> &'a T {
        &of[((self.unit(what, card) * of.len() as f64) as usize).min(of.len() - 1)]
    }
}
