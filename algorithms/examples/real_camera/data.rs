//! The captures in a folder: flat planes of known distance, and scenes with a depth map.
//!
//! ```text
//! flat/DISTANCE_MM/fMARK/{l,r}.png      a plane that far from the sensor, at the marked F-number
//! NAME/{l,r,d}.png                      a scene; d.png: 8 bits × 10/255 m, or 16 bits in mm; 0: not known
//! ```
//! Views are 8-bit pictures of a converter; their sRGB curve is undone, the converter's own tone curve is not known.

use std::path::{Path, PathBuf};

use quadpixel::command::CommandError;
use quadpixel::image::srgb::to_linear;
use quadpixel::image::{Image, raster};

/// Distance of a full code of an 8-bit depth map, m.
const EIGHT_BIT_FULL_M: f32 = 10.0;

/// Left and right view of an exposure: RGB, sRGB's curve undone.
pub struct Views {
    pub left: Image,
    pub right: Image,
}

/// A plane square to the axis.
pub struct Flat {
    /// From the sensor.
    pub distance_mm: f64,
    /// F-number on the lens.
    pub mark: f64,
    pub folder: PathBuf,
}

/// A scene.
pub struct Scene {
    pub name: String,
    pub folder: PathBuf,
}

/// What a folder holds, in order of distance, mark and name.
#[derive(Default)]
pub struct Captures {
    pub flats: Vec<Flat>,
    pub scenes: Vec<Scene>,
}

impl Captures {
    /// Looks through `folder` and the folders in it.
    pub fn find(folder: &Path) -> Result<Self, CommandError> {
        let mut found = Self::default();
        let mut open = vec![folder.to_path_buf()];
        while let Some(here) = open.pop() {
            let entries = std::fs::read_dir(&here)
                .map_err(|e| CommandError::input(format!("{}: {e}", here.display())))?;
            open.extend(entries.flatten().map(|e| e.path()).filter(|p| p.is_dir()));
            if !["l.png", "r.png"].iter().all(|f| here.join(f).is_file()) {
                continue;
            }
            let below = here.strip_prefix(folder).unwrap_or(&here);
            let parts: Vec<String> = (below.components())
                .map(|c| c.as_os_str().to_string_lossy().into_owned())
                .collect();
            if here.join("d.png").is_file() {
                let name = parts.join("-");
                found.scenes.push(Scene { name, folder: here });
            } else if let [.., distance, mark] = parts.as_slice()
                && let (Ok(distance_mm), Some(Ok(mark))) = (
                    distance.parse(),
                    mark.strip_prefix('f').map(str::parse::<f64>),
                )
            {
                found.flats.push(Flat {
                    distance_mm,
                    mark,
                    folder: here,
                });
            }
        }
        (found.flats).sort_by(|a, b| {
            (a.distance_mm, a.mark)
                .partial_cmp(&(b.distance_mm, b.mark))
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        found.scenes.sort_by(|a, b| a.name.cmp(&b.name));
        if found.flats.is_empty() && found.scenes.is_empty() {
            return Err(CommandError::input(format!(
                "{}: no capture in it; looked for flat/DISTANCE_MM/fMARK/{{l,r}}.png and NAME/{{l,r,d}}.png",
                folder.display()
            )));
        }
        Ok(found)
    }
}

impl Views {
    /// l.png and r.png of a folder.
    pub fn read(folder: &Path) -> Result<Self, CommandError> {
        let [left, right] = ["l.png", "r.png"].map(|name| linear(&folder.join(name)));
        let (left, right) = (left?, right?);
        let size = |i: &Image| (i.width(), i.height(), i.channels());
        if size(&left) != size(&right) || left.channels() != 3 {
            return Err(CommandError::input(format!(
                "{}: l.png and r.png must be colour pictures of one size",
                folder.display()
            )));
        }
        Ok(Self { left, right })
    }

    /// Mean of both.
    pub fn mean(&self) -> Image {
        let mut mean = self.left.clone();
        for (m, r) in mean.data_mut().iter_mut().zip(self.right.data()) {
            *m = 0.5 * (*m + r);
        }
        mean
    }
}

fn linear(path: &Path) -> Result<Image, CommandError> {
    let mut image = raster::read(path).map_err(|e| CommandError::input(e.to_string()))?;
    image.data_mut().iter_mut().for_each(|v| *v = to_linear(*v));
    Ok(image)
}

/// Distance from the camera at each pixel of a `width` × `height` picture, m; NaN where the map has none.
pub fn depth_m(path: &Path, width: usize, height: usize) -> Result<Image, CommandError> {
    let bad = |e: String| CommandError::input(format!("{}: {e}", path.display()));
    let map = image::ImageReader::open(path)
        .map_err(|e| bad(e.to_string()))?
        .decode()
        .map_err(|e| bad(e.to_string()))?;
    let eight_bit = map.color().bytes_per_pixel() == map.color().channel_count();
    let map = map.into_luma16();
    let (from_width, from_height) = (map.width() as usize, map.height() as usize);
    if from_width < width || from_height < height {
        return Err(bad(format!(
            "{from_width} × {from_height}: smaller than the views"
        )));
    }
    let mut depth = Image::zeros(width, height, 1);
    for y in 0..height {
        for x in 0..width {
            let at = |i: usize, n: usize, from: usize| {
                ((i as f64 + 0.5) * from as f64 / n as f64) as u32
            };
            let code = map.get_pixel(at(x, width, from_width), at(y, height, from_height))[0];
            depth.pixel_mut(x, y)[0] = match (code, eight_bit) {
                (0, _) => f32::NAN,
                (code, true) => f32::from(code) / 65535.0 * EIGHT_BIT_FULL_M,
                (code, false) => f32::from(code) * 1e-3,
            };
        }
    }
    Ok(depth)
}
