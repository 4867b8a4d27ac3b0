//! Draws a sample's sensor electronics.

use quadpixel::sensor::Subpixels;
use quadpixel::sensor::readout::{ReadoutSettings, Stream};

use super::dice::{Dice, Purpose};
use crate::config::ReadoutConfig;

/// Gains stay within this many standard deviations.
const FARTHEST: f64 = 5.0;

pub(super) fn readout(
    config: &ReadoutConfig,
    dice: &Dice,
    shot: &Dice,
    pitch_um: f64,
    subpixels: Subpixels,
) -> ReadoutSettings {
    // One sensor for all samples is that of sample 0.
    let sensor = Dice {
        index: if config.same_sensor { 0 } else { dice.index },
        ..*dice
    };
    let count = subpixels.count();
    let mismatch = sensor.draw(&config.gain_mismatch, Purpose::GainMismatch, 0);
    let gain = |subpixel: usize| {
        let mut random = Stream::new(sensor.key(Purpose::SubpixelGain, subpixel as u64), &[]);
        1.0 + mismatch * random.normal().clamp(-FARTHEST, FARTHEST)
    };
    let area_um2 = pitch_um * pitch_um / count as f64;
    let mut settings = ReadoutSettings {
        photons_um2: dice.draw(&config.photons_um2, Purpose::Photons, 0),
        exposure_s: dice.draw(&config.exposure_s, Purpose::ExposureTime, 0),
        dark_current_e_s: dice.draw(&config.dark_current_e_s, Purpose::DarkCurrent, 0),
        full_well_e: area_um2 * sensor.draw(&config.full_well_e_um2, Purpose::FullWell, 0),
        prnu: sensor.draw(&config.prnu, Purpose::Prnu, 0),
        read_noise_e: dice.draw(&config.read_noise_e, Purpose::ReadNoise, 0),
        gain_dn_per_e: (config.gain_dn_per_e.as_ref()).map(|g| dice.draw(g, Purpose::Gain, 0)),
        black_level: config.black_level,
        bits: config.bits,
        subpixel_gains: (0..count).map(gain).collect(),
        sensor_seed: sensor.key(Purpose::Sensor, 0),
        shot_seed: shot.key(Purpose::Shot, 0),
    };
    let left_over_right = sensor.draw(&config.left_over_right, Purpose::LeftOverRight, 0);
    settings.weigh_halves(left_over_right, subpixels.m());
    settings
}
