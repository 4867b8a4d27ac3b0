//! A camera file as it is read, with its lens settled, and as a dataset or a recipe takes it.

use std::path::Path;

use quadpixel::em::Level;
use quadpixel::file;
use quadpixel::lens::{Lens, LensError, Prescription};
use quadpixel::sensor::ShiftRule;
use quadpixel::spectrum::ChannelWavelengths;

use super::{CameraFile, CameraFileError, LensPart};
use crate::config::{DatasetConfig, Draw, ResponseConfig, TableConfig};
use crate::recipe::table_choice::TableChoice;
use crate::recipe::{Recipe, ResponseSource, TableRecipe};

/// Lens shifts per pitch of the table of the pixel.
const SHIFTS: usize = 12;
/// Built-in lenses that stand in where the file names none: fast ones, of phones up to this focal length, mm, and of
/// larger cameras.
const PHONE: &str = "wide_US11940605B2_emb9";
const LONGEST_OF_PHONES_MM: f64 = 15.0;
const LARGER: &str = "lib_50mm_US20210263286_ex1";

/// A camera file, checked, with what it asks of a lens settled.
#[derive(Clone, Debug)]
pub struct FittedCamera {
    camera: CameraFile,
    /// As it was named: the pixel is read from there.
    path: String,
    lens: String,
    /// `None` where the lens does not open as far.
    f_number: Option<f64>,
    /// What is not as the file asks.
    pub warnings: Vec<String>,
}

impl FittedCamera {
    /// Reads a camera file.
    ///
    /// # Errors
    /// A file that cannot be read or is no camera's, numbers that cannot be, a lens that does not load.
    pub fn read(path: &Path) -> Result<Self, CameraFileError> {
        let file = path.display().to_string();
        let text = file::read_text(path)?;
        let camera: CameraFile = toml::from_str(&text).map_err(|cause| CameraFileError::Toml {
            file: file.clone(),
            cause: Box::new(cause),
        })?;
        let value = |cause| CameraFileError::Value {
            file: file.clone(),
            cause,
        };
        camera.check().map_err(value)?;
        (camera.pixel.check()).map_err(|cause| CameraFileError::Pixel {
            file: file.clone(),
            cause,
        })?;
        let lens = match &camera.lens.file {
            Some(name) => beside(path, name),
            None if camera.lens.focal_length_mm <= LONGEST_OF_PHONES_MM => PHONE.to_owned(),
            None => LARGER.to_owned(),
        };
        let refused = |cause| CameraFileError::Lens {
            file: file.clone(),
            cause,
        };
        let open = opens_to(&lens).map_err(refused)?;
        let mut warnings = Vec::new();
        let LensPart {
            focal_length_mm,
            f_number,
            file: named,
        } = &camera.lens;
        if named.is_none() {
            warnings.push(format!(
                "{file}: names no lens; {lens}, scaled to {focal_length_mm} mm, stands in: disparity and blur are its, not the camera's own"
            ));
        }
        // A lens opened to what its maker's figure was rounded from.
        if *f_number < open - 0.005 {
            warnings.push(format!(
                "{file}: F/{f_number:.2} is asked for; {lens} opens to F/{open:.2}, which is taken"
            ));
        }
        Ok(Self {
            f_number: Some(*f_number).filter(|f| *f >= open),
            path: file,
            camera,
            lens,
            warnings,
        })
    }

    /// The file.
    pub fn camera(&self) -> &CameraFile {
        &self.camera
    }

    /// Puts the camera in the place of a configuration's.
    pub fn put_into(&self, config: &mut DatasetConfig) {
        let lens = &mut config.lens;
        lens.names = vec![self.lens.clone()];
        (lens.from, lens.filter) = (None, None);
        lens.focal_length_mm = Some(self.camera.lens.focal_length_mm);
        lens.f_number = self.f_number.map(Draw::Fixed);
        let sensor = &mut config.sensor;
        sensor.subpixels = self.camera.pixel.subpixels;
        sensor.pitch_um = None;
        sensor.microlens_shift = ShiftRule::ChiefRay;
        sensor.microlens_law = self.camera.microlenses;
        if let Some(readout) = &mut config.readout {
            readout.left_over_right = Draw::Fixed(self.camera.left_over_right);
        }
        let given = match &config.response {
            ResponseConfig::Simulated(table) => Some((table.level, table.choice)),
            _ => None,
        };
        let (level, choice) = self.table(given);
        config.response = ResponseConfig::Simulated(TableConfig {
            level,
            pixels: vec![self.path.clone()],
            stack: None,
            choice,
            charge: self.camera.charge,
        });
    }

    /// Puts the camera in the place of a recipe's.
    pub fn put_into_recipe(&self, recipe: &mut Recipe) {
        let lens = &mut recipe.lens;
        lens.name.clone_from(&self.lens);
        lens.focal_length_mm = Some(self.camera.lens.focal_length_mm);
        lens.f_number = self.f_number;
        (lens.misalignments, lens.deviations) = (Vec::new(), Vec::new());
        let sensor = &mut recipe.sensor;
        sensor.subpixels = self.camera.pixel.subpixels;
        sensor.pitch_um = self.camera.pixel.pitch_um;
        sensor.microlens_shift = ShiftRule::ChiefRay;
        sensor.microlens_law = self.camera.microlenses;
        if let Some(readout) = &mut recipe.readout {
            // Gains of other sub-pixels say nothing of these.
            let count = sensor.subpixels.count();
            if readout.subpixel_gains.len() != count {
                readout.subpixel_gains = vec![1.0; count];
            }
            readout.weigh_halves(self.camera.left_over_right, sensor.subpixels.m());
        }
        let given = recipe.response.table().map(|t| (t.level, t.choice));
        let (level, choice) = self.table(given);
        recipe.response = ResponseSource::Simulated(TableRecipe {
            choice,
            charge: self.camera.charge,
            ..TableRecipe::new(level, self.path.clone())
        });
    }

    /// Model and table: as they were, but of all lens shifts.
    fn table(&self, given: Option<(Level, TableChoice)>) -> (Level, TableChoice) {
        let (level, choice) = given.unwrap_or_default();
        let shifts = choice.shifts.or(Some(SHIFTS));
        (level, TableChoice { shifts, ..choice })
    }
}

/// A built-in lens by its name, or a file beside the camera file.
fn beside(camera: &Path, name: &str) -> String {
    let is_file = [".json", ".zmx", ".seq"]
        .iter()
        .any(|end| name.ends_with(end));
    match camera.parent() {
        Some(folder) if is_file => folder.join(name).display().to_string(),
        _ => name.to_owned(),
    }
}

/// The F-number of a lens that is wide open.
fn opens_to(name: &str) -> Result<f64, LensError> {
    let lens = Lens::new(&Prescription::named(name)?)?;
    let wavelength = ChannelWavelengths::default().reference_nm();
    Ok(lens.paraxial(wavelength)?.f_number)
}
