//! Where a node's number lies in memory.
//!
//! A component is one array of rows along x; a row has `stride` places, a multiple of 16 (one AVX-512 vector), of which
//! `lanes` are nodes. A layer has the rows j = −2 … ny + 1: those below 0 and from ny on hold what lies beyond the
//! sides. In x, nodes to nx + 1 have places of their own, and those at −1 and −2 are the last places of the row before.

/// Numbers in a vector of the widest kind.
pub(super) const VECTOR: usize = 16;

/// Sizes of rows and layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub nx: usize,
    pub ny: usize,
    /// Nodes that are stepped in a row: nx, or nx + 1 between mirrors.
    pub lanes: usize,
    /// Rows that are stepped: ny, or ny + 1 between mirrors.
    pub rows: usize,
    /// Places that are stepped in a row, the lanes made full vectors.
    pub width: usize,
    /// Places of a row.
    pub stride: usize,
}

impl Layout {
    pub fn new(nx: usize, ny: usize, mirror_x: bool, mirror_y: bool) -> Self {
        let lanes = nx + usize::from(mirror_x);
        let width = lanes.next_multiple_of(VECTOR);
        Self {
            nx,
            ny,
            lanes,
            rows: ny + usize::from(mirror_y),
            width,
            stride: (nx + 4).next_multiple_of(VECTOR),
        }
    }

    /// Places of a layer.
    pub fn layer(&self) -> usize {
        (self.ny + 4) * self.stride
    }

    /// Place of node (0, j) of a layer; j from −2.
    pub fn at(&self, layer: usize, j: isize) -> usize {
        layer * self.layer() + (j + 2) as usize * self.stride
    }

    /// Places of `layers` layers; the last row's neighbours exist as well.
    pub fn places(&self, layers: usize) -> usize {
        layers * self.layer() + 4 * self.stride
    }
}
