//! A sample of a large picture with depth: converted and written some rows at a time, so that memory does not grow with
//! all that a sample holds of each pixel.

use std::ops::Range;
use std::time::Instant;

use quadpixel::image::ImageError;
use quadpixel::memory;
use quadpixel::rgbd::{DepthPicture, RgbdError, Spread};

use super::exposure::Exposure;
use super::picture::{Begun, shown};
use super::prepared::{Prepared, Rays, SampleError};
use super::rendered::{Made, raw_encoding};
use crate::observer::{Event, Observer};
use crate::recipe::SampleId;
use crate::rgbd::Level;
use crate::writer::{Kind, Place, SampleWriter, WriteError};

/// Pixels of a picture above which it is converted by rows.
const LARGE_PX: usize = 1 << 20;
/// Pixels that are converted together, about.
const PART_PX: usize = 1 << 18;
/// Rows that are converted together are a multiple of this: tiles, blocks of files and colour patterns are whole.
const ROWS: usize = 64;

/// A sample of a large picture, whose rows are converted as they are written.
pub struct ByRows {
    exposure: Exposure,
    picture: DepthPicture,
    spread: Spread,
    /// Rows that are converted together.
    at_once: usize,
    /// Rays that were told of.
    told: u64,
}

impl Prepared {
    /// Whether it is of a picture with depth so large that [`Self::by_rows`] saves memory.
    pub fn is_large(&self) -> bool {
        let by_kernels = (self.recipe.rgbd.as_ref()).is_some_and(|rgbd| rgbd.level == Level::Psf);
        let sensor = self.camera.sensor();
        by_kernels && sensor.width() * sensor.height() > LARGE_PX
    }

    /// The sample of its picture, to be written row by row.
    ///
    /// # Errors
    /// As of [`Self::render`].
    pub fn by_rows(self, id: SampleId) -> Result<ByRows, SampleError> {
        let at_once = (PART_PX / self.camera.sensor().width()).max(1);
        self.by_so_many_rows(id, at_once.next_multiple_of(ROWS))
    }

    fn by_so_many_rows(self, id: SampleId, at_once: usize) -> Result<ByRows, SampleError> {
        let mut begun = Begun::new(self, &Rays::Trace)?;
        let began = Instant::now();
        let spread = begun.conversion().spread();
        let spread = spread.map_err(|cause| begun.refused(cause))?;
        let enough = memory::check("rows of a converted picture", spread.bytes(at_once));
        enough.map_err(|cause| begun.refused(RgbdError::from(cause)))?;
        begun.prepared.stages.rays_s += began.elapsed().as_secs_f64();
        let (exposure, picture) = begun.exposure(id, spread.rays())?;
        Ok(ByRows {
            exposure,
            picture,
            spread,
            at_once,
            told: 0,
        })
    }
}

impl ByRows {
    /// Converts and writes it. What was made.
    ///
    /// # Errors
    /// As of [`SampleWriter`].
    pub fn write(mut self, place: Place<'_>, observer: &dyn Observer) -> Result<Made, WriteError> {
        match self.try_write(place, false, observer) {
            Err(WriteError::Image(ImageError::HalfOverflow { .. })) => {
                self.exposure.begin_again();
                self.try_write(place, true, observer)?;
            }
            done => done?,
        }
        Ok(self.exposure.made())
    }

    fn try_write(
        &mut self,
        place: Place<'_>,
        bright: bool,
        observer: &dyn Observer,
    ) -> Result<(), WriteError> {
        let camera = &self.exposure.prepared.camera;
        let kind = Kind {
            raw: raw_encoding(self.exposure.raw_white),
            channels_differ: self.exposure.known.fields.len() == 3,
            world: false,
            bright,
        };
        let height = camera.sensor().height();
        let mut writer = SampleWriter::new(place, kind, &self.exposure.description)?;
        for first in (0..height).step_by(self.at_once) {
            let rows = first..(first + self.at_once).min(height);
            self.rows(rows.clone(), &mut writer)?;
            self.tell(rows.end as f64 / height as f64, observer);
        }
        let began = Instant::now();
        self.exposure.count();
        writer.finish(self.exposure.description.clone())?;
        self.exposure.prepared.stages.writing_s += began.elapsed().as_secs_f64();
        Ok(())
    }

    /// Tells that a part of all rows is done: never less than before.
    fn tell(&mut self, part: f64, observer: &dyn Observer) {
        let done = (self.exposure.prepared.recipe.rays() as f64 * part) as u64;
        observer.event(Event::Rays(done.saturating_sub(self.told)));
        self.told = self.told.max(done);
    }

    fn rows(&mut self, rows: Range<usize>, writer: &mut SampleWriter) -> Result<(), WriteError> {
        let exposure = &mut self.exposure;
        let mut began = Instant::now();
        let mut lap = || {
            std::mem::replace(&mut began, Instant::now())
                .elapsed()
                .as_secs_f64()
        };
        let converted = self.spread.rows(rows.clone());
        exposure.prepared.stages.rays_s += lap();
        let shown = shown(exposure, &self.picture, converted, Some(rows));
        let pictures = exposure.pictures(shown);
        exposure.prepared.stages.truth_s += lap();
        writer.rows(&pictures.files(&exposure.description))?;
        exposure.prepared.stages.writing_s += lap();
        Ok(())
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use std::collections::BTreeMap;
    use std::path::Path;

    use quadpixel::image::Image;

    use super::*;
    use crate::assemble::Responses;
    use crate::recipe::parse_recipe;
    use crate::rgbd::{Meaning, RgbdRecipe, Stored};
    use crate::sample::prepare_picture;
    use crate::writer::write_alone;

    const SIZE: [usize; 2] = [72, 150];

    /// A picture whose light is up to `white`, before a camera with all files that a sample can have.
    fn prepared(white: f32) -> Prepared {
        prepared_with(white, &mut Responses::new())
    }

    fn prepared_with(white: f32, responses: &mut Responses) -> Prepared {
        let text = format!(
            r#"
            environment = [0, 0, 0]
            planes = []
            lens = {{ name = "wide_US20120327520A1_emb3", focus_mm = 750 }}
            sensor = {{ pitch_um = 2.8, subpixels = "2x2", width = {}, height = {}, mosaic = "rggb",
                       window = {{ at = "position", x_mm = 0.4, y_mm = 0.2 }} }}
            response = {{ model = "geometric" }}
            render = {{ rays_per_pixel = 16, seed = 3 }}
            readout = {{ photons_um2 = 300 }}
            camera_pictures = {{ noisy = true }}
            "#,
            SIZE[0], SIZE[1]
        );
        let mut recipe = parse_recipe(&text, "a picture").unwrap();
        let pixel = |i: usize| ((i * 7919) % 251) as f32 / 250.0;
        let light = (0..3 * SIZE[0] * SIZE[1]).map(|i| white * pixel(i));
        let depth = (0..SIZE[0] * SIZE[1]).map(|i| match (i % SIZE[0], i / SIZE[0]) {
            (20..40, 30..110) => 0.45,
            (60..64, 70..75) => f32::NAN,
            (_, y) => 0.9 + 0.01 * y as f32,
        });
        let stored = |data: Vec<f32>, channels| {
            let image = Image::from_vec(SIZE[0], SIZE[1], channels, data).unwrap();
            Stored::array(image, None)
        };
        let (light, depth) = (stored(light.collect(), 3), stored(depth.collect(), 1));
        let (rgbd, picture) = RgbdRecipe::of_arrays(&light, &depth, &Meaning::default()).unwrap();
        recipe.rgbd = Some(rgbd);
        prepare_picture(&recipe, picture, responses, &()).unwrap()
    }

    fn id() -> SampleId {
        SampleId {
            index: 0,
            configuration_blake3: "0".repeat(64),
        }
    }

    fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
        let entries = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap());
        let named = entries.map(|e| {
            let name = e.file_name().into_string().unwrap();
            (name, std::fs::read(e.path()).unwrap())
        });
        named.collect()
    }

    #[test]
    fn a_sample_by_rows_has_the_files_of_the_whole_one_byte_for_byte() {
        // The second needs floats for its light, which is found out on the way.
        for white in [1.0, 3e6] {
            let folder = tempfile::tempdir().unwrap();
            let (whole, by_rows) = (folder.path().join("whole"), folder.path().join("by-rows"));
            let (sample, _) = prepared(white).render(id(), Rays::Trace, &()).unwrap();
            write_alone(&whole, &sample.files()).unwrap();
            let rows = prepared(white).by_so_many_rows(id(), 64).unwrap();
            let made = rows.write(Place::Alone(&by_rows), &()).unwrap();
            assert_eq!(made.warnings, sample.made.warnings);
            let (whole, by_rows) = (files(&whole), files(&by_rows));
            assert_eq!(whole.len(), 20, "{:?}", whole.keys());
            for (name, bytes) in &whole {
                assert!(by_rows.get(name) == Some(bytes), "{white}: {name}");
            }
            assert_eq!(whole.len(), by_rows.len());
        }
    }
    #[test]
    fn a_second_picture_through_the_same_camera_is_as_through_a_new_one() {
        let folder = tempfile::tempdir().unwrap();
        let written = |prepared: Prepared, name: &str| {
            let (sample, _) = prepared.render(id(), Rays::Trace, &()).unwrap();
            write_alone(&folder.path().join(name), &sample.files()).unwrap();
            files(&folder.path().join(name))
        };
        let mut shared = Responses::new();
        written(prepared_with(1.0, &mut shared), "first");
        let second = written(prepared_with(0.5, &mut shared), "second");
        assert_eq!(second, written(prepared(0.5), "alone"));
    }
}
