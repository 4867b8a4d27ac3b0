//! What the numbers of the files mean.

use serde::{Deserialize, Serialize};

/// How light is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Encoding {
    /// sRGB for whole numbers (PNG, JPEG, TIFF, NPY of integers), linear for floats.
    #[default]
    Auto,
    /// sRGB.
    Srgb,
    /// Linear.
    Linear,
}

/// What a depth file holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DepthKind {
    /// Distance along the axis.
    #[default]
    Z,
    /// Distance along each pixel's own ray.
    Ray,
    /// 1/z.
    Inverse,
    /// Shift between two cameras side by side, px: z = focal length × baseline / disparity.
    Disparity,
}

impl DepthKind {
    /// Its name, as in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Z => "z",
            Self::Ray => "ray",
            Self::Inverse => "inverse",
            Self::Disparity => "disparity",
        }
    }
}

/// The pinhole camera that took the picture; pixel (0, 0) has its middle at 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Intrinsics {
    /// Focal length along x, px.
    pub fx_px: f64,
    /// Along y; absent: as along x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fy_px: Option<f64>,
    /// Column of the axis; absent: the middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cx_px: Option<f64>,
    /// Row of the axis; absent: the middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cy_px: Option<f64>,
}

/// What numbers mean. What is absent is taken from a sidecar, then from the kind of file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Meaning {
    /// How light is stored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub encoding: Option<Encoding>,
    /// What the depth is; absent: z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kind: Option<DepthKind>,
    /// Metres per number (inverse depth: 1/m per number; disparity: px per number); absent: 1 for floats and for
    /// disparity; whole numbers have none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<f64>,
    /// A number that marks a hole, beside those that cannot be depths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hole: Option<f64>,
    /// Depths nearer than this are holes, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nearest_m: Option<f64>,
    /// Distance of the two cameras of a disparity, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline_m: Option<f64>,
    /// What is added to a disparity, px: the difference of the two cameras' axes (Middlebury's `doffs`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disparity_offset_px: Option<f64>,
    /// The picture's own camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub intrinsics: Option<Intrinsics>,
    /// Its horizontal field of view, deg, in the place of intrinsics.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hfov_deg: Option<f64>,
}

impl Meaning {
    /// What this leaves open, as `other` has it.
    pub fn or(self, other: Self) -> Self {
        // A field of view given here stands before intrinsics of the other.
        let own_camera = self.intrinsics.is_some() || self.hfov_deg.is_some();
        let (intrinsics, hfov_deg) = match own_camera {
            true => (self.intrinsics, self.hfov_deg),
            false => (other.intrinsics, other.hfov_deg),
        };
        Self {
            encoding: self.encoding.or(other.encoding),
            kind: self.kind.or(other.kind),
            unit: self.unit.or(other.unit),
            hole: self.hole.or(other.hole),
            nearest_m: self.nearest_m.or(other.nearest_m),
            baseline_m: self.baseline_m.or(other.baseline_m),
            disparity_offset_px: self.disparity_offset_px.or(other.disparity_offset_px),
            intrinsics,
            hfov_deg,
        }
    }

    /// The first number that is none, and what is allowed.
    pub fn check(&self) -> Result<(), String> {
        let positive = [
            ("unit", self.unit),
            ("nearest_m", self.nearest_m),
            ("baseline_m", self.baseline_m),
            ("intrinsics.fx_px", self.intrinsics.map(|i| i.fx_px)),
            ("intrinsics.fy_px", self.intrinsics.and_then(|i| i.fy_px)),
        ];
        let good = |v: f64| v > 0.0 && v.is_finite();
        let bad = positive.iter().find(|(_, v)| v.is_some_and(|v| !good(v)));
        if let Some((field, value)) = bad {
            let value = value.unwrap_or_default();
            return Err(format!("{field} is {value}; allowed: a positive number"));
        }
        let of_disparity = [
            ("baseline_m", self.baseline_m),
            ("disparity_offset_px", self.disparity_offset_px),
        ];
        let kind = self.kind.unwrap_or_default();
        if kind != DepthKind::Disparity
            && let Some((field, _)) = of_disparity.iter().find(|(_, v)| v.is_some())
        {
            let kind = kind.name();
            return Err(format!(
                "{field} beside a depth of kind {kind}; allowed: with kind disparity"
            ));
        }
        match self.hfov_deg {
            Some(deg) if !(deg > 0.0 && deg < 179.0) => {
                Err(format!("hfov_deg is {deg}; allowed: above 0, below 179"))
            }
            _ => Ok(()),
        }
    }

    /// The picture's camera for a picture of this size, where it is known.
    pub fn camera(&self, width: usize, height: usize) -> Option<[f64; 4]> {
        let middle = |px: usize| (px as f64 - 1.0) / 2.0;
        let from_view = |deg: f64| Intrinsics {
            fx_px: width as f64 / 2.0 / (deg.to_radians() / 2.0).tan(),
            fy_px: None,
            cx_px: None,
            cy_px: None,
        };
        let i = self.intrinsics.or(self.hfov_deg.map(from_view))?;
        Some([
            i.fx_px,
            i.fy_px.unwrap_or(i.fx_px),
            i.cx_px.unwrap_or(middle(width)),
            i.cy_px.unwrap_or(middle(height)),
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_only_a_disparity_has_is_refused_beside_other_kinds() {
        let of = |kind, baseline_m, disparity_offset_px| {
            let meaning = Meaning {
                kind,
                baseline_m,
                disparity_offset_px,
                ..Meaning::default()
            };
            meaning.check()
        };
        assert_eq!(of(Some(DepthKind::Disparity), Some(0.1), Some(3.0)), Ok(()));
        for (told, named) in [
            (
                of(None, Some(0.1), None),
                "baseline_m beside a depth of kind z",
            ),
            (
                of(Some(DepthKind::Ray), None, Some(3.0)),
                "disparity_offset_px",
            ),
        ] {
            assert!(told.is_err_and(|e| e.contains(named)), "{named}");
        }
    }
}
