//! Ground truth of a render: depth, distance, disparity by traced centroids and paraxial, circle of confusion, the
//! all-in-focus target, and what a white wall would give.
//!
//! Everything is held at the reference wavelength (green) and on the same microlens grid as the views.

mod bundle;
mod chief;
mod defocus;
mod disparity;
mod receptive;
mod white;

pub use chief::{ChiefRays, GeometryTruth};
pub use defocus::Defocus;
pub use disparity::{DisparityField, DisparityMaps};
pub use receptive::{ReceptiveField, TextureSpectrum};
pub use white::WhiteField;

pub(crate) use bundle::{Centroid, centroids};
pub(crate) use disparity::jacobian_at;
pub(crate) use white::white_sum_sr;
