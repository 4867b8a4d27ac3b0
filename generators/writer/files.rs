//! What a sample consists of.

use quadpixel::image::Image;
use quadpixel::image::raster::Levels;

use crate::describe::Description;

/// What a sample, or some rows of one, consists of. W × H pixels of m × n sub-pixels; every image has row 0 on top.
#[derive(Clone, Debug)]
pub struct SampleFiles<'a> {
    /// The sub-pixel mosaic, m·W × n·H, linear, one channel per colour: finite and not negative.
    pub raw: &'a Image,
    /// How the mosaic is stored.
    pub raw_encoding: RawEncoding,
    /// The all-in-focus image, W × H, linear, on the scale of the sum of all sub-pixels.
    pub target: &'a Image,
    /// z from the first lens vertex, m, one channel; +inf for the sky.
    pub depth_m: &'a Image,
    /// Distance from the first lens vertex, m, one channel.
    pub distance_m: &'a Image,
    /// Traced disparity (dx, dy), px, two channels: one image a sub-pixel in stored order.
    pub traced_px: &'a [Image],
    /// The paraxial disparity, alike.
    pub paraxial_px: &'a [Image],
    /// Signed circle of confusion, px, one channel.
    pub coc_px: &'a Image,
    /// Where the sum shows what the chief ray meets, from there, px, two channels.
    pub chief_to_sum_px: &'a Image,
    /// Shifts of red and blue from green, px, four channels: one image per sub-pixel, and one of the sum; left out
    /// where the channels see the same.
    pub channel_shifts_px: Option<&'a [Image]>,
    /// Fraction (0 to 1) of the pupil that sees another surface than the ray of sight, one channel.
    pub occlusion: &'a Image,
    /// The capture as a sensor reads it, where that is asked for.
    pub noisy: Option<NoisyFiles<'a>>,
    /// Where the float maps apply. A pixel with NaN in any of them is invalid too, and NaN goes into all of them there.
    pub valid: &'a [bool],
    /// Objects and normals, of worlds of meshes; left out of the sample if `None`.
    pub seen: Option<WorldMaps<'a>>,
    /// Everything else, of the whole sample.
    pub description: &'a Description,
}

/// What the rays of sight see of a world of meshes.
#[derive(Clone, Copy, Debug)]
pub struct WorldMaps<'a> {
    /// Number of the object of each pixel; 65535 where none.
    pub objects: &'a [u16],
    /// Unit normal on the camera's side (X right, Y up, Z into the scene), three channels; 0 where nothing is met.
    pub normals: &'a Image,
}

/// A noisy capture.
#[derive(Clone, Copy, Debug)]
pub struct NoisyFiles<'a> {
    /// Digital numbers of the mosaic.
    pub codes: &'a Image,
    /// Their linear values.
    pub linear: &'a Image,
    /// What a white wall gives on each sub-pixel, in stored order: W × H, one channel per colour.
    pub shading: &'a [Image],
}

/// How the raw mosaic is stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RawEncoding {
    /// 16-bit PNG with these levels.
    Png(Levels),
    /// Half-float EXR.
    Exr,
}
