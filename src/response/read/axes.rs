//! The nodes along u and v that the lookups of a table read, and the cell that holds a direction.
//!
//! Bilinear weights are ≥ 0 and sum to 1, so 0 ≤ P_i and Σ P_i ≤ 1 carry over from the nodes (to rounding). Directions
//! beyond the axes read the edge. Plain multiplies and adds, no fused ones: the same bits on every CPU.

/// Nodes along u and v, from minus to plus the last value of each.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes {
    pub nu: usize,
    pub nv: usize,
    /// place on the axis = cosine × scale + centre
    pub scale: [f32; 2],
    centre: [f32; 2],
}

/// The four nodes around a direction.
#[derive(Clone, Copy, Default)]
pub(super) struct Cell {
    /// Its lowest node along u and v.
    pub i: usize,
    pub j: usize,
    /// Weights of the nodes (i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1).
    pub weights: [f32; 4],
}

impl Axes {
    /// Of axes as (count, last value). The caller (a checked table) guarantees counts ≥ 3.
    pub fn new((nu, u_end): (usize, f32), (nv, v_end): (usize, f32)) -> Self {
        let (cu, cv) = ((nu / 2) as f32, (nv / 2) as f32);
        Self {
            nu,
            nv,
            scale: [cu / u_end, cv / v_end],
            centre: [cu, cv],
        }
    }

    /// Direction cosines of all nodes, `[v][u]`.
    pub fn cosines(&self) -> (Vec<f32>, Vec<f32>) {
        let cosine = |i: usize, axis: usize| (i as f32 - self.centre[axis]) / self.scale[axis];
        (0..self.nu * self.nv)
            .map(|k| (cosine(k % self.nu, 0), cosine(k / self.nu, 1)))
            .unzip()
    }

    /// The same axes, from their last values as these nodes have them.
    pub fn renewed(&self) -> Self {
        let end = |axis: usize| self.centre[axis] / self.scale[axis];
        Self::new((self.nu, end(0)), (self.nv, end(1)))
    }

    /// The cell that holds a direction, or is nearest to it; a mirrored axis has minus its scale.
    #[inline(always)]
    pub fn cell(&self, scale: [f32; 2], u: f32, v: f32) -> Cell {
        let x = within(u * scale[0] + self.centre[0], (self.nu - 1) as f32);
        let y = within(v * scale[1] + self.centre[1], (self.nv - 1) as f32);
        // To 32 bits: a single instruction, to 64 many.
        let i = (x as i32 as usize).min(self.nu - 2);
        let j = (y as i32 as usize).min(self.nv - 2);
        let (a, b) = (x - i as f32, y - j as f32);
        Cell {
            i,
            j,
            weights: [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b],
        }
    }
}

/// From 0 to `end`; a NaN is 0.
#[inline(always)]
fn within(x: f32, end: f32) -> f32 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < end { x } else { end }
}
