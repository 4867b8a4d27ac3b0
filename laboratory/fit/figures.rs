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
    /// Diameter of the disk of both together, of the area within its edge, px.
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
        let (disk_px, centre) = Disk { sum: &sum, side }.size_and_middle();
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

/// A disk out of focus, as both views together have it.
///
/// Its edge lies where the light falls most steeply outwards, as that of a blurred step does, however bright the disk
/// is there: coma makes one side several times as bright as the other, and one level for all would cut the dim side.
/// (It is found a fraction of a pixel inside of the true one.)
struct Disk<'a> {
    sum: &'a [f64],
    side: usize,
}

/// Directions that the edge is looked for in, and steps of the search, px; the light is its mean over so many of them.
const DIRECTIONS: usize = 120;
const STEP: f64 = 0.25;
const MEAN_OF: usize = 5;
/// Part of the radius within which there is no edge.
const INNER: f64 = 0.5;
/// Light below this part of the brightest pixel is no disk's.
const FAINT: f64 = 0.05;
/// Moves of the middle to that of the area within the edge.
const MOVES: usize = 3;

impl Disk<'_> {
    /// Diameter and middle (column, row), px.
    fn size_and_middle(&self) -> (f64, [f64; 2]) {
        let most = self.sum.iter().copied().fold(0.0, f64::max);
        let lit: Vec<[f64; 2]> = (0..self.sum.len())
            .filter(|&i| self.sum[i] > FAINT * most)
            .map(|i| [(i % self.side) as f64, (i / self.side) as f64])
            .collect();
        let mean = |axis: usize| lit.iter().map(|p| p[axis]).sum::<f64>() / lit.len() as f64;
        let mut middle = [mean(0), mean(1)];
        let mut diameter = diameter_of(lit.len() as f64);
        for _ in 0..MOVES {
            let inner = INNER * 0.5 * diameter;
            let edge: Vec<[f64; 2]> = (0..DIRECTIONS)
                .map(|k| {
                    let angle = std::f64::consts::TAU * k as f64 / DIRECTIONS as f64;
                    let (sin, cos) = angle.sin_cos();
                    let radius = self.edge(middle, [cos, sin], inner);
                    [middle[0] + radius * cos, middle[1] + radius * sin]
                })
                .collect();
            let (area, centre) = polygon(&edge);
            (diameter, middle) = (diameter_of(area), centre);
        }
        (diameter, middle)
    }

    /// How far the edge lies from the middle.
    fn edge(&self, middle: [f64; 2], towards: [f64; 2], inner: f64) -> f64 {
        let count = (self.side as f64 / STEP) as usize;
        let light: Vec<f64> = (0..count)
            .map(|k| {
                let r = STEP * k as f64;
                self.at([middle[0] + r * towards[0], middle[1] + r * towards[1]])
            })
            .collect();
        let smooth: Vec<f64> = light
            .windows(MEAN_OF)
            .map(|w| w.iter().sum::<f64>())
            .collect();
        let falls: Vec<f64> = smooth.windows(2).map(|w| w[0] - w[1]).collect();
        let first = (inner / STEP) as usize;
        let steepest = (first..falls.len()).max_by(|&a, &b| falls[a].total_cmp(&falls[b]));
        let Some(k) = steepest else {
            return inner;
        };
        // The vertex of the parabola through the steepest fall and its neighbours.
        let around = |k: usize| falls.get(k).copied().unwrap_or(0.0);
        let (before, here, after) = (around(k.saturating_sub(1)), falls[k], around(k + 1));
        let bend = before - 2.0 * here + after;
        let part = match bend < 0.0 {
            true => (0.5 * (before - after) / bend).clamp(-0.5, 0.5),
            false => 0.0,
        };
        // A fall lies between two means, each of them half a window on from its first sample.
        STEP * (k as f64 + part + 0.5 * MEAN_OF as f64)
    }

    /// Linear between pixels; nothing beyond them.
    fn at(&self, [x, y]: [f64; 2]) -> f64 {
        let pixel = |x: f64, y: f64| {
            let inside = |c: f64| (0.0..self.side as f64).contains(&c);
            match inside(x) && inside(y) {
                true => self.sum[y as usize * self.side + x as usize],
                false => 0.0,
            }
        };
        let (left, top) = (x.floor(), y.floor());
        let (a, b) = (x - left, y - top);
        let row = |y: f64| (1.0 - a) * pixel(left, y) + a * pixel(left + 1.0, y);
        (1.0 - b) * row(top) + b * row(top + 1.0)
    }
}

fn diameter_of(area: f64) -> f64 {
    2.0 * (area / std::f64::consts::PI).sqrt()
}

/// Area and centroid of a polygon.
fn polygon(corners: &[[f64; 2]]) -> (f64, [f64; 2]) {
    let (mut area, mut x, mut y) = (0.0, 0.0, 0.0);
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let cross = a[0] * b[1] - b[0] * a[1];
        area += 0.5 * cross;
        x += cross * (a[0] + b[0]) / 6.0;
        y += cross * (a[1] + b[1]) / 6.0;
    }
    (area, [x / area, y / area])
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
    fn the_edge_of_a_disk_four_times_as_bright_on_one_side_is_found_all_round() {
        // A step blurred by σ = 2 px, summed over a disk of radius R = 12 px whose light is w = 1 − 0.6 x/R.
        let (side, radius) = (61, 12.0);
        let blurred = |x: f64, y: f64| {
            let mut sum = 0.0;
            for j in -30..=30 {
                for i in -30..=30 {
                    let (a, b) = (0.5 * f64::from(i), 0.5 * f64::from(j));
                    if a.hypot(b) <= radius {
                        let weight = 1.0 - 0.6 * a / radius;
                        let away = (x - 31.0 - a).powi(2) + (y - 29.0 - b).powi(2);
                        sum += weight * (-away / 8.0).exp();
                    }
                }
            }
            sum
        };
        let sum: Vec<f64> = (0..side * side)
            .map(|i| blurred((i % side) as f64, (i / side) as f64))
            .collect();
        let disk = Disk { sum: &sum, side };
        let (diameter, middle) = disk.size_and_middle();
        // To first order a blurred edge falls most steeply σ²/(2 R) inside, where it is curved, and σ² w'/w beyond,
        // where the light rises outwards by w': in the mean over all directions −1/6 and −1/12 px, and the middle of
        // the edge lies twice the mean of cos φ times it, 0.278 px, towards the bright side.
        assert!(
            (diameter - (24.0 - 2.0 / 6.0 - 2.0 / 12.0)).abs() < 0.2,
            "{diameter}"
        );
        assert!((middle[0] - (31.0 - 0.278)).abs() < 0.03, "{middle:?}");
        assert!((middle[1] - 29.0).abs() < 0.05, "{middle:?}");
    }

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
