//! A camera file: what `qpgen fit` found of a real camera, as TOML, and how a dataset or a recipe takes it.
//!
//! ```text
//! camera.toml ─┬ lens: a prescription or a stand-in, scaled to the focal length, stopped to the F-number
//!              ├ pixel: layers ─▶ table of all lens shifts
//!              ├ charge: diffusion, crosstalk ─▶ added by the table's lookup
//!              ├ left_over_right ─▶ gains of the read-out, where there is one
//!              └ microlenses: where they stand beside the place that parts the light of the chief ray's cone equally
//! ```
//! What the file says replaces lens, sub-pixels, pitch, microlenses and response; all else stays.

use std::path::Path;

use quadpixel::em::{Level, PixelStack, StackError};
use quadpixel::file::{self, FileError};
use quadpixel::lens::{Lens, LensError, Prescription};
use quadpixel::range::OutOfRange;
use quadpixel::sensor::{Charge, MicrolensLaw, ShiftRule};
use quadpixel::spectrum::ChannelWavelengths;
use serde::{Deserialize, Serialize};

use crate::config::{DatasetConfig, Draw, ResponseConfig, TableConfig};
use crate::recipe::check::F_NUMBERS;
use crate::recipe::table_choice::TableChoice;
use crate::recipe::{Recipe, ResponseSource, TableRecipe};

/// Lens shifts per pitch of the table of the pixel.
const SHIFTS: usize = 12;
/// Built-in lenses that stand in where the file names none: fast ones, of phones up to this focal length, mm, and of
/// larger cameras.
const PHONE: &str = "wide_US11940605B2_emb9";
const LONGEST_OF_PHONES_MM: f64 = 15.0;
const LARGER: &str = "lib_50mm_US20210263286_ex1";

/// The whole of `camera.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraFile {
    /// For people.
    pub name: String,
    /// The main lens.
    pub lens: LensPart,
    /// What charge does in the silicon.
    #[serde(default)]
    pub charge: Charge,
    /// What the left half of a pixel's columns gives over the right half of the same light, 0.5 to 2.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub left_over_right: f64,
    /// Where microlenses stand beside the place at which the sub-pixels share the light equally.
    #[serde(default)]
    pub microlenses: MicrolensLaw,
    /// The layers.
    pub pixel: PixelStack,
    /// What was fitted, with deviations: for people.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<FittedParameter>,
}

fn one() -> f64 {
    1.0
}

fn is_one(value: &f64) -> bool {
    *value == 1.0
}

/// The main lens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LensPart {
    /// A name of `qpgen lens list`, or a .json, .zmx or .seq file beside the camera file; absent: a built-in lens
    /// stands in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// The lens is scaled to this focal length, mm.
    pub focal_length_mm: f64,
    /// And stopped down to this F-number, where it opens as far.
    pub f_number: f64,
}

/// One parameter after a fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittedParameter {
    /// Its name, with its unit.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation, the priors included.
    pub sigma: f64,
    /// Value and deviation before.
    pub prior: [f64; 2],
    /// Whether the data hold it; if not, it is where its prior was.
    pub held_by_data: bool,
    /// Whether it lies at a bound, where its deviation says little.
    pub at_bound: bool,
}

/// Why a camera file is not taken.
#[non_exhaustive]
#[derive(Debug, thiserror::Error)]
pub enum CameraFileError {
    /// It cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// It is no such TOML.
    #[error("{file}: {cause}")]
    Toml {
        /// The file.
        file: String,
        /// What is wrong, and where.
        cause: Box<toml::de::Error>,
    },
    /// A number of it.
    #[error("{file}: {cause}")]
    Value {
        /// The file.
        file: String,
        /// Which number, and what is allowed.
        cause: OutOfRange,
    },
    /// Its pixel.
    #[error("{file}: {cause}")]
    Pixel {
        /// The file.
        file: String,
        /// What is wrong with it.
        cause: StackError,
    },
    /// Its lens.
    #[error("{file}: {cause}")]
    Lens {
        /// The file.
        file: String,
        /// What is wrong with it.
        cause: LensError,
    },
}

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

impl CameraFile {
    fn check(&self) -> Result<(), OutOfRange> {
        self.charge.check()?;
        quadpixel::range::within("camera", "left_over_right", self.left_over_right, 0.5..=2.0)?;
        let refused = |field: &'static str, value: f64| {
            OutOfRange::new("camera", field, value, "finite and > 0")
        };
        quadpixel::range::within("camera", "lens.f_number", self.lens.f_number, F_NUMBERS)?;
        for (field, value) in [
            ("lens.focal_length_mm", self.lens.focal_length_mm),
            ("pixel.pitch_um", self.pixel.pitch_um),
        ] {
            quadpixel::range::require(value > 0.0 && value.is_finite(), || refused(field, value))?;
        }
        let (law, pitch_um) = (self.microlenses, self.pixel.pitch_um);
        for (field, value, most) in [
            ("microlenses.um", law.um, pitch_um),
            ("microlenses.um_per_mm", law.um_per_mm, 100.0),
            ("microlenses.um_per_mm3", law.um_per_mm3, 100.0),
            ("microlenses.um_per_mm5", law.um_per_mm5, 100.0),
            ("microlenses.axis_x_mm", law.axis_x_mm, 100.0),
            (
                "charge.diffusion_um",
                self.charge.diffusion_um,
                10.0 * pitch_um,
            ),
        ] {
            quadpixel::range::within("camera", field, value, -most..=most)?;
        }
        // With more of it than this a sub-pixel would have less of its own charge than of its neighbours'.
        let count = self.pixel.subpixels.count() as f64;
        let most = (count - 1.0) / count;
        quadpixel::range::within(
            "camera",
            "charge.crosstalk",
            self.charge.crosstalk,
            0.0..=most,
        )
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

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use quadpixel::sensor::CollectedAt;

    use super::*;
    use crate::assemble;
    use crate::config::{DEFAULT_TOML, ReadoutConfig};
    use crate::draw;

    fn camera(folder: &Path) -> CameraFile {
        let pixel = PixelStack {
            subpixels: quadpixel::sensor::Subpixels::DUAL_X,
            ..PixelStack::builtin("1.6um").unwrap()
        };
        let camera = CameraFile {
            name: "a phone".into(),
            lens: LensPart {
                file: None,
                focal_length_mm: 4.4,
                f_number: 2.2,
            },
            charge: Charge {
                diffusion_um: 0.2,
                crosstalk: 0.1,
                collected_at: CollectedAt::LitSide,
            },
            left_over_right: 1.2,
            microlenses: MicrolensLaw {
                um: 0.1,
                um_per_mm: -0.05,
                ..MicrolensLaw::default()
            },
            pixel,
            parameters: Vec::new(),
        };
        std::fs::write(
            folder.join("camera.toml"),
            toml::to_string(&camera).unwrap(),
        )
        .unwrap();
        camera
    }

    #[test]
    fn a_dataset_has_the_lens_the_microlenses_and_the_charge_of_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = camera(folder.path());
        let path = folder.path().join("camera.toml");
        let fitted = FittedCamera::read(&path).unwrap();
        assert_eq!(fitted.camera(), &file);
        assert_eq!(fitted.warnings.len(), 1, "{:?}", fitted.warnings);
        let mut config = DatasetConfig::from_toml(DEFAULT_TOML, "t").unwrap();
        config.readout = Some(ReadoutConfig {
            gain_mismatch: Draw::Fixed(0.0),
            ..ReadoutConfig::default()
        });
        fitted.put_into(&mut config);
        config.check().unwrap();
        // As it is kept beside a dataset, and read again.
        let kept = toml::to_string(&config).unwrap();
        assert_eq!(DatasetConfig::from_toml(&kept, "t").unwrap(), config);
        let pitch = |name: &str| Ok(assemble::pixel(name)?.pitch_um);
        let recipe = draw::recipe(&config, 0, &pitch).unwrap();
        assert_eq!(recipe.sensor.pitch_um, 1.6);
        let lens = assemble::lens(&recipe.lens).unwrap();
        let p = lens.paraxial(550.0).unwrap();
        assert!(
            (p.efl_mm - 4.4).abs() < 1e-6 && (p.f_number - 2.2).abs() < 1e-3,
            "{p:?}"
        );
        let gains = |recipe: &Recipe| recipe.readout.as_ref().unwrap().subpixel_gains.clone();
        let [left, right] = gains(&recipe)[..] else {
            panic!("{:?}", gains(&recipe))
        };
        assert!((left / right - 1.2).abs() < 1e-12 && (left + right - 2.0).abs() < 1e-12);
        // Another recipe takes the same camera.
        let mut other = recipe.clone();
        if let Some(readout) = &mut other.readout {
            readout.subpixel_gains = vec![1.1; 4];
        }
        other.lens.name = "lib_dgauss_50mm".into();
        fitted.put_into_recipe(&mut other);
        assert_eq!(
            (&other.lens.name, &other.response),
            (&recipe.lens.name, &recipe.response)
        );
        assert_eq!(other.sensor.microlens_law, file.microlenses);
        assert_eq!(gains(&other), gains(&recipe));
    }

    #[test]
    fn a_lens_that_does_not_open_as_far_is_told_of_and_one_that_is_not_there_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut file = camera(folder.path());
        let path = folder.path().join("camera.toml");
        file.lens.f_number = 1.2;
        std::fs::write(&path, toml::to_string(&file).unwrap()).unwrap();
        let fitted = FittedCamera::read(&path).unwrap();
        assert!(fitted.f_number.is_none() && fitted.warnings.len() == 2);
        for (change, named) in [
            ("file = \"absent.zmx\"\nfocal", "absent.zmx"),
            ("focal_length = 3\nfocal", "focal_length"),
        ] {
            let text = toml::to_string(&file).unwrap();
            std::fs::write(&path, text.replacen("focal", change, 1)).unwrap();
            let why = FittedCamera::read(&path).unwrap_err().to_string();
            assert!(why.contains(named), "{why}");
        }
        file.charge.diffusion_um = -1.0;
        std::fs::write(&path, toml::to_string(&file).unwrap()).unwrap();
        let why = FittedCamera::read(&path).unwrap_err().to_string();
        assert!(why.contains("diffusion_um"), "{why}");
    }

    #[test]
    fn numbers_that_no_camera_has_are_refused_by_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("camera.toml");
        let whole = camera(folder.path());
        for (change, said) in [
            (
                (|c| c.microlenses.axis_x_mm = 1e200) as fn(&mut CameraFile),
                "microlenses.axis_x_mm",
            ),
            (|c| c.microlenses.um = 1000.0, "microlenses.um"),
            (
                |c| c.microlenses.um_per_mm5 = f64::NAN,
                "microlenses.um_per_mm5",
            ),
            (|c| c.charge.diffusion_um = 1e300, "charge.diffusion_um"),
            (|c| c.charge.crosstalk = 0.6, "charge.crosstalk"),
            (|c| c.lens.f_number = 1000.0, "lens.f_number is 1000"),
            (|c| c.pixel.pitch_um = 0.0, "pixel.pitch_um is 0"),
        ] {
            let mut bad = whole.clone();
            change(&mut bad);
            std::fs::write(&path, toml::to_string(&bad).unwrap()).unwrap();
            let refused = FittedCamera::read(&path).map(|_| ()).unwrap_err();
            assert!(refused.to_string().contains(said), "{refused}");
        }
    }
}
