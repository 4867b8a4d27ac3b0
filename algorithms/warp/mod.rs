//! Warping by the exact Lanczos kernel.
