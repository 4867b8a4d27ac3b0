//! The noisy capture of a sample, beside the clean one.

use quadpixel::image::Image;
use quadpixel::range::OutOfRange;
use quadpixel::render::Camera;
use quadpixel::render::truth::WhiteField;
use quadpixel::sensor::readout::{Readout, ReadoutSettings};
use quadpixel_datasets as spec;

use crate::writer::NoisyFiles;

/// A sensor's electronics, and the exposure.
pub(super) struct Capture {
    readout: Readout,
    /// What `meta.json` says, but for what was saturated.
    description: spec::Readout,
    /// The linear value a sr of absorbed white light.
    gain: f64,
}

/// A noisy capture, or rows of one, and the truth of its shading.
pub(super) struct Noisy {
    codes: Image,
    linear: Image,
    shading: Vec<Image>,
    /// Values that are saturated.
    pub saturated: u64,
}

impl Capture {
    /// `gain` is the linear value a sr of absorbed white light.
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn new(
        settings: &ReadoutSettings,
        camera: &Camera,
        white: &WhiteField,
        gain: f64,
    ) -> Result<Self, OutOfRange> {
        let sensor = camera.sensor();
        let quantum_efficiency = white.quantum_efficiency();
        let electrons_at_white = settings.electrons_at_white(sensor.pitch_um(), quantum_efficiency);
        let readout = Readout::new(
            settings,
            sensor.subpixels(),
            electrons_at_white,
            white.largest_share(),
        )?;
        let description = spec::Readout {
            photons_um2: settings.photons_um2,
            quantum_efficiency,
            electrons_at_white,
            exposure_s: settings.exposure_s,
            dark_e: readout.dark_e(),
            full_well_e: settings.full_well_e,
            prnu: settings.prnu,
            read_noise_e: settings.read_noise_e,
            gain_dn_per_e: readout.gain_dn_per_e(),
            black_level: settings.black_level,
            bits: settings.bits,
            subpixel_gains: settings.subpixel_gains.clone(),
            sensor_seed: settings.sensor_seed,
            shot_seed: settings.shot_seed,
            saturated: 0,
        };
        Ok(Self {
            readout,
            description,
            gain,
        })
    }

    /// Exposes the clean mosaic of a camera's rows.
    pub fn expose(&self, mosaic: &Image, camera: &Camera, white: &WhiteField) -> Noisy {
        let sensor = camera.sensor();
        let first_row = sensor.first_row() * sensor.subpixels().n();
        let exposed = self.readout.expose_rows(mosaic, first_row);
        let mut shading = white.of_subpixels_sr(sensor);
        for value in shading.iter_mut().flat_map(|image| image.data_mut()) {
            *value *= self.gain as f32;
        }
        Noisy {
            linear: self.readout.linear(&exposed.codes),
            codes: exposed.codes,
            saturated: exposed.saturated,
            shading,
        }
    }

    /// What `meta.json` says of a capture of which so many values are saturated.
    pub fn description(&self, saturated: u64) -> spec::Readout {
        spec::Readout {
            saturated,
            ..self.description.clone()
        }
    }
}

impl Noisy {
    /// What the writer takes.
    pub fn files(&self) -> NoisyFiles<'_> {
        NoisyFiles {
            codes: &self.codes,
            linear: &self.linear,
            shading: &self.shading,
        }
    }
}
