//! Ground truth of a render: depth, distance, disparity by traced centroids and paraxial, circle of confusion, the
//! all-in-focus target, and what a white wall would give.
//!
//! On the same microlens grid as the views, at the reference wavelength (green); what the other channels see beside it
//! is in [`channel_shifts`].

mod bundle;
mod channels;
mod defocus;
mod disparity;
mod displaced;
mod matched;
mod polar_rule;
mod receptive;
mod sight;
mod sight_field;
mod sight_line;
mod sight_nodes;
mod target;
mod white;

pub use channels::channel_shifts;
pub use defocus::Defocus;
pub use disparity::{DisparityField, DisparityMaps};
pub use matched::{TextureSpectrum, matched_shift_px};
pub use receptive::ReceptiveField;
pub use sight::{GeometryTruth, SightRays};
pub use sight_line::SightLine;
pub use white::WhiteField;

pub(super) use bundle::Bundle;
pub(crate) use bundle::{Centroid, centroids};
pub(super) use disparity::Seen;
pub(crate) use disparity::jacobian_at;
pub(super) use displaced::draws_px;
pub(crate) use white::white_sum_sr;
