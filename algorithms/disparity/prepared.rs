//! Two pictures as matching takes them: brought to one scale, with the nodes and the statistics of all windows.

use quadpixel::image::Image;

use super::error::MatchError;
use super::geometry::{Grid, TAPS_PX};
use super::plane::{Plane, WindowStatistics};
use super::settings::{self, MatchSettings};

/// Two pictures that can be matched.
pub(super) struct Prepared {
    pub a: Plane,
    pub b: Plane,
    /// Nodes of the windows.
    pub grid: Grid,
    /// Of the windows of A and B.
    pub statistics: [WindowStatistics; 2],
}

impl Prepared {
    /// Checks the settings and the pictures.
    pub fn new(a: &Image, b: &Image, settings: &MatchSettings) -> Result<Self, MatchError> {
        settings::check(settings)?;
        if (a.width(), a.height()) != (b.width(), b.height()) {
            return Err(MatchError::Size {
                a: (a.width(), a.height()),
                b: (b.width(), b.height()),
            });
        }
        let (a, b) = (Plane::new(a)?, Plane::new(b)?);
        let too_small = MatchError::TooSmall {
            width: a.width,
            height: a.height,
            window: settings.window_px,
            least: settings.window_px + 2 * TAPS_PX,
        };
        Self::from_planes(a, b, settings).ok_or(too_small)
    }

    /// Of planes of one size; `None` where no window fits.
    pub fn from_planes(a: Plane, b: Plane, settings: &MatchSettings) -> Option<Self> {
        let grid = Grid::new(a.width, a.height, settings.window_px, settings.stride_px)?;
        let statistics = [&a, &b].map(|p| WindowStatistics::new(p, settings.window_px / 2));
        Some(Self {
            a,
            b,
            grid,
            statistics,
        })
    }
}
