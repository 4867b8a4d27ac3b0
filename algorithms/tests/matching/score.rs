//! Matching against the truth and against the Cramér-Rao bound.

use quadpixel_algorithms::disparity::{DisparityMap, MatchSettings, Verdict, match_images};

use quadpixel::image::Image;

use crate::texture::{Texture, picture};

/// One pair and how it is matched; `gain` and `offset` are those of B.
#[derive(Clone, Copy)]
pub struct Case {
    pub size: usize,
    pub seed: u64,
    pub shift: [f64; 2],
    pub noise: f64,
    pub gain: f64,
    pub offset: f64,
    pub settings: MatchSettings,
}

/// What came out: errors and bound in px a single axis, over the valid nodes.
pub struct Score {
    pub rms_px: f64,
    pub bound_px: f64,
    /// √mean of the deviation that the matches themselves claim.
    pub claimed_px: f64,
    pub valid: f64,
}

/// A and B.
pub fn pair(case: &Case) -> [Image; 2] {
    let texture = Texture::white(case.size, case.size, case.seed);
    let still = texture.render(0.85, [0.0, 0.0], None);
    let moved = texture.render(0.85, case.shift, None);
    [
        picture(case.size, &still, 1.0, 0.0, case.noise, case.seed ^ 0xa),
        picture(
            case.size,
            &moved,
            case.gain,
            case.offset,
            case.noise,
            case.seed ^ 0xb,
        ),
    ]
}

/// Matches the pair of `case` and judges the result.
pub fn score(case: &Case) -> Score {
    let [a, b] = pair(case);
    let map = match_images(&a, &b, &case.settings).expect("a proper pair");
    judge(case, &map)
}

/// Holds `map` to the truth of `case`.
pub fn judge(case: &Case, map: &DisparityMap) -> Score {
    let texture = Texture::white(case.size, case.size, case.seed);
    let slopes = [0, 1].map(|axis| texture.render(0.85, [0.0, 0.0], Some(axis)));
    let (mut error, mut bound, mut claimed, mut count) = (0.0, 0.0, 0.0, 0usize);
    let half = case.settings.window_px / 2;
    for ([x, y], found) in map.nodes() {
        if found.verdict != Verdict::Valid {
            continue;
        }
        count += 1;
        let off = [found.dx_px - case.shift[0], found.dy_px - case.shift[1]];
        error += 0.5 * (off[0] * off[0] + off[1] * off[1]);
        claimed += 0.5 * (found.covariance_px2[0] + found.covariance_px2[2]);
        let [mut xx, mut xy, mut yy] = [0.0; 3];
        for row in y as usize - half..=y as usize + half {
            for column in x as usize - half..=x as usize + half {
                let i = row * case.size + column;
                xx += slopes[0][i] * slopes[0][i];
                xy += slopes[0][i] * slopes[1][i];
                yy += slopes[1][i] * slopes[1][i];
            }
        }
        // Half the trace of the inverse; B's noise counts more where its texture is weaker.
        let variance = case.noise * case.noise * (1.0 + 1.0 / (case.gain * case.gain));
        bound += 0.5 * variance * (xx + yy) / (xx * yy - xy * xy);
    }
    let mean = |sum: f64| (sum / count as f64).sqrt();
    Score {
        rms_px: mean(error),
        bound_px: mean(bound),
        claimed_px: mean(claimed),
        valid: count as f64 / map.grid.len() as f64,
    }
}
