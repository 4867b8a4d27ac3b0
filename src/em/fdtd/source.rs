//! A current sheet: J(x, y, t) = (Jx, Jy) e^(i(kx x + ky y)) w(t) on one plane of tangential E, with k∥ = phase /
//! period.

use std::sync::Arc;

/// The waveform w(t): t in µm/c, any unit of surface current.
pub type Waveform = Arc<dyn Fn(f64) -> f64 + Send + Sync>;

/// The plane and the waveform; direction and k∥ are the member's.
#[derive(Clone)]
pub struct Source {
    /// The plane k of the sheet, 1 to nz − 1, outside the absorbing layers.
    pub plane: usize,
    /// w(t), taken at the middle of each step.
    pub waveform: Waveform,
}
