//! The captures in a folder: flat planes of known distance, and scenes with a depth map.
//!
//! ```text
//! flat/DISTANCE_MM/fMARK/{l,r}.png      a plane that far from the sensor, at the marked F-number
//! NAME/{l,r,d}.png                      a scene; d.png: 8 bits × 10/255 m, or 16 bits in mm; 0: not known
//! ```
//! Names, distances and marks are what is found, at any depth of folders; of a scene the last folders above its
//! pictures are the name, up to its number the kind (`box-001`, `box/001`: box). What is no capture, or cannot be read,
//! is left out and said.
//!
//! Views are 8-bit pictures of a converter; their sRGB curve is undone, the converter's own tone curve is not known.

use std::error::Error;
use std::path::{Path, PathBuf};

use quadpixel::image::srgb::to_linear;
use quadpixel::image::{Image, raster};

/// The F-number from which on a capture counts as sharp, to be the texture of a wider one.
pub const SHARP_MARK: f64 = 16.0;

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

impl Scene {
    /// Its name up to the first hyphen: box, casual.
    pub fn kind(&self) -> &str {
        self.name.split('-').next().unwrap_or_default()
    }
}

/// What a folder holds, in order of distance, mark and name.
#[derive(Default)]
pub struct Captures {
    pub flats: Vec<Flat>,
    pub scenes: Vec<Scene>,
    /// Folders that look like captures and are none, and why.
    pub left_out: Vec<String>,
}

impl Captures {
    /// Looks through `folder` and the folders in it.
    pub fn find(folder: &Path) -> Result<Self, Box<dyn Error>> {
        let mut found = Self::default();
        let mut open = vec![folder.to_path_buf()];
        while let Some(here) = open.pop() {
            let entries =
                std::fs::read_dir(&here).map_err(|e| format!("{}: {e}", here.display()))?;
            open.extend(entries.flatten().map(|e| e.path()).filter(|p| p.is_dir()));
            let below = here.strip_prefix(folder).unwrap_or(&here);
            let parts: Vec<String> = (below.components())
                .map(|c| c.as_os_str().to_string_lossy().into_owned())
                .collect();
            if let Err(why) = found.take(&here, &parts) {
                found.left_out.push(format!("{}: {why}", parts.join("/")));
            }
        }
        found.flats.sort_by(|a, b| {
            let by = a.distance_mm.total_cmp(&b.distance_mm);
            by.then(a.mark.total_cmp(&b.mark))
        });
        found.scenes.sort_by(|a, b| a.name.cmp(&b.name));
        found.left_out.sort();
        if found.flats.is_empty() && found.scenes.is_empty() {
            return Err(format!(
                "{}: no capture in it; looked for flat/DISTANCE_MM/fMARK/{{l,r}}.png and NAME/{{l,r,d}}.png",
                folder.display()
            ).into());
        }
        Ok(found)
    }

    /// Takes the capture in the folder `here`, if there is one; `parts` are the names of the folders down to it.
    fn take(&mut self, here: &Path, parts: &[String]) -> Result<(), String> {
        let has = |name: &str| here.join(name).is_file();
        match (has("l.png"), has("r.png")) {
            (false, false) => return Ok(()),
            (true, true) => {}
            (left, _) => return Err(format!("{}.png is missing", if left { "r" } else { "l" })),
        }
        let folder = here.to_path_buf();
        if has("d.png") {
            let name = parts.join("-");
            self.scenes.push(Scene { name, folder });
            return Ok(());
        }
        let positive = |text: &str| {
            text.parse()
                .ok()
                .filter(|v: &f64| *v > 0.0 && v.is_finite())
        };
        let plane = match parts {
            [.., distance, mark] => {
                positive(distance).zip(mark.strip_prefix('f').and_then(positive))
            }
            _ => None,
        };
        let Some((distance_mm, mark)) = plane else {
            return Err(
                "neither d.png beside the views nor DISTANCE_MM/fMARK as folders".to_owned(),
            );
        };
        self.flats.push(Flat {
            distance_mm,
            mark,
            folder,
        });
        Ok(())
    }
}

impl Views {
    /// l.png and r.png of a folder.
    pub fn read(folder: &Path) -> Result<Self, Box<dyn Error>> {
        let [left, right] = ["l.png", "r.png"].map(|name| linear(&folder.join(name)));
        let (left, right) = (left?, right?);
        let size = |i: &Image| (i.width(), i.height(), i.channels());
        if size(&left) != size(&right) || left.channels() != 3 {
            return Err(format!(
                "{}: l.png and r.png must be colour pictures of one size",
                folder.display()
            )
            .into());
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

fn linear(path: &Path) -> Result<Image, Box<dyn Error>> {
    let mut image = raster::read(path)?;
    image.data_mut().iter_mut().for_each(|v| *v = to_linear(*v));
    Ok(image)
}

/// Distance from the camera at each pixel of a `width` × `height` picture, m; NaN where the map has none.
pub fn depth_m(path: &Path, width: usize, height: usize) -> Result<Image, Box<dyn Error>> {
    let bad = |e: String| format!("{}: {e}", path.display());
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
        ))
        .into());
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
