//! What planes cannot tell.

/// Planes that do not tell focus and gain.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// Fewer than two distances, or all alike.
    #[error(
        "the distances are {0} m; allowed: two or more whose 1/Z differ by a tenth of the largest"
    )]
    Distances(String),
    /// A distance that is none.
    #[error("a distance is {0} m; allowed: above 0 to 1000000")]
    Distance(f64),
    /// A picture of another size.
    #[error("the plane at {distance_m} m has {size} px; allowed: the curve's {curve}")]
    Size {
        /// Of the plane, m.
        distance_m: f64,
        /// Of its views.
        size: String,
        /// Of the curve.
        curve: String,
    },
    /// No part of the picture has enough matches.
    #[error(
        "the plane at {0} m has no part with 16 trusted matches; allowed: a plane with texture that fills the picture"
    )]
    NoTexture(f64),
    /// The search does not end at a gain that a pixel could have.
    #[error(
        "no gain and focus fit the planes: the search ended at a gain of {0}; allowed: 0.1 to 10 (are the distances in m, and counted as the curve counts?)"
    )]
    NoFit(f64),
}
