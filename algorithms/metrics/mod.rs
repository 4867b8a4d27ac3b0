//! Figures of merit: sharpness of a picture, error of a disparity map.

pub mod disparity_error;
pub mod sharpness;
