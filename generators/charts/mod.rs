//! Flat charts, randomised from one seed.
//!
//! A [`ChartSpec`] (the `kind` and its parameters, as in a configuration file) is drawn as a square [`Texture`] of
//! linear reflectance in 0..=1. The same specification, seed and size give the same bytes on any number of threads:
//! random numbers are keyed hashes. Lengths are shares of the side, so that a chart is the same picture at every size
//! (white noise and the cutoff of noise, in texels, are not).

mod alphabet;
mod dead_leaves;
mod error;
mod image_file;
pub(crate) mod keyed;
mod lettering;
mod mask;

mod noise;
mod paint;
mod resolution;
mod stripes;

pub use alphabet::Alphabet;
pub use dead_leaves::DeadLeaves;
pub use error::ChartError;
pub use image_file::ImageFile;
pub(crate) use image_file::is_image;
pub use mask::Mask;
pub use noise::Noise;
pub use resolution::Resolution;
pub use stripes::{Checkerboard, SiemensStar, SlantedEdge};

use error::{side, within};
use keyed::Key;
use quadpixel::scene::texture::Texture;
use serde::{Deserialize, Serialize};

/// A flat colour; it does not depend on the seed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Constant {
    /// Linear reflectance of R, G and B, each 0..=1; default 0.8.
    pub color: [f64; 3],
}

impl Default for Constant {
    fn default() -> Self {
        Self { color: [0.8; 3] }
    }
}

impl Constant {
    fn draw(&self, size_px: usize) -> Result<Texture, ChartError> {
        side(size_px)?;
        for value in self.color {
            within("constant", "color", value, 0.0, 1.0)?;
        }
        let color = self.color.map(|v| v as f32);
        Ok(Texture::from_fn(size_px, size_px, |_, _| color)?)
    }
}

/// A chart and its parameters; in files the tag is `kind`, in kebab case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum ChartSpec {
    /// ISO-12233-like resolution chart.
    Resolution(Resolution),
    /// Tiled alphabet.
    Alphabet(Alphabet),
    /// White or 1/f^β noise.
    Noise(Noise),
    /// Occluding disks and rectangles of all sizes.
    DeadLeaves(DeadLeaves),
    /// One slanted edge.
    SlantedEdge(SlantedEdge),
    /// Siemens star.
    SiemensStar(SiemensStar),
    /// Checkerboard.
    Checkerboard(Checkerboard),
    /// An image file.
    Image(ImageFile),
    /// A flat colour.
    Constant(Constant),
}

impl ChartSpec {
    /// The names of all charts, as in files.
    pub const KINDS: [&'static str; 9] = [
        "resolution",
        "alphabet",
        "noise",
        "dead-leaves",
        "slanted-edge",
        "siemens-star",
        "checkerboard",
        "image",
        "constant",
    ];

    /// The name of its kind, as in files.
    pub fn name(&self) -> &'static str {
        let index = match self {
            Self::Resolution(_) => 0,
            Self::Alphabet(_) => 1,
            Self::Noise(_) => 2,
            Self::DeadLeaves(_) => 3,
            Self::SlantedEdge(_) => 4,
            Self::SiemensStar(_) => 5,
            Self::Checkerboard(_) => 6,
            Self::Image(_) => 7,
            Self::Constant(_) => 8,
        };
        Self::KINDS[index]
    }

    /// Draws the chart, `size_px` texels per side (1..=16384).
    ///
    /// # Errors
    /// A parameter out of its range, or an image that cannot be read.
    pub fn generate(&self, seed: u64, size_px: usize) -> Result<Texture, ChartError> {
        match self {
            Self::Resolution(chart) => chart.draw(size_px),
            Self::Alphabet(chart) => chart.draw(seed, size_px),
            Self::Noise(chart) => chart.draw(seed, size_px),
            Self::DeadLeaves(chart) => chart.draw(seed, size_px),
            Self::SlantedEdge(chart) => chart.draw(size_px),
            Self::SiemensStar(chart) => chart.draw(size_px),
            Self::Checkerboard(chart) => chart.draw(size_px),
            Self::Image(chart) => chart.draw(size_px),
            Self::Constant(chart) => chart.draw(size_px),
        }
    }
}

/// Draws the parameters of the chart named `kind` from `seed`.
///
/// # Errors
/// An unknown name, or `image`, which needs a file.
pub fn random_spec(kind: &str, seed: u64) -> Result<ChartSpec, ChartError> {
    let key = Key::new(seed, kind).with(1);
    Ok(match kind {
        "resolution" => ChartSpec::Resolution(Resolution::random(key)),
        "alphabet" => ChartSpec::Alphabet(Alphabet::random(key)),
        "noise" => ChartSpec::Noise(Noise::random(key)),
        "dead-leaves" => ChartSpec::DeadLeaves(DeadLeaves::random(key)),
        "slanted-edge" => ChartSpec::SlantedEdge(SlantedEdge::random(key)),
        "siemens-star" => ChartSpec::SiemensStar(SiemensStar::random(key)),
        "checkerboard" => ChartSpec::Checkerboard(Checkerboard::random(key)),
        "image" => return Err(ChartError::NeedsFile),
        "constant" => ChartSpec::Constant(Constant {
            color: [0, 1, 2].map(|c| key.range(c, 0.1, 0.9)),
        }),
        _ => {
            return Err(ChartError::UnknownChart {
                kind: kind.to_owned(),
                known: ChartSpec::KINDS.join(", "),
            });
        }
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests;
