//! The range of an image's numbers.

use super::Image;

/// Least and largest finite value of each channel; `None` where there is none.
pub fn finite_ranges(image: &Image) -> Vec<Option<[f32; 2]>> {
    let channels = image.channels();
    // As many lanes as make whole pixels, side by side.
    match channels {
        1 | 2 | 4 => by_lanes::<16>(image.data(), channels),
        3 => by_lanes::<12>(image.data(), channels),
        _ => {
            let values = |c: usize| image.data().iter().skip(c).step_by(channels);
            (0..channels)
                .map(|c| found(values(c).fold(NONE, |range, v| grown(range, *v))))
                .collect()
        }
    }
}

/// Of no value.
const NONE: [f32; 2] = [f32::INFINITY, f32::NEG_INFINITY];

#[inline(always)]
fn grown([least, largest]: [f32; 2], value: f32) -> [f32; 2] {
    let is_finite = value.abs() < f32::INFINITY;
    let [low, high] = if is_finite { [value; 2] } else { NONE };
    // Not `min` and `max`, which look after NaN, too.
    [
        if low < least { low } else { least },
        if high > largest { high } else { largest },
    ]
}

fn found([least, largest]: [f32; 2]) -> Option<[f32; 2]> {
    (least <= largest).then_some([least, largest])
}

fn by_lanes<const N: usize>(data: &[f32], channels: usize) -> Vec<Option<[f32; 2]>> {
    let [mut least, mut largest] = NONE.map(|none| [none; N]);
    let (whole, rest) = data.as_chunks::<N>();
    for values in whole {
        for i in 0..N {
            [least[i], largest[i]] = grown([least[i], largest[i]], values[i]);
        }
    }
    let mut lanes: Vec<[f32; 2]> = (least.into_iter().zip(largest))
        .map(|(a, b)| [a, b])
        .collect();
    (lanes.iter_mut().zip(rest)).for_each(|(lane, value)| *lane = grown(*lane, *value));
    let of_channel = |c: usize| {
        let lanes = lanes.iter().skip(c).step_by(channels);
        found(lanes.fold(NONE, |[a, b], [c, d]| [a.min(*c), b.max(*d)]))
    };
    (0..channels).map(of_channel).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)] // because tests fail by panicking
mod tests {
    use super::*;

    #[test]
    fn ranges_are_those_of_each_channel_and_of_finite_values_alone() {
        for channels in 1..=5 {
            for pixels in [1, 3, 40] {
                let value = |i: usize| ((i * 37) % 101) as f32 - 50.0;
                let mut data: Vec<f32> = (0..pixels * channels).map(value).collect();
                if pixels > 3 {
                    data[channels] = f32::INFINITY;
                    data[2 * channels] = f32::NAN;
                    data[3 * channels] = f32::NEG_INFINITY;
                }
                let image = Image::from_vec(pixels, 1, channels, data.clone()).unwrap();
                for (c, range) in finite_ranges(&image).into_iter().enumerate() {
                    let own = || {
                        data.iter()
                            .skip(c)
                            .step_by(channels)
                            .filter(|v| v.is_finite())
                    };
                    let least = own().copied().fold(f32::INFINITY, f32::min);
                    let largest = own().copied().fold(f32::NEG_INFINITY, f32::max);
                    assert_eq!(range, Some([least, largest]));
                }
            }
        }
        let none = Image::from_vec(2, 1, 1, vec![f32::NAN, f32::INFINITY]).unwrap();
        assert_eq!(finite_ranges(&none), [None]);
    }
}
