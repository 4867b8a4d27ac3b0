//! The random numbers of a sample.

use quadpixel::sampling::{hash, uniform};

use crate::config::Draw;

/// What a drawn number is for; part of its key.
#[derive(Clone, Copy)]
#[repr(u64)]
pub(super) enum Purpose {
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
    PictureFocus,
    LeftOverRight,
}

/// Numbers of one sample.
#[derive(Clone, Copy)]
pub(super) struct Dice {
    pub(super) seed: u64,
    pub(super) index: u64,
}

impl Dice {
    pub(super) fn draw(&self, draw: &Draw, purpose: Purpose, card: u64) -> f64 {
        draw.at(self.seed, &[self.index, purpose as u64, card])
    }
    /// 0 where there is nothing to draw.
    pub(super) fn draw_or_0(&self, draw: &Option<Draw>, purpose: Purpose) -> f64 {
        draw.map_or(0.0, |draw| self.draw(&draw, purpose, 0))
    }
    pub(super) fn unit(&self, purpose: Purpose, card: u64) -> f64 {
        uniform(self.seed, &[self.index, purpose as u64, card])
    }
    pub(super) fn key(&self, purpose: Purpose, card: u64) -> u64 {
        // 53 bits: survives a round trip through TOML and JSON readers that hold numbers as f64.
        hash(self.seed, &[self.index, purpose as u64, card]) >> 11
    }
    pub(super) fn choice<'a, T>(&self, list: &'a [T], purpose: Purpose, card: u64) -> &'a T {
        &list[((self.unit(purpose, card) * list.len() as f64) as usize).min(list.len() - 1)]
    }
}
