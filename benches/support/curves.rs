//! The independent curves of `tests/response/reference`, the pixels that they are of, and errors against them.

use quadpixel::em::PixelStack;
use quadpixel::em::light::Powers;

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

/// The words of the command line.
pub fn words() -> Vec<String> {
    let words = std::env::args().skip(1);
    words.filter(|word| word != "--bench").collect()
}

/// P of the left and the right half of a pixel of two columns.
pub fn halves(powers: &Powers) -> [f64; 2] {
    [0, 1].map(|side| powers.absorbed.iter().skip(side).step_by(2).sum())
}

/// Errors of halves in % of the strong one.
#[derive(Default)]
pub struct Errors {
    pub worst: f64,
    squares: f64,
    count: f64,
}

impl Errors {
    /// Of both halves against the `exact` ones.
    pub fn add(&mut self, halves: [f64; 2], exact: [f64; 2]) -> [f64; 2] {
        let strong = exact[0].max(exact[1]);
        let errors = [0, 1].map(|i| 100.0 * (halves[i] - exact[i]) / strong);
        self.worst = errors.iter().fold(self.worst, |w, e| w.max(e.abs()));
        self.squares += errors[0] * errors[0] + errors[1] * errors[1];
        self.count += 2.0;
        errors
    }

    pub fn rms(&self) -> f64 {
        (self.squares / self.count).sqrt()
    }
}
