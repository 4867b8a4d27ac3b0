//! Pixels of a plane in the order in which the sums of a tile run (see [`super::tile`]).

/// Pixels of a plane by phases: \[row\]\[phase\]\[lane\], from pixel (x, y) on; `outside` beyond the plane.
pub(super) struct Phases {
    data: Vec<f32>,
    phases: usize,
    pub lanes: usize,
}

impl Phases {
    /// `stride, phases, lanes, rows`: of the layout; `level`: what is taken off.
    #[inline(always)]
    pub fn new(
        plane: (&[f32], usize),
        from: [isize; 2],
        [stride, phases, lanes, rows]: [usize; 4],
        level: f32,
        outside: f32,
    ) -> Self {
        let (pixels, width) = plane;
        let mut data = vec![outside; rows * phases * lanes];
        for (r, to) in data.chunks_exact_mut(phases * lanes).enumerate() {
            let Some(y) = usize::try_from(from[1] + r as isize).ok() else {
                continue;
            };
            let Some(row) = pixels.get(y * width..(y + 1) * width) else {
                continue;
            };
            for (c, to) in to.chunks_exact_mut(lanes).enumerate() {
                let first = from[0] + c as isize;
                let skipped = (-first).max(0) as usize;
                let skipped = skipped.div_ceil(stride).min(lanes);
                let start = (first + (skipped * stride) as isize) as usize;
                let Some(row) = row.get(start..) else {
                    continue;
                };
                for (to, v) in to[skipped..].iter_mut().zip(row.iter().step_by(stride)) {
                    *to = v - level;
                }
            }
        }
        Self {
            data,
            phases,
            lanes,
        }
    }

    #[inline(always)]
    pub fn row(&self, r: usize) -> &[f32] {
        let length = self.phases * self.lanes;
        &self.data[r * length..(r + 1) * length]
    }
}
