//! One render, many sensors: the radiance of every ray is kept, and other pixels see the same rays.
//!
//! A ray's place on the microlens, its direction and its radiance do not depend on what the pixel below does with it:
//! neither on the number of sub-pixels, nor on their response, nor on the rule by which the microlenses are shifted.
//! Places and directions are functions of (seed, pixel, ray), so the radiance alone is kept: three f32 per ray, 1.5 kB
//! per pixel of 128 rays. An image developed from a record is the image that a new render with that pixel would give,
//! to the last bit. The lens, its focus, the wavelengths, and pitch, size and place of the window are the record's.

use std::io::{BufReader, BufWriter, Write};
use std::path::Path;

use ndarray::{Array1, ArrayView1, IxDyn};
use ndarray_npy::NpzWriter;

use super::{Camera, RenderSettings, RenderStats};
use crate::file::{self, FileError};
use crate::hash::ContentHash;
use crate::image::Image;
use crate::npz::{HASH, Npz};

/// The radiance of every ray of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct RayRecord {
    width: usize,
    height: usize,
    settings: RenderSettings,
    /// W, H, pitch (µm), centre (mm), sensor's z (mm), focus (mm), hash of the wavelengths: of the camera that it
    /// belongs to.
    geometry: Vec<f64>,
    /// [row][column][channel][ray], lost rays 0.
    radiance: Vec<f32>,
    occlusion: Option<Image>,
    stats: RenderStats,
}

/// Why a record cannot be made, read or used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// More than [`RayRecord::MAX_BYTES`].
    #[error("record of rays: takes {bytes} bytes; allowed: up to {max}, a smaller window or fewer rays", max = RayRecord::MAX_BYTES)]
    TooLarge {
        /// Its size.
        bytes: u64,
    },
    /// Rays of another camera.
    #[error(
        "record of rays: was made with {what} {record}, the camera has {camera}; allowed: the same lens, focus and window"
    )]
    OtherCamera {
        /// What differs.
        what: &'static str,
        /// In the record.
        record: f64,
        /// Of the camera.
        camera: f64,
    },
    /// The file system said no.
    #[error(transparent)]
    File(#[from] FileError),
    /// Not a file of ours.
    #[error("{path}: is no record of rays: {why}")]
    Format {
        /// The file.
        path: String,
        /// What is wrong.
        why: String,
    },
}

/// What the entries of `geometry` are.
const GEOMETRY: [&str; 9] = [
    "width_px",
    "height_px",
    "pitch_um",
    "centre x_mm",
    "centre y_mm",
    "sensor z_mm",
    "focus_mm",
    "wavelengths (hash)",
    "lens diffraction (0 or 1)",
];

impl RayRecord {
    /// Largest record, bytes (4 GiB).
    pub const MAX_BYTES: u64 = 1 << 32;

    /// Zeros for the radiance of every ray.
    pub(super) fn space(
        camera: &Camera,
        settings: &RenderSettings,
    ) -> Result<Vec<f32>, RecordError> {
        let (width, height) = (camera.sensor().width(), camera.sensor().height());
        let values = (width as u64)
            .saturating_mul(height as u64)
            .saturating_mul(3 * settings.rays_per_pixel as u64);
        let bytes = values.saturating_mul(4);
        if bytes > Self::MAX_BYTES {
            return Err(RecordError::TooLarge { bytes });
        }
        Ok(vec![0.0; values as usize])
    }

    /// The record of a render that has filled [`RayRecord::space`].
    pub(super) fn new(
        camera: &Camera,
        settings: &RenderSettings,
        radiance: Vec<f32>,
        (occlusion, stats): (Option<Image>, RenderStats),
    ) -> Self {
        Self {
            width: camera.sensor().width(),
            height: camera.sensor().height(),
            settings: *settings,
            geometry: geometry(camera),
            radiance,
            occlusion,
            stats,
        }
    }

    /// Whether a camera has the window, pitch, lens and focus of the record.
    ///
    /// # Errors
    /// [`RecordError::OtherCamera`] with the first difference.
    pub(super) fn check_camera(&self, camera: &Camera) -> Result<(), RecordError> {
        for (i, (&record, camera)) in self.geometry.iter().zip(geometry(camera)).enumerate() {
            if record != camera {
                return Err(RecordError::OtherCamera {
                    what: GEOMETRY[i],
                    record,
                    camera,
                });
            }
        }
        Ok(())
    }

    pub(super) fn radiance(&self) -> &[f32] {
        &self.radiance
    }

    /// The occlusion map of the render, if it was asked for.
    pub(super) fn occlusion(&self) -> Option<&Image> {
        self.occlusion.as_ref()
    }

    pub(super) fn stats(&self) -> &RenderStats {
        &self.stats
    }

    /// Rays and seed.
    pub fn settings(&self) -> RenderSettings {
        self.settings
    }

    /// Writes an uncompressed `.npz`: `radiance` f32 [row, column, channel, ray], `occlusion` f32 [row, column] (empty
    /// if not asked for), `geometry` f64, `meta` (UTF-8 JSON: rays, seed, losses, and `about`, the caller's own), and
    /// `blake3`, the hash of all of it.
    ///
    /// # Errors
    /// The disk.
    pub fn write_npz(&self, path: &Path, about: &serde_json::Value) -> Result<(), RecordError> {
        let failed = |cause| FileError::new(path, "write", cause);
        let meta =
            serde_json::json!({ "settings": self.settings, "stats": self.stats, "about": about });
        let meta = meta.to_string().into_bytes();
        let shape = [self.height, self.width, 3, self.settings.rays_per_pixel];
        let radiance = ndarray::ArrayView::from_shape(IxDyn(&shape), &self.radiance)
            .map_err(|e| format_error(path, e))?;
        let occlusion = self.occlusion.as_ref().map_or(&[][..], Image::data);
        let hash = self.content_hash(&meta);
        file::write_with(path, |file| {
            let mut npz = NpzWriter::new(BufWriter::new(file));
            npz.add_array("radiance", &radiance)
                .and_then(|()| npz.add_array("occlusion", &ArrayView1::from(occlusion)))
                .and_then(|()| npz.add_array("geometry", &ArrayView1::from(&self.geometry[..])))
                .and_then(|()| npz.add_array("meta", &ArrayView1::from(&meta)))
                .and_then(|()| npz.add_array(HASH, &ArrayView1::from(hash.hex().as_bytes())))
                .map_err(|e| format_error(path, e))?;
            let mut file = npz.finish().map_err(|e| format_error(path, e))?;
            Ok(file.flush().map_err(failed)?)
        })
    }

    /// Of all that is in the file.
    fn content_hash(&self, meta: &[u8]) -> ContentHash {
        let occlusion = self.occlusion.as_ref().map_or(&[][..], Image::data);
        ContentHash::new(meta)
            .array(&self.geometry, f64::to_le_bytes)
            .array(occlusion, f32::to_le_bytes)
            .array(&self.radiance, f32::to_le_bytes)
    }

    /// Reads [`RayRecord::write_npz`]'s file, and what the caller said there.
    ///
    /// # Errors
    /// A file that cannot be read, or is no record.
    pub fn read_npz(path: &Path) -> Result<(Self, serde_json::Value), RecordError> {
        let file = file::open(path)?;
        let wrong = |what: String| format_error(path, what);
        let mut npz = Npz::open(BufReader::new(file)).map_err(wrong)?;
        let radiance: ndarray::ArrayD<f32> = npz.array("radiance").map_err(wrong)?;
        let occlusion: Array1<f32> = npz.array("occlusion").map_err(wrong)?;
        let geometry: Array1<f64> = npz.array("geometry").map_err(wrong)?;
        let stated: Array1<u8> = npz.array("meta").map_err(wrong)?;
        let stated = stated.to_vec();
        let meta: Meta = serde_json::from_slice(&stated).map_err(|e| format_error(path, e))?;
        let wrong = |what: &str| format_error(path, what);
        let &[height, width, 3, rays] = radiance.shape() else {
            return Err(wrong("radiance is not [row, column, 3, ray]"));
        };
        if rays != meta.settings.rays_per_pixel || geometry.len() != GEOMETRY.len() {
            return Err(wrong("its arrays do not fit each other"));
        }
        if let Some(bad) = radiance.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            return Err(wrong(&format!(
                "radiance {bad}; allowed: finite, not negative"
            )));
        }
        let occlusion = match occlusion.len() {
            0 => None,
            _ => Some(
                Image::from_vec(width, height, 1, occlusion.to_vec())
                    .ok_or_else(|| wrong("occlusion is not [row, column]"))?,
            ),
        };
        let record = Self {
            width,
            height,
            settings: meta.settings,
            geometry: geometry.to_vec(),
            radiance: radiance.iter().copied().collect(),
            occlusion,
            stats: meta.stats,
        };
        if [width as f64, height as f64] != record.geometry[..2] {
            return Err(wrong("its size is not that of its camera"));
        }
        let hash = record.content_hash(&stated);
        npz.check_hash(&hash)
            .map_err(|why| format_error(path, why))?;
        Ok((record, meta.about))
    }
}

#[derive(serde::Deserialize)]
struct Meta {
    settings: RenderSettings,
    stats: RenderStats,
    about: serde_json::Value,
}

fn geometry(camera: &Camera) -> Vec<f64> {
    let sensor = camera.sensor();
    vec![
        sensor.width() as f64,
        sensor.height() as f64,
        sensor.pitch_um(),
        sensor.centre_mm().x,
        sensor.centre_mm().y,
        camera.sensor_z_mm(),
        camera.focus_distance_mm(),
        camera.wavelengths().fingerprint(),
        f64::from(u8::from(camera.lens_diffraction().is_some())),
    ]
}

fn format_error(path: &Path, why: impl ToString) -> RecordError {
    RecordError::Format {
        path: path.display().to_string(),
        why: why.to_string(),
    }
}
