//! Numbers as colours: one scale for sizes, one for signed values, one for directions.

/// An 8-bit sRGB colour.
pub type Rgb = [u8; 3];

/// Viridis (van der Walt & Smith, CC0) at eight places, interpolated; 0 dark violet, 1 yellow.
pub fn viridis(t: f32) -> Rgb {
    const STOPS: [Rgb; 8] = [
        [68, 1, 84],
        [70, 50, 127],
        [54, 92, 141],
        [39, 127, 142],
        [31, 161, 135],
        [74, 194, 109],
        [159, 218, 58],
        [253, 231, 37],
    ];
    blend(&STOPS, t)
}

/// Blue at 0 (negative) over white to red at 1 (positive).
pub fn blue_white_red(t: f32) -> Rgb {
    const STOPS: [Rgb; 5] = [
        [33, 102, 172],
        [146, 197, 222],
        [247, 247, 247],
        [244, 165, 130],
        [178, 24, 43],
    ];
    blend(&STOPS, t)
}

fn blend(stops: &[Rgb], t: f32) -> Rgb {
    let place = t.clamp(0.0, 1.0) * (stops.len() - 1) as f32;
    let low = (place as usize).min(stops.len() - 2);
    let part = place - low as f32;
    std::array::from_fn(|c| {
        let (a, b) = (f32::from(stops[low][c]), f32::from(stops[low + 1][c]));
        (a + (b - a) * part).round() as u8
    })
}

/// Direction (x to the right, y down) as hue, right red, down yellow-green, left cyan, up violet; `length` 0 to 1 as
/// saturation, so that no length is white.
pub fn direction([x, y]: [f64; 2], length: f64) -> Rgb {
    let hue = y.atan2(x).to_degrees().rem_euclid(360.0) / 60.0;
    let saturation = length.clamp(0.0, 1.0);
    // From HSV of full value: each primary falls off linearly from its own hue (0, 2, 4).
    [0.0, 2.0, 4.0].map(|primary: f64| {
        let apart = (hue - primary).abs().min(6.0 - (hue - primary).abs());
        let pure = (2.0 - apart).clamp(0.0, 1.0);
        (255.0 * (1.0 - saturation * (1.0 - pure))).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_end_in_their_stops_and_clamp() {
        assert_eq!(viridis(-1.0), [68, 1, 84]);
        assert_eq!(viridis(2.0), [253, 231, 37]);
        assert_eq!(blue_white_red(0.5), [247, 247, 247]);
    }

    #[test]
    fn directions_stand_on_the_hue_circle() {
        assert_eq!(direction([1.0, 0.0], 1.0), [255, 0, 0]);
        assert_eq!(direction([-1.0, 0.0], 1.0), [0, 255, 255]);
        assert_eq!(direction([0.0, 1.0], 1.0), [128, 255, 0]);
        assert_eq!(direction([0.0, -1.0], 1.0), [128, 0, 255]);
        assert_eq!(direction([1.0, 0.0], 0.0), [255, 255, 255]);
    }
}
