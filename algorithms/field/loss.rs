//! What outliers weigh.

/// What an outlier may weigh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Loss {
    /// All the same: least squares.
    Squares,
    /// Huber's, k = 1.345: linear in the tail.
    Huber,
    /// Tukey's biweight, k = 4.685, started from Huber's fit: nothing beyond k scales.
    Tukey,
}

impl Loss {
    /// Weight ρ'(t)/t at t scales.
    pub(super) fn weight(self, t: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber => (1.345 / t).min(1.0),
            Self::Tukey => {
                let rest = 1.0 - (t / 4.685) * (t / 4.685);
                if rest > 0.0 { rest * rest } else { 0.0 }
            }
        }
    }
}
