//! The independent curves of `tests/response/reference`, and the pixels that they are of.

use quadpixel::em::PixelStack;

macro_rules! curve {
    ($name:literal) => {
        include_str!(concat!("../../tests/response/reference/", $name, ".csv"))
    };
}

/// A pixel by its name on the command line, and lines of θ in degrees and P of left and right half under s, then under
/// p.
pub fn reference(pixel: &str) -> (PixelStack, Vec<Vec<f64>>) {
    let (stack, csv) = match pixel {
        "1.6" => (
            PixelStack::paper(1.6, 1.1314, 1.1314, 0.75),
            curve!("pitch1.6_roc1.1314_h1.1314_filter0.75"),
        ),
        "1.6-flat" => (
            PixelStack::paper(1.6, 1.6, 1.1314, 0.75),
            curve!("pitch1.6_roc1.6_h1.1314_filter0.75"),
        ),
        "2.8" => (
            PixelStack::paper(2.8, 1.98, 1.98, 0.75),
            curve!("pitch2.8_roc1.98_h1.98_filter0.75"),
        ),
        "2.8-flat" => (
            PixelStack::paper(2.8, 2.8, 1.98, 0.75),
            curve!("pitch2.8_roc2.8_h1.98_filter0.75"),
        ),
        // The file's own head says 2.48, not the 2.475 of its name.
        "3.5-roc3.5" => (
            PixelStack::paper(3.5, 3.5, 2.48, 1.0),
            curve!("pitch3.5_roc3.5_h2.475_filter1.0"),
        ),
        _ => (
            PixelStack::paper(3.5, 2.475, 2.475, 1.0),
            curve!("pitch3.5_roc2.475_h2.475_filter1.0"),
        ),
    };
    let lines = csv.lines();
    let lines = lines.filter(|l| l.starts_with(|c: char| c.is_ascii_digit()));
    (stack, lines.map(numbers).collect())
}

/// Numbers parted by commas.
pub fn numbers(text: &str) -> Vec<f64> {
    text.split(',').map(|x| x.parse().unwrap()).collect()
}
