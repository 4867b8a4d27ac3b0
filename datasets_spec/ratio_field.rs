//! Numbers at the nodes of a grid over a window.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// κ over the window: values at the nodes of a regular grid that spans it, bilinear between them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RatioField {
    /// Mean over the nodes: the one number for those that need one.
    pub mean: f64,
    /// Nodes along x: the first on the outer edge of column 0, the last on that of the last column.
    pub columns: u32,
    /// Nodes along y: the first on the outer edge of row 0, the last on that of the last row.
    pub rows: u32,
    /// Values at the nodes, row by row. Where one of the halves gets no light the mean stands.
    pub values: Vec<f64>,
}

impl RatioField {
    /// A field of `columns` × `rows` nodes from its values, row by row, `None` where there is none. `None` if no node
    /// has a value, or their number does not fit.
    pub fn new(columns: u32, rows: u32, values: &[Option<f64>]) -> Option<Self> {
        let known: Vec<f64> = values.iter().flatten().copied().collect();
        let fits = values.len() as u64 == u64::from(columns) * u64::from(rows);
        if known.is_empty() || !fits {
            return None;
        }
        let mean = known.iter().sum::<f64>() / known.len() as f64;
        let values = values.iter().map(|value| value.unwrap_or(mean)).collect();
        Some(Self {
            mean,
            columns,
            rows,
            values,
        })
    }

    /// Whether there are two nodes or more in each direction and a value at each.
    pub fn is_sound(&self) -> bool {
        let count = u64::from(self.columns) * u64::from(self.rows);
        self.columns > 1 && self.rows > 1 && self.values.len() as u64 == count
    }

    /// κ at column x and row y of a window of `width_px` × `height_px` (pixel centres have integer coordinates); beside
    /// the window that of its edge. The mean if the field is not [sound](Self::is_sound).
    pub fn at(&self, [x, y]: [f64; 2], [width_px, height_px]: [u32; 2]) -> f64 {
        if !self.is_sound() {
            return self.mean;
        }
        let size_px = [width_px, height_px];
        let [value] = bilinear([x, y], size_px, [self.columns, self.rows], |i| {
            [self.values[i]]
        });
        value
    }
}

/// Values at column x and row y of a window, from `nodes` columns × rows (two or more each) that span it.
pub(crate) fn bilinear<const N: usize>(
    at: [f64; 2],
    size_px: [u32; 2],
    nodes: [u32; 2],
    value: impl Fn(usize) -> [f64; N],
) -> [f64; N] {
    let [(i, fx), (j, fy)] = [0, 1].map(|axis| {
        let last = f64::from(nodes[axis] - 1);
        let place = ((at[axis] + 0.5) / f64::from(size_px[axis]) * last).clamp(0.0, last);
        let node = (place as usize).min(nodes[axis] as usize - 2);
        (node, place - node as f64)
    });
    let columns = nodes[0] as usize;
    let corner = |di: usize, dj: usize| value((j + dj) * columns + i + di);
    let (a, b, c, d) = (corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1));
    std::array::from_fn(|k| {
        let top = a[k] + fx * (b[k] - a[k]);
        let bottom = c[k] + fx * (d[k] - c[k]);
        top + fy * (bottom - top)
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn a_bilinear_field_is_met_everywhere_and_held_at_the_edge() {
        let plane = |x: f64, y: f64| 0.4 + 0.01 * x - 0.02 * y + 0.003 * x * y;
        let (width, height) = (8.0, 4.0);
        // Nodes on the outer edges: x from −0.5 to 7.5, y from −0.5 to 3.5.
        let node = |k: usize| {
            let (x, y) = ((k % 3) as f64 / 2.0 * width, (k / 3) as f64 * height);
            Some(plane(x - 0.5, y - 0.5))
        };
        let field = RatioField::new(3, 2, &(0..6).map(node).collect::<Vec<_>>()).unwrap();
        for [x, y] in [[0.0, 0.0], [3.25, 1.5], [7.0, 3.0], [7.5, -0.5]] {
            let at = field.at([x, y], [8, 4]);
            assert!((at - plane(x, y)).abs() < 1e-12, "{x} {y}: {at}");
        }
        assert_eq!(
            field.at([90.0, 90.0], [8, 4]),
            *field.values.last().unwrap()
        );
    }

    #[test]
    fn a_dark_node_takes_the_mean_and_a_field_without_light_is_none() {
        let field = RatioField::new(2, 2, &[Some(0.2), None, Some(0.4), Some(0.6)]).unwrap();
        assert!((field.mean - 0.4).abs() < 1e-15 && field.values[1] == field.mean);
        assert!(RatioField::new(2, 2, &[None; 4]).is_none());
        assert!(RatioField::new(2, 2, &[Some(0.1); 3]).is_none());
        // A file may say anything: no panic.
        let broken = RatioField {
            columns: 7,
            ..field
        };
        assert_eq!(broken.at([0.0, 0.0], [4, 4]), broken.mean);
    }
}
