//! What `meta.json` says of the values of the truth, found while their rows come.

use quadpixel::image::{Image, finite_ranges};
use quadpixel_datasets::{CocDisparity, Range, Ranges};

use super::truth::Truth;

/// Root-mean-square circle of confusion, px, below which its ratio to the disparity means nothing.
const LEAST_DEFOCUS_PX: f64 = 0.5;

/// Counts, ranges and sums over the pixels of a sample.
#[derive(Clone, Debug, Default)]
pub(super) struct Findings {
    /// Pixels without truth.
    pub invalid: u64,
    /// Over the finite values.
    pub ranges: Ranges,
    /// Of the traced disparity, and of the paraxial; `None` before the first row and for a pixel of one column.
    ratios: [Option<Ratio>; 2],
}

/// Sums over the valid pixels: x_L − x_R times the circle of confusion c, c², 1.
#[derive(Clone, Copy, Debug, Default)]
struct Ratio {
    along: f64,
    square: f64,
    count: f64,
}

impl Findings {
    /// Goes on with some rows.
    pub fn add(&mut self, truth: &Truth) {
        self.invalid += truth.valid.iter().filter(|valid| !**valid).count() as u64;
        let depth = truth.depth_m.data();
        self.ranges.sky_pixels += depth.iter().filter(|z| z.is_infinite()).count() as u64;
        let ranges = &mut self.ranges;
        grow([&mut ranges.depth_m], &truth.depth_m);
        grow([&mut ranges.coc_px], &truth.coc_px);
        for map in &truth.disparity_px {
            grow([&mut ranges.dx_px, &mut ranges.dy_px], map);
        }
        let Some(maps) = &truth.left_right_px else {
            return;
        };
        for (ratio, map) in self.ratios.iter_mut().zip(maps) {
            let sums = ratio.get_or_insert_default();
            for (&d, &c) in map.data().iter().zip(truth.coc_px.data()) {
                if d.is_finite() && c.is_finite() {
                    sums.along += f64::from(d) * f64::from(c);
                    sums.square += f64::from(c) * f64::from(c);
                    sums.count += 1.0;
                }
            }
        }
    }

    /// −Σ (x_L − x_R) c / Σ c² over the valid pixels, for the traced and the paraxial disparity.
    pub fn coc_disparity(&self) -> Option<CocDisparity> {
        let ratio = |sums: Ratio| {
            let means_something = sums.square > sums.count * LEAST_DEFOCUS_PX * LEAST_DEFOCUS_PX;
            means_something.then(|| -sums.along / sums.square)
        };
        let [traced, paraxial] = self.ratios;
        Some(CocDisparity {
            traced_ratio: ratio(traced?)?,
            paraxial_ratio: ratio(paraxial?)?,
        })
    }
}

/// Takes the values of a map's first channels into their ranges.
fn grow<const N: usize>(ranges: [&mut Option<Range>; N], map: &Image) {
    for (range, own) in ranges.into_iter().zip(finite_ranges(map)) {
        let Some([least, largest]) = own.map(|own| own.map(f64::from)) else {
            continue;
        };
        let (min, max) = range.map_or((least, largest), |r| (r.min.min(least), r.max.max(largest)));
        *range = Some(Range { min, max });
    }
}
