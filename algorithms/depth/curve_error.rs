//! Why a camera tells no depth.

/// A camera that tells no depth.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// Nothing tells κ.
    #[error("the camera's description does not say the ratio of disparity to circle of confusion")]
    NoRatio,
    /// A gain without meaning.
    #[error("kappa · fx · entrance pupil diameter must be above 0")]
    Gain,
    /// A field of κ whose nodes do not fit.
    #[error("disparity_ratio: its values are not as many as columns × rows, at least 2 × 2")]
    Nodes,
}
