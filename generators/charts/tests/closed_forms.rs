//! Charts against their closed forms.

use super::*;
use rustfft::{FftPlanner, num_complex::Complex64};

#[test]
fn checkerboard_is_exact_when_squares_fit_the_raster() {
    let board = Checkerboard {
        squares: 4.0,
        ..Checkerboard::default()
    };
    let t = board.draw(128).unwrap();
    for (x, y) in [(0, 0), (31, 31), (32, 32), (127, 127), (65, 1)] {
        assert_eq!(t.texel(x, y)[0], 0.8, "{x} {y}");
    }
    for (x, y) in [(32, 0), (31, 32), (127, 0)] {
        assert_eq!(t.texel(x, y)[0], 0.05, "{x} {y}");
    }
    assert!((t.mean()[0] - 0.425).abs() < 1e-6);
    // Squares of half a texel cannot be shown: grey.
    let fine = Checkerboard {
        squares: 256.0,
        ..Checkerboard::default()
    };
    assert!(
        bits(&fine.draw(128).unwrap())
            .iter()
            .all(|v| (f32::from_bits(v[0]) - 0.425).abs() < 1e-6)
    );
}

#[test]
fn slanted_edge_has_its_angle_and_crosses_the_middle() {
    for angle_deg in [5.0f64, -3.0, 12.0] {
        let n = 256;
        let t = SlantedEdge {
            angle_deg,
            dark: 0.0,
            light: 1.0,
        }
        .draw(n)
        .unwrap();
        // The dark length of each row is the edge's place; a line fit over the rows.
        let (mut sum, mut moment, mut weight) = (0.0, 0.0, 0.0);
        for y in 0..n {
            let edge: f64 = (0..n).map(|x| 1.0 - f64::from(t.texel(x, y)[0])).sum();
            let v = y as f64 + 0.5 - 0.5 * n as f64;
            sum += edge;
            moment += v * edge;
            weight += v * v;
        }
        assert!((sum / n as f64 - 0.5 * n as f64).abs() < 1e-3);
        let slope = moment / weight;
        assert!(
            (slope + angle_deg.to_radians().tan()).abs() < 1e-5,
            "{angle_deg}: {slope}"
        );
    }
}

#[test]
fn siemens_star_has_its_spokes_and_a_grey_heart() {
    let spokes = 36;
    let n = 512;
    let t = SiemensStar {
        spokes,
        dark: 0.0,
        light: 1.0,
        ..SiemensStar::default()
    }
    .draw(n)
    .unwrap();
    let m = 1440;
    let mut ring: Vec<Complex64> = (0..m)
        .map(|k| {
            let a = std::f32::consts::TAU * k as f32 / m as f32;
            let v = t.sample_channel(0.5 + 0.3 * a.cos(), 0.5 + 0.3 * a.sin(), 0);
            Complex64::new(v.into(), 0.0)
        })
        .collect();
    FftPlanner::new().plan_fft_forward(m).process(&mut ring);
    let strongest = (1..m / 2)
        .max_by(|&a, &b| ring[a].norm().total_cmp(&ring[b].norm()))
        .unwrap();
    assert_eq!(strongest, spokes as usize);
    // A square wave's fundamental is 1/π a side of the spectrum; bilinear look-up and texels of 1/27 period take 1 %.
    assert!((ring[strongest].norm() / m as f64 * std::f64::consts::PI - 1.0).abs() < 0.02);
    // Nyquist lies at r = spokes / π = 11.5 texels.
    assert!((t.texel(256 + 7, 256)[0] - 0.5).abs() < 1e-6);
}

#[test]
fn noise_has_its_mean_variance_and_spectral_slope() {
    let n = 256;
    for (exponent, cutoff_texels) in [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (0.0, 4.0)] {
        let noise = Noise {
            exponent,
            cutoff_texels,
            mean: 0.5,
            contrast: 0.05,
            color: true,
        };
        let t = noise.draw(11, n).unwrap();
        for c in 0..3 {
            let values: Vec<f64> = (0..n * n)
                .map(|i| t.texel(i % n, i / n)[c].into())
                .collect();
            let mean = values.iter().sum::<f64>() / (n * n) as f64;
            let std =
                (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * n) as f64).sqrt();
            // Five standard errors of 65536 independent values; less for the normalised fields.
            assert!((mean - 0.5).abs() < 5.0 * 0.05 / n as f64, "mean {mean}");
            assert!(
                (std / 0.05 - 1.0).abs() < 5.0 / (2f64.sqrt() * n as f64),
                "std {std}"
            );
            let low = band_power(&values, n, 8.0, 16.0);
            let high = band_power(&values, n, 32.0, 64.0);
            if cutoff_texels == 0.0 {
                // The bands are scaled copies, two octaves apart: a power law's ratio is 4^β. 600 modes at least: 4 %
                // standard error.
                let slope = (low / high).ln() / 4f64.ln();
                assert!((slope - exponent).abs() < 0.15, "β {exponent}: {slope}");
            } else {
                assert!(band_power(&values, n, 66.0, 120.0) < 1e-8 * high);
            }
        }
    }
}

/// Mean power of the 2D frequencies low ≤ |k| < high (cycles per side).
fn band_power(values: &[f64], n: usize, low: f64, high: f64) -> f64 {
    let fft = FftPlanner::new().plan_fft_forward(n);
    let mut field: Vec<Complex64> = values.iter().map(|&v| Complex64::new(v, 0.0)).collect();
    fft.process(&mut field);
    let mut turned: Vec<Complex64> = (0..n * n).map(|i| field[(i % n) * n + i / n]).collect();
    fft.process(&mut turned);
    let signed = |i: usize| {
        if i > n / 2 {
            i as f64 - n as f64
        } else {
            i as f64
        }
    };
    let (sum, count) = (0..n * n)
        .filter(|i| (low..high).contains(&signed(i % n).hypot(signed(i / n))))
        .fold((0.0, 0.0), |(sum, count), i| {
            (sum + turned[i].norm_sqr(), count + 1.0)
        });
    sum / count
}

#[test]
fn dead_leaves_radii_follow_the_inverse_cube() {
    let spec = DeadLeaves::default();
    let leaves = spec.leaves(5);
    let (a, b) = (spec.least_radius, spec.largest_radius);
    for r in [0.003, 0.004, 0.008, 0.02] {
        let below = leaves
            .iter()
            .filter(|leaf| f64::from(leaf.radius) < r)
            .count() as f64;
        let want = (a.powi(-2) - f64::powi(r, -2)) / (a.powi(-2) - b.powi(-2));
        let n = leaves.len() as f64;
        // Five standard errors of a binomial share.
        assert!(
            (below / n - want).abs() < 5.0 * (want * (1.0 - want) / n).sqrt(),
            "{r}"
        );
    }
}

#[test]
fn alphabet_has_ink_in_every_tile() {
    let spec = Alphabet {
        tiles: 3,
        ..Alphabet::default()
    };
    let t = spec.draw(2, 300).unwrap();
    for tile in 0..9 {
        let tones: Vec<f32> = (0..100 * 100)
            .map(|i| t.texel((tile % 3) * 100 + i % 100, (tile / 3) * 100 + i / 100)[1])
            .collect();
        let low = tones.iter().copied().fold(1.0, f32::min);
        let high = tones.iter().copied().fold(0.0, f32::max);
        assert!(high - low > 0.2, "tile {tile}: {low}..{high}");
        // Regular text inks 10 to 30 % of its lines.
        let middle = 0.5 * (low + high);
        let dark = tones.iter().filter(|&&v| v < middle).count() as f64 / 1e4;
        assert!(
            (0.05..0.4).contains(&dark.min(1.0 - dark)),
            "tile {tile}: {dark}"
        );
    }
}
