//! What the members of a simulation share: grid, media and coefficients.

use std::sync::Arc;

use super::coefficients::{Coefficients, MediumStep};
use super::layout::Layout;
use super::{CpmlSettings, MaterialMap, YeeGrid};

/// What the members share.
pub(super) struct Shared {
    pub grid: YeeGrid,
    pub map: Arc<MaterialMap>,
    pub layout: Layout,
    pub coefficients: Coefficients,
    pub cpml: CpmlSettings,
    pub source_plane: usize,
}

impl Shared {
    pub fn nz(&self) -> usize {
        self.grid.nz()
    }

    /// Place of layer k in the arrays of ψ, if it absorbs.
    #[inline(always)]
    pub fn absorbing(&self, k: usize) -> Option<usize> {
        let top = self.grid.nz() - self.cpml.above;
        if k < self.cpml.below {
            Some(k)
        } else if k >= top {
            Some(k - top + self.cpml.below)
        } else {
            None
        }
    }

    pub fn medium_step(&self, axis: usize, [i, j, k]: [usize; 3]) -> &MediumStep {
        &self.coefficients.steps[self.map.at(axis, i, j, k)]
    }
}
