//! What matching finds: shifts with their covariances, and whether they can be trusted.

use super::geometry::Grid;

/// Whether a match can be trusted, and if not, why.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Verdict {
    /// All tests passed.
    Valid = 0,
    /// The window shows nothing but rounding, or a pattern with no slope along a free axis.
    Textureless = 1,
    /// ZNCC below the limit.
    LowCorrelation = 2,
    /// A second peak nearly as high as the first: periodic texture.
    Ambiguous = 3,
    /// The best shift lies at the end of the search, or beyond it.
    SearchEdge = 4,
    /// The window or its interpolation leaves B.
    Outside = 5,
    /// Standard deviation above the limit.
    Uncertain = 6,
    /// The match from B back to A leads elsewhere.
    Inconsistent = 7,
    /// The refinement left the peak it started from.
    NotConverged = 8,
}

impl Verdict {
    /// All verdicts, in the order of their codes.
    pub const ALL: [Self; 9] = [
        Self::Valid,
        Self::Textureless,
        Self::LowCorrelation,
        Self::Ambiguous,
        Self::SearchEdge,
        Self::Outside,
        Self::Uncertain,
        Self::Inconsistent,
        Self::NotConverged,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Valid => "valid",
            Self::Textureless => "textureless",
            Self::LowCorrelation => "low_correlation",
            Self::Ambiguous => "ambiguous",
            Self::SearchEdge => "search_edge",
            Self::Outside => "outside",
            Self::Uncertain => "uncertain",
            Self::Inconsistent => "inconsistent",
            Self::NotConverged => "not_converged",
        }
    }
}

/// The match of one window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Shift to the right, px; NaN unless valid; 0 where the axis is fixed.
    pub dx_px: f64,
    /// Shift down, px; NaN unless valid; 0 where the axis is fixed.
    pub dy_px: f64,
    /// Covariance xx, xy, yy in px²; NaN unless valid; 0 on a fixed axis.
    pub covariance_px2: [f64; 3],
    /// Correlation at the best shift, −1 to 1; NaN where none was computed.
    pub zncc: f64,
    /// Trust.
    pub verdict: Verdict,
}

impl Match {
    pub(super) fn rejected(verdict: Verdict, zncc: f64) -> Self {
        Self {
            dx_px: f64::NAN,
            dy_px: f64::NAN,
            covariance_px2: [f64::NAN; 3],
            zncc,
            verdict,
        }
    }

    /// Standard deviation along the worse principal axis, px.
    pub fn deviation_px(&self) -> f64 {
        largest_eigenvalue(self.covariance_px2).sqrt()
    }
}

/// Larger eigenvalue of the symmetric matrix (xx, xy, yy).
pub(super) fn largest_eigenvalue([xx, xy, yy]: [f64; 3]) -> f64 {
    let half_difference = 0.5 * (xx - yy);
    0.5 * (xx + yy) + (half_difference * half_difference + xy * xy).sqrt()
}

/// Matches on a grid of nodes, row-major.
#[derive(Clone, Debug, PartialEq)]
pub struct DisparityMap {
    /// Where the nodes lie.
    pub grid: Grid,
    /// One match a node.
    pub matches: Vec<Match>,
}

impl DisparityMap {
    /// Nodes with their pixel positions (x, y).
    pub fn nodes(&self) -> impl Iterator<Item = ([f64; 2], &Match)> {
        (self.matches.iter().enumerate()).map(|(i, found)| {
            let (x, y) = self.grid.pixel(i);
            ([x as f64, y as f64], found)
        })
    }

    /// Nodes with `verdict`.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.matches.iter().filter(|m| m.verdict == verdict).count()
    }

    /// The valid matches, for [`crate::field`].
    pub fn observations(&self) -> Vec<crate::field::Observation> {
        self.nodes()
            .filter(|(_, found)| found.verdict == Verdict::Valid)
            .map(|(at_px, found)| crate::field::Observation {
                at_px,
                shift_px: [found.dx_px, found.dy_px],
                covariance_px2: found.covariance_px2,
            })
            .collect()
    }
}
