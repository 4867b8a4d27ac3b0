//! Where the time of a run goes. On the console only: no file of a dataset holds a time.

use std::time::Instant;

use serde::Serialize;

/// Seconds of wall time by stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Stages {
    /// Angular responses: computed or read.
    pub response_s: f64,
    /// Lens, pupils and charts.
    pub scene_s: f64,
    /// Which effects the scene calls for.
    pub effects_s: f64,
    /// Rays: traced, looked up, splatted.
    pub rays_s: f64,
    /// Depth, disparity, target and the other truths.
    pub truth_s: f64,
    /// Encoding, preview and disk.
    pub writing_s: f64,
}

impl Stages {
    /// Both together.
    pub fn plus(self, other: Self) -> Self {
        Self {
            response_s: self.response_s + other.response_s,
            scene_s: self.scene_s + other.scene_s,
            effects_s: self.effects_s + other.effects_s,
            rays_s: self.rays_s + other.rays_s,
            truth_s: self.truth_s + other.truth_s,
            writing_s: self.writing_s + other.writing_s,
        }
    }
}

impl std::fmt::Display for Stages {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "response {:.1} s, lens and charts {:.1} s, effects {:.1} s, rays {:.1} s, truth {:.1} s, writing {:.1} s",
            self.response_s,
            self.scene_s,
            self.effects_s,
            self.rays_s,
            self.truth_s,
            self.writing_s
        )
    }
}

/// Runs `work` and adds its seconds to `stage`.
pub fn timed<T>(stage: &mut f64, work: impl FnOnce() -> T) -> T {
    let began = Instant::now();
    let result = work();
    *stage += began.elapsed().as_secs_f64();
    result
}
