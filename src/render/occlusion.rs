//! How much of the pupil something before the surface in sight, or behind its edge, takes.

/// How much of the pupil sees another surface than the ray of sight.
pub(super) struct Occlusion {
    /// Surface that the ray of sight meets.
    pub chief_surface: u16,
    /// Solid-angle-weighted sum over rays that meet another one, and over all that pass.
    pub other: f64,
    pub all: f64,
}

impl Occlusion {
    /// Beside this surface, which the ray of sight meets.
    pub fn beside(chief_surface: u16) -> Self {
        Self {
            chief_surface,
            other: 0.0,
            all: 0.0,
        }
    }

    /// The other surfaces' share; `None` where no ray passed.
    pub fn share(&self) -> Option<f32> {
        (self.all > 0.0).then(|| (self.other / self.all) as f32)
    }
}
