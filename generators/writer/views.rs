//! The mosaic taken apart: one view a sub-pixel, sums of views, left and right halves.

use quadpixel::image::Image;

/// The view of each sub-pixel in stored order (row by row): view (i, j) takes mosaic pixel (x·m + i, y·n + j).
pub fn split_views(raw: &Image, columns: usize, rows: usize) -> Vec<Image> {
    let (width, height) = (raw.width() / columns, raw.height() / rows);
    let view = |index: usize| {
        let (i, j) = (index % columns, index / columns);
        let mut view = Image::zeros(width, height, raw.channels());
        for y in 0..height {
            for x in 0..width {
                let from = raw.pixel(x * columns + i, y * rows + j);
                view.pixel_mut(x, y).copy_from_slice(from);
            }
        }
        view
    };
    (0..columns * rows).map(view).collect()
}

/// The sum of images of one size, added in f64 in the order given.
pub fn sum_of<'a>(images: impl IntoIterator<Item = &'a Image>) -> Option<Image> {
    let images: Vec<&Image> = images.into_iter().collect();
    let first = images.first()?;
    let (width, height, channels) = (first.width(), first.height(), first.channels());
    let total = |i: usize| {
        images
            .iter()
            .map(|image| f64::from(image.data()[i]))
            .sum::<f64>() as f32
    };
    let data = (0..first.data().len()).map(total).collect();
    Image::from_vec(width, height, channels, data)
}

/// Indices of the sub-pixels that see the left and the right half of the pupil (a middle column sees neither); empty for a
/// pixel of one column.
pub fn left_right(columns: usize, rows: usize) -> (Vec<usize>, Vec<usize>) {
    let half = columns / 2;
    let of = |wanted: std::ops::Range<usize>| {
        (0..columns * rows)
            .filter(|index| wanted.contains(&(index % columns)))
            .collect()
    };
    (of(0..half), of(columns - half..columns))
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn the_quad_mosaic_comes_apart_as_b_a_over_d_c() {
        // One pixel: B = 1, A = 2 above, D = 3, C = 4 below.
        let raw = Image::from_vec(2, 2, 1, vec![1.0, 2.0, 3.0, 4.0]).unwrap();
        let views = split_views(&raw, 2, 2);
        let values: Vec<f32> = views.iter().map(|view| view.data()[0]).collect();
        assert_eq!(values, [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(
            datasets_spec::paths::subpixel_names(2, 2),
            ["B", "A", "D", "C"]
        );
        let (left, right) = left_right(2, 2);
        let total = |side: &[usize]| sum_of(side.iter().map(|&i| &views[i])).unwrap().data()[0];
        assert_eq!((total(&left), total(&right)), (4.0, 6.0)); // L = B + D, R = A + C
    }

    #[test]
    fn a_middle_column_sees_neither_half() {
        assert_eq!(left_right(3, 1), (vec![0], vec![2]));
        assert_eq!(left_right(1, 2), (vec![], vec![]));
        assert!(sum_of([]).is_none());
    }
}
