//! Figures of a pair of kernels, found alike in measured and in predicted ones.

use serde::Serialize;

use super::measurements::{centroid_px, sum_of};

/// Rows about the middle that the share is read from, in diameters of the disk.
const BAND: f64 = 0.15;
/// Where the share is read at the edges, in radii: nearer the rim the blur mixes in what lies beside the disk.
const EDGE: f64 = 0.9;
/// Columns with less than this part of the brightest one's light have no share.
const DARK: f64 = 0.15;

/// Figures of one field.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FieldFigures {
    /// x of the left kernel's centroid minus x of the right one's, px.
    pub shift_px: f64,
    /// Diameter of the disk of both together: of its area above half of its plateau, px.
    pub disk_px: f64,
    /// |shift| over diameter.
    pub shift_over_disk: f64,
    /// Σ min(L, R).
    pub overlap: f64,
    /// Share of the left view at −0.9 and +0.9 radii along x.
    pub edges: [f64; 2],
    /// Where the halves are equal along x, radii from the disk's middle; `None` where they are nowhere.
    pub equal_halves: Option<f64>,
}

impl FieldFigures {
    /// Of kernels of sum 1, the left of which gets `left_part` of the light.
    pub fn new(views: &[Vec<f64>; 2], left_part: f64, side: usize) -> Self {
        let [left, right] = [0, 1].map(|k| centroid_px(&views[k], side)[0]);
        let sum = sum_of(views, left_part);
        let (disk_px, centre) = disk(&sum, side);
        let pairs = views[0].iter().zip(&views[1]);
        let share = Share::new(views, left_part, side, (disk_px, centre));
        Self {
            shift_px: left - right,
            disk_px,
            shift_over_disk: (left - right).abs() / disk_px,
            overlap: pairs.map(|(l, r)| l.min(*r)).sum(),
            edges: [-EDGE, EDGE].map(|x| share.at(x)),
            equal_halves: share.half(),
        }
    }
}

/// Diameter and middle (column, row) of a disk, px.
fn disk(sum: &[f64], side: usize) -> (f64, [f64; 2]) {
    let most = sum.iter().copied().fold(0.0, f64::max);
    let mut bright: Vec<f64> = sum.iter().copied().filter(|s| *s > 0.3 * most).collect();
    bright.sort_by(f64::total_cmp);
    let plateau = bright.get(bright.len() / 2).copied().unwrap_or(most);
    let (mut count, mut x, mut y) = (0.0, 0.0, 0.0);
    for (i, s) in sum.iter().enumerate() {
        if *s > 0.5 * plateau {
            count += 1.0;
            x += (i % side) as f64;
            y += (i / side) as f64;
        }
    }
    let diameter = 2.0 * (count / std::f64::consts::PI).sqrt();
    (diameter, [x / count, y / count])
}

/// Share of the left view along x through the disk's middle.
struct Share {
    /// (radii, share), by columns with light.
    samples: Vec<[f64; 2]>,
}

impl Share {
    fn new(
        views: &[Vec<f64>; 2],
        left_part: f64,
        side: usize,
        (disk_px, centre): (f64, [f64; 2]),
    ) -> Self {
        let rows: Vec<usize> = (0..side)
            .filter(|&j| (j as f64 - centre[1]).abs() <= BAND * disk_px)
            .collect();
        let light = |view: &[f64], i: usize| rows.iter().map(|j| view[j * side + i]).sum::<f64>();
        let columns: Vec<[f64; 2]> = (0..side)
            .map(|i| {
                let [l, r] = [0, 1].map(|k| light(&views[k], i));
                [left_part * l, (1.0 - left_part) * r]
            })
            .collect();
        let most = columns.iter().map(|[l, r]| l + r).fold(0.0, f64::max);
        let lit = columns
            .iter()
            .enumerate()
            .filter(|(_, [l, r])| l + r > DARK * most);
        let samples =
            lit.map(|(i, [l, r])| [(i as f64 - centre[0]) / (0.5 * disk_px), l / (l + r)]);
        Self {
            samples: samples.collect(),
        }
    }

    fn at(&self, x: f64) -> f64 {
        let after = self.samples.partition_point(|s| s[0] < x);
        match (
            after.checked_sub(1).and_then(|k| self.samples.get(k)),
            self.samples.get(after),
        ) {
            (Some(a), Some(b)) => a[1] + (b[1] - a[1]) * (x - a[0]) / (b[0] - a[0]),
            (Some(end), None) | (None, Some(end)) => end[1],
            (None, None) => f64::NAN,
        }
    }

    fn half(&self) -> Option<f64> {
        let pairs = self.samples.windows(2);
        let crossings = pairs.filter(|w| (w[0][1] - 0.5) * (w[1][1] - 0.5) <= 0.0);
        let places = crossings.map(|w| {
            let part = (w[0][1] - 0.5) / (w[0][1] - w[1][1]);
            w[0][0] + part * (w[1][0] - w[0][0])
        });
        places.min_by(|a, b| a.abs().total_cmp(&b.abs()))
    }
}

/// RMS of the difference of two pairs of kernels over the RMS of the first.
pub fn relative_rms(measured: &[Vec<f64>; 2], predicted: &[Vec<f64>; 2]) -> f64 {
    let (mut difference, mut size) = (0.0, 0.0);
    for (m, p) in measured.iter().zip(predicted) {
        for (m, p) in m.iter().zip(p) {
            difference += (m - p) * (m - p);
            size += m * m;
        }
    }
    (difference / size).sqrt()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn half_disks_shift_by_0_424_diameters_and_do_not_overlap() {
        // Centroid of a half disk: 4/(3π) of the radius from its straight edge, so that the halves lie 4/(3π) of the
        // diameter apart.
        let side = 81;
        let mut views = [vec![0.0; side * side], vec![0.0; side * side]];
        let mut light = [0.0; 2];
        for i in 0..views[0].len() {
            let (x, y) = ((i % side) as f64 - 40.0, (i / side) as f64 - 40.0);
            let half = usize::from(x > 0.25);
            if x.hypot(y) < 30.0 {
                views[half][i] = 1.0;
                light[half] += 1.0;
            }
        }
        for (view, light) in views.iter_mut().zip(light) {
            view.iter_mut().for_each(|v| *v /= light);
        }
        let figures = FieldFigures::new(&views, light[0] / (light[0] + light[1]), side);
        assert!((figures.disk_px - 60.0).abs() < 0.3, "{figures:?}");
        assert!(
            (figures.shift_over_disk - 0.4244).abs() < 0.003,
            "{figures:?}"
        );
        assert_eq!(figures.overlap, 0.0);
        assert_eq!(figures.edges, [1.0, 0.0]);
        assert!(figures.equal_halves.unwrap().abs() < 0.04, "{figures:?}");
        assert_eq!(relative_rms(&views, &views), 0.0);
    }
}
