//! A picture reduced to a square while its rows come.

use quadpixel::image::{Image, finite_ranges};

/// An image fitted into a square: reduced by box averages, or enlarged by whole source pixels' copies.
#[derive(Clone, Debug)]
pub struct Thumbnail {
    channels: usize,
    /// Columns and rows of the source.
    source: [usize; 2],
    /// Columns and rows that are shown.
    shown: [usize; 2],
    /// Sums over boxes, row by row.
    sums: Vec<f32>,
    /// Rows of the source that were added.
    rows: usize,
    /// Smallest and largest finite value.
    range: Option<(f32, f32)>,
}

impl Thumbnail {
    /// Of a source of width × height pixels, in a square of `side` px.
    pub fn new((width, height): (usize, usize), channels: usize, side: usize) -> Self {
        let longest = width.max(height);
        let shown = [width, height].map(|n| (n * side / longest).max(1));
        Self {
            channels,
            source: [width, height],
            shown,
            sums: vec![0.0; shown[0] * shown[1] * channels],
            rows: 0,
            range: None,
        }
    }

    /// Of a whole image.
    pub fn of(image: &Image, side: usize) -> Self {
        let size = (image.width(), image.height());
        let mut own = Self::new(size, image.channels(), side);
        own.add(image);
        own
    }

    /// Goes on with some rows, of as many columns and channels as the source.
    pub fn add(&mut self, rows: &Image) {
        let here = self.rows..self.rows + rows.height();
        self.rows = here.end;
        let [columns, lines] = self.shown;
        let channels = self.channels;
        for j in 0..lines {
            let own = self.own(1, j);
            let sums = &mut self.sums[j * columns * channels..][..columns * channels];
            for y in own.start.max(here.start)..own.end.min(here.end) {
                let length = rows.width() * channels;
                let row = &rows.data()[(y - here.start) * length..][..length];
                for (i, sums) in sums.chunks_exact_mut(channels).enumerate() {
                    let own = boxed(i, self.source[0], columns);
                    add_pixels(sums, &row[own.start * channels..own.end * channels]);
                }
            }
        }
        let ranges = finite_ranges(rows).into_iter().flatten();
        self.range = ranges.fold(self.range, |range, [least, largest]| {
            let (low, high) = range.unwrap_or((least, largest));
            Some((least.min(low), largest.max(high)))
        });
    }

    /// Source columns (0) or rows (1) of one that is shown.
    fn own(&self, axis: usize, i: usize) -> std::ops::Range<usize> {
        boxed(i, self.source[axis], self.shown[axis])
    }

    /// Columns and rows that are shown.
    pub fn shown(&self) -> [usize; 2] {
        self.shown
    }

    /// The mean of the source under a place that is shown.
    pub fn mean(&self, i: usize, j: usize, out: &mut Vec<f32>) {
        let count = (self.own(0, i).len() * self.own(1, j).len()) as f32;
        let sums = &self.sums[(j * self.shown[0] + i) * self.channels..][..self.channels];
        out.clear();
        out.extend(sums.iter().map(|sum| sum / count));
    }

    /// Smallest and largest finite value of the source, of all channels.
    pub fn range(&self) -> Option<(f32, f32)> {
        self.range
    }
}

/// Adds pixels to the sums of their channels, one after the other.
fn add_pixels(sums: &mut [f32], pixels: &[f32]) {
    fn of<const N: usize>(sums: &mut [f32], pixels: &[f32]) {
        let ([sums], _) = sums.as_chunks_mut::<N>() else {
            return;
        };
        for pixel in pixels.as_chunks::<N>().0 {
            sums.iter_mut()
                .zip(pixel)
                .for_each(|(sum, value)| *sum += value);
        }
    }
    match sums.len() {
        1 => of::<1>(sums, pixels),
        3 => of::<3>(sums, pixels),
        channels => {
            for pixel in pixels.chunks_exact(channels) {
                (sums.iter_mut().zip(pixel)).for_each(|(sum, value)| *sum += value);
            }
        }
    }
}

/// Places of a source of `source` that place `i` of `shown` stands for.
fn boxed(i: usize, source: usize, shown: usize) -> std::ops::Range<usize> {
    let first = i * source / shown;
    first..((i + 1) * source / shown).max(first + 1)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn rows_one_by_one_give_the_means_of_the_whole() {
        // Reduced with boxes of two sizes, and enlarged.
        for side in [3, 16] {
            let data: Vec<f32> = (0..7 * 8 * 2).map(|v| (v * 37 % 112) as f32).collect();
            let image = Image::from_vec(7, 8, 2, data).unwrap();
            let whole = Thumbnail::of(&image, side);
            let mut by_rows = Thumbnail::new((7, 8), 2, side);
            for row in image.data().chunks(14) {
                by_rows.add(&Image::from_vec(7, 1, 2, row.to_vec()).unwrap());
            }
            assert_eq!(whole.sums, by_rows.sums);
            assert_eq!(by_rows.range(), Some((0.0, 111.0)));
        }
    }

    #[test]
    fn a_box_is_averaged_and_a_pixel_copied() {
        let image = Image::from_vec(2, 2, 1, vec![1.0, 2.0, 3.0, 6.0]).unwrap();
        let mut mean = Vec::new();
        Thumbnail::of(&image, 1).mean(0, 0, &mut mean);
        assert_eq!(mean, [3.0]);
        let large = Thumbnail::of(&image, 4);
        let means: Vec<f32> = (0..4)
            .map(|i| {
                large.mean(i, 3, &mut mean);
                mean[0]
            })
            .collect();
        assert_eq!(means, [3.0, 3.0, 6.0, 6.0]);
    }
}
