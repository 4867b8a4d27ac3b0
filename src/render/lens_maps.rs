//! How rays go through a camera's lens: surface by surface, or by maps ([`crate::lens::LensMap`]).

use crate::lens::{MapBound, MapFailure, MapReport};

/// How rays go through the lens.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(
    untagged,
    expecting = "\"map\", \"exact\" or { rms_px = 0.01, worst_px = 0.1 }"
)]
pub enum LensTracing {
    /// One of two words.
    Named(Named),
    /// By maps that err by no more than this.
    Bound(MapBound),
}

/// Words for [`LensTracing`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Named {
    /// By maps of the default bound.
    Map,
    /// Surface by surface.
    Exact,
}

impl Default for LensTracing {
    fn default() -> Self {
        Self::MAP
    }
}

impl LensTracing {
    /// By maps of the default bound.
    pub const MAP: Self = Self::Named(Named::Map);
    /// Surface by surface.
    pub const EXACT: Self = Self::Named(Named::Exact);

    /// Whether it is the default.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The bound of its maps; `None`: surface by surface.
    pub fn bound(&self) -> Option<MapBound> {
        match self {
            Self::Named(Named::Map) => Some(MapBound::default()),
            Self::Named(Named::Exact) => None,
            Self::Bound(bound) => Some(*bound),
        }
    }
}

/// What became of a camera's maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LensMaps {
    /// None was asked for, or there is no lens.
    NotAsked,
    /// Too few rays for them to pay.
    TooFewRays,
    /// All wavelengths have one.
    Mapped {
        /// What was asked for.
        bound: MapBound,
        /// Of all wavelengths: the largest of each number.
        report: MapReport,
    },
    /// Some wavelength has none: all are traced surface by surface.
    Failed {
        /// What was asked for.
        bound: MapBound,
        /// Wavelength, nm.
        wavelength_nm: f64,
        /// Why it has none.
        failure: MapFailure,
    },
}
