//! What the numbers of pictures and depths mean, by arguments.

use crate::number::number;
use clap::{Args, ValueEnum};
use quadpixel_generators::rgbd::{DepthKind, Encoding, Intrinsics, Meaning};

/// What the numbers of the files mean. What is absent is taken from a sidecar STEM.json beside the depth (or else
/// beside the picture) with `kind`, `unit`, `hole`, `nearest_m`, `encoding`, `hfov_deg`, `intrinsics` ({fx_px, fy_px,
/// cx_px, cy_px}), `baseline_m`, `disparity_offset_px`.
#[derive(Args)]
pub struct MeaningArgs {
    /// How light is stored; absent: whole numbers are sRGB, floats linear.
    #[arg(long, value_enum)]
    encoding: Option<EncodingName>,
    /// What the depth is; absent: z.
    #[arg(long, value_enum)]
    depth_kind: Option<KindName>,
    /// Unit of the depth: m, cm, mm, or metres per number (inverse depth: 1/m per number; disparity: px per number);
    /// absent: 1 for floats and disparity; whole numbers have none.
    #[arg(long, value_parser = unit)]
    depth_unit: Option<f64>,
    /// A stored number that marks a hole, such as 65535.
    #[arg(value_parser = number, long, allow_negative_numbers = true)]
    hole: Option<f64>,
    /// Depths nearer than this are holes, m.
    #[arg(value_parser = number, long)]
    nearest_m: Option<f64>,
    /// Horizontal field of view of the picture's own camera, deg: for ray and disparity.
    #[arg(value_parser = number, long, conflicts_with = "focal_px")]
    hfov_deg: Option<f64>,
    /// Its focal length, px: for ray and disparity.
    #[arg(value_parser = number, long)]
    focal_px: Option<f64>,
    /// Its axis, column and row; absent: the middle.
    #[arg(value_parser = number, long, value_delimiter = ',', num_args = 2, requires = "focal_px")]
    axis_px: Option<Vec<f64>>,
    /// Distance between the two cameras of a disparity, m.
    #[arg(value_parser = number, long)]
    baseline_m: Option<f64>,
    /// Is added to a disparity, px (Middlebury's doffs).
    #[arg(value_parser = number, long, allow_negative_numbers = true)]
    disparity_offset_px: Option<f64>,
}

#[derive(Clone, Copy, ValueEnum)]
enum EncodingName {
    /// sRGB.
    Srgb,
    /// Linear.
    Linear,
}

#[derive(Clone, Copy, ValueEnum)]
enum KindName {
    /// Distance along the axis.
    Z,
    /// Distance along each pixel's own ray.
    Ray,
    /// 1/z.
    Inverse,
    /// Shift between two cameras side by side, px.
    Disparity,
}

fn unit(text: &str) -> Result<f64, String> {
    match text {
        "m" => Ok(1.0),
        "cm" => Ok(0.01),
        "mm" => Ok(0.001),
        number => (number.parse().ok())
            .filter(|n: &f64| *n > 0.0 && n.is_finite())
            .ok_or_else(|| "allowed: m, cm, mm, or metres per number".to_owned()),
    }
}

impl MeaningArgs {
    /// As the library takes it.
    pub fn meaning(&self) -> Meaning {
        let axis = |k: usize| self.axis_px.as_ref().and_then(|a| a.get(k).copied());
        Meaning {
            encoding: self.encoding.map(|name| match name {
                EncodingName::Srgb => Encoding::Srgb,
                EncodingName::Linear => Encoding::Linear,
            }),
            kind: self.depth_kind.map(|name| match name {
                KindName::Z => DepthKind::Z,
                KindName::Ray => DepthKind::Ray,
                KindName::Inverse => DepthKind::Inverse,
                KindName::Disparity => DepthKind::Disparity,
            }),
            unit: self.depth_unit,
            hole: self.hole,
            nearest_m: self.nearest_m,
            baseline_m: self.baseline_m,
            disparity_offset_px: self.disparity_offset_px,
            intrinsics: self.focal_px.map(|fx_px| Intrinsics {
                fx_px,
                fy_px: None,
                cx_px: axis(0),
                cy_px: axis(1),
            }),
            hfov_deg: self.hfov_deg,
        }
    }
}
