//! The noisy capture of a sample, beside the clean one.

use quadpixel::image::Image;
use quadpixel::range::OutOfRange;
use quadpixel::render::truth::WhiteField;
use quadpixel::render::{Camera, SubPixelImage};
use quadpixel::sensor::readout::{Readout, ReadoutSettings};
use quadpixel_datasets as spec;

use crate::writer::NoisyFiles;

/// A noisy capture and the truth of its shading.
pub(crate) struct Noisy {
    codes: Image,
    linear: Image,
    shading: Vec<Image>,
    description: spec::Readout,
}

impl Noisy {
    /// Exposes a clean mosaic. `gain` is the linear value a sr of absorbed white light.
    ///
    /// # Errors
    /// A setting out of its range.
    pub(crate) fn expose(
        settings: &ReadoutSettings,
        mosaic: &SubPixelImage,
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
        let exposed = readout.expose(&mosaic.mosaic);
        let mut shading = white.of_subpixels_sr(sensor);
        for value in shading.iter_mut().flat_map(|image| image.data_mut()) {
            *value *= gain as f32;
        }
        Ok(Self {
            linear: readout.linear(&exposed.codes),
            shading,
            description: spec::Readout {
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
                saturated: exposed.saturated,
            },
            codes: exposed.codes,
        })
    }

    /// What `meta.json` says of it.
    pub(crate) fn description(&self) -> spec::Readout {
        self.description.clone()
    }

    /// What the writer takes.
    pub(crate) fn files(&self) -> NoisyFiles<'_> {
        NoisyFiles {
            codes: &self.codes,
            linear: &self.linear,
            shading: &self.shading,
        }
    }
}
