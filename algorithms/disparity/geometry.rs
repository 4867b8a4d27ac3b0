//! Where the windows lie, and which way they may move.

/// Reach of the Lanczos kernel (a = 4) beyond the window, px.
pub(super) const TAPS_PX: usize = 4;

/// Directions in which a shift is possible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axes {
    /// Right-left and up-down.
    Both,
    /// Right-left only: rectified stereo, left-right views.
    Horizontal,
    /// Up-down only: top-bottom views.
    Vertical,
}

impl Axes {
    /// Whether x and y are free.
    pub(super) fn free(self) -> [bool; 2] {
        [self != Self::Vertical, self != Self::Horizontal]
    }
}

/// Nodes at pixel `first + i·stride` on both axes: all whose window and interpolation at shift 0 lie inside the
/// picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Nodes a row.
    pub columns: usize,
    /// Rows of nodes.
    pub rows: usize,
    /// Pixel (column and row) of the first node.
    pub first_px: usize,
    /// Pixels between nodes.
    pub stride_px: usize,
}

impl Grid {
    /// For a picture of `width × height`; `None` where no window fits.
    pub(super) fn new(
        width: usize,
        height: usize,
        window_px: usize,
        stride_px: usize,
    ) -> Option<Self> {
        let first_px = window_px / 2 + TAPS_PX;
        let count = |size: usize| Some((size.checked_sub(2 * first_px + 1)?) / stride_px + 1);
        Some(Self {
            columns: count(width)?,
            rows: count(height)?,
            first_px,
            stride_px,
        })
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// A grid has at least one node.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Pixel (column, row) of node `index`.
    pub fn pixel(&self, index: usize) -> (usize, usize) {
        (
            self.first_px + index % self.columns * self.stride_px,
            self.first_px + index / self.columns * self.stride_px,
        )
    }

    /// Column (or row, with `count` rows) of the node nearest to pixel `p`.
    pub(super) fn nearest(&self, p: usize, count: usize) -> usize {
        let offset = p.saturating_sub(self.first_px) + self.stride_px / 2;
        (offset / self.stride_px).min(count - 1)
    }
}
