//! Matching against the truth and the Cramér-Rao bound, over windows, gains and noise: a Markdown table.
//!
//! `cargo bench -p quadpixel-laboratory --bench matching_accuracy`

#[path = "../../algorithms/tests/matching/score.rs"]
mod score;
#[path = "../../algorithms/tests/matching/texture.rs"]
mod texture;

use quadpixel_algorithms::disparity::MatchSettings;
use score::{Case, score};

const SHIFTS: [[f64; 2]; 5] = [
    [0.25, -0.4],
    [1.37, 0.61],
    [-2.4, 2.4],
    [0.5, 0.5],
    [-0.83, -1.91],
];

fn main() {
    println!(
        "| window | noise | gain, offset | bound px | RMS px | claimed px | efficiency | valid |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for window_px in [15, 21, 31] {
        for (gain, offset) in [(1.0, 0.0), (0.8, 0.05)] {
            for noise in [0.0, 0.005, 0.01, 0.02] {
                let [mut rms, mut bound, mut claimed, mut valid] = [0.0; 4];
                for (i, shift) in SHIFTS.into_iter().enumerate() {
                    let result = score(&Case {
                        size: 301,
                        seed: 100 + i as u64,
                        shift,
                        noise,
                        gain,
                        offset,
                        settings: MatchSettings {
                            window_px,
                            ..MatchSettings::default()
                        },
                    });
                    rms += result.rms_px * result.rms_px / SHIFTS.len() as f64;
                    bound += result.bound_px * result.bound_px / SHIFTS.len() as f64;
                    claimed += result.claimed_px * result.claimed_px / SHIFTS.len() as f64;
                    valid += result.valid / SHIFTS.len() as f64;
                }
                println!(
                    "| {window_px} | {:.1} % | {gain}, {offset} | {:.5} | {:.5} | {:.5} | {:.3} | {:.1} % |",
                    100.0 * noise,
                    bound.sqrt(),
                    rms.sqrt(),
                    claimed.sqrt(),
                    (bound / rms).sqrt(),
                    100.0 * valid
                );
            }
        }
    }
}
