//! Why there are no kernels.

use crate::memory::MemoryError;

/// Why kernels cannot be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KernelError {
    /// Part of the window gets no light.
    #[error(
        "part of the sensor window is dark; allowed: a window inside the image circle of the lens"
    )]
    Dark,
    /// They would take more memory than is allowed.
    #[error(transparent)]
    Memory(#[from] MemoryError),
}
